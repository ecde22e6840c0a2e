//! A simulation for a lane, and what goes beside it there.

#![allow(clippy::inline_always)] // a round is compiled for several instruction sets

use super::Laned;
use super::impacts::ImpactLanes;
use crate::model::error::SimulationError;
use crate::model::tip::Tip;
use crate::simulate::{Leg, Model, Observer, Simulation};

/// A simulation for a lane, with its observer and with what takes its events.
pub(crate) trait Job {
    /// What moves.
    type Model: Laned;
    /// The observer, which gets the sections.
    type Watch: Observer<<Self::Model as Model>::State>;
    /// What goes beside the motion in the lane: `()` for nothing.
    type Beside: Companion;
    /// The simulation and its observer.
    fn parts(&mut self) -> (&mut Simulation<Self::Model>, &mut Self::Watch);
    /// Takes an event, the stop included.
    fn take(&mut self, event: Result<<Self::Model as Model>::Event, SimulationError>);

    /// What goes beside the motion, if anything does, and the simulation.
    #[inline(always)]
    fn companion(&mut self) -> Option<(&mut Self::Beside, &Simulation<Self::Model>)> {
        None
    }

    /// Whether the impact from which the present flight begins is passed over: nothing is kept of
    /// it.
    #[inline(always)]
    fn skips(&mut self) -> bool {
        let (simulation, watch) = self.parts();
        watch.skips(simulation.flight.clock(), simulation.flight.state())
    }

    /// Takes note of an impact that is passed over.
    #[inline(always)]
    fn passed(&mut self) {}

    /// Runs to the end outside of the lanes.
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

/// What goes beside a motion in its lane, and is computed for the impacts of several lanes
/// together.
pub(crate) trait Companion {
    /// The numbers of all lanes.
    type Lanes: Default;

    /// Looks at the impacts of all lanes: which ones lanes can pass over.
    fn look(lanes: &mut Self::Lanes, impacts: &ImpactLanes);

    /// Whether the impact from which the present flight begins is passed over: what is computed in
    /// lane `j` is all that is wanted of it.
    fn passes(&mut self, j: usize, lanes: &mut Self::Lanes, simulation: &Simulation) -> bool;

    /// Computes what belongs to the impacts that were passed over.
    fn compute<G: Tip>(lanes: &mut Self::Lanes, impacts: &ImpactLanes);

    /// From the flight that has just begun after an impact, the companion is in lane `j`,
    fn enter(&mut self, j: usize, lanes: &mut Self::Lanes);

    /// also where a flight goes on from another instant,
    fn go_on(&mut self, j: usize, lanes: &mut Self::Lanes, simulation: &Simulation);

    /// until an event has to be taken.
    fn leave(&mut self, j: usize, lanes: &mut Self::Lanes);
}

/// Nothing.
impl Companion for () {
    type Lanes = ();

    #[inline(always)]
    fn look((): &mut (), _: &ImpactLanes) {}

    #[inline(always)]
    fn passes(&mut self, _: usize, (): &mut (), _: &Simulation) -> bool {
        false
    }

    #[inline(always)]
    fn compute<G: Tip>((): &mut (), _: &ImpactLanes) {}

    fn enter(&mut self, _: usize, (): &mut ()) {}

    fn go_on(&mut self, _: usize, (): &mut (), _: &Simulation) {}

    fn leave(&mut self, _: usize, (): &mut ()) {}
}

/// A job with its index.
impl<T: Job> Job for (usize, T) {
    type Model = T::Model;
    type Watch = T::Watch;
    type Beside = T::Beside;

    fn parts(&mut self) -> (&mut Simulation<T::Model>, &mut T::Watch) {
        self.1.parts()
    }

    fn take(&mut self, event: Result<<T::Model as Model>::Event, SimulationError>) {
        self.1.take(event);
    }

    #[inline(always)]
    fn companion(&mut self) -> Option<(&mut T::Beside, &Simulation<T::Model>)> {
        self.1.companion()
    }

    #[inline(always)]
    fn skips(&mut self) -> bool {
        self.1.skips()
    }

    #[inline(always)]
    fn passed(&mut self) {
        self.1.passed();
    }
}
