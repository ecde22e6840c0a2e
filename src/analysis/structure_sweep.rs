//! Runs of structures that differ in some numbers, side by side or each from the end of the one before.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use rayon::prelude::*;

use crate::analysis::period::PeriodReport;
use crate::analysis::sweep::{PointStatus, SweepStart};
use crate::analysis::workers::Workers;
use crate::model::structure::{Structure, StructureState};
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::StopReason;
use crate::simulate::run::{Run, RunError, RunOptions, run};

/// One point: its run, what it says of the motion, and how it was begun.
#[derive(Debug, Clone)]
pub struct StructurePoint {
    /// Completed, restarted, or why not.
    pub status: PointStatus,
    /// The run, also one that failed; `None` for a start that does not fit, or one that was not begun.
    pub run: Option<Run<Structure>>,
    /// Its period and label.
    pub report: Option<PeriodReport>,
}

impl StructurePoint {
    fn none(status: PointStatus) -> Self {
        Self { status, run: None, report: None }
    }

    fn new(
        structure: &Structure,
        initial: &StructureState,
        options: RunOptions,
        restarted: bool,
        cancel: &CancelToken,
    ) -> Self {
        match run(structure, initial.clone(), options, cancel) {
            Ok(run) if run.stop_reason == StopReason::Interrupted => {
                Self::none(PointStatus::Pending)
            }
            Ok(run) => {
                let report = run.period(cancel);
                if report.is_interrupted() {
                    return Self::none(PointStatus::Pending);
                }
                let status = PointStatus::of(run.stop_reason, restarted);
                Self { status, run: Some(run), report: Some(report) }
            }
            Err(RunError::Simulation { done, .. }) => {
                Self { status: PointStatus::Failed, run: Some(*done), report: None }
            }
            Err(_) => Self::none(PointStatus::Overlap),
        }
    }
}

/// The points of a sweep, each from `initial` or followed from the one before; `count` counts those
/// that are done. Points that `cancel` has ended are pending.
pub fn structure_sweep(
    structures: &[&Structure],
    initial: &StructureState,
    options: RunOptions,
    start: SweepStart,
    workers: &Workers,
    cancel: &CancelToken,
    count: &AtomicUsize,
) -> Vec<StructurePoint> {
    let done = |point: StructurePoint| {
        count.fetch_add(1, Relaxed);
        point
    };
    if start == SweepStart::Fresh {
        return workers.install(|| {
            structures
                .par_iter()
                .map(|structure| {
                    if cancel.is_cancelled() {
                        return StructurePoint::none(PointStatus::Pending);
                    }
                    done(StructurePoint::new(structure, initial, options, false, cancel))
                })
                .collect()
        });
    }
    let mut points = vec![StructurePoint::none(PointStatus::Pending); structures.len()];
    let mut state = initial.clone();
    for step in 0..structures.len() {
        let place = if start == SweepStart::Backward { structures.len() - 1 - step } else { step };
        if cancel.is_cancelled() {
            break;
        }
        let mut point = StructurePoint::new(structures[place], &state, options, false, cancel);
        if point.status == PointStatus::Overlap {
            point = StructurePoint::new(structures[place], initial, options, true, cancel);
        }
        if let Some(run) = point.run.as_ref().filter(|run| run.stop_reason.reached_the_end()) {
            state = run.final_state.state.clone();
        }
        points[place] = done(point);
    }
    points
}
