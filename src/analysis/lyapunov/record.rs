//! Growth of the perturbations of a motion, step by step, with its errors.

use super::perturbed::{PerturbationLanes, Perturbations};
use super::{HISTORY, LyapunovError, Spectrum};
use crate::analysis::period::Growth;
use crate::analysis::tolerances::{ALIGNING_STEPS, ERROR_BLOCKS, GROWTH_STEP, STATED_BLOCKS};
use crate::flight::Drive;
use crate::model::state::Clock;
use crate::model::tip::Tip;
use crate::simulate::event::Event;
use crate::simulate::run::Run;
use crate::simulate::{Companion, ImpactLanes, Simulation};

/// Length of a step.
#[derive(Clone, Copy)]
pub(super) enum Step {
    /// So many drive periods.
    Periods(u32),
    /// This time.
    Time(f64),
}

/// The steps of a record: of the steps asked for some align the perturbations, and so many together
/// are one of the record, in either part.
#[derive(Clone, Copy)]
pub(super) struct Recorded {
    pub step: Step,
    pub each: u32,
    pub aligning: u32,
    pub all: u32,
}

impl Recorded {
    /// Those that only align, and all.
    pub fn counts(&self) -> (u32, u32) {
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
    pub(super) perturbations: Perturbations<N>,
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
    pub(super) align: Option<usize>,
    /// Why there are no more steps.
    pub(super) error: Option<LyapunovError>,
}

impl<const N: usize> GrowthRecord<N> {
    pub(super) fn new(run: &Run, steps: Recorded) -> Self {
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
    pub(super) fn spectrum(&self) -> Spectrum {
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

pub(super) fn end_of_step(drive: &Drive, from: Clock, step: Step, k: u32) -> Clock {
    match step {
        Step::Periods(each) => {
            Clock { period: from.period + i64::from(k) * i64::from(each), ..from }
        }
        Step::Time(each) => drive.clock_at(drive.time(from) + f64::from(k) * each),
    }
}

/// One perturbation goes beside its motion.
#[allow(clippy::inline_always)] // a round is compiled for several instruction sets
impl Companion for GrowthRecord<1> {
    type Lanes = PerturbationLanes;

    #[inline(always)]
    fn look(lanes: &mut PerturbationLanes, impacts: &ImpactLanes) {
        lanes.look(impacts);
    }

    #[inline(always)]
    fn passes(&mut self, j: usize, lanes: &mut PerturbationLanes, simulation: &Simulation) -> bool {
        let clock = simulation.present_flight().clock;
        let passes = lanes.is_usual(j)
            && clock <= simulation.horizon_clock()
            && (clock < self.next || (!lanes.is_low(j) && self.end_steps(j, lanes, clock)));
        if passes {
            lanes.pass(j, clock);
        }
        passes
    }

    #[inline(always)]
    fn compute<G: Tip>(lanes: &mut PerturbationLanes, impacts: &ImpactLanes) {
        lanes.map::<G>(impacts);
    }

    fn enter(&mut self, j: usize, lanes: &mut PerturbationLanes) {
        if self.error.is_none() {
            self.perturbations.enter(j, lanes);
        }
    }

    fn go_on(&mut self, j: usize, lanes: &mut PerturbationLanes, simulation: &Simulation) {
        lanes.go_on(j, simulation.present_flight().clock);
    }

    fn leave(&mut self, j: usize, lanes: &mut PerturbationLanes) {
        self.perturbations.leave(j, lanes);
    }
}

impl GrowthRecord<1> {
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
pub(in crate::analysis) fn standard_error(values: &[f64], blocks: usize) -> f64 {
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
