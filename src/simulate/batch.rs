//! Many simulations at once, in the lanes of the vector registers: what is scanned for each flight
//! by itself, then what all lanes do together.
//!
//! A lane does the same operations as a single simulation ([`Simulation::advance`]), by the same
//! functions: the bits do not depend on what the other lanes hold. Everything but the usual flight
//! between two impacts (grazes, chatter, sustained contact, motion that has decayed, overdamped
//! bodies) is left to the single simulation. The queue of jobs is the same for all models; what a
//! round of the lanes does is the model's business (oblique.rs, structure.rs).

#![allow(clippy::inline_always)] // a round is compiled for several instruction sets

mod impacts;
mod job;
mod motions;
mod oblique;
mod sections;
mod simulation;
mod structure;

pub(crate) use self::impacts::ImpactLanes;
pub(crate) use self::job::{Companion, Job};
use super::{Model, Simulation};
use crate::numerics::lanes::LANES;
use crate::simulate::event::StopReason;

/// With fewer jobs than this, lanes save no time.
const FEWEST: usize = 3;

/// A model whose usual flights and impacts are computed in lanes.
#[allow(private_bounds, private_interfaces)] // nobody outside of the crate can name the trait
pub trait Laned: Model {
    /// What the systems of one batch have in common.
    type Family: Copy + PartialEq;
    /// The numbers of all lanes, and those of what goes beside the motions.
    type Lanes<B: Default>: Default;

    /// The family of a simulation that lanes can hold.
    fn family(simulation: &Simulation<Self>) -> Option<Self::Family>;
    /// Sets the system of lane `j`.
    fn enter<B: Default>(lanes: &mut Self::Lanes<B>, j: usize, simulation: &Simulation<Self>);
    /// What the lane alone has goes back to its job, which can then go on outside of it.
    fn leave<T: Job<Model = Self>>(
        lanes: &mut Self::Lanes<LanesBeside<T>>,
        j: usize,
        job: &mut Option<T>,
    );
    /// The next impact of each lane, or whatever else comes next.
    fn round<T: Job<Model = Self>>(batch: &mut Batch<'_, T>);
}

/// Runs all jobs that `next` gives, at most `most` at a time, and hands each to `done` after its
/// stop.
pub(crate) fn run_batch<T: Job>(
    next: &mut dyn FnMut() -> Option<T>,
    done: &mut dyn FnMut(T),
    most: usize,
) {
    let (first, family) = loop {
        let Some(mut job) = next() else { return };
        if let Some(family) = T::Model::family(job.parts().0) {
            break (job, family);
        }
        job.finish();
        done(job);
    };
    let mut batch = Batch { next, done, family, jobs: Default::default(), lanes: Box::default() };
    let mut first = Some(first);
    for j in 0..LANES.min(most) {
        let job = first.take().or_else(|| batch.next_job());
        batch.refill(j, job);
    }
    while batch.jobs.iter().flatten().count() >= FEWEST {
        T::Model::round(&mut batch);
    }
    for j in 0..LANES {
        T::Model::leave(&mut batch.lanes, j, &mut batch.jobs[j]);
        if let Some(mut job) = batch.jobs[j].take() {
            job.finish();
            (batch.done)(job);
        }
    }
}

/// The jobs in the lanes, and where jobs come from and go to.
pub(crate) struct Batch<'a, T: Job> {
    next: &'a mut dyn FnMut() -> Option<T>,
    done: &'a mut dyn FnMut(T),
    family: <T::Model as Laned>::Family,
    /// Of each lane, its job.
    jobs: [Option<T>; LANES],
    lanes: Box<<T::Model as Laned>::Lanes<LanesBeside<T>>>,
}

/// What goes beside the motions of these jobs, in all lanes.
type LanesBeside<T> = <<T as Job>::Beside as Companion>::Lanes;

/// Some of the lanes, a bit for each: a list of them, written one by one and copied as a whole, is
/// waited for.
#[derive(Clone, Copy, Default)]
struct LaneSet(u32);

impl LaneSet {
    #[inline(always)]
    fn push(&mut self, j: usize) {
        self.0 |= 1 << j;
    }

    #[inline(always)]
    fn is_empty(self) -> bool {
        self.0 == 0
    }

    #[inline(always)]
    fn count(self) -> usize {
        self.0.count_ones() as usize
    }

    /// In order.
    #[inline(always)]
    fn iter(self) -> impl Iterator<Item = usize> {
        let mut left = self.0;
        std::iter::from_fn(move || {
            let lane = (left != 0).then(|| left.trailing_zeros() as usize % LANES)?;
            left &= left - 1;
            Some(lane)
        })
    }
}

impl<T: Job> Batch<'_, T> {
    /// The job, unless lanes cannot hold it: it then runs to its end at once.
    fn admit(&mut self, mut job: T) -> Option<T> {
        if T::Model::family(job.parts().0) == Some(self.family) {
            return Some(job);
        }
        job.finish();
        (self.done)(job);
        None
    }

    /// The next job for a lane, if there is one.
    #[inline(never)]
    fn next_job(&mut self) -> Option<T> {
        loop {
            let job = (self.next)()?;
            if let Some(job) = self.admit(job) {
                return Some(job);
            }
        }
    }

    fn refill(&mut self, j: usize, mut job: Option<T>) {
        if let Some(job) = &mut job {
            T::Model::enter::<LanesBeside<T>>(&mut self.lanes, j, job.parts().0);
        }
        self.jobs[j] = job;
    }

    /// Retires the job of lane `j`, which has ended or stops for this reason, and refills the lane.
    #[inline(never)]
    fn retire(&mut self, j: usize, reason: Option<StopReason>) {
        T::Model::leave(&mut self.lanes, j, &mut self.jobs[j]);
        if let Some(mut job) = self.jobs[j].take() {
            if let Some(reason) = reason {
                let (simulation, _) = job.parts();
                let stop = simulation.stop_here(reason);
                if let Some(end) = simulation.checked(Some(Ok(stop))) {
                    job.take(end);
                }
            }
            (self.done)(job);
        }
        let next_job = self.next_job();
        self.refill(j, next_job);
    }
}
