//! Several simulations in lockstep: the first pass over each flight by itself, then all their contacts
//! and impacts at once, one in each lane of the vector registers.
//!
//! A lane does the same operations as one simulation by itself ([`Simulation::advance`]), by the same
//! functions, so that the bits do not depend on who travels together. What is not the usual case of a
//! flight between two impacts (grazes, chatter, lasting contact, slip that ends, motion near resonance
//! or beyond critical damping) is left to each simulation.

#![allow(clippy::inline_always)] // a round is compiled for several instruction sets

mod encounters;

use std::marker::PhantomData;

use self::encounters::{Ahead, Encounters};
use super::{Observer, Phase, Simulation, Takeoff, Turn};
use crate::contact::{Found, Outlook, Start, Touch, carefully, outlook};
use crate::error::SimulationError;
use crate::event::Event;
use crate::gap::{Direct, Geometry, Oblique};
use crate::impact::{self, PreImpact};
use crate::lanes::LANES;
use crate::params::{Contact, ImpactLaw};

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

/// With fewer travellers the lanes are not worth it.
const FEWEST: usize = 3;

/// Takes travellers from `next` while there is room, until it has none left, and hands each to `done`
/// after its stop.
pub(crate) fn travel<T: Traveller>(next: &mut dyn FnMut() -> Option<T>, done: &mut dyn FnMut(T)) {
    let Some(mut first) = next() else { return };
    let contact = first.parts().0.system.contact;
    let mut company = Company {
        next,
        done,
        contact,
        crew: Vec::with_capacity(LANES),
        encounters: Encounters::default(),
    };
    if let Some(traveller) = company.fitting(first) {
        company.board(traveller);
    }
    while company.crew.len() < LANES && company.another() {}
    while company.crew.len() >= FEWEST {
        let arch = pulp::Arch::new();
        match contact {
            Contact::Oblique => arch.dispatch(Round::<Oblique, T>(&mut company, PhantomData)),
            Contact::Direct => arch.dispatch(Round::<Direct, T>(&mut company, PhantomData)),
        }
    }
    for mut traveller in company.crew {
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
    crew: Vec<T>,
    encounters: Encounters,
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

    fn board(&mut self, traveller: T) {
        self.crew.push(traveller);
        self.seat(self.crew.len() - 1);
    }

    /// Lane `j` has a new traveller.
    fn seat(&mut self, j: usize) {
        let (simulation, _) = self.crew[j].parts();
        self.encounters.board(j, &simulation.system, &simulation.motion);
    }

    /// Whether one more has come aboard.
    #[inline(never)]
    fn another(&mut self) -> bool {
        while let Some(traveller) = (self.next)() {
            if let Some(traveller) = self.fitting(traveller) {
                self.board(traveller);
                return true;
            }
        }
        false
    }

    /// Traveller `j` has come to his end: another takes his lane, or the last one does.
    #[inline(never)]
    fn alight(&mut self, j: usize) {
        let traveller = self.crew.swap_remove(j);
        (self.done)(traveller);
        self.another();
        if j < self.crew.len() {
            self.seat(j);
        }
    }

    /// Everybody's next impact.
    #[inline(always)]
    fn round<G: Geometry>(&mut self) {
        let mut j = 0;
        while j < self.crew.len() {
            match look_ahead::<G, T>(&mut self.crew[j]) {
                Some(ahead) => {
                    let flight = &self.crew[j].parts().0.flight;
                    self.encounters.set::<G>(j, flight, &ahead);
                    j += 1;
                }
                None => self.alight(j),
            }
        }
        self.encounters.meet::<G>();
        self.encounters.strike::<G>();
        for (j, traveller) in self.crew.iter_mut().enumerate() {
            let (simulation, watch) = traveller.parts();
            if let Some(event) = simulation.encounter(j, &self.encounters, watch) {
                traveller.take(event);
            }
        }
    }
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

/// Goes on until a contact is seen ahead; `None` at the end.
#[inline(always)]
fn look_ahead<G: Geometry, T: Traveller>(traveller: &mut T) -> Option<Ahead> {
    loop {
        let (simulation, watch) = traveller.parts();
        if simulation.point.stopped.is_some() {
            return None;
        }
        if let Some(stop) = simulation.stop_before_leg(watch) {
            traveller.take(Ok(stop));
            return None;
        }
        if let Some(ahead) = simulation.look_ahead::<G>() {
            return Some(ahead);
        }
        if let Some(event) = simulation.turn_alone(watch) {
            traveller.take(event);
        }
    }
}

impl Simulation {
    /// Whether the usual flight of this system, and its impacts, can be done in a lane.
    fn is_plain(&self) -> bool {
        self.motion.swings() && self.system.law != ImpactLaw::Paper
    }

    /// A contact ahead that the first pass sees, if the lanes can do what follows. What else it finds is
    /// left for [`Simulation::turn_alone`].
    #[inline(always)]
    fn look_ahead<G: Geometry>(&mut self) -> Option<Ahead> {
        let Phase::Flight(takeoff @ (Takeoff::Apart | Takeoff::Touching)) = self.point.anchor.phase
        else {
            return None;
        };
        if self.found.is_some() || self.point.completion.is_some() {
            return None;
        }
        let start = self.start(takeoff);
        let span = self.motion.span;
        let (outlook, evaluations) = outlook::<G>(&self.motion, &self.flight, start, span);
        match outlook {
            Outlook::Ahead { near, bounds, .. } if self.motion.is_plain_at(near) => {
                let touching = start == Start::Touching;
                return Some(Ahead { near, bounds, touching, evaluations });
            }
            Outlook::Ahead { .. } => {}
            Outlook::Clear(time) => {
                self.evaluations += evaluations;
                self.found = Some(Found::Clear(time));
            }
            Outlook::Unsure(clear) => {
                let (motion, flight) = (&self.motion, &self.flight);
                let report = carefully::<G>(motion, flight, start, span, clear, evaluations);
                self.evaluations += report.evaluations;
                self.found = Some(report.found);
            }
        }
        None
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

    /// The contact and impact in lane `j`, or by itself where that is of no use.
    #[inline(always)]
    fn encounter<O: Observer>(
        &mut self,
        j: usize,
        encounters: &Encounters,
        observer: &mut O,
    ) -> Turn {
        let Some(touch) = encounters.contact(j) else {
            return self.turn_alone(observer);
        };
        self.evaluations += encounters.evaluations(j);
        let reached = touch.local_time();
        if self.ends_by(reached).is_some() {
            self.found = Some(Found::Contact(touch));
            return self.turn_alone(observer);
        }
        self.pass_sections_in_flight(reached, false, observer);
        let Some((pre, impact, flight)) = encounters.impact(j, self.flight.clock.period) else {
            return self.strike_alone(&touch, observer);
        };
        if impact::no_room(&self.system, &PreImpact::at(flight.angle, &pre)) {
            return self.strike_alone(&touch, observer);
        }
        self.rebound(pre, impact, flight, observer)
    }
}
