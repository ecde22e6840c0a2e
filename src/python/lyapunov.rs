//! `_core.Spectrum` and `lyapunov_spectrum`.

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

use super::arrays;
use super::cancel::interruptible;
use super::run::PyRun;
use crate::analysis::lyapunov::{LyapunovError, Spectrum};
use crate::model::error::ParameterError;
use crate::simulate::event::StopReason;

/// Lyapunov exponents of a motion.
#[pyclass(name = "Spectrum", module = "vibroimpact._core", frozen)]
pub(super) struct PySpectrum(Spectrum);

#[pymethods]
impl PySpectrum {
    /// (4,) per unit time, descending.
    #[getter]
    fn exponents<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.0.exponents)
    }
    /// (4,) standard errors.
    #[getter]
    fn errors<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.0.errors)
    }
    /// Time measured over.
    #[getter]
    fn time(&self) -> f64 {
        self.0.time
    }
    /// Impacts in that time.
    #[getter]
    fn impacts(&self) -> u64 {
        self.0.impacts
    }
    /// (h,) times since the measurement began.
    #[getter]
    fn history_time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.0.history_time)
    }
    /// (h, 4) exponents up to them.
    #[getter]
    fn history<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::states(py, &self.0.history)
    }
    /// Why the measurement ended early; None if it did not.
    #[getter]
    fn error(&self) -> Option<String> {
        self.0.error.as_ref().map(ToString::to_string)
    }
    /// Whether Ctrl-C ended it.
    #[getter]
    fn interrupted(&self) -> bool {
        self.0.error == Some(LyapunovError::Stopped(StopReason::Interrupted))
    }
}

/// The spectrum of the motion that goes on from the end of `run`, or from where it has settled.
#[pyfunction]
#[pyo3(signature = (run, steps, step = None))]
pub(super) fn lyapunov_spectrum(
    py: Python<'_>,
    run: &PyRun,
    steps: u32,
    step: Option<f64>,
) -> PyResult<PySpectrum> {
    let (spectrum, _) = interruptible::<Spectrum, ParameterError>(py, None, |cancel| {
        let (_, later) = run.0.on_attractor(cancel);
        crate::analysis::lyapunov::lyapunov_spectrum(
            later.as_ref().unwrap_or(&run.0),
            steps,
            step,
            cancel,
        )
    })?;
    Ok(PySpectrum(spectrum))
}
