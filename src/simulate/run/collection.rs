//! A run in the making: from its start or from the end of another, in one go or in parts.

use super::collector::Collector;
use super::kept::Kept;
use super::options::RunOptions;
use super::proceeds::Proceeds;
use super::recorded::Recorded;
use super::trace::Begins;
use super::{FinalState, Run, RunError};
use crate::model::error::{SimulationError, StateError};
use crate::model::parameters::System;
use crate::model::state::Clock;
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::{EventKind, EventRecord, StopEvent, StopReason};
use crate::simulate::{Cycle, Job, Laned, Leg, ModelEvent, Simulation};

/// Most records for which there is room from the start: one impact per period is usual.
const MOST_EXPECTED: usize = 1024;

/// Most events, and sections, that are copied between two looks at the token.
pub(super) const MOST_COPIED: u64 = 1 << 16;

/// A run in the making.
#[derive(Clone)]
pub(crate) struct Collection<M: Recorded = System> {
    system: M,
    options: RunOptions,
    pub(super) window: Clock,
    pub(super) first_section: i64,
    pub(super) simulation: Simulation<M>,
    pub(super) collector: Collector<M>,
    kept: Kept<M>,
    end: Option<StopEvent<M::State>>,
    failure: Option<SimulationError>,
}

impl<M: Recorded + Laned> Job for Collection<M> {
    type Model = M;
    type Watch = Collector<M>;
    type Beside = ();

    fn parts(&mut self) -> (&mut Simulation<M>, &mut Collector<M>) {
        (&mut self.simulation, &mut self.collector)
    }

    #[inline(always)]
    #[allow(clippy::inline_always)] // in the lanes
    fn take(&mut self, event: Result<M::Event, SimulationError>) {
        self.took(&event);
    }

    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn skips(&mut self) -> bool {
        let precedes = self.collector.precedes(self.simulation.present_flight().clock());
        if precedes {
            // Into what is there: this is done at every impact.
            let (kept, leg) = (&mut self.collector.anchor, &self.simulation.checkpoint().anchor);
            (kept.clock, kept.phase) = (leg.clock, leg.phase);
            kept.state.clone_from(&leg.state);
            kept.touching.clone_from(&leg.touching);
        }
        precedes
    }
}

impl<M: Recorded> Proceeds for Collection<M> {
    fn proceed(&mut self, cancel: &CancelToken) -> bool {
        self.simulation.proceed_with(cancel);
        self.run_out();
        self.end.as_ref().is_none_or(|end| end.reason != StopReason::Interrupted)
    }

    #[cfg(feature = "python")]
    fn millionths_done(&self) -> usize {
        let drive = self.simulation.drive();
        let here = self.end.as_ref().map_or(self.simulation.clock(), |end| end.clock);
        let part = drive.time(here) / drive.time(self.simulation.horizon_clock());
        usize::try_from((1e6 * part.clamp(0.0, 1.0)) as i64).unwrap_or_default()
    }
}

impl<M: Recorded> Collection<M> {
    #[inline(always)]
    #[allow(clippy::inline_always)] // in the lanes
    fn took(&mut self, event: &Result<M::Event, SimulationError>) {
        if self.keeps(event)
            && let Some((cycle, times)) = self.simulation.repeats()
        {
            self.repeat(&cycle, times);
        }
    }

