//! Lyapunov exponents: the mean rates at which small perturbations of a motion grow, from the exact
//! derivatives of its flights, impacts, chatter and contact phases (docs/theory.md, section 7),
//! with the perturbations kept orthonormal (Benettin et al. 1980; Shimada & Nagashima 1979).
//!
//! There are four, those of the state at fixed time. The phase of the drive is a fifth coordinate
//! with the exponent 0, which is left out; without a drive one of the four is that of the flow. A
//! wall that rests (mbar = 0) is left out with its two.

mod directions;
mod perturbed;

use nalgebra::Matrix4;

pub(crate) use self::perturbed::PerturbationLanes;
use self::perturbed::Perturbations;
use crate::analysis::period::Growth;

use crate::analysis::tolerances::{
    ALIGNING_STEPS, ERROR_BLOCKS, GROWTH_STEP, MOST_CONTRACTION, MOST_CONTRACTION_STEPS,
    SHORTEST_MEASURED, STATED_BLOCKS,
};
use crate::analysis::workers::{Workers, side_by_side};
use crate::flight::Drive;
use crate::model::error::{ParameterError, SimulationError};
use crate::model::state::{Clock, State};
use crate::model::tip::Tip;
use crate::numerics::cancel::CancelToken;
use crate::numerics::double_double::DoubleDouble;
use crate::simulate::event::{Event, StopReason};
use crate::simulate::run::Run;
use crate::simulate::{Horizon, ImpactLanes, Job, Simulation, run_batch};

/// Points of the history, at most.
const HISTORY: usize = 200;
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
    /// Time they are measured over,
    pub time: f64,
    /// and the impacts in it; those left out in complete chatter are not counted.
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
    type Watch = ();
    type Beside = PerturbationLanes;

    fn parts(&mut self) -> (&mut Simulation, &mut ()) {
        (&mut self.simulation, &mut self.watch)
    }

    fn take(&mut self, event: Result<Event, SimulationError>) {
        self.record(event);
    }

    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn compute_beside<G: Tip>(beside: &mut PerturbationLanes, impacts: &ImpactLanes) {
        beside.map::<G>(impacts);
    }

    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn passes(&mut self, j: usize, beside: &mut PerturbationLanes) -> bool {
        self.record.passes(j, beside, &self.simulation)
    }

    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn accept_beside(beside: &mut PerturbationLanes) {
        beside.accept();
    }

    fn enter(&mut self, j: usize, beside: &mut PerturbationLanes) {
        self.record.enter(j, beside);
    }

    fn go_on(&mut self, j: usize, beside: &mut PerturbationLanes) {
        beside.go_on(j, self.simulation.present_flight().clock);
    }

    fn leave(&mut self, j: usize, beside: &mut PerturbationLanes) {
        self.record.leave(j, beside);
    }
}

/// Length of a step.
#[derive(Clone, Copy)]
enum Step {
    /// So many drive periods.
    Periods(u32),
    /// This time.
    Time(f64),
}

/// The steps of a record: of the steps asked for some align the perturbations, and so many together
/// are one of the record, in either part.
#[derive(Clone, Copy)]
struct Recorded {
    step: Step,
    each: u32,
    aligning: u32,
    all: u32,
}

impl Recorded {
    /// Those that only align, and all.
    fn counts(&self) -> (u32, u32) {
        let aligning = self.aligning.div_ceil(self.each);
        (aligning, aligning + (self.all - self.aligning).div_ceil(self.each))
    }

    /// End of the k-th.
    fn end(&self, drive: &Drive, from: Clock, k: u32) -> Clock {
        let (aligning, _) = self.counts();
        let done = match k.checked_sub(aligning) {
            None | Some(0) => k.saturating_mul(self.each).min(self.aligning),
            Some(more) => {
                self.aligning.saturating_add(more.saturating_mul(self.each)).min(self.all)
            }
        };
        end_of_step(drive, from, self.step, done)
    }
}

