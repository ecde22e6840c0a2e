//! Derivatives of complete chatter at a stop: time and state just after the impacts of one sequence are
//! smooth functions of the separation velocity u, and so are their derivatives. Both are extrapolated
//! to u = 0 by the same polynomials, as in tangent/chatter.rs.

use nalgebra::{DMatrix, RowDVector};

use super::StructureTangentError;
use super::perturbed::Perturbed;
use crate::contact::tolerances::CHATTER_SPACING;
use crate::flight::Drive;
use crate::impact::RegimeKind;
use crate::model::state::Clock;
use crate::model::structure::{Structure, StructureState};
use crate::numerics::EPS;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::dual::Dual;
use crate::numerics::extrapolation::at_zero;
use crate::simulate::structure::{StopChatterEvent, StructureEvent};
use crate::simulate::{AnchorOf, Model, Simulation};
use crate::tangent::tolerances::{
    CONVERGED_SLOPES, LOWEST_REVERSING, MOST_BOUNCES, MOST_EXTRAPOLATED,
};

/// What an impact leaves behind, with its perturbations.
#[derive(Debug, Clone)]
pub(super) struct Sample {
    /// Stop, regime, direction of slip.
    pub contact: (usize, RegimeKind, bool),
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
struct Limit {
    columns: DMatrix<f64>,
    delay: RowDVector<f64>,
    /// Difference of the last two orders.
    error: f64,
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

    /// At u = 0.
    fn limit(&self, drive: &Drive) -> Option<Limit> {
        let first = self.0.first().filter(|_| self.0.len() >= 4)?;
        let (rows, columns) = first.events.shape();
        let count = self.0.len();
        let newest = || self.0.iter().rev();
        let mut limit = Limit {
            columns: DMatrix::zeros(rows, columns),
            delay: RowDVector::zeros(columns),
            error: 0.0,
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
                .map(|s| [number(drive.until(first.clock, s.clock).value(), s.delay[c])])
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
        Some(limit)
    }
}

impl Perturbed {
    /// From the last impact before chatter to its accumulation point.
    pub(super) fn accumulate(
        &mut self,
        before: &AnchorOf<Structure>,
        event: &StopChatterEvent,
    ) -> Result<(), StructureTangentError> {
        let refused = || StructureTangentError::Chatter(event.stop, event.time);
        if self.samples.0.first().is_some_and(|first| !first.low) {
            self.low = None;
        }
        let limit = self.limit_of(before, event).ok_or_else(refused)?;
        self.columns = limit.columns;
        self.clock = event.clock;
        self.of.land_on(event.stop, event.clock, &mut self.columns, &limit.delay);
        self.delay = Some(limit.delay);
        Ok(())
    }

    /// Follows the impacts until the limit is known.
    fn limit_of(
        &mut self,
        before: &AnchorOf<Structure>,
        event: &StopChatterEvent,
    ) -> Option<Limit> {
        let drive = *self.of.drive();
        let after = DoubleDouble::new(Structure::span(&self.of.motion));
        let far = drive.advance(event.clock, after);
        let mut hopping = Simulation::hopping(&self.of.structure, before.clone(), far);
        let mut ahead = self.clone();
        let mut best: Option<Limit> = None;
        for _ in 0..MOST_BOUNCES {
            if let Some(limit) = ahead.samples.limit(&drive)
                && best.as_ref().is_none_or(|best| limit.error < best.error)
            {
                best = Some(limit);
            }
            let low = ahead.samples.0.last().map_or(f64::INFINITY, |last| last.separation);
            let done = best.as_ref().is_some_and(|best| best.error <= EPS);
            if done || low <= LOWEST_REVERSING * LOWEST_REVERSING {
                break;
            }
            match ahead.advance(&mut hopping) {
                Ok(None | Some(StructureEvent::Impact(_) | StructureEvent::Graze(_))) => {}
                _ => break,
            }
        }
        self.samples = Samples::default();
        best.filter(|best| best.error <= CONVERGED_SLOPES)
    }
}
