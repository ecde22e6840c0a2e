//! The trace of a run, as a file has it.

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays::to_vec;
use crate::simulate::run::{Noted, Recorded, Run};

/// A trace as JSON, and the residuals of the clocks, for Python.
pub(super) type Told<'py> = (Bound<'py, PyArray1<u8>>, Bound<'py, PyArray1<f64>>);
/// The same, as they come back.
pub(super) type Given<'py> = (PyReadonlyArray1<'py, u8>, PyReadonlyArray1<'py, f64>);

/// The trace of a run; `None` where it has not kept all of its events.
pub(super) fn told<'py, M: Recorded>(py: Python<'py>, run: &Run<M>) -> PyResult<Option<Told<'py>>> {
    let Some((noted, residuals)) = run.noted() else { return Ok(None) };
    let text = serde_json::to_vec(&noted).map_err(|e| PyValueError::new_err(e.to_string()))?;
    Ok(Some((PyArray1::from_vec(py, text), PyArray1::from_slice(py, residuals))))
}

/// A run with its trace, if it has one.
pub(super) fn traced<M: Recorded>(run: Run<M>, trace: Option<Given<'_>>) -> PyResult<Run<M>> {
    let Some((text, residuals)) = trace else { return Ok(run) };
    let text = text.as_array().to_vec();
    let noted: Noted<M> =
        serde_json::from_slice(&text).map_err(|e| PyValueError::new_err(e.to_string()))?;
    Ok(run.with_noted(noted, to_vec(&residuals))?)
}
