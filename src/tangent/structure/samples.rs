//! What the impacts of a sequence leave behind, with its perturbations, and what becomes of those.

use nalgebra::{DMatrix, DVector, RowDVector};
use smallvec::SmallVec;

use crate::contact::tolerances::CHATTER_SPACING;
use crate::impact::RegimeKind;
use crate::model::state::Clock;
use crate::model::structure::{StructureState, largest_number};
use crate::numerics::EPS;
use crate::numerics::dual::Dual;
use crate::numerics::extrapolation::level_weights;
use crate::tangent::tolerances::{MOST_CLOSED, MOST_EXTRAPOLATED, SAME_SLOPES};

/// What an impact leaves behind, with its perturbations.
#[derive(Debug, Clone)]
pub(super) struct Sample {
    pub stop: usize,
    pub formula: Formula,
    /// u before; -u after it, and the change of that.
    pub approach: f64,
    pub separation: f64,
    pub change: RowDVector<f64>,
    pub clock: Clock,
    pub delay: RowDVector<f64>,
    pub state: StructureState,
    pub events: DMatrix<f64>,
    /// What becomes of it, once that has been asked.
    pub closed: Option<Closed>,
}

/// What impacts are alike in: regime, direction of slip, and piece of the restitution curve. Only with one
/// formula for each is what they leave behind a smooth function of u.
pub(super) type Formula = (RegimeKind, bool, usize);

/// The state, with its perturbations, at a fixed time in the leg that begins where the bounces end, if
/// contact begins at once after an impact.
#[derive(Debug, Clone)]
pub(super) struct Closed {
    pub state: DVector<f64>,
    pub columns: DMatrix<f64>,
    /// How long the bounces last, as part of a local flight.
    pub part: f64,
}

/// Impacts at one stop that may belong to one chatter, in their order, with u at most
/// [`CHATTER_SPACING`] times that of the one before.
#[derive(Debug, Clone, Default)]
pub(super) struct Samples {
    all: Vec<Sample>,
    /// What becomes of so many of the first ones has been told.
    told: usize,
    /// Low bounces have been before the first one.
    low: bool,
}

/// Perturbations where the bounces end, at a fixed time in the leg that begins there.
pub(super) struct Limit {
    pub columns: DMatrix<f64>,
    pub error: f64,
}

impl Limit {
    /// The one with the smaller error.
    pub fn better(one: Option<Self>, other: Self) -> Self {
        match one {
            Some(one) if one.error <= other.error => one,
            _ => other,
        }
    }

    /// This one, with its difference from that of one sample less for its error.
    fn checked_by(self, fewer: Option<&DMatrix<f64>>) -> Self {
        let Some(fewer) = fewer else { return self };
        let off = self.columns.iter().zip(fewer.iter());
        let off = off.map(|(x, other)| (x - other).abs() / (1.0 + x.abs()));
        // Not a number where the last u are below counting.
        let off = off
            .fold(0.0, |most: f64, off| if off.is_nan() { f64::INFINITY } else { most.max(off) });
        let error = if off.is_finite() { self.error.min(off) } else { off };
        Self { error, ..self }
    }

    /// Whether it is known as well as is needed.
    pub fn is_known(&self) -> bool {
        self.error <= SAME_SLOPES
    }
}

impl Sample {
    /// Its numbers are no larger.
    fn size(&self) -> f64 {
        let StructureState { q, v } = &self.state;
        largest_number(q).max(largest_number(v)).max(1.0)
    }

    /// Rounding of its delay: that of the gap over the velocity at which it is met.
    fn noise(&self) -> f64 {
        self.size() * EPS / self.approach
    }

    /// Bound of the error if the bounces after it close the contact at once. What they do is left out to
    /// second order in the time that they last, as part of a local flight, which has a derivative.
    fn bound(&self, part: f64) -> f64 {
        let changes = if part > 0.0 { self.change.amax() / self.separation } else { 0.0 };
        self.noise().max(self.size() * part * part * (1.0 + changes))
    }
}

/// Some of them, with what becomes of each, the newest first.
type Newest<'a> = SmallVec<[(&'a Sample, &'a Closed); MOST_EXTRAPOLATED]>;

