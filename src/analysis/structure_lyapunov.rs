//! Lyapunov exponents of the motions of structures, as lyapunov.rs gives those of the pendulum: all
//! 2N of the state at fixed time, or the largest few, from the exact derivative along the motion,
//! with the perturbations kept orthonormal.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::lyapunov::{HISTORY, standard_error};
use crate::analysis::period::CHATTERING;
use crate::analysis::tolerances::{
    ALIGNING_STEPS, ERROR_BLOCKS, LOST_LENGTH, MOST_CONTRACTION, MOST_CONTRACTION_STEPS,
    SHORTEST_MEASURED,
};
use crate::model::error::{ParameterError, StateError};
use crate::model::structure::{Structure, StructureState};
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::StopReason;
use crate::simulate::structure::StructureEvent;
use crate::simulate::{Horizon, Simulation};
use crate::tangent::structure::{Linearised, Perturbed, StructureTangentError};

/// Why nothing is measured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StructureLyapunovError {
    /// An argument is refused.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The start is refused.
    #[error(transparent)]
    State(#[from] StateError),
}

/// Lyapunov exponents of a motion of a structure.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureSpectrum {
    /// Per unit time, descending: as many as were asked for. -inf where perturbations vanish at
    /// once (stick, chatter, contact, plastic impacts); NaN where nothing could be measured.
    pub exponents: Vec<f64>,
    /// Their standard errors, from the means of ten blocks; 0 for -inf.
    pub errors: Vec<f64>,
    /// Time they are measured over, after a tenth of the steps that only aligns the perturbations,
    pub time: f64,
    /// and the impacts in it at each stop; those left out in complete chatter are not counted.
    pub impacts: Vec<u64>,
    /// Times since this measurement began, at most 200,
    pub history_time: Vec<f64>,
    /// and the exponents up to each of them, in the order of the final ones.
    pub history: Vec<Vec<f64>>,
    /// Why it was not measured over all that was asked for, if it was not.
    pub error: Option<StructureTangentError>,
}

/// The largest `count` exponents of the motion from `initial`, over so many drive periods; under a
/// constant load over so many steps of this length. Who wants those of what a motion settles on
/// starts there. `cancel` ends the measurement with what is done.
///
/// # Errors
/// [`StructureLyapunovError`] for a start or numbers that are refused; what happens later is in the
/// spectrum.
///
/// # Example
/// Without impacts perturbations decay with the damping of the modes:
/// ```
/// use vibroimpact::{CancelToken, Stop, Structure, StructureState, structure_lyapunov};
///
/// let structure = Structure::builder(vec![vec![1.0]], vec![vec![4.0]])
///     .damping(vec![vec![0.2]])
///     .drive(vec![1.0.into()], 1.5, 0.0)
///     .stop(Stop::new([1.0], 5.0, 0.8))
///     .build()?;
/// let start = StructureState::new(&[0.0], &[0.0]);
/// let found = structure_lyapunov(&structure, start, 100, 2, None, &CancelToken::never())?;
/// assert!((found.exponents[0] + 0.1).abs() < 0.01);
/// assert!((found.exponents.iter().sum::<f64>() + 0.2).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn structure_lyapunov(
    structure: &Structure,
    initial: StructureState,
    periods: u32,
    count: usize,
    step: Option<f64>,
    cancel: &CancelToken,
) -> Result<StructureSpectrum, StructureLyapunovError> {
    if periods == 0 {
        return Err(ParameterError::new("periods", periods, "a whole number >= 1").into());
    }
    let mut measurement = Measurement::new(structure, initial, count, step, cancel)?;
    measurement.extend_to(periods);
    Ok(measurement.spectrum())
}

/// Where a step ends.
struct End {
    time: f64,
    /// ln of the growth of each direction since the start.
    grown: Vec<f64>,
    impacts: Vec<u64>,
}

/// A motion that is followed with its perturbations, for as long as it is extended.
pub(crate) struct Measurement {
    simulation: Simulation<Structure>,
    perturbed: Perturbed,
    grown: Vec<f64>,
    impacts: Vec<u64>,
    /// Length of a step, which is taken in so many parts.
    length: f64,
    parts: u32,
    /// Steps that were asked for, those so far, and where those end that have a state at their end.
    asked: u32,
    done: u32,
    ends: Vec<End>,
    /// The sections at the ends of the drive periods, if they are kept.
    sections: Option<Sections>,
    /// Why there are no more of them.
    error: Option<StructureTangentError>,
}

/// States at the ends of drive periods, and the impacts in the period that ends at each, with those
/// since the last one.
#[derive(Default)]
pub(crate) struct Sections {
    pub states: Vec<StructureState>,
    pub counts: Vec<u32>,
}