/// Growth of the perturbations of a motion, step by step. Who follows the motion hands over its
/// events.
pub(crate) struct GrowthRecord<const N: usize> {
    perturbations: Perturbations<N>,
    /// End of the run, where the record begins.
    from: Clock,
    steps: Recorded,
    /// End of the step that runs.
    next: Clock,
    /// ln of the growth in each direction up to the end of the last step.
    grown: [f64; N],
    /// End, length, logarithmic growth in each direction and impacts so far of each step.
    ends: Vec<Clock>,
    lengths: Vec<f64>,
    logs: Vec<[f64; N]>,
    impacts: Vec<u64>,
    /// Steps that align the perturbations; a part of those done if `None`.
    align: Option<usize>,
    /// Why there are no more steps.
    error: Option<LyapunovError>,
}

impl<const N: usize> GrowthRecord<N> {
    fn new(run: &Run, steps: Recorded) -> Self {
        let (from, skips) = (run.final_state.clock, run.skips_at_end());
        let perturbations = Perturbations::new(&run.system, &run.final_state, skips, true);
        let next = steps.end(perturbations.drive(), from, 1);
        let stopped = !run.stop_reason.reached_the_end();
        Self {
            perturbations,
            from,
            steps,
            next,
            grown: [0.0; N],
            ends: Vec::new(),
            lengths: Vec::new(),
            logs: Vec::new(),
            impacts: Vec::new(),
            align: None,
            error: stopped.then_some(LyapunovError::Stopped(run.stop_reason)),
        }
    }

    /// Takes the next event of the motion from its simulation.
    pub fn take(&mut self, event: &Event, simulation: &Simulation) {
        if self.error.is_none()
            && let Err(error) = self.try_to_take(event, simulation)
        {
            self.error = Some(error);
        }
    }

    fn try_to_take(&mut self, event: &Event, simulation: &Simulation) -> Result<(), LyapunovError> {
        let (clock, stop) = (event.clock(), matches!(event, Event::Stop(_)));
        if let Event::Stop(stop) = event
            && !stop.reason.reached_the_end()
        {
            return Err(LyapunovError::Stopped(stop.reason));
        }
        let chatters = simulation.skips_at(event) || matches!(event, Event::Chatter(_));
        loop {
            let ends = clock >= self.next;
            if !chatters {
                self.perturbations.approach(if ends { self.next } else { clock })?;
            }
            // Where there are no states, the step ends at the first instant after.
            let cut = clock > self.perturbations.clock()
                && !chatters
                && !self.perturbations.has_no_states();
            if self.is_complete() || !(ends && (cut || stop)) {
                break;
            }
            self.end_step(cut)?;
        }
        if stop { Ok(()) } else { self.perturbations.take(event, simulation.present_flight()) }
    }

    /// Whether all steps have been recorded.
    fn is_complete(&self) -> bool {
        self.ends.len() as u32 >= self.steps.counts().1
    }

    /// Ends a step where it is to end, or at the last event.
    fn end_step(&mut self, cut: bool) -> Result<(), LyapunovError> {
        let last = self.perturbations.clock();
        let end = if cut && self.next > last { self.next } else { last };
        let grown = self.perturbations.logs_at(end)?;
        let before = std::mem::replace(&mut self.grown, grown);
        let drive = self.perturbations.drive();
        let from = self.ends.last().copied().unwrap_or(self.from);
        self.lengths.push(drive.until(from, end).value());
        self.ends.push(end);
        // A direction that was lost and replaced counts anew.
        let since = |i: usize| if before[i].is_finite() { before[i] } else { 0.0 };
        self.logs.push(std::array::from_fn(|i| grown[i] - since(i)));
        self.impacts.push(self.perturbations.impacts());
        let done = self.ends.len();
        self.next = self.steps.end(drive, self.from, done as u32 + 1);
        if N == 1 && self.perturbations.rank() == 0 {
            self.perturbations.restart();
        } else if self.align == Some(done) {
            // Directions lost while the perturbations were aligned are replaced.
            self.perturbations.restore_directions();
        }
        Ok(())
    }

