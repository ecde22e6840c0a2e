//! The motion of a structure between events: free flights, and legs with closed stops.

use std::sync::{Arc, Mutex};

use smallvec::SmallVec;

use super::touching::StopStart;
use super::{StructureMode, Touched};
use crate::contact::chatter::Scales;
use crate::flight::structure::{
    Closed, LegEvent, LinearFlight, LinearMotion, StopForce, Transitions,
};
use crate::flight::{Drive, StopContact, StructureFlight, StructureMotion};
use crate::model::state::Clock;
use crate::model::structure::{Coordinates, Structure, StructureState, largest_number};
use crate::numerics::EPS;
use crate::numerics::double_double::DoubleDouble;
use crate::search::Start;
use crate::search::first_contact::{Found, Touch};
use crate::search::gap::GapPoint;
use crate::search::tolerances::{REST_NOISE, REST_TIME};
use crate::simulate::model::Leg;
use crate::simulate::{AnchorOf, Phase};

/// What the legs of a structure have in common.
#[derive(Debug)]
pub struct Motion {
    pub(super) free: StructureMotion,
    pub(super) drive: Drive,
    /// Of each gap, the largest acceleration by loads and drive.
    pub(super) loads: Vec<f64>,
    /// By set of closed stops, as they come up.
    closed: Mutex<Vec<Arc<LinearMotion>>>,
}

impl Clone for Motion {
    fn clone(&self) -> Self {
        let closed = self.closed.lock().map_or_else(|_| Vec::new(), |closed| closed.clone());
        let (free, loads) = (self.free.clone(), self.loads.clone());
        Self { free, drive: self.drive, loads, closed: Mutex::new(closed) }
    }
}

/// A leg of a structure: it starts at some instant, and is evaluated at local times.
#[derive(Debug, Clone)]
pub struct StructureLeg {
    clock: Clock,
    pub(super) state: StructureState,
    kind: LegKind,
}

#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "free flights are usual, and take no memory")]
enum LegKind {
    Free(StructureFlight),
    Closed(Arc<LinearMotion>, Box<LinearFlight>),
}

impl StructureLeg {
    /// The free flight, if it is one.
    #[inline(always)]
    #[allow(clippy::inline_always)] // in the lanes
    pub(crate) fn free(&self) -> Option<&StructureFlight> {
        if let LegKind::Free(flight) = &self.kind { Some(flight) } else { None }
    }

    /// The same, to be written over.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(super) fn free_mut(&mut self) -> Option<&mut StructureFlight> {
        if let LegKind::Free(flight) = &mut self.kind { Some(flight) } else { None }
    }

    /// Another free flight has taken its place, from this clock, q and v.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(super) fn restart(&mut self, clock: Clock, (q, v): (&[f64], &[f64])) {
        self.clock = clock;
        self.state.q.copy_from_slice(q);
        self.state.v.copy_from_slice(v);
    }

    /// Whether nothing will ever end or move it.
    pub(super) fn rests(&self) -> bool {
        match &self.kind {
            LegKind::Free(_) => false,
            LegKind::Closed(motion, flight) => motion.rests(flight),
        }
    }
}

impl Leg<StructureState> for StructureLeg {
    fn clock(&self) -> Clock {
        self.clock
    }

    fn later_by(&mut self, periods: i64) {
        self.clock.period += periods;
    }

    fn state(&self) -> &StructureState {
        &self.state
    }
}

impl StructureMode {
    /// These stops, held so.
    pub(crate) fn holds(self, structure: &Structure, stops: &[u32]) -> Closed {
        let rubs = |stop: &u32| structure.stops()[*stop as usize].friction() > 0.0;
        let stop = stops.iter().copied().find(rubs).unwrap_or(0) as usize;
        let all = stops.iter().map(|&stop| stop as usize);
        let beside = all.clone().filter(|&other| other != stop).collect();
        match self {
            Self::Closed => Closed::Frictionless(all.collect()),
            Self::SlidePositive => Closed::Slide { stop, direction: 1.0, beside },
            Self::SlideNegative => Closed::Slide { stop, direction: -1.0, beside },
            Self::Stick => Closed::Stick { stop, beside },
        }
    }

