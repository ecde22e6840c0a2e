//! `_core.Sweep` and `sweep`.

use numpy::{PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

use super::arrays;
use super::run::to_state;
use super::system::PySystem;
use crate::period::ImpactCount;
use crate::run::RunOptions;
use crate::simulate::Horizon;
use crate::state::State;
use crate::sweep::{PointStatus, SweepPoint, SweepStart, Workers};
use crate::tolerance::{DEFAULT_MAX_EVENTS, DEFAULT_TOLERANCE};

/// Result of sweep: ragged arrays, point i owning rows offset[i] : offset[i + 1].
#[pyclass(name = "Sweep", module = "vibroimpact._core", frozen)]
pub(super) struct PySweep(Vec<SweepPoint>, bool);

impl PySweep {
    fn offsets<'py>(
        &self,
        py: Python<'py>,
        rows: impl Fn(&SweepPoint) -> usize,
    ) -> Bound<'py, PyArray1<i64>> {
        let mut offsets = Vec::with_capacity(self.0.len() + 1);
        let mut total = 0;
        offsets.push(0);
        for point in &self.0 {
            total += rows(point) as i64;
            offsets.push(total);
        }
        PyArray1::from_vec(py, offsets)
    }

    fn rows<'py>(
        &self,
        py: Python<'py>,
        rows: impl Fn(&SweepPoint) -> &[[f64; 4]],
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let all: Vec<[f64; 4]> = self.0.iter().flat_map(|p| rows(p).iter().copied()).collect();
        arrays::states(py, &all)
    }

    fn orbit(&self, part: impl Fn((usize, ImpactCount)) -> i64) -> Vec<i64> {
        let orbit = |p: &SweepPoint| p.period.and_then(|r| r.orbit).map_or(0, &part);
        self.0.iter().map(orbit).collect()
    }
}

#[pymethods]
impl PySweep {
    #[getter]
    fn done<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        let done = self.0.iter().map(|p| p.status != PointStatus::Pending).collect();
        PyArray1::from_vec(py, done)
    }
    /// Whether Ctrl-C ended the sweep.
    #[getter]
    fn interrupted(&self) -> bool {
        self.1
    }
    #[getter]
    fn status(&self) -> Vec<&'static str> {
        self.0.iter().map(|p| p.status.name()).collect()
    }
    #[getter]
    fn offset<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.offsets(py, |p| p.impact_section.len())
    }
    /// (rows, 4) x1, v1, v2 just before the impact, phase.
    #[getter]
    fn impact_section<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, |p| &p.impact_section)
    }
    #[getter]
    fn regime<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i8>> {
        PyArray1::from_vec(py, self.0.iter().flat_map(|p| p.regime.iter().copied()).collect())
    }
    #[getter]
    fn stroboscopic_offset<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.offsets(py, |p| p.stroboscopic.len())
    }
    /// (rows, 4) x1, v1, x2, v2.
    #[getter]
    fn stroboscopic<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, |p| &p.stroboscopic)
    }
    /// (n,) period in drive periods, 0 where none was found.
    #[getter]
    fn m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_vec(py, self.orbit(|(m, _)| m as i64))
    }
    /// (n,) impacts per orbit, -1 with complete chatter.
    #[getter]
    fn n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let count = |(_, n)| match n {
            ImpactCount::Finite(n) => n as i64,
            ImpactCount::Infinite => -1,
        };
        PyArray1::from_vec(py, self.orbit(count))
    }
    /// (n,) part of the kept window in contact.
    #[getter]
    fn contact_fraction<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.0.iter().map(|p| p.contact_fraction).collect())
    }
    #[getter]
    fn residual<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let residual = |p: &SweepPoint| p.period.map_or(f64::NAN, |r| r.residual);
        PyArray1::from_vec(py, self.0.iter().map(residual).collect())
    }
    /// (n, 4) state at the end.
    #[getter]
    fn final_states<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let state = |p: &SweepPoint| p.final_state.map_or([f64::NAN; 4], State::to_array);
        arrays::states(py, &self.0.iter().map(state).collect::<Vec<_>>())
    }
}

/// One run per value of a parameter.
#[pyfunction]
#[pyo3(signature = (
    system, parameter, values, initial, *, periods, keep, start = "fresh",
    max_events = DEFAULT_MAX_EVENTS, tolerance = DEFAULT_TOLERANCE, section_phase = 0.0,
    workers = None, progress = None,
))]
#[allow(clippy::too_many_arguments)]
pub(super) fn sweep(
    py: Python<'_>,
    system: &PySystem,
    parameter: &str,
    values: PyReadonlyArray1<'_, f64>,
    initial: [f64; 4],
    periods: i64,
    keep: i64,
    start: &str,
    max_events: u64,
    tolerance: f64,
    section_phase: f64,
    workers: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<PySweep> {
    let options = RunOptions {
        horizon: Horizon::Periods(periods),
        keep: Some(keep),
        max_events,
        tolerance,
        section_phase,
    };
    let start = SweepStart::from_name(start)?;
    let workers = Workers::new(workers)?;
    let (initial, values, system) = (to_state(initial)?, arrays::to_vec(&values), system.0);
    let mut raised = None;
    let points = py.detach(|| {
        let mut go_on = |done: usize| {
            if raised.is_none() {
                raised = Python::attach(|py| {
                    if let Some(progress) = &progress {
                        progress.call1(py, (done,))?;
                    }
                    py.check_signals()
                })
                .err();
            }
            raised.is_none()
        };
        crate::sweep::sweep(
            &system, parameter, &values, initial, options, start, &workers, &mut go_on,
        )
    })?;
    match raised {
        // Ctrl-C ends the sweep with what is done, inside the callback as outside it.
        Some(error) if !error.is_instance_of::<PyKeyboardInterrupt>(py) => Err(error),
        raised => Ok(PySweep(points, raised.is_some())),
    }
}
