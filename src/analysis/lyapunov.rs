//! Lyapunov exponents: the mean rates at which small perturbations of a motion grow, from the exact
//! derivatives of its flights, impacts, chatter and contact phases (docs/theory.md, section 7),
//! with the perturbations kept orthonormal (Benettin et al. 1980; Shimada & Nagashima 1979).
//!
//! There are four, those of the state at fixed time. The phase of the drive is a fifth coordinate
//! with the exponent 0, which is left out; without a drive one of the four is that of the flow. A
//! wall that rests (mbar = 0) is left out with its two.

mod directions;
mod orbit;
mod perturbed;
mod record;

pub(crate) use self::orbit::{PerturbedMotion, exponent_of_orbit, largest_multiplier};
pub(crate) use self::record::GrowthRecord;
pub(super) use self::record::standard_error;
use self::record::{Recorded, Step, end_of_step};
use crate::analysis::tolerances::{
    ALIGNING_STEPS, MOST_CONTRACTION, MOST_CONTRACTION_STEPS, SHORTEST_MEASURED,
};
use crate::analysis::workers::{Workers, side_by_side};
use crate::model::error::{ParameterError, SimulationError};
use crate::model::parameters::System;
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::{Event, StopReason};
use crate::simulate::run::Run;
use crate::simulate::{Horizon, Job, Simulation, run_batch};

/// Points of the history, at most.
pub(super) const HISTORY: usize = 200;
/// Periods, or other steps, of which each is recorded by itself, at most; of more, several together.
const MOST_RECORDED: u32 = 2 * HISTORY as u32;

/// Why a spectrum is not what was asked for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LyapunovError {
    /// The computation of the motion failed.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The motion ends.
    #[error("the motion ends: {}", .0.name())]
    Stopped(StopReason),
    /// A leg has no derivatives that could be computed.
    #[error("a leg of the motion has no derivatives that could be computed")]
    NoDerivative,
}

/// Lyapunov exponents of a motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// Per unit time, descending. -inf where perturbations vanish at once (stick, chatter,
    /// contact); NaN for the two of a wall at rest, and where nothing could be measured.
    pub exponents: [f64; 4],
    /// Their standard errors, from the means of ten blocks; 0 for -inf.
    pub errors: [f64; 4],
    /// Time they are measured over.
    pub time: f64,
    /// Impacts in that time; those left out in complete chatter are not counted.
    pub impacts: u64,
    /// Times since the measurement began,
    pub history_time: Vec<f64>,
    /// and the exponents up to them.
    pub history: Vec<[f64; 4]>,
    /// Why it was not measured over all that was asked for, if it was not.
    pub error: Option<LyapunovError>,
}

/// The spectrum of the motion that goes on from the end of `run`, over so many steps of one drive
/// period, or of a time `step` under a constant load. `cancel` ends
/// the measurement with what is done.
///
/// # Errors
/// [`ParameterError`] without steps or their length, or with steps too short to move the time; what
/// happens later is in the spectrum.
pub fn lyapunov_spectrum(
    run: &Run,
    steps: u32,
    step: Option<f64>,
    cancel: &CancelToken,
) -> Result<Spectrum, ParameterError> {
    exponents::<4>(run, steps, step, cancel)
}

/// The largest exponent alone, from one perturbation: as [`lyapunov_spectrum`], in less time. The
/// other three are NaN.
///
/// # Errors
/// As [`lyapunov_spectrum`].
pub fn largest_lyapunov_exponent(
    run: &Run,
    steps: u32,
    step: Option<f64>,
    cancel: &CancelToken,
) -> Result<Spectrum, ParameterError> {
    exponents::<1>(run, steps, step, cancel)
}

