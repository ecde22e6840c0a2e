//! Sweeps over one parameter, in parallel: the only user of rayon.
//!
//! Every point is a run of its own, or a followed branch is one task from end to end, so the
//! result has the same bits for any number of threads.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc;
use std::time::Duration;

use rayon::prelude::*;

use crate::error::ParameterError;
use crate::event::StopReason;
use crate::params::System;
use crate::period::PeriodReport;
use crate::run::{Run, RunError, RunOptions, run};
use crate::simulate::Simulation;
use crate::state::State;

/// Points handed to the threads at a time.
const CHUNK: usize = 128;
/// Time between two looks at the caller's wish to go on.
const LOOK: Duration = Duration::from_millis(50);

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
        if threads == 0 {
            return Err(error("a whole number >= 1"));
        }
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map(|pool| Self(Some(pool)))
            .map_err(|_| error("as many threads as the system gives"))
    }

    /// Does `work` on the threads while this one asks `go_on` now and then; once that says no,
    /// `work` sees its flag raised and should end.
    fn run<T: Send>(
        &self,
        go_on: &mut dyn FnMut() -> bool,
        work: impl FnOnce(&AtomicBool) -> T + Send,
    ) -> T {
        let cancel = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let (working, worked) = mpsc::channel::<()>();
            let (pool, cancel) = (&self.0, &cancel);
            let task = scope.spawn(move || {
                let _working = working; // dropped at the end, which wakes the watch
                match pool {
                    Some(pool) => pool.install(|| work(cancel)),
                    None => work(cancel),
                }
            });
            while let Err(mpsc::RecvTimeoutError::Timeout) = worked.recv_timeout(LOOK) {
                if !go_on() {
                    cancel.store(true, Relaxed);
                }
            }
            task.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        })
    }
}

/// Where each value of the parameter starts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum SweepStart {
    /// From the initial state.
    Fresh,
    /// From the last state of the value before.
    Forward,
    /// From the last state of the value after: the values are run in reverse.
    Backward,
}

impl SweepStart {
    /// The start of this name: fresh, forward, backward.
    ///
    /// # Errors
    /// [`ParameterError`] for an unknown name.
    pub fn from_name(name: &str) -> Result<Self, ParameterError> {
        match name {
            "fresh" => Ok(Self::Fresh),
            "forward" => Ok(Self::Forward),
            "backward" => Ok(Self::Backward),
            _ => Err(ParameterError::new("start", name, "one of fresh, forward, backward")),
        }
    }
}

/// What became of one point of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum PointStatus {
    /// Not reached before the caller ended the sweep.
    Pending,
    /// Completed, or completed after the followed state did not fit and the initial one was used.
    Completed {
        /// From `initial` although a branch was followed.
        restarted: bool,
    },
    /// Stopped early.
    Stopped(StopReason),
    /// The computation failed.
    Failed,
}

impl PointStatus {
    /// The name used in Python and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Pending => "pending",
            Self::Completed { restarted: false } => "completed",
            Self::Completed { restarted: true } => "restarted",
            Self::Stopped(reason) => reason.name(),
            Self::Failed => "failed",
        }
    }
}

/// One point of a sweep: what its section rows need.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPoint {
    /// What became of it.
    pub status: PointStatus,
    /// (x1, v1, v2, phase) just before each kept impact.
    pub impact_section: Vec<[f64; 4]>,
    /// Regime number of each kept impact.
    pub regime: Vec<i8>,
    /// Kept stroboscopic states.
    pub stroboscopic: Vec<[f64; 4]>,
    /// Period found on the section, without following nearby orbits.
    pub period: Option<PeriodReport>,
    /// State at the end.
    pub final_state: Option<State>,
    /// Part of the kept window in contact; NaN where nothing is kept.
    pub contact_fraction: f64,
}

impl SweepPoint {
    fn empty(status: PointStatus) -> Self {
        Self {
            status,
            impact_section: Vec::new(),
            regime: Vec::new(),
            stroboscopic: Vec::new(),
            period: None,
            final_state: None,
            contact_fraction: f64::NAN,
        }
    }

