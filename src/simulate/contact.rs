//! Lasting contact: the end of chatter, landings, slides, sticks and releases.

use super::{Completion, FlightStart, Horizon, Observer, Phase, Simulation, Turn};
use crate::contact::chatter::Limit;
use crate::contact::sustained::{ContactForce, ContactMode, Next, SlideEnd};
use crate::contact::tolerances::CHATTER_NOISE;
use crate::flight::Touch;
use crate::model::error::SimulationError;
use crate::model::state::{Clock, State};
use crate::numerics::EPS;
use crate::numerics::double_double::DoubleDouble;
use crate::search::tolerances::RELEASE_PROBE;
use crate::simulate::event::{ChatterEvent, ContactEvent, Event, StopReason};
use crate::simulate::tolerances::{
    DEFAULT_TOLERANCE, MOST_MOVES, SHORTEST_MOVE, STANDSTILL_EVENTS, STANDSTILL_TIME,
};

impl Simulation {
    /// Carries a chatter sequence to its accumulation point.
    pub(super) fn complete<O: Observer>(&mut self, observer: &mut O) -> Turn {
        let completion = self.point.completion?;
        let (reached, over) = self.reached_by(completion.clock);
        let state_at = |this: &Self, s: DoubleDouble| this.hop(&completion, s.value());
        self.pass_sections(reached, over, observer, state_at);
        if over {
            let state = state_at(self, reached.not_negative());
            return Some(Ok(self.stop_at_horizon(state)));
        }
        Some(Ok(self.accumulate(&completion)))
    }

    /// The accumulation point.
    fn accumulate(&mut self, completion: &Completion) -> Event {
        let Completion { clock, state, impacts_skipped, time_jump, error } = *completion;
        self.point.completion = None;
        self.point.events += 1;
        self.point.monitor = crate::contact::chatter::ChatterMonitor::default();
        self.anchor(clock, state, Phase::Landing);
        let drive = &self.motion.drive;
        let (time, phase) = (drive.time(clock), drive.phase_at(clock));
        let force = match self.system.land(drive.trig_at(clock), &state) {
            Next::Hold(mode) => self.force(clock, &state, mode),
            _ => ContactForce::default(),
        };
        Event::Chatter(ChatterEvent {
            clock,
            time,
            phase,
            state,
            force,
            impacts_skipped,
            time_jump,
            // With the rounding of the time in the period, on which nothing depends.
            error: error + EPS * clock.time_in_period,
        })
    }

    /// The bodies meet at g = g' = 0 to rounding: the end of bounces too low to tell, which are
    /// carried on to leading order, or a plastic impact.
    pub(super) fn come_to_rest(&mut self, touch: &Touch) -> Turn {
        let (clock, _, _) = self.place(touch.time, touch.offset);
        let u = -self.system.approach_velocity(&self.point.anchor.state);
        if let Some(ratio) = self.point.monitor.shrinks(u) {
            let state = touch.state;
            let second = touch.gap.second.max(f64::MIN_POSITIVE);
            let leading = (2.0 * u / (second * (1.0 - ratio))).min(self.motion.span);
            // Velocities of some least numbers have no digits; the end is not before the next
            // bounce.
            let time = leading.max(touch.local_time());
            let phase = self.motion.drive.trig_at(clock);
            let v1 = if self.point.monitor.stopped {
                0.0
            } else {
                self.system.slip_after_bounces(phase, &state, (u, ratio), time)
            };
            let others = [state.x1 + state.v1 * time, state.v2];
            let limit = Limit { time, slip: v1, others, ratio, error: time * time };
            let mut completion = self.completion(&limit, &state, second);
            if completion.error > self.chatter_tolerance.max(DEFAULT_TOLERANCE) {
                // g'' so small that the accumulation point is not certain: bounces as low as this
                // are contact already.
                let size = state.to_array().iter().fold(0.0, |most: f64, c| most.max(c.abs()));
                let state = self.system.landed(State {
                    v1: if self.point.monitor.stopped { 0.0 } else { state.v1 },
                    ..state
                });
                let error = u + CHATTER_NOISE * EPS * size;
                let time_jump = touch.local_time();
                completion = Completion { clock, state, time_jump, error, ..completion };
            }
            // A section or the end of the run may lie before it.
            self.point.completion = Some(completion);
            return None;
        }
        self.anchor(clock, self.system.landed(touch.state), Phase::Landing);
        None
    }

