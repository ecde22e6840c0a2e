//! What happens in a run of a structure.

use std::fmt;

use smallvec::SmallVec;

use super::StructureMode;
use crate::impact::StopImpact;
use crate::model::state::Clock;
use crate::model::structure::StructureState;
use crate::simulate::event::StopEvent;
use crate::simulate::model::ModelEvent;

/// An impact on a stop, with its place in time.
#[derive(Debug, Clone, PartialEq)]
pub struct StopImpactEvent {
    /// Periods and time in the period.
    pub clock: Clock,
    /// Time since the start of the run.
    pub time: f64,
    /// Phase of the drive in [0, 2 pi).
    pub phase: f64,
    /// State just before.
    pub pre: StructureState,
    /// State just after.
    pub post: StructureState,
    /// The stop, regime, impulses, energy.
    pub impact: StopImpact,
}

/// A graze: a stop is touched without an impulse, g = g' = 0, g'' < 0.
#[derive(Debug, Clone, PartialEq)]
pub struct StopGrazeEvent {
    /// Periods and time in the period.
    pub clock: Clock,
    /// Time since the start of the run.
    pub time: f64,
    /// Phase of the drive in [0, 2 pi).
    pub phase: f64,
    /// Which stop.
    pub stop: usize,
    /// State at the graze.
    pub state: StructureState,
    /// g'' there.
    pub gap_acceleration: f64,
}

/// Complete chatter at a stop, carried to its accumulation point.
#[derive(Debug, Clone, PartialEq)]
pub struct StopChatterEvent {
    /// Periods and time in the period of the accumulation point.
    pub clock: Clock,
    /// Its time since the start of the run.
    pub time: f64,
    /// Phase of the drive in [0, 2 pi).
    pub phase: f64,
    /// Which stop.
    pub stop: usize,
    /// State there, with g = g' = 0.
    pub state: StructureState,
    /// Stops closed just before.
    pub closed: ClosedStops,
    /// How many of the impacts skipped come before the time left is lost in rounding.
    pub impacts_skipped: f64,
    /// Time from the last impact to the accumulation point.
    pub time_jump: f64,
    /// Bound of the error that the completion adds to time and state, in scales of the motion.
    pub error: f64,
}

/// The set of closed stops, or how one slips, changes.
#[derive(Debug, Clone, PartialEq)]
pub struct StopContactEvent {
    /// Periods and time in the period.
    pub clock: Clock,
    /// Time since the start of the run.
    pub time: f64,
    /// Phase of the drive in [0, 2 pi).
    pub phase: f64,
    /// The stop that closes, opens or changes its slip; the first, if there are several.
    pub stop: usize,
    /// State at that instant.
    pub state: StructureState,
    /// How contact goes on; `None`: no stop is closed.
    pub mode: Option<StructureMode>,
    /// Closed stops from now on, and the forces in them just after.
    pub closed: ClosedStops,
    /// Normal and tangential force at `stop` just after; 0 where it is open.
    pub force: [f64; 2],
}

/// Numbers of closed stops, ascending.
pub type ClosedStops = SmallVec<[u32; 4]>;

/// One event of a run of a structure.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum StructureEvent {
    /// A stop is struck.
    Impact(StopImpactEvent),
    /// A stop is touched without an impulse.
    Graze(StopGrazeEvent),
    /// Infinitely many impacts are carried to their accumulation point.
    Chatter(StopChatterEvent),
    /// A stop closes: contact lasts there.
    Closed(StopContactEvent),
    /// A stop opens: its force has fallen to zero, or an impact elsewhere pulls it off.
    Release(StopContactEvent),
    /// The run ends; always the last event.
    Stop(StopEvent<StructureState>),
}

impl ModelEvent<StructureState> for StructureEvent {
    fn clock(&self) -> Clock {
        match self {
            Self::Impact(e) => e.clock,
            Self::Graze(e) => e.clock,
            Self::Chatter(e) => e.clock,
            Self::Closed(e) | Self::Release(e) => e.clock,
            Self::Stop(e) => e.clock,
        }
    }

    fn stop(stop: StopEvent<StructureState>) -> Self {
        Self::Stop(stop)
    }

    fn as_stop(&self) -> Option<&StopEvent<StructureState>> {
        if let Self::Stop(stop) = self { Some(stop) } else { None }
    }

    fn is_impact(&self) -> bool {
        matches!(self, Self::Impact(_))
    }

    fn is_graze(&self) -> bool {
        matches!(self, Self::Graze(_))
    }
}

impl fmt::Display for StructureEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Impact(e) => write!(
                f,
                "impact on stop {} ({}) at t = {:.6}, approach velocity {:.6}",
                e.impact.stop,
                e.impact.regime.kind().name(),
                e.time,
                e.impact.approach_velocity
            ),
            Self::Graze(e) => write!(f, "graze of stop {} at t = {:.6}", e.stop, e.time),
            Self::Chatter(e) => write!(f, "chatter at stop {} ends at t = {:.6}", e.stop, e.time),
            Self::Closed(e) => write!(f, "stop {} closes at t = {:.6}", e.stop, e.time),
            Self::Release(e) => write!(f, "stop {} opens at t = {:.6}", e.stop, e.time),
            Self::Stop(e) => write!(f, "stop ({}) at t = {:.6}", e.reason, e.time),
        }
    }
}
