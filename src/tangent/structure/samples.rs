//! What the impacts of a sequence leave behind, with its perturbations, and the limit of those.

use nalgebra::{DMatrix, RowDVector};

use super::rates::Linearised;
use crate::contact::tolerances::CHATTER_SPACING;
use crate::impact::RegimeKind;
use crate::model::state::Clock;
use crate::model::structure::{StructureState, largest_number};
use crate::numerics::EPS;
use crate::numerics::dual::Dual;
use crate::numerics::extrapolation::at_zero;
use crate::tangent::tolerances::MOST_EXTRAPOLATED;

/// Fewest samples of which two orders can be compared. At a small r more are lost in rounding.
const FEWEST: usize = 3;

/// What an impact leaves behind, with its perturbations.
#[derive(Debug, Clone)]
pub(super) struct Sample {
    /// Stop, regime, direction of slip, piece of the restitution curve.
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

/// The last impacts, as far as they may be chatter.
#[derive(Debug, Clone, Default)]
pub(super) struct Samples(Vec<Sample>);

/// The limit of time and state, with their derivatives.
pub(super) struct Limit {
    pub columns: DMatrix<f64>,
    pub delay: RowDVector<f64>,
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
        match self.0.last() {
            Some(last) if last.contact != new.contact || new.separation >= last.separation => {
                self.0.clear();
            }
            Some(last) if new.separation > CHATTER_SPACING * last.separation => return,
            _ => {}
        }
        if self.0.len() == MOST_EXTRAPOLATED {
            self.0.remove(0);
        }
        self.0.push(new);
    }

    pub fn combine(&mut self, by: &DMatrix<f64>) {
        for sample in &mut self.0 {
            sample.change = &sample.change * by;
            sample.delay = &sample.delay * by;
            sample.events = &sample.events * by;
        }
    }

    /// The last one.
    pub fn last(&self) -> Option<&Sample> {
        self.0.last()
    }

    /// Whether it began before rounding spoilt the perturbations.
    pub fn begin_well(&self) -> bool {
        self.0.first().is_some_and(|first| !first.low)
    }

    /// At u = 0, from the first samples, so many that their error is least: further ones bring more
    /// rounding.
    pub fn limit(&self, of: &Linearised) -> Option<Limit> {
        let limits = (FEWEST..=self.0.len()).map(|count| Self::limit_of(&self.0[..count], of));
        limits.min_by(|a, b| a.error.total_cmp(&b.error))
    }

    /// Its delay is that within the drive period of the first one.
    pub fn period(&self) -> i64 {
        self.0.first().map_or(0, |first| first.clock.period)
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
            error: last.noise(),
        };
        let place = |sample: &Sample, i: usize| {
            let StructureState { q, v } = &sample.state;
            if i < q.len() { q[i] } else { v[i - q.len()] }
        };
        for c in 0..columns {
            let number = |value: f64, slope: f64| Dual::<1> { value, slope: [slope] };
            let nodes: Vec<Dual<1>> = newest().map(|s| number(s.separation, s.change[c])).collect();
            let mut extrapolated = |values: Vec<[Dual<1>; 1]>| {
                let [all] = at_zero(&nodes, values.clone());
                let [fewer] = at_zero(&nodes[..count - 1], values);
                let slopes = (all.slope[0] - fewer.slope[0]).abs() / (1.0 + all.slope[0].abs());
                limit.error = limit.error.max((all.value - fewer.value).abs()).max(slopes);
                all.slope[0]
            };
            let times = newest()
                .map(|s| {
                    let later = of.later(s.clock.period - first.clock.period);
                    let slope = s.delay[c] + later.map_or(0.0, |later| later[c]);
                    [number(drive.until(first.clock, s.clock).value(), slope)]
                })
                .collect();
            let delay = extrapolated(times);
            for i in 0..rows {
                // Differences, so that no digit is lost where little changes.
                let from = place(first, i);
                let values =
                    newest().map(|s| [number(place(s, i) - from, s.events[(i, c)])]).collect();
                limit.columns[(i, c)] = extrapolated(values);
            }
            limit.delay[c] = delay;
        }
        limit
    }
}
