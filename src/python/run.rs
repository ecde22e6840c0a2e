//! `_core.Run`, `simulate` and `simulate_many`.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays;
use super::cancel::{Progress, interruptible, interruptible_later};
use super::enums::Member;
use super::errors::Crossing;
use super::system::PySystem;
use crate::analysis::Workers;
use crate::analysis::period::{EvidenceKind, ImpactCount, PeriodReport, WhyUndecided};
use crate::analysis::sweep::run_and_count;
use crate::contact::sustained::ContactMode;
use crate::model::error::ParameterError;
use crate::model::parameters::System;
use crate::model::state::State;
use crate::simulate::Horizon;
use crate::simulate::event::StopReason;
use crate::simulate::run::{
    Bounces, BouncesEnd, Collection, EnergyAudit, FinalState, Recorded, Run, RunError, RunOptions,
};
use crate::simulate::tolerances::{DEFAULT_MAX_EVENTS, DEFAULT_TOLERANCE};

/// State at the end of a run.
#[pyclass(name = "FinalState", module = "vibroimpact._core", frozen)]
pub(super) struct PyFinalState(FinalState);

#[pymethods]
impl PyFinalState {
    #[getter]
    fn x1(&self) -> f64 {
        self.0.state.x1
    }
    #[getter]
    fn v1(&self) -> f64 {
        self.0.state.v1
    }
    #[getter]
    fn x2(&self) -> f64 {
        self.0.state.x2
    }
    #[getter]
    fn v2(&self) -> f64 {
        self.0.state.v2
    }
    #[getter]
    fn time(&self) -> f64 {
        self.0.time
    }
    #[getter]
    fn period(&self) -> i64 {
        self.0.clock.period
    }
    #[getter]
    fn time_in_period(&self) -> f64 {
        self.0.clock.time_in_period
    }
    /// Contact mode.
    #[getter]
    fn mode(&self) -> &'static str {
        self.0.mode.map_or("flight", ContactMode::name)
    }
    fn __repr__(&self) -> String {
        let FinalState { state: s, clock, time, .. } = self.0;
        format!(
            "FinalState(x1={:?}, v1={:?}, x2={:?}, v2={:?}, time={time:?}, period={})",
            s.x1, s.v1, s.x2, s.v2, clock.period
        )
    }
}

/// The label of a motion from its kept stroboscopic states, with the evidence.
#[pyclass(name = "PeriodReport", module = "vibroimpact._core", frozen)]
pub(super) struct PyPeriodReport(pub(super) PeriodReport);

#[pymethods]
impl PyPeriodReport {
    #[getter]
    fn m(&self) -> Option<usize> {
        self.0.orbit.map(|(m, _)| m)
    }
    #[getter]
    fn n(&self) -> Option<f64> {
        self.0.orbit.map(|(_, n)| match n {
            ImpactCount::Finite(n) => n as f64,
            ImpactCount::Infinite => f64::INFINITY,
        })
    }
    #[getter]
    fn residual(&self) -> f64 {
        self.0.residual
    }
    #[getter]
    fn kind(&self) -> Member<EvidenceKind> {
        Member(self.0.evidence.kind())
    }
    #[getter]
    fn further(&self) -> i64 {
        self.0.evidence.further()
    }
    #[getter]
    fn rate(&self) -> Option<f64> {
        self.0.evidence.rate()
    }
    #[getter]
    fn growth(&self) -> Option<f64> {
        self.0.evidence.growth().map(|growth| growth.mean)
    }
    #[getter]
    fn growth_error(&self) -> Option<f64> {
        self.0.evidence.growth().map(|growth| growth.error)
    }
    #[getter]
    fn growth_periods(&self) -> Option<usize> {
        self.0.evidence.growth().map(|growth| growth.periods)
    }
    #[getter]
    fn why(&self) -> Option<Member<WhyUndecided>> {
        self.0.evidence.why().map(Member)
    }
    /// The evidence in words.
    #[getter]
    fn text(&self) -> String {
        self.0.evidence.to_string()
    }
    /// Whether Ctrl-C ended it.
    #[getter]
    fn interrupted(&self) -> bool {
        self.0.is_interrupted()
    }
    #[getter]
    fn label(&self) -> String {
        self.0.label()
    }
    fn __repr__(&self) -> String {
        format!("PeriodReport(label={:?}, residual={:e})", self.0.label(), self.0.residual)
    }
}

/// Rows, which of them were skipped, why each list of skipped ones ends, whether Ctrl-C came.
type PyBounces<'py> =
    (Bound<'py, PyAny>, Bound<'py, PyArray1<bool>>, Vec<Member<BouncesEnd>>, bool);

/// Result of simulate.
#[pyclass(name = "Run", module = "vibroimpact._core", frozen)]
pub(super) struct PyRun(pub(super) Run);

