//! `_core.Arrivals` and `arrivals`.

use std::sync::atomic::AtomicUsize;

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::cancel::{Progress, interruptible};
use super::period::orbit_numbers;
use super::simulate::Machine;
use crate::analysis::Workers;
use crate::analysis::basin::{Arrival, ArrivalStatus, Followed, Target};
use crate::analysis::period::{CHATTERING, PeriodReport};
use crate::analysis::sweep::{PointStatus, arrive_many};
use crate::model::error::{ParameterError, StateError};
use crate::model::parameters::System;
use crate::model::state::State;
use crate::model::structure::{Structure, StructureState};
use crate::simulate::run::RunOptions;
use crate::simulate::tolerances::{DEFAULT_MAX_EVENTS, DEFAULT_TOLERANCE};

/// An arrival, with its states as numbers one after another.
struct Row {
    status: ArrivalStatus,
    state: Option<Vec<f64>>,
    tail: Vec<f64>,
    counts: Vec<u32>,
    period: Option<PeriodReport>,
}

impl Row {
    fn new<P>(arrival: Arrival<P>, numbers: impl Fn(&P) -> Vec<f64>) -> Self {
        let Arrival { status, state, tail, counts, period } = arrival;
        let tail = tail.iter().flat_map(&numbers).collect();
        Self { status, state: state.as_ref().map(numbers), tail, counts, period }
    }
}

/// The attractor of each of n starts, whose states have d numbers.
#[pyclass(name = "Arrivals", module = "vibroimpact._core", frozen)]
pub(super) struct PyArrivals {
    arrivals: Vec<Row>,
    width: usize,
    interrupted: bool,
}

impl PyArrivals {
    fn column<'py, T: numpy::Element>(
        &self,
        py: Python<'py>,
        of: impl Fn(&Row) -> T,
    ) -> Bound<'py, PyArray1<T>> {
        PyArray1::from_vec(py, self.arrivals.iter().map(of).collect())
    }

    fn left(&self) -> impl Iterator<Item = (usize, &Row)> {
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
    /// (n, d) state at the arrival or the end; NaN where there is none.
    #[getter]
    fn states<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mut rows = Vec::with_capacity(self.arrivals.len() * self.width);
        for arrival in &self.arrivals {
            match &arrival.state {
                Some(state) => rows.extend_from_slice(state),
                None => rows.extend(std::iter::repeat_n(f64::NAN, self.width)),
            }
        }
        PyArray1::from_vec(py, rows).reshape([self.arrivals.len(), self.width])
    }
    /// (n,) period in drive periods of those left over, 0 where none was found.
    #[getter]
    fn m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.column(py, |arrival| orbit_numbers(arrival.period)[0])
    }
    /// (n,) their impacts per orbit, -1 with complete chatter.
    #[getter]
    fn n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.column(py, |arrival| orbit_numbers(arrival.period)[1])
    }
    /// (l,) the starts left over at the end of a completed run.
    #[getter(left)]
    fn left_over<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.left().map(|(i, _)| i as i64))
    }
    /// (l, keep, d) their last sections.
    #[getter]
    fn tails<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let rows: Vec<f64> =
            self.left().flat_map(|(_, arrival)| arrival.tail.iter().copied()).collect();
        let count = self.left().count();
        let keep = rows.len() / (self.width * count).max(1);
        PyArray1::from_vec(py, rows).reshape([count, keep, self.width])
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

/// Numbers one after another, and states.
trait Numbered: Followed {
    fn state(numbers: &[f64]) -> Result<Self::State, StateError>;
    fn section_of(numbers: &[f64]) -> Self::Section;
    fn numbers(section: &Self::Section) -> Vec<f64>;
}

impl Numbered for System {
    fn state(numbers: &[f64]) -> Result<State, StateError> {
        State::new(numbers[0], numbers[1], numbers[2], numbers[3])
    }
    fn section_of(numbers: &[f64]) -> [f64; 4] {
        std::array::from_fn(|i| numbers[i])
    }
    fn numbers(section: &[f64; 4]) -> Vec<f64> {
        section.to_vec()
    }
}

