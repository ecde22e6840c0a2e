//! What the impacts of a sequence leave behind, with its perturbations, and the limit of those.

use nalgebra::{DMatrix, RowDVector};
use smallvec::SmallVec;

use super::rates::Linearised;
use crate::contact::tolerances::CHATTER_SPACING;
use crate::impact::RegimeKind;
use crate::model::state::Clock;
use crate::model::structure::{StructureState, largest_number};
use crate::numerics::EPS;
use crate::numerics::extrapolation::Weights;
use crate::tangent::tolerances::{MOST_EXTRAPOLATED, MOST_ROUNDING, SAME_SLOPES};

/// Fewest samples of which two orders can be compared. At a small r more are lost in rounding.
const FEWEST: usize = 3;

/// What an impact leaves behind, with its perturbations.
#[derive(Debug, Clone)]
pub(super) struct Sample {
    /// Stop, regime, direction of slip before, piece of the restitution curve.
    pub contact: (usize, RegimeKind, bool, usize),
    /// -u, and its change.
    pub separation: f64,
    pub change: RowDVector<f64>,
    pub clock: Clock,
    pub delay: RowDVector<f64>,
    pub state: StructureState,
    pub events: DMatrix<f64>,
    /// Rounding has spoilt the perturbations before.
    pub low: bool,
}

/// Impacts that may belong to one chatter, in their order, with u at most [`CHATTER_SPACING`] times
/// that of the one before: as many as the extrapolation takes, and more where rounding spoils the last.
#[derive(Debug, Clone, Default)]
pub(super) struct Samples {
    all: Vec<Sample>,
    /// Limits of so many of the first ones have been told.
    told: usize,
}

/// The limit of time and state, with their derivatives.
pub(super) struct Limit {
    pub columns: DMatrix<f64>,
    /// Within this drive period.
    pub delay: RowDVector<f64>,
    pub period: i64,
    /// Difference of the last two orders, with the rounding of the last sample.
    pub error: f64,
}

impl Sample {
    /// Rounding of its perturbations, relative to their size.
    pub fn noise(&self) -> f64 {
        let StructureState { q, v } = &self.state;
        EPS * largest_number(q).max(largest_number(v)).max(1.0) / self.separation
    }
}

impl Samples {
    /// Takes an impact: of other contact, or harder than the last one, it begins anew.
    pub fn take(&mut self, new: Sample) {
        match self.all.last() {
            Some(last) if last.contact != new.contact || new.separation >= last.separation => {
                self.all.clear();
                self.told = 0;
            }
            Some(last) if new.separation > CHATTER_SPACING * last.separation => return,
            _ => {}
        }
        // More than the extrapolation takes are kept only beside one that is mostly rounding, as a
        // slow chatter has many: the limit from the earlier ones may be better.
        if self.all.len() >= MOST_EXTRAPOLATED && new.noise() <= MOST_ROUNDING {
            self.all.remove(0);
            self.told = 0;
        }
        self.all.push(new);
    }

    pub fn combine(&mut self, by: &DMatrix<f64>) {
        self.told = 0;
        for sample in &mut self.all {
            sample.change = &sample.change * by;
            sample.delay = &sample.delay * by;
            sample.events = &sample.events * by;
        }
    }

    /// So many drive periods later.
    pub fn later_by(&mut self, periods: i64) {
        for sample in &mut self.all {
            sample.clock.period += periods;
        }
    }

    /// Whether no two impacts may belong to one chatter.
    pub fn are_few(&self) -> bool {
        self.all.len() <= 1
    }

    /// The last one.
    pub fn last(&self) -> Option<&Sample> {
        self.all.last()
    }

    /// Whether it began before rounding spoilt the perturbations.
    pub fn begin_well(&self) -> bool {
        self.all.first().is_some_and(|first| !first.low)
    }

    /// At u = 0, from some samples in a row, up to that one with which the error is least: further ones
    /// bring more rounding. Of those numbers of samples whose limit has not been told.
    pub fn limit(&mut self, of: &Linearised) -> Option<Limit> {
        let counts = FEWEST.max(self.told + 1)..=self.all.len();
        self.told = self.all.len();
        let mut best: Option<Limit> = None;
        for count in counts.rev() {
            let first = count.saturating_sub(MOST_EXTRAPOLATED);
            let limit = Self::limit_of(&self.all[first..count], of);
            if best.as_ref().is_none_or(|best| limit.error.total_cmp(&best.error).is_lt()) {
                best = Some(limit);
            }
            if best.as_ref().is_some_and(|best| best.error <= SAME_SLOPES) {
                break;
            }
        }
        best
    }

    fn limit_of(samples: &[Sample], of: &Linearised) -> Limit {
        let drive = of.drive();
        let (first, last) = (&samples[0], &samples[samples.len() - 1]);
        let (rows, columns) = first.events.shape();
        let count = samples.len();
        let newest = || samples.iter().rev();
        let mut limit = Limit {
            columns: DMatrix::zeros(rows, columns),
            delay: RowDVector::zeros(columns),
            period: first.clock.period,
            error: last.noise(),
        };
        let place = |sample: &Sample, i: usize| {
            let StructureState { q, v } = &sample.state;
            if i < q.len() { q[i] } else { v[i - q.len()] }
        };
        let nodes: Numbers = newest().map(|s| s.separation).collect();
        let all = Weights::at_zero(&nodes);
        let fewer = Weights::at_zero(&nodes[..count - 1]);
        for c in 0..columns {
            let changes: Numbers = newest().map(|s| s.change[c]).collect();
            let all_change = all.change(&nodes, &changes);
            let fewer_change = fewer.change(&nodes, &changes);
            let mut extrapolated = |values: &Numbers, slopes: &Numbers| {
                let (value, slope) = all.sum(&all_change, values, slopes);
                let (other, other_slope) = fewer.sum(&fewer_change, values, slopes);
                let slopes = (slope - other_slope).abs() / (1.0 + slope.abs());
                limit.error = limit.error.max((value - other).abs()).max(slopes);
                slope
            };
            let times = newest().map(|s| drive.until(first.clock, s.clock).value()).collect();
            let delays = newest()
                .map(|s| {
                    let later = of.later(s.clock.period - first.clock.period);
                    s.delay[c] + later.map_or(0.0, |later| later[c])
                })
                .collect();
            let delay = extrapolated(&times, &delays);
            for i in 0..rows {
                // Differences, so that no digit is lost where little changes.
                let from = place(first, i);
                let values = newest().map(|s| place(s, i) - from).collect();
                let slopes = newest().map(|s| s.events[(i, c)]).collect();
                limit.columns[(i, c)] = extrapolated(&values, &slopes);
            }
            limit.delay[c] = delay;
        }
        limit
    }
}

/// A number of each sample.
type Numbers = SmallVec<[f64; MOST_EXTRAPOLATED]>;