#[pymethods]
impl PyRun {
    #[getter]
    fn impacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::records(py, &self.0.impacts)
    }
    #[getter]
    fn stroboscopic<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::states(py, &self.0.stroboscopic)
    }
    #[getter]
    fn events<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::records(py, &self.0.events)
    }
    #[getter]
    fn grazes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::records(py, &self.0.grazes)
    }
    #[getter]
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::records(py, &self.0.contacts)
    }
    /// Time in contact within the kept window.
    #[getter]
    fn time_in_contact(&self) -> f64 {
        self.0.time_in_contact()
    }
    #[getter]
    fn final_state(&self) -> PyFinalState {
        PyFinalState(self.0.final_state)
    }
    #[getter]
    fn stop_reason(&self) -> &'static str {
        self.0.stop_reason.name()
    }
    /// A sentence on how the run ended.
    #[getter]
    fn stop_detail(&self) -> String {
        let FinalState { state, time, .. } = self.0.final_state;
        format!(
            "{} at t = {time} after {} impacts, state {:?}",
            self.0.stop_reason.name(),
            self.0.impact_count,
            state.to_array()
        )
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
    #[getter]
    fn interrupted(&self) -> bool {
        self.0.stop_reason == StopReason::Interrupted
    }

    /// States (len(t), 4) at times inside the kept window, with `forces` also the contact forces
    /// (len(t), 6); and whether Ctrl-C ended it with fewer rows.
    fn trajectory<'py>(
        &self,
        py: Python<'py>,
        t: PyReadonlyArray1<'py, f64>,
        forces: bool,
    ) -> PyResult<(Bound<'py, PyArray2<f64>>, bool)> {
        let times = arrays::to_vec(&t);
        let width = if forces { 6 } else { 4 };
        let (flat, interrupted) = interruptible(py, None, |cancel| {
            let mut flat = Vec::with_capacity(width * times.len());
            let done = self.0.follow(&times, cancel, |state, force| {
                flat.extend(state.to_array());
                if forces {
                    flat.extend([force.normal, force.tangential]);
                }
            });
            done.map(|()| flat).ok_or_else(|| self.outside())
        })?;
        let rows = flat.len() / width;
        Ok((PyArray1::from_vec(py, flat).reshape([rows, width])?, interrupted))
    }

    /// Impacts of the kept window and those skipped in it, down to an approach velocity and at most
    /// so many; of each, whether it was skipped; of each chatter, why its list ends. After Ctrl-C
    /// those up to there.
    fn bounces<'py>(&self, py: Python<'py>, slowest: f64, most: usize) -> PyResult<PyBounces<'py>> {
        let (bounces, interrupted) = interruptible::<_, ParameterError>(py, None, |cancel| {
            Ok(self.0.bounces(slowest, most, cancel))
        })?;
        let Bounces { impacts, skipped, ends } = bounces;
        let ends = ends.into_iter().map(Member).collect();
        let skipped = PyArray1::from_vec(py, skipped);
        Ok((arrays::records(py, &impacts)?, skipped, ends, interrupted))
    }

    /// Energies and works in the kept window, by name; `None` after Ctrl-C.
    fn energy_audit(&self, py: Python<'_>) -> PyResult<Option<BTreeMap<&'static str, f64>>> {
        let (audit, _) =
            interruptible::<_, ParameterError>(py, None, |cancel| Ok(self.0.energy_audit(cancel)))?;
        Ok(audit.map(works))
    }

    /// Period, impact count and label.
    fn period(&self, py: Python<'_>) -> PyResult<PyPeriodReport> {
        let (report, _) =
            interruptible::<_, ParameterError>(py, None, |cancel| Ok(self.0.period(cancel)))?;
        Ok(PyPeriodReport(report))
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
        let options = further(&self.0, periods, time, keep, max_events)?;
        Ok(Self(make(py, self.0.begin_resuming(options)?, None)?))
    }

    /// Everything but the arrays, as JSON with exact numbers.
    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string(&self.0).map_err(|e| PyValueError::new_err(e.to_string()))
    }

    /// A run from the text of `to_json` and the arrays.
    #[staticmethod]
    fn from_parts(
        text: &str,
        impacts: &Bound<'_, PyAny>,
        stroboscopic: PyReadonlyArray2<'_, f64>,
        events: &Bound<'_, PyAny>,
        grazes: &Bound<'_, PyAny>,
        contacts: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let mut run: Run =
            serde_json::from_str(text).map_err(|e| PyValueError::new_err(e.to_string()))?;
        run.system = run.system.validated()?;
        run.impacts = arrays::from_records(impacts)?;
        run.stroboscopic = arrays::to_states(&stroboscopic)?;
        run.events = arrays::from_records(events)?;
        run.grazes = arrays::from_records(grazes)?;
        run.contacts = arrays::from_records(contacts)?;
        Ok(Self(run))
    }
}

impl PyRun {
    fn outside(&self) -> PyErr {
        let (from, to) = (self.0.kept_from(), self.0.final_state.time);
        PyValueError::new_err(format!("t outside the kept window [{from}, {to}]"))
    }
}

