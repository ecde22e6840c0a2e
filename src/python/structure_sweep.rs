//! `_core.structure_sweep`.

use std::sync::atomic::AtomicUsize;

use numpy::PyReadonlyArray2;
use pyo3::prelude::*;

use super::cancel::{Progress, interruptible};
use super::period::PyPeriodReport;
use super::structure::PyStructure;
use super::structure_run::PyStructureRun;
use crate::analysis::Workers;
use crate::analysis::structure_sweep::{StructurePoint, structure_sweep as sweep};
use crate::analysis::sweep::SweepStart;
use crate::model::error::ParameterError;
use crate::model::structure::StructureState;
use crate::simulate::Horizon;
use crate::simulate::run::RunOptions;
use crate::simulate::tolerances::{DEFAULT_MAX_EVENTS, DEFAULT_TOLERANCE};

/// Of each point the place of its status in `STATUS_NAMES`, its run and what it says of the motion.
type Points = Vec<(i8, Option<PyStructureRun>, Option<PyPeriodReport>)>;

/// One run per structure, from a start (2, N) or each from the end of the one before; and whether
/// Ctrl-C ended the work.
#[pyfunction]
#[pyo3(signature = (
    structures, initial, *, periods, keep, start = "fresh", max_events = DEFAULT_MAX_EVENTS,
    chatter_tolerance = DEFAULT_TOLERANCE, section_phase = 0.0, workers = None, progress = None,
))]
#[allow(clippy::too_many_arguments)]
pub(super) fn structure_sweep(
    py: Python<'_>,
    structures: Vec<PyRef<'_, PyStructure>>,
    initial: PyReadonlyArray2<'_, f64>,
    periods: i64,
    keep: i64,
    start: &str,
    max_events: u64,
    chatter_tolerance: f64,
    section_phase: f64,
    workers: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Points, bool)> {
    let horizon = Horizon::Periods(periods);
    let options =
        RunOptions { horizon, keep: Some(keep), max_events, chatter_tolerance, section_phase };
    let structures: Vec<_> = structures.iter().map(|structure| &structure.0).collect();
    for structure in &structures {
        options.check(*structure)?;
    }
    let initial = initial.as_array();
    let initial = StructureState::new(&initial.row(0).to_vec(), &initial.row(1).to_vec());
    let (start, workers) = (SweepStart::from_name(start)?, Workers::new(workers)?);
    let done = AtomicUsize::new(0);
    let progress = progress.as_ref().map(|tell| Progress { tell, done: &done });
    let (points, interrupted) =
        interruptible::<_, ParameterError>(py, progress.as_ref(), |cancel| {
            Ok(sweep(&structures, &initial, options, start, &workers, cancel, &done))
        })?;
    let crossed = |StructurePoint { status, run, report }| {
        (status.code(), run.map(PyStructureRun), report.map(PyPeriodReport))
    };
    Ok((points.into_iter().map(crossed).collect(), interrupted))
}
