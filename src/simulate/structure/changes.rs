//! How contact with the stops of a structure begins, changes and ends.

use super::motion::Motion;
use super::strike::Near;
use super::touching::StopStart;
use super::{StructureMode, Touched};
use crate::contact::closed_stops::{Landing, land};
use crate::model::state::Clock;
use crate::model::structure::{Simultaneous, Structure, StructureState};
use crate::numerics::EPS;
use crate::search::Start;
use crate::search::first_contact::Touch;
use crate::simulate::event::StopReason;
use crate::simulate::model::Follows;
use crate::simulate::tolerances::SAME_INSTANT;
use crate::simulate::{Anchor, AnchorOf, FlightStart, Observer, Phase, Simulation, Turn};

impl Motion {
    /// The state moved onto a stop, u = 0; `stopped`: and without slip there.
    pub(crate) fn on_stop_at_rest(
        &self,
        clock: Clock,
        mut state: StructureState,
        stop: usize,
        stopped: bool,
    ) -> StructureState {
        let structure = self.structure();
        let (gap, rate) = self.free.gap(stop, clock, &state.q, &state.v);
        self.free.move_onto(stop, gap, &mut state.q);
        let rows = structure.contact(stop);
        let [a, b, c] = rows.mobilities;
        // u - a P + b Q = 0, and s - b P + c Q = 0 where slip stops.
        let (normal, tangential) = if stopped && c > 0.0 {
            let slip = structure.slip(stop, &state.v);
            let determinant = a * c - b * b;
            ((c * rate - b * slip) / determinant, (b * rate - a * slip) / determinant)
        } else {
            (rate / a, 0.0)
        };
        for ((v, n), t) in state.v.iter_mut().zip(&rows.by_normal).zip(&rows.by_tangent) {
            *v += tangential * t - normal * n;
        }
        state
    }

    /// Other stops that are touched to rounding, at rates that the loads would give the structure over
    /// that rounding alone: bounces on them are lower than any digit. They may stay closed, too.
    fn touched_slowly(&self, here: &AnchorOf<Structure>) -> Vec<usize> {
        let StructureState { q, v } = &here.state;
        let slowly = |&stop: &usize| {
            let (gap, rate) = self.free.gap(stop, here.clock, q, v);
            let level = SAME_INSTANT * EPS * self.structure().stops()[stop].gap_size(q);
            gap.abs() <= level && self.is_low(stop, q, rate)
        };
        let all = 0..self.structure().stops().len();
        all.filter(|&stop| here.touching.of(stop as u32).is_none()).filter(slowly).collect()
    }

    /// What follows where some stops are closed, or touched with g' = 0.
    /// `slip_ended`: one of them whose slip has just stopped.
    pub(crate) fn follows(
        &self,
        here: &AnchorOf<Structure>,
        slip_ended: Option<usize>,
    ) -> Follows<Structure> {
        let structure = self.structure();
        let StructureState { q, v } = &here.state;
        let speed = self.speed(&here.state).max(here.touching.speed);
        let mut touching = here.touching.clone();
        touching.were_closed.clear();
        (touching.were_held, touching.speed) = (None, 0.0);
        let mut candidates = Vec::new();
        let stuck = touching.at.iter().find(|(_, start)| *start == StopStart::Stuck);
        let slip_ended = slip_ended.or(stuck.map(|&(stop, _)| stop as usize));
        for stop in touching.candidates() {
            // An impact elsewhere has pulled it off.
            let (_, rate) = self.free.gap(stop as usize, here.clock, q, v);
            if rate < -self.rest(stop as usize, here.clock, speed) {
                touching.set(stop, StopStart::Touching);
            } else {
                candidates.push(stop as usize);
            }
        }
        candidates.extend(self.touched_slowly(here));
        let (closed, leaving) = match land(structure, here.clock, (q, v), &candidates, slip_ended) {
            Landing::Hold { closed, leaving } => (Some(closed), leaving),
            Landing::Separate { leaving } => (None, leaving),
            Landing::Painleve => return Follows::Stops(StopReason::Painleve),
            Landing::TooManyWithFriction => {
                return Follows::Stops(StopReason::SeveralFrictional);
            }
        };
        for &stop in &candidates {
            touching.set(stop as u32, StopStart::Closed);
        }
        for (stop, start) in leaving {
            let start = match start {
                Start::Released => StopStart::Released,
                Start::Grazed(_) => StopStart::Separating,
                Start::Touching | Start::Apart => StopStart::Touching,
            };
            touching.set(stop as u32, start);
        }
        let phase = match &closed {
            Some(closed) => Phase::Contact(StructureMode::of(closed)),
            None => Phase::Flight(FlightStart::Touching),
        };
        Follows::Leg(Anchor { clock: here.clock, state: here.state.clone(), phase, touching })
    }
}

