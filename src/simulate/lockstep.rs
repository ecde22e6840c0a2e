//! Several simulations in lockstep: the first pass over each flight by itself, then all their contacts
//! and impacts at once, one in each lane of the vector registers.
//!
//! A lane does the same operations as one simulation by itself ([`Simulation::advance`]), by the same
//! functions, so that the bits do not depend on who travels together. Impacts whose slip ends are resolved
//! one by one. What is not the usual case of a flight between two impacts (grazes, chatter, lasting
//! contact, motion that has decayed, bodies that creep) is left to each simulation.

#![allow(clippy::inline_always)] // a round is compiled for several instruction sets

mod encounters;
mod motions;
mod sections;

use std::marker::PhantomData;

use self::encounters::{Encounters, Sight};
use self::sections::pass_sections;
use super::{Observer, Phase, Simulation};
use crate::flight::Flight;
use crate::impact::{self, Impact, ImpactFailure, PreImpact};
use crate::model::error::SimulationError;
use crate::model::parameters::{Contact, System};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::lanes::{self, LANES};
use crate::search::first_contact::{Found, Outlook, Start, carefully};
use crate::search::gap::{Direct, Geometry, Oblique};
use crate::search::scan::{Batch, Outset, Scan, Scanner};
use crate::simulate::event::{Event, StopReason};

/// A simulation, who watches it, and what becomes of its events.
pub(crate) trait Traveller {
    /// Gets the sections.
    type Watch: Observer;
    /// The simulation and its observer.
    fn parts(&mut self) -> (&mut Simulation, &mut Self::Watch);
    /// Takes an event, the stop included.
    fn take(&mut self, event: Result<Event, SimulationError>);

    /// Goes on to the end by itself.
    fn finish(&mut self) {
        loop {
            let (simulation, watch) = self.parts();
            match simulation.advance(watch) {
                Some(event) => self.take(event),
                None => return,
            }
        }
    }
}

/// A traveller with his place among all.
impl<T: Traveller> Traveller for (usize, T) {
    type Watch = T::Watch;

    fn parts(&mut self) -> (&mut Simulation, &mut T::Watch) {
        self.1.parts()
    }

    fn take(&mut self, event: Result<Event, SimulationError>) {
        self.1.take(event);
    }
}

/// With fewer travellers the lanes are not worth it.
const FEWEST: usize = 3;

/// Takes travellers from `next` while there is room, at most so many at a time, until it has none left,
/// and hands each to `done` after its stop.
pub(crate) fn travel<T: Traveller>(
    next: &mut dyn FnMut() -> Option<T>,
    done: &mut dyn FnMut(T),
    most: usize,
) {
    let Some(mut first) = next() else { return };
    let contact = first.parts().0.system.contact;
    let mut company =
        Company { next, done, contact, crew: Default::default(), lanes: Box::default() };
    let mut first = company.fitting(first);
    for j in 0..LANES.min(most) {
        let traveller = first.take().or_else(|| company.another());
        company.seat(j, traveller);
    }
    while company.crew.iter().flatten().count() >= FEWEST {
        match contact {
            Contact::Oblique => lanes::wide(Round::<Oblique, T>(&mut company, PhantomData)),
            Contact::Direct => lanes::wide(Round::<Direct, T>(&mut company, PhantomData)),
        }
    }
    for j in 0..LANES {
        company.lanes.fetch(j, &mut company.crew[j]);
        if let Some(mut traveller) = company.crew[j].take() {
            traveller.finish();
            (company.done)(traveller);
        }
    }
}

/// Those who travel together.
struct Company<'a, T> {
    next: &'a mut dyn FnMut() -> Option<T>,
    done: &'a mut dyn FnMut(T),
    contact: Contact,
    /// Traveller j sits in lane j.
    crew: [Option<T>; LANES],
    lanes: Box<Work>,
}

/// What is being worked out, lane by lane.
#[derive(Default)]
struct Work {
    scanners: [Scanner; LANES],
    batches: [Batch; LANES],
    encounters: Encounters,
    /// 1 where a flight has begun in a lane, which also holds what its scan starts from: the simulation
    /// knows start and phase, not the bodies' constants.
    afloat: [u64; LANES],
}

