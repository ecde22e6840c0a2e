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

use std::marker::PhantomData;

use self::encounters::{Ahead, Encounters, Sight};
use super::{Observer, Phase, Simulation, Turn};
use crate::contact::{Found, Outlook, Start, Touch, carefully};
use crate::error::SimulationError;
use crate::event::Event;
use crate::flight::Flight;
use crate::gap::{Direct, GapBounds, Geometry, Oblique};
use crate::impact::{self, Impact, ImpactFailure, PreImpact};
use crate::lanes::{self, LANES};
use crate::params::{Contact, ImpactLaw, System};
use crate::scan::{Batch, Outset, Scan, Scanner};
use crate::state::State;

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
    for mut traveller in company.crew.into_iter().flatten() {
        traveller.finish();
        (company.done)(traveller);
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
    /// What the next scans start from, where that is known.
    outsets: [Option<Outset>; LANES],
    bounds: [GapBounds; LANES],
    batches: [Batch; LANES],
    encounters: Encounters,
}

/// Some of the lanes, in order.
#[derive(Default)]
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
            self.lanes.outsets[j] = None;
        }
        self.crew[j] = traveller;
    }

    /// Traveller `j` has come to his end: another takes his lane.
    #[inline(never)]
    fn alight(&mut self, j: usize) {
        if let Some(traveller) = self.crew[j].take() {
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
        let Work { encounters, outsets, .. } = &mut *self.lanes;
        encounters.meet::<G>();
        encounters.strike::<G>();
        for j in ready.iter() {
            if let (Some(pre), Some(traveller)) = (encounters.bends(j), &mut self.crew[j])
                && let Ok(impact) = resolve_alone(&traveller.parts().0.system, &pre)
            {
                encounters.bend(j, &impact);
            }
        }
        encounters.depart::<G>();
        if T::Watch::SECTIONS {
            while pass_sections(&mut self.crew, &ready, encounters) {}
        }
        for j in ready.iter() {
            let Some(traveller) = &mut self.crew[j] else { continue };
            outsets[j] = None;
            let (simulation, watch) = traveller.parts();
            let event = match simulation.encounter(j, encounters, watch) {
                Encounter::Alone => simulation.turn_alone(watch),
                Encounter::Struck(touch) => simulation.strike_alone(&touch, watch),
                Encounter::Usual { pre, impact, flight } => {
                    outsets[j] = encounters.outset(j);
                    simulation.rebound(pre, impact, flight, watch)
                }
            };
            if let Some(event) = event {
                traveller.take(event);
            }
        }
    }

    /// Goes on with lane `j` until a scan begins or a contact is ahead, or nobody is left for it.
    #[inline(always)]
    fn depart<G: Geometry>(&mut self, j: usize, scanning: &mut Seats, ready: &mut Seats) {
        loop {
            let Some(traveller) = &mut self.crew[j] else { return };
            let (simulation, watch) = traveller.parts();
            let stop = if simulation.point.stopped.is_some() {
                None
            } else if let Some(stop) = simulation.stop_before_leg(watch) {
                Some(stop)
            } else {
                let Work { scanners, outsets, bounds, encounters, .. } = &mut *self.lanes;
                let outset = outsets[j].take();
                if let Some(start) = simulation.scanned_from() {
                    let touching = start == Start::Touching;
                    let (motion, flight) = (&simulation.motion, &simulation.flight);
                    let outset = outset.unwrap_or_else(|| Outset::new::<G>(motion, flight));
                    bounds[j] = outset.bounds;
                    let scanner = &mut scanners[j];
                    match scanner.begin::<G>(motion, flight, &outset, touching, motion.span) {
                        None => return scanning.push(j),
                        Some(Scan::Hop(near)) => {
                            let (bounds, evaluations) = (outset.bounds, scanner.evaluations);
                            let sight = Sight::Near(near);
                            let ahead = Ahead { sight, bounds, touching, evaluations };
                            encounters.set::<G>(j, flight, &ahead);
                            return ready.push(j);
                        }
                        Some(scan) => {
                            let outlook = Outlook::new(scan, outset.bounds);
                            simulation.resolve::<G>(outlook, scanner.evaluations);
                        }
                    }
                }
                if let Some(event) = simulation.turn_alone(watch) {
                    traveller.take(event);
                }
                continue;
            };
            if let Some(stop) = stop {
                traveller.take(Ok(stop));
            }
            self.alight(j);
        }
    }

    /// What follows from the last batch of lane `j`.
    #[inline(always)]
    fn judge<G: Geometry>(&mut self, j: usize) -> Judged {
        let Work { scanners, bounds, batches, encounters, .. } = &mut *self.lanes;
        let Some(traveller) = &mut self.crew[j] else { return Judged::Alone };
        let (simulation, watch) = traveller.parts();
        let Some(scan) = scanners[j].judge(&simulation.motion, &batches[j]) else {
            return Judged::Open;
        };
        let evaluations = scanners[j].evaluations;
        if let Scan::Rise(rise) = scan {
            let touching = simulation.scanned_from() == Some(Start::Touching);
            let ahead = Ahead { sight: Sight::On(rise), bounds: bounds[j], touching, evaluations };
            encounters.set::<G>(j, &simulation.flight, &ahead);
            return Judged::Ahead;
        }
        simulation.resolve::<G>(Outlook::new(scan, bounds[j]), evaluations);
        if let Some(event) = simulation.turn_alone(watch) {
            traveller.take(event);
        }
        Judged::Alone
    }
}

