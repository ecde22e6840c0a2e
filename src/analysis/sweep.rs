//! Sweeps over parameters and initial states, in parallel.
//!
//! Every point is a run of its own, or a followed branch is one task from end to end, so the
//! result has the same bits for any number of threads.

mod points;
mod rows;

use points::points_together;
pub use rows::SweepRows;

use std::cell::RefCell;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use crate::analysis::basin::{Arrival, ArrivalStatus, BasinRun, Followed, Target};
use crate::analysis::period::PeriodReport;
use crate::analysis::tolerances::EXPONENT_PERIODS;
use crate::analysis::workers::{Workers, side_by_side};
use crate::impact::PreImpact;
use crate::model::error::{ParameterError, StateError};
use crate::model::parameters::System;
use crate::model::state::State;
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::StopReason;
use crate::simulate::run::{Run, RunError, RunOptions, Together, run, run_together};
use crate::simulate::{Simulation, run_batch};

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

/// What is found out about each point, beside its final state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Measure {
    /// The period m-n, where the section returns.
    Returns,
    /// The label: where the section does not return, the growth of a perturbation is measured.
    Label,
    /// The label, and the largest Lyapunov exponent.
    LargestExponent,
    /// The label, and all Lyapunov exponents over so many drive periods after the end of the run,
    /// or after the motion has settled.
    Spectrum(u32),
}

impl Measure {
    /// Fewest drive periods over which a growth is measured: an exponent is wanted of it, or only
    /// what it shows.
    fn least_growth(self) -> u32 {
        if self == Self::LargestExponent { EXPONENT_PERIODS } else { 0 }
    }
}

/// How the points of a sweep are run, and what is kept of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepOptions {
    /// How each run is made.
    pub run: RunOptions,
    /// What is found out about it.
    pub measure: Measure,
    /// Whether the rows of both sections are kept.
    pub rows: bool,
}

impl From<RunOptions> for SweepOptions {
    fn from(run: RunOptions) -> Self {
        Self { run, measure: Measure::Returns, rows: true }
    }
}

/// One point of a sweep: a system and where it starts.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// The system.
    pub system: System,
    /// Its state at t = 0.
    pub initial: State,
}

impl Cell {
    /// `system` with `parameter` at each of `values`, all from `initial`.
    ///
    /// # Errors
    /// [`ParameterError`] for an unknown parameter or a value outside its range.
    pub fn along(
        system: &System,
        parameter: &str,
        values: &[f64],
        initial: State,
    ) -> Result<Vec<Self>, ParameterError> {
        let cell = |&value| Ok(Self { system: system.with(parameter, value)?, initial });
        values.iter().map(cell).collect()
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
    /// The bodies overlap at the start: nothing was run.
    Overlap,
    /// The computation failed.
    Failed,
    /// The run came to its end, but on which attractor cannot be told.
    Unresolved,
}

impl From<ArrivalStatus> for PointStatus {
    fn from(status: ArrivalStatus) -> Self {
        match status {
            ArrivalStatus::Pending => Self::Pending,
            ArrivalStatus::Overlap => Self::Overlap,
            ArrivalStatus::Arrived { .. } => Self::Completed { restarted: false },
            ArrivalStatus::Elsewhere(StopReason::Completed) => Self::Unresolved,
            ArrivalStatus::Elsewhere(reason) => Self::Stopped(reason),
            ArrivalStatus::Failed => Self::Failed,
        }
    }
}

impl PointStatus {
    /// All names; a status is stored as its place among them.
    pub const NAMES: &'static [&'static str] = &[
        "pending",
        "completed",
        "restarted",
        "overlap",
        "failed",
        "rest",
        "event_cap",
        "time_cap",
        "painleve",
        "jammed",
        "undecidable_graze",
        "law_failed",
        "unresolved",
        "simultaneous",
        "sequence_cap",
        "several_frictional",
    ];

    /// Of a run that ended so.
    pub(crate) fn of(reason: StopReason, restarted: bool) -> Self {
        match reason {
            StopReason::Completed => Self::Completed { restarted },
            StopReason::Interrupted => Self::Pending,
            reason => Self::Stopped(reason),
        }
    }

    /// The name used in Python and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Pending => "pending",
            Self::Completed { restarted: false } => "completed",
            Self::Completed { restarted: true } => "restarted",
            Self::Stopped(reason) => reason.name(),
            Self::Overlap => "overlap",
            Self::Failed => "failed",
            Self::Unresolved => "unresolved",
        }
    }

    /// Its place among [`Self::NAMES`].
    #[must_use]
    pub fn code(self) -> i8 {
        Self::NAMES.iter().position(|&name| name == self.name()).map_or(-1, |place| place as i8)
    }
}

