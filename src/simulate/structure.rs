//! A linear structure with stops in the event loop: what it asks of it (model.rs).

#![allow(private_interfaces)] // nobody outside of the crate can name the trait

mod changes;
mod event;
mod lane;
mod motion;
mod strike;
mod touching;

pub use event::{
    ClosedStops, StopChatterEvent, StopContactEvent, StopGrazeEvent, StopImpactEvent,
    StructureEvent,
};
pub use motion::{Motion, StructureLeg};
pub(crate) use strike::Near;
pub use touching::{StopStart, Touching};

use serde::{Deserialize, Serialize};

use super::model::{ChatterView, Follows, Leg, Model, Skipped};
use super::{Anchor, AnchorOf, FlightStart, Observer, Phase, Simulation, Turn};
use crate::contact::chatter::{Bounce, Limit, Others, Scales};
use crate::flight::Drive;
use crate::impact::StopImpact;
use crate::model::error::StateError;
use crate::model::state::{Clock, ModelState};
use crate::model::structure::{Coordinates, Structure, StructureState, largest_number};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::lanes::LANES;
use crate::search::Start;
use crate::search::first_contact::{ContactReport, Touch};
use crate::search::gap::noise;

/// How contact goes on at the closed stops.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StructureMode {
    /// Without friction.
    Closed,
    /// One stop with friction slides, t . q' > 0.
    SlidePositive,
    /// It slides, t . q' < 0.
    SlideNegative,
    /// It sticks.
    Stick,
}

impl StructureMode {
    /// The name used in Python and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Closed => "closed",
            Self::SlidePositive => "slide_positive",
            Self::SlideNegative => "slide_negative",
            Self::Stick => "stick",
        }
    }
}

/// What a leg of a structure meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Touched {
    /// An open stop.
    Stop(u32),
    /// The force in a closed one falls through 0.
    Force(u32),
    /// The velocity of slip falls to 0.
    SlipEnds,
    /// Friction no longer holds: slip begins, t . q' > 0 or not.
    SlipBegins(bool),
}

impl Others for StructureState {
    fn count(&self) -> usize {
        2 * self.q.len()
    }

    fn at(&self, place: usize) -> f64 {
        let count = self.q.len();
        if place < count { self.q[place] } else { self.v[place - count] }
    }

    fn changed(&self, by: impl Fn(usize) -> f64) -> Self {
        let count = self.q.len();
        let part = |of: &Coordinates, first: usize| -> Coordinates {
            of.iter().enumerate().map(|(i, x)| x + by(first + i)).collect()
        };
        Self { q: part(&self.q, 0), v: part(&self.v, count) }
    }

    fn scale(&self, place: usize, scales: &Scales) -> f64 {
        if place < self.q.len() { scales.place } else { scales.speed }
    }
}

impl Model for Structure {
    type State = StructureState;
    type Impact = StopImpact;
    type Event = StructureEvent;
    type Motion = Motion;
    type Flight = StructureLeg;
    type Touched = Touched;
    type Mode = StructureMode;
    const STOPS_SLIP: bool = true;
    type Touching = Touching;
    type Others = StructureState;
    type Bits = Vec<u64>;

    fn motion(&self) -> Motion {
        Motion::new(self)
    }

    fn drive(motion: &Motion) -> &Drive {
        &motion.drive
    }

    fn span(motion: &Motion) -> f64 {
        motion.free.span()
    }

    fn rests(_: &Motion, leg: &StructureLeg) -> bool {
        leg.rests()
    }

