//! `_core.StructureSweep` and `structure_sweep`.

use std::sync::atomic::AtomicUsize;

use numpy::{
    PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyReadonlyArray3,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::cancel::{Progress, interruptible};
use super::period::{motion_number, orbit_numbers, residual};
use super::structure::PyStructure;
use super::structure_parts::starts;
use super::structure_run::{impacts, states};
use super::sweep::measure_from;
use crate::analysis::Workers;
use crate::analysis::structure_sweep::{
    StructureCells, StructurePoint, structure_sweep as sweep_of_structures,
};
use crate::analysis::sweep::{SweepOptions, SweepStart};
use crate::model::error::ParameterError;
use crate::model::structure::{Structure, StructureState};
use crate::simulate::Horizon;
use crate::simulate::run::RunOptions;
use crate::simulate::tolerances::{DEFAULT_MAX_EVENTS, DEFAULT_TOLERANCE};

/// Result of a sweep of structures of N coordinates: a column for each quantity; the rows of impacts
/// and sections are ragged, their numbers per cell in the columns of counts.
#[pyclass(name = "StructureSweep", module = "vibroimpact._core", frozen)]
pub(super) struct PyStructureSweep {
    points: Vec<StructurePoint>,
    width: usize,
    interrupted: bool,
}

impl PyStructureSweep {
    fn column<'py, T: numpy::Element>(
        &self,
        py: Python<'py>,
        value: impl Fn(&StructurePoint) -> T,
    ) -> Bound<'py, PyArray1<T>> {
        PyArray1::from_vec(py, self.points.iter().map(value).collect())
    }

    /// (n, most) numbers of each, NaN where there are fewer.
    fn wide<'py>(&self, py: Python<'py>, place: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let most = self.points.iter().map(|p| p.exponents.len()).max().unwrap_or(0);
        let number =
            |p: &StructurePoint, i: usize| p.exponents.get(i).map_or(f64::NAN, |x| x[place]);
        let rows = self.points.iter().flat_map(|p| (0..most).map(move |i| number(p, i)));
        PyArray1::from_vec(py, rows.collect()).reshape([self.points.len(), most])
    }
}

#[pymethods]
impl PyStructureSweep {
    /// Whether Ctrl-C ended the sweep.
    #[getter]
    fn interrupted(&self) -> bool {
        self.interrupted
    }
    /// (n,) place of each status in `STATUS_NAMES`.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i8>> {
        self.column(py, |p| p.status.code())
    }
    /// (n,) kept impacts of each cell.
    #[getter]
    fn impact_count<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.column(py, |p| p.impacts.len() as i64)
    }
    /// Columns of all kept impacts, as `_core.StructureRun.impacts`.
    #[getter]
    fn impacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let rows: Vec<_> = self.points.iter().flat_map(|p| p.impacts.iter().cloned()).collect();
        impacts(py, self.width, &rows)
    }
    /// (n,) kept stroboscopic states of each cell.
    #[getter]
    fn stroboscopic_count<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.column(py, |p| p.stroboscopic.len() as i64)
    }
    /// (rows, 2, N) q and v.
    #[getter]
    fn stroboscopic<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        states(py, self.width, self.points.iter().flat_map(|p| &p.stroboscopic))
    }
    /// (n,) period in drive periods, 0 where none was found.
    #[getter]
    fn m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.column(py, |p| orbit_numbers(p.period)[0])
    }
    /// (n,) impacts per orbit, -1 with complete chatter.
    #[getter]
    fn n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.column(py, |p| orbit_numbers(p.period)[1])
    }
    /// (n,) place of each kind of motion in `MOTION_NAMES`.
    #[getter]
    fn motion<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i8>> {
        self.column(py, |p| motion_number(p.period))
    }
    /// (n,) largest difference of sections m periods apart.
    #[getter]
    fn residual<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |p| residual(p.period))
    }
    /// (n, most) Lyapunov exponents, descending; NaN where a cell has none.
    #[getter]
    fn exponents<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.wide(py, 0)
    }
    /// (n, most) their standard errors.
    #[getter]
    fn exponent_errors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.wide(py, 1)
    }
    /// (n,) part of the kept window in contact.
    #[getter]
    fn contact_fraction<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |p| p.contact_fraction)
    }
    /// (n, 2, N) state at the end.
    #[getter]
    fn final_states<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let none = vec![f64::NAN; self.width];
        let none = StructureState::new(&none, &none);
        states(py, self.width, self.points.iter().map(|p| p.final_state.as_ref().unwrap_or(&none)))
    }
}

