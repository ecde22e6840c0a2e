//! A simulation for a lane.

#![allow(clippy::inline_always)] // a round is compiled for several instruction sets

use super::impacts::ImpactLanes;
use crate::model::error::SimulationError;
use crate::model::tip::Tip;
use crate::simulate::event::Event;
use crate::simulate::{Observer, Simulation};

/// A simulation for a lane, with its observer and with what takes its events.
pub(crate) trait Job {
    /// The observer, which gets the sections.
    type Watch: Observer;
    /// The simulation and its observer.
    fn parts(&mut self) -> (&mut Simulation, &mut Self::Watch);
    /// What is computed beside the motions of all lanes.
    type Beside: Default;
    /// Takes an event, the stop included.
    fn take(&mut self, event: Result<Event, SimulationError>);

    /// Computes, for the impacts of all lanes, what goes beside.
    #[inline(always)]
    fn compute_beside<G: Tip>(_: &mut Self::Beside, _: &ImpactLanes) {}

    /// Whether the impact from which the present flight begins is passed over: what was computed
    /// beside lane `j` is all that is wanted of it.
    #[inline(always)]
    fn passes(&mut self, _j: usize, _: &mut Self::Beside) -> bool {
        false
    }

    /// Takes over what was computed beside the lanes whose impacts were passed over.
    #[inline(always)]
    fn accept_beside(_: &mut Self::Beside) {}

    /// From the flight that has just begun after an impact, what goes beside is in lane `j`,
    fn enter(&mut self, _j: usize, _: &mut Self::Beside) {}

    /// also where a flight goes on from another instant,
    fn go_on(&mut self, _j: usize, _: &mut Self::Beside) {}

    /// until an event has to be taken.
    fn leave(&mut self, _j: usize, _: &mut Self::Beside) {}

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

/// A job with its index.
impl<T: Job> Job for (usize, T) {
    type Watch = T::Watch;
    type Beside = T::Beside;

    fn parts(&mut self) -> (&mut Simulation, &mut T::Watch) {
        self.1.parts()
    }

    fn take(&mut self, event: Result<Event, SimulationError>) {
        self.1.take(event);
    }

    #[inline(always)]
    fn compute_beside<G: Tip>(beside: &mut T::Beside, impacts: &ImpactLanes) {
        T::compute_beside::<G>(beside, impacts);
    }

    #[inline(always)]
    fn passes(&mut self, j: usize, beside: &mut T::Beside) -> bool {
        self.1.passes(j, beside)
    }

    #[inline(always)]
    fn accept_beside(beside: &mut T::Beside) {
        T::accept_beside(beside);
    }

    fn enter(&mut self, j: usize, beside: &mut T::Beside) {
        self.1.enter(j, beside);
    }

    fn go_on(&mut self, j: usize, beside: &mut T::Beside) {
        self.1.go_on(j, beside);
    }

    fn leave(&mut self, j: usize, beside: &mut T::Beside) {
        self.1.leave(j, beside);
    }
}
