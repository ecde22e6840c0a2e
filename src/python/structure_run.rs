//! `_core.StructureRun`.

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::arrays::to_vec;
use super::cancel::interruptible_if;
use super::errors::{Crossing, Works};
use super::simulate::{outside, run_methods};
use super::structure::PyStructure;
use super::structure_parts::tables;
use super::trace::{Given, traced};
use crate::model::structure::{Structure, StructureState};
use crate::numerics::cancel::CancelToken;
use crate::simulate::run::{Run, StopImpactRecord};

/// Result of a simulation of a structure, in its own (modal or given) coordinates.
#[pyclass(name = "StructureRun", module = "vibroimpact._core", frozen)]
pub(super) struct PyStructureRun(pub(super) Run<Structure>);

impl Crossing for Structure {
    fn wrapped(py: Python<'_>, run: Run<Self>) -> PyResult<Py<PyAny>> {
        Ok(Py::new(py, PyStructureRun(run))?.into_any())
    }

    /// Columns of impacts.
    fn impacts<'py>(
        py: Python<'py>,
        run: &Run<Self>,
        rows: &[StopImpactRecord],
    ) -> PyResult<Bound<'py, PyAny>> {
        Ok(impacts(py, run.system.coordinates(), rows)?.into_any())
    }

    fn works(run: &Run<Self>, cancel: &CancelToken) -> Option<Works> {
        let audit = run.energy_audit(cancel)?;
        Some(Works::from([
            ("energy_start", audit.energy_start),
            ("energy_end", audit.energy_end),
            ("loads", audit.loads),
            ("damping", audit.damping),
            ("impacts", audit.impacts),
            ("contact_friction", audit.contact_friction),
            ("stops", audit.stops),
            ("total", audit.total),
            ("residual", audit.residual()),
        ]))
    }
}

type Columns<'py> = Bound<'py, PyDict>;

fn matrix<'py, 'a>(
    py: Python<'py>,
    count: usize,
    width: usize,
    rows: impl Iterator<Item = &'a [f64]>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let mut flat = Vec::with_capacity(count * width);
    rows.for_each(|row| flat.extend_from_slice(row));
    PyArray1::from_vec(py, flat).reshape([count, width])
}

/// Columns of impacts.
pub(super) fn impacts<'py>(
    py: Python<'py>,
    width: usize,
    rows: &[StopImpactRecord],
) -> PyResult<Columns<'py>> {
    let table = PyDict::new(py);
    let floats = |of: fn(&StopImpactRecord) -> f64| PyArray1::from_iter(py, rows.iter().map(of));
    let whole = |of: fn(&StopImpactRecord) -> i64| PyArray1::from_iter(py, rows.iter().map(of));
    let wide =
        |of: fn(&StopImpactRecord) -> &[f64]| matrix(py, rows.len(), width, rows.iter().map(of));
    table.set_item("time", floats(|row| row.time))?;
    table.set_item("period", whole(|row| row.period))?;
    table.set_item("time_in_period", floats(|row| row.time_in_period))?;
    table.set_item("stop", whole(|row| row.stop))?;
    table.set_item("q", wide(|row| &row.q)?)?;
    table.set_item("v_pre", wide(|row| &row.v_pre)?)?;
    table.set_item("v_post", wide(|row| &row.v_post)?)?;
    table.set_item("approach_velocity", floats(|row| row.approach_velocity))?;
    table.set_item("phase", floats(|row| row.phase))?;
    table.set_item("regime", whole(|row| row.regime as i64))?;
    table.set_item("impulse_normal", floats(|row| row.impulse_normal))?;
    table.set_item("impulse_tangential", floats(|row| row.impulse_tangential))?;
    table.set_item("energy_loss", floats(|row| row.energy_loss))?;
    Ok(table)
}

