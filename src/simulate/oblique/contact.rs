//! Lasting contact of the pendulum and the mass: slides and sticks.

use super::follows;
use crate::contact::sustained::{ContactMode, Next, SlideEnd};
use crate::model::state::Clock;
use crate::model::state::{ModelState, State};
use crate::numerics::EPS;
use crate::numerics::double_double::DoubleDouble;
use crate::simulate::event::StopReason;
use crate::simulate::{Anchor, Horizon, Observer, Phase, Simulation, Turn};

impl Simulation {
    fn continue_as(&mut self, clock: Clock, state: State, next: Next) -> Turn {
        let here = Anchor { clock, state, phase: Phase::Landing, touching: () };
        self.continue_with(&here, follows(clock, state, next), true)
    }

    pub(super) fn slide<O: Observer>(&mut self, mode: ContactMode, observer: &mut O) -> Turn {
        let Anchor { clock, state, .. } = self.point.anchor;
        let step = self.system.slide(self.motion.drive.trig_at(clock), &state, mode);
        if step.stalls(self.motion.span) {
            return Some(Err(self.fail(true)));
        }
        if !step.is_finite() {
            // Either the force grows beyond all bounds where the tip's reach ends, or the loads do.
            if step.is_at_reach() {
                return self.continue_as(clock, state, self.system.no_force_fits(&state));
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
            SlideEnd::Released => self.continue_as(clock, state, Next::Release),
            SlideEnd::Stopped => {
                let state = self.system.on_contact(state.x1, 0.0);
                let next = self.system.land(self.motion.drive.trig_at(clock), &state);
                self.continue_as(clock, state, next)
            }
            SlideEnd::Painleve => self.continue_as(clock, state, self.system.no_force_fits(&state)),
        }
    }

    pub(super) fn stick<O: Observer>(&mut self, observer: &mut O) -> Turn {
        let Anchor { clock, state, .. } = self.point.anchor;
        let change = self.system.stick(&state).next_change(self.motion.drive.trig_at(clock));
        if change.is_none() && matches!(self.horizon, Horizon::Impacts { .. }) {
            let time = self.motion.drive.time(clock);
            return Some(Ok(self.stop(clock, time, state, StopReason::Rest)));
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
            return self.continue_as(clock, state, next);
        }
        self.anchor(clock, state, Phase::Contact(ContactMode::Stick));
        None
    }
}

/// Local flights' spans by which a rest for ever is carried on at a time.
const REST_TURNS: f64 = 256.0;
