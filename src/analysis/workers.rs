//! The threads that share work.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use rayon::prelude::*;

use crate::model::error::ParameterError;

/// More threads than any machine has use for; some systems hang rather than refuse them.
const MOST_THREADS: usize = 1024;

/// The threads that share the work.
#[derive(Debug, Default)]
pub struct Workers(Option<rayon::ThreadPool>);

impl Workers {
    /// So many threads; all processors if `None`.
    ///
    /// # Errors
    /// [`ParameterError`] for 0 threads, or more than the system gives.
    pub fn new(threads: Option<usize>) -> Result<Self, ParameterError> {
        let Some(threads) = threads else { return Ok(Self(None)) };
        let error = |allowed| ParameterError::new("workers", threads, allowed);
        if !(1..=MOST_THREADS).contains(&threads) {
            return Err(error("a whole number in [1, 1024]"));
        }
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map(|pool| Self(Some(pool)))
            .map_err(|_| error("as many threads as the system gives"))
    }

    /// Does `work`; what is parallel in it, on the threads.
    pub(crate) fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        match &self.0 {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }
}

/// The next piece of work, by its place among all.
pub(crate) type Next<'a> = dyn FnMut() -> Option<usize> + 'a;
/// Takes what has come of a piece of work.
pub(crate) type Done<'a, T> = dyn FnMut(usize, T) + 'a;

/// Does so many pieces of work on the threads of the present pool, each of which asks for the next
/// piece when it has room for it, and hands over what has come of each; `None` where nothing has.
/// The last argument of `work` is how many pieces a thread may have in hand, so that few are shared
/// by all.
pub(crate) fn side_by_side<T: Send>(
    count: usize,
    work: &(dyn Fn(&mut Next, &mut Done<T>, usize) + Sync),
) -> Vec<Option<T>> {
    let begun = AtomicUsize::new(0);
    let threads = rayon::current_num_threads();
    let in_hand = count.div_ceil(threads);
    // As tasks, so that a pool all of whose other threads are busy does the work too.
    let tasks = (0..threads).into_par_iter().with_max_len(1);
    let shares: Vec<_> = tasks
        .map(|_| {
            let mut share = Vec::new();
            let mut next = || Some(begun.fetch_add(1, Relaxed)).filter(|&place| place < count);
            work(&mut next, &mut |place, result| share.push((place, result)), in_hand);
            share
        })
        .collect();
    let mut results: Vec<Option<T>> = std::iter::repeat_with(|| None).take(count).collect();
    for (place, result) in shares.into_iter().flatten() {
        results[place] = Some(result);
    }
    results
}