run_methods! { PyStructureRun {
    /// Columns of the kept grazes.
    #[getter]
    fn grazes<'py>(&self, py: Python<'py>) -> PyResult<Columns<'py>> {
        let (rows, width, table) = (&self.0.grazes, self.width(), PyDict::new(py));
        let count = rows.len();
        table.set_item("time", PyArray1::from_iter(py, rows.iter().map(|row| row.time)))?;
        table.set_item("period", PyArray1::from_iter(py, rows.iter().map(|row| row.period)))?;
        let times = rows.iter().map(|row| row.time_in_period);
        table.set_item("time_in_period", PyArray1::from_iter(py, times))?;
        table.set_item("stop", PyArray1::from_iter(py, rows.iter().map(|row| row.stop)))?;
        let q = rows.iter().map(|row| row.state.q.as_slice());
        table.set_item("q", matrix(py, count, width, q)?)?;
        let v = rows.iter().map(|row| row.state.v.as_slice());
        table.set_item("v", matrix(py, count, width, v)?)?;
        table.set_item("phase", PyArray1::from_iter(py, rows.iter().map(|row| row.phase)))?;
        let second = rows.iter().map(|row| row.gap_acceleration);
        table.set_item("gap_acceleration", PyArray1::from_iter(py, second))?;
        Ok(table)
    }

    /// Columns of the kept events of lasting contact.
    #[getter]
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Columns<'py>> {
        let (rows, width, table) = (&self.0.contacts, self.width(), PyDict::new(py));
        let count = rows.len();
        table.set_item("time", PyArray1::from_iter(py, rows.iter().map(|row| row.time)))?;
        table.set_item("period", PyArray1::from_iter(py, rows.iter().map(|row| row.period)))?;
        let times = rows.iter().map(|row| row.time_in_period);
        table.set_item("time_in_period", PyArray1::from_iter(py, times))?;
        let kinds = rows.iter().map(|row| row.kind as i64);
        table.set_item("kind", PyArray1::from_iter(py, kinds))?;
        table.set_item("stop", PyArray1::from_iter(py, rows.iter().map(|row| row.stop)))?;
        let stops = self.0.system.stops().len();
        let closed: Vec<bool> = rows
            .iter()
            .flat_map(|row| (0..stops).map(|stop| row.closed.contains(&(stop as u32))))
            .collect();
        table.set_item("closed", PyArray1::from_vec(py, closed).reshape([count, stops])?)?;
        let q = rows.iter().map(|row| row.state.q.as_slice());
        table.set_item("q", matrix(py, count, width, q)?)?;
        let v = rows.iter().map(|row| row.state.v.as_slice());
        table.set_item("v", matrix(py, count, width, v)?)?;
        table.set_item("phase", PyArray1::from_iter(py, rows.iter().map(|row| row.phase)))?;
        for (place, name) in ["normal_force", "tangential_force"].into_iter().enumerate() {
            let forces = rows.iter().map(|row| row.force[place]);
            table.set_item(name, PyArray1::from_iter(py, forces))?;
        }
        let skipped = rows.iter().map(|row| row.impacts_skipped);
        table.set_item("impacts_skipped", PyArray1::from_iter(py, skipped))?;
        let jumps = rows.iter().map(|row| row.time_jump);
        table.set_item("time_jump", PyArray1::from_iter(py, jumps))?;
        table.set_item("error", PyArray1::from_iter(py, rows.iter().map(|row| row.error)))?;
        Ok(table)
    }

    /// Columns of the kept events.
    #[getter]
    fn events<'py>(&self, py: Python<'py>) -> PyResult<Columns<'py>> {
        let (rows, table) = (&self.0.events, PyDict::new(py));
        table.set_item("time", PyArray1::from_iter(py, rows.iter().map(|row| row.time)))?;
        table.set_item("period", PyArray1::from_iter(py, rows.iter().map(|row| row.period)))?;
        table.set_item("kind", PyArray1::from_iter(py, rows.iter().map(|row| row.kind)))?;
        table.set_item("index", PyArray1::from_iter(py, rows.iter().map(|row| row.index)))?;
        let stops = rows.iter().map(|event| self.0.stop_of(event));
        table.set_item("stop", PyArray1::from_iter(py, stops))?;
        Ok(table)
    }

    /// Kept sections, (k, 2, N).
    #[getter]
    fn stroboscopic<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        states(py, self.width(), self.0.stroboscopic.iter())
    }

    /// Time, period, time in the period, mode, q and v at the end, and which stops are closed.
    #[getter]
    fn final_state<'py>(&self, py: Python<'py>) -> PyResult<Columns<'py>> {
        let (end, table) = (&self.0.final_state, PyDict::new(py));
        table.set_item("time", end.time)?;
        table.set_item("period", end.clock.period)?;
        table.set_item("time_in_period", end.clock.time_in_period)?;
        table.set_item("mode", end.mode.map_or("flight", |mode| mode.name()))?;
        table.set_item("q", PyArray1::from_slice(py, &end.state.q))?;
        table.set_item("v", PyArray1::from_slice(py, &end.state.v))?;
        let closed = self.0.closed_at_end();
        let stops = (0..self.0.system.stops().len() as u32).map(|stop| closed.contains(&stop));
        table.set_item("closed", PyArray1::from_iter(py, stops))?;
        Ok(table)
    }

    /// A sentence on how the run ended.
    #[getter]
    fn stop_detail(&self) -> String {
        let (reason, count) = (self.0.stop_reason.name(), self.0.impact_count);
        format!("{reason} at t = {} after {count} impacts", self.0.final_state.time)
    }

    /// States (len(t), 2, N) at times inside the kept window, forces (len(t), stops, 2), and whether
    /// Ctrl-C ended it with fewer rows.
    #[allow(clippy::type_complexity)]
    fn trajectory<'py>(
        &self,
        py: Python<'py>,
        t: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<(Bound<'py, PyArray3<f64>>, Bound<'py, PyArray3<f64>>, bool)> {
        let times = to_vec(&t);
        let is_long = !self.0.is_soon_followed(times.len());
        let ((rows, forces), interrupted) = interruptible_if(py, is_long, None, |cancel| {
            let (mut rows, mut forces) = (Vec::new(), Vec::new());
            let done = self.0.follow(&times, cancel, |state, force| {
                rows.push(state.clone());
                forces.extend(force.into_iter().flatten());
            });
            done.map(|()| (rows, forces)).ok_or_else(|| outside(&self.0))
        })?;
        let shape = [rows.len(), self.0.system.stops().len(), 2];
        let forces = PyArray1::from_vec(py, forces).reshape(shape)?;
        Ok((states(py, self.width(), rows.iter())?, forces, interrupted))
    }

    /// Everything but structure and arrays, as JSON with exact numbers.
    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string(&self.0.progress()).map_err(|e| PyValueError::new_err(e.to_string()))
    }

    /// A run from its structure, the text of `to_json`, the arrays, and what `trace` gave.
    #[staticmethod]
    #[pyo3(signature = (
        structure, text, impacts, stroboscopic, events, grazes, contacts, trace = None
    ))]
    #[allow(clippy::too_many_arguments)]
    fn from_parts(
        structure: &PyStructure,
        text: &str,
        impacts: &Bound<'_, PyDict>,
        stroboscopic: PyReadonlyArray3<'_, f64>,
        events: &Bound<'_, PyDict>,
        grazes: &Bound<'_, PyDict>,
        contacts: &Bound<'_, PyDict>,
        trace: Option<Given<'_>>,
    ) -> PyResult<Self> {
        let progress =
            serde_json::from_str(text).map_err(|e| PyValueError::new_err(e.to_string()))?;
        let tables = tables(impacts, &stroboscopic, events, grazes, contacts)?;
        let run = Run::of(structure.0.clone(), progress, tables);
        Ok(Self(traced(run, trace)?))
    }
}}

impl PyStructureRun {
    fn width(&self) -> usize {
        self.0.system.coordinates()
    }
}

/// States as an array (n, 2, N).
pub(super) fn states<'py, 'a>(
    py: Python<'py>,
    width: usize,
    rows: impl Iterator<Item = &'a StructureState>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let mut flat = Vec::new();
    let mut count = 0;
    for row in rows {
        flat.extend_from_slice(&row.q);
        flat.extend_from_slice(&row.v);
        count += 1;
    }
    PyArray1::from_vec(py, flat).reshape([count, 2, width])
}
