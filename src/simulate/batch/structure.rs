//! The rounds of structures: the search among the stops of each flight by itself, but the contacts
//! that it finds, the states there and the flights after the impacts for all lanes together.

#![allow(clippy::inline_always)] // a round is compiled for several instruction sets
#![allow(private_bounds, private_interfaces)] // nobody outside of the crate can name the trait

use super::{Batch, Job, LaneSet, Laned};
use crate::flight::structure::{FlightLanes, Looked, Met, Shape};
use crate::impact::StopImpact;
use crate::model::state::Clock;
use crate::model::structure::{Structure, StructureState};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::lanes::{self, LANES};
use crate::simulate::Simulation;

/// The numbers of all lanes.
#[derive(Default)]
pub struct StructureLanes {
    flights: FlightLanes,
    /// Whether the present flight is in the lane.
    in_lane: [bool; LANES],
    impacts: [Option<ImpactInLane>; LANES],
}

/// An impact by which the next flight of a lane begins.
struct ImpactInLane {
    clock: Clock,
    /// Velocities before it.
    v: [f64; FlightLanes::MOST_MODES],
    impact: StopImpact,
}

impl Laned for Structure {
    type Family = Shape;
    type Lanes<B: Default> = StructureLanes;

    fn family(simulation: &Simulation<Self>) -> Option<Shape> {
        Shape::of(simulation.motion.free())
    }

    fn enter<B: Default>(lanes: &mut StructureLanes, j: usize, simulation: &Simulation<Self>) {
        lanes.flights.set(j, simulation.motion.free());
        lanes.in_lane[j] = false;
    }

    fn leave<T: Job<Model = Self>>(lanes: &mut StructureLanes, j: usize, _: &mut Option<T>) {
        lanes.in_lane[j] = false;
    }

    fn round<T: Job<Model = Self>>(batch: &mut Batch<'_, T>) {
        lanes::wide(Round(batch));
    }
}

/// A round, compiled for each kind of vector instructions.
struct Round<'a, 'b, T: Job<Model = Structure>>(&'a mut Batch<'b, T>);

impl<T: Job<Model = Structure>> pulp::NullaryFnOnce for Round<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.0.strike_each();
    }
}