/// Passes the next section of every flight that has one before its contact; whether any has.
#[inline(always)]
fn pass_sections<T: Traveller>(
    crew: &mut [Option<T>; LANES],
    ready: &Seats,
    encounters: &mut Encounters,
) -> bool {
    let (mut times, mut passing) = (*encounters.near(), Seats::default());
    for j in ready.iter() {
        let (Some(traveller), Some(touch)) = (&mut crew[j], encounters.contact(j)) else {
            continue;
        };
        let (simulation, _) = traveller.parts();
        if let Some(time) = simulation.section_before(touch.local_time()) {
            times[j] = time;
            passing.push(j);
        }
    }
    if passing.count == 0 {
        return false;
    }
    encounters.pass(&times);
    for j in passing.iter() {
        if let Some(traveller) = &mut crew[j] {
            let (simulation, watch) = traveller.parts();
            simulation.pass_section(&encounters.state(j), watch);
        }
    }
    true
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
        self.motion.swings_or_beats() && self.system.law != ImpactLaw::Paper
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

    /// Leaves what the first pass has found for [`Simulation::turn_alone`], which finds out by itself what
    /// a contact ahead is.
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
                self.found = Some(report.found);
            }
        }
    }

    /// Local time of the next section, if that lies before a contact that ends the flight, and its state is
    /// had from a lane.
    #[inline(always)]
    fn section_before(&self, contact: f64) -> Option<f64> {
        let at = self.section_by(contact, false)?;
        let time = at.value();
        let usual = at.hi <= self.motion.span && !self.motion.decays_by(time);
        (usual && self.ends_by(contact).is_none()).then_some(time)
    }

    /// A leg by itself.
    #[inline(never)]
    fn turn_alone<O: Observer>(&mut self, observer: &mut O) -> Turn {
        self.turn(observer)
    }

    #[inline(never)]
    fn strike_alone<O: Observer>(&mut self, touch: &Touch, observer: &mut O) -> Turn {
        self.strike(touch, observer)
    }

    /// What has become of the flight in lane `j`; sections before the contact are passed.
    #[inline(always)]
    fn encounter<O: Observer>(
        &mut self,
        j: usize,
        encounters: &Encounters,
        observer: &mut O,
    ) -> Encounter {
        let Some(touch) = encounters.contact(j) else { return Encounter::Alone };
        self.evaluations += encounters.evaluations(j);
        let reached = touch.local_time();
        if self.ends_by(reached).is_some() {
            self.found = Some(Found::Contact(touch));
            return Encounter::Alone;
        }
        self.pass_sections_in_flight(reached, false, observer);
        let Some((pre, impact, flight)) = encounters.impact(j, self.flight.clock.period) else {
            return Encounter::Struck(touch);
        };
        if impact::no_room(&self.system, &PreImpact::at(flight.angle, &pre)) {
            return Encounter::Struck(touch);
        }
        Encounter::Usual { pre, impact, flight }
    }
}

/// What becomes of a flight with a contact ahead.
#[allow(clippy::large_enum_variant)] // none is ever stored
enum Encounter {
    /// Nothing that is of use.
    Alone,
    /// A contact.
    Struck(Touch),
    /// A contact, an impact, and the next flight.
    Usual { pre: State, impact: Impact, flight: Flight },
}