/// How a run is resumed.
pub(super) fn further<M: Recorded>(
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

/// The numbers of an audit, by name.
fn works(audit: EnergyAudit) -> BTreeMap<&'static str, f64> {
    BTreeMap::from([
        ("energy_start", audit.energy_start),
        ("energy_end", audit.energy_end),
        ("moment", audit.moment),
        ("force", audit.force),
        ("damping", audit.damping),
        ("restitution", audit.restitution),
        ("impact_friction", audit.impact_friction),
        ("contact_friction", audit.contact_friction),
        ("wall", audit.wall),
        ("total", audit.total),
        ("residual", audit.residual()),
    ])
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

pub(super) fn to_state(initial: [f64; 4]) -> PyResult<State> {
    let [x1, v1, x2, v2] = initial;
    Ok(State::new(x1, v1, x2, v2)?)
}

/// One run.
#[pyfunction]
#[pyo3(signature = (
    system, initial, *, periods = None, time = None, keep = None,
    max_events = DEFAULT_MAX_EVENTS, chatter_tolerance = DEFAULT_TOLERANCE, section_phase = 0.0,
    progress = None,
))]
#[allow(clippy::too_many_arguments)]
pub(super) fn simulate(
    py: Python<'_>,
    system: &PySystem,
    initial: [f64; 4],
    periods: Option<i64>,
    time: Option<f64>,
    keep: Option<i64>,
    max_events: u64,
    chatter_tolerance: f64,
    section_phase: f64,
    progress: Option<Py<PyAny>>,
) -> PyResult<PyRun> {
    let horizon = horizon(periods, time)?;
    let options = RunOptions { horizon, keep, max_events, chatter_tolerance, section_phase };
    let collection = Collection::begin(&system.0, to_state(initial)?, options)?;
    Ok(PyRun(make(py, collection, progress.as_ref())?))
}

impl Crossing for System {
    fn wrapped(py: Python<'_>, run: Run) -> PyResult<Py<PyAny>> {
        Ok(PyRun(run).into_pyobject(py)?.into_any().unbind())
    }
}

/// Makes a run, and tells how much of it is done if that is wanted.
pub(super) fn make<M: Crossing>(
    py: Python<'_>,
    mut collection: Collection<M>,
    progress: Option<&Py<PyAny>>,
) -> PyResult<Run<M>> {
    if let Some(tell) = progress {
        return make_and_tell(py, collection, tell);
    }
    interruptible_later(py, |cancel| collection.proceed(cancel))?;
    Ok(collection.into_run()?)
}

/// Makes a run, and tells how many millionths of its time are done.
fn make_and_tell<M: Crossing>(
    py: Python<'_>,
    mut collection: Collection<M>,
    tell: &Py<PyAny>,
) -> PyResult<Run<M>> {
    let done = AtomicUsize::new(0);
    let progress = Progress { tell, done: &done };
    interruptible::<_, PyErr>(py, Some(&progress), |cancel| {
        while !collection.proceed(&cancel.part_of(ASKS_PER_PART)) && !cancel.is_cancelled() {
            done.store(collection.millionths_done(), Relaxed);
        }
        done.store(collection.millionths_done(), Relaxed);
        Ok(())
    })?;
    Ok(collection.into_run()?)
}

/// Asks of the token, one before each flight, between two looks at how far a run is: some tens of
/// milliseconds.
const ASKS_PER_PART: u64 = 1 << 15;

/// One run per initial state, in parallel, and whether Ctrl-C ended the work.
#[pyfunction]
#[pyo3(signature = (
    system, initials, *, periods = None, time = None, keep = None,
    max_events = DEFAULT_MAX_EVENTS, chatter_tolerance = DEFAULT_TOLERANCE, section_phase = 0.0,
    workers = None, progress = None,
))]
#[allow(clippy::too_many_arguments)]
pub(super) fn simulate_many(
    py: Python<'_>,
    system: &PySystem,
    initials: PyReadonlyArray2<'_, f64>,
    periods: Option<i64>,
    time: Option<f64>,
    keep: Option<i64>,
    max_events: u64,
    chatter_tolerance: f64,
    section_phase: f64,
    workers: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Vec<PyRun>, bool, Option<String>)> {
    let horizon = horizon(periods, time)?;
    let options = RunOptions { horizon, keep, max_events, chatter_tolerance, section_phase };
    options.check(&system.0)?;
    let initials: PyResult<Vec<State>> =
        arrays::to_states(&initials)?.into_iter().map(to_state).collect();
    let (initials, system) = (initials?, system.0);
    let workers = Workers::new(workers)?;
    let done = AtomicUsize::new(0);
    let progress = progress.as_ref().map(|tell| Progress { tell, done: &done });
    let (runs, interrupted) = interruptible(py, progress.as_ref(), |cancel| {
        run_and_count(&system, &initials, options, &workers, cancel, &done)
    })?;
    let mut failure = None;
    let run_or_done = |(place, run): (usize, Result<Run, RunError>)| match run {
        Ok(run) => Ok(PyRun(run)),
        Err(RunError::Simulation { error, done }) => {
            failure.get_or_insert_with(|| format!("run {place}: {error}"));
            Ok(PyRun(*done))
        }
        Err(error) => Err(PyErr::from(error)),
    };
    let runs = runs.into_iter().enumerate().map(run_or_done).collect::<PyResult<_>>()?;
    Ok((runs, interrupted, failure))
}
