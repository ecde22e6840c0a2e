//! A run in the making that tells what it comes to: all events, also before its window, and what repeats
//! from the start on. What follows a motion beside it needs them.

use super::collection::{Collection, MOST_COPIED, made_as};
use super::collector::Collector;
use super::options::RunOptions;
use super::recorded::Recorded;
use crate::model::error::StateError;
use crate::model::state::Clock;
use crate::numerics::cancel::CancelToken;
use crate::simulate::{CheckpointOf, Cycle, ModelEvent, Observer, Simulation, Turn};

/// Sections as a run keeps them, and as they are told.
struct Sections<'a, M: Recorded, O> {
    collector: &'a mut Collector<M>,
    /// The first that the run keeps.
    first: i64,
    told: &'a mut O,
}

impl<M: Recorded, O: Observer<M::State>> Observer<M::State> for Sections<'_, M, O> {
    const SECTIONS: bool = true;

    fn section(&mut self, k: i64, state: &M::State) {
        if k >= self.first {
            self.collector.section(k, state);
        }
        self.told.section(k, state);
    }

    fn first_section(&self) -> i64 {
        self.told.first_section()
    }
}

/// Sections that nobody is told of.
struct Untold {
    /// The first that the run keeps.
    first: i64,
}

impl<S> Observer<S> for Untold {
    const SECTIONS: bool = true;

    fn section(&mut self, _: i64, _: &S) {}

    fn first_section(&self) -> i64 {
        self.first
    }
}

impl<M: Recorded> Collection<M> {
    /// A run that is told while it is made, with this window and first section.
    ///
    /// # Errors
    /// [`StateError`]: a bad start.
    pub(crate) fn told(
        system: &M,
        initial: M::State,
        options: RunOptions,
        kept: (Clock, i64),
    ) -> Result<Self, StateError> {
        let mut simulation = made_as(Simulation::new(system, initial)?, options);
        simulation.skips_repeats_until(Clock::START.period);
        Ok(Self::keeping(simulation, system, options, kept))
    }

    /// Goes on where it was interrupted, until this is cancelled.
    pub(crate) fn proceed_with(&mut self, cancel: &CancelToken) {
        self.simulation.proceed_with(cancel);
    }

    /// The next event; `None` after the stop.
    pub(crate) fn tell(&mut self, told: &mut impl Observer<M::State>) -> Turn<M> {
        if self.simulation.checkpoint().stopped.is_some() {
            return None;
        }
        loop {
            let turn = self.tell_step(told);
            if turn.is_some() {
                return turn;
            }
        }
    }

    /// A single turn, with an event or without one. Only before the stop.
    pub(crate) fn tell_step(&mut self, told: &mut impl Observer<M::State>) -> Turn<M> {
        let Self { simulation, collector, first_section, .. } = self;
        let turn = simulation.step(&mut Sections { collector, first: *first_section, told });
        if let Some(event) = &turn {
            self.keeps(event);
        }
        turn
    }

    /// The start of the window, and the first section that is kept.
    pub(crate) fn window(&self) -> (Clock, i64) {
        (self.window, self.first_section)
    }

    /// Where the run ends at the latest.
    pub(crate) fn horizon_clock(&self) -> Clock {
        self.simulation.horizon_clock()
    }

    /// Whether the caller has ended the work.
    pub(crate) fn is_cancelled(&self) -> bool {
        self.simulation.is_cancelled()
    }

    /// Where the simulation is.
    pub(crate) fn checkpoint(&self) -> &CheckpointOf<M> {
        self.simulation.checkpoint()
    }

    /// Whether this event, the last one so far, lies among skipped impacts.
    pub(crate) fn skips_at(&self, event: &M::Event) -> bool {
        self.simulation.skips_at(event)
    }

    /// What has been found to repeat since this was last asked.
    pub(crate) fn found_to_repeat(&mut self) -> Option<Cycle> {
        self.simulation.repeats().map(|(cycle, _)| cycle)
    }

    /// Drive periods of the window, at most.
    pub(crate) fn told_periods(&self) -> i64 {
        self.horizon_clock().period.saturating_sub(self.window.period)
    }

    /// How many whole cycles there are from here on.
    pub(crate) fn cycles_left_to_end(&self, cycle: &Cycle) -> i64 {
        self.simulation.cycles_left_to_end(cycle)
    }

    /// Whether the present leg begins before the window, or with it.
    fn is_before_window(&self) -> bool {
        self.simulation.clock() <= self.window
    }

    /// How many whole cycles there are from here on that can be passed over at once: all before the
    /// window, or all in it.
    pub(crate) fn cycles_left(&self, cycle: &Cycle) -> i64 {
        let left = self.simulation.cycles_left_to_end(cycle);
        let point = self.simulation.checkpoint();
        if self.is_before_window() {
            let periods = self.window.period - 2 - point.anchor.clock.period;
            return left.min(periods.max(0) / cycle.periods);
        }
        if point.next_section < self.first_section {
            return 0;
        }
        // So that the caller can end the run.
        let most = MOST_COPIED / cycle.events.max(cycle.periods.unsigned_abs());
        left.min(i64::try_from(most).unwrap_or(i64::MAX).max(1))
    }

    /// Passes over so many cycles, after one of them, and keeps those of the window.
    pub(crate) fn pass(&mut self, cycle: &Cycle, times: i64) {
        if self.collector.precedes(self.simulation.clock()) {
            self.simulation.repeat(cycle, times);
            self.collector.anchor = self.simulation.checkpoint().anchor.clone();
        } else {
            self.repeat(cycle, times);
        }
    }

    /// Passes over so many cycles, after one of them, also into the window, and keeps those of it; whether
    /// all of them, which the caller may have interrupted.
    pub(crate) fn pass_all(&mut self, cycle: &Cycle, times: i64) -> bool {
        let mut left = times;
        let mut has_kept_one = false;
        while left > 0 {
            if self.simulation.is_cancelled() {
                return false;
            }
            let passed = self.cycles_left(cycle).min(left);
            if passed > 0 && (self.is_before_window() || has_kept_one) {
                self.pass(cycle, passed);
                left -= passed;
                continue;
            }
            // The first that lies in the window is the one that is kept, and copied.
            has_kept_one = passed > 0;
            for _ in 0..cycle.events {
                let turn = self.tell(&mut Untold { first: self.first_section });
                if !turn.is_some_and(|event| event.is_ok_and(|event| event.as_stop().is_none())) {
                    return false;
                }
            }
            left -= 1;
        }
        true
    }
}
