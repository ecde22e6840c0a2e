//! A whole run with what is kept of it: the last periods' impacts, sections, grazes and events.

mod audit;
mod bounces;
mod kept;
mod legs;
mod options;

pub use audit::EnergyAudit;
pub use bounces::{Bounces, BouncesEnd};
pub use options::RunOptions;

use serde::{Deserialize, Serialize};

use self::kept::Kept;
use crate::contact::sustained::ContactMode;
use crate::flight::{Apart, Drive, stays_apart};
use crate::model::error::{ParameterError, SimulationError, StateError};
use crate::model::parameters::System;
use crate::model::state::{Clock, State};
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::{
    ContactRecord, Event, EventKind, EventRecord, GrazeRecord, ImpactRecord, StopEvent, StopReason,
};
use crate::simulate::tolerances::DEFAULT_MAX_EVENTS;
use crate::simulate::{Anchor, Checkpoint, Cycle, Job, Observer, Simulation, run_batch};

/// Why a run could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// Bad option.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// Bad start.
    #[error(transparent)]
    State(#[from] StateError),
    /// Failed computation.
    #[error("{error}")]
    Simulation {
        /// What failed, where.
        error: SimulationError,
        /// The run up to there; its stop reason is [`StopReason::Failed`].
        done: Box<Run>,
    },
}

/// State at the end of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FinalState {
    /// The state, after the impact if one falls on that instant.
    pub state: State,
    /// Periods and time in the period.
    pub clock: Clock,
    /// Time since the start.
    pub time: f64,
    /// Contact mode; `None` in flight.
    pub mode: Option<ContactMode>,
}

/// A run: what was kept, how it ended, and what is needed to go on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// The system.
    pub system: System,
    /// How it was made.
    pub options: RunOptions,
    /// Impacts in the window.
    #[serde(skip)]
    pub impacts: Vec<ImpactRecord>,
    /// States at the stroboscopic sections in the window.
    #[serde(skip)]
    pub stroboscopic: Vec<[f64; 4]>,
    /// Grazes in the window.
    #[serde(skip)]
    pub grazes: Vec<GrazeRecord>,
    /// Events of lasting contact in the window.
    #[serde(skip)]
    pub contacts: Vec<ContactRecord>,
    /// Events in the window.
    #[serde(skip)]
    pub events: Vec<EventRecord>,
    /// State at the end.
    pub final_state: FinalState,
    /// Why the run ended.
    pub stop_reason: StopReason,
    /// Impacts since t = 0, kept or not.
    pub impact_count: u64,
    /// Evaluations of the gap function.
    pub evaluations: u64,
    /// Start of the window.
    pub(crate) window: Clock,
    /// Number of the first section in the window.
    pub(crate) first_section: i64,
    /// The flight in which the window begins.
    window_anchor: Anchor,
    checkpoint: Checkpoint,
}

/// Most records for which there is room from the start: one impact per period is usual.
const MOST_EXPECTED: usize = 1024;

/// Most events, and sections, that are copied between two looks at the token.
const MOST_COPIED: u64 = 1 << 16;

/// Collects sections, and passes over what comes before the window.
pub(crate) struct Collector {
    sections: Vec<[f64; 4]>,
    /// Start of the window, and whether what happens there belongs to it.
    window: Clock,
    inclusive: bool,
    /// The leg in which the window begins.
    anchor: Anchor,
}

impl Observer for Collector {
    const SECTIONS: bool = true;

    fn section(&mut self, _: i64, state: &State) {
        self.sections.push(state.to_array());
    }

    fn skips(&mut self, clock: Clock, state: &State) -> bool {
        let skipped = self.precedes(clock);
        if skipped {
            self.anchor = Anchor::after_impact(clock, *state);
        }
        skipped
    }
}

impl Collector {
    /// From this instant on, after these sections.
    pub fn from(clock: Clock, sections: Vec<[f64; 4]>) -> Self {
        let anchor = Anchor::apart(clock, State::from_array([0.0; 4]));
        Self { sections, window: clock, inclusive: true, anchor }
    }

    /// The sections so far.
    pub fn sections(&self) -> &[[f64; 4]] {
        &self.sections
    }

    /// Makes room for so many sections more.
    pub fn reserve(&mut self, sections: usize) {
        self.sections.reserve(sections);
    }

    /// The last so many sections again.
    fn repeat(&mut self, sections: usize) {
        debug_assert!(sections <= self.sections.len(), "{sections} of {}", self.sections.len());
        let from = self.sections.len().saturating_sub(sections);
        self.sections.extend_from_within(from..);
    }

    fn precedes(&self, clock: Clock) -> bool {
        // What happens at the start belongs to a run whose window is all of it.
        clock < self.window || (clock == self.window && !self.inclusive)
    }
}

/// Makes a run, which `cancel` ends with what is done.
///
/// # Errors
/// [`RunError`]: a bad option or start before any work, or a failed computation.
pub fn run(
    system: &System,
    initial: State,
    options: RunOptions,
    cancel: &CancelToken,
) -> Result<Run, RunError> {
    let mut collection = Collection::begin(system, initial, options)?;
    collection.proceed(cancel);
    collection.into_run()
}

