//! `_core.Sensitivity`.

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use super::arrays;
use super::cancel::{interrupted, interruptible};
use super::errors::failed;
use super::run::PyRun;
use crate::model::state::State;
use crate::tangent::{OneSidedReason, Sensitivity, SensitivityError};

impl From<SensitivityError> for PyErr {
    fn from(error: SensitivityError) -> Self {
        match error {
            SensitivityError::Parameter(error) => error.into(),
            SensitivityError::State(error) => error.into(),
            SensitivityError::Cancelled => interrupted(error.to_string()),
            _ => failed(error.to_string()),
        }
    }
}

/// Derivatives of a run.
#[pyclass(name = "Sensitivity", module = "vibroimpact._core", frozen)]
pub(super) struct PySensitivity(Sensitivity);

impl PySensitivity {
    /// A table of these dimensions, the last of which is what is differentiated by.
    fn table<'py, const N: usize>(
        &self,
        py: Python<'py>,
        values: &[f64],
        inner: [usize; N],
    ) -> PyResult<Bound<'py, PyAny>> {
        let array = PyArray1::from_slice(py, values);
        let width: usize = inner.iter().product::<usize>() * self.0.names.len();
        let rows = values.len() / width;
        let shape: Vec<usize> =
            [rows].into_iter().chain(inner).chain([self.0.names.len()]).collect();
        let shape = PyTuple::new(py, shape)?;
        array.call_method1("reshape", (shape,))
    }
}

#[pymethods]
impl PySensitivity {
    /// (n, k) of the times of the kept impacts.
    #[getter]
    fn times<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.table(py, &self.0.times, [])
    }
    /// (n, 4, k) of the states before them.
    #[getter]
    fn before<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.table(py, &self.0.before, [4])
    }
    /// (n, 4, k) of the states after them.
    #[getter]
    fn after<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.table(py, &self.0.after, [4])
    }
    /// (m, 4, k) of the sections.
    #[getter]
    fn stroboscopic<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.table(py, &self.0.stroboscopic, [4])
    }
    /// (1, 4, k) of the final state.
    #[getter]
    fn final_state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.table(py, &self.0.final_state, [4])
    }
    /// Index, time and reason of each event from which on derivatives are one-sided.
    #[getter]
    fn one_sided(&self) -> Vec<(i64, f64, &'static str)> {
        let reason = |reason: OneSidedReason| reason.name();
        self.0.one_sided.iter().map(|at| (at.index, at.time, reason(at.reason))).collect()
    }
    /// (len(t), 4, k) of the states at times inside the kept window.
    fn trajectory<'py>(
        &self,
        py: Python<'py>,
        t: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let times = arrays::to_vec(&t);
        let rows = py.detach(|| self.0.trajectory(&times))?;
        let rows = rows.ok_or_else(|| {
            pyo3::exceptions::PyValueError::new_err("t outside of the kept window")
        })?;
        self.table(py, &rows, [4])
    }
}

/// Derivatives of a run from this start by the numbers of these names.
#[pyfunction]
pub(super) fn sensitivity(
    py: Python<'_>,
    run: &PyRun,
    initial: [f64; 4],
    names: Vec<String>,
) -> PyResult<PySensitivity> {
    let [x1, v1, x2, v2] = initial;
    let initial = State { x1, v1, x2, v2 };
    let (found, _) = interruptible(py, None, |cancel| {
        crate::tangent::sensitivity(&run.0, initial, &names, cancel)
    })?;
    Ok(PySensitivity(found))
}
