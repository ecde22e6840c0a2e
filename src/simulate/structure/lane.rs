//! What a simulation of a structure hands to its lane, and takes back from it.

#![allow(clippy::inline_always)] // a round is compiled for several instruction sets

use super::motion::Motion;
use super::touching::StopStart;
use crate::flight::structure::{Met, StructureFlight, StructureMotion};
use crate::impact::{self, StopImpact};
use crate::model::state::Clock;
use crate::model::structure::{Structure, largest_number};
use crate::numerics::EPS;
use crate::search::Start;
use crate::search::first_contact::{Found, Touch};
use crate::search::gap::GapPoint;
use crate::simulate::structure::Touched;
use crate::simulate::tolerances::SAME_INSTANT;
use crate::simulate::{FlightStart, Leg, Model, Phase, Simulation};

impl Motion {
    /// Free motion.
    #[inline(always)]
    pub(crate) fn free(&self) -> &StructureMotion {
        &self.free
    }

    /// The impact at a stop that is met while no other is near: q is moved onto the stop, and v
    /// becomes what it is after the impact. `None` for anything else, of which q and v then mean
    /// nothing.
    #[inline(always)]
    pub(crate) fn strike_alone(
        &self,
        clock: Clock,
        stop: usize,
        q: &mut [f64],
        v: &mut [f64],
    ) -> Option<StopImpact> {
        let (gap, _) = self.free.gap(stop, clock, q, v);
        self.free.move_onto(stop, gap, q);
        let (_, approach) = self.free.gap(stop, clock, q, v);
        let before = largest_number(v);
        // Not rounding, nor a NaN.
        if approach <= 0.0 || approach.is_nan() {
            return None;
        }
        let impact = impact::strike_inline(self.structure(), stop, approach, v).ok()?;
        if self.structure().stops()[stop].restitution() == 0.0 && impact.regime.kind().sticks() {
            return None; // a landing
        }
        let finite = q.iter().chain(&*v).all(|x| x.is_finite());
        if !(finite && impact.impulse_normal.is_finite() && impact.energy_loss.is_finite()) {
            return None;
        }
        // No less than what any stop may have moved while the clock rounds (strike.rs).
        let speed = before.max(largest_number(v)) + largest_number(q) / self.free.longest();
        let moved = speed * self.free.longest();
        let apart = |other: usize| {
            let (apart, size) = self.free.at_least_apart(other, q, moved);
            apart > 8.0 * SAME_INSTANT * EPS * size
        };
        let mut others = (0..self.structure().stops().len()).filter(|&other| other != stop);
        others.all(apart).then_some(impact)
    }
}

impl Simulation<Structure> {
    /// The stop on which the present flight begins, if it is one that lanes can hold.
    #[inline(never)]
    #[expect(clippy::option_option, reason = "a flight in a lane, which may begin on no stop")]
    pub(crate) fn begins_for_lane(&self) -> Option<Option<usize>> {
        let Phase::Flight(began @ (FlightStart::Apart | FlightStart::Touching)) =
            self.point.anchor.phase
        else {
            return None;
        };
        let touching = &self.point.anchor.touching;
        let usual = self.found.is_none() && self.point.completion.is_none() && touching.is_plain();
        let start = self.start(began);
        if !usual || !matches!(start, Start::Apart | Start::Touching) {
            return None;
        }
        let begins = self.flight.clock() == self.point.anchor.clock;
        Some(touching.at.first().filter(|_| begins).map(|&(stop, _)| stop as usize))
    }

    /// The free motion, and the present flight if it is free, over which another is to be written.
    #[inline(always)]
    pub(crate) fn free_flight(&mut self) -> Option<(&StructureMotion, &mut StructureFlight)> {
        Some((&self.motion.free, self.flight.free_mut()?))
    }

    /// A search has met this contact, as for a single flight.
    #[inline(always)]
    pub(crate) fn set_met(&mut self, met: &Met) {
        let &Met { stop, time, offset } = met;
        let (gap, state) = (GapPoint::default(), Touched::Stop(stop as u32));
        self.found = Some(Found::Contact(Touch { time, offset, gap, state }));
    }

    /// Begins the flight after an impact on a stop that was met alone, which has been written over
    /// the last one ([`Self::free_flight`]); whether chatter may have begun.
    #[inline(always)]
    pub(crate) fn begin_alone(
        &mut self,
        clock: Clock,
        impact: &StopImpact,
        (q, v): (&[f64], &[f64]),
    ) -> bool {
        let anchor = &mut self.point.anchor;
        anchor.state.q.copy_from_slice(q);
        anchor.state.v.copy_from_slice(v);
        anchor.clock = clock;
        anchor.phase = Phase::Flight(FlightStart::Touching);
        anchor.touching.at.clear();
        anchor.touching.at.push((impact.stop as u32, StopStart::Touching));
        self.flight.restart(clock, (q, v));
        self.point.monitor.at_contact(impact.stop as u32);
        let view = self.system.chatter_view(impact);
        let chatters = self.left(&view);
        if chatters {
            self.complete_chatter_if_certain(&view);
        }
        chatters
    }
}
