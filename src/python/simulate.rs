//! `_core.simulate`, for every machine; and what the runs of all machines have alike.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use numpy::ndarray::ArrayViewD;
use numpy::{PyArray1, PyReadonlyArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::cancel::{Progress, interruptible, interruptible_later};
use super::enums::Member;
use super::errors::Crossing;
use super::structure::PyStructure;
use super::system::{PySystem, to_state};
use crate::analysis::Workers;
use crate::analysis::sweep::run_and_count;
use crate::model::error::ParameterError;
use crate::model::structure::StructureState;
use crate::simulate::Horizon;
use crate::simulate::event::StopReason;
use crate::simulate::run::{
    Bounces, BouncesEnd, Collection, Proceeds, Recorded, Run, RunError, RunOptions,
};
use crate::simulate::tolerances::{DEFAULT_MAX_EVENTS, DEFAULT_TOLERANCE};

/// What can be simulated.
#[derive(FromPyObject)]
pub(super) enum Machine<'py> {
    System(PyRef<'py, PySystem>),
    Structure(PyRef<'py, PyStructure>),
}

enum Starts<S> {
    One(S),
    Many(Vec<S>),
}

impl<S> Starts<S> {
    /// From an array of this shape, or of several of it.
    fn of(
        array: &ArrayViewD<'_, f64>,
        shape: &[usize],
        state: impl Fn(&[f64]) -> PyResult<S>,
    ) -> PyResult<Self> {
        let numbers: Vec<f64> = array.iter().copied().collect();
        match array.shape() {
            one if one == shape => Ok(Self::One(state(&numbers)?)),
            [_, rest @ ..] if rest == shape => {
                let each = numbers.chunks_exact(shape.iter().product());
                Ok(Self::Many(each.map(state).collect::<PyResult<_>>()?))
            }
            other => {
                let message = format!("an array {shape:?} or several are needed, not {other:?}");
                Err(PyValueError::new_err(message))
            }
        }
    }
}

/// Runs that were begun, in order; whether Ctrl-C ended the work; and the place of the first that
/// failed, with the reason.
type Runs = (Vec<Py<PyAny>>, bool, Option<(usize, String)>);

/// One run from one start, or one from each of several, in parallel.
#[pyfunction]
#[pyo3(signature = (
    machine, initial, *, periods = None, time = None, keep = None,
    max_events = DEFAULT_MAX_EVENTS, chatter_tolerance = DEFAULT_TOLERANCE, section_phase = 0.0,
    workers = None, progress = None,
))]
#[allow(clippy::too_many_arguments)]
pub(super) fn simulate(
    py: Python<'_>,
    machine: Machine<'_>,
    initial: PyReadonlyArrayDyn<'_, f64>,
    periods: Option<i64>,
    time: Option<f64>,
    keep: Option<i64>,
    max_events: u64,
    chatter_tolerance: f64,
    section_phase: f64,
    workers: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Runs> {
    let horizon = horizon(periods, time)?;
    let options = RunOptions { horizon, keep, max_events, chatter_tolerance, section_phase };
    let (rows, progress) = (initial.as_array(), progress.as_ref());
    match machine {
        Machine::System(system) => {
            let starts = Starts::of(&rows, &[4], |row| to_state([row[0], row[1], row[2], row[3]]))?;
            runs(py, &system.0, starts, options, workers, progress)
        }
        Machine::Structure(structure) => {
            let count = structure.0.coordinates();
            let starts = Starts::of(&rows, &[2, count], |row| {
                Ok(StructureState::new(&row[..count], &row[count..]))
            })?;
            runs(py, &structure.0, starts, options, workers, progress)
        }
    }
}

fn runs<M: Crossing>(
    py: Python<'_>,
    machine: &M,
    starts: Starts<M::State>,
    options: RunOptions,
    workers: Option<usize>,
    progress: Option<&Py<PyAny>>,
) -> PyResult<Runs> {
    options.check(machine)?;
    let (made, interrupted) = match starts {
        Starts::One(initial) => {
            let run = collected(py, Collection::begin(machine, initial, options)?, progress)?;
            let stopped = |run: &Run<M>| run.stop_reason == StopReason::Interrupted;
            let interrupted = run.as_ref().is_ok_and(stopped);
            (vec![run], interrupted)
        }
        Starts::Many(initials) => {
            let workers = Workers::new(workers)?;
            let done = AtomicUsize::new(0);
            let progress = progress.map(|tell| Progress { tell, done: &done });
            interruptible(py, progress.as_ref(), |cancel| {
                run_and_count(machine, &initials, options, &workers, cancel, &done)
            })?
        }
    };
    let mut failure = None;
    let run_or_done = |(place, run): (usize, Result<Run<M>, RunError<M>>)| match run {
        Ok(run) => M::wrapped(py, run),
        Err(RunError::Simulation { error, done }) => {
            failure.get_or_insert_with(|| (place, error.to_string()));
            M::wrapped(py, *done)
        }
        Err(error) => Err(PyErr::from(error)),
    };
    let runs = made.into_iter().enumerate().map(run_or_done).collect::<PyResult<_>>()?;
    Ok((runs, interrupted, failure))
}

pub(super) fn horizon(periods: Option<i64>, time: Option<f64>) -> PyResult<Horizon> {
    match (periods, time) {
        (Some(periods), None) => Ok(Horizon::Periods(periods)),
        (None, Some(time)) => Ok(Horizon::Time(time)),
        (None, None) => Err(ParameterError::new("periods", "missing", "periods or time").into()),
        (Some(_), Some(time)) => {
            Err(ParameterError::new("time", time, "only one of periods and time").into())
        }
    }
}

/// Makes a run.
fn collected<M: Crossing>(
    py: Python<'_>,
    mut collection: Collection<M>,
    progress: Option<&Py<PyAny>>,
) -> PyResult<Result<Run<M>, RunError<M>>> {
    carry_out(py, &mut collection, READS, progress)?;
    Ok(collection.into_run())
}

/// Reads of the token between two readings of the clock at the start of a run.
const READS: u64 = 16;

/// Does the work on a run, which Ctrl-C can end, and tells how many millionths of its time are done if that
/// is wanted. Between two readings of the clock at the start it reads the token so many times.
pub(super) fn carry_out(
    py: Python<'_>,
    work: &mut (impl Proceeds + Send + ?Sized),
    reads: u64,
    progress: Option<&Py<PyAny>>,
) -> PyResult<()> {
    let Some(tell) = progress else {
        return interruptible_later(py, reads, |cancel| work.proceed(cancel));
    };
    let done = AtomicUsize::new(0);
    let progress = Progress { tell, done: &done };
    interruptible::<_, PyErr>(py, Some(&progress), |cancel| {
        while !work.proceed(&cancel.part_of(ASKS_PER_PART)) && !cancel.is_cancelled() {
            done.store(work.millionths_done(), Relaxed);
        }
        done.store(work.millionths_done(), Relaxed);
        Ok(())
    })?;
    Ok(())
}

/// Asks of the token, one before each flight, between two looks at how far a run is: some tens of
/// milliseconds.
const ASKS_PER_PART: u64 = 1 << 15;

/// A run that goes on for further periods or time.
pub(super) fn resumed<M: Crossing>(
    py: Python<'_>,
    run: &Run<M>,
    periods: Option<i64>,
    time: Option<f64>,
    keep: Option<i64>,
    max_events: Option<u64>,
) -> PyResult<Run<M>> {
    let options = further(run, periods, time, keep, max_events)?;
    Ok(collected(py, run.begin_resuming(options)?, None)??)
}

/// How a run is resumed.
fn further<M: Recorded>(
    run: &Run<M>,
    periods: Option<i64>,
    time: Option<f64>,
    keep: Option<i64>,
    max_events: Option<u64>,
) -> PyResult<RunOptions> {
    let done = run.final_state.clock.period;
    let horizon = match horizon(periods, time)? {
        // Checked before the sum: a bad number must be named as it was given.
        Horizon::Periods(more) if more < 0 || done.checked_add(more).is_none() => {
            return Err(ParameterError::new("periods", more, "a whole number >= 0").into());
        }
        Horizon::Periods(more) => Horizon::Periods(done + more),
        Horizon::Time(more) if more.is_nan() || more < 0.0 => {
            return Err(ParameterError::new("time", more, "a finite number >= 0").into());
        }
        Horizon::Time(more) => Horizon::Time(run.final_state.time + more),
        other @ Horizon::Impacts { .. } => other,
    };
    if let (Some(keep), Some(periods)) = (keep, periods)
        && keep > periods
    {
        let allowed = "a whole number in [0, periods]";
        return Err(ParameterError::new("keep", keep, allowed).into());
    }
    let max_events = max_events.unwrap_or(run.options.max_events);
    Ok(RunOptions { horizon, keep, max_events, ..run.options })
}

/// The error about times of which some lie outside the kept window.
pub(super) fn outside<M: Recorded>(run: &Run<M>) -> PyErr {
    let (from, to) = (run.kept_from(), run.final_state.time);
    PyValueError::new_err(format!("t outside the kept window [{from}, {to}]"))
}

/// Rows, which of them were skipped, why each list of skipped ones ends, whether Ctrl-C came.
pub(super) type PyBounces<'py> =
    (Bound<'py, PyAny>, Bound<'py, PyArray1<bool>>, Vec<Member<BouncesEnd>>, bool);

/// Impacts of the kept window and those skipped in it, down to an approach velocity and at most so
/// many.
pub(super) fn bounces<'py, M: Crossing>(
    py: Python<'py>,
    run: &Run<M>,
    slowest: f64,
    most: usize,
) -> PyResult<PyBounces<'py>> {
    let (bounces, interrupted) = interruptible::<_, ParameterError>(py, None, |cancel| {
        Ok(run.bounces(slowest, most, cancel))
    })?;
    let Bounces { impacts, skipped, ends } = bounces;
    let ends = ends.into_iter().map(Member).collect();
    Ok((M::impacts(py, run, &impacts)?, PyArray1::from_vec(py, skipped), ends, interrupted))
}

