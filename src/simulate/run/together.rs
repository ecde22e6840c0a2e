//! Many runs at once.

#![allow(private_interfaces)] // nobody outside of the crate can name the trait

use super::collection::Collection;
use super::recorded::Recorded;
use super::{Run, RunError, RunOptions};
use crate::model::parameters::System;
use crate::model::structure::Structure;
use crate::numerics::cancel::CancelToken;
use crate::simulate::run_batch;

/// A model of which many runs may be made together.
pub trait Together: Recorded {
    /// Makes the runs that `next` gives, at most so many at a time.
    fn collect_all(
        next: &mut dyn FnMut() -> Option<(usize, Collection<Self>)>,
        done: &mut dyn FnMut((usize, Collection<Self>)),
        most: usize,
    );
}

impl Together for System {
    /// In the lanes.
    fn collect_all(
        next: &mut dyn FnMut() -> Option<(usize, Collection)>,
        done: &mut dyn FnMut((usize, Collection)),
        most: usize,
    ) {
        run_batch(next, done, most);
    }
}

impl Together for Structure {
    /// One after another.
    fn collect_all(
        next: &mut dyn FnMut() -> Option<(usize, Collection<Self>)>,
        done: &mut dyn FnMut((usize, Collection<Self>)),
        _: usize,
    ) {
        while let Some((place, mut collection)) = next() {
            collection.run_out();
            done((place, collection));
        }
    }
}

/// Makes runs, at most so many at a time: `next` gives their systems and starts, `done` gets each
/// with its place in their order.
pub(crate) fn run_together<M: Together>(
    next: &mut dyn FnMut() -> Option<(usize, M, M::State)>,
    options: RunOptions,
    cancel: &CancelToken,
    done: &mut dyn FnMut(usize, Result<Run<M>, RunError<M>>),
    most: usize,
) {
    let done = std::cell::RefCell::new(done);
    let mut next = || loop {
        let (place, system, initial) = next()?;
        match Collection::new(&system, initial, options, cancel) {
            Ok(collection) => return Some((place, collection)),
            Err(error) => (done.borrow_mut())(place, Err(error.into())),
        }
    };
    let mut made = |(place, collection): (usize, Collection<M>)| {
        (done.borrow_mut())(place, collection.into_run());
    };
    M::collect_all(&mut next, &mut made, most);
}
