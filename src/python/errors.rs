//! Where errors cross from Rust to Python.

use std::collections::BTreeMap;

use pyo3::import_exception;
use pyo3::prelude::*;

use crate::model::error::{ParameterError as BadParameter, StateError as BadState};
use crate::numerics::cancel::CancelToken;
use crate::simulate::run::{Run, RunError, Together};

import_exception!(vibroimpact.errors, ParameterError);
import_exception!(vibroimpact.errors, StateError);
import_exception!(vibroimpact.errors, SimulationError);

impl From<BadParameter> for PyErr {
    fn from(error: BadParameter) -> Self {
        ParameterError::new_err(error.to_string())
    }
}

impl From<BadState> for PyErr {
    fn from(error: BadState) -> Self {
        StateError::new_err(error.to_string())
    }
}

/// A computation that failed.
pub(super) fn failed(message: String) -> PyErr {
    SimulationError::new_err((message,))
}

/// A model whose runs cross to Python.
pub(super) trait Crossing: Together {
    /// A run as an object of Python.
    fn wrapped(py: Python<'_>, run: Run<Self>) -> PyResult<Py<PyAny>>;
    /// Impacts of a run as a table of Python.
    fn impacts<'py>(
        py: Python<'py>,
        run: &Run<Self>,
        rows: &[Self::ImpactRow],
    ) -> PyResult<Bound<'py, PyAny>>;
    /// Energies and works in the kept window, by name; `None` once `cancel` has ended it.
    fn works(run: &Run<Self>, cancel: &CancelToken) -> Option<Works>;
}

/// The numbers of an energy audit, by name.
pub(super) type Works = BTreeMap<&'static str, f64>;

impl<M: Crossing> From<RunError<M>> for PyErr {
    fn from(error: RunError<M>) -> Self {
        match error {
            RunError::Parameter(error) => error.into(),
            RunError::State(error) => error.into(),
            RunError::Simulation { error, done } => {
                let wrapped = Python::attach(|py| M::wrapped(py, *done));
                wrapped.map_or_else(
                    |error| error,
                    |run| SimulationError::new_err((error.to_string(), run)),
                )
            }
        }
    }
}
