//! Lyapunov exponents: the mean rates at which small perturbations of a motion grow, from the exact
//! derivatives of its flights, impacts, chatter and contact phases (docs/theory.md, section 7),
//! with the perturbations kept orthonormal (Benettin et al. 1980; Shimada & Nagashima 1979).
//!
//! There are four, those of the state at fixed time. The phase of the drive is a fifth coordinate
//! with the exponent 0, which is left out; without a drive one of the four is that of the flow. A
//! wall that rests (mbar = 0) is left out with its two.

mod perturbed;

use crate::analysis::period::Growth;
use crate::analysis::tolerances::{ALIGNING_STEPS, ERROR_BLOCKS, SHORTEST_MEASURED};
use crate::flight::Drive;
use crate::model::error::{ParameterError, SimulationError};
use crate::model::state::Clock;
use crate::numerics::cancel::CancelToken;
use crate::numerics::double_double::DoubleDouble;
use crate::simulate::Horizon;
use crate::simulate::event::StopReason;
use crate::simulate::run::Run;

use perturbed::PerturbedMotion;

/// Drive periods of a step in which growth is recorded.
const STRIDE: u32 = 8;
/// Points of the history, at most.
const HISTORY: usize = 200;

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
    /// Their standard errors, from the means of blocks; 0 for -inf.
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
    if steps == 0 {
        return Err(ParameterError::new("steps", steps, "a whole number >= 1"));
    }
    let driven = run.system.drive_frequency() > 0.0;
    if step.is_none_or(|step| !(step.is_finite() && step >= SHORTEST_MEASURED)) && !driven {
        let allowed = format!("a finite number >= {SHORTEST_MEASURED:e}");
        return Err(ParameterError::new("step", format!("{step:?}"), allowed));
    }
    let step = step.filter(|_| !driven);
    let end = run.final_state.time;
    if let Some(step) = step.filter(|step| end + step <= end) {
        let allowed = format!("a time that changes that of the end, {end:?}");
        return Err(ParameterError::new("step", format!("{step:?}"), allowed));
    }
    let step = step.map_or(Step::Periods(1), Step::Time);
    let mut record = GrowthRecord::new(run, step, 4, cancel);
    // Directions lost while the perturbations were aligned are replaced.
    let aligned = steps as usize / ALIGNING_STEPS;
    record.measure_to(aligned as u32);
    record.motion.restore_directions();
    record.align = Some(aligned);
    record.measure_to(steps);
    Ok(record.spectrum())
}

/// Length of a step.
#[derive(Clone, Copy)]
enum Step {
    /// So many drive periods.
    Periods(u32),
    /// This time.
    Time(f64),
}

/// Growth of perturbations, step by step.
struct GrowthRecord {
    motion: PerturbedMotion,
    drive: Drive,
    /// End of the run, where the record begins.
    from: Clock,
    step: Step,
    /// Number of perturbations.
    wanted: usize,
    /// End, length, logarithmic growth in each direction and impacts so far of each step.
    ends: Vec<Clock>,
    lengths: Vec<f64>,
    logs: Vec<[f64; 4]>,
    impacts: Vec<u64>,
    /// Steps that align the perturbations; a part of those done if `None`.
    align: Option<usize>,
    /// Why there are no more steps.
    error: Option<LyapunovError>,
}

impl GrowthRecord {
    fn new(run: &Run, step: Step, wanted: usize, cancel: &CancelToken) -> Self {
        let drive = Drive::of(&run.system);
        let from = run.final_state.clock;
        let stopped = !run.stop_reason.reached_the_end();
        Self {
            motion: PerturbedMotion::new(run, Some(wanted), cancel),
            drive,
            from,
            step,
            wanted,
            ends: Vec::new(),
            lengths: Vec::new(),
            logs: Vec::new(),
            impacts: Vec::new(),
            align: None,
            error: stopped.then_some(LyapunovError::Stopped(run.stop_reason)),
        }
    }