impl Work {
    /// Completes the flight of the traveller in lane `j`, who may then go on by himself.
    #[inline(always)]
    fn fetch<T: Traveller>(&mut self, j: usize, traveller: &mut Option<T>) {
        if let (1, Some(traveller)) = (std::mem::take(&mut self.afloat[j]), traveller) {
            let (pendulum, oscillator) = self.encounters.bodies(j);
            let flight = &mut traveller.parts().0.flight;
            (flight.pendulum, flight.oscillator) = (pendulum, oscillator);
        }
    }
}

/// Some of the lanes, in order.
#[derive(Clone, Default)]
struct Seats {
    lanes: [usize; LANES],
    count: usize,
}

impl Seats {
    #[inline(always)]
    fn push(&mut self, j: usize) {
        self.lanes[self.count] = j;
        self.count += 1;
    }

    #[inline(always)]
    fn iter(&self) -> impl Iterator<Item = usize> {
        self.lanes.into_iter().take(self.count)
    }
}

impl<T: Traveller> Company<'_, T> {
    /// Who does not fit in goes by himself.
    fn fitting(&mut self, mut traveller: T) -> Option<T> {
        let simulation = traveller.parts().0;
        if simulation.is_plain() && simulation.system.contact == self.contact {
            return Some(traveller);
        }
        traveller.finish();
        (self.done)(traveller);
        None
    }

    /// One more who fits in, if there is one.
    #[inline(never)]
    fn another(&mut self) -> Option<T> {
        loop {
            let traveller = (self.next)()?;
            if let Some(traveller) = self.fitting(traveller) {
                return Some(traveller);
            }
        }
    }

    fn seat(&mut self, j: usize, mut traveller: Option<T>) {
        if let Some(traveller) = &mut traveller {
            let (simulation, _) = traveller.parts();
            self.lanes.encounters.board(j, &simulation.system, &simulation.motion);
        }
        self.lanes.afloat[j] = 0;
        self.crew[j] = traveller;
    }

    /// Traveller `j` has come to his end, or stops for this reason: another takes his lane.
    #[inline(never)]
    fn alight(&mut self, j: usize, reason: Option<StopReason>) {
        self.lanes.fetch(j, &mut self.crew[j]);
        if let Some(mut traveller) = self.crew[j].take() {
            if let Some(reason) = reason {
                let (simulation, _) = traveller.parts();
                let stop = simulation.stop_here(reason);
                if let Some(end) = simulation.checked(Some(Ok(stop))) {
                    traveller.take(end);
                }
            }
            (self.done)(traveller);
        }
        let another = self.another();
        self.seat(j, another);
    }

    /// Everybody's next impact. Scans go on batch by batch, all of them before any is judged: what is
    /// found decides where to go on, and would otherwise be waited for.
    #[inline(always)]
    fn round<G: Geometry>(&mut self) {
        let (mut scanning, mut ready) = (Seats::default(), Seats::default());
        for j in 0..LANES {
            self.depart::<G>(j, &mut scanning, &mut ready);
        }
        while scanning.count > 0 {
            let Work { scanners, batches, .. } = &mut *self.lanes;
            for j in scanning.iter() {
                if let Some(traveller) = &mut self.crew[j] {
                    batches[j] = scanners[j].batch::<G>(&traveller.parts().0.motion);
                }
            }
            let before = std::mem::take(&mut scanning);
            for j in before.iter() {
                match self.judge::<G>(j) {
                    Judged::Ahead => ready.push(j),
                    Judged::Open => scanning.push(j),
                    Judged::Alone => self.depart::<G>(j, &mut scanning, &mut ready),
                }
            }
        }
        let Work { encounters, .. } = &mut *self.lanes;
        encounters.meet::<G>();
        encounters.strike::<G>();
        for j in ready.iter() {
            if let (Some(pre), Some(traveller)) = (encounters.switches(j), &mut self.crew[j])
                && let Ok(impact) = resolve_alone(&traveller.parts().0.system, &pre)
                && !impact.ends_at_rest()
            {
                encounters.set_switched(j, &impact);
            }
        }
        encounters.depart::<G>();
        if T::Watch::SECTIONS {
            let mut among = ready.clone();
            while among.count > 0 {
                among = pass_sections(&mut self.crew, &among, encounters);
            }
        }
        let mut leaving = [0; LANES];
        for j in ready.iter() {
            leaving[j] = u64::from(self.end_flight(j));
        }
        let Work { encounters, afloat, .. } = &mut *self.lanes;
        encounters.proceed(&leaving);
        *afloat = leaving;
    }

    /// What becomes of the flight in lane `j` with a contact ahead; whether another begins in the
    /// lane.
    #[inline(always)]
    fn end_flight(&mut self, j: usize) -> bool {
        let Work { encounters, .. } = &*self.lanes;
        let Some(traveller) = &mut self.crew[j] else { return false };
        let (simulation, watch) = traveller.parts();
        if encounters.is_certain(j) {
            simulation.evaluations += encounters.evaluations(j);
            let (time, offset) = encounters.meets(j);
            if simulation.ends_by(time, offset, true).is_some() {
                simulation.found = Some(Found::Contact(encounters.contact(j)));
            } else if encounters.is_resolved(j) && !simulation.has_no_room(j, encounters) {
                let steady = encounters.is_steady(j);
                let chatters = simulation.take_off(j, encounters);
                if chatters || !steady {
                    let (pendulum, oscillator) = encounters.bodies_after(j);
                    let flight = &mut simulation.flight;
                    (flight.pendulum, flight.oscillator) = (pendulum, oscillator);
                }
                if chatters {
                    simulation.believe_chatter(&encounters.impact(j));
                }
                let Flight { clock, state, .. } = simulation.flight;
                if !watch.skips(clock, &state) {
                    let event = simulation.record(encounters.before(j), encounters.impact(j));
                    traveller.take(Ok(event));
                }
                return steady;
            }
        }
        self.end_alone(j);
        false
    }

    /// The same of a flight that does not end with an impact in the lane.
    #[inline(never)]
    fn end_alone(&mut self, j: usize) {
        self.lanes.fetch(j, &mut self.crew[j]);
        let encounters = &self.lanes.encounters;
        let Some(traveller) = &mut self.crew[j] else { return };
        let (simulation, watch) = traveller.parts();
        let event = if encounters.is_certain(j) && simulation.found.is_none() {
            let (time, offset) = encounters.meets(j);
            simulation.pass_sections_in_flight(DoubleDouble::sum(time, offset), false, watch);
            simulation.strike(&encounters.contact(j), watch)
        } else {
            simulation.turn(watch)
        };
        if let Some(event) = event {
            traveller.take(event);
        }
    }

    /// Goes on with lane `j` until a scan begins or a contact is ahead, or nobody is left for it.
    #[inline(always)]
    fn depart<G: Geometry>(&mut self, j: usize, scanning: &mut Seats, ready: &mut Seats) {
        loop {
            let Some(traveller) = &mut self.crew[j] else { return };
            let (simulation, _) = traveller.parts();
            let stopped = simulation.point.stopped.is_some();
            let reason = if stopped { None } else { simulation.stops_before_leg() };
            if stopped || reason.is_some() {
                self.alight(j, reason);
                continue;
            }
            let Work { scanners, encounters, afloat, .. } = &mut *self.lanes;
            if let Some(start) = simulation.scanned_from() {
                let touching = start == Start::Touching;
                let (motion, flight) = (&simulation.motion, &simulation.flight);
                let outset = if afloat[j] == 1 {
                    encounters.outset(j)
                } else {
                    let outset = Outset::new::<G>(motion, flight);
                    encounters.load::<G>(j, flight, &outset.bounds, touching);
                    outset
                };
                let scanner = &mut scanners[j];
                match scanner.begin::<G>(motion, flight, &outset, touching, motion.span) {
                    None => return scanning.push(j),
                    Some(Scan::Hop(near)) => {
                        encounters.see(j, &Sight::Near(near), scanner.evaluations);
                        return ready.push(j);
                    }
                    Some(scan) => self.go_alone::<G>(j, Some(Outlook::new(scan, outset.bounds))),
                }
            } else {
                self.go_alone::<G>(j, None);
            }
        }
    }

    /// What follows from the last batch of lane `j`.
    #[inline(never)]
    fn judge<G: Geometry>(&mut self, j: usize) -> Judged {
        let Work { scanners, batches, encounters, .. } = &mut *self.lanes;
        let Some(traveller) = &mut self.crew[j] else { return Judged::Alone };
        let scanner = &mut scanners[j];
        let Some(scan) = scanner.judge(&traveller.parts().0.motion, &batches[j]) else {
            return Judged::Open;
        };
        if let Scan::Rise(rise) = scan {
            encounters.see(j, &Sight::On(rise), scanner.evaluations);
            return Judged::Ahead;
        }
        let outlook = Outlook::new(scan, encounters.bounds(j));
        self.go_alone::<G>(j, Some(outlook));
        Judged::Alone
    }

    /// A leg of lane `j` by itself, after the first pass, if there was one.
    #[inline(never)]
    fn go_alone<G: Geometry>(&mut self, j: usize, outlook: Option<Outlook>) {
        self.lanes.fetch(j, &mut self.crew[j]);
        let Some(traveller) = &mut self.crew[j] else { return };
        let (simulation, watch) = traveller.parts();
        if let Some(outlook) = outlook {
            simulation.resolve::<G>(outlook, self.lanes.scanners[j].evaluations);
        }
        if let Some(event) = simulation.turn(watch) {
            traveller.take(event);
        }
    }
}