/// What becomes of some samples at u = 0.
fn extrapolated(newest: &Newest) -> DMatrix<f64> {
    let (last, rest) = (newest[0].1, &newest[1..]);
    let mut columns = last.columns.clone();
    for c in 0..columns.ncols() {
        let mut nodes = [Dual::<1> { value: 0.0, slope: [0.0] }; MOST_EXTRAPOLATED];
        for (node, (sample, _)) in nodes.iter_mut().zip(newest) {
            *node = Dual { value: sample.separation, slope: [sample.change[c]] };
        }
        let weights: [_; MOST_EXTRAPOLATED] = level_weights(&nodes[..newest.len()]);
        for (weight, (_, closed)) in weights[1..].iter().zip(rest) {
            let values = closed.state.iter().zip(&last.state);
            let slopes = closed.columns.column(c).into_iter().zip(last.columns.column(c));
            let sums = columns.column_mut(c).into_iter();
            for ((sum, (y, nearest)), (dy, d_nearest)) in sums.zip(values).zip(slopes) {
                *sum += weight.value * (dy - d_nearest) + weight.slope[0] * (y - nearest);
            }
        }
    }
    columns
}

impl Samples {
    /// Takes an impact: at another stop, or harder than the last one, it begins anew.
    pub fn take(&mut self, new: Sample, low: bool) {
        match self.all.last() {
            Some(last) if last.stop == new.stop && new.separation < last.separation => {
                if new.separation > CHATTER_SPACING * last.separation {
                    return;
                }
            }
            _ => *self = Self { low, ..Self::default() },
        }
        if self.all.len() >= MOST_CLOSED {
            self.all.remove(0);
            self.told = self.told.saturating_sub(1);
        }
        self.all.push(new);
    }

    pub fn combine(&mut self, by: &DMatrix<f64>) {
        self.told = 0;
        for sample in &mut self.all {
            sample.change = &sample.change * by;
            sample.delay = &sample.delay * by;
            sample.events = &sample.events * by;
            sample.closed = None;
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

    /// Whether it began before the bounces were low.
    pub fn begin_well(&self) -> bool {
        !self.low && !self.all.is_empty()
    }

    /// What becomes of them where u = 0, from so many of them with which the error is least: the difference
    /// from what one less says, or its bound. The newest of them is the last one that has no more rounding
    /// than is asked for, or one after it; of those that have not been told.
    pub fn limit(&mut self, closed: impl Fn(&Sample) -> Closed) -> Option<Limit> {
        let clear = self.all.iter().rposition(|sample| sample.noise() <= SAME_SLOPES);
        let first_end = clear.map_or(0, |last| last + 1).max(self.told + 1);
        self.told = self.all.len();
        let mut best: Option<Limit> = None;
        for end in first_end..=self.all.len() {
            if let Some(limit) = self.limit_before(end, &closed) {
                best = Some(Limit::better(best, limit));
            }
            if best.as_ref().is_some_and(Limit::is_known) {
                break;
            }
        }
        best
    }

    /// The same from those just before this one.
    fn limit_before(&mut self, end: usize, closed: impl Fn(&Sample) -> Closed) -> Option<Limit> {
        let Sample { formula, .. } = self.all[end - 1];
        // If slip reverses in each, what is left of it falls by another factor than u, and nothing is
        // extrapolated.
        let reverses = formula.0.reverses();
        let most = if reverses { 2 } else { MOST_EXTRAPOLATED };
        let (mut best, mut fewer): (_, Option<DMatrix<f64>>) = (None, None);
        for first in (end.saturating_sub(most)..end).rev() {
            let sample = &mut self.all[first];
            if sample.formula != formula {
                break;
            }
            sample.closed = Some(sample.closed.take().unwrap_or_else(|| closed(sample)));
            let of = self.all[first..end].iter().rev();
            let of: Newest = of.filter_map(|s| Some((s, s.closed.as_ref()?))).collect();
            let (last, its) = *of.first()?;
            let (columns, other) = if reverses {
                (its.columns.clone(), of.get(1).map(|(_, older)| older.columns.clone()))
            } else {
                (extrapolated(&of), fewer)
            };
            fewer = Some(columns.clone());
            let limit = Limit { columns, error: last.bound(its.part) }.checked_by(other.as_ref());
            let known = limit.is_known();
            best = Some(Limit::better(best, limit));
            if known {
                break;
            }
        }
        best
    }
}