impl Sections {
    fn count(&mut self, change: impl FnOnce(u32) -> u32) {
        self.counts.resize(self.states.len() + 1, 0);
        if let Some(count) = self.counts.last_mut() {
            *count = change(*count);
        }
    }

    fn take(&mut self, event: &StructureEvent) {
        match event {
            StructureEvent::Impact(_) => self.count(|count| count.saturating_add(1)),
            StructureEvent::Chatter(_) => self.count(|_| CHATTERING),
            _ => {}
        }
    }

    fn end(&mut self, state: StructureState) {
        self.count(|count| count);
        self.states.push(state);
    }
}

impl Measurement {
    /// Of the largest `count` exponents of the motion from `initial`, in steps of a drive period, or
    /// of this length under a constant load.
    pub fn new(
        structure: &Structure,
        initial: StructureState,
        count: usize,
        step: Option<f64>,
        cancel: &CancelToken,
    ) -> Result<Self, StructureLyapunovError> {
        let all = 2 * structure.coordinates();
        if !(1..=all).contains(&count) {
            let allowed = format!("a whole number from 1 to {all}");
            return Err(ParameterError::new("count", count, allowed).into());
        }
        let driven = structure.drive_frequency() > 0.0;
        let step = step.filter(|step| step.is_finite() && *step >= SHORTEST_MEASURED);
        if !driven && step.is_none() {
            let allowed = format!("a finite number >= {SHORTEST_MEASURED:e}");
            return Err(ParameterError::new("step", format!("{step:?}"), allowed).into());
        }
        let simulation = Simulation::new(structure, initial)?.cancel_with(cancel);
        let length = match step.filter(|_| !driven) {
            Some(step) => step,
            None => simulation.drive().period.hi,
        };
        let fastest = structure.modal_damping().rounded().norm();
        let parts = (length * fastest / MOST_CONTRACTION).ceil().clamp(1.0, MOST_CONTRACTION_STEPS);
        #[allow(clippy::cast_sign_loss)] // at least 1
        let parts = parts as u32;
        let start = simulation.checkpoint().anchor.clock;
        let directions = some_directions(all, count);
        let mut measurement = Self {
            simulation,
            perturbed: Perturbed::new(Arc::new(Linearised::new(structure)), start, directions),
            grown: vec![0.0; count],
            impacts: vec![0; structure.stops().len()],
            length,
            parts,
            asked: 0,
            done: 0,
            ends: Vec::new(),
            sections: None,
            error: None,
        };
        measurement.orthonormalise();
        measurement.ends.push(measurement.end());
        Ok(measurement)
    }

    /// Goes on until so many steps after the start: the same, bit by bit, in one turn or in several.
    pub fn extend_to(&mut self, steps: u32) {
        self.asked = steps;
        while self.done < steps && self.error.is_none() {
            match self.take_step() {
                // Where impacts are skipped the step ends with a later one.
                Ok(recorded) => {
                    self.done += 1;
                    if recorded {
                        self.ends.push(self.end());
                    }
                }
                Err(why) => self.error = Some(why),
            }
        }
    }

    /// Keeps the sections from here on, behind these.
    pub fn keeping(self, sections: Sections) -> Self {
        Self { sections: Some(sections), ..self }
    }

    /// Steps so far.
    pub fn followed(&self) -> u32 {
        self.done
    }

    /// The sections so far.
    pub fn sections(&self) -> (&[StructureState], &[u32]) {
        self.sections.as_ref().map_or((&[], &[]), |kept| {
            let counts = &kept.counts[..kept.states.len().min(kept.counts.len())];
            (&kept.states, counts)
        })
    }

    /// Whether the motion could not be followed any further.
    pub fn has_ended(&self) -> bool {
        self.error.is_some()
    }

    /// The next step; whether there is a state at its end.
    fn take_step(&mut self) -> Result<bool, StructureTangentError> {
        let driven = self.perturbed.structure().drive_frequency() > 0.0;
        let mut recorded = true;
        for part in 1..=self.parts {
            let time =
                self.length * (f64::from(self.done) + f64::from(part) / f64::from(self.parts));
            let horizon = if driven && part == self.parts {
                Horizon::Periods(i64::from(self.done) + 1)
            } else {
                Horizon::Time(time)
            };
            recorded = self.advance_to(horizon)?;
        }
        Ok(recorded)
    }

    fn end(&self) -> End {
        let time = self.length * f64::from(self.done);
        End { time, grown: self.grown.clone(), impacts: self.impacts.clone() }
    }

    /// What has been measured, of which the first tenth of the steps only aligns.
    pub fn spectrum(&self) -> StructureSpectrum {
        let aligning = self.asked / ALIGNING_STEPS;
        spectrum(&self.ends, self.grown.len(), aligning, self.length, self.error.clone())
    }

