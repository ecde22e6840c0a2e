//! `_core.Sensitivity`.

use nalgebra::Complex;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use super::arrays;
use super::cancel::interruptible_if;
use super::errors::{Crossing, failed};
use super::run::PyRun;
use super::simulate::{Machine, carry_out, horizon};
use super::structure::rows;
use super::structure_run::PyStructureRun;
use super::system::to_state;
use crate::model::state::State;
use crate::model::structure::{StopVariation, Structure, StructureState, Variation};
use crate::simulate::event::StopReason;
use crate::simulate::run::{Recorded, Run, RunOptions};
use crate::simulate::tolerances::{DEFAULT_MAX_EVENTS, DEFAULT_TOLERANCE};
use crate::tangent::{
    Along, OneSidedReason, Sensitivity, SensitivityError, SensitivityTable, carried_out,
    structure_carried_out, structure_sensitivity as of_structure,
};

impl From<SensitivityError> for PyErr {
    fn from(error: SensitivityError) -> Self {
        match error {
            SensitivityError::Parameter(error) => error.into(),
            SensitivityError::State(error) => error.into(),
            _ => failed(error.to_string()),
        }
    }
}

/// Derivatives of a run; r rows of numbers are a state.
#[pyclass(name = "Sensitivity", module = "vibroimpact._core", frozen)]
pub(super) struct PySensitivity(Sensitivity<Box<dyn Along>>);

impl PySensitivity {
    /// A table of these dimensions, the last of which is what is differentiated by.
    fn table<'py, const N: usize>(
        &self,
        py: Python<'py>,
        values: &SensitivityTable,
        inner: [usize; N],
    ) -> PyResult<Bound<'py, PyAny>> {
        let array = PyArray1::zeros(py, values.len(), false);
        values.write(array.readwrite().as_slice_mut()?);
        let width: usize = inner.iter().product::<usize>() * self.0.names.len();
        let rows = values.len() / width;
        let shape: Vec<usize> =
            [rows].into_iter().chain(inner).chain([self.0.names.len()]).collect();
        let shape = PyTuple::new(py, shape)?;
        array.call_method1("reshape", (shape,))
    }

    /// Numbers of a state.
    fn width(&self) -> usize {
        self.0.final_state.len() / self.0.names.len()
    }
}

#[pymethods]
impl PySensitivity {
    /// (n, k) of the times of the kept impacts.
    #[getter]
    fn times<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.table(py, &self.0.times, [])
    }
    /// (n, r, k) of the states before them.
    #[getter]
    fn before<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.table(py, &self.0.before, [self.width()])
    }
    /// (n, r, k) of the states after them.
    #[getter]
    fn after<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.table(py, &self.0.after, [self.width()])
    }
    /// (m, r, k) of the sections.
    #[getter]
    fn stroboscopic<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.table(py, &self.0.stroboscopic, [self.width()])
    }
    /// (1, r, k) of the final state.
    #[getter]
    fn final_state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.table(py, &self.0.final_state.clone().into(), [self.width()])
    }
    /// Up to when they are known, where Ctrl-C has ended the work; else None.
    #[getter]
    fn until(&self) -> Option<f64> {
        self.0.until
    }
    /// Index, time and reason of each event from which on derivatives are one-sided.
    #[getter]
    fn one_sided(&self) -> Vec<(i64, f64, &'static str)> {
        let reason = |reason: OneSidedReason| reason.name();
        self.0.one_sided.iter().map(|at| (at.index, at.time, reason(at.reason))).collect()
    }
    /// (len(t), r, k) of the states at times inside the kept window, and whether Ctrl-C left some out.
    fn trajectory<'py>(
        &self,
        py: Python<'py>,
        t: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<(Bound<'py, PyAny>, bool)> {
        let times = arrays::to_vec(&t);
        let is_long = times.len() > MOST_TIMES_AT_ONCE;
        let (rows, interrupted) =
            interruptible_if(py, is_long, None, |cancel| self.0.trajectory(&times, cancel))?;
        let rows = rows.ok_or_else(|| {
            pyo3::exceptions::PyValueError::new_err("t outside of the kept window")
        })?;
        Ok((self.table(py, &rows.into(), [self.width()])?, interrupted))
    }
}