/// Makes runs, at most so many at a time: `next` gives their systems and starts, `done` gets each
/// with its place in their order.
pub(crate) fn run_together(
    next: &mut dyn FnMut() -> Option<(usize, System, State)>,
    options: RunOptions,
    cancel: &CancelToken,
    done: &mut dyn FnMut(usize, Result<Run, RunError>),
    most: usize,
) {
    let done = std::cell::RefCell::new(done);
    let mut next = || loop {
        let (place, system, initial) = next()?;
        match Collection::new(&system, initial, options, cancel) {
            Ok(collection) => return Some((place, collection)),
            Err(error) => (done.borrow_mut())(place, Err(error.into())),
        }
    };
    let mut made = |(place, collection): (usize, Collection)| {
        (done.borrow_mut())(place, collection.into_run());
    };
    run_batch(&mut next, &mut made, most);
}

/// A run in the making.
pub(crate) struct Collection {
    system: System,
    options: RunOptions,
    window: Clock,
    first_section: i64,
    simulation: Simulation,
    collector: Collector,
    kept: Kept,
    end: Option<StopEvent>,
    failure: Option<SimulationError>,
}

impl Job for Collection {
    type Watch = Collector;
    type Beside = ();

    fn parts(&mut self) -> (&mut Simulation, &mut Collector) {
        (&mut self.simulation, &mut self.collector)
    }

    fn take(&mut self, event: Result<Event, SimulationError>) {
        match event {
            Ok(Event::Stop(stop)) => self.end = Some(stop),
            Ok(event) => {
                if self.collector.precedes(event.clock()) {
                    self.collector.anchor = self.simulation.checkpoint().anchor;
                } else {
                    self.kept.take(&event);
                    if let Some((cycle, times)) = self.simulation.repeats() {
                        self.repeat(&cycle, times);
                    }
                }
            }
            Err(error) => self.failure = Some(error),
        }
    }
}

impl Collection {
    /// A run of which nothing is made yet.
    ///
    /// # Errors
    /// [`RunError`]: a bad option or start.
    pub fn begin(system: &System, initial: State, options: RunOptions) -> Result<Self, RunError> {
        options.check(system)?;
        Ok(Self::new(system, initial, options, &CancelToken::never())?)
    }

    /// Goes on until the run ends or `cancel` interrupts it, also after an interruption. Returns
    /// whether it has ended.
    pub fn proceed(&mut self, cancel: &CancelToken) -> bool {
        self.simulation.proceed_with(cancel);
        self.finish();
        self.end.is_none_or(|end| end.reason != StopReason::Interrupted)
    }

    /// How many millionths of its time are done.
    #[cfg_attr(not(feature = "python"), expect(dead_code))]
    pub fn millionths_done(&self) -> usize {
        let drive = self.simulation.drive();
        let here = self.end.map_or(self.simulation.clock(), |end| end.clock);
        let part = drive.time(here) / drive.time(self.simulation.horizon_clock());
        usize::try_from((1e6 * part.clamp(0.0, 1.0)) as i64).unwrap_or_default()
    }

    /// As [`Self::begin`], ended by `cancel`, with options that have been checked.
    ///
    /// # Errors
    /// [`StateError`]: a bad start.
    pub fn new(
        system: &System,
        initial: State,
        options: RunOptions,
        cancel: &CancelToken,
    ) -> Result<Self, StateError> {
        let simulation = Simulation::new(system, initial)?.cancel_with(cancel);
        let window = Clock::new(options.window(), 0.0);
        Ok(Self::of(simulation, system, options, window))
    }

    fn of(simulation: Simulation, system: &System, options: RunOptions, window: Clock) -> Self {
        let mut simulation = simulation
            .until(options.horizon)
            .max_events(options.max_events)
            .chatter_tolerance(options.chatter_tolerance)
            .section_phase(options.section_phase);
        simulation.sections_from(window.period + 1);
        simulation.skips_repeats_until(window.period);
        let end = simulation.horizon_clock().period;
        let expected =
            usize::try_from(end.saturating_sub(window.period)).map_or(0, |n| n.min(MOST_EXPECTED));
        let collector = Collector {
            sections: Vec::with_capacity(expected),
            window,
            inclusive: window <= simulation.clock(),
            anchor: simulation.checkpoint().anchor,
        };
        Self {
            system: *system,
            options,
            window,
            first_section: simulation.checkpoint().next_section,
            simulation,
            collector,
            kept: Kept::with_capacity(expected),
            end: None,
            failure: None,
        }
    }

    /// Copies what repeats, a part of it at a time so that the caller can end the run.
    #[inline(never)]
    fn repeat(&mut self, cycle: &Cycle, times: i64) {
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
    pub fn into_run(mut self) -> Result<Run, RunError> {
        self.finish();
        let failure = self.failure.take();
        let Self { system, options, window, first_section, simulation, collector, .. } = self;
        let end = self.end.unwrap_or_else(|| simulation.standstill());
        // A run that ends before its window has kept nothing: its window is its end.
        let window = if window > end.clock { end.clock } else { window };
        let Kept { impacts, grazes, contacts, mut events, .. } = self.kept;
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
            checkpoint: *simulation.checkpoint(),
        };
        match failure {
            Some(error) => Err(RunError::Simulation { error, done: Box::new(run) }),
            None => Ok(run),
        }
    }
}