impl Numbered for Structure {
    fn state(numbers: &[f64]) -> Result<StructureState, StateError> {
        Ok(Self::section_of(numbers))
    }
    fn section_of(numbers: &[f64]) -> StructureState {
        StructureState::of_numbers(numbers)
    }
    fn numbers(section: &StructureState) -> Vec<f64> {
        section.numbers().collect()
    }
}

/// What is to be followed, as it comes from Python.
struct Asked<'a, 'py> {
    initials: PyReadonlyArray2<'py, f64>,
    centers: PyReadonlyArray2<'py, f64>,
    factors: PyReadonlyArray3<'py, f64>,
    counts: Vec<Vec<i64>>,
    options: RunOptions,
    workers: Workers,
    progress: Option<&'a Py<PyAny>>,
}

impl Asked<'_, '_> {
    fn targets<M: Numbered>(&self, width: usize) -> PyResult<Vec<Target<M::Section>>> {
        let (centers, factors) = (self.centers.as_array(), self.factors.as_array());
        let count = centers.nrows();
        let fit = centers.ncols() == width && factors.shape() == [count, width, width];
        if !fit || self.counts.len() != count {
            let message = "centers (k, d), factors (k, d, d) and k lists of counts are needed";
            return Err(PyValueError::new_err(message));
        }
        let impacts =
            |&c: &i64| if c < 0 { CHATTERING } else { u32::try_from(c).unwrap_or(CHATTERING) };
        let regions = centers.rows().into_iter().zip(factors.outer_iter());
        let mut targets = Vec::with_capacity(count);
        for ((center, factor), counts) in regions.zip(&self.counts) {
            targets.push(Target {
                center: M::section_of(&center.to_vec()),
                factor: factor.rows().into_iter().map(|w| M::section_of(&w.to_vec())).collect(),
                counts: counts.iter().map(impacts).collect(),
            });
        }
        Ok(targets)
    }

    fn follow<M: Numbered>(
        &self,
        py: Python<'_>,
        machine: &M,
        width: usize,
    ) -> PyResult<PyArrivals> {
        let initials = self.initials.as_array();
        if initials.ncols() != width {
            let message = format!("an array (n, {width}) is needed, not {:?}", initials.shape());
            return Err(PyValueError::new_err(message));
        }
        let targets = self.targets::<M>(width)?;
        let starts = initials.rows().into_iter().map(|row| M::state(&row.to_vec()));
        let starts = starts.collect::<Result<Vec<_>, _>>()?;
        let done = AtomicUsize::new(0);
        let progress = self.progress.map(|tell| Progress { tell, done: &done });
        let (options, workers) = (self.options, &self.workers);
        let (arrivals, interrupted) = interruptible(py, progress.as_ref(), |cancel| {
            let found = arrive_many(machine, &starts, &targets, options, workers, cancel, &done)?;
            let rows = found.into_iter().map(|arrival| Row::new(arrival, M::numbers));
            Ok::<_, ParameterError>(rows.collect())
        })?;
        Ok(PyArrivals { arrivals, width, interrupted })
    }
}

/// Follow every start (n, d) until it arrives at one of the attractors.
#[pyfunction]
#[pyo3(signature = (
    machine, initials, *, centers, factors, counts, periods, keep,
    max_events = DEFAULT_MAX_EVENTS, chatter_tolerance = DEFAULT_TOLERANCE, workers = None,
    progress = None,
))]
#[allow(clippy::too_many_arguments)]
pub(super) fn arrivals(
    py: Python<'_>,
    machine: Machine<'_>,
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
    let progress = progress.as_ref();
    let asked = Asked { initials, centers, factors, counts, options, workers, progress };
    match machine {
        Machine::System(system) => asked.follow(py, &system.0, 4),
        Machine::Structure(structure) => {
            asked.follow(py, &structure.0, 2 * structure.0.coordinates())
        }
    }
}
