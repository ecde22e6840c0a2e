//! How a simulation ends: at its horizon, at a cap, where the motion does, or with an error.

use super::{Horizon, Simulation, Turn};
use crate::flight::Flight;
use crate::model::error::SimulationError;
use crate::model::state::{Clock, State};
use crate::simulate::event::{Event, StopEvent, StopReason};

impl Simulation {
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
    pub(super) fn checked(&mut self, turn: Turn) -> Turn {
        match turn {
            Some(Ok(Event::Stop(stop))) if !stop.state.is_finite() => Some(Err(self.fail(false))),
            turn => turn,
        }
    }

    /// Stops at the horizon, whose clock is known exactly.
    pub(super) fn stop_at_horizon(&mut self, state: State) -> Event {
        let reason = match self.horizon {
            Horizon::Impacts { .. } => StopReason::TimeCap,
            Horizon::Periods(_) if !self.motion.drive.has_period() => StopReason::TimeCap,
            _ => StopReason::Completed,
        };
        self.stop_at_end(state, reason)
    }

    pub(super) fn stop_at_end(&mut self, state: State, reason: StopReason) -> Event {
        let clock = self.end;
        self.stop(clock, self.motion.drive.time(clock), state, reason)
    }

    /// Stops at the start of the present leg, or at the graze it goes on from.
    pub(super) fn stop_here(&mut self, reason: StopReason) -> Event {
        let (s, rest) = self.point.grazed.map_or((0.0, 0.0), |s| (s, self.point.grazed_rest));
        let (clock, time, _) = self.place(s, rest);
        let state = self.motion.state_at(&self.flight, s);
        self.stop(clock, time, state, reason)
    }

    pub(super) fn stop(
        &mut self,
        clock: Clock,
        time: f64,
        state: State,
        reason: StopReason,
    ) -> Event {
        self.point.stopped = Some(reason);
        Event::Stop(StopEvent { clock, time, state, reason })
    }

    pub(super) fn fail(&mut self, stalled: bool) -> SimulationError {
        let Flight { clock, state, .. } = self.flight;
        let (time, impacts) = (self.motion.drive.time(clock), self.point.impacts);
        let state = state.to_array();
        self.point.stopped = Some(StopReason::Failed);
        if stalled {
            SimulationError::SearchStalled { time, impacts, state }
        } else {
            SimulationError::NotFinite { time, impacts, state }
        }
    }
}