/// Cells as they come from Python: each has one of some structures with some of its numbers changed.
struct Cells<'a> {
    structures: Vec<&'a Structure>,
    which: Vec<usize>,
    names: Vec<String>,
    /// Row by row.
    values: Vec<f64>,
    initials: Vec<StructureState>,
}

impl StructureCells for Cells<'_> {
    fn count(&self) -> usize {
        self.which.len()
    }

    fn structure(&self, place: usize) -> Result<Structure, ParameterError> {
        let structure = self.structures[self.which[place]].clone();
        let row = &self.values[place * self.names.len()..];
        let pairs = self.names.iter().zip(row);
        pairs.into_iter().try_fold(structure, |made, (name, &value)| made.with(name, value))
    }

    fn initial(&self, place: usize) -> StructureState {
        self.initials[place].clone()
    }
}

/// One run per cell: cell i has the structure of the number `which[i]`, with the values in row i of
/// its numbers `names`, and starts from `initials[i]`, (2, N).
#[pyfunction]
#[pyo3(signature = (
    structures, which, names, values, initials, *, periods, keep, start = "fresh",
    measure = "returns", measured = 0, rows = true, max_events = DEFAULT_MAX_EVENTS,
    chatter_tolerance = DEFAULT_TOLERANCE, section_phase = 0.0, workers = None, progress = None,
))]
#[allow(clippy::too_many_arguments)]
pub(super) fn structure_sweep(
    py: Python<'_>,
    structures: Vec<PyRef<'_, PyStructure>>,
    which: PyReadonlyArray1<'_, i64>,
    names: Vec<String>,
    values: PyReadonlyArray2<'_, f64>,
    initials: PyReadonlyArray3<'_, f64>,
    periods: i64,
    keep: i64,
    start: &str,
    measure: &str,
    measured: u32,
    rows: bool,
    max_events: u64,
    chatter_tolerance: f64,
    section_phase: f64,
    workers: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<PyStructureSweep> {
    let horizon = Horizon::Periods(periods);
    let run =
        RunOptions { horizon, keep: Some(keep), max_events, chatter_tolerance, section_phase };
    let options = SweepOptions { run, measure: measure_from(measure, measured)?, rows };
    let (start, workers) = (SweepStart::from_name(start)?, Workers::new(workers)?);
    let structures: Vec<_> = structures.iter().map(|structure| &structure.0).collect();
    let width = initials.as_array().shape()[2];
    let initials = starts(&initials);
    let which: Vec<_> = which.as_array().iter().map(|&k| usize::try_from(k).ok()).collect();
    let which = which
        .into_iter()
        .map(|k| k.filter(|&k| structures.get(k).is_some_and(|s| s.coordinates() == width)))
        .collect::<Option<Vec<_>>>()
        .ok_or_else(|| ParameterError::new("which", "another", "that of a structure that fits"))?;
    if values.as_array().shape() != [which.len(), names.len()] || initials.len() != which.len() {
        let given = format!("{:?}", values.as_array().shape());
        let allowed = "a row for each cell and a column for each name";
        return Err(ParameterError::new("values", given, allowed).into());
    }
    let values = values.as_array().iter().copied().collect();
    let cells = Cells { structures, which, names, values, initials };
    let done = AtomicUsize::new(0);
    let progress = progress.as_ref().map(|tell| Progress { tell, done: &done });
    let (points, interrupted) = interruptible(py, progress.as_ref(), |cancel| {
        sweep_of_structures(&cells, options, start, &workers, cancel, &done)
    })?;
    Ok(PyStructureSweep { points, width, interrupted })
}