    fn begin(&self, initial: StructureState) -> Result<AnchorOf<Self>, StateError> {
        let count = self.coordinates();
        for (name, numbers) in [("q", &initial.q), ("v", &initial.v)] {
            if numbers.len() != count {
                return Err(StateError::Shape { name, given: numbers.len(), expected: count });
            }
            if let Some(place) = numbers.iter().position(|x| !x.is_finite()) {
                let name = format!("{name}[{place}]").into();
                return Err(StateError::NotFinite { name, value: numbers[place] });
            }
        }
        let motion = Motion::new(self);
        let (mut state, mut touching) = (initial, Touching::default());
        let (mut strikes, mut lands) = (false, false);
        let speed = motion.speed(&state);
        for index in 0..self.stops().len() {
            let stop = &self.stops()[index];
            let (gap, rate) = motion.free.gap(index, Clock::START, &state.q, &state.v);
            let level = noise(stop.gap_size(&state.q));
            if gap > level {
                return Err(StateError::PenetratesStop { stop: index, gap });
            }
            if gap < -level {
                continue;
            }
            let rest = motion.rest(index, Clock::START, speed);
            let start =
                if rate > rest || rate < -rest { StopStart::Touching } else { StopStart::Landed };
            strikes |= rate > rest;
            lands |= start == StopStart::Landed;
            touching.set(index as u32, start);
            motion.free.move_onto(index, gap, &mut state.q);
        }
        let phase = if strikes {
            Phase::Strike
        } else if lands {
            Phase::Landing
        } else {
            Phase::Flight(if touching.at.is_empty() {
                FlightStart::Apart
            } else {
                FlightStart::Touching
            })
        };
        Ok(Anchor { clock: Clock::START, state, phase, touching })
    }

    fn flight(
        &self,
        motion: &Motion,
        leg: &AnchorOf<Self>,
        clock: Clock,
        state: StructureState,
    ) -> StructureLeg {
        motion.leg(leg, clock, state)
    }

    fn state_after(motion: &Motion, flight: &StructureLeg, time: DoubleDouble) -> StructureState {
        motion.state_after(flight, time)
    }

    fn state_at(motion: &Motion, flight: &StructureLeg, s: f64) -> StructureState {
        motion.state_after(flight, DoubleDouble::new(s))
    }

    fn state_within(motion: &Motion, flight: &StructureLeg, time: DoubleDouble) -> StructureState {
        motion.state_after(flight, time)
    }

    fn states_within(
        motion: &Motion,
        flight: &StructureLeg,
        times: &[DoubleDouble],
    ) -> [StructureState; LANES] {
        std::array::from_fn(|j| {
            times.get(j).map_or_else(StructureState::default, |&at| motion.state_after(flight, at))
        })
    }

    fn search(
        &self,
        motion: &Motion,
        leg: &AnchorOf<Self>,
        flight: &StructureLeg,
        start: Start,
        grazed: u32,
    ) -> ContactReport<Touched> {
        ContactReport { found: motion.search(flight, leg, start, grazed), evaluations: 0 }
    }

    fn touched(motion: &Motion, flight: &StructureLeg, touch: &Touch<Touched>) -> StructureState {
        motion.state_after(flight, DoubleDouble::sum(touch.time, touch.offset))
    }

    fn contact_of(touched: &Touched) -> u32 {
        match touched {
            Touched::Stop(stop) | Touched::Force(stop) => *stop,
            Touched::SlipEnds | Touched::SlipBegins(_) => 0,
        }
    }

    fn diverges_by_law(&self) -> bool {
        false
    }

    fn meet<O: Observer<StructureState>>(
        simulation: &mut Simulation<Self>,
        touch: &Touch<Touched>,
        observer: &mut O,
    ) -> Turn<Self> {
        match touch.state {
            Touched::Stop(stop) => simulation.strike_stop(stop, touch, observer),
            change => simulation.change_contact(change, touch),
        }
    }

    fn strike_at_start<O: Observer<StructureState>>(
        simulation: &mut Simulation<Self>,
        observer: &mut O,
    ) -> Turn<Self> {
        simulation.strike_again(observer)
    }

    fn impact_event(
        (clock, time, phase): (Clock, f64, f64),
        pre: StructureState,
        post: StructureState,
        impact: StopImpact,
    ) -> StructureEvent {
        StructureEvent::Impact(StopImpactEvent { clock, time, phase, pre, post, impact })
    }

