//! Where errors cross from Rust to Python.

use pyo3::PyErr;
use pyo3::import_exception;

use super::run::PyRun;
use crate::model::error::{ParameterError as BadParameter, StateError as BadState};
use crate::simulate::run::RunError;

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

impl From<RunError> for PyErr {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Parameter(error) => error.into(),
            RunError::State(error) => error.into(),
            RunError::Simulation { error, done } => {
                SimulationError::new_err((error.to_string(), PyRun(*done)))
            }
        }
    }
}