    /// How these stops are held.
    pub(super) fn of(closed: &Closed) -> Self {
        match closed {
            Closed::Frictionless(_) => Self::Closed,
            Closed::Slide { direction, .. } if *direction > 0.0 => Self::SlidePositive,
            Closed::Slide { .. } => Self::SlideNegative,
            Closed::Stick { .. } => Self::Stick,
        }
    }
}

impl Motion {
    pub fn new(structure: &Structure) -> Self {
        let load = |stop: usize| {
            let parts = structure.contact(stop).modal_normal.iter().zip(structure.modes());
            parts.map(|(n, mode)| n.hi.abs() * (mode.load.abs() + mode.drive.norm())).sum()
        };
        Self {
            free: StructureMotion::new(structure),
            drive: Drive::new(structure.drive_frequency(), structure.phase()),
            loads: (0..structure.stops().len()).map(load).collect(),
            closed: Mutex::new(Vec::new()),
        }
    }

    /// A velocity that this motion may have: what is small beside it is rounding. Where nothing turns
    /// coordinates give none.
    pub(super) fn speed(&self, state: &StructureState) -> f64 {
        largest_number(&state.v) + largest_number(&state.q) / self.free.longest()
    }

    /// Scales of the motion at the start of a flight on a stop, by which it is known how well the
    /// end of chatter there is: the time so far, of a local flight at most, and what the
    /// acceleration onto the stop does in it beside the present coordinates and velocities, which
    /// may all be zero at the end.
    pub(super) fn scales(&self, leg: &StructureLeg, stop: usize) -> Scales {
        let time = self.drive.time(leg.clock).min(self.free.span()).max(f64::MIN_POSITIVE);
        let rows = self.structure().contact(stop);
        let [second, _] = self.gap_jet(leg, stop as u32);
        let rate = second.abs() * time;
        let speed = rate / rows.mobilities[0] * largest_number(&rows.by_normal);
        let [q, v] = [&leg.state.q, &leg.state.v].map(|of| largest_number(of));
        let drive = self.drive.omega;
        let moved = self.structure().stops()[stop].rate_size(v, drive);
        Scales {
            time,
            place: q + speed * time,
            speed: v + speed,
            rate: moved + rate,
            slip: f64::INFINITY,
        }
    }

    /// Whether no open stop but this one can be met while it chatters for so long from the start of a
    /// flight. With |n . q'| <= sqrt(a 2E), a = n M^-1 n, the root of 2E grows no faster than by the
    /// norm of the loads, and in impacts by that of their impulses, which add up to less than what
    /// would hold the stop; twice all of it leaves room for friction and for stops that move.
    pub(super) fn is_alone(
        &self,
        anchor: &AnchorOf<Structure>,
        leg: &StructureLeg,
        stop: usize,
        time: f64,
    ) -> bool {
        let structure = self.structure();
        let StructureState { q, v } = &leg.state;
        let (mut energy, mut loads) = (0.0, 0.0);
        for mode in structure.modes() {
            let (place, rate) = (mode.frequency.value() * mode.along(q), mode.along(v));
            energy += place * place + rate * rate;
            let load = mode.load.abs() + mode.drive.norm();
            loads += load * load;
        }
        let mobility = |stop: usize| structure.contact(stop).mobilities[0];
        let [second, _] = self.gap_jet(leg, stop as u32);
        let held = second.abs() / mobility(stop).sqrt();
        let most = 2.0 * (energy.sqrt() + time * (loads.sqrt() + held));
        let closed = anchor.touching.closed();
        let mut others = (0..structure.stops().len())
            .filter(|&other| other != stop && !closed.contains(&(other as u32)));
        others.all(|other| {
            let own = (structure.stops()[other].amplitude() * self.drive.omega).abs();
            let (gap, _) = self.free.gap(other, leg.clock, q, v);
            gap < -time * (mobility(other).sqrt() * most + own)
        })
    }

