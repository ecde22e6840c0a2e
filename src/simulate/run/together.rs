//! Many runs at once.

#![allow(private_interfaces)] // nobody outside of the crate can name the trait

use super::collection::Collection;
use super::recorded::Recorded;
use super::{Run, RunError, RunOptions};
use crate::numerics::cancel::CancelToken;
use crate::simulate::{Laned, run_batch};

/// A model of which many runs are made together, in lanes.
pub trait Together: Recorded + Laned {}

impl<M: Recorded + Laned> Together for M {}

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
    run_batch(&mut next, &mut made, most);
}