/// The largest exponents of several motions, as [`largest_lyapunov_exponent`] gives them one by one:
/// many at once, in the lanes of the vector registers and on all threads of `workers`. Those of motions
/// that `cancel` keeps from being measured at all are `None`.
///
/// # Errors
/// As [`lyapunov_spectrum`], before anything is measured.
pub fn largest_lyapunov_exponents(
    runs: &[Run],
    steps: u32,
    step: Option<f64>,
    workers: &Workers,
    cancel: &CancelToken,
) -> Result<Vec<Option<Spectrum>>, ParameterError> {
    for run in runs {
        steps_of(run, steps, step)?;
    }
    Ok(workers.install(|| {
        side_by_side(runs.len(), &|next, done, in_hand| {
            let mut next = || {
                let place = next().filter(|_| !cancel.is_cancelled())?;
                let measured = Measurement::<1>::new(&runs[place], steps, step, cancel).ok()?;
                Some((place, measured))
            };
            let mut measured =
                |(place, measured): (usize, Measurement<1>)| done(place, measured.spectrum());
            run_batch(&mut next, &mut measured, in_hand);
        })
    }))
}

fn exponents<const N: usize>(
    run: &Run,
    steps: u32,
    step: Option<f64>,
    cancel: &CancelToken,
) -> Result<Spectrum, ParameterError> {
    let mut measurement = Measurement::<N>::new(run, steps, step, cancel)?;
    while measurement.record.error.is_none()
        && let Some(event) = measurement.simulation.advance(&mut ())
    {
        measurement.record(event);
    }
    Ok(measurement.spectrum())
}

/// Kind of the steps of a measurement, if it can be made.
fn steps_of(run: &Run, steps: u32, step: Option<f64>) -> Result<Step, ParameterError> {
    if steps == 0 {
        return Err(ParameterError::new("steps", steps, "a whole number >= 1"));
    }
    let driven = run.system.drive_frequency() > 0.0;
    if step.is_none_or(|step| !(step.is_finite() && step >= SHORTEST_MEASURED)) && !driven {
        let allowed = format!("a finite number >= {SHORTEST_MEASURED:e}");
        return Err(ParameterError::new("step", format!("{step:?}"), allowed));
    }
    let step = step.filter(|_| !driven);
    let time = run.final_state.time;
    if let Some(step) = step.filter(|step| time + step <= time) {
        let allowed = format!("a time that changes that of the end, {time:?}");
        return Err(ParameterError::new("step", format!("{step:?}"), allowed));
    }
    Ok(step.map_or(Step::Periods(1), Step::Time))
}

/// A motion that is followed, with the growth of its perturbations.
struct Measurement<const N: usize> {
    simulation: Simulation,
    record: GrowthRecord<N>,
    /// Nothing looks at its sections.
    watch: (),
}

impl<const N: usize> Measurement<N> {
    /// Of the motion that goes on from the end of `run`, over so many steps.
    fn new(
        run: &Run,
        steps: u32,
        step: Option<f64>,
        cancel: &CancelToken,
    ) -> Result<Self, ParameterError> {
        let (step, end) = (steps_of(run, steps, step)?, run.final_state.clock);
        let aligning = steps / ALIGNING_STEPS;
        let length = match step {
            Step::Periods(each) => f64::from(each) * run.system.drive_period(),
            Step::Time(each) => each,
        };
        // Where damping is strong, no more than can be flown in steps.
        let contraction = length * run.system.fastest_decay();
        let most = (MOST_CONTRACTION * MOST_CONTRACTION_STEPS / contraction).max(1.0);
        #[allow(clippy::cast_sign_loss)] // at least 1
        let each = f64::from(steps / MOST_RECORDED).clamp(1.0, most) as u32;
        let recorded = Recorded { step, each, aligning, all: steps };
        let mut record = GrowthRecord::<N>::new(run, recorded);
        record.align = Some(recorded.counts().0 as usize);
        let last = end_of_step(record.perturbations.drive(), end, step, steps);
        let whole = matches!(step, Step::Periods(_)) && last.time_in_period == 0.0;
        let horizon = if whole {
            Horizon::Periods(last.period)
        } else {
            Horizon::Time(record.perturbations.drive().time(last))
        };
        let mut simulation = run.resumed().cancel_with(cancel);
        simulation.extend_to(horizon);
        Ok(Self { simulation, record, watch: () })
    }

