//! The one bridge from Ctrl-C to the core's cancellation token.
//!
//! Only Python's main thread receives signals, and only while it holds the interpreter. So the work
//! runs on another thread, without the interpreter, while the calling thread waits for it, checks
//! for signals and reports progress. The start of a thread costs more than a short run, so a run
//! begins on the calling thread.
//!
//! Another thread of Python gets no signals. Its calls end by a [`PyCancellation`] that it heeds.

use std::cell::RefCell;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::Relaxed};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

use crate::numerics::cancel::CancelToken;

/// Time between two checks for signals.
const LOOK: Duration = Duration::from_millis(25);
/// Time of work on the calling thread before a thread is started for the rest: many times what the
/// start costs, and too short to be noticed after Ctrl-C.
const FIRST_PART: Duration = Duration::from_millis(1);
/// Number of reads of the token, over several calls, until it counts as cancelled; `u64::MAX`:
/// never.
static ASKS: AtomicU64 = AtomicU64::new(u64::MAX);

/// Lets the `asks`-th read of the token in the following calls act as Ctrl-C at that place; None:
/// no such read. For tests, with one worker thread. Returns how many reads were left.
#[pyfunction]
pub(super) fn _interrupt_at(asks: Option<u64>) -> u64 {
    ASKS.swap(asks.unwrap_or(u64::MAX), Relaxed)
}

thread_local! {
    /// What ends the calls of this thread.
    static HEEDED: RefCell<Option<CancelToken>> = const { RefCell::new(None) };
}

/// Ends the calls of each thread that heeds it, as Ctrl-C does on the main thread. Never taken
/// back.
#[pyclass(frozen, module = "vibroimpact._core", name = "Cancellation")]
pub(super) struct PyCancellation(CancelToken);

#[pymethods]
impl PyCancellation {
    #[new]
    fn new() -> Self {
        Self(CancelToken::new())
    }

    /// Ends the work, soon.
    fn cancel(&self) {
        self.0.cancel();
    }

    #[getter]
    fn cancelled(&self) -> bool {
        self.0.is_cancelled()
    }
}

/// Lets a cancellation end what the calling thread computes from now on; None: nothing does.
#[pyfunction]
#[pyo3(signature = (cancellation))]
pub(super) fn _heed(cancellation: Option<PyRef<'_, PyCancellation>>) {
    let token = cancellation.map(|wish| wish.0.clone());
    HEEDED.with_borrow_mut(|heeded| *heeded = token);
}

/// The function that receives progress, and the counter of what is done.
pub(super) struct Progress<'a> {
    pub tell: &'a Py<PyAny>,
    pub done: &'a AtomicUsize,
}

/// The exception of a call that Ctrl-C ended, if the call has no result.
pub(super) fn interrupted(message: String) -> PyErr {
    PyKeyboardInterrupt::new_err(message)
}

/// Works with the interpreter released. Ctrl-C makes the work end early with what is done, and is
/// reported with the result, also if it comes during a call of progress; others are raised.
pub(super) fn interruptible<T: Send, E: Into<PyErr> + Send>(
    py: Python<'_>,
    progress: Option<&Progress>,
    work: impl FnOnce(&CancelToken) -> Result<T, E> + Send,
) -> PyResult<(T, bool)> {
    interruptible_if(py, true, progress, work)
}

/// The same of work that may be known to be done before anyone would look for Ctrl-C, which is then left
/// to what comes after it.
pub(super) fn interruptible_if<T: Send, E: Into<PyErr> + Send>(
    py: Python<'_>,
    is_long: bool,
    progress: Option<&Progress>,
    work: impl FnOnce(&CancelToken) -> Result<T, E> + Send,
) -> PyResult<(T, bool)> {
    let heeded = HEEDED.with_borrow(Clone::clone);
    let token =
        heeded.as_ref().map_or_else(|| CancelToken::after(ASKS.load(Relaxed)), CancelToken::part);
    let mut raised = None;
    let tell = |py: Python<'_>| match progress {
        // False ends the work, anything else lets it go on.
        Some(Progress { tell, done }) => {
            let answer = tell.call1(py, (done.load(Relaxed),))?;
            Ok(answer.bind(py).extract::<bool>().unwrap_or(true))
        }
        None => PyResult::Ok(true),
    };
    let mut ended = false;
    let main = is_main_thread(py)?;
    let result = if (main && is_long) || progress.is_some() {
        py.detach(|| {
            beside(
                || work(&token),
                || {
                    if raised.is_none() && !ended {
                        let look = |py: Python<'_>| {
                            let wanted = tell(py)?;
                            py.check_signals().map(|()| wanted)
                        };
                        let looked = Python::attach(look);
                        ended = !matches!(looked, Ok(true));
                        raised = looked.err();
                    }
                    if ended {
                        token.cancel();
                    }
                },
            )
        })
    } else {
        py.detach(|| work(&token))
    };
    let counted = ASKS.load(Relaxed) != u64::MAX;
    let mut interrupted =
        token.asks_left() == 0 || heeded.as_ref().is_some_and(CancelToken::is_cancelled);
    if counted {
        ASKS.store(if interrupted { u64::MAX } else { token.asks_left() }, Relaxed);
        if interrupted && main && heeded.is_none() && raised.is_none() {
            let signal = py.import("signal")?;
            raised = signal.call_method1("raise_signal", (signal.getattr("SIGINT")?,)).err();
        }
    }
    if raised.is_none() {
        let told = tell(py);
        interrupted |= ended || !matches!(told, Ok(true));
        raised = told.err();
    }
    match raised {
        Some(error) if !error.is_instance_of::<PyKeyboardInterrupt>(py) => Err(error),
        _ => result.map(|done| (done, interrupted)).map_err(Into::into),
    }
}

/// Work that can be interrupted and go on: `proceed` does so until it has ended or the token is
/// cancelled, and returns whether it has ended. It does a part of so many reads of the token at once.
pub(super) fn interruptible_later(
    py: Python<'_>,
    reads: u64,
    mut proceed: impl FnMut(&CancelToken) -> bool + Send,
) -> PyResult<()> {
    let mut first_part = || {
        let begun = Instant::now();
        while begun.elapsed() < FIRST_PART {
            if proceed(&CancelToken::after(reads)) {
                return true;
            }
        }
        false
    };
    // A test counts the reads of one token: then there is no first part.
    let counted = ASKS.load(Relaxed) != u64::MAX;
    if counted || !py.detach(&mut first_part) {
        interruptible::<_, PyErr>(py, None, |cancel| Ok(proceed(cancel)))?;
    }
    Ok(())
}

/// Does the work on another thread, and calls `look` at intervals until it is done.
fn beside<T: Send>(work: impl FnOnce() -> T + Send, mut look: impl FnMut()) -> T {
    std::thread::scope(|scope| {
        let (working, worked) = mpsc::channel::<()>();
        let task = scope.spawn(move || {
            let _working = working; // dropped at the end, which wakes the wait
            work()
        });
        while let Err(mpsc::RecvTimeoutError::Timeout) = worked.recv_timeout(LOOK) {
            look();
        }
        task.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

/// Whether signals may come to this thread.
fn is_main_thread(py: Python<'_>) -> PyResult<bool> {
    let threading = py.import("threading")?;
    let here = threading.call_method0("current_thread")?;
    Ok(here.is(&threading.call_method0("main_thread")?))
}