    /// Takes note of an event; whether it belongs to the window.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(super) fn keeps(&mut self, event: &Result<M::Event, SimulationError>) -> bool {
        let event = match event {
            Ok(event) => event,
            Err(error) => {
                // An interruption that the run has gone on from is no longer its end.
                (self.failure, self.end) = (Some(error.clone()), None);
                return false;
            }
        };
        if let Some(stop) = event.as_stop() {
            self.end = Some(stop.clone());
            false
        } else if self.collector.precedes(event.clock()) {
            self.collector.anchor = self.simulation.checkpoint().anchor.clone();
            false
        } else {
            self.kept.take(event);
            true
        }
    }

    /// Runs to the end.
    pub(super) fn run_out(&mut self) {
        while let Some(event) = self.next() {
            self.took(&event);
        }
    }

    /// The next event; legs on the way are noted.
    fn next(&mut self) -> Option<Result<M::Event, SimulationError>> {
        let Self { simulation, collector, kept, .. } = self;
        if !M::NOTES_LEGS || kept.trace.legs.is_none() {
            return simulation.advance(collector);
        }
        if simulation.checkpoint().stopped.is_some() {
            return None;
        }
        loop {
            let turn = simulation.step(collector);
            let point = simulation.checkpoint();
            let begins = match &turn {
                Some(Ok(event)) => M::begins(event, &point.anchor, point.skips()),
                Some(Err(_)) => None,
                // Unless the same leg goes on.
                None => (point.elapsed.hi == 0.0).then_some(Begins::Silently),
            };
            if let Some(begins) = begins {
                kept.trace.begins(point, begins);
            }
            if turn.is_some() {
                return turn;
            }
        }
    }

    /// A run of which nothing is made yet.
    ///
    /// # Errors
    /// [`RunError`]: a bad option or start.
    pub fn begin(system: &M, initial: M::State, options: RunOptions) -> Result<Self, RunError<M>> {
        options.check(system)?;
        let mut all = Self::new(system, initial, options, &CancelToken::never())?;
        if M::NOTES_LEGS && all.window == Clock::START {
            all.kept.trace.legs = Some(Vec::new());
        }
        Ok(all)
    }

    /// As [`Self::begin`], ended by `cancel`, with options that have been checked.
    ///
    /// # Errors
    /// [`StateError`]: a bad start.
    pub fn new(
        system: &M,
        initial: M::State,
        options: RunOptions,
        cancel: &CancelToken,
    ) -> Result<Self, StateError> {
        let simulation = Simulation::new(system, initial)?.cancel_with(cancel);
        let window = Clock::new(options.window(), 0.0);
        Ok(Self::of(simulation, system, options, window))
    }

    pub(super) fn of(
        simulation: Simulation<M>,
        system: &M,
        options: RunOptions,
        window: Clock,
    ) -> Self {
        let mut simulation = made_as(simulation, options);
        simulation.sections_from(window.period + 1);
        simulation.skips_repeats_until(window.period);
        let first_section = simulation.checkpoint().next_section;
        Self::keeping(simulation, system, options, (window, first_section))
    }

    /// What keeps the window of a simulation, from this section on.
    pub(super) fn keeping(
        simulation: Simulation<M>,
        system: &M,
        options: RunOptions,
        (window, first_section): (Clock, i64),
    ) -> Self {
        let end = simulation.horizon_clock().period;
        let expected =
            usize::try_from(end.saturating_sub(window.period)).map_or(0, |n| n.min(MOST_EXPECTED));
        let collector = Collector {
            sections: Vec::with_capacity(expected),
            window,
            inclusive: window <= simulation.clock(),
            anchor: simulation.checkpoint().anchor.clone(),
        };
        Self {
            system: system.clone(),
            options,
            window,
            first_section,
            simulation,
            collector,
            kept: Kept::with_capacity(expected),
            end: None,
            failure: None,
        }
    }

    /// Copies what repeats, a part of it at a time so that the caller can end the run.
    #[inline(never)]
    pub(super) fn repeat(&mut self, cycle: &Cycle, times: i64) {
        let most = MOST_COPIED / cycle.events.max(cycle.periods.unsigned_abs());
        let times = times.min(i64::try_from(most).unwrap_or(i64::MAX).max(1));
        let events = usize::try_from(cycle.events).unwrap_or(usize::MAX);
        let sections = usize::try_from(cycle.periods).unwrap_or(usize::MAX);
        for _ in 0..times {
            self.kept.repeat(events, cycle.periods, self.simulation.drive());
            self.collector.repeat(sections);
        }
        self.simulation.repeat(cycle, times);
    }

    /// Goes on to the end, and makes the run of what was kept.
    pub fn into_run(mut self) -> Result<Run<M>, RunError<M>> {
        self.run_out();
        // Also where it ends before the window, and all sections were told.
        self.simulation.sections_from(self.first_section);
        let failure = self.failure.take();
        let Self { system, options, window, first_section, simulation, collector, .. } = self;
        let end = self.end.unwrap_or_else(|| simulation.standstill());
        // A run that ends before its window has kept nothing: its window is its end.
        let window = if window > end.clock { end.clock } else { window };
        let Kept { impacts, grazes, contacts, mut events, mut trace } = self.kept;
        trace.repeated = simulation.repeated();
        events.push(EventRecord {
            time: end.time,
            period: end.clock.period,
            kind: EventKind::Stop as i64,
            index: -1,
        });
        let run = Run {
            system,
            options,
            impacts,
            stroboscopic: collector.sections,
            grazes,
            contacts,
            events,
            trace,
            final_state: FinalState {
                state: end.state,
                clock: end.clock,
                time: end.time,
                mode: simulation.mode(),
            },
            stop_reason: end.reason,
            impact_count: simulation.impact_count(),
            evaluations: simulation.evaluations(),
            window,
            first_section,
            window_anchor: collector.anchor,
            checkpoint: simulation.checkpoint().clone(),
        };
        match failure {
            Some(error) => Err(RunError::Simulation { error, done: Box::new(run) }),
            None => Ok(run),
        }
    }
}

/// A simulation up to its horizon, with the caps, tolerances and sections of these options.
pub(super) fn made_as<M: Recorded>(
    simulation: Simulation<M>,
    options: RunOptions,
) -> Simulation<M> {
    simulation
        .until(options.horizon)
        .max_events(options.max_events)
        .chatter_tolerance(options.chatter_tolerance)
        .section_phase(options.section_phase)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::state::State;
    use crate::simulate::run::run;

    #[test]
    fn a_run_made_in_parts_is_the_run_made_at_once() {
        let start = State { x1: 0.0, v1: 0.5, x2: 0.0, v2: 0.0 };
        // A motion that repeats exactly and is copied; friction; chatter with sustained contact.
        for (drive_frequency, friction, damping) in
            [(1.8, 0.0, 0.0), (2.55, 0.4, 0.01), (0.25, 0.0, 0.1)]
        {
            let system = System::builder()
                .mass_ratio(0.6)
                .frequency_ratio(2.0)
                .restitution(0.8)
                .gap(0.5)
                .drive_frequency(drive_frequency)
                .moment_amplitude(1.0)
                .pendulum_damping(damping)
                .oscillator_damping(damping)
                .force_amplitude(15.0 * damping)
                .friction(friction)
                .build()
                .unwrap();
            let options = RunOptions::periods(400).keep(300);
            let whole = run(&system, start, options, &CancelToken::never()).unwrap();
            for asks in [2, 3, 16] {
                let mut collection = Collection::begin(&system, start, options).unwrap();
                let mut parts = 1;
                while !collection.proceed(&CancelToken::after(asks)) {
                    parts += 1;
                }
                assert!(parts > 10, "{parts}");
                assert_eq!(collection.into_run().unwrap(), whole);
            }
        }
    }
}