    /// Goes on until so many steps are done.
    fn measure_to(&mut self, count: u32) {
        let done = self.ends.len() as u32;
        // A motion without events reaches its horizon in one step: it must not lie further than
        // wanted.
        let last = end_of_step(&self.drive, self.from, self.step, count);
        let whole = matches!(self.step, Step::Periods(_)) && last.time_in_period == 0.0;
        self.motion.extend(if whole {
            Horizon::Periods(last.period)
        } else {
            Horizon::Time(self.drive.time(last))
        });
        for k in done + 1..=count {
            if self.error.is_some() {
                return;
            }
            let end = end_of_step(&self.drive, self.from, self.step, k);
            if let Err(error) = self.motion.advance_to(end) {
                self.error = Some(error);
                return;
            }
            let before = self.ends.last().copied().unwrap_or(self.from);
            self.ends.push(self.motion.clock());
            self.lengths.push(self.drive.until(before, self.motion.clock()).value());
            self.logs.push(self.motion.take_logs());
            self.impacts.push(self.motion.impacts());
            if self.wanted == 1 && self.motion.rank() == 0 {
                self.motion.restart(1);
            }
        }
    }

    /// Steps that only align.
    fn aligned(&self) -> usize {
        let part = self.logs.len() / ALIGNING_STEPS;
        self.align.filter(|&align| align < self.logs.len()).unwrap_or(part)
    }

    fn spectrum(&self) -> Spectrum {
        let (all, aligned) = (self.logs.len(), self.aligned());
        let (lengths, logs) = (&self.lengths[aligned..], &self.logs[aligned..]);
        let directions = self.motion.directions();
        let mut passed = Vec::with_capacity(lengths.len());
        let mut sums = Vec::with_capacity(lengths.len());
        let (mut time, mut sum) = (0.0, [0.0; 4]);
        for (length, log) in lengths.iter().zip(logs) {
            time += length;
            sum = std::array::from_fn(|i| sum[i] + log[i]);
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
            let growth: Vec<f64> = logs.iter().map(|log| log[i]).collect();
            if i < directions {
                standard_error(&growth) * logs.len() as f64 / time
            } else {
                f64::NAN
            }
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

/// Growth of a perturbation after the end of a run, over more and more drive periods.
pub(crate) struct GrowthEstimator(GrowthRecord);

impl GrowthEstimator {
    pub fn new(run: &Run, cancel: &CancelToken) -> Self {
        Self(GrowthRecord::new(run, Step::Periods(STRIDE), 1, cancel))
    }

    /// The growth over so many periods from the end of the run; `None` where it cannot be measured.
    pub fn over(&mut self, periods: u32) -> Option<Growth> {
        let record = &mut self.0;
        record.measure_to(periods / STRIDE);
        if record.error.is_some() {
            return None;
        }
        // A perturbation that is lost at once (by stick) counts as reduced to the rounding of a
        // double.
        let least = f64::EPSILON.ln();
        let logs: Vec<f64> =
            record.logs[record.aligned()..].iter().map(|log| log[0].max(least)).collect();
        let stride = f64::from(STRIDE);
        Some(Growth {
            mean: logs.iter().sum::<f64>() / (stride * logs.len() as f64),
            error: standard_error(&logs) / stride,
            periods: record.logs.len() * STRIDE as usize,
        })
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
    let mut motion = PerturbedMotion::new(run, None, cancel);
    motion.extend(Horizon::Periods(end_of_step(&drive, begin, m, 2).period + 1));
    if begin != end {
        motion.advance_to(begin).ok()?;
    }
    let mut exponent_of_next = |turn: u32| {
        let from = motion.clock();
        let close = end_of_step(&drive, begin, m, turn);
        motion.restart(4);
        motion.advance_to(close).ok()?;
        let multipliers = motion.vectors().complex_eigenvalues();
        let largest = multipliers.iter().map(|lambda| lambda.norm()).fold(0.0, f64::max);
        (motion.clock() == close).then(|| largest.ln() / drive.until(from, close).value())
    };
    let (first, second) = (exponent_of_next(1)?, exponent_of_next(2)?);
    Some([second, if first == second { 0.0 } else { (second - first).abs() }])
}

/// Standard error of the mean of a series, neighbours of which may depend on each other, from the
/// means of ten blocks: long ones, so that what is bounded (the beat of a torus) hardly counts. NaN
/// for too few values; 0 where all are -inf.
fn standard_error(values: &[f64]) -> f64 {
    if values.contains(&f64::NEG_INFINITY) {
        return 0.0;
    }
    let length = values.len() / ERROR_BLOCKS;
    if length == 0 {
        return f64::NAN;
    }
    let blocks = values.rchunks_exact(length).take(ERROR_BLOCKS);
    let means: Vec<f64> = blocks.map(|block| block.iter().sum::<f64>() / length as f64).collect();
    let count = ERROR_BLOCKS as f64;
    let mean = means.iter().sum::<f64>() / count;
    let squares = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>();
    (squares / (count - 1.0) / count).sqrt()
}
