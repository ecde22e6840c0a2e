//! A motion followed beyond its run in the lanes of a sweep, with a small perturbation of it and
//! with its sections, so that nothing is computed twice.

#![allow(clippy::inline_always)] // a round is compiled for several instruction sets

use crate::analysis::lyapunov::GrowthRecord;
use crate::analysis::period::{CHATTERING, Growth, PeriodReport, comes_back, detect_nearest};
use crate::analysis::tolerances::{QUIET_PERIODS, RETURN_WINDOW};
use crate::model::error::SimulationError;
use crate::model::parameters::System;
use crate::model::state::Clock;
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::{Event, StopEvent};
use crate::simulate::run::{Collector, Run};
use crate::simulate::{Horizon, Job, Simulation};

/// A motion after the end of its run.
pub(crate) struct Following {
    simulation: Simulation,
    collector: Collector,
    /// Impacts in the drive period that ends at each section, those of the run among them, and since
    /// the last one.
    counts: Vec<u32>,
    growth: GrowthRecord<1>,
    /// End of the run.
    from: Clock,
    /// The end of the motion so far.
    end: Option<StopEvent>,
}

impl Job for Following {
    type Model = System;
    type Watch = Collector;
    type Beside = GrowthRecord<1>;

    fn parts(&mut self) -> (&mut Simulation, &mut Collector) {
        (&mut self.simulation, &mut self.collector)
    }

    fn take(&mut self, event: Result<Event, SimulationError>) {
        let Ok(event) = event else { return };
        match event {
            Event::Impact(_) => self.count(|count| count.saturating_add(1)),
            Event::Chatter(_) => self.count(|_| CHATTERING),
            _ => self.count(|count| count),
        }
        if let Event::Stop(stop) = event {
            self.end = Some(stop);
        }
        self.growth.take(&event, &self.simulation);
    }

    #[inline(always)]
    fn companion(&mut self) -> Option<(&mut GrowthRecord<1>, &Simulation)> {
        Some((&mut self.growth, &self.simulation))
    }

    #[inline(always)]
    fn passed(&mut self) {
        self.count(|count| count.saturating_add(1));
    }
}

impl Following {
    /// Changes the count of impacts since the last section: those before an event have been passed.
    #[inline(always)]
    fn count(&mut self, change: impl FnOnce(u32) -> u32) {
        self.counts.resize(self.collector.sections().len() + 1, 0);
        if let Some(count) = self.counts.last_mut() {
            *count = change(*count);
        }
    }

    /// The motion that goes on from the end of `run`, for so many drive periods.
    pub fn new(run: &Run, periods: u32, cancel: &CancelToken) -> Self {
        let simulation = run.resumed().section_phase(run.options.section_phase).cancel_with(cancel);
        let (sections, counts) = run.counted_sections();
        let mut following = Self {
            simulation,
            collector: Collector::from(run.final_state.clock, sections.to_vec()),
            counts,
            growth: GrowthRecord::of_one(run),
            from: run.final_state.clock,
            end: None,
        };
        following.extend_to(periods);
        following
    }

    /// Goes on until so many drive periods after the run.
    pub fn extend_to(&mut self, periods: u32) {
        let end = Clock { period: self.from.period + i64::from(periods), ..self.from };
        let more = usize::try_from(end.period - self.simulation.clock().period).unwrap_or(0) + 1;
        self.collector.reserve(more);
        self.counts.reserve(more);
        self.end = None;
        self.simulation.extend_to(if end.time_in_period == 0.0 {
            Horizon::Periods(end.period)
        } else {
            Horizon::Time(self.simulation.drive().time(end))
        });
    }

    /// The growth of the perturbation so far; `None` where it cannot be measured.
    pub fn growth(&self) -> Option<Growth> {
        let arrived = self.end.is_some_and(|end| end.reason.reached_the_end());
        self.growth.growth().filter(|_| arrived)
    }

    /// Whether the bodies have not met for a while: they may never meet again.
    pub fn has_parted(&self) -> bool {
        let last = self.counts.len().saturating_sub(QUIET_PERIODS);
        last > 0 && self.counts[last..].iter().all(|&count| count == 0)
    }

    /// The run of which `run` is the first part, without tables of events.
    pub fn continued(&self, run: &Run) -> Option<Run> {
        Some(run.continued(&self.simulation, self.end?, self.collector.sections().to_vec()))
    }

    /// The period that its sections show, those of the run among them.
    pub fn return_report(&self, cancel: &CancelToken) -> PeriodReport {
        let sections = self.collector.sections();
        detect_nearest(sections, &self.counts[..sections.len()], cancel)
    }

    /// The period that its last sections show, if they have come back to where they were.
    pub fn last_return(&self, cancel: &CancelToken) -> Option<PeriodReport> {
        let sections = self.collector.sections();
        let last = sections.len().saturating_sub(RETURN_WINDOW)..sections.len();
        let window = &sections[last.clone()];
        comes_back(window).then(|| detect_nearest(window, &self.counts[last], cancel))
    }
}
