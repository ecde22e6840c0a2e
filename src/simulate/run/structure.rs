//! What a run keeps of a structure, and how its legs are followed.

#![allow(private_interfaces)] // nobody outside of the crate can name the traits

use super::Run;
use super::legs::{Kind, Leg};
use super::recorded::{Kept, Recorded, Row};
use super::trace::Begins;
use crate::flight::Drive;
use crate::impact::{RegimeKind, StopImpact, strike};
use crate::model::state::Clock;
use crate::model::structure::{Coordinates, Structure, StructureState};
use crate::numerics::double_double::DoubleDouble;
use crate::simulate::event::{EventKind, EventRecord};
use crate::simulate::structure::{
    ClosedStops, Motion, StopContactEvent, StopStart, StructureEvent, StructureLeg, StructureMode,
    Touching,
};
use crate::simulate::{Anchor, AnchorOf, FlightStart, Model, Phase, hops};

/// A kept impact on a stop: the columns of `run.impacts`.
#[derive(Debug, Clone, PartialEq)]
pub struct StopImpactRecord {
    /// Time since the start of the run; whole drive periods, and time since.
    pub time: f64,
    /// Whole drive periods.
    pub period: i64,
    /// Time in the period.
    pub time_in_period: f64,
    /// Phase of the drive in [0, 2 pi).
    pub phase: f64,
    /// Which stop.
    pub stop: i64,
    /// q.
    pub q: Coordinates,
    /// q' before it.
    pub v_pre: Coordinates,
    /// q' after it.
    pub v_post: Coordinates,
    /// u before.
    pub approach_velocity: f64,
    /// How friction acted.
    pub regime: RegimeKind,
    /// P >= 0, against the normal.
    pub impulse_normal: f64,
    /// Q, along the tangent.
    pub impulse_tangential: f64,
    /// Energy taken by restitution and friction.
    pub energy_loss: f64,
}

/// A kept graze of a stop: the columns of `run.grazes`.
#[derive(Debug, Clone, PartialEq)]
pub struct StopGrazeRecord {
    /// Time since the start of the run.
    pub time: f64,
    /// Whole drive periods.
    pub period: i64,
    /// Time in the period.
    pub time_in_period: f64,
    /// Phase of the drive in [0, 2 pi).
    pub phase: f64,
    /// Which stop.
    pub stop: i64,
    /// q and q'.
    pub state: StructureState,
    /// g'' there.
    pub gap_acceleration: f64,
}

/// A kept event of lasting contact: the columns of `run.contacts`.
#[derive(Debug, Clone, PartialEq)]
pub struct StopContactRecord {
    /// Time since the start of the run.
    pub time: f64,
    /// Whole drive periods.
    pub period: i64,
    /// Time in the period.
    pub time_in_period: f64,
    /// Phase of the drive in [0, 2 pi).
    pub phase: f64,
    /// Kind of the event.
    pub kind: EventKind,
    /// The stop that closes, opens or changes.
    pub stop: i64,
    /// q and q'.
    pub state: StructureState,
    /// Closed stops from now on.
    pub closed: ClosedStops,
    /// Forces at `stop` just after: against the normal, and along the tangent.
    pub force: [f64; 2],
    /// Of chatter, else 0: impacts left out.
    pub impacts_skipped: f64,
    /// Of chatter, else 0: time from the last impact to the accumulation point.
    pub time_jump: f64,
    /// Of chatter, else 0: bound of the error of time and state.
    pub error: f64,
}

macro_rules! row {
    ($record:ty) => {
        impl Row for $record {
            fn time_in_period(&self) -> f64 {
                self.time_in_period
            }

            fn moved(self, time: f64, period: i64) -> Self {
                Self { time, period, ..self }
            }
        }
    };
}

row!(StopImpactRecord);
row!(StopGrazeRecord);
row!(StopContactRecord);

/// The kind of event that begins a mode, or ends contact.
fn kind_of(mode: Option<StructureMode>) -> EventKind {
    match mode {
        Some(StructureMode::Closed) => EventKind::Closed,
        Some(StructureMode::SlidePositive) => EventKind::SlidePositive,
        Some(StructureMode::SlideNegative) => EventKind::SlideNegative,
        Some(StructureMode::Stick) => EventKind::Stick,
        None => EventKind::Release,
    }
}

fn contact_row(e: &StopContactEvent, kind: EventKind) -> StopContactRecord {
    StopContactRecord {
        time: e.time,
        period: e.clock.period,
        time_in_period: e.clock.time_in_period,
        phase: e.phase,
        kind,
        stop: e.stop as i64,
        state: e.state.clone(),
        closed: e.closed.clone(),
        force: e.force,
        impacts_skipped: 0.0,
        time_jump: 0.0,
        error: 0.0,
    }
}

/// Whether a state has the numbers of this structure.
fn has_state(structure: &Structure, StructureState { q, v }: &StructureState) -> bool {
    [q.len(), v.len()] == [structure.coordinates(); 2]
}