/// One point of a sweep: what its section rows need.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPoint {
    /// What became of it.
    pub status: PointStatus,
    /// (x1, v1, v2, phase, approach velocity, energy loss) of each kept impact, state and phase
    /// just before it.
    pub impact_section: Vec<[f64; 6]>,
    /// Regime number of each kept impact.
    pub regime: Vec<i8>,
    /// Kept stroboscopic states.
    pub stroboscopic: Vec<[f64; 4]>,
    /// Period, with the label if that was wanted.
    pub period: Option<PeriodReport>,
    /// Lyapunov exponents with their standard errors, those wanted; else NaN.
    pub exponents: [[f64; 2]; 4],
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
            exponents: [[f64::NAN; 2]; 4],
            final_state: None,
            contact_fraction: f64::NAN,
        }
    }

    fn new(
        run: Run,
        restarted: bool,
        options: &SweepOptions,
        (period, exponents): (Option<PeriodReport>, [[f64; 2]; 4]),
    ) -> Self {
        let interrupted = period.is_some_and(|report| report.is_interrupted());
        let status = PointStatus::of(run.stop_reason, restarted);
        if interrupted || status == PointStatus::Pending {
            return Self::empty(PointStatus::Pending);
        }
        let mut point = Self {
            contact_fraction: run.time_in_contact() / (run.final_state.time - run.kept_from()),
            final_state: Some(run.final_state.state),
            period,
            exponents,
            ..Self::empty(status)
        };
        if options.rows {
            let contact = run.system.contact;
            point.impact_section = run
                .impacts
                .iter()
                .map(|i| {
                    let pre = State { x1: i.x1, v1: i.v1_pre, x2: i.x2, v2: i.v2_pre };
                    let u = PreImpact::new(contact, &pre).approach_velocity();
                    [i.x1, i.v1_pre, i.v2_pre, i.phase, u, i.energy_loss]
                })
                .collect();
            point.regime = run.impacts.iter().map(|i| i.regime as i8).collect();
            point.stroboscopic = run.stroboscopic;
        }
        point
    }
}

/// Runs every cell, and counts in `done` those that are. `cancel` ends the sweep; cells not done
/// are then pending.
///
/// # Errors
/// [`ParameterError`] for a bad option, before any run.
pub fn sweep(
    cells: &[Cell],
    options: SweepOptions,
    start: SweepStart,
    workers: &Workers,
    cancel: &CancelToken,
    done: &AtomicUsize,
) -> Result<Vec<SweepPoint>, ParameterError> {
    for cell in cells {
        options.run.check(&cell.system)?;
    }
    let counted = |point: SweepPoint| {
        done.fetch_add(usize::from(point.status != PointStatus::Pending), Relaxed);
        point
    };
    Ok(workers.install(|| {
        if start == SweepStart::Fresh {
            let points = side_by_side(cells.len(), &|next, done, in_hand| {
                let mut done = |place, point| done(place, counted(point));
                points_together(cells, next, &options, cancel, &mut done, in_hand);
            });
            let pending = || SweepPoint::empty(PointStatus::Pending);
            return points.into_iter().map(|point| point.unwrap_or_else(pending)).collect();
        }
        let mut last = None;
        in_order(cells.len(), start, |place| {
            let begun = |from: Option<&State>, restarted: bool| {
                let initial = from.copied().unwrap_or(cells[place].initial);
                fresh((&cells[place].system, initial), &options, restarted, cancel)
            };
            counted(follow(&mut last, begun))
        })
    }))
}

fn fresh(
    (system, initial): (&System, State),
    options: &SweepOptions,
    restarted: bool,
    cancel: &CancelToken,
) -> SweepPoint {
    if cancel.is_cancelled() {
        return SweepPoint::empty(PointStatus::Pending);
    }
    let run = run(system, initial, options.run, cancel);
    SweepPoint::of(run, restarted, options, cancel)
}

/// A point of a branch.
pub(super) trait OnBranch {
    /// Where its run ends.
    type State: Clone;
    /// What became of it.
    fn status(&self) -> PointStatus;
    /// Its last state, if it has a run.
    fn end(&self) -> Option<Self::State>;
}

impl OnBranch for SweepPoint {
    type State = State;

    fn status(&self) -> PointStatus {
        self.status
    }

