//! The rounds of the two bodies: each flight's first pass by itself, then the contacts and impacts
//! of all lanes together.

#![allow(clippy::inline_always)] // a round is compiled for several instruction sets
#![allow(private_bounds, private_interfaces)] // nobody outside of the crate can name the trait

use std::marker::PhantomData;

use super::impacts::{ImpactLanes, Nearby};
use super::sections::pass_sections;
use super::{Batch, Companion, Job, LaneSet, Laned, LanesBeside};
use crate::flight::{Flight, Found, Point, States};
use crate::impact::{self, Impact, ImpactFailure, PreImpact};
use crate::model::parameters::{Contact, System};
use crate::model::tip::{Direct, Oblique, Tip};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::lanes::{self, LANES};
use crate::search::Start;
use crate::search::first_contact::FirstPass;
use crate::search::scan::{Scan, Scanner, Stride};
use crate::search::steps::SteppedGap;
use crate::simulate::{Model, Observer, Simulation};

impl Laned for System {
    type Family = Contact;
    type Lanes<B: Default> = LaneData<B>;

    fn family(simulation: &Simulation) -> Option<Contact> {
        simulation.fits_a_lane().then_some(simulation.system.contact)
    }

    fn enter<B: Default>(lanes: &mut LaneData<B>, j: usize, simulation: &Simulation) {
        lanes.impacts.set_system(j, &simulation.system, &simulation.motion);
        lanes.in_lane[j] = 0;
    }

    fn leave<T: Job<Model = Self>>(
        lanes: &mut LaneData<LanesBeside<T>>,
        j: usize,
        job: &mut Option<T>,
    ) {
        lanes.write_back(j, job);
        if let Some(job) = job {
            leave(job, j, &mut lanes.beside);
        }
    }

    fn round<T: Job<Model = Self>>(batch: &mut Batch<'_, T>) {
        match batch.family {
            Contact::Oblique => lanes::wide(Round::<Oblique, T>(batch, PhantomData)),
            Contact::Direct => lanes::wide(Round::<Direct, T>(batch, PhantomData)),
        }
    }
}

/// The numbers of all lanes.
#[derive(Default)]
pub struct LaneData<B> {
    scanners: [Scanner<Point>; LANES],
    strides: [Stride<States>; LANES],
    impacts: ImpactLanes,
    /// 1 where the present flight began in the lane: the lane alone then has the bodies' constants
    /// and the start of the scan.
    in_lane: [u64; LANES],
    beside: B,
}

impl<B> LaneData<B> {
    /// Writes what the lane alone has into the simulation, which can then go on outside of the
    /// lane.
    #[inline(always)]
    fn write_back<T: Job<Model = System>>(&mut self, j: usize, job: &mut Option<T>) {
        if let (1, Some(job)) = (std::mem::take(&mut self.in_lane[j]), job) {
            let (pendulum, oscillator) = self.impacts.bodies(j);
            let flight = &mut job.parts().0.flight;
            (flight.pendulum, flight.oscillator) = (pendulum, oscillator);
        }
    }
}

