//! How a simulation ends: at its horizon, at a cap, where the motion does, or with an error.

use super::{Horizon, Leg, Model, ModelEvent, Simulation, Turn};
use crate::model::error::SimulationError;
use crate::model::state::{Clock, ModelState};
use crate::simulate::event::{StopEvent, StopReason};

impl<M: Model> Simulation<M> {
    /// Why it stops before the next leg, if it does.
    #[inline(always)]
    #[allow(clippy::inline_always)] // looked at before every flight
    pub(super) fn stops_before_leg(&self) -> Option<StopReason> {
        match self.horizon {
            Horizon::Impacts { count, .. } if self.point.impacts >= count => {
                Some(StopReason::Completed)
            }
            _ if self.point.events >= self.max_events => Some(StopReason::EventCap),
            _ if self.cancel.is_cancelled() => Some(StopReason::Interrupted),
            _ => None,
        }
    }

    /// A stop in a state beyond the range of finite numbers is a failure.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(super) fn checked(&mut self, turn: Turn<M>) -> Turn<M> {
        match turn {
            Some(Ok(event)) if event.as_stop().is_some_and(|stop| !stop.state.is_finite()) => {
                Some(Err(self.fail(false)))
            }
            turn => turn,
        }
    }

    /// Stops at the horizon, whose clock is known exactly.
    pub(super) fn stop_at_horizon(&mut self, state: M::State) -> M::Event {
        let reason = match self.horizon {
            _ if M::rests(&self.motion, &self.flight) => StopReason::Rest,
            Horizon::Impacts { .. } => StopReason::TimeCap,
            Horizon::Periods(_) if !self.drive().has_period() => StopReason::TimeCap,
            _ => StopReason::Completed,
        };
        self.stop_at_end(state, reason)
    }

    pub(super) fn stop_at_end(&mut self, state: M::State, reason: StopReason) -> M::Event {
        let clock = self.end;
        self.stop(clock, self.drive().time(clock), state, reason)
    }

    /// Stops at the start of the present leg, or at the graze it goes on from.
    pub(super) fn stop_here(&mut self, reason: StopReason) -> M::Event {
        let (s, rest) = self.point.grazed.map_or((0.0, 0.0), |s| (s, self.point.grazed_rest));
        let (clock, time, _) = self.place(s, rest);
        let state = M::state_at(&self.motion, &self.flight, s);
        self.stop(clock, time, state, reason)
    }

    pub(super) fn stop(
        &mut self,
        clock: Clock,
        time: f64,
        state: M::State,
        reason: StopReason,
    ) -> M::Event {
        self.point.stopped = Some(reason);
        M::Event::stop(StopEvent { clock, time, state, reason })
    }

    pub(super) fn fail(&mut self, stalled: bool) -> SimulationError {
        let (time, impacts) = (self.drive().time(self.flight.clock()), self.point.impacts);
        let state = self.flight.state().to_vec();
        self.point.stopped = Some(StopReason::Failed);
        if stalled {
            SimulationError::SearchStalled { time, impacts, state }
        } else {
            SimulationError::NotFinite { time, impacts, state }
        }
    }
}
