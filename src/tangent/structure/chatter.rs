//! Derivatives of complete chatter at a stop: time and state just after the impacts of one sequence
//! are smooth functions of the separation velocity u, and so are their derivatives. Both are
//! extrapolated to u = 0 by the same polynomials, as in tangent/chatter.rs.

use super::StructureTangentError;
use super::perturbed::Perturbed;
use super::samples::{Limit, Sample, Samples};
use crate::model::structure::Structure;
use crate::numerics::double_double::DoubleDouble;
use crate::simulate::structure::{StopChatterEvent, StructureEvent};
use crate::simulate::{AnchorOf, Model};
use crate::tangent::tolerances::{CONVERGED_SLOPES, MOST_BOUNCES, SAME_SLOPES};

impl Perturbed {
    /// From the last impact before chatter to its accumulation point.
    pub(super) fn accumulate(
        &mut self,
        before: &AnchorOf<Structure>,
        event: &StopChatterEvent,
    ) -> Result<(), StructureTangentError> {
        let largest = self.columns.amax();
        let refused = || StructureTangentError::Chatter(event.stop, event.time, largest);
        if self.samples.begin_well() {
            self.low = None;
        }
        let limit = self.limit_of(before, event).ok_or_else(refused)?;
        self.columns = limit.columns;
        self.clock = event.clock;
        self.of.land_on(event.stop, event.clock, &mut self.columns, &limit.delay);
        self.delay = Some(limit.delay);
        Ok(())
    }

    /// The limit, from the impacts so far, and from those that follow as far as they are needed.
    fn limit_of(
        &mut self,
        before: &AnchorOf<Structure>,
        event: &StopChatterEvent,
    ) -> Option<Limit> {
        let mut best = None;
        if !self.is_known(&mut best) {
            let after = DoubleDouble::new(Structure::span(&self.of.motion));
            let far = self.of.drive().advance(event.clock, after);
            let mut ahead = self.clone();
            self.steppers.hop(&self.of, (before, far), |hopping| {
                for _ in 0..MOST_BOUNCES {
                    match ahead.advance(hopping) {
                        Ok(None | Some(StructureEvent::Impact(_) | StructureEvent::Graze(_))) => {}
                        _ => break,
                    }
                    if ahead.is_known(&mut best) {
                        break;
                    }
                }
            });
        }
        self.samples = Samples::default();
        let mut best = best.filter(|best| best.error <= CONVERGED_SLOPES)?;
        if let Some(later) = self.of.later(event.clock.period - best.period) {
            best.delay -= later;
        }
        Some(best)
    }

    /// Whether the limit is known as well as it can be, or as is needed; the best so far.
    fn is_known(&mut self, best: &mut Option<Limit>) -> bool {
        if let Some(limit) = self.samples.limit(&self.of)
            && best.as_ref().is_none_or(|best| limit.error < best.error)
        {
            *best = Some(limit);
        }
        // What comes after the best one has more rounding.
        let noise = self.samples.last().map_or(0.0, Sample::noise);
        best.as_ref().is_some_and(|best| best.error <= noise.max(SAME_SLOPES))
    }
}
