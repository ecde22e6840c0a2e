//! Derivatives of a motion by where it started, and the exponents of the periodic motions on which runs
//! have settled.

use nalgebra::Matrix4;

use super::LyapunovError;
use super::perturbed::Perturbations;
use super::record::{Step, end_of_step};
use crate::flight::Drive;
use crate::model::state::{Clock, State};
use crate::numerics::cancel::CancelToken;
use crate::numerics::double_double::DoubleDouble;
use crate::simulate::event::{Event, StopReason};
use crate::simulate::run::Run;
use crate::simulate::{Horizon, Simulation};

/// A motion that is followed from instant to instant, with the derivatives by where it started.
pub(crate) struct PerturbedMotion {
    simulation: Simulation,
    perturbations: Perturbations<4>,
    /// The event after the present instant.
    pending: Option<Event>,
}

impl PerturbedMotion {
    /// The motion that goes on from the end of `run`, up to a horizon.
    pub fn new(run: &Run, horizon: Horizon, cancel: &CancelToken) -> Self {
        let mut simulation = run.resumed().cancel_with(cancel);
        simulation.extend_to(horizon);
        let perturbations =
            Perturbations::new(&run.system, &run.final_state, run.skips_at_end(), false);
        Self { simulation, perturbations, pending: None }
    }

    /// Goes on to an instant at which the motion has a state.
    ///
    /// # Errors
    /// [`LyapunovError`], also where impacts are skipped at this instant.
    pub fn advance_to(&mut self, end: Clock) -> Result<(), LyapunovError> {
        loop {
            let event = match self.pending.take() {
                Some(event) => event,
                None => match self.simulation.advance(&mut ()) {
                    Some(event) => event?,
                    None => return Err(LyapunovError::Stopped(StopReason::Completed)),
                },
            };
            let (clock, skips) = (event.clock(), self.simulation.skips_at(&event));
            if let Event::Stop(stop) = event
                && !stop.reason.reached_the_end()
            {
                return Err(LyapunovError::Stopped(stop.reason));
            }
            let stops = matches!(event, Event::Stop(_));
            let chatters = skips || matches!(event, Event::Chatter(_));
            let ends = clock >= end && (clock > self.perturbations.clock() || stops);
            if !chatters {
                self.perturbations.approach(if ends { end } else { clock })?;
            }
            if ends {
                if chatters || self.perturbations.has_no_states() {
                    return Err(LyapunovError::NoDerivative);
                }
                self.pending = Some(event);
                return self.perturbations.carry_to(end);
            }
            self.perturbations.take(&event, self.simulation.present_flight())?;
        }
    }

    /// Counts derivatives from the present instant on.
    pub fn restart(&mut self) {
        self.perturbations.restart();
    }

    /// The present state.
    pub fn state(&self) -> State {
        self.perturbations.state()
    }

    /// Impacts since the start, those of complete chatter left out.
    pub fn impacts(&self) -> u64 {
        self.perturbations.impacts()
    }

    /// Derivatives of the present state (x1, x1', x2', x2) by the one at the last restart.
    pub fn derivatives(&self) -> Matrix4<f64> {
        let columns = self.perturbations.columns();
        Matrix4::from_fn(|r, c| columns[r][c])
    }
}

/// Largest exponent of the periodic motion of `m` drive periods on which `run` has settled, from
/// its Floquet multipliers: ln max|lambda|/(m T), -inf where all are 0; and by how much it changes
/// from one orbit to the next, as it does while the run still settles. `None` where derivatives
/// cannot be computed, or the orbit cannot be cut at the end of the run, which lies among skipped
/// impacts.
pub(crate) fn exponent_of_orbit(run: &Run, m: usize, cancel: &CancelToken) -> Option<[f64; 2]> {
    let m = Step::Periods(u32::try_from(m).ok()?);
    let drive = Drive::of(&run.system);
    let end = run.final_state.clock;
    // Rounding may put an impact at the end of the run before or after it: a quarter period on, it
    // is on one side.
    let begin = if run.strikes_at(end.time_in_period) {
        drive.advance(end, DoubleDouble::new(0.25 * run.system.drive_period()))
    } else {
        end
    };
    let horizon = Horizon::Periods(end_of_step(&drive, begin, m, 2).period + 1);
    let mut motion = PerturbedMotion::new(run, horizon, cancel);
    if begin != end {
        motion.advance_to(begin).ok()?;
    }
    let mut from = begin;
    let mut exponent_of_next = |turn: u32| {
        let close = end_of_step(&drive, begin, m, turn);
        motion.restart();
        motion.advance_to(close).ok()?;
        let length = drive.until(std::mem::replace(&mut from, close), close).value();
        Some(largest_multiplier(&motion.derivatives()).ln() / length)
    };
    let (first, second) = (exponent_of_next(1)?, exponent_of_next(2)?);
    Some([second, if first == second { 0.0 } else { (second - first).abs() }])
}

/// max|lambda| of the derivative of a return map.
pub(crate) fn largest_multiplier(derivative: &Matrix4<f64>) -> f64 {
    let multipliers = derivative.complex_eigenvalues();
    multipliers.iter().map(|lambda| lambda.norm()).fold(0.0, f64::max)
}