    /// Steps that only align.
    fn aligned(&self) -> usize {
        let part = self.logs.len() / ALIGNING_STEPS as usize;
        self.align.filter(|&align| align < self.logs.len()).unwrap_or(part)
    }
}

impl<const N: usize> GrowthRecord<N> {
    fn spectrum(&self) -> Spectrum {
        let (all, aligned) = (self.logs.len(), self.aligned());
        let (lengths, logs) = (&self.lengths[aligned..], &self.logs[aligned..]);
        let directions = self.perturbations.directions().min(N);
        let mut passed = Vec::with_capacity(lengths.len());
        let mut sums = Vec::with_capacity(lengths.len());
        let (mut time, mut sum) = (0.0, [0.0; 4]);
        for (length, log) in lengths.iter().zip(logs) {
            time += length;
            sum.iter_mut().zip(log).for_each(|(sum, log)| *sum += log);
            passed.push(time);
            sums.push(sum);
        }
        let rates = |sum: [f64; 4], time: f64| {
            std::array::from_fn(|i| if i < directions { sum[i] / time } else { f64::NAN })
        };
        let exponents: [f64; 4] = rates(sum, time);
        // Descending, NaN last.
        let mut order = [0, 1, 2, 3];
        order.sort_by(|&i, &j| {
            let key =
                |i: usize| if exponents[i].is_nan() { f64::NEG_INFINITY } else { exponents[i] };
            key(j).total_cmp(&key(i)).then(i.cmp(&j))
        });
        let sorted = |values: [f64; 4]| order.map(|i| values[i]);
        let errors = std::array::from_fn(|i| {
            if i >= directions {
                return f64::NAN;
            }
            let growth: Vec<f64> = logs.iter().map(|log| log[i]).collect();
            standard_error(&growth, ERROR_BLOCKS) * logs.len() as f64 / time
        });
        let stride = logs.len().div_ceil(HISTORY).max(1);
        let shown = || (stride..=logs.len()).step_by(stride).map(|k| k - 1);
        let impacts = |k: usize| k.checked_sub(1).map_or(0, |k| self.impacts[k]);
        Spectrum {
            exponents: sorted(exponents),
            errors: sorted(errors),
            time,
            impacts: impacts(all) - impacts(aligned),
            history_time: shown().map(|k| passed[k]).collect(),
            history: shown().map(|k| sorted(rates(sums[k], passed[k]))).collect(),
            error: self.error.clone(),
        }
    }
}

fn end_of_step(drive: &Drive, from: Clock, step: Step, k: u32) -> Clock {
    match step {
        Step::Periods(each) => {
            Clock { period: from.period + i64::from(k) * i64::from(each), ..from }
        }
        Step::Time(each) => drive.clock_at(drive.time(from) + f64::from(k) * each),
    }
}

impl GrowthRecord<1> {
    /// The perturbation is in lane `j` from the impact that was taken last,
    pub fn enter(&mut self, j: usize, lanes: &mut PerturbationLanes) {
        if self.error.is_none() {
            self.perturbations.enter(j, lanes);
        }
    }

    /// until here.
    pub fn leave(&mut self, j: usize, lanes: &mut PerturbationLanes) {
        self.perturbations.leave(j, lanes);
    }