/// The methods of a run of Python: those that all have, which stand here, and its own.
macro_rules! run_methods {
    ($name:ident { $($own:tt)* }) => {
        #[pymethods]
        impl $name {
            /// The kept impacts.
            #[getter]
            fn impacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                Crossing::impacts(py, &self.0, &self.0.impacts)
            }
            /// Time in contact within the kept window.
            #[getter]
            fn time_in_contact(&self) -> f64 {
                self.0.time_in_contact()
            }
            /// Why it ended.
            #[getter]
            fn stop_reason(&self) -> &'static str {
                self.0.stop_reason.name()
            }
            /// Start of the kept window (time).
            #[getter]
            fn kept_from(&self) -> f64 {
                self.0.kept_from()
            }
            /// Impacts since t = 0, kept or not.
            #[getter]
            fn impact_count(&self) -> u64 {
                self.0.impact_count
            }
            /// Whether Ctrl-C ended it.
            #[getter]
            fn interrupted(&self) -> bool {
                self.0.stop_reason == $crate::simulate::event::StopReason::Interrupted
            }

            /// Impacts of the kept window and those skipped in it, down to an approach velocity and
            /// at most so many; of each, whether it was skipped; of each chatter, why its list
            /// ends. After Ctrl-C those up to there.
            fn bounces<'py>(
                &self,
                py: Python<'py>,
                slowest: f64,
                most: usize,
            ) -> PyResult<$crate::python::simulate::PyBounces<'py>> {
                $crate::python::simulate::bounces(py, &self.0, slowest, most)
            }

            /// Period, impact count and label.
            fn period(&self, py: Python<'_>) -> PyResult<$crate::python::period::PyPeriodReport> {
                $crate::python::period::PyPeriodReport::of(py, |cancel| self.0.period(cancel))
            }

            /// Energies and works in the kept window, by name; `None` after Ctrl-C.
            fn energy_audit(
                &self,
                py: Python<'_>,
            ) -> PyResult<Option<$crate::python::errors::Works>> {
                let audit = |cancel: &_| {
                    Ok::<_, $crate::model::error::ParameterError>(Crossing::works(&self.0, cancel))
                };
                Ok($crate::python::cancel::interruptible(py, None, audit)?.0)
            }

            /// What it knows of its events beyond the tables, as JSON, and what their clocks hold
            /// beyond them; `None` where it has not kept all.
            fn trace<'py>(
                &self,
                py: Python<'py>,
            ) -> PyResult<Option<$crate::python::trace::Told<'py>>> {
                $crate::python::trace::told(py, &self.0)
            }

            /// Continue for further periods or time.
            #[pyo3(signature = (*, periods = None, time = None, keep = None, max_events = None))]
            fn resume(
                &self,
                py: Python<'_>,
                periods: Option<i64>,
                time: Option<f64>,
                keep: Option<i64>,
                max_events: Option<u64>,
            ) -> PyResult<Self> {
                let run = &self.0;
                let run = $crate::python::simulate::resumed(
                    py, run, periods, time, keep, max_events,
                )?;
                Ok(Self(run))
            }

            $($own)*
        }
    };
}
pub(super) use run_methods;
