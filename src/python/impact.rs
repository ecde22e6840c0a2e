//! `_core.impact`: single impacts, many at a time.

use numpy::PyReadonlyArray1;
use pyo3::PyErr;
use pyo3::prelude::*;

use super::arrays;
use super::cancel::{interrupted, interruptible};
use super::system::PySystem;
use crate::impact::{ImpactOutcome, OutcomeError};

impl From<OutcomeError> for PyErr {
    fn from(error: OutcomeError) -> Self {
        match error {
            OutcomeError::Parameter(error) => error.into(),
            OutcomeError::State(error) => error.into(),
        }
    }
}

/// The impacts from states just before them, arrays of one length; in closed form, or in `steps`
/// steps of the impulse.
#[pyfunction]
#[pyo3(signature = (system, x1, v1, v2, *, steps = None))]
pub(super) fn impact<'py>(
    py: Python<'py>,
    system: &PySystem,
    x1: PyReadonlyArray1<'_, f64>,
    v1: PyReadonlyArray1<'_, f64>,
    v2: PyReadonlyArray1<'_, f64>,
    steps: Option<u32>,
) -> PyResult<Bound<'py, PyAny>> {
    let (x1, v1, v2) = (arrays::to_vec(&x1), arrays::to_vec(&v1), arrays::to_vec(&v2));
    if v1.len() != x1.len() || v2.len() != x1.len() {
        let message = format!("lengths {}, {}, {} differ", x1.len(), v1.len(), v2.len());
        return Err(pyo3::exceptions::PyValueError::new_err(message));
    }
    let system = &system.0;
    let one = |index: usize| -> Result<ImpactOutcome, OutcomeError> {
        let (x1, v1, v2) = (x1[index], v1[index], v2[index]);
        match steps {
            None => Ok(ImpactOutcome::new(system, x1, v1, v2)?),
            Some(steps) => ImpactOutcome::incremental(system, x1, v1, v2, steps),
        }
    };
    let (rows, ended) = interruptible(py, None, |cancel| {
        (0..x1.len()).take_while(|_| !cancel.is_cancelled()).map(one).collect::<Result<Vec<_>, _>>()
    })?;
    if ended {
        let message = format!("interrupted after {} of {} impacts", rows.len(), x1.len());
        return Err(interrupted(message));
    }
    arrays::records(py, &rows)
}