    /// Whether lane `j` has all of the impact from which the present flight of the simulation
    /// begins.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub fn passes(
        &mut self,
        j: usize,
        lanes: &mut PerturbationLanes,
        simulation: &Simulation,
    ) -> bool {
        let clock = simulation.present_flight().clock;
        let passes = lanes.is_usual(j)
            && clock <= simulation.horizon_clock()
            && (clock < self.next || (!lanes.is_low(j) && self.end_steps(j, lanes, clock)));
        if passes {
            lanes.pass(j, clock);
        }
        passes
    }

    /// Ends the steps that end before an impact at this instant; whether they could be.
    #[inline(never)]
    fn end_steps(&mut self, j: usize, lanes: &mut PerturbationLanes, clock: Clock) -> bool {
        self.perturbations.read(j, lanes);
        while clock >= self.next && !self.is_complete() {
            if clock <= self.perturbations.clock() || self.end_step(true).is_err() {
                return false;
            }
        }
        true
    }

    /// Of one perturbation of the motion that goes on from the end of `run`.
    pub fn of_one(run: &Run) -> Self {
        let step = Step::Periods(GROWTH_STEP);
        Self::new(run, Recorded { step, each: 1, aligning: 0, all: u32::MAX })
    }

    /// Mean growth per drive period of a record of one perturbation; `None` where it cannot be
    /// measured.
    pub fn growth(&self) -> Option<Growth> {
        if self.error.is_some() {
            return None;
        }
        // A perturbation that is lost at once (by stick) counts as reduced to the rounding of a
        // double.
        let least = f64::EPSILON.ln();
        let logs: Vec<f64> =
            self.logs[self.aligned()..].iter().map(|log| log[0].max(least)).collect();
        let stride = f64::from(GROWTH_STEP);
        Some(Growth {
            mean: logs.iter().sum::<f64>() / (stride * logs.len() as f64),
            error: stated_error(&logs) / stride,
            periods: self.logs.len() * GROWTH_STEP as usize,
            of_ten: standard_error(&logs, ERROR_BLOCKS) / stride,
        })
    }
}

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

/// Standard error of the mean growth that is measured for a label: the largest of those from the
/// means of twenty, ten, five and three blocks, each with Student's factor. A motion sticks to what
/// is regular for a while; neither how long nor how often is known from a short series, and ten
/// blocks alone have too small an error. NaN for too few values.
fn stated_error(values: &[f64]) -> f64 {
    if values.len() < ERROR_BLOCKS {
        return f64::NAN;
    }
    let errors = STATED_BLOCKS.map(|(blocks, factor)| factor * standard_error(values, blocks));
    errors.into_iter().fold(0.0, f64::max)
}

/// Standard error of the mean of a series, neighbours of which may depend on each other, from the
/// means of so many blocks. NaN for too few values; 0 where all are -inf.
fn standard_error(values: &[f64], blocks: usize) -> f64 {
    if values.contains(&f64::NEG_INFINITY) {
        return 0.0;
    }
    let length = values.len() / blocks;
    if length == 0 {
        return f64::NAN;
    }
    let means = values.rchunks_exact(length).take(blocks);
    let means: Vec<f64> = means.map(|block| block.iter().sum::<f64>() / length as f64).collect();
    let count = blocks as f64;
    let mean = means.iter().sum::<f64>() / count;
    let squares = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>();
    (squares / (count - 1.0) / count).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::tolerances::EXPONENT_PERIODS;
    use crate::model::parameters::{Contact, ImpactLaw, System, SystemBuilder};
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

    /// How often the mean 0 lies within two stated errors of that of `values` steps, which keep their
    /// value for `memory` steps in the mean.
    fn within_two_errors(values: usize, memory: f64) -> f64 {
        const SERIES: u32 = 4_000;
        let mut seed = 1u64;
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963);
            (seed >> 11) as f64 / (1u64 << 53) as f64
        };
        let within = (0..SERIES).filter(|_| {
            let mut value = uniform() - 0.5;
            let series: Vec<f64> = (0..values)
                .map(|_| {
                    if uniform() * memory < 1.0 {
                        value = uniform() - 0.5;
                    }
                    value
                })
                .collect();
            let mean = series.iter().sum::<f64>() / values as f64;
            mean.abs() < 2.0 * stated_error(&series)
        });
        within.count() as f64 / f64::from(SERIES)
    }

    #[test]
    fn two_stated_errors_hold_the_mean_also_of_motions_that_stick() {
        let values = (EXPONENT_PERIODS / GROWTH_STEP) as usize;
        for memory in [1.0, 2.0, 4.0] {
            let within = within_two_errors(values, memory);
            assert!(within > 0.93, "{within} with a memory of {memory} steps");
        }
    }
}