/// An impact whose slip ends.
#[inline(never)]
fn resolve_alone(system: &System, pre: &PreImpact) -> Result<Impact, ImpactFailure> {
    impact::resolve(system, pre)
}

/// What follows from a batch of steps.
enum Judged {
    /// A contact ahead.
    Ahead,
    /// Another batch is needed.
    Open,
    /// The traveller has gone on by himself.
    Alone,
}

/// A round, compiled for each kind of vector instructions.
struct Round<'a, 'b, G, T>(&'a mut Company<'b, T>, PhantomData<G>);

impl<G: Geometry, T: Traveller> pulp::NullaryFnOnce for Round<'_, '_, G, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.0.round::<G>();
    }
}

impl Simulation {
    /// Whether the usual flight of this system, and its impacts, can be done in a lane.
    fn is_plain(&self) -> bool {
        self.motion.swings_or_beats() && self.system.law.is_coulomb()
    }

    /// How the present flight starts, if it is to be scanned.
    #[inline(always)]
    fn scanned_from(&self) -> Option<Start> {
        let Phase::Flight(takeoff) = self.point.anchor.phase else { return None };
        if self.found.is_some() || self.point.completion.is_some() {
            return None;
        }
        Some(self.start(takeoff)).filter(|start| matches!(start, Start::Apart | Start::Touching))
    }