/// Derivatives of a `System` at events that take some milliseconds. With fewer a thread of their own, which
/// costs as much as some hundred of them, gains nothing: nobody would have looked for Ctrl-C before they
/// are done.
const MOST_AT_ONCE: u64 = 1 << 16;

/// Times at which derivatives are soon told, though impacts may have been skipped between them.
const MOST_TIMES_AT_ONCE: usize = 1 << 8;

/// Whether the derivatives of a run by so many numbers take longer, where one of them at an event takes as
/// long as so many of a `System`.
fn is_long<M: Recorded>(run: &Run<M>, names: usize, each: usize) -> bool {
    // Flights take long without events where the search for them does.
    let events = run.followed_events().max(run.evaluations / 8);
    // Without events each drive period counts, before the window too.
    let periods = u64::try_from(run.final_state.clock.period).unwrap_or_default();
    let places = events.saturating_add(periods);
    // Where events must be found, that takes as long as derivatives by two names.
    let numbers = (names as u64 + 2).saturating_mul(each as u64);
    places.saturating_mul(numbers) > MOST_AT_ONCE
}

/// Derivatives of a run from this start by the numbers of these names.
#[pyfunction]
pub(super) fn sensitivity(
    py: Python<'_>,
    run: &PyRun,
    initial: [f64; 4],
    names: Vec<String>,
) -> PyResult<PySensitivity> {
    let [x1, v1, x2, v2] = initial;
    let initial = State { x1, v1, x2, v2 };
    let is_long = is_long(&run.0, names.len(), 1);
    let (found, _) = interruptible_if(py, is_long, None, |cancel| {
        crate::tangent::sensitivity(&run.0, initial, &names, cancel)
    })?;
    Ok(PySensitivity(found.of_any()))
}

/// Derivatives of a run of a structure from this start, (2, N), along directions: each has a name, and
/// the derivatives of fields where the name alone does not say them.
#[pyfunction]
pub(super) fn structure_sensitivity(
    py: Python<'_>,
    run: &PyStructureRun,
    initial: PyReadonlyArray2<'_, f64>,
    by: Vec<(String, Option<Bound<'_, PyDict>>)>,
) -> PyResult<PySensitivity> {
    let structure = &run.0.system;
    let (initial, along) = (started(&initial), along(structure, by)?);
    let is_long = is_long(&run.0, along.len(), numbers_of(structure));
    let (found, _) =
        interruptible_if(py, is_long, None, |cancel| of_structure(&run.0, initial, along, cancel))?;
    Ok(PySensitivity(found.of_any()))
}

/// Reads of the token between two readings of the clock at the start of a run of a `System` that is made with
/// its derivatives: some milliseconds, for a cycle that is looked at for itself must not be interrupted.
const READS: u64 = 1 << 12;

/// A run from one start that is made with its derivatives, along directions or by the numbers of names
/// alone, and these, if Ctrl-C has not ended it. `progress` gets how many millionths of it are done.
#[pyfunction]
#[pyo3(signature = (
    machine, initial, by, *, periods = None, time = None, keep = None,
    max_events = DEFAULT_MAX_EVENTS, chatter_tolerance = DEFAULT_TOLERANCE, section_phase = 0.0,
    progress = None,
))]
#[allow(clippy::too_many_arguments)]
pub(super) fn simulate_with_sensitivity(
    py: Python<'_>,
    machine: Machine<'_>,
    initial: PyReadonlyArrayDyn<'_, f64>,
    by: Vec<(String, Option<Bound<'_, PyDict>>)>,
    periods: Option<i64>,
    time: Option<f64>,
    keep: Option<i64>,
    max_events: u64,
    chatter_tolerance: f64,
    section_phase: f64,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Py<PyAny>, Option<PySensitivity>)> {
    let horizon = horizon(periods, time)?;
    let options = RunOptions { horizon, keep, max_events, chatter_tolerance, section_phase };
    let progress = progress.as_ref();
    match machine {
        Machine::System(system) => {
            let (system, initial) = (&system.0, to_state(initial.extract()?)?);
            let names: Vec<String> = by.into_iter().map(|(name, _)| name).collect();
            let made = carried_out(system, initial, options, &names, |work| {
                carry_out(py, work, READS, progress)
            })?;
            with_sensitivity(py, made)
        }
        Machine::Structure(structure) => {
            let structure = &structure.0;
            let (initial, along) = (started(&initial.extract()?), along(structure, by)?);
            let reads = (READS / (structure.coordinates() as u64).pow(2)).max(2);
            let made = structure_carried_out(structure, initial, options, along, |work| {
                carry_out(py, work, reads, progress)
            })?;
            with_sensitivity(py, made)
        }
    }
}

/// A run with its derivatives; one that was interrupted without.
fn with_sensitivity<M: Crossing, L: Along + 'static>(
    py: Python<'_>,
    (run, found): (Run<M>, Result<Sensitivity<L>, SensitivityError>),
) -> PyResult<(Py<PyAny>, Option<PySensitivity>)> {
    let interrupted = run.stop_reason == StopReason::Interrupted;
    let found = if interrupted { None } else { Some(PySensitivity(found?.of_any())) };
    Ok((M::wrapped(py, run)?, found))
}

