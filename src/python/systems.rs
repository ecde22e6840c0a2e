//! `_core.Systems`: systems that differ in some parameters, for work on all of them at once.

use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use super::system::PySystem;
use crate::model::error::ParameterError;
use crate::model::parameters::System;

/// Validated systems.
#[pyclass(name = "Systems", module = "vibroimpact._core", frozen)]
pub(super) struct PySystems(Vec<System>);

impl PySystems {
    pub(super) fn count(&self) -> usize {
        self.0.len()
    }

    /// The system of a number.
    pub(super) fn get(&self, number: usize) -> Result<&System, ParameterError> {
        let known = || ParameterError::new("number", number, "that of a system");
        self.0.get(number).ok_or_else(known)
    }
}

/// A system with these values of its parameters `names`.
pub(super) fn with_values(
    system: &System,
    names: &[String],
    values: &[f64],
) -> Result<System, ParameterError> {
    system.with_all(names.iter().map(String::as_str).zip(values.iter().copied()))
}

#[pymethods]
impl PySystems {
    /// System i has the values in row i of its parameters `names`.
    #[new]
    fn new(
        system: &PySystem,
        names: Vec<String>,
        values: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Self> {
        let values = values.as_array();
        if values.ncols() != names.len() {
            let given = format!("{:?}", values.shape());
            return Err(ParameterError::new("values", given, "a column for each name").into());
        }
        let rows = values.rows().into_iter();
        let systems = rows.map(|row| with_values(&system.0, &names, &row.to_vec()));
        Ok(Self(systems.collect::<Result<_, _>>()?))
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    /// The values of a numeric parameter.
    fn column<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let values: Option<Vec<f64>> = self.0.iter().map(|system| system.get(name)).collect();
        match (values, self.0.first()) {
            (None, Some(system)) => Err(system.unknown(name).into()),
            (values, _) => Ok(PyArray1::from_vec(py, values.unwrap_or_default())),
        }
    }

    /// Which have a body 2 on which impacts do not act.
    #[getter]
    fn is_wall<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_vec(py, self.0.iter().map(System::is_wall).collect())
    }
}
