//! `_core.RestitutionCurve`.

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use super::arrays::to_vec;
use crate::model::error::ParameterError;
use crate::model::restitution::RestitutionCurve;

/// A coefficient of restitution that depends on the approach velocity.
#[pyclass(name = "RestitutionCurve", module = "vibroimpact._core", frozen)]
pub(super) struct PyRestitutionCurve(pub RestitutionCurve);

#[pymethods]
impl PyRestitutionCurve {
    /// Linear between knots.
    #[staticmethod]
    fn table(
        speeds: PyReadonlyArray1<'_, f64>,
        values: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Self> {
        Ok(Self(RestitutionCurve::table(&to_vec(&speeds), &to_vec(&values))?))
    }

    /// A power law.
    #[staticmethod]
    fn power_law(r_low: f64, least_speed: f64, exponent: f64) -> PyResult<Self> {
        Ok(Self(RestitutionCurve::power_law(r_low, least_speed, exponent)?))
    }

    /// r at approach velocities.
    fn at<'py>(
        &self,
        py: Python<'py>,
        speeds: PyReadonlyArray1<'_, f64>,
    ) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, speeds.as_array().iter().map(|&u| self.0.at(u)))
    }

    /// The names of its numbers.
    #[getter]
    fn names(&self) -> Vec<&'static str> {
        self.0.names()
    }

    /// The value of one of them.
    fn get(&self, name: &str) -> PyResult<f64> {
        let allowed = || format!("one of {}", self.0.names().join(", "));
        Ok(self.0.get(name).ok_or_else(|| ParameterError::new("name", name, allowed()))?)
    }
}