impl<T: Job<Model = System>> Batch<'_, T> {
    /// The next impact of each lane. All lanes take one stride before any result is read, so that
    /// no lane waits for a result.
    #[inline(always)]
    fn round<G: Tip>(&mut self) {
        let (mut scanning, mut ready) = (LaneSet::default(), LaneSet::default());
        for j in 0..LANES {
            self.begin_flight::<G>(j, &mut scanning, &mut ready);
        }
        while !scanning.is_empty() {
            let LaneData { scanners, strides, .. } = &mut *self.lanes;
            for j in scanning.iter() {
                if let Some(job) = &mut self.jobs[j] {
                    strides[j] = scanners[j].stride(&job.parts().0.tip_gap::<G>());
                }
            }
            let before = std::mem::take(&mut scanning);
            for j in before.iter() {
                match self.read_stride::<G>(j) {
                    Scanned::Contact => ready.push(j),
                    Scanned::Continues => scanning.push(j),
                    Scanned::Single => self.begin_flight::<G>(j, &mut scanning, &mut ready),
                }
            }
        }
        let LaneData { impacts, beside, .. } = &mut *self.lanes;
        impacts.find_contacts::<G>();
        impacts.resolve::<G>();
        for j in ready.iter() {
            if let (Some(pre), Some(job)) = (impacts.switches(j), &mut self.jobs[j])
                && let Ok(impact) = resolve_switched(&job.parts().0.system, &pre)
                && !impact.ends_at_rest()
            {
                impacts.set_switched(j, &impact);
            }
        }
        impacts.start_flights::<G>();
        T::Beside::look(beside, impacts);
        if T::Watch::SECTIONS {
            let mut among = ready;
            while !among.is_empty() {
                among = pass_sections(&mut self.jobs, among, impacts);
            }
        }
        let mut leaving = [0; LANES];
        for j in ready.iter() {
            leaving[j] = u64::from(self.end_flight(j));
        }
        let LaneData { impacts, in_lane, beside, .. } = &mut *self.lanes;
        T::Beside::compute::<G>(beside, impacts);
        impacts.accept(&leaving);
        *in_lane = leaving;
    }

    /// Ends the flight of lane `j`, which has a contact ahead; whether the next flight begins in
    /// the lane.
    #[inline(always)]
    fn end_flight(&mut self, j: usize) -> bool {
        let LaneData { impacts, beside, .. } = &mut *self.lanes;
        let Some(job) = &mut self.jobs[j] else { return false };
        let (simulation, watch) = job.parts();
        if impacts.is_certain(j) {
            simulation.evaluations += impacts.evaluations(j);
            let (time, offset) = impacts.contact_time(j);
            if simulation.horizon_before(time, offset, true).is_some() {
                simulation.found = Some(Found::Contact(impacts.contact(j)));
            } else if impacts.is_resolved(j) && !simulation.has_no_room(j, impacts) {
                let steady = impacts.is_steady(j);
                let chatters = simulation.start_next_flight(j, impacts);
                if chatters || !steady {
                    let (pendulum, oscillator) = impacts.bodies_after(j);
                    let flight = &mut simulation.flight;
                    (flight.pendulum, flight.oscillator) = (pendulum, oscillator);
                }
                if chatters {
                    let view = simulation.system.chatter_view(&impacts.impact(j));
                    simulation.complete_chatter_if_certain(&view);
                }
                let Flight { clock, state, .. } = simulation.flight;
                if !watch.skips(clock, &state) && (chatters || !passes(job, j, beside)) {
                    let (simulation, _) = job.parts();
                    let event = simulation.record(impacts.state_before(j), impacts.impact(j));
                    leave(job, j, beside);
                    job.take(Ok(event));
                    if !chatters && let Some((companion, _)) = job.companion() {
                        companion.enter(j, beside);
                    }
                }
                return steady;
            }
        }
        self.end_flight_outside(j);
        false
    }

    /// Ends the flight of lane `j` outside of the lane.
    #[inline(never)]
    fn end_flight_outside(&mut self, j: usize) {
        self.lanes.write_back(j, &mut self.jobs[j]);
        let impacts = &self.lanes.impacts;
        let Some(job) = &mut self.jobs[j] else { return };
        let (simulation, watch) = job.parts();
        let event = if impacts.is_certain(j) && simulation.found.is_none() {
            let (time, offset) = impacts.contact_time(j);
            simulation.pass_sections_in_flight(DoubleDouble::sum(time, offset), false, watch);
            simulation.strike(&impacts.contact(j), watch)
        } else {
            simulation.turn(watch)
        };
        if let Some(event) = event {
            leave(job, j, &mut self.lanes.beside);
            job.take(event);
        }
    }

    /// Begins flights in lane `j` until one has to be scanned or has a contact ahead, or no job is
    /// left.
    #[inline(always)]
    fn begin_flight<G: Tip>(&mut self, j: usize, scanning: &mut LaneSet, ready: &mut LaneSet) {
        loop {
            let Some(job) = &mut self.jobs[j] else { return };
            if self.lanes.in_lane[j] == 0
                && let Some((companion, simulation)) = job.companion()
            {
                companion.go_on(j, &mut self.lanes.beside, simulation);
            }
            let (simulation, _) = job.parts();
            let stopped = simulation.point.stopped.is_some();
            let reason = if stopped { None } else { simulation.stops_before_leg() };
            if stopped || reason.is_some() {
                self.retire(j, reason);
                continue;
            }
            let LaneData { scanners, impacts, in_lane, .. } = &mut *self.lanes;
            if let Some(start) = simulation.scanned_from() {
                let touching = start == Start::Touching;
                let (motion, flight) = (&simulation.motion, &simulation.flight);
                let gap = simulation.tip_gap::<G>();
                let scan_start = if in_lane[j] == 1 {
                    impacts.scan_start(j)
                } else {
                    let scan_start = gap.scan_start();
                    impacts.load::<G>(j, flight, &scan_start.bounds, touching);
                    scan_start
                };
                let scanner = &mut scanners[j];
                match scanner.begin(&gap, &scan_start, touching, motion.span) {
                    None => return scanning.push(j),
                    Some(Scan::Hop(near)) => {
                        impacts.set_nearby(j, &Nearby::Near(near), scanner.evaluations);
                        return ready.push(j);
                    }
                    Some(scan) => {
                        self.step_outside::<G>(j, Some(FirstPass::new(scan, scan_start.bounds)));
                    }
                }
            } else {
                self.step_outside::<G>(j, None);
            }
        }
    }

    /// Reads the result of the last stride of lane `j`.
    #[inline(never)]
    fn read_stride<G: Tip>(&mut self, j: usize) -> Scanned {
        let LaneData { scanners, strides, impacts, .. } = &mut *self.lanes;
        let Some(job) = &mut self.jobs[j] else { return Scanned::Single };
        let scanner = &mut scanners[j];
        let Some(scan) = scanner.judge(&job.parts().0.tip_gap::<G>(), &strides[j]) else {
            return Scanned::Continues;
        };
        if let Scan::RisingStep(rise) = scan {
            impacts.set_nearby(j, &Nearby::On(rise), scanner.evaluations);
            return Scanned::Contact;
        }
        let first_pass = FirstPass::new(scan, impacts.bounds(j));
        self.step_outside::<G>(j, Some(first_pass));
        Scanned::Single
    }

    /// One leg of lane `j` outside of the lane, after the first pass if there was one.
    #[inline(never)]
    fn step_outside<G: Tip>(&mut self, j: usize, first_pass: Option<FirstPass>) {
        self.lanes.write_back(j, &mut self.jobs[j]);
        let Some(job) = &mut self.jobs[j] else { return };
        let (simulation, watch) = job.parts();
        if let Some(first_pass) = first_pass {
            simulation.store_first_pass::<G>(first_pass, self.lanes.scanners[j].evaluations);
        }
        if let Some(event) = simulation.turn(watch) {
            leave(job, j, &mut self.lanes.beside);
            job.take(event);
        }
    }
}

