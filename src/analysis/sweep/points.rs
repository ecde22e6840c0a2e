//! The points of a sweep in the lanes: each is a run, and then what is followed of the motion after
//! it until its label is told.

#![allow(clippy::inline_always)] // a round is compiled for several instruction sets

use std::cell::RefCell;
use std::collections::VecDeque;
use std::ops::ControlFlow::{self, Break, Continue};

use super::{Cell, Measure, PointStatus, SweepOptions, SweepPoint};
use crate::analysis::label::{Following, Labelling};
use crate::analysis::lyapunov::{GrowthRecord, LyapunovError, lyapunov_spectrum};
use crate::model::error::SimulationError;
use crate::model::parameters::System;
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::{Event, StopReason};
use crate::simulate::run::{Collection, Collector, Run, RunError};
use crate::simulate::{Job, Simulation, run_batch};

/// A run with its label.
pub(super) struct LabelledRun {
    pub run: Run,
    /// From the initial state although a branch was followed.
    pub restarted: bool,
    pub labelling: Labelling,
}

impl LabelledRun {
    /// The point, with the exponents that are wanted.
    pub fn point(mut self, options: &SweepOptions, cancel: &CancelToken) -> SweepPoint {
        let Self { run, labelling, .. } = &mut self;
        let mut exponents = [[f64::NAN; 2]; 4];
        match options.measure {
            Measure::LargestExponent => exponents[0] = labelling.exponent(run, cancel),
            Measure::Spectrum(periods) => {
                let later = labelling.settled(run, cancel);
                let settled = later.as_ref().unwrap_or(run);
                if let Ok(spectrum) = lyapunov_spectrum(settled, periods, None, cancel) {
                    if spectrum.error == Some(LyapunovError::Stopped(StopReason::Interrupted)) {
                        return SweepPoint::empty(PointStatus::Pending);
                    }
                    exponents =
                        std::array::from_fn(|i| [spectrum.exponents[i], spectrum.errors[i]]);
                }
            }
            Measure::Returns | Measure::Label => {}
        }
        let report = labelling.report(cancel);
        SweepPoint::new(self.run, self.restarted, options, (Some(report), exponents))
    }
}

/// What is simulated for a point.
#[expect(clippy::large_enum_variant, reason = "most are runs, and none is worth an allocation")]
enum PointJob {
    Run(usize, Collection),
    Label(usize, Box<LabelledRun>, Box<Following>),
}

impl Job for PointJob {
    type Model = System;
    type Watch = Collector;
    type Beside = GrowthRecord<1>;

    #[inline]
    fn parts(&mut self) -> (&mut Simulation, &mut Collector) {
        match self {
            Self::Run(_, run) => run.parts(),
            Self::Label(_, _, following) => following.parts(),
        }
    }

    #[inline]
    fn take(&mut self, event: Result<Event, SimulationError>) {
        match self {
            Self::Run(_, run) => run.take(event),
            Self::Label(_, _, following) => following.take(event),
        }
    }

    #[inline(always)]
    fn companion(&mut self) -> Option<(&mut GrowthRecord<1>, &Simulation)> {
        match self {
            Self::Run(..) => None,
            Self::Label(_, _, following) => following.companion(),
        }
    }

    #[inline(always)]
    fn passed(&mut self) {
        if let Self::Label(_, _, following) = self {
            following.passed();
        }
    }
}

/// Makes the points of the cells whose places `next` gives, at most so many at a time.
pub(super) fn points_together(
    cells: &[Cell],
    next: &mut dyn FnMut() -> Option<usize>,
    options: &SweepOptions,
    cancel: &CancelToken,
    done: &mut dyn FnMut(usize, SweepPoint),
    most: usize,
) {
    let done = RefCell::new(done);
    let made = |place: usize, point: SweepPoint| (done.borrow_mut())(place, point);
    // Labels that wait for a lane.
    let waiting = RefCell::new(VecDeque::new());
    loop {
        let mut next_job = || {
            if let Some(job) = waiting.borrow_mut().pop_front() {
                return Some(job);
            }
            loop {
                let place = next().filter(|_| !cancel.is_cancelled())?;
                let Cell { system, initial } = &cells[place];
                match Collection::new(system, *initial, options.run, cancel) {
                    Ok(run) => return Some(PointJob::Run(place, run)),
                    Err(_) => made(place, SweepPoint::empty(PointStatus::Overlap)),
                }
            }
        };
        let mut proceed = |job: PointJob| {
            let (place, point, following) = match job {
                PointJob::Run(place, run) => {
                    let run = run.into_run();
                    let run = match SweepPoint::without_label(run, false, options, cancel) {
                        Break(point) => return made(place, point),
                        Continue(run) => run,
                    };
                    let least = options.measure.least_growth();
                    let (labelling, following) = Labelling::begin(&run, least, cancel);
                    let point = Box::new(LabelledRun { run, restarted: false, labelling });
                    (place, point, following)
                }
                PointJob::Label(place, mut point, following) => {
                    let LabelledRun { run, labelling, .. } = &mut *point;
                    let following = labelling.proceed(run, following, cancel);
                    (place, point, following)
                }
            };
            match following {
                Some(following) => {
                    waiting.borrow_mut().push_back(PointJob::Label(place, point, following));
                }
                None => made(place, point.point(options, cancel)),
            }
        };
        run_batch(&mut next_job, &mut proceed, most);
        if waiting.borrow().is_empty() {
            return;
        }
    }
}

impl SweepPoint {
    /// Of a run that has no label, or of which none is wanted; else the run.
    pub(super) fn without_label(
        run: Result<Run, RunError>,
        restarted: bool,
        options: &SweepOptions,
        cancel: &CancelToken,
    ) -> ControlFlow<Self, Run> {
        let run = match run {
            Ok(run) => run,
            Err(RunError::State(_)) => return Break(Self::empty(PointStatus::Overlap)),
            Err(_) => return Break(Self::empty(PointStatus::Failed)),
        };
        let completed = run.stop_reason.reached_the_end();
        if completed && options.measure != Measure::Returns {
            // What is measured beside the run may take longer than the run; those who travelled
            // together end together.
            let pending = cancel.is_cancelled().then(|| Self::empty(PointStatus::Pending));
            return pending.map_or(Continue(run), Break);
        }
        let period = completed.then(|| run.section_report(cancel));
        Break(Self::new(run, restarted, options, (period, [[f64::NAN; 2]; 4])))
    }

    /// Of a run by itself.
    pub(super) fn of(
        run: Result<Run, RunError>,
        restarted: bool,
        options: &SweepOptions,
        cancel: &CancelToken,
    ) -> Self {
        let run = match Self::without_label(run, restarted, options, cancel) {
            Break(point) => return point,
            Continue(run) => run,
        };
        let labelling = run.labelled(options.measure.least_growth(), cancel);
        LabelledRun { run, restarted, labelling }.point(options, cancel)
    }
}
