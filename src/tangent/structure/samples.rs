//! What the impacts of a sequence leave behind, with its perturbations, and what becomes of those.

use nalgebra::{DMatrix, RowDVector};

use crate::contact::tolerances::CHATTER_SPACING;
use crate::model::state::Clock;
use crate::model::structure::{StructureState, largest_number};
use crate::numerics::EPS;
use crate::tangent::tolerances::{MOST_CLOSED, SAME_SLOPES};

/// What an impact leaves behind, with its perturbations.
#[derive(Debug, Clone)]
pub(super) struct Sample {
    pub stop: usize,
    /// u before; -u after it, and the change of that.
    pub approach: f64,
    pub separation: f64,
    pub change: RowDVector<f64>,
    pub clock: Clock,
    pub delay: RowDVector<f64>,
    pub state: StructureState,
    pub events: DMatrix<f64>,
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

    /// A newer one, which is better, with their difference for its error.
    fn checks(&self, newer: Self) -> Self {
        let off = newer.columns.iter().zip(self.columns.iter());
        let off = off.map(|(x, other)| (x - other).abs() / (1.0 + x.abs())).fold(0.0, f64::max);
        Self { error: newer.error.min(off), ..newer }
    }
}

impl Sample {
    /// Bound of the error if the bounces after it close the contact at once. What they do is left out to
    /// second order in the time that they last, as part of a local flight, which has a derivative; and
    /// the delay has the rounding of the gap over the velocity at which it is met.
    fn bound(&self, part: f64) -> f64 {
        let StructureState { q, v } = &self.state;
        let size = largest_number(q).max(largest_number(v)).max(1.0);
        let changes = if part > 0.0 { self.change.amax() / self.separation } else { 0.0 };
        size * (EPS / self.approach).max(part * part * (1.0 + changes))
    }
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

    /// What becomes of the one with which the error is least, if the bounces after it close the contact
    /// at once: the difference from what becomes of the one before, or its bound. Of those that have
    /// not been told. `closed` says that, and how long the bounces last, as part of a local flight.
    pub fn limit(
        &mut self,
        closed: impl Fn(&Sample) -> Option<(DMatrix<f64>, f64)>,
    ) -> Option<Limit> {
        let first = self.told.saturating_sub(1);
        self.told = self.all.len();
        let (mut best, mut newer) = (None, None);
        for sample in self.all[first..].iter().rev() {
            let (columns, part) = closed(sample)?;
            let this = Limit { columns, error: sample.bound(part) };
            if let Some(newer) = newer.take() {
                best = Some(Limit::better(best, this.checks(newer)));
                if best.as_ref().is_some_and(|best| best.error <= SAME_SLOPES) {
                    return best;
                }
            }
            newer = Some(this);
        }
        match newer {
            Some(oldest) => Some(Limit::better(best, oldest)),
            None => best,
        }
    }
}