    fn new(run: Run, restarted: bool) -> Self {
        let status = match run.stop_reason {
            StopReason::Completed => PointStatus::Completed { restarted },
            StopReason::Interrupted => return Self::empty(PointStatus::Pending),
            reason => PointStatus::Stopped(reason),
        };
        Self {
            status,
            impact_section: run
                .impacts
                .iter()
                .map(|i| [i.x1, i.v1_pre, i.v2_pre, i.phase])
                .collect(),
            regime: run.impacts.iter().map(|i| i.regime as i8).collect(),
            contact_fraction: run.time_in_contact() / (run.final_state.time - run.kept_from()),
            period: run.stop_reason.reached_the_end().then(|| run.return_report()),
            final_state: Some(run.final_state.state),
            stroboscopic: run.stroboscopic,
        }
    }
}

/// Runs `system` with `parameter` at each of `values`. `go_on` gets the number of points done and
/// ends the sweep by returning `false`; points not reached are then pending.
///
/// # Errors
/// [`ParameterError`] for a value outside its range or a bad option, before any run.
#[allow(clippy::too_many_arguments)]
pub fn sweep(
    system: &System,
    parameter: &str,
    values: &[f64],
    initial: State,
    options: RunOptions,
    start: SweepStart,
    workers: &Workers,
    go_on: &mut dyn FnMut(usize) -> bool,
) -> Result<Vec<SweepPoint>, ParameterError> {
    let mut systems = Vec::with_capacity(values.len());
    for &value in values {
        let system = system.with(parameter, value)?;
        options.check(&system)?;
        systems.push(system);
    }
    if start == SweepStart::Backward {
        systems.reverse();
    }
    let mut points = Vec::with_capacity(systems.len());
    let mut last = None;
    for chunk in systems.chunks(CHUNK) {
        let done = points.len();
        let mut cancelled = false;
        let mut watch = || {
            cancelled |= !go_on(done);
            !cancelled
        };
        points.extend(workers.run(&mut watch, |cancel| {
            if start == SweepStart::Fresh {
                let one = |system| fresh(system, initial, options, false, cancel);
                chunk.par_iter().map(one).collect::<Vec<_>>()
            } else {
                let one = |(i, system)| {
                    follow(system, done + i == 0, &mut last, initial, options, cancel)
                };
                chunk.iter().enumerate().map(one).collect()
            }
        }));
        if cancelled || !go_on(points.len()) {
            break;
        }
    }
    points.resize(systems.len(), SweepPoint::empty(PointStatus::Pending));
    if start == SweepStart::Backward {
        points.reverse();
    }
    Ok(points)
}

fn fresh(
    system: &System,
    initial: State,
    options: RunOptions,
    restarted: bool,
    cancel: &AtomicBool,
) -> SweepPoint {
    match run(system, initial, options, &mut || !cancel.load(Relaxed)) {
        Ok(run) => SweepPoint::new(run, restarted),
        Err(_) => SweepPoint::empty(PointStatus::Failed),
    }
}

/// From the last state, or from `initial` where there is none or it penetrates at the new value.
fn follow(
    system: &System,
    first: bool,
    last: &mut Option<State>,
    initial: State,
    options: RunOptions,
    cancel: &AtomicBool,
) -> SweepPoint {
    let followed =
        last.and_then(|state| match run(system, state, options, &mut || !cancel.load(Relaxed)) {
            Ok(run) => Some(SweepPoint::new(run, false)),
            Err(RunError::State(_)) => None,
            Err(_) => Some(SweepPoint::empty(PointStatus::Failed)),
        });
    let point = followed.unwrap_or_else(|| fresh(system, initial, options, !first, cancel));
    if point.final_state.is_some() {
        *last = point.final_state;
    }
    point
}

/// One run per initial state, in parallel. Where `go_on` ends the work early, the runs that were
/// begun by then are returned, of the first so many of `initials`; those cut short say so in
/// their stop reason.
///
/// # Errors
/// [`RunError`] of the first run that failed, with bad options and starts found first.
pub fn run_many(
    system: &System,
    initials: &[State],
    options: RunOptions,
    workers: &Workers,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Vec<Run>, RunError> {
    options.check(system)?;
    for &initial in initials {
        Simulation::new(system, initial)?;
    }
    let mut runs = Vec::with_capacity(initials.len());
    for chunk in initials.chunks(CHUNK) {
        let done: Result<Vec<Run>, RunError> = workers.run(go_on, |cancel| {
            let one = |&start: &State| run(system, start, options, &mut || !cancel.load(Relaxed));
            chunk.par_iter().map(one).collect()
        });
        runs.extend(done?);
        if !go_on() {
            break;
        }
    }
    Ok(runs)
}