    /// Local time at which a leg ends that lasts to this clock, and whether that is the horizon.
    fn reached_by(&self, clock: Clock) -> (DoubleDouble, bool) {
        let over = clock > self.end;
        let last = if over { self.end } else { clock };
        (self.motion.drive.until(self.flight.clock, last), over)
    }

    /// Decides what follows a landing.
    pub(super) fn land<O: Observer>(&mut self, observer: &mut O) -> Turn {
        let super::Anchor { clock, state, .. } = self.point.anchor;
        let (reached, over) = self.reached_by(clock);
        if over {
            // Time has been moved on.
            self.pass_sections(reached, over, observer, |_, _| state);
            return Some(Ok(self.stop_at_horizon(state)));
        }
        let next = self.system.land(self.motion.drive.trig_at(clock), &state);
        self.continue_with(clock, state, next, false)
    }

    /// Continues with what follows; `held`: from contact, so that its end is an event.
    fn continue_with(&mut self, clock: Clock, state: State, next: Next, held: bool) -> Turn {
        let (clock, state) = match self.moved_from_standstill(clock, &state) {
            Ok(Some(moved)) => moved,
            Ok(None) => return self.enter(clock, state, next, held),
            Err(error) => return Some(Err(error)),
        };
        if held && !self.reached_by(clock).1 {
            // What ends a contact is told, wherever time has been moved to.
            let next = self.system.land(self.motion.drive.trig_at(clock), &state);
            return self.enter(clock, state, next, held);
        }
        self.anchor(clock, state, Phase::Landing);
        None
    }

    /// The mode that follows, from this clock and state on.
    fn enter(&mut self, clock: Clock, state: State, next: Next, held: bool) -> Turn {
        let (time, phase) = (self.motion.drive.time(clock), self.motion.drive.phase_at(clock));
        let (mode, leg) = match next {
            Next::Hold(mode) => (Some(mode), Phase::Contact(mode)),
            Next::Separate => (None, Phase::Flight(FlightStart::Touching)),
            Next::Release => (None, Phase::Flight(FlightStart::Released)),
            Next::Painleve => return Some(Ok(self.stop(clock, time, state, StopReason::Painleve))),
            Next::Jammed => return Some(Ok(self.stop(clock, time, state, StopReason::Jammed))),
        };
        self.anchor(clock, state, leg);
        if mode.is_none() && !held {
            return None;
        }
        self.point.events += 1;
        let force = mode.map_or(ContactForce::default(), |mode| self.force(clock, &state, mode));
        let event = ContactEvent { clock, time, phase, state, mode, force };
        Some(Ok(match mode {
            Some(ContactMode::SlidePositive) => Event::SlidePositive(event),
            Some(ContactMode::SlideNegative) => Event::SlideNegative(event),
            Some(ContactMode::Stick) => Event::Stick(event),
            None => Event::Release(event),
        }))
    }

    /// Counts changes with hardly any progress in time. Where there are too many, rounding decides
    /// between the modes: time is moved on, further each time, but only so far that the gap of a
    /// free motion stays at rounding level. Where that leads nowhere the run fails.
    fn moved_from_standstill(
        &mut self,
        clock: Clock,
        state: &State,
    ) -> Result<Option<(Clock, State)>, SimulationError> {
        let span = self.motion.span;
        let passed = self.motion.drive.until(self.point.anchor.clock, clock).value();
        if passed > STANDSTILL_TIME * span {
            (self.point.standstill, self.point.moves) = (0, 0);
        }
        self.point.standstill += 1;
        if self.point.standstill <= STANDSTILL_EVENTS {
            return Ok(None);
        }
        self.point.standstill = 0;
        self.point.moves += 1;
        let flight = self.motion.flight(clock, *state);
        let gap = self.motion.contact_gap(&flight);
        let level = EPS * state.x1.abs().max(state.x2.abs()).max(1.0);
        let time = (EPS * 2f64.powi(self.point.moves.min(64) as i32))
            .min(RELEASE_PROBE.1)
            .min((2.0 * level / gap.second.abs()).sqrt() / span)
            .min((6.0 * level / gap.third.abs()).cbrt() / span);
        if self.point.moves >= MOST_MOVES && time < SHORTEST_MOVE {
            return Err(self.fail(true));
        }
        let time = span * time.max(EPS);
        let later = self.motion.drive.advance(clock, DoubleDouble::new(time));
        let moved = self.motion.state_at(&flight, time);
        Ok(Some((later, self.system.landed(moved))))
    }