impl Recorded for Structure {
    type ImpactRow = StopImpactRecord;
    type GrazeRow = StopGrazeRecord;
    type ContactRow = StopContactRecord;
    type Section = StructureState;
    type Force = Vec<[f64; 2]>;
    type Follower = Follower;

    fn section(state: &StructureState) -> StructureState {
        state.clone()
    }

    fn kept(event: &StructureEvent) -> (Clock, f64, Kept<Self>) {
        match event {
            StructureEvent::Impact(e) => {
                let impact = &e.impact;
                let row = StopImpactRecord {
                    time: e.time,
                    period: e.clock.period,
                    time_in_period: e.clock.time_in_period,
                    phase: e.phase,
                    stop: impact.stop as i64,
                    q: e.pre.q.clone(),
                    v_pre: e.pre.v.clone(),
                    v_post: e.post.v.clone(),
                    approach_velocity: impact.approach_velocity,
                    regime: impact.regime.kind(),
                    impulse_normal: impact.impulse_normal,
                    impulse_tangential: impact.impulse_tangential,
                    energy_loss: impact.energy_loss,
                };
                (e.clock, e.time, Kept::Impact(row))
            }
            StructureEvent::Graze(e) => {
                let row = StopGrazeRecord {
                    time: e.time,
                    period: e.clock.period,
                    time_in_period: e.clock.time_in_period,
                    phase: e.phase,
                    stop: e.stop as i64,
                    state: e.state.clone(),
                    gap_acceleration: e.gap_acceleration,
                };
                (e.clock, e.time, Kept::Graze(row))
            }
            StructureEvent::Chatter(e) => {
                let row = StopContactRecord {
                    time: e.time,
                    period: e.clock.period,
                    time_in_period: e.clock.time_in_period,
                    phase: e.phase,
                    kind: EventKind::Chatter,
                    stop: e.stop as i64,
                    state: e.state.clone(),
                    closed: e.closed.clone(),
                    force: [0.0; 2],
                    impacts_skipped: e.impacts_skipped,
                    time_jump: e.time_jump,
                    error: e.error,
                };
                (e.clock, e.time, Kept::Contact(EventKind::Chatter, row))
            }
            StructureEvent::Closed(e) => {
                let kind = kind_of(e.mode);
                (e.clock, e.time, Kept::Contact(kind, contact_row(e, kind)))
            }
            StructureEvent::Release(e) => {
                let row = contact_row(e, EventKind::Release);
                (e.clock, e.time, Kept::Contact(EventKind::Release, row))
            }
            StructureEvent::Stop(e) => (e.clock, e.time, Kept::Nothing),
        }
    }

    fn passed_over(_: Clock, _: &StructureState) -> Option<AnchorOf<Self>> {
        // Which stops are closed is not told by the state.
        None
    }

    fn resolved(&self, row: &StopImpactRecord) -> Option<StopImpact> {
        let mut velocities = row.v_pre.clone();
        let stop = usize::try_from(row.stop).ok().filter(|&stop| stop < self.stops().len())?;
        strike(self, stop, row.approach_velocity, &mut velocities).ok()
    }

    fn has_leg(&self, leg: &AnchorOf<Self>, impact: Option<&StopImpact>) -> bool {
        let Touching { at, were_closed, pending, .. } = &leg.touching;
        let closed = at.iter().map(|(stop, _)| stop).chain(were_closed);
        let struck = pending.iter().chain(impact).map(|impact| impact.stop);
        has_state(self, &leg.state)
            && closed.map(|&stop| stop as usize).chain(struck).all(|stop| stop < self.stops().len())
    }

    fn has_rows(run: &Run<Self>) -> bool {
        let stops = run.system.stops().len();
        let is_one = |stop: i64| usize::try_from(stop).is_ok_and(|stop| stop < stops);
        let has_contact = |row: &StopContactRecord| {
            is_one(row.stop)
                && row.closed.iter().all(|&stop| is_one(i64::from(stop)))
                && has_state(&run.system, &row.state)
        };
        run.impacts.iter().all(|row| is_one(row.stop))
            && run.grazes.iter().all(|row| is_one(row.stop))
            && run.contacts.iter().all(has_contact)
    }

    fn approach(event: &StructureEvent) -> f64 {
        match event {
            StructureEvent::Impact(e) => e.impact.approach_velocity,
            _ => 0.0,
        }
    }

    const NOTES_LEGS: bool = true;

    fn begins(
        event: &StructureEvent,
        leg: &AnchorOf<Self>,
        skips: bool,
    ) -> Option<Begins<StopImpact>> {
        let flies = matches!(leg.phase, Phase::Flight(FlightStart::Touching)) && !skips;
        match event {
            StructureEvent::Graze(_) | StructureEvent::Stop(_) => None,
            StructureEvent::Impact(_) if flies && leg.touching.is_plain() => None,
            StructureEvent::Impact(e) => Some(Begins::WithImpact(e.impact)),
            _ => Some(Begins::WithContact),
        }
    }

