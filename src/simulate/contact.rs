//! Lasting contact: the end of chatter, landings, and what follows them.

use super::model::{Follows, Skipped};
use super::{AnchorOf, Completion, Leg, Model, Observer, Simulation, Turn};
use crate::contact::chatter::{ChatterMonitor, Limit};
use crate::contact::tolerances::CHATTER_NOISE;
use crate::model::error::SimulationError;
use crate::model::state::Clock;
use crate::numerics::EPS;
use crate::numerics::double_double::DoubleDouble;
use crate::search::first_contact::Touch;
use crate::search::tolerances::RELEASE_PROBE;
use crate::simulate::tolerances::{
    DEFAULT_TOLERANCE, MOST_MOVES, SHORTEST_MOVE, STANDSTILL_EVENTS, STANDSTILL_TIME,
};

impl<M: Model> Simulation<M> {
    /// Carries a chatter sequence to its accumulation point.
    pub(super) fn complete<O: Observer<M::State>>(&mut self, observer: &mut O) -> Turn<M> {
        let completion = self.point.completion.clone()?;
        let (reached, over) = self.reached_by(completion.clock);
        let state_at = |this: &Self, s: DoubleDouble| this.hop(&completion, s.value());
        self.pass_sections(reached, over, observer, state_at);
        if over {
            let state = state_at(self, reached.not_negative());
            return Some(Ok(self.stop_at_horizon(state)));
        }
        Some(Ok(self.accumulate(&completion)))
    }

    /// The leg that begins at an accumulation point.
    pub(super) fn accumulation(
        &self,
        completion: &Completion<M::State>,
        contact: u32,
    ) -> AnchorOf<M> {
        let Completion { clock, ref state, .. } = *completion;
        let stopped = M::STOPS_SLIP && self.point.monitor.stopped;
        self.system.landing(&self.point.anchor, clock, state.clone(), contact, stopped)
    }

    /// The accumulation point.
    fn accumulate(&mut self, completion: &Completion<M::State>) -> M::Event {
        let Completion { clock, impacts_skipped, time_jump, error, .. } = *completion;
        let leg = self.accumulation(completion, self.point.contact);
        self.point.completion = None;
        self.point.events += 1;
        self.point.monitor = ChatterMonitor::default();
        let place = (clock, self.drive().time(clock), self.drive().phase_at(clock));
        // With the rounding of the time in the period, on which nothing depends.
        let scales = self.system.scales(&self.motion, &self.flight, self.point.contact);
        let error = error + EPS * clock.time_in_period / scales.time;
        let skipped = Skipped { impacts: impacts_skipped, time_jump, error };
        let contact = self.point.contact;
        let event = self.system.chatter_event(&self.motion, place, &leg, contact, skipped);
        self.begin_leg(leg);
        event
    }

    /// The bodies meet at g = g' = 0 to rounding: the end of bounces too low to tell, which are
    /// carried on to leading order, or a plastic impact.
    pub(super) fn come_to_rest(&mut self, touch: &Touch<M::Touched>) -> Turn<M> {
        let (clock, _, _) = self.place(touch.time, touch.offset);
        let state = M::touched(&self.motion, &self.flight, touch);
        let contact = M::contact_of(&touch.state);
        let u = self.system.separation(&self.motion, &self.point.anchor, contact);
        if let Some(ratio) = self.point.monitor.shrinks(u) {
            let second = touch.gap.second.max(f64::MIN_POSITIVE);
            let leading = (2.0 * u / (second * (1.0 - ratio))).min(M::span(&self.motion));
            // Velocities of some least numbers have no digits; the end is not before the next
            // bounce.
            let time = leading.max(touch.local_time());
            let stopped = self.point.monitor.stopped;
            let bounces = (u, ratio, time);
            let met = (clock, &state, contact);
            let leg = &self.point.anchor;
            let (slip, others) =
                self.system.after_bounces(&self.motion, leg, met, bounces, stopped);
            let scales = self.system.scales(&self.motion, &self.flight, contact);
            let limit = Limit { time, slip, others, ratio, error: (time / scales.time).powi(2) };
            let mut completion = self.completion(&limit, second, contact, &scales);
            let certain = completion.error <= self.chatter_tolerance.max(DEFAULT_TOLERANCE);
            if !certain || !self.is_alone(contact, time) {
                // g'' so small that the accumulation point is not certain, or not the next event:
                // bounces as low as this are contact already.
                let (size, _) = self.system.sizes(&state, contact, &scales);
                let state = self.system.landed(&self.motion, clock, state, contact, stopped);
                let error = u / scales.rate + CHATTER_NOISE * EPS * size;
                let time_jump = touch.local_time();
                completion = Completion { clock, state, time_jump, error, ..completion };
            }
            // A section or the end of the run may lie before it.
            self.point.completion = Some(completion);
            self.point.contact = contact;
            return None;
        }
        self.land_at(clock, state, contact);
        None
    }

