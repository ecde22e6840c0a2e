//! `_core.Arrivals` and `arrivals`.

use std::sync::atomic::AtomicUsize;

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays;
use super::cancel::{Progress, interruptible};
use super::system::PySystem;
use crate::analysis::Workers;
use crate::analysis::basin::{Arrival, ArrivalStatus, Target};
use crate::analysis::period::{CHATTERING, ImpactCount};
use crate::analysis::sweep::{PointStatus, arrive_many};
use crate::model::error::StateError;
use crate::model::state::State;
use crate::simulate::run::RunOptions;
use crate::simulate::tolerances::{DEFAULT_MAX_EVENTS, DEFAULT_TOLERANCE};

/// The attractor of each of n starts.
#[pyclass(name = "Arrivals", module = "vibroimpact._core", frozen)]
pub(super) struct PyArrivals {
    arrivals: Vec<Arrival>,
    interrupted: bool,
}

impl PyArrivals {
    fn column<'py, T: numpy::Element>(
        &self,
        py: Python<'py>,
        of: impl Fn(&Arrival) -> T,
    ) -> Bound<'py, PyArray1<T>> {
        PyArray1::from_vec(py, self.arrivals.iter().map(of).collect())
    }

    fn left(&self) -> impl Iterator<Item = (usize, &Arrival)> {
        self.arrivals.iter().enumerate().filter(|(_, arrival)| arrival.period.is_some())
    }
}

#[pymethods]
impl PyArrivals {
    /// Whether Ctrl-C ended the work.
    #[getter]
    fn interrupted(&self) -> bool {
        self.interrupted
    }
    /// (n,) place of each status in `STATUS_NAMES`.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i8>> {
        self.column(py, |arrival| PointStatus::from(arrival.status).code())
    }
    /// (n,) number of the attractor, -1 for none of them.
    #[getter]
    fn attractor<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.column(py, |arrival| match arrival.status {
            ArrivalStatus::Arrived { target, .. } => target as i64,
            _ => -1,
        })
    }
    /// (n,) drive periods until its region was entered, -1 for none.
    #[getter]
    fn periods<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.column(py, |arrival| match arrival.status {
            ArrivalStatus::Arrived { periods, .. } => periods,
            _ => -1,
        })
    }
    /// (n, 4) state at the arrival or the end; NaN where there is none.
    #[getter]
    fn states<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows: Vec<_> =
            self.arrivals.iter().map(|arrival| arrival.state.unwrap_or([f64::NAN; 4])).collect();
        arrays::states(py, &rows)
    }
    /// (n,) period in drive periods of those left over, 0 where none was found.
    #[getter]
    fn m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.column(py, |arrival| {
            arrival.period.and_then(|report| report.orbit).map_or(0, |(m, _)| m as i64)
        })
    }
    /// (n,) their impacts per orbit, -1 with complete chatter.
    #[getter]
    fn n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.column(py, |arrival| match arrival.period.and_then(|report| report.orbit) {
            Some((_, ImpactCount::Finite(n))) => n as i64,
            Some((_, ImpactCount::Infinite)) => -1,
            None => 0,
        })
    }
    /// (l,) the starts left over at the end of a completed run.
    #[getter(left)]
    fn left_over<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.left().map(|(i, _)| i as i64))
    }
    /// (l, keep, 4) their last sections.
    #[getter]
    fn tails<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let rows: Vec<f64> =
            self.left().flat_map(|(_, arrival)| arrival.tail.as_flattened()).copied().collect();
        let count = self.left().count();
        let keep = rows.len() / (4 * count).max(1);
        PyArray1::from_vec(py, rows).reshape([count, keep, 4])
    }
    /// (l, keep) their impacts in the drive period before each section, -1 with complete chatter.
    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i64>>> {
        let count = |&c: &u32| if c == CHATTERING { -1 } else { i64::from(c) };
        let rows: Vec<i64> =
            self.left().flat_map(|(_, arrival)| arrival.counts.iter().map(count)).collect();
        let left = self.left().count();
        let keep = rows.len() / left.max(1);
        PyArray1::from_vec(py, rows).reshape([left, keep])
    }
}

fn targets(
    centers: &PyReadonlyArray2<'_, f64>,
    factors: &PyReadonlyArray3<'_, f64>,
    counts: Vec<Vec<i64>>,
) -> PyResult<Vec<Target>> {
    let centers = arrays::to_states(centers)?;
    let factors = factors.as_array();
    if factors.shape() != [centers.len(), 4, 4] || counts.len() != centers.len() {
        let message = "centers (k, 4), factors (k, 4, 4) and k lists of counts are needed";
        return Err(PyValueError::new_err(message));
    }
    let count = |c: i64| if c < 0 { CHATTERING } else { u32::try_from(c).unwrap_or(CHATTERING) };
    let target = |(i, (center, counts)): (usize, ([f64; 4], Vec<i64>))| Target {
        center,
        factor: std::array::from_fn(|row| std::array::from_fn(|column| factors[[i, row, column]])),
        counts: counts.into_iter().map(count).collect(),
    };
    Ok(centers.into_iter().zip(counts).enumerate().map(target).collect())
}

/// Follow every start until it arrives at one of the attractors.
#[pyfunction]
#[pyo3(signature = (
    system, initials, *, centers, factors, counts, periods, keep,
    max_events = DEFAULT_MAX_EVENTS, chatter_tolerance = DEFAULT_TOLERANCE, workers = None,
    progress = None,
))]
#[allow(clippy::too_many_arguments)]
pub(super) fn arrivals(
    py: Python<'_>,
    system: &PySystem,
    initials: PyReadonlyArray2<'_, f64>,
    centers: PyReadonlyArray2<'_, f64>,
    factors: PyReadonlyArray3<'_, f64>,
    counts: Vec<Vec<i64>>,
    periods: i64,
    keep: i64,
    max_events: u64,
    chatter_tolerance: f64,
    workers: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<PyArrivals> {
    let options =
        RunOptions { max_events, chatter_tolerance, ..RunOptions::periods(periods).keep(keep) };
    let workers = Workers::new(workers)?;
    let targets = targets(&centers, &factors, counts)?;
    let starts: Result<Vec<State>, StateError> = arrays::to_states(&initials)?
        .into_iter()
        .map(|[x1, v1, x2, v2]| State::new(x1, v1, x2, v2))
        .collect();
    let (starts, system) = (starts?, system.0);
    let done = AtomicUsize::new(0);
    let progress = progress.as_ref().map(|tell| Progress { tell, done: &done });
    let (arrivals, interrupted) = interruptible(py, progress.as_ref(), |cancel| {
        arrive_many(&system, &starts, &targets, options, &workers, cancel, &done)
    })?;
    Ok(PyArrivals { arrivals, interrupted })
}