    fn graze_event(
        (clock, time, phase): (Clock, f64, f64),
        state: StructureState,
        touch: &Touch<Touched>,
    ) -> StructureEvent {
        let stop = Self::contact_of(&touch.state) as usize;
        let gap_acceleration = touch.gap.second;
        StructureEvent::Graze(StopGrazeEvent { clock, time, phase, stop, state, gap_acceleration })
    }

    fn grazes_undecidably(&self, state: &StructureState, touched: &Touched) -> bool {
        crate::impact::approach_grows_at(self, Self::contact_of(touched) as usize, &state.v)
    }

    fn landing(
        &self,
        before: &AnchorOf<Self>,
        clock: Clock,
        state: StructureState,
        contact: u32,
        stopped: bool,
    ) -> AnchorOf<Self> {
        let mut touching = before.touching.landing(clock > before.clock);
        touching.set(contact, if stopped { StopStart::Stuck } else { StopStart::Landed });
        Anchor { clock, state, phase: Phase::Landing, touching }
    }

    fn landed(
        &self,
        motion: &Motion,
        clock: Clock,
        state: StructureState,
        contact: u32,
        stopped: bool,
    ) -> StructureState {
        motion.on_stop_at_rest(clock, state, contact as usize, stopped)
    }

    fn follows(&self, motion: &Motion, here: &AnchorOf<Self>) -> Follows<Self> {
        motion.follows(here, None)
    }

    fn contact_event(
        &self,
        motion: &Motion,
        (clock, time, phase): (Clock, f64, f64),
        before: &AnchorOf<Self>,
        after: &AnchorOf<Self>,
        _: bool,
    ) -> Option<StructureEvent> {
        let (were, closed) = (before.touching.closed_before(), after.touching.closed());
        let mode = if let Phase::Contact(mode) = after.phase { Some(mode) } else { None };
        let opened = were.iter().copied().find(|stop| !closed.contains(stop));
        let shut = closed.iter().copied().find(|stop| !were.contains(stop));
        let was = match before.phase {
            Phase::Contact(mode) => Some(mode),
            _ => before.touching.were_held,
        };
        let changed = shut.is_some() || opened.is_some() || (was.is_some() && was != mode);
        if !changed {
            return None;
        }
        let rubs = closed.iter().copied().find(|&stop| self.rubs(stop));
        let stop = shut.or(opened).or(rubs).or(closed.first().copied())?;
        let leg = motion.leg(after, clock, after.state.clone());
        let forces = Motion::forces(&leg, DoubleDouble::ZERO);
        let force = forces.iter().find(|force| force.stop == stop as usize);
        let force = force.map_or([0.0; 2], |force| [force.normal, force.tangential]);
        let event = StopContactEvent {
            clock,
            time,
            phase,
            stop: stop as usize,
            state: after.state.clone(),
            mode,
            closed,
            force,
        };
        Some(if shut.is_none() && opened.is_some() {
            StructureEvent::Release(event)
        } else {
            StructureEvent::Closed(event)
        })
    }

    fn hold<O: Observer<StructureState>>(
        simulation: &mut Simulation<Self>,
        _: StructureMode,
        observer: &mut O,
    ) -> Turn<Self> {
        // Contact is one more linear motion: its end is met as an impact is.
        simulation.fly(FlightStart::Touching, observer)
    }

    fn chatter_view(&self, impact: &StopImpact) -> ChatterView {
        ChatterView {
            regime: impact.regime.kind(),
            approach: impact.approach_velocity,
            separation: -impact.separation_velocity,
            restitution: self.stops()[impact.stop].coefficient().below(impact.approach_velocity),
            contact: impact.stop as u32,
        }
    }

    fn bounce(
        &self,
        view: &ChatterView,
        clock: Clock,
        post: &StructureState,
    ) -> Bounce<StructureState> {
        let &ChatterView { regime, separation, contact, .. } = view;
        let slip = self.slip(contact as usize, &post.v);
        Bounce { regime, separation, clock, slip, upper: false, others: post.clone() }
    }

    fn keeps_side(&self, _: &Bounce<StructureState>, _: &Limit<StructureState>) -> bool {
        true
    }

