//! `_core.sin_cos` and `_core.decay_minus_1`: the core's elementary functions of arrays, for
//! enclosures, whose proof uses their known error (tests/python/test_elementary.py).

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::numerics::elementary;

/// Sine and cosine of each number, for |x| <= 1e5; with larger ones the library's.
#[pyfunction]
#[allow(clippy::type_complexity)]
pub(super) fn sin_cos<'py>(
    py: Python<'py>,
    x: PyReadonlyArray1<'py, f64>,
) -> (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>) {
    let (sin, cos) = x.as_array().iter().map(|&x| elementary::sin_cos(x)).unzip();
    (PyArray1::from_vec(py, sin), PyArray1::from_vec(py, cos))
}

/// e^x - 1 of each number, x <= 0.
#[pyfunction]
pub(super) fn decay_minus_1<'py>(
    py: Python<'py>,
    x: PyReadonlyArray1<'py, f64>,
) -> Bound<'py, PyArray1<f64>> {
    let values = x.as_array().iter().map(|&x| elementary::decay_minus_1(x)).collect();
    PyArray1::from_vec(py, values)
}