    fn force(&self, clock: Clock, state: &State, mode: ContactMode) -> ContactForce {
        self.system.contact_force(self.motion.drive.trig_at(clock), state, mode)
    }

    /// One step of a contact phase.
    pub(super) fn hold<O: Observer>(&mut self, mode: ContactMode, observer: &mut O) -> Turn {
        if mode == ContactMode::Stick { self.stick(observer) } else { self.slide(mode, observer) }
    }

    fn slide<O: Observer>(&mut self, mode: ContactMode, observer: &mut O) -> Turn {
        let super::Anchor { clock, state, .. } = self.point.anchor;
        let step = self.system.slide(self.motion.drive.trig_at(clock), &state, mode);
        if step.stalls(self.motion.span) {
            return Some(Err(self.fail(true)));
        }
        if !step.is_finite() {
            // Either the force grows beyond all bounds where the tip's reach ends, or the loads do.
            if step.is_at_reach() {
                return self.continue_with(clock, state, self.system.no_force_fits(&state), true);
            }
            return Some(Err(self.fail(false)));
        }
        let (reached, cause) = step.end();
        let over = self.horizon_before(reached, 0.0, false);
        let state_at = |this: &Self, s: DoubleDouble| {
            let (x1, v1) = step.at(s.value());
            this.system.on_contact(x1, v1)
        };
        let last = over.unwrap_or(DoubleDouble::new(reached));
        self.pass_sections(last, over.is_some(), observer, state_at);
        if let Some(end) = over {
            let state = state_at(self, end.not_negative());
            return Some(Ok(self.stop_at_horizon(state)));
        }
        let clock = self.clock_after(reached, 0.0);
        let state = state_at(self, DoubleDouble::new(reached));
        if !state.is_finite() {
            return Some(Err(self.fail(false)));
        }
        match cause {
            // Short steps of a fast slide are progress; none at all is not.
            SlideEnd::Continues if reached > EPS * step.unit() => {
                self.anchor(clock, state, Phase::Contact(mode));
                None
            }
            SlideEnd::Continues | SlideEnd::Side => {
                let (clock, state) = match self.moved_from_standstill(clock, &state) {
                    Ok(moved) => moved.unwrap_or((clock, state)),
                    Err(error) => return Some(Err(error)),
                };
                self.anchor(clock, state, Phase::Contact(mode));
                None
            }
            SlideEnd::Released => self.continue_with(clock, state, Next::Release, true),
            SlideEnd::Stopped => {
                let state = self.system.on_contact(state.x1, 0.0);
                let next = self.system.land(self.motion.drive.trig_at(clock), &state);
                self.continue_with(clock, state, next, true)
            }
            SlideEnd::Painleve => {
                self.continue_with(clock, state, self.system.no_force_fits(&state), true)
            }
        }
    }

    fn stick<O: Observer>(&mut self, observer: &mut O) -> Turn {
        let super::Anchor { clock, state, .. } = self.point.anchor;
        let change = self.system.stick(&state).next_change(self.motion.drive.trig_at(clock));
        if change.is_none() && matches!(self.horizon, Horizon::Impacts { .. }) {
            return Some(Ok(self.stop(
                clock,
                self.motion.drive.time(clock),
                state,
                StopReason::Rest,
            )));
        }
        // A rest for ever goes on in pieces, so that the caller is asked now and then.
        let reached = change.map_or(REST_TURNS * self.motion.span, |(time, _)| time);
        let over = self.horizon_before(reached, 0.0, false);
        let last = over.unwrap_or(DoubleDouble::new(reached));
        self.pass_sections(last, over.is_some(), observer, |_, _| state);
        if over.is_some() {
            return Some(Ok(match change {
                Some(_) => self.stop_at_horizon(state),
                None => self.stop_at_end(state, StopReason::Rest),
            }));
        }
        let clock = self.clock_after(reached, 0.0);
        if let Some((_, next)) = change {
            return self.continue_with(clock, state, next, true);
        }
        self.anchor(clock, state, Phase::Contact(ContactMode::Stick));
        None
    }
}

/// Local flights' spans by which a rest for ever is carried on at a time.
const REST_TURNS: f64 = 256.0;
