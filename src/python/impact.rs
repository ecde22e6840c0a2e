//! `_core.impact`: single impacts, many at a time.

use numpy::PyReadonlyArray1;
use pyo3::PyErr;
use pyo3::prelude::*;

use super::arrays;
use super::system::PySystem;
use crate::impact::{ImpactOutcome, OutcomeError};

/// Steps of the impulse between two looks for Ctrl-C: some tens of milliseconds.
const BETWEEN_SIGNALS: usize = 1 << 22;

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
    let system = system.0;
    let one = |index: usize| -> Result<ImpactOutcome, OutcomeError> {
        let (x1, v1, v2) = (x1[index], v1[index], v2[index]);
        match steps {
            None => Ok(ImpactOutcome::new(&system, x1, v1, v2)?),
            Some(steps) => ImpactOutcome::incremental(&system, x1, v1, v2, steps),
        }
    };
    let at_once = (BETWEEN_SIGNALS / steps.map_or(64, |steps| steps.max(1) as usize)).max(1);
    let mut rows = Vec::with_capacity(x1.len());
    while rows.len() < x1.len() {
        let stop = x1.len().min(rows.len() + at_once);
        py.detach(|| {
            for index in rows.len()..stop {
                rows.push(one(index)?);
            }
            Ok::<(), OutcomeError>(())
        })?;
        py.check_signals()?;
    }
    arrays::records(py, &rows)
}
