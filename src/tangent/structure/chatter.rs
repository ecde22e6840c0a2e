//! Derivatives of complete chatter at a stop: time and state just after the impacts of one sequence
//! are smooth functions of the separation velocity u, and so are their derivatives. Both are
//! extrapolated to u = 0 by the same polynomials, as in tangent/chatter.rs.

use super::StructureTangentError;
use super::perturbed::Perturbed;
use super::samples::{Limit, Sample, Samples};
use crate::model::structure::Structure;
use crate::numerics::double_double::DoubleDouble;
use crate::simulate::structure::{StopChatterEvent, StructureEvent};
use crate::simulate::{AnchorOf, Model, Simulation};
use crate::tangent::tolerances::{CONVERGED_SLOPES, MOST_BOUNCES};

impl Perturbed {
    /// From the last impact before chatter to its accumulation point.
    pub(super) fn accumulate(
        &mut self,
        before: &AnchorOf<Structure>,
        event: &StopChatterEvent,
    ) -> Result<(), StructureTangentError> {
        let refused = || StructureTangentError::Chatter(event.stop, event.time);
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

    /// Follows the impacts until the limit is known.
    fn limit_of(
        &mut self,
        before: &AnchorOf<Structure>,
        event: &StopChatterEvent,
    ) -> Option<Limit> {
        let drive = *self.of.drive();
        let after = DoubleDouble::new(Structure::span(&self.of.motion));
        let far = drive.advance(event.clock, after);
        let mut ahead = self.clone();
        let best = self.steppers.hop(&self.of, (before, far), |hopping| ahead.best_limit(hopping));
        self.samples = Samples::default();
        let (mut best, period) = best.filter(|(best, _)| best.error <= CONVERGED_SLOPES)?;
        if let Some(later) = self.of.later(event.clock.period - period) {
            best.delay -= later;
        }
        Some(best)
    }

    /// The limit with the least error, with the drive period of its delay.
    fn best_limit(&mut self, hopping: &mut Simulation<Structure>) -> Option<(Limit, i64)> {
        let mut best: Option<(Limit, i64)> = None;
        for _ in 0..MOST_BOUNCES {
            if let Some(limit) = self.samples.limit(&self.of)
                && best.as_ref().is_none_or(|(best, _)| limit.error < best.error)
            {
                best = Some((limit, self.samples.period()));
            }
            // What comes after the best one has more rounding.
            let noise = self.samples.last().map_or(0.0, Sample::noise);
            if best.as_ref().is_some_and(|(best, _)| noise >= best.error) {
                break;
            }
            match self.advance(hopping) {
                Ok(None | Some(StructureEvent::Impact(_) | StructureEvent::Graze(_))) => {}
                _ => break,
            }
        }
        best
    }
}