impl Run {
    /// Goes on to a further horizon, with the same bits as one long run; keeps the last `keep`
    /// periods of the continuation (all of it if `None`).
    ///
    /// # Errors
    /// [`RunError`]: bad options, a run that ended for good, or a failed computation.
    pub fn resume(&self, options: RunOptions, cancel: &CancelToken) -> Result<Run, RunError> {
        let mut collection = self.begin_resuming(options)?;
        collection.proceed(cancel);
        collection.into_run()
    }

    /// The continuation, of which nothing is made yet.
    pub(crate) fn begin_resuming(&self, options: RunOptions) -> Result<Collection, RunError> {
        options.check(&self.system)?;
        let resumable = matches!(
            self.stop_reason,
            StopReason::Completed
                | StopReason::EventCap
                | StopReason::TimeCap
                | StopReason::Rest
                | StopReason::Interrupted
        );
        if !resumable {
            let allowed = "a run that completed, was interrupted or met a cap";
            return Err(ParameterError::new("stop_reason", self.stop_reason.name(), allowed).into());
        }
        let simulation = self.resumed().until(options.horizon);
        let here = self.final_state.clock;
        if simulation.horizon_clock() < here {
            let value = format!("{:?}", options.horizon);
            return Err(ParameterError::new("horizon", value, "not before the run's end").into());
        }
        let kept = Clock::new(options.window(), 0.0);
        let window = if options.keep.is_some() && kept > here { kept } else { here };
        Ok(Collection::of(simulation, &self.system, options, window))
    }

    /// The simulation at the end of the run, ready to go on. The caps on events count from there.
    pub(crate) fn resumed(&self) -> Simulation {
        let mut point = self.checkpoint;
        point.stopped = None;
        Simulation::from_checkpoint(&self.system, &point)
            .max_events(point.events.saturating_add(DEFAULT_MAX_EVENTS))
            .chatter_tolerance(self.options.chatter_tolerance)
    }

    /// Whether the end lies among skipped impacts.
    pub(crate) fn skips_at_end(&self) -> bool {
        self.checkpoint.skips()
    }

    /// A run that ends at the same instant in another state, of which nothing is kept; `None` unless
    /// both runs end in free flight there.
    pub(crate) fn begun_from(&self, state: State) -> Option<Run> {
        let apart = self.system.gap_function(&state) < -self.system.gap_noise(&state);
        if !apart || self.skips_at_end() || self.final_state.mode.is_some() {
            return None;
        }
        let anchor = Anchor::apart(self.final_state.clock, state);
        let final_state = FinalState { state, ..self.final_state };
        Some(self.ending(final_state, &self.checkpoint.restarted(anchor), Vec::new()))
    }

    /// This run and its continuation up to `end`, of which sections alone are kept.
    pub(crate) fn continued(
        &self,
        simulation: &Simulation,
        end: StopEvent,
        stroboscopic: Vec<[f64; 4]>,
    ) -> Run {
        let StopEvent { clock, time, state, reason } = end;
        let final_state = FinalState { state, clock, time, mode: simulation.mode() };
        let run = self.ending(final_state, simulation.checkpoint(), stroboscopic);
        Run { stop_reason: reason, impact_count: simulation.impact_count(), ..run }
    }

    /// A run of this system without tables of events.
    fn ending(
        &self,
        final_state: FinalState,
        checkpoint: &Checkpoint,
        stroboscopic: Vec<[f64; 4]>,
    ) -> Run {
        let kept = i64::try_from(stroboscopic.len()).unwrap_or(i64::MAX);
        Run {
            system: self.system,
            options: self.options,
            impacts: Vec::new(),
            stroboscopic,
            grazes: Vec::new(),
            contacts: Vec::new(),
            events: Vec::new(),
            final_state,
            stop_reason: self.stop_reason,
            impact_count: self.impact_count,
            evaluations: self.evaluations,
            window: final_state.clock,
            first_section: checkpoint.next_section - kept,
            window_anchor: checkpoint.anchor,
            checkpoint: *checkpoint,
        }
    }

    /// What becomes of bodies that are certain never to meet again.
    pub(crate) fn stays_apart(&self) -> Option<Apart> {
        let FinalState { state, clock, mode, .. } = self.final_state;
        let flies = mode.is_none() && !self.skips_at_end();
        flies.then(|| stays_apart(&self.system, clock, state)).flatten()
    }

    /// Start of the kept window.
    #[must_use]
    pub fn kept_from(&self) -> f64 {
        Drive::of(&self.system).time(self.window)
    }
}

#[cfg(test)]
mod tests {
    use super::{Collection, RunOptions, run};
    use crate::model::parameters::System;
    use crate::model::state::State;
    use crate::numerics::cancel::CancelToken;

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
