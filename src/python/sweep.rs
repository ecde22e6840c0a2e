//! `_core.Sweep` and `sweep`.

use std::sync::atomic::AtomicUsize;

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;

use super::arrays;
use super::cancel::{Progress, interruptible};
use super::period::{motion_number, orbit_numbers, residual};
use super::system::PySystem;
use super::systems::with_values;
use crate::analysis::Workers;
use crate::analysis::sweep::{Cell, Measure, SweepOptions, SweepPoint, SweepRows, SweepStart};
use crate::model::error::ParameterError;
use crate::model::state::State;
use crate::simulate::Horizon;
use crate::simulate::run::RunOptions;
use crate::simulate::tolerances::{DEFAULT_MAX_EVENTS, DEFAULT_TOLERANCE};

/// Result of sweep: a column for each quantity; the rows of both sections are ragged, their numbers
/// per cell in the columns of counts.
#[pyclass(name = "Sweep", module = "vibroimpact._core", frozen)]
pub(super) struct PySweep {
    /// Without their rows.
    points: Vec<SweepPoint>,
    impact_count: Py<PyArray1<i64>>,
    stroboscopic_count: Py<PyArray1<i64>>,
    impact_section: Py<PyArray2<f64>>,
    regime: Py<PyArray1<i8>>,
    stroboscopic: Py<PyArray2<f64>>,
    interrupted: bool,
}

impl PySweep {
    fn new(
        py: Python<'_>,
        mut points: Vec<SweepPoint>,
        rows: SweepRows,
        interrupted: bool,
    ) -> PyResult<Self> {
        for point in &mut points {
            (point.impact_section, point.regime, point.stroboscopic) = Default::default();
        }
        let counts = |counts: &[usize]| {
            PyArray1::from_vec(py, counts.iter().map(|&n| n as i64).collect()).unbind()
        };
        let (count, states) = (rows.regime.len(), rows.stroboscopic.len());
        let impact_section = PyArray1::from_vec(py, rows.impact_section).reshape([6, count])?;
        let stroboscopic = PyArray1::from_vec(py, rows.stroboscopic.into_flattened());
        Ok(Self {
            points,
            impact_count: counts(&rows.impact_count),
            stroboscopic_count: counts(&rows.stroboscopic_count),
            impact_section: impact_section.unbind(),
            regime: PyArray1::from_vec(py, rows.regime).unbind(),
            stroboscopic: stroboscopic.reshape([states, 4])?.unbind(),
            interrupted,
        })
    }

    fn column<'py, T: numpy::Element>(
        &self,
        py: Python<'py>,
        value: impl Fn(&SweepPoint) -> T,
    ) -> Bound<'py, PyArray1<T>> {
        PyArray1::from_vec(py, self.points.iter().map(value).collect())
    }
}

#[pymethods]
impl PySweep {
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
    fn impact_count(&self, py: Python<'_>) -> Py<PyArray1<i64>> {
        self.impact_count.clone_ref(py)
    }
    /// (6, rows) x1, v1, v2, phase just before each impact, approach velocity, energy loss.
    #[getter]
    fn impact_section(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
        self.impact_section.clone_ref(py)
    }
    /// (rows,) its regime number.
    #[getter]
    fn regime(&self, py: Python<'_>) -> Py<PyArray1<i8>> {
        self.regime.clone_ref(py)
    }
    /// (n,) kept stroboscopic states of each cell.
    #[getter]
    fn stroboscopic_count(&self, py: Python<'_>) -> Py<PyArray1<i64>> {
        self.stroboscopic_count.clone_ref(py)
    }
    /// (rows, 4) x1, v1, x2, v2.
    #[getter]
    fn stroboscopic(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
        self.stroboscopic.clone_ref(py)
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
    /// (n, 4) Lyapunov exponents, descending; NaN where not wanted.
    #[getter]
    fn exponents<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows: Vec<[f64; 4]> =
            self.points.iter().map(|p| p.exponents.map(|[value, _]| value)).collect();
        arrays::states(py, &rows)
    }
    /// (n, 4) their standard errors.
    #[getter]
    fn exponent_errors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows: Vec<[f64; 4]> =
            self.points.iter().map(|p| p.exponents.map(|[_, error]| error)).collect();
        arrays::states(py, &rows)
    }
    /// (n,) part of the kept window in contact.
    #[getter]
    fn contact_fraction<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |p| p.contact_fraction)
    }
    /// (n, 4) state at the end.
    #[getter]
    fn final_states<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let state = |p: &SweepPoint| p.final_state.map_or([f64::NAN; 4], State::to_array);
        arrays::states(py, &self.points.iter().map(state).collect::<Vec<_>>())
    }
}

pub(super) fn measure_from(name: &str, measured: u32) -> Result<Measure, ParameterError> {
    match name {
        "returns" => Ok(Measure::Returns),
        "label" => Ok(Measure::Label),
        "largest_exponent" => Ok(Measure::LargestExponent),
        "spectrum" => Ok(Measure::Spectrum(measured)),
        _ => {
            let allowed = "one of returns, label, largest_exponent, spectrum";
            Err(ParameterError::new("measure", name, allowed))
        }
    }
}

/// One run per cell: row i of `values` holds its parameters `names`, row i of `initials` its start.
#[pyfunction]
#[pyo3(signature = (
    system, names, values, initials, *, periods, keep, start = "fresh", measure = "returns",
    measured = 0, rows = true, max_events = DEFAULT_MAX_EVENTS, chatter_tolerance = DEFAULT_TOLERANCE,
    section_phase = 0.0, workers = None, progress = None,
))]
#[allow(clippy::too_many_arguments)]
pub(super) fn sweep(
    py: Python<'_>,
    system: &PySystem,
    names: Vec<String>,
    values: PyReadonlyArray2<'_, f64>,
    initials: PyReadonlyArray2<'_, f64>,
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
) -> PyResult<PySweep> {
    let run = RunOptions {
        horizon: Horizon::Periods(periods),
        keep: Some(keep),
        max_events,
        chatter_tolerance,
        section_phase,
    };
    let options = SweepOptions { run, measure: measure_from(measure, measured)?, rows };
    let start = SweepStart::from_name(start)?;
    let workers = Workers::new(workers)?;
    let initials = arrays::to_states(&initials)?;
    let values = values.as_array();
    if values.ncols() != names.len() || values.nrows() != initials.len() {
        let given = format!("{:?}", values.shape());
        let allowed = "a row for each cell and a column for each name";
        return Err(ParameterError::new("values", given, allowed).into());
    }
    let mut cells = Vec::with_capacity(initials.len());
    for (row, &[x1, v1, x2, v2]) in values.rows().into_iter().zip(&initials) {
        let system = with_values(&system.0, &names, &row.to_vec())?;
        cells.push(Cell { system, initial: State::new(x1, v1, x2, v2)? });
    }
    let done = AtomicUsize::new(0);
    let progress = progress.as_ref().map(|tell| Progress { tell, done: &done });
    let ((points, rows), interrupted) = interruptible(py, progress.as_ref(), |cancel| {
        let points =
            crate::analysis::sweep::sweep(&cells, options, start, &workers, cancel, &done)?;
        let rows = SweepRows::of(&points, &workers);
        Ok::<_, ParameterError>((points, rows))
    })?;
    PySweep::new(py, points, rows, interrupted)
}