    /// Takes the next event of the motion.
    fn record(&mut self, event: Result<Event, SimulationError>) {
        match event {
            Ok(event) => self.record.take(&event, &self.simulation),
            Err(error) => {
                self.record.error.get_or_insert(error.into());
            }
        }
    }

    fn spectrum(&self) -> Spectrum {
        self.record.spectrum()
    }
}

impl Job for Measurement<1> {
    type Model = System;
    type Watch = ();
    type Beside = GrowthRecord<1>;

    fn parts(&mut self) -> (&mut Simulation, &mut ()) {
        (&mut self.simulation, &mut self.watch)
    }

    fn take(&mut self, event: Result<Event, SimulationError>) {
        self.record(event);
    }

    #[inline(always)]
    #[allow(clippy::inline_always)] // a round is compiled for several instruction sets
    fn companion(&mut self) -> Option<(&mut GrowthRecord<1>, &Simulation)> {
        Some((&mut self.record, &self.simulation))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::parameters::{Contact, ImpactLaw, System, SystemBuilder};
    use crate::model::state::State;
    use crate::simulate::run::{RunOptions, run};

    fn machine(frequency: f64) -> SystemBuilder {
        System::builder()
            .mass_ratio(0.6)
            .frequency_ratio(2.0)
            .restitution(0.8)
            .gap(0.5)
            .drive_frequency(frequency)
            .moment_amplitude(1.0)
    }

    /// The end of 100 drive periods from the same start.
    fn end(builder: SystemBuilder) -> Run {
        let start = State { x1: 0.0, v1: 0.5, x2: 0.0, v2: 0.0 };
        run(&builder.build().unwrap(), start, RunOptions::periods(100), &CancelToken::never())
            .unwrap()
    }

    #[test]
    fn lanes_measure_what_a_single_perturbation_does() {
        let mut runs = Vec::new();
        for i in 0..6 {
            let frequency = 1.1 + 0.31 * f64::from(i);
            for (damping, friction) in [(0.0, 0.0), (0.02, 0.0), (0.0, 0.2), (0.3, 0.6)] {
                let damped = |builder: SystemBuilder| {
                    builder.pendulum_damping(damping).oscillator_damping(damping)
                };
                let oblique = damped(machine(frequency)).friction(friction);
                runs.push(end(oblique.clone()));
                runs.push(end(oblique.clone().law(ImpactLaw::Newton).force_amplitude(0.5)));
                runs.push(end(oblique.restitution(0.0)));
                let direct = damped(machine(frequency)).contact(Contact::Direct);
                runs.push(end(direct.clone()));
                runs.push(end(direct.mass_ratio(0.0)));
                if i > 0 {
                    continue;
                }
                // Chatter, complete or not, and sustained contact.
                let bouncing = damped(machine(0.3 * frequency)).force_amplitude(1.5);
                runs.push(end(bouncing.clone().restitution(0.3).friction(friction)));
                runs.push(end(bouncing.restitution(0.7)));
            }
        }
        let never = CancelToken::never();
        for (threads, periods) in [(1, 300), (2, 1_000)] {
            let workers = Workers::new(Some(threads)).unwrap();
            let found = largest_lyapunov_exponents(&runs, periods, None, &workers, &never).unwrap();
            let mut impacts = 0;
            for (run, found) in runs.iter().zip(found) {
                let single = largest_lyapunov_exponent(run, periods, None, &never).unwrap();
                // With their bits, NaN included.
                assert_eq!(format!("{:?}", found.unwrap()), format!("{single:?}"));
                impacts += single.impacts;
            }
            assert!(impacts > 10_000, "{impacts}");
        }
    }
}
