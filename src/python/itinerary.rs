//! What the itineraries of all machines hand to Python in one way.

use nalgebra::{Dim, RawStorage};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

use super::cancel::{interrupted, interruptible};
use crate::model::error::ParameterError;
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::StopReason;
use crate::tangent::itinerary::ItineraryError;

pub(super) type Matrix<'py> = Bound<'py, PyArray2<f64>>;

/// A matrix of any kind.
pub(super) fn matrix<'py, R: Dim, C: Dim, S: RawStorage<f64, R, C>>(
    py: Python<'py>,
    matrix: &nalgebra::Matrix<f64, R, C, S>,
) -> PyResult<Matrix<'py>> {
    let (rows, columns) = matrix.shape();
    let by_rows = (0..rows).flat_map(|i| (0..columns).map(move |j| matrix[(i, j)]));
    PyArray1::from_iter(py, by_rows).reshape([rows, columns])
}

/// A residual and its Jacobian, row by row.
pub(super) fn residual(
    py: Python<'_>,
    (values, jacobian, columns): (Vec<f64>, Vec<f64>, usize),
) -> PyResult<(Bound<'_, PyArray1<f64>>, Matrix<'_>)> {
    let jacobian = PyArray1::from_vec(py, jacobian).reshape([values.len(), columns])?;
    Ok((values.into_pyarray(py), jacobian))
}

/// A motion that is followed until Ctrl-C: what it is, or in words why there is none.
pub(super) fn followed<T: Send>(
    py: Python<'_>,
    follow: impl FnOnce(&CancelToken) -> Result<T, ItineraryError> + Send,
) -> PyResult<Result<T, String>> {
    let (found, _) = interruptible::<_, ParameterError>(py, None, |cancel| Ok(follow(cancel)))?;
    match found {
        Ok(found) => Ok(Ok(found)),
        Err(
            refused @ (ItineraryError::Parameter(_)
            | ItineraryError::State(_)
            | ItineraryError::Stopped(StopReason::Interrupted)),
        ) => Err(refusal(refused)),
        Err(other) => Ok(Err(other.to_string())),
    }
}

/// A verdict on a motion that is followed until Ctrl-C.
pub(super) fn judged<T: Send>(
    py: Python<'_>,
    judge: impl FnOnce(&CancelToken) -> Result<T, ItineraryError> + Send,
) -> PyResult<T> {
    interruptible::<_, ParameterError>(py, None, |cancel| Ok(judge(cancel)))?.0.map_err(refusal)
}

/// What Python raises where an itinerary or a verdict is an error, and not an outcome.
fn refusal(error: ItineraryError) -> PyErr {
    match error {
        ItineraryError::Parameter(error) => error.into(),
        ItineraryError::State(error) => error.into(),
        _ => interrupted("interrupted while a motion was followed".to_owned()),
    }
}

/// Why a solution is no motion of its machine, in words; empty if it is one.
pub(super) fn words(rejection: Option<impl ToString>) -> String {
    rejection.map_or_else(String::new, |why| why.to_string())
}

/// Refuses the number of a leg that an itinerary of so many does not have.
pub(super) fn checked_leg(leg: usize, legs: usize) -> Result<(), ParameterError> {
    if leg < legs {
        return Ok(());
    }
    Err(ParameterError::new("leg", leg, "a leg of the itinerary"))
}