    /// The bodies are on this contact with g' = 0 from this clock on.
    pub(super) fn land_at(&mut self, clock: Clock, state: M::State, contact: u32) {
        let stopped = M::STOPS_SLIP && self.point.monitor.stuck;
        let state = self.system.landed(&self.motion, clock, state, contact, stopped);
        let leg = self.system.landing(&self.point.anchor, clock, state, contact, stopped);
        self.begin_leg(leg);
    }

    /// Local time at which a leg ends that lasts to this clock, and whether that is the horizon.
    fn reached_by(&self, clock: Clock) -> (DoubleDouble, bool) {
        let over = clock > self.end;
        let last = if over { self.end } else { clock };
        (self.drive().until(self.flight.clock(), last), over)
    }

    /// Decides what follows a landing.
    pub(super) fn land<O: Observer<M::State>>(&mut self, observer: &mut O) -> Turn<M> {
        let clock = self.point.anchor.clock;
        let (reached, over) = self.reached_by(clock);
        if over {
            // Time has been moved on.
            let state = self.point.anchor.state.clone();
            self.pass_sections(reached, over, observer, |_, _| state.clone());
            return Some(Ok(self.stop_at_horizon(state)));
        }
        let follows = self.system.follows(&self.motion, &self.point.anchor);
        let here = self.point.anchor.clone();
        self.continue_with(&here, follows, false)
    }

    /// Continues from `here` with what follows; `held`: from contact, so that its end is an event.
    pub(super) fn continue_with(
        &mut self,
        here: &AnchorOf<M>,
        follows: Follows<M>,
        held: bool,
    ) -> Turn<M> {
        let (clock, state) = match self.moved_from_standstill(here.clock, &here.state) {
            Ok(Some(moved)) => moved,
            Ok(None) => return self.enter(here, follows, held),
            Err(error) => return Some(Err(error)),
        };
        let leg = self.system.landing(here, clock, state, self.point.contact, false);
        if held && !self.reached_by(clock).1 {
            // What ends a contact is told, wherever time has been moved to.
            let follows = self.system.follows(&self.motion, &leg);
            return self.enter(&leg, follows, held);
        }
        self.begin_leg(leg);
        None
    }

    /// The leg that follows `here`.
    fn enter(&mut self, here: &AnchorOf<M>, follows: Follows<M>, held: bool) -> Turn<M> {
        let clock = here.clock;
        let place = (clock, self.drive().time(clock), self.drive().phase_at(clock));
        let leg = match follows {
            Follows::Leg(leg) => leg,
            Follows::Stops(reason) => {
                return Some(Ok(self.stop(clock, place.1, here.state.clone(), reason)));
            }
        };
        let before = &self.point.anchor;
        let event = self.system.contact_event(&self.motion, place, before, &leg, held);
        self.begin_leg(leg);
        self.point.events += u64::from(event.is_some());
        event.map(Ok)
    }

    /// Counts changes with hardly any progress in time. Where there are too many, rounding decides
    /// between the modes: time is moved on, further each time, but only so far that the gap of a
    /// free motion stays at rounding level. Where that leads nowhere the run fails.
    pub(super) fn moved_from_standstill(
        &mut self,
        clock: Clock,
        state: &M::State,
    ) -> Result<Option<(Clock, M::State)>, SimulationError> {
        let span = M::span(&self.motion);
        let passed = self.drive().until(self.point.anchor.clock, clock).value();
        if passed > STANDSTILL_TIME * span {
            (self.point.standstill, self.point.moves) = (0, 0);
        }
        self.point.standstill += 1;
        if self.point.standstill <= STANDSTILL_EVENTS {
            return Ok(None);
        }
        self.point.standstill = 0;
        self.point.moves += 1;
        let flight = self.flight_from(clock, state.clone());
        let [second, third] = self.system.gap_jet(&self.motion, &flight, self.point.contact);
        let level = EPS * self.system.extent(state);
        let time = (EPS * 2f64.powi(self.point.moves.min(64) as i32))
            .min(RELEASE_PROBE.1)
            .min((2.0 * level / second.abs()).sqrt() / span)
            .min((6.0 * level / third.abs()).cbrt() / span);
        if self.point.moves >= MOST_MOVES && time < SHORTEST_MOVE {
            return Err(self.fail(true));
        }
        let time = span * time.max(EPS);
        let later = self.drive().advance(clock, DoubleDouble::new(time));
        let moved = M::state_at(&self.motion, &flight, time);
        let contact = self.point.contact;
        Ok(Some((later, self.system.landed(&self.motion, later, moved, contact, false))))
    }
}
