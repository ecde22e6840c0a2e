//! Where arrays cross between Rust and NumPy.

use bytemuck::Pod;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyBytes;

use crate::impact::ImpactOutcome;
use crate::simulate::event::{ContactRecord, EventRecord, GrazeRecord, ImpactRecord};

/// Rows of a structured array.
pub(super) trait Record: Pod {
    /// Their NumPy dtype, made once.
    fn dtype(py: Python<'_>) -> PyResult<&Bound<'_, PyAny>>;
}

macro_rules! record {
    ($($row:ty),+) => {$(
        impl Record for $row {
            fn dtype(py: Python<'_>) -> PyResult<&Bound<'_, PyAny>> {
                static DTYPE: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
                let dtype = DTYPE.get_or_try_init(py, || {
                    let columns = <$row>::COLUMNS.to_vec();
                    PyResult::Ok(py.import("numpy")?.getattr("dtype")?.call1((columns,))?.unbind())
                })?;
                Ok(dtype.bind(py))
            }
        }
    )+};
}

record!(ImpactRecord, GrazeRecord, ContactRecord, EventRecord, ImpactOutcome);

/// Records as a structured array.
pub(super) fn records<'py, T: Record>(py: Python<'py>, rows: &[T]) -> PyResult<Bound<'py, PyAny>> {
    let bytes = PyArray1::<u8>::from_slice(py, bytemuck::cast_slice(rows));
    bytes.call_method1("view", (T::dtype(py)?,))
}

/// Records from a structured array of the right dtype.
pub(super) fn from_records<T: Record>(array: &Bound<'_, PyAny>) -> PyResult<Vec<T>> {
    let dtype = T::dtype(array.py())?;
    if !array.getattr("dtype")?.eq(dtype)? {
        let message = format!("an array of the dtype {dtype} is needed");
        return Err(pyo3::exceptions::PyValueError::new_err(message));
    }
    let bytes = array.call_method0("tobytes")?;
    Ok(bytemuck::pod_collect_to_vec(bytes.cast::<PyBytes>()?.as_bytes()))
}

/// States as an array (n, 4).
pub(super) fn states<'py>(
    py: Python<'py>,
    rows: &[[f64; 4]],
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, rows.as_flattened()).reshape([rows.len(), 4])
}

/// States from an array (n, 4).
pub(super) fn to_states(array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<[f64; 4]>> {
    let view = array.as_array();
    if view.ncols() != 4 {
        let message = format!("an array (n, 4) is needed, not {:?}", view.shape());
        return Err(pyo3::exceptions::PyValueError::new_err(message));
    }
    Ok(view.rows().into_iter().map(|r| [r[0], r[1], r[2], r[3]]).collect())
}

/// Numbers from a one-dimensional array of any stride.
pub(super) fn to_vec(array: &PyReadonlyArray1<'_, f64>) -> Vec<f64> {
    array.as_array().iter().copied().collect()
}