    /// The time that velocities have had to grow, and of which the clock has the rounding: all of it
    /// so far, but no more than a local flight. By this, and not by the length of a local flight
    /// alone, a soft spring is no different from none.
    pub(super) fn time_scale(&self, clock: Clock) -> f64 {
        self.drive.time(clock).min(self.free.longest())
    }

    /// A rate of a gap below this is rounding, where velocities are up to `speed`. Bounces of less
    /// than this are over within the rounding of the clock.
    pub(super) fn rest(&self, stop: usize, clock: Clock, speed: f64) -> f64 {
        let moved = self.structure().stops()[stop].rate_size(speed, self.drive.omega);
        REST_NOISE * EPS * (moved + self.loads[stop] * REST_TIME * self.time_scale(clock))
    }

    pub(super) fn structure(&self) -> &Structure {
        self.free.structure()
    }

    /// Gap of a stop and its rate u in a state.
    pub(crate) fn gap(&self, stop: usize, clock: Clock, state: &StructureState) -> (f64, f64) {
        self.free.gap(stop, clock, &state.q, &state.v)
    }

    /// The motion while these stops stay closed; `None`: no force does it.
    pub(super) fn held(&self, closed: Closed) -> Option<Arc<LinearMotion>> {
        let Ok(mut known) = self.closed.lock() else { return None };
        if let Some(found) = known.iter().find(|motion| *motion.closed() == closed) {
            return Some(Arc::clone(found));
        }
        let made = Arc::new(LinearMotion::new(self.structure(), closed)?);
        known.push(Arc::clone(&made));
        Some(made)
    }

    /// The leg of this kind from an instant on. One that no force holds is a free one.
    pub fn leg(
        &self,
        leg: &AnchorOf<Structure>,
        clock: Clock,
        state: StructureState,
    ) -> StructureLeg {
        let kind = match self.held_in(leg) {
            Some(motion) => {
                let flight = motion.flight(clock, &state.q, &state.v);
                LegKind::Closed(motion, Box::new(flight))
            }
            None => LegKind::Free(self.free.flight(clock, &state.q, &state.v)),
        };
        StructureLeg { clock, state, kind }
    }

    /// What holds the closed stops of a leg; `None` of a free one, and where no force does it.
    fn held_in(&self, leg: &AnchorOf<Structure>) -> Option<Arc<LinearMotion>> {
        match leg.phase {
            Phase::Contact(mode) => self.held(mode.holds(self.structure(), &leg.touching.closed())),
            _ => None,
        }
    }

    /// Carries states q, v, one after another, along a leg of this kind from t = 0 on; of a structure
    /// without loads and drive.
    pub(crate) fn carry(
        &self,
        leg: &AnchorOf<Structure>,
        elapsed: DoubleDouble,
        states: &mut [f64],
    ) {
        let Some(motion) = self.held_in(leg) else { return self.free.carry(elapsed, states) };
        let count = self.structure().coordinates();
        for state in states.chunks_exact_mut(2 * count) {
            let (q, v) = state.split_at_mut(count);
            let after = motion.state_after(&motion.flight(Clock::START, q, v), elapsed);
            q.copy_from_slice(&after.0);
            v.copy_from_slice(&after.1);
        }
    }

    /// What becomes of the modes after a time of free flight; `None` where damping couples them.
    pub(crate) fn transitions(&self, elapsed: DoubleDouble) -> Option<Transitions> {
        self.free.transitions(elapsed)
    }

    /// Dimension of the states that a leg of this kind has.
    pub(crate) fn dimension(&self, leg: &AnchorOf<Structure>) -> usize {
        self.held_in(leg).map_or(2 * self.structure().coordinates(), |motion| motion.dimension())
    }

    /// State at a local time.
    pub fn state_after(&self, leg: &StructureLeg, elapsed: DoubleDouble) -> StructureState {
        match &leg.kind {
            LegKind::Free(flight) => self.free.state_at(flight, elapsed),
            LegKind::Closed(motion, flight) => {
                let (q, v) = motion.state_after(flight, elapsed);
                StructureState { q: Coordinates::from_vec(q), v: Coordinates::from_vec(v) }
            }
        }
    }