    fn end(&self) -> Option<State> {
        self.final_state
    }
}

/// The points of a branch, made in the order of its start.
pub(super) fn in_order<P>(
    count: usize,
    start: SweepStart,
    mut one: impl FnMut(usize) -> P,
) -> Vec<P> {
    if start != SweepStart::Backward {
        return (0..count).map(one).collect();
    }
    let mut points: Vec<P> = (0..count).rev().map(&mut one).collect();
    points.reverse();
    points
}

/// A point from the last state, or from its own start where there is none or it does not fit:
/// `begun` makes it from a state, or from its own, which counts as a restart or not.
pub(super) fn follow<P: OnBranch>(
    last: &mut Option<P::State>,
    begun: impl Fn(Option<&P::State>, bool) -> P,
) -> P {
    let mut point = begun(last.as_ref(), false);
    if last.is_some() && point.status() == PointStatus::Overlap {
        point = begun(None, true);
    }
    if let Some(end) = point.end() {
        *last = Some(end);
    }
    point
}

/// One run per initial state, in parallel. Where `cancel` ends the work early, the runs that were
/// begun by then are returned, of the first so many of `initials`; those cut short say so in
/// their stop reason. A run that fails does not take the others with it.
///
/// # Errors
/// [`RunError`] for a bad option or start, before any run.
pub fn run_many(
    system: &System,
    initials: &[State],
    options: RunOptions,
    workers: &Workers,
    cancel: &CancelToken,
) -> Result<Vec<Result<Run, RunError>>, RunError> {
    run_and_count(system, initials, options, workers, cancel, &AtomicUsize::new(0))
}

/// Runs, or why there is none, in the order of their starts.
type Runs<M> = Vec<Result<Run<M>, RunError<M>>>;

/// As [`run_many`]; counts in `count` the runs that have come to an end.
pub(crate) fn run_and_count<M: Together>(
    system: &M,
    initials: &[M::State],
    options: RunOptions,
    workers: &Workers,
    cancel: &CancelToken,
    count: &AtomicUsize,
) -> Result<Runs<M>, RunError<M>> {
    options.check(system)?;
    for (place, initial) in initials.iter().enumerate() {
        Simulation::new(system, initial.clone())
            .map_err(|error| StateError::OneOfSeveral { place, error: Box::new(error) })?;
    }
    let runs = workers.install(|| {
        side_by_side(initials.len(), &|next, done, in_hand| {
            let mut next = || {
                let place = next().filter(|_| !cancel.is_cancelled())?;
                Some((place, system.clone(), initials[place].clone()))
            };
            let mut counted = |place: usize, run: Result<Run<M>, RunError<M>>| {
                count.fetch_add(1, Relaxed);
                done(place, run);
            };
            run_together(&mut next, options, cancel, &mut counted, in_hand);
        })
    });
    Ok(runs.into_iter().map_while(|run| run).collect())
}

/// Follows every start until it arrives at one of the targets, and counts in `count` those that
/// have come to an end. `cancel` ends the work; starts not reached are then pending.
///
/// # Errors
/// [`ParameterError`] for a bad option, before any run.
pub fn arrive_many<M: Followed>(
    system: &M,
    initials: &[M::State],
    targets: &[Target<M::Section>],
    options: RunOptions,
    workers: &Workers,
    cancel: &CancelToken,
    count: &AtomicUsize,
) -> Result<Vec<Arrival<M::Section>>, ParameterError> {
    options.check(system)?;
    let arrivals = workers.install(|| {
        side_by_side(initials.len(), &|next, done, in_hand| {
            let done = RefCell::new(|place, arrival: Arrival<M::Section>| {
                count.fetch_add(usize::from(arrival.status != ArrivalStatus::Pending), Relaxed);
                done(place, arrival);
            });
            let mut next = || loop {
                let place = next().filter(|_| !cancel.is_cancelled())?;
                match BasinRun::new(system, initials[place].clone(), targets, options, cancel) {
                    Ok(run) => return Some((place, run)),
                    Err(_) => (done.borrow_mut())(place, Arrival::empty(ArrivalStatus::Overlap)),
                }
            };
            let mut arrived =
                |(place, run): (usize, BasinRun<M>)| (done.borrow_mut())(place, run.arrive());
            run_batch(&mut next, &mut arrived, in_hand);
        })
    });
    let pending = || Arrival::empty(ArrivalStatus::Pending);
    Ok(arrivals.into_iter().map(|arrival| arrival.unwrap_or_else(pending)).collect())
}