impl<T: Job<Model = Structure>> Batch<'_, T> {
    /// The next impact of each lane, or one leg outside of it.
    #[inline(always)]
    fn strike_each(&mut self) {
        let (mut near, mut struck) = (LaneSet::default(), LaneSet::default());
        for j in 0..LANES {
            if self.begin_search(j) {
                match self.look(j) {
                    Looked::Near => near.push(j),
                    Looked::Unusual => self.leg_outside(j, None),
                }
            }
        }
        self.lanes.flights.find_contacts();
        let mut contacts = [None; LANES];
        for j in near.iter() {
            if let Some(job) = &mut self.jobs[j] {
                contacts[j] = self.lanes.flights.take_contact(j, job.parts().0.motion.free());
            }
        }
        self.lanes.flights.find_states();
        for j in near.iter() {
            let contact = contacts[j].filter(|_| self.lanes.flights.is_first(j));
            if contact.is_some_and(|contact| self.strike(j, &contact)) {
                struck.push(j);
            } else {
                self.leg_outside(j, contact);
            }
        }
        self.lanes.flights.start();
        for j in struck.iter() {
            self.depart(j);
        }
    }

    /// Begins the flight of lane `j` in the lane; whether it is to be searched. Legs before it that
    /// lanes cannot hold are done at once, and jobs that have ended retire.
    #[inline(always)]
    fn begin_search(&mut self, j: usize) -> bool {
        loop {
            let Some(job) = &mut self.jobs[j] else { return false };
            let (simulation, _) = job.parts();
            let stopped = simulation.point.stopped.is_some();
            let reason = if stopped { None } else { simulation.stops_before_leg() };
            if stopped || reason.is_some() {
                self.retire(j, reason);
                continue;
            }
            let StructureLanes { flights, in_lane, impacts } = &mut *self.lanes;
            let motion = simulation.motion.free();
            if in_lane[j] {
                let touched = impacts[j].as_ref().map(|of| of.impact.stop);
                flights.begin_search(j, touched);
                return true;
            }
            if let (Some(touched), Some(flight)) =
                (simulation.begins_for_lane(), simulation.flight.free())
                && flights.load(j, motion, flight)
            {
                flights.begin_search(j, touched);
                return true;
            }
            self.leg_outside(j, None);
        }
    }

    /// Goes on with the search of lane `j`.
    #[inline(always)]
    fn look(&mut self, j: usize) -> Looked {
        let Some(job) = &mut self.jobs[j] else { return Looked::Unusual };
        let (simulation, _) = job.parts();
        let Some(flight) = simulation.flight.free() else { return Looked::Unusual };
        self.lanes.flights.look(j, simulation.motion.free(), flight)
    }

    /// The impact at the contact of lane `j`; whether it is one that lanes can hold.
    #[inline(always)]
    fn strike(&mut self, j: usize, contact: &Met) -> bool {
        let StructureLanes { flights, impacts, .. } = &mut *self.lanes;
        let Some(job) = &mut self.jobs[j] else { return false };
        let (simulation, watch) = job.parts();
        let &Met { stop, time, offset } = contact;
        if !flights.is_usual(j) || simulation.horizon_before(time, offset, true).is_some() {
            return false;
        }
        simulation.pass_sections_in_flight(DoubleDouble::sum(time, offset), false, watch);
        let clock = simulation.impact_clock(time, offset);
        let count = simulation.system.coordinates();
        let (mut q, before) = flights.state(j);
        let mut v = before;
        let struck = simulation.motion.strike_alone(clock, stop, &mut q[..count], &mut v[..count]);
        let Some(impact) = struck else { return false };
        flights.set_state(j, clock, (&q, &v));
        impacts[j] = Some(ImpactInLane { clock, v: before, impact });
        true
    }

    /// Begins the flight after the impact of lane `j`.
    #[inline(always)]
    fn depart(&mut self, j: usize) {
        let StructureLanes { flights, in_lane, impacts } = &mut *self.lanes;
        let (Some(job), Some(struck)) = (&mut self.jobs[j], &impacts[j]) else { return };
        let ImpactInLane { clock, v: before, impact } = struck;
        let (simulation, _) = job.parts();
        let count = simulation.system.coordinates();
        let (q, v) = flights.state(j);
        if let Some((motion, flight)) = simulation.free_flight() {
            flights.store(j, motion, *clock, flight);
        }
        #[cfg(test)]
        tests::IN_LANES.set(tests::IN_LANES.get() + 1);
        simulation.begin_alone(*clock, impact, (&q[..count], &v[..count]));
        in_lane[j] = simulation.point.completion.is_none();
        if !job.skips() {
            let pre = StructureState::new(&q[..count], &before[..count]);
            let event = job.parts().0.record(pre, *impact);
            job.take(Ok(event));
        }
    }

    /// One leg of lane `j` outside of the lane; a search has met this contact, if any.
    #[inline(never)]
    fn leg_outside(&mut self, j: usize, contact: Option<Met>) {
        self.lanes.in_lane[j] = false;
        let Some(job) = &mut self.jobs[j] else { return };
        let (simulation, watch) = job.parts();
        if let Some(contact) = contact {
            simulation.set_met(&contact);
        }
        if let Some(event) = simulation.step(watch) {
            job.take(event);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;
    use crate::model::structure::Stop;
    use crate::numerics::cancel::CancelToken;
    use crate::simulate::run::{RunOptions, run, run_together};

    thread_local! {
        /// Impacts by which a flight has begun in a lane of this thread.
        pub(super) static IN_LANES: Cell<u64> = const { Cell::new(0) };
    }

    /// Two masses, of which the first moves between two stops.
    fn between_stops(drive_frequency: f64, friction: f64) -> Structure {
        let stop = |side: f64| Stop::new([side, 0.0], 0.3, 0.8).with_friction(friction, [0.2, 0.5]);
        let (mass, stiffness) = ([[1.0, 0.0], [0.0, 2.0]], [[2.0, -1.0], [-1.0, 1.0]]);
        Structure::builder(mass.map(Vec::from).into(), stiffness.map(Vec::from).into())
            .stop(stop(1.0))
            .stop(stop(-1.0))
            .damping_ratios(vec![0.02, 0.05])
            .drive(vec![0.0.into(), 1.0.into()], drive_frequency, 0.0)
            .build()
            .unwrap()
    }

    #[test]
    fn nearly_all_impacts_of_chaotic_motions_are_in_lanes_with_the_same_bits() {
        for friction in [0.0, 0.3] {
            let frequencies = [0.8, 0.81, 0.82, 0.825, 0.875, 0.88, 0.97, 0.975];
            let at = |frequency: f64| between_stops(frequency, friction);
            let rest = StructureState::new(&[0.0; 2], &[0.0; 2]);
            let mut jobs = frequencies
                .iter()
                .enumerate()
                .map(|(place, &frequency)| (place, at(frequency), rest.clone()));
            let options = RunOptions::periods(100).keep(10);
            let (mut impacts, never) = (0, CancelToken::never());
            IN_LANES.set(0);
            run_together(
                &mut || jobs.next(),
                options,
                &never,
                &mut |place, found| {
                    let (found, structure) = (found.unwrap(), at(frequencies[place]));
                    impacts += found.impact_count;
                    // All of it, what a run goes on from included.
                    assert_eq!(found, run(&structure, rest.clone(), options, &never).unwrap());
                },
                LANES,
            );
            let part = IN_LANES.get() as f64 / impacts as f64;
            println!("{friction}: {part} of {impacts}");
            assert!(impacts > 3_000 && part > 0.9, "{part} of {impacts}");
        }
    }
}