    fn leg_after(
        run: &Run<Self>,
        event: &EventRecord,
        before: &AnchorOf<Self>,
    ) -> Option<AnchorOf<Self>> {
        let index = usize::try_from(event.index).ok()?;
        let (clock, state, closed, mode, stop) = if event.kind == EventKind::Impact as i64 {
            let row = run.impacts.get(index)?;
            let clock = Clock::new(row.period, row.time_in_period);
            let state = StructureState { q: row.q.clone(), v: row.v_post.clone() };
            let mode = if let Phase::Contact(mode) = before.phase { Some(mode) } else { None };
            (clock, state, before.touching.closed(), mode, u32::try_from(row.stop).ok())
        } else {
            let row = run.contacts.get(index)?;
            let clock = Clock::new(row.period, row.time_in_period);
            let mode = match row.kind {
                EventKind::SlidePositive => Some(StructureMode::SlidePositive),
                EventKind::SlideNegative => Some(StructureMode::SlideNegative),
                EventKind::Stick => Some(StructureMode::Stick),
                _ if row.closed.is_empty() => None,
                _ => match before.phase {
                    // Another stop closed or opened: how the one with friction is held goes on.
                    Phase::Contact(mode) if run.system.any_rubs(&row.closed) => Some(mode),
                    _ => Some(StructureMode::Closed),
                },
            };
            (clock, row.state.clone(), row.closed.clone(), mode, None)
        };
        let mut touching = Touching::default();
        for &stop in &closed {
            touching.set(stop, StopStart::Closed);
        }
        // Where an impact opens a closed stop, an event of its own says so.
        if let Some(stop) = stop.filter(|stop| !closed.contains(stop)) {
            touching.set(stop, StopStart::Touching);
        }
        let phase = match mode.filter(|_| !closed.is_empty()) {
            Some(mode) => Phase::Contact(mode),
            None => Phase::Flight(FlightStart::Touching),
        };
        Some(Anchor { clock, state, phase, touching })
    }

    fn follower(_: &Run<Self>, motion: &Motion, leg: &Leg<Self>) -> Follower {
        let anchor = &leg.anchor;
        if let Kind::Hops(_) = leg.kind {
            return Follower::Hops(Box::new(anchor.clone()));
        }
        Follower::Leg(Box::new(motion.leg(anchor, anchor.clock, anchor.state.clone())))
    }

    fn followed(
        follower: &mut Follower,
        run: &Run<Self>,
        motion: &Motion,
        leg: &Leg<Self>,
        clock: Clock,
    ) -> (StructureState, Vec<[f64; 2]>) {
        let drive = Self::drive(motion);
        let mut forces = vec![[0.0; 2]; run.system.stops().len()];
        match follower {
            Follower::Leg(flight) => {
                let elapsed = drive.until(leg.anchor.clock, clock);
                let elapsed = if elapsed.hi < 0.0 { DoubleDouble::ZERO } else { elapsed };
                for force in Motion::forces(flight, elapsed) {
                    forces[force.stop] = [force.normal, force.tangential];
                }
                (motion.state_after(flight, elapsed), forces)
            }
            Follower::Hops(last) => {
                let start = if last.clock <= clock { (**last).clone() } else { leg.anchor.clone() };
                let (state, hop) = hops(&run.system, start, clock);
                **last = hop;
                let limit = || match &leg.kind {
                    Kind::Hops(limit) => {
                        use crate::model::state::ModelState;
                        limit.clone().earlier(drive.until(clock, leg.end).value())
                    }
                    _ => leg.anchor.state.clone(),
                };
                (state.unwrap_or_else(limit), forces)
            }
        }
    }

    fn own_drive(&self) -> Drive {
        Drive::new(self.drive_frequency(), self.phase())
    }
}

impl Run<Structure> {
    /// The stop of a kept event; -1 for the end of the run.
    #[must_use]
    pub fn stop_of(&self, event: &EventRecord) -> i64 {
        let Ok(index) = usize::try_from(event.index) else { return -1 };
        let stop = if event.kind == EventKind::Impact as i64 {
            self.impacts.get(index).map(|row| row.stop)
        } else if event.kind == EventKind::Graze as i64 {
            self.grazes.get(index).map(|row| row.stop)
        } else {
            self.contacts.get(index).map(|row| row.stop)
        };
        stop.unwrap_or(-1)
    }

    /// Stops that are closed at the end.
    #[must_use]
    pub fn closed_at_end(&self) -> ClosedStops {
        self.checkpoint.anchor.touching.closed()
    }
}

/// Evaluates one leg at times that mostly increase.
pub enum Follower {
    /// A flight, or contact.
    Leg(Box<StructureLeg>),
    /// The start of the last hop looked at.
    Hops(Box<AnchorOf<Structure>>),
}
