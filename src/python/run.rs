//! `_core.Run`, and what it consists of.

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays;
use super::cancel::interruptible_if;
use super::errors::{Crossing, Works};
use super::simulate::{outside, run_methods};
use super::trace::{Given, traced};
use crate::contact::sustained::ContactMode;
use crate::model::parameters::System;
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::ImpactRecord;
use crate::simulate::run::{FinalState, Run};

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

/// Result of simulate.
#[pyclass(name = "Run", module = "vibroimpact._core", frozen)]
pub(super) struct PyRun(pub(super) Run);

run_methods! { PyRun {
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
    #[getter]
    fn final_state(&self) -> PyFinalState {
        PyFinalState(self.0.final_state)
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
        let is_long = !self.0.is_soon_followed(times.len());
        let (flat, interrupted) = interruptible_if(py, is_long, None, |cancel| {
            let mut flat = Vec::with_capacity(width * times.len());
            let done = self.0.follow(&times, cancel, |state, force| {
                flat.extend(state.to_array());
                if forces {
                    flat.extend([force.normal, force.tangential]);
                }
            });
            done.map(|()| flat).ok_or_else(|| outside(&self.0))
        })?;
        let rows = flat.len() / width;
        Ok((PyArray1::from_vec(py, flat).reshape([rows, width])?, interrupted))
    }

    /// Everything but the arrays, as JSON with exact numbers.
    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string(&self.0).map_err(|e| PyValueError::new_err(e.to_string()))
    }

    /// A run from the text of `to_json`, the arrays, and what `trace` gave.
    #[staticmethod]
    #[pyo3(signature = (text, impacts, stroboscopic, events, grazes, contacts, trace = None))]
    fn from_parts(
        text: &str,
        impacts: &Bound<'_, PyAny>,
        stroboscopic: PyReadonlyArray2<'_, f64>,
        events: &Bound<'_, PyAny>,
        grazes: &Bound<'_, PyAny>,
        contacts: &Bound<'_, PyAny>,
        trace: Option<Given<'_>>,
    ) -> PyResult<Self> {
        let mut run: Run =
            serde_json::from_str(text).map_err(|e| PyValueError::new_err(e.to_string()))?;
        run.system = run.system.validated()?;
        run.impacts = arrays::from_records(impacts)?;
        run.stroboscopic = arrays::to_states(&stroboscopic)?;
        run.events = arrays::from_records(events)?;
        run.grazes = arrays::from_records(grazes)?;
        run.contacts = arrays::from_records(contacts)?;
        Ok(Self(traced(run, trace)?))
    }
}}

impl Crossing for System {
    fn wrapped(py: Python<'_>, run: Run) -> PyResult<Py<PyAny>> {
        Ok(Py::new(py, PyRun(run))?.into_any())
    }
    fn impacts<'py>(
        py: Python<'py>,
        _run: &Run,
        rows: &[ImpactRecord],
    ) -> PyResult<Bound<'py, PyAny>> {
        arrays::records(py, rows)
    }

    fn works(run: &Run, cancel: &CancelToken) -> Option<Works> {
        let audit = run.energy_audit(cancel)?;
        Some(Works::from([
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
        ]))
    }
}
