//! What happens in a run: events, the records that are kept of them, and why a run stopped.

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

use crate::impact::Impact;
use crate::state::{Clock, State};

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

/// The end of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StopEvent {
    /// Periods and time in the period.
    pub clock: Clock,
    /// Time since the start of the run.
    pub time: f64,
    /// State at the end.
    pub state: State,
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
    /// The run ends; always the last event.
    Stop(StopEvent),
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
    /// Complete chatter: infinitely many impacts follow in finite time, then contact lasts.
    Chatter,
    /// A graze where slip cannot stop the approach (mbar + k cos x1 <= 0) has a finite effect.
    UndecidableGraze,
    /// mbar = 0: the pendulum sticks against a wall that keeps approaching, or is driven by it
    /// to the end of its reach.
    Jammed,
    /// law = paper gave no admissible outcome.
    LawFailed,
    /// The caller asked for the end.
    Interrupted,
}

impl StopReason {
    /// The name used in Python and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Completed => "completed",
            Self::EventCap => "event_cap",
            Self::TimeCap => "time_cap",
            Self::Chatter => "chatter",
            Self::UndecidableGraze => "undecidable_graze",
            Self::Jammed => "jammed",
            Self::LawFailed => "law_failed",
            Self::Interrupted => "interrupted",
        }
    }
}

/// Kind of an event as stored: the numbers of `vibroimpact.EventKind` in Python.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
#[non_exhaustive]
pub enum EventKind {
    /// Index points into the impacts.
    Impact = 0,
    /// Index points into the grazes.
    Graze = 1,
    /// Index is -1.
    Stop = 7,
}

/// A kept impact: the columns of `run.impacts`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs)]
pub struct ImpactRecord {
    pub time: f64,
    pub period: i64,
    pub time_in_period: f64,
    pub x1: f64,
    pub v1_pre: f64,
    pub v1_post: f64,
    pub x2: f64,
    pub v2_pre: f64,
    pub v2_post: f64,
    pub phase: f64,
    /// Number of the regime.
    pub regime: i64,
    pub impulse_normal: f64,
    pub impulse_tangential: f64,
    pub energy_loss: f64,
}

impl ImpactRecord {
    /// Column names and NumPy formats, in order.
    pub const COLUMNS: &'static [(&'static str, &'static str)] = &[
        ("time", "<f8"),
        ("period", "<i8"),
        ("time_in_period", "<f8"),
        ("x1", "<f8"),
        ("v1_pre", "<f8"),
        ("v1_post", "<f8"),
        ("x2", "<f8"),
        ("v2_pre", "<f8"),
        ("v2_post", "<f8"),
        ("phase", "<f8"),
        ("regime", "<i8"),
        ("impulse_normal", "<f8"),
        ("impulse_tangential", "<f8"),
        ("energy_loss", "<f8"),
    ];
}

impl From<&ImpactEvent> for ImpactRecord {
    fn from(e: &ImpactEvent) -> Self {
        Self {
            time: e.time,
            period: e.clock.period,
            time_in_period: e.clock.time_in_period,
            x1: e.pre.x1,
            v1_pre: e.pre.v1,
            v1_post: e.post.v1,
            x2: e.pre.x2,
            v2_pre: e.pre.v2,
            v2_post: e.post.v2,
            phase: e.phase,
            regime: e.impact.regime.kind() as i64,
            impulse_normal: e.impact.impulse_normal,
            impulse_tangential: e.impact.impulse_tangential,
            energy_loss: e.impact.energy_loss,
        }
    }
}

/// A kept graze: the columns of `run.grazes`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs)]
pub struct GrazeRecord {
    pub time: f64,
    pub period: i64,
    pub time_in_period: f64,
    pub x1: f64,
    pub v1: f64,
    pub x2: f64,
    pub v2: f64,
    pub phase: f64,
    /// g'' at the graze.
    pub gap_acceleration: f64,
}

impl GrazeRecord {
    /// Column names and NumPy formats, in order.
    pub const COLUMNS: &'static [(&'static str, &'static str)] = &[
        ("time", "<f8"),
        ("period", "<i8"),
        ("time_in_period", "<f8"),
        ("x1", "<f8"),
        ("v1", "<f8"),
        ("x2", "<f8"),
        ("v2", "<f8"),
        ("phase", "<f8"),
        ("gap_acceleration", "<f8"),
    ];
}

impl From<&GrazeEvent> for GrazeRecord {
    fn from(e: &GrazeEvent) -> Self {
        Self {
            time: e.time,
            period: e.clock.period,
            time_in_period: e.clock.time_in_period,
            x1: e.state.x1,
            v1: e.state.v1,
            x2: e.state.x2,
            v2: e.state.v2,
            phase: e.phase,
            gap_acceleration: e.gap_acceleration,
        }
    }
}

/// A kept event: the columns of `run.events`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs)]
pub struct EventRecord {
    pub time: f64,
    pub period: i64,
    /// Number of the [`EventKind`].
    pub kind: i64,
    /// Row in the table of that kind, -1 for stop.
    pub index: i64,
}

impl EventRecord {
    /// Column names and NumPy formats, in order.
    pub const COLUMNS: &'static [(&'static str, &'static str)] =
        &[("time", "<f8"), ("period", "<i8"), ("kind", "<i8"), ("index", "<i8")];
}
