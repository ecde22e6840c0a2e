//! What changes of a leg without an impact make of perturbations: stops that close, open, or begin or end to
//! slip.

use super::StructureTangentError;
use super::impact::along;
use super::perturbed::Perturbed;
use crate::model::structure::Structure;
use crate::simulate::structure::{StopStart, StructureMode};
use crate::simulate::{AnchorOf, Model, Phase};
use crate::tangent::tolerances::STILL_FLIGHT;

impl Perturbed {
    /// A leg has changed without an impact.
    pub(super) fn change(
        &mut self,
        before: &AnchorOf<Structure>,
        after: &AnchorOf<Structure>,
    ) -> Result<(), StructureTangentError> {
        match before.phase {
            Phase::Contact(mode) => {
                self.fly(before, after.clock)?;
                self.settle(before);
                if self.slip_ends(mode, before, after) {
                    self.stop_slip(before, after);
                } else {
                    // The force has fallen to 0, or to the limit of friction: no rate jumps.
                    self.reduce(self.of.motion.dimension(before));
                }
                Ok(())
            }
            Phase::Flight(_) => {
                let time = self.of.drive().until(self.clock, after.clock).value();
                if time > STILL_FLIGHT * Structure::span(&self.of.motion) {
                    let time = self.of.drive().time(after.clock);
                    return Err(StructureTangentError::Landing(time));
                }
                self.land_all(after);
                Ok(())
            }
            Phase::Landing => {
                self.land_all(after);
                Ok(())
            }
            Phase::Strike => Ok(()),
        }
    }

    fn slip_ends(
        &self,
        mode: StructureMode,
        before: &AnchorOf<Structure>,
        after: &AnchorOf<Structure>,
    ) -> bool {
        let slid = matches!(mode, StructureMode::SlidePositive | StructureMode::SlideNegative);
        let rubs = |stop: &u32| self.of.structure.rubs(*stop);
        let stays = |stop: &u32| after.touching.of(*stop) == Some(StopStart::Closed);
        slid && after.phase != before.phase
            && before.touching.closed().iter().any(|stop| rubs(stop) && stays(stop))
    }

    /// t . q' = 0 at a closed stop.
    fn stop_slip(&mut self, before: &AnchorOf<Structure>, after: &AnchorOf<Structure>) {
        let structure = &self.of.structure;
        let count = structure.coordinates();
        let closed = before.touching.closed();
        let Some(stop) = closed.into_iter().find(|&stop| structure.rubs(stop)) else { return };
        let tangent = structure.stops()[stop as usize].tangent().unwrap_or(&[]);
        let rates = self.steppers.rates(&self.of, before, (after.clock, &after.state));
        let change: f64 = tangent.iter().zip(rates.iter().skip(count)).map(|(t, a)| t * a).sum();
        let delay = along(tangent, &self.columns, count) * (-1.0 / change);
        self.delayed(&rates, delay);
    }
}
