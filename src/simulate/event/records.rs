//! Events as they are kept: one table per kind, and the table of all events in order.

use bytemuck::{Pod, Zeroable};

use super::{ChatterEvent, ContactEvent, GrazeEvent, ImpactEvent};
use crate::contact::sustained::ContactMode;

/// Kind of an event as stored: the numbers of `vibroimpact.EventKind` in Python.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
#[non_exhaustive]
pub enum EventKind {
    /// Index points into the impacts.
    Impact = 0,
    /// Index points into the grazes.
    Graze = 1,
    /// Index of this kind and the next four points into the contacts.
    Chatter = 2,
    /// Slides, x1' > 0.
    SlidePositive = 3,
    /// Slides, x1' < 0.
    SlideNegative = 4,
    /// Sticks.
    Stick = 5,
    /// Flight again.
    Release = 6,
    /// Index is -1.
    Stop = 7,
    /// A stop of a structure closes without friction; index points into the contacts.
    Closed = 8,
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

/// A kept event of lasting contact: the columns of `run.contacts`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs)]
pub struct ContactRecord {
    pub time: f64,
    pub period: i64,
    pub time_in_period: f64,
    /// Number of the [`EventKind`]: chatter, slide_positive, slide_negative, stick, release.
    pub kind: i64,
    pub x1: f64,
    pub v1: f64,
    pub x2: f64,
    pub v2: f64,
    pub phase: f64,
    /// Contact force just after the event.
    pub normal_force: f64,
    /// Friction on the tip just after the event.
    pub tangential_force: f64,
    /// Of chatter, else 0: impacts left out.
    pub impacts_skipped: f64,
    /// Of chatter, else 0: time from the last impact to the accumulation point.
    pub time_jump: f64,
    /// Of chatter, else 0: bound of the error of time and state.
    pub error: f64,
}

impl ContactRecord {
    /// Column names and NumPy formats, in order.
    pub const COLUMNS: &'static [(&'static str, &'static str)] = &[
        ("time", "<f8"),
        ("period", "<i8"),
        ("time_in_period", "<f8"),
        ("kind", "<i8"),
        ("x1", "<f8"),
        ("v1", "<f8"),
        ("x2", "<f8"),
        ("v2", "<f8"),
        ("phase", "<f8"),
        ("normal_force", "<f8"),
        ("tangential_force", "<f8"),
        ("impacts_skipped", "<f8"),
        ("time_jump", "<f8"),
        ("error", "<f8"),
    ];
}

impl From<&ContactEvent> for ContactRecord {
    fn from(e: &ContactEvent) -> Self {
        Self {
            time: e.time,
            period: e.clock.period,
            time_in_period: e.clock.time_in_period,
            kind: EventKind::of(e.mode) as i64,
            x1: e.state.x1,
            v1: e.state.v1,
            x2: e.state.x2,
            v2: e.state.v2,
            phase: e.phase,
            normal_force: e.force.normal,
            tangential_force: e.force.tangential,
            impacts_skipped: 0.0,
            time_jump: 0.0,
            error: 0.0,
        }
    }
}

impl From<&ChatterEvent> for ContactRecord {
    fn from(e: &ChatterEvent) -> Self {
        let ChatterEvent { clock, time, phase, state, force, .. } = *e;
        Self {
            kind: EventKind::Chatter as i64,
            impacts_skipped: e.impacts_skipped,
            time_jump: e.time_jump,
            error: e.error,
            ..Self::from(&ContactEvent { clock, time, phase, state, mode: None, force })
        }
    }
}

impl EventKind {
    /// The contact mode that an event of this number begins.
    pub(crate) fn mode(kind: i64) -> Option<ContactMode> {
        [ContactMode::SlidePositive, ContactMode::SlideNegative, ContactMode::Stick]
            .into_iter()
            .find(|&mode| Self::of(Some(mode)) as i64 == kind)
    }

    /// The kind of event that begins a contact mode, or ends contact.
    pub(crate) fn of(mode: Option<ContactMode>) -> Self {
        match mode {
            Some(ContactMode::SlidePositive) => Self::SlidePositive,
            Some(ContactMode::SlideNegative) => Self::SlideNegative,
            Some(ContactMode::Stick) => Self::Stick,
            None => Self::Release,
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