    fn gap_jet(&self, motion: &Motion, flight: &StructureLeg, contact: u32) -> [f64; 2] {
        motion.gap_jet(flight, contact)
    }

    fn limit_state(
        &self,
        motion: &Motion,
        flight: &StructureLeg,
        limit: &Limit<StructureState>,
        contact: u32,
    ) -> (StructureState, f64) {
        let clock = motion.drive.advance(flight.clock(), DoubleDouble::new(limit.time));
        let stopped = limit.slip == 0.0;
        let state = limit.others.clone();
        (motion.on_stop_at_rest(clock, state, contact as usize, stopped), 1.0)
    }

    fn scales(&self, motion: &Motion, flight: &StructureLeg, contact: u32) -> Scales {
        motion.scales(flight, contact as usize)
    }

    fn is_alone(
        &self,
        motion: &Motion,
        leg: &AnchorOf<Self>,
        flight: &StructureLeg,
        contact: u32,
        time: f64,
    ) -> bool {
        motion.is_alone(leg, flight, contact as usize, time)
    }

    fn sizes(&self, state: &StructureState, contact: u32, scales: &Scales) -> (f64, f64) {
        let stop = &self.stops()[contact as usize];
        let [place, speed] = [&state.q, &state.v].map(|of| largest_number(of));
        let size = (place / scales.place).max(speed / scales.speed);
        (size, stop.rate_size(speed, self.drive_frequency()))
    }

    fn extent(&self, state: &StructureState) -> f64 {
        let stops = self.stops().iter().map(|stop| stop.gap_size(&state.q));
        stops.fold(0.0, f64::max)
    }

    fn holds(&self, motion: &Motion, leg: &AnchorOf<Self>) -> bool {
        let contact = leg.touching.candidates();
        match motion.follows(leg, None) {
            Follows::Leg(next) => next.touching.closed().len() >= contact.len(),
            Follows::Stops(_) => false,
        }
    }

    fn chatter_event(
        &self,
        _: &Motion,
        (clock, time, phase): (Clock, f64, f64),
        leg: &AnchorOf<Self>,
        contact: u32,
        skipped: Skipped,
    ) -> StructureEvent {
        let Skipped { impacts: impacts_skipped, time_jump, error } = skipped;
        let mut closed = leg.touching.closed();
        closed.retain(|stop| *stop != contact);
        StructureEvent::Chatter(StopChatterEvent {
            clock,
            time,
            phase,
            stop: contact as usize,
            state: leg.state.clone(),
            closed,
            impacts_skipped,
            time_jump,
            error,
        })
    }

    fn after_bounces(
        &self,
        motion: &Motion,
        leg: &AnchorOf<Self>,
        (clock, state, contact): (Clock, &StructureState, u32),
        (_, _, time): (f64, f64, f64),
        stopped: bool,
    ) -> (f64, StructureState) {
        // The impulses of the bounces do what a lasting force would.
        let landed = motion.on_stop_at_rest(clock, state.clone(), contact as usize, stopped);
        let slip = self.slip(contact as usize, &landed.v);
        let mut held = self.landing(leg, clock, landed.clone(), contact, stopped);
        if let Follows::Leg(next) = motion.follows(&held, None) {
            held = next;
        }
        let there = motion.leg(&held, clock, landed);
        let after = motion.state_after(&there, DoubleDouble::new(time));
        let slip = if slip == 0.0 { 0.0 } else { self.slip(contact as usize, &after.v) };
        (slip, after)
    }

    fn separation(&self, motion: &Motion, leg: &AnchorOf<Self>, contact: u32) -> f64 {
        let StructureState { q, v } = &leg.state;
        -motion.free.gap(contact as usize, leg.clock, q, v).1
    }

    fn bits(leg: &AnchorOf<Self>) -> Vec<u64> {
        let touching = leg.touching.at.iter().map(|&(stop, how)| u64::from(stop) << 8 | how as u64);
        let mut bits = leg.state.bits();
        bits.extend(touching);
        bits
    }
}
