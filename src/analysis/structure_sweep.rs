//! Sweeps of structures: one run for each cell, of which the label and what else is wanted is kept.
//!
//! Every point is a run of its own, or a followed branch is one task from end to end, so the result
//! has the same bits for any number of threads.

use std::cell::RefCell;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use crate::analysis::period::PeriodReport;
use crate::analysis::structure_lyapunov::structure_lyapunov;
use crate::analysis::sweep::{
    Measure, OnBranch, PointStatus, SweepOptions, SweepStart, follow, in_order,
};
use crate::analysis::workers::{Workers, side_by_side};
use crate::model::error::ParameterError;
use crate::model::structure::{Structure, StructureState};
use crate::numerics::cancel::CancelToken;
use crate::simulate::run::{Run, RunError, StopImpactRecord, run, run_together};

/// The cells of a sweep: structure and start of each are made when its run begins, for there may be
/// many.
pub trait StructureCells: Sync {
    /// How many.
    fn count(&self) -> usize;
    /// The structure of a cell.
    ///
    /// # Errors
    /// [`ParameterError`] for a number out of range.
    fn structure(&self, place: usize) -> Result<Structure, ParameterError>;
    /// Where it starts.
    fn initial(&self, place: usize) -> StructureState;
}

/// What is kept of one point.
#[derive(Debug, Clone, PartialEq)]
pub struct StructurePoint {
    /// What became of it.
    pub status: PointStatus,
    /// Period, with the label if that was wanted.
    pub period: Option<PeriodReport>,
    /// Lyapunov exponents with their standard errors, those wanted.
    pub exponents: Vec<[f64; 2]>,
    /// State at the end.
    pub final_state: Option<StructureState>,
    /// Part of the kept window in which a stop is closed; NaN where nothing is kept.
    pub contact_fraction: f64,
    /// The kept impacts, if rows are wanted,
    pub impacts: Vec<StopImpactRecord>,
    /// and the kept sections.
    pub stroboscopic: Vec<StructureState>,
}

impl OnBranch for StructurePoint {
    type State = StructureState;

    fn status(&self) -> PointStatus {
        self.status
    }

    fn end(&self) -> Option<StructureState> {
        self.final_state.clone()
    }
}

impl StructurePoint {
    fn empty(status: PointStatus) -> Self {
        Self {
            status,
            period: None,
            exponents: Vec::new(),
            final_state: None,
            contact_fraction: f64::NAN,
            impacts: Vec::new(),
            stroboscopic: Vec::new(),
        }
    }

    fn of(
        run: Result<Run<Structure>, RunError<Structure>>,
        options: &SweepOptions,
        restarted: bool,
        cancel: &CancelToken,
    ) -> Self {
        let run = match run {
            Ok(run) => run,
            Err(RunError::State(_)) => return Self::empty(PointStatus::Overlap),
            Err(_) => return Self::empty(PointStatus::Failed),
        };
        let status = PointStatus::of(run.stop_reason, restarted);
        let (mut period, mut exponents) = (None, Vec::new());
        if run.stop_reason.reached_the_end() {
            (period, exponents) = measured(&run, options.measure, cancel);
        }
        // What was measured may have been cut short.
        if status == PointStatus::Pending || cancel.is_cancelled() {
            return Self::empty(PointStatus::Pending);
        }
        let mut point = Self { period, exponents, ..Self::empty(status) };
        point.contact_fraction = run.time_in_contact() / (run.final_state.time - run.kept_from());
        point.final_state = Some(run.final_state.state);
        if options.rows {
            (point.impacts, point.stroboscopic) = (run.impacts, run.stroboscopic);
        }
        point
    }
}

/// What is wanted of a run that has come to its end.
fn measured(
    run: &Run<Structure>,
    measure: Measure,
    cancel: &CancelToken,
) -> (Option<PeriodReport>, Vec<[f64; 2]>) {
    if measure == Measure::Returns {
        return (Some(run.section_report(cancel)), Vec::new());
    }
    let mut labelling = run.labelled(cancel);
    let exponents = match measure {
        Measure::LargestExponent => vec![labelling.exponent(run, cancel)],
        Measure::Spectrum(periods) => {
            let (start, all) = (labelling.settled.clone(), 2 * run.system.coordinates());
            match structure_lyapunov(&run.system, start, periods, all, None, cancel) {
                Ok(found) => {
                    found.exponents.into_iter().zip(found.errors).map(|(x, e)| [x, e]).collect()
                }
                Err(_) => vec![[f64::NAN; 2]; all],
            }
        }
        Measure::Returns | Measure::Label => Vec::new(),
    };
    (Some(labelling.report), exponents)
}

/// Runs every cell, and counts in `done` those that are. `cancel` ends the sweep; cells not done
/// are then pending.
///
/// # Errors
/// [`ParameterError`] for a bad option or cell, before any run.
pub fn structure_sweep(
    cells: &dyn StructureCells,
    options: SweepOptions,
    start: SweepStart,
    workers: &Workers,
    cancel: &CancelToken,
    done: &AtomicUsize,
) -> Result<Vec<StructurePoint>, ParameterError> {
    for place in 0..cells.count() {
        options.run.check(&cells.structure(place)?)?;
    }
    let counted = |point: StructurePoint| {
        done.fetch_add(usize::from(point.status != PointStatus::Pending), Relaxed);
        point
    };
    Ok(workers.install(|| {
        if start == SweepStart::Fresh {
            let points = side_by_side(cells.count(), &|next, done, in_hand| {
                let done = RefCell::new(done);
                let made = |place: usize, point: StructurePoint| {
                    (done.borrow_mut())(place, counted(point));
                };
                let mut next = || loop {
                    let place = next().filter(|_| !cancel.is_cancelled())?;
                    match cells.structure(place) {
                        Ok(structure) => return Some((place, structure, cells.initial(place))),
                        Err(_) => made(place, StructurePoint::empty(PointStatus::Failed)),
                    }
                };
                let mut ran = |place: usize, run| {
                    made(place, StructurePoint::of(run, &options, false, cancel));
                };
                run_together(&mut next, options.run, cancel, &mut ran, in_hand);
            });
            let pending = || StructurePoint::empty(PointStatus::Pending);
            return points.into_iter().map(|point| point.unwrap_or_else(pending)).collect();
        }
        let begun = |place: usize, from: Option<&StructureState>, restarted: bool| {
            if cancel.is_cancelled() {
                return StructurePoint::empty(PointStatus::Pending);
            }
            let Ok(structure) = cells.structure(place) else {
                return StructurePoint::empty(PointStatus::Failed);
            };
            let initial = from.cloned().unwrap_or_else(|| cells.initial(place));
            let run = run(&structure, initial, options.run, cancel);
            StructurePoint::of(run, &options, restarted, cancel)
        };
        let mut last = None;
        in_order(cells.count(), start, |place| {
            counted(follow(&mut last, |from, restarted| begun(place, from, restarted)))
        })
    }))
}