/// Whether the impact from which the present flight of lane `j` begins is passed over.
#[inline(always)]
fn passes<T: Job<Model = System>>(job: &mut T, j: usize, lanes: &mut LanesBeside<T>) -> bool {
    let passes = job.companion().is_some_and(|(companion, of)| companion.passes(j, lanes, of));
    if passes {
        job.passed();
    }
    passes
}

/// Takes what goes beside the motion of a job out of lane `j`.
fn leave<T: Job<Model = System>>(job: &mut T, j: usize, lanes: &mut LanesBeside<T>) {
    if let Some((companion, _)) = job.companion() {
        companion.leave(j, lanes);
    }
}

/// An impact whose slip ends: reversal or stick.
#[inline(never)]
fn resolve_switched(system: &System, pre: &PreImpact) -> Result<Impact, ImpactFailure> {
    lanes::narrow(Resolving { system, pre })
}

/// Such an impact, compiled for fused multiplications where there are any.
struct Resolving<'a> {
    system: &'a System,
    pre: &'a PreImpact,
}

impl pulp::NullaryFnOnce for Resolving<'_> {
    type Output = Result<Impact, ImpactFailure>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        impact::resolve(self.system, self.pre)
    }
}

/// Result of a stride.
enum Scanned {
    /// A contact is ahead.
    Contact,
    /// Another stride is needed.
    Continues,
    /// The leg has been done outside of the lane.
    Single,
}

/// A round, compiled for each kind of vector instructions.
struct Round<'a, 'b, G, T: Job<Model = System>>(&'a mut Batch<'b, T>, PhantomData<G>);

impl<G: Tip, T: Job<Model = System>> pulp::NullaryFnOnce for Round<'_, '_, G, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.0.round::<G>();
    }
}