    /// Leaves what the first pass has found for the next turn, which finds out by itself what a
    /// contact ahead is.
    #[inline(never)]
    fn resolve<G: Geometry>(&mut self, outlook: Outlook, evaluations: u64) {
        let Phase::Flight(takeoff) = self.point.anchor.phase else { return };
        match outlook {
            Outlook::Ahead { .. } => {}
            Outlook::Clear(time) => {
                self.evaluations += evaluations;
                self.found = Some(Found::Clear(time));
            }
            Outlook::Unsure(clear) => {
                let (motion, flight) = (&self.motion, &self.flight);
                let (start, span) = (self.start(takeoff), motion.span);
                let report = carefully::<G>(motion, flight, start, span, clear, evaluations);
                self.evaluations += report.evaluations;
                self.found = Some(self.made_sure(report.found));
            }
        }
    }

    /// The flight after the impact in lane `j` begins, the bodies' constants left in the lane;
    /// whether chatter may have begun. Compiled for any processor: gathered from lanes that have
    /// just been written, numbers come late.
    #[inline(never)]
    fn take_off(&mut self, j: usize, encounters: &Encounters) -> bool {
        let (clock, state) = encounters.start_after(j, self.flight.clock.period);
        let (angle, start) = encounters.angles_after(j);
        (self.flight.clock, self.flight.state) = (clock, state);
        (self.flight.angle, self.flight.start) = (angle, start);
        let (regime, approach_velocity) = encounters.approach(j);
        self.leave(clock, state, regime, approach_velocity)
    }

    /// Whether a wall leaves the bodies no room at the contact in lane `j`.
    #[inline(always)]
    fn has_no_room(&self, j: usize, encounters: &Encounters) -> bool {
        self.system.is_wall() && encounters.meeting(j).has_no_room(&self.system)
    }
}