fn started(initial: &PyReadonlyArray2<'_, f64>) -> StructureState {
    let initial = rows(initial);
    StructureState::new(&initial[0], &initial[1])
}

/// What derivatives by one name at an event cost, in those of a `System`.
fn numbers_of(structure: &Structure) -> usize {
    (2 * structure.coordinates()).pow(2)
}

/// What a structure is differentiated along.
fn along(
    structure: &Structure,
    by: Vec<(String, Option<Bound<'_, PyDict>>)>,
) -> PyResult<Vec<(String, Variation)>> {
    let one = |(name, fields): (String, Option<Bound<'_, PyDict>>)| {
        let variation = match fields {
            Some(fields) => variation(&fields, structure.stops().len())?,
            None => Variation::named(&name, structure)?,
        };
        Ok((name, variation))
    };
    by.into_iter().map(one).collect()
}

/// The derivatives of fields.
fn variation(fields: &Bound<'_, PyDict>, stops: usize) -> PyResult<Variation> {
    let mut found = Variation::default();
    let mut start = [None, None];
    for (key, value) in fields {
        let key: String = key.extract()?;
        let vector = || -> PyResult<Vec<f64>> {
            Ok(arrays::to_vec(&value.extract::<PyReadonlyArray1<'_, f64>>()?))
        };
        let matrix = || -> PyResult<Vec<Vec<f64>>> {
            Ok(rows(&value.extract::<PyReadonlyArray2<'_, f64>>()?))
        };
        match key.as_str() {
            "mass" => found.mass = Some(matrix()?),
            "stiffness" => found.stiffness = Some(matrix()?),
            "damping" => found.damping = Some(matrix()?),
            "damping_ratios" => found.damping_ratios = Some(vector()?),
            "static_load" => found.static_load = Some(vector()?),
            "drive_amplitude" => {
                let drive = value.extract::<PyReadonlyArray1<'_, Complex<f64>>>()?;
                found.drive_amplitude = Some(drive.as_array().iter().copied().collect());
            }
            "drive_frequency" => found.drive_frequency = value.extract()?,
            "phase" => found.phase = value.extract()?,
            "q" => start[0] = Some(vector()?),
            "v" => start[1] = Some(vector()?),
            "stops" => {
                let all = matrix()?;
                let of = |row: &Vec<f64>| StopVariation {
                    gap: row[0],
                    restitution: row[1],
                    friction: row[2],
                    amplitude: row[3],
                    phase: row[4],
                    of_curve: std::array::from_fn(|i| row.get(5 + i).copied().unwrap_or_default()),
                };
                found.stops = all.iter().map(of).collect();
                debug_assert_eq!(found.stops.len(), stops);
            }
            _ => return Err(pyo3::exceptions::PyValueError::new_err(key)),
        }
    }
    if let [q, v] = &start
        && let Some(some) = q.as_ref().or(v.as_ref())
    {
        let none = vec![0.0; some.len()];
        let of = |part: &Option<Vec<f64>>| part.clone().unwrap_or_else(|| none.clone());
        found.start = Some(StructureState::new(&of(q), &of(v)));
    }
    Ok(found)
}
