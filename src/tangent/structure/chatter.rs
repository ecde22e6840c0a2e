//! Derivatives where the bounces at a stop end, in complete chatter or lost in rounding.
//!
//! All bounces after an impact that leaves u take away u and what loads add to it while they last, T =
//! O(u), and so do an impulse that closes the contact there and the forces which hold it for this time.
//! They have the same paths, so the sums of impulses are the same, and states later on differ by O(u T).
//! So the derivatives of the motion that is closed at once, which has no bounces any more, are those of
//! the limit but for O(u), times the derivative of u: the lower the impact, the nearer. In such a motion the
//! rounding of an instant of impact, EPS/u, moves nothing but this instant. What the impacts of one formula
//! become in it is a smooth function of u without a slope at u = 0, and is extrapolated to there as in
//! tangent/chatter.rs: so few impacts are enough, at a small r those that there are.

use std::sync::Arc;

use nalgebra::RowDVector;
use smallvec::smallvec;

use super::StructureTangentError;
use super::equation::Held;
use super::forced::Steppers;
use super::perturbed::Perturbed;
use super::rates::Linearised;
use super::samples::{Closed, Limit, Sample, Samples};
use crate::model::structure::Structure;
use crate::numerics::double_double::DoubleDouble;
use crate::simulate::structure::{
    StopChatterEvent, StopStart, StructureEvent, StructureMode, Touching,
};
use crate::simulate::{Anchor, AnchorOf, Model, Phase};
use crate::tangent::tolerances::{CONVERGED_SLOPES, MOST_BOUNCES, STILL_FLIGHT};

/// Where bounces end, and the leg that begins there.
struct Rest {
    of: Arc<Linearised>,
    steppers: Arc<Steppers>,
    leg: AnchorOf<Structure>,
    held: Option<Arc<Held>>,
}

impl Rest {
    /// What becomes of an impact if contact begins there at once.
    fn closed(&self, sample: &Sample) -> Closed {
        let mut leg = AnchorOf::<Structure> {
            clock: sample.clock,
            state: sample.state.clone(),
            ..self.leg.clone()
        };
        let mut columns = sample.events.clone();
        if let Some(held) = &self.held {
            let at = (leg.clock, &mut leg.state);
            self.of.close(held, at, &mut columns, &sample.delay);
        }
        let (state, columns) =
            self.steppers.ahead(&self.of, &leg, (&columns, &sample.delay), self.leg.clock);
        let time = self.of.drive().until(sample.clock, self.leg.clock).value();
        let part = time.max(0.0) / Structure::span(&self.of.motion);
        Closed { state, columns, part }
    }
}

impl Perturbed {
    /// The end of bounces at a stop, after which this leg begins.
    fn rest(&self, after: &AnchorOf<Structure>, stop: usize) -> Rest {
        let leg = self.of.leg_from(after).into_owned();
        let held_in =
            |leg: &AnchorOf<Structure>| self.steppers.of(&self.of, leg).equation.held.clone();
        // A stop that opens at once is met without friction.
        let alone = || {
            let touching =
                Touching { at: smallvec![(stop as u32, StopStart::Closed)], ..Touching::default() };
            let phase = Phase::Contact(StructureMode::Closed);
            held_in(&Anchor { clock: leg.clock, state: leg.state.clone(), phase, touching })
        };
        let held = held_in(&leg).filter(|held| held.stops.contains(&Some(stop))).or_else(alone);
        Rest { of: Arc::clone(&self.of), steppers: Arc::clone(&self.steppers), leg, held }
    }

    /// From the last impact before chatter to its accumulation point.
    pub(super) fn accumulate(
        &mut self,
        (before, after): (&AnchorOf<Structure>, &AnchorOf<Structure>),
        event: &StopChatterEvent,
    ) -> Result<(), StructureTangentError> {
        let largest = self.columns.amax();
        if self.samples.begin_well() {
            self.low = None;
        }
        let rest = self.rest(after, event.stop);
        let limit = self.limit_of(before, &rest).filter(|limit| limit.error <= CONVERGED_SLOPES);
        self.samples = Samples::default();
        let refused = || StructureTangentError::Chatter(event.stop, event.time, largest);
        self.begin_rest(&rest, limit.ok_or_else(refused)?);
        Ok(())
    }

    fn begin_rest(&mut self, rest: &Rest, limit: Limit) {
        self.delay = Some(RowDVector::zeros(limit.columns.ncols()));
        (self.columns, self.clock) = (limit.columns, rest.leg.clock);
    }

    /// The limit, from the impacts so far, and from those that follow as far as they are needed.
    fn limit_of(&mut self, before: &AnchorOf<Structure>, rest: &Rest) -> Option<Limit> {
        let mut best = None;
        if !self.is_known(&mut best, rest) {
            let after = DoubleDouble::new(Structure::span(&self.of.motion));
            let far = self.of.drive().advance(rest.leg.clock, after);
            let mut ahead = self.clone();
            self.steppers.hop(&self.of, (before, far), |hopping| {
                for _ in 0..MOST_BOUNCES {
                    match ahead.advance(hopping) {
                        Ok(None | Some(StructureEvent::Impact(_) | StructureEvent::Graze(_))) => {}
                        _ => break,
                    }
                    if ahead.is_known(&mut best, rest) {
                        break;
                    }
                }
            });
        }
        best
    }

    /// Whether the limit is known as well as is needed; the best so far.
    fn is_known(&mut self, best: &mut Option<Limit>, rest: &Rest) -> bool {
        if let Some(limit) = self.samples.limit(|sample| rest.closed(sample)) {
            *best = Some(Limit::better(best.take(), limit));
        }
        best.as_ref().is_some_and(Limit::is_known)
    }

    /// Stops close without an event before: after a plastic impact, or bounces whose last ones are lost
    /// in rounding; at the start they stand for starts that land there.
    pub(super) fn land_all(&mut self, after: &AnchorOf<Structure>) {
        let closed = after.touching.closed();
        let bounced = self.samples.last().filter(|last| {
            let time = self.of.drive().until(last.clock, after.clock).value();
            let at_once = time <= STILL_FLIGHT * Structure::span(&self.of.motion);
            at_once && closed.contains(&(last.stop as u32))
        });
        let Some(stop) = bounced.map(|last| last.stop) else {
            let still = RowDVector::zeros(self.columns.ncols());
            let delay = self.delay.take().unwrap_or(still);
            if let Some(held) = &self.steppers.of(&self.of, after).equation.held {
                self.of.land_on(held, after.clock, &mut self.columns, &delay);
            }
            self.delay = Some(delay);
            return;
        };
        let rest = self.rest(after, stop);
        let well = self.samples.begin_well();
        let limit = self.samples.limit(|sample| rest.closed(sample));
        self.samples = Samples::default();
        if let Some(limit) = limit {
            if well && limit.error <= CONVERGED_SLOPES {
                self.low = None;
            }
            self.begin_rest(&rest, limit);
        }
    }
}