    /// Goes on to a horizon; whether there is a state there, not skipped impacts.
    fn advance_to(&mut self, horizon: Horizon) -> Result<bool, StructureTangentError> {
        self.simulation.extend_to(horizon);
        loop {
            let event = self.perturbed.advance(&mut self.simulation)?;
            if let (Some(event), Some(sections)) = (&event, &mut self.sections) {
                sections.take(event);
            }
            match event {
                Some(StructureEvent::Impact(e)) => self.impacts[e.impact.stop] += 1,
                Some(StructureEvent::Stop(stop)) if stop.reason == StopReason::TimeCap => {
                    return Err(StructureTangentError::Stopped(stop.reason));
                }
                Some(StructureEvent::Stop(stop)) => {
                    if let (Horizon::Periods(_), Some(sections)) = (horizon, &mut self.sections) {
                        sections.end(stop.state);
                    }
                    break;
                }
                _ => {}
            }
        }
        let skips = self.simulation.checkpoint().skips();
        if !skips {
            self.orthonormalise();
        }
        Ok(!skips)
    }

    /// Makes the directions orthonormal again, from the first one on (Gram and Schmidt, twice), and
    /// counts what they have grown by. Lost ones, the last, are left out.
    fn orthonormalise(&mut self) {
        let mut columns = self.perturbed.columns().clone();
        let mut rank = columns.ncols().min(self.perturbed.rank());
        let mut parts = DMatrix::zeros(columns.ncols(), columns.ncols());
        for i in 0..rank {
            let whole = columns.column(i).norm();
            for j in (0..i).chain(0..i) {
                let part = columns.column(i).dot(&columns.column(j));
                let other = columns.column(j) * part;
                let mut column = columns.column_mut(i);
                column -= other;
                parts[(j, i)] += part;
            }
            let length = columns.column(i).norm();
            if length <= LOST_LENGTH * whole || length == 0.0 {
                rank = i;
                break;
            }
            let mut column = columns.column_mut(i);
            column /= length;
            parts[(i, i)] = length;
            self.grown[i] += length.ln();
        }
        self.grown[rank..].fill(f64::NEG_INFINITY);
        let upper = parts.view((0, 0), (rank, rank)).into_owned();
        let mut by = DMatrix::zeros(columns.ncols(), rank);
        if let Some(inverse) = upper.try_inverse() {
            by.view_mut((0, 0), (rank, rank)).copy_from(&inverse);
        }
        self.perturbed.recombine(columns.columns(0, rank).into_owned(), &by);
    }
}

/// Directions none of which is special to a structure: numbers without a pattern, the same in every
/// run.
fn some_directions(rows: usize, columns: usize) -> DMatrix<f64> {
    let mut seed = 1u64;
    DMatrix::from_fn(rows, columns, |_, _| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    })
}

fn spectrum(
    ends: &[End],
    count: usize,
    aligning: u32,
    length: f64,
    error: Option<StructureTangentError>,
) -> StructureSpectrum {
    let aligned = ends.iter().position(|end| end.time >= f64::from(aligning) * length);
    let measured = &ends[aligned.unwrap_or(ends.len() - 1)..];
    let (first, last) = (&measured[0], &measured[measured.len() - 1]);
    let time = last.time - first.time;
    // Up to one of the ends.
    let rate = |end: &End, i: usize| {
        if end.grown[i] == f64::NEG_INFINITY {
            return f64::NEG_INFINITY;
        }
        (end.grown[i] - first.grown[i]) / (end.time - first.time)
    };
    let mut found: Vec<(usize, f64, f64)> = (0..count)
        .map(|i| {
            if time == 0.0 {
                return (i, f64::NAN, f64::NAN);
            }
            if last.grown[i] == f64::NEG_INFINITY {
                return (i, f64::NEG_INFINITY, 0.0);
            }
            let rates: Vec<f64> =
                measured.windows(2).map(|pair| pair[1].grown[i] - pair[0].grown[i]).collect();
            let error = standard_error(&rates, ERROR_BLOCKS) * rates.len() as f64 / time;
            (i, rate(last, i), error)
        })
        .collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    let impacts = last.impacts.iter().zip(&first.impacts).map(|(last, first)| last - first);
    let stride = (measured.len() - 1).div_ceil(HISTORY).max(1);
    let shown = || measured[1..].iter().skip(stride - 1).step_by(stride);
    StructureSpectrum {
        exponents: found.iter().map(|each| each.1).collect(),
        errors: found.iter().map(|each| each.2).collect(),
        time,
        impacts: impacts.collect(),
        history_time: shown().map(|end| end.time - first.time).collect(),
        history: shown().map(|end| found.iter().map(|each| rate(end, each.0)).collect()).collect(),
        error,
    }
}