    /// Forces in the closed stops at a local time.
    pub fn forces(leg: &StructureLeg, elapsed: DoubleDouble) -> Vec<StopForce> {
        match &leg.kind {
            LegKind::Free(_) => Vec::new(),
            LegKind::Closed(motion, flight) => motion.forces(flight, elapsed),
        }
    }

    /// g'' and g''' of an open stop at the start of a leg.
    pub(super) fn gap_jet(&self, leg: &StructureLeg, stop: u32) -> [f64; 2] {
        let GapPoint { second, third, .. } = match &leg.kind {
            LegKind::Free(flight) => self.free.gap_at_start(flight, stop as usize),
            LegKind::Closed(motion, flight) => motion.gap_at_start(flight, stop as usize),
        };
        [second, third]
    }

    /// What a leg meets first.
    pub(super) fn search(
        &self,
        leg: &StructureLeg,
        anchor: &AnchorOf<Structure>,
        start: Start,
        grazed: u32,
    ) -> Found<Touched> {
        let mut starts = SmallVec::<[(usize, Start); 4]>::new();
        if let Start::Grazed(_) = start {
            starts.push((grazed as usize, start));
        }
        if leg.clock == anchor.clock {
            for &(stop, how) in &anchor.touching.at {
                let begins = match how {
                    StopStart::Touching => Start::Touching,
                    StopStart::Separating => Start::Grazed(0.0),
                    StopStart::Released => Start::Released,
                    StopStart::Closed | StopStart::Landed | StopStart::Stuck => continue,
                };
                // The first one counts: that of a graze later in the flight.
                starts.push((stop as usize, begins));
            }
        }
        let met = |touched: Touched, time: f64, offset: f64| {
            Found::Contact(Touch { time, offset, gap: GapPoint::default(), state: touched })
        };
        let touch = |stop: usize, time: f64| {
            let clock = self.drive.advance(leg.clock, DoubleDouble::new(time));
            let there = self.state_after(leg, DoubleDouble::new(time));
            let there = self.again(leg, clock, there);
            let [second, third] = self.gap_jet(&there, stop as u32);
            let gap = GapPoint { second, third, ..GapPoint::default() };
            Touch { time, offset: 0.0, gap, state: Touched::Stop(stop as u32) }
        };
        match &leg.kind {
            LegKind::Free(flight) => match self.free.next_contact(flight, &starts) {
                StopContact::Met { stop, time, offset } => {
                    met(Touched::Stop(stop as u32), time, offset)
                }
                StopContact::Grazed { stop, time } => Found::Graze(touch(stop, time)),
                StopContact::Resting { stop, time } => Found::Resting(touch(stop, time)),
                StopContact::Clear(time) => Found::Clear(time),
                StopContact::Failed { .. } => Found::NotFinite,
            },
            LegKind::Closed(motion, flight) => match motion.next_event(flight, &starts) {
                LegEvent::Met { stop, time, offset } => {
                    met(Touched::Stop(stop as u32), time, offset)
                }
                LegEvent::Grazed { stop, time } => Found::Graze(touch(stop, time)),
                LegEvent::Resting { stop, time } => Found::Resting(touch(stop, time)),
                LegEvent::Released { stop, time, offset } => {
                    met(Touched::Force(stop as u32), time, offset)
                }
                LegEvent::SlipEnds { time, offset } => met(Touched::SlipEnds, time, offset),
                LegEvent::SlipBegins { direction, time, offset } => {
                    met(Touched::SlipBegins(direction > 0.0), time, offset)
                }
                LegEvent::Clear(time) => Found::Clear(time),
                LegEvent::Failed { .. } => Found::NotFinite,
            },
        }
    }

    /// A leg of the same kind from another instant on.
    fn again(&self, leg: &StructureLeg, clock: Clock, state: StructureState) -> StructureLeg {
        let kind = match &leg.kind {
            LegKind::Free(_) => LegKind::Free(self.free.flight(clock, &state.q, &state.v)),
            LegKind::Closed(motion, _) => {
                let flight = motion.flight(clock, &state.q, &state.v);
                LegKind::Closed(Arc::clone(motion), Box::new(flight))
            }
        };
        StructureLeg { clock, state, kind }
    }
}
