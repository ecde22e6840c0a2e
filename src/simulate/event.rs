//! What happens in a run: events, and why a run stopped. The records that are kept of events are in
//! `event/records.rs`.

mod display;
mod records;

pub use records::{ContactRecord, EventKind, EventRecord, GrazeRecord, ImpactRecord};

use serde::{Deserialize, Serialize};

use crate::contact::sustained::{ContactForce, ContactMode};
use crate::impact::Impact;
use crate::model::state::{Clock, State};

/// An impact with its place in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImpactEvent {
    /// Periods and time in the period.
    pub clock: Clock,
    /// Time since the start of the run.
    pub time: f64,
    /// Forcing phase in [0, 2 pi).
    pub phase: f64,
    /// State just before.
    pub pre: State,
    /// State just after.
    pub post: State,
    /// Regime, impulses, energy.
    pub impact: Impact,
}

/// A graze: the bodies touch without an impulse, g = g' = 0, g'' < 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrazeEvent {
    /// Periods and time in the period.
    pub clock: Clock,
    /// Time since the start of the run.
    pub time: f64,
    /// Forcing phase in [0, 2 pi).
    pub phase: f64,
    /// State at the graze.
    pub state: State,
    /// g'' there.
    pub gap_acceleration: f64,
}

/// Complete chatter: the infinitely many impacts left are skipped, to their accumulation point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChatterEvent {
    /// Periods and time in the period of the accumulation point.
    pub clock: Clock,
    /// Its time since the start of the run.
    pub time: f64,
    /// Forcing phase in [0, 2 pi).
    pub phase: f64,
    /// State there, with g = g' = 0.
    pub state: State,
    /// Force of the contact that follows; 0 where none does.
    pub force: ContactForce,
    /// How many of the impacts skipped come before the time left is lost in the rounding of the
    /// time in the period. (There are infinitely many.)
    pub impacts_skipped: f64,
    /// Time from the last impact to the accumulation point.
    pub time_jump: f64,
    /// Bound of the error that the completion adds to time and state, absolute. Where g'' is so
    /// small that the accumulation point is not certain to 1e-12, contact begins once the bounces
    /// are at rounding level: `time_jump` is 0 then and this bounds the state alone.
    pub error: f64,
}

/// Contact begins, changes its mode, or ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactEvent {
    /// Periods and time in the period.
    pub clock: Clock,
    /// Time since the start of the run.
    pub time: f64,
    /// Forcing phase in [0, 2 pi).
    pub phase: f64,
    /// State at that instant.
    pub state: State,
    /// Mode from now on; `None`: flight.
    pub mode: Option<ContactMode>,
    /// Force just after.
    pub force: ContactForce,
}

/// The end of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StopEvent<S = State> {
    /// Periods and time in the period.
    pub clock: Clock,
    /// Time since the start of the run.
    pub time: f64,
    /// State at the end.
    pub state: S,
    /// Why the run stopped.
    pub reason: StopReason,
}

/// One event of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Event {
    /// The bodies strike.
    Impact(ImpactEvent),
    /// The bodies touch without an impulse.
    Graze(GrazeEvent),
    /// Infinitely many impacts are carried to their accumulation point.
    Chatter(ChatterEvent),
    /// The tip begins to slide in contact, x1' > 0.
    SlidePositive(ContactEvent),
    /// The tip begins to slide in contact, x1' < 0.
    SlideNegative(ContactEvent),
    /// The tip begins to stick in contact.
    Stick(ContactEvent),
    /// Contact ends: its force has fallen to zero.
    Release(ContactEvent),
    /// The run ends; always the last event.
    Stop(StopEvent),
}

impl Event {
    /// The impact, if it is one.
    #[must_use]
    pub fn into_impact(self) -> Option<ImpactEvent> {
        if let Self::Impact(impact) = self { Some(impact) } else { None }
    }

    /// Periods and time in the period.
    #[must_use]
    pub fn clock(&self) -> Clock {
        match self {
            Self::Impact(e) => e.clock,
            Self::Graze(e) => e.clock,
            Self::Chatter(e) => e.clock,
            Self::SlidePositive(e) | Self::SlideNegative(e) | Self::Stick(e) | Self::Release(e) => {
                e.clock
            }
            Self::Stop(e) => e.clock,
        }
    }
}

/// Why a run stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum StopReason {
    /// The time or the number of impacts asked for is reached.
    Completed,
    /// The cap on the number of events is reached.
    EventCap,
    /// The cap on the time is reached before the number of impacts asked for.
    TimeCap,
    /// Both bodies rest in contact, and nothing will ever move them. The run is carried to the end
    /// that was asked for; one without an end stops there.
    Rest,
    /// Contact where slip drives the bodies into each other (mbar + k cos x1 <= 0): no contact
    /// force fits, or more than one does (Painleve).
    Painleve,
    /// A graze where slip cannot stop the approach (mbar + k cos x1 <= 0) has a finite effect.
    UndecidableGraze,
    /// mbar = 0: the pendulum sticks against a wall that keeps approaching, or is driven by it
    /// to the end of its reach.
    Jammed,
    /// law = paper gave no admissible outcome.
    LawFailed,
    /// A number left the range of floats, or no contact could be decided: of what was done up to
    /// there.
    Failed,
    /// Stops that see each other are struck at one instant, or one while another is closed, and
    /// `simultaneous` gives no rule for it, or one that no velocity obeys.
    Simultaneous,
    /// Impacts at one instant follow one another beyond counting.
    SequenceCap,
    /// Contact lasts with friction at one stop, and at another one that sees it.
    SeveralFrictional,
    /// The caller wished it, and nothing else.
    Interrupted,
}

impl StopReason {
    /// Whether the run came to the time or the number of impacts asked for.
    #[must_use]
    pub fn reached_the_end(self) -> bool {
        matches!(self, Self::Completed | Self::Rest)
    }

    /// The name used in Python and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Completed => "completed",
            Self::EventCap => "event_cap",
            Self::TimeCap => "time_cap",
            Self::Rest => "rest",
            Self::Painleve => "painleve",
            Self::UndecidableGraze => "undecidable_graze",
            Self::Jammed => "jammed",
            Self::LawFailed => "law_failed",
            Self::Failed => "failed",
            Self::Simultaneous => "simultaneous",
            Self::SequenceCap => "sequence_cap",
            Self::SeveralFrictional => "several_frictional",
            Self::Interrupted => "interrupted",
        }
    }
}
