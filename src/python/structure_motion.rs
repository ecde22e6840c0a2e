//! `_core.StructureOrbit`, `_core.StructureSpectrum` and what makes them.

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

use super::cancel::interruptible;
use super::structure_run::PyStructureRun;
use crate::analysis::{
    StructureLyapunovError, StructureOrbit, StructureOrbitError, StructureSpectrum,
    StructureStability, structure_lyapunov, structure_orbit,
};
use crate::model::error::ParameterError;
use crate::tangent::structure::StructurePassage;

/// A periodic motion of a structure.
#[pyclass(name = "StructureOrbit", module = "vibroimpact._core", frozen)]
pub(super) struct PyStructureOrbit(StructureOrbit);

#[pymethods]
impl PyStructureOrbit {
    /// (2, N): q and v at the start of a drive period.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let state = &self.0.state;
        let flat: Vec<f64> = state.numbers().collect();
        PyArray1::from_vec(py, flat).reshape([2, state.q.len()])
    }

    /// Its length in drive periods.
    #[getter]
    fn periods(&self) -> u32 {
        self.0.periods
    }

    /// Largest difference of its end from its start.
    #[getter]
    fn residual(&self) -> f64 {
        self.0.residual
    }

    /// Derivative of the return map, (2N, 2N).
    #[getter]
    fn derivative<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let matrix = &self.0.matrix;
        let count = matrix.nrows();
        let entries = (0..count).flat_map(|i| (0..count).map(move |j| matrix[(i, j)]));
        PyArray1::from_iter(py, entries).reshape([count, count])
    }

    /// Its eigenvalues, real and imaginary parts, by descending modulus.
    #[getter]
    fn multipliers(&self) -> Vec<(f64, f64)> {
        self.0.multipliers.iter().map(|each| (each.re, each.im)).collect()
    }

    /// Rounding of their moduli.
    #[getter]
    fn bound(&self) -> f64 {
        self.0.bound
    }

    /// stable, unstable or undecided.
    #[getter]
    fn stability(&self) -> &'static str {
        match self.0.stability {
            StructureStability::Stable => "stable",
            StructureStability::Unstable => "unstable",
            StructureStability::Undecided => "undecided",
        }
    }

    /// Impacts of an orbit at each stop, without those that a complete chatter skips.
    #[getter]
    fn impacts(&self) -> Vec<u64> {
        self.0.impacts.clone()
    }

    /// Whether an orbit has complete chatter.
    #[getter]
    fn chatters(&self) -> bool {
        self.0.passed.iter().any(|event| matches!(event, StructurePassage::Chatter(_)))
    }
}

/// The periodic motion of so many drive periods on which a run has settled; or why there is none.
#[pyfunction]
pub(super) fn structure_motion(
    py: Python<'_>,
    run: &PyStructureRun,
    periods: u32,
) -> PyResult<(Option<PyStructureOrbit>, Option<String>)> {
    let state = run.0.final_state.state.clone();
    let (found, _) = interruptible::<_, ParameterError>(py, None, |cancel| {
        Ok(structure_orbit(&run.0.system, state, periods, cancel))
    })?;
    match found {
        Ok(orbit) => Ok((Some(PyStructureOrbit(orbit)), None)),
        Err(StructureOrbitError::Parameter(error)) => Err(error.into()),
        Err(error) => Ok((None, Some(error.to_string()))),
    }
}

/// Lyapunov exponents of a motion of a structure.
#[pyclass(name = "StructureSpectrum", module = "vibroimpact._core", frozen)]
pub(super) struct PyStructureSpectrum(StructureSpectrum, bool);

#[pymethods]
impl PyStructureSpectrum {
    /// Per unit time, descending.
    #[getter]
    fn exponents<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.0.exponents)
    }

    /// Their standard errors.
    #[getter]
    fn errors<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.0.errors)
    }

    /// Time measured over.
    #[getter]
    fn time(&self) -> f64 {
        self.0.time
    }

    /// Impacts in it at each stop.
    #[getter]
    fn impacts(&self) -> Vec<u64> {
        self.0.impacts.clone()
    }

    /// Times since the measurement began.
    #[getter]
    fn history_time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.0.history_time)
    }

    /// The exponents up to each of these times, one row for each.
    #[getter]
    fn history<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let shape = [self.0.history.len(), self.0.exponents.len()];
        PyArray1::from_vec(py, self.0.history.concat()).reshape(shape)
    }

    /// Why the measurement ended early; None if it did not.
    #[getter]
    fn error(&self) -> Option<String> {
        self.0.error.as_ref().map(ToString::to_string)
    }

    /// Whether Ctrl-C ended it.
    #[getter]
    fn interrupted(&self) -> bool {
        self.1
    }
}

/// The largest `count` exponents of the motion from the end of a run on.
#[pyfunction]
#[pyo3(signature = (run, steps, count, step = None))]
pub(super) fn structure_spectrum(
    py: Python<'_>,
    run: &PyStructureRun,
    steps: u32,
    count: usize,
    step: Option<f64>,
) -> PyResult<PyStructureSpectrum> {
    let state = run.0.final_state.state.clone();
    let (found, interrupted) = interruptible::<_, ParameterError>(py, None, |cancel| {
        Ok(structure_lyapunov(&run.0.system, state, steps, count, step, cancel))
    })?;
    match found {
        Ok(spectrum) => Ok(PyStructureSpectrum(spectrum, interrupted)),
        Err(StructureLyapunovError::Parameter(error)) => Err(error.into()),
        Err(StructureLyapunovError::State(error)) => Err(error.into()),
    }
}