impl Simulation<Structure> {
    /// A stop is met.
    pub(super) fn strike_stop<O: Observer<StructureState>>(
        &mut self,
        stop: u32,
        touch: &Touch<Touched>,
        observer: &mut O,
    ) -> Turn<Structure> {
        let clock = self.impact_clock(touch.time, touch.offset);
        let elapsed = crate::numerics::double_double::DoubleDouble::sum(touch.time, touch.offset);
        let mut pre = self.motion.state_after(&self.flight, elapsed);
        let free = &self.motion.free;
        let (gap, _) = free.gap(stop as usize, clock, &pre.q, &pre.v);
        free.move_onto(stop as usize, gap, &mut pre.q);
        self.strike_from(clock, pre, stop, observer)
    }

    fn strike_from<O: Observer<StructureState>>(
        &mut self,
        clock: Clock,
        mut pre: StructureState,
        stop: u32,
        observer: &mut O,
    ) -> Turn<Structure> {
        let before = &self.point.anchor;
        let near = self.motion.near(clock, &pre, before.touching.speed);
        let stop = self.first_in_sequence(&near, stop);
        pre.q = self.motion.on_stops(clock, &near, pre.q);
        let (_, rate) = self.motion.free.gap(stop as usize, clock, &pre.q, &pre.v);
        // The search knows that it approaches, also where that is below rounding.
        let approach = rate.max(f64::MIN_POSITIVE);
        let struck = self.motion.strike(clock, before, pre, &near, stop, approach);
        self.point.monitor.at_contact(stop);
        self.rebound(clock, struck, observer)
    }

    /// The lowest number of those that approach at this instant, where one impact follows another.
    fn first_in_sequence(&self, near: &[Near], stop: u32) -> u32 {
        if self.system.simultaneous() != Simultaneous::Sequence {
            return stop;
        }
        let approaching = near.iter().filter(|at| at.moves && at.rate > 0.0);
        approaching.map(|at| at.stop).min().map_or(stop, |lowest| lowest.min(stop))
    }

    /// The next impact of an instant at which several stops are struck, or the first of a start.
    pub(super) fn strike_again<O: Observer<StructureState>>(
        &mut self,
        observer: &mut O,
    ) -> Turn<Structure> {
        let Anchor { clock, ref state, ref touching, .. } = self.point.anchor;
        if let Some(struck) = self.motion.next_pending(clock, touching, state.clone()) {
            return self.rebound(clock, struck, observer);
        }
        let near = self.motion.near(clock, state, touching.speed);
        let next = near.iter().find(|at| at.moves && at.rate > 0.0).map(|at| at.stop);
        if let Some(stop) = next {
            let pre = state.clone();
            return self.strike_from(clock, pre, stop, observer);
        }
        let phase = Phase::Landing;
        let leg = Anchor { clock, state: state.clone(), phase, touching: touching.clone() };
        self.begin_leg(leg);
        None
    }

    /// Contact ends or changes at a local time of a leg.
    pub(super) fn change_contact(
        &mut self,
        change: Touched,
        touch: &Touch<Touched>,
    ) -> Turn<Structure> {
        let clock = self.clock_after(touch.time, touch.offset);
        let elapsed = crate::numerics::double_double::DoubleDouble::sum(touch.time, touch.offset);
        let state = self.motion.state_after(&self.flight, elapsed);
        let anchor = &self.point.anchor;
        let mut touching = anchor.touching.after(clock > anchor.clock);
        let mut here = Anchor { clock, state, phase: Phase::Landing, touching: touching.clone() };
        let slide = |positive: bool| {
            if positive { StructureMode::SlidePositive } else { StructureMode::SlideNegative }
        };
        let follows = match change {
            Touched::Force(stop) => {
                self.point.contact = stop;
                touching.set(stop, StopStart::Released);
                here.touching = touching;
                self.motion.follows(&here, None)
            }
            Touched::SlipBegins(positive) => {
                let closed = slide(positive).holds(&self.system, &touching.closed());
                if self.motion.held(closed).is_some() {
                    let phase = Phase::Contact(slide(positive));
                    Follows::Leg(Anchor { phase, ..here.clone() })
                } else {
                    // Slip this way would press the stop together.
                    Follows::Stops(StopReason::Painleve)
                }
            }
            Touched::SlipEnds | Touched::Stop(_) => {
                let rubs = touching.closed().into_iter().find(|&stop| self.system.rubs(stop));
                let rubs = rubs.map(|stop| stop as usize);
                if let Some(stop) = rubs {
                    self.point.contact = stop as u32;
                    here.state = self.motion.on_stop_at_rest(clock, here.state, stop, true);
                }
                self.motion.follows(&here, rubs)
            }
        };
        self.continue_with(&here, follows, true)
    }
}
