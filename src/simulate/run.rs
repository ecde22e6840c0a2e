//! A whole run with what is kept of it: the last periods' impacts, sections, grazes and events.

mod audit;
mod bounces;
mod collection;
mod collector;
mod kept;
mod leg;
mod legs;
#[cfg(feature = "python")]
mod noted;
mod oblique;
mod options;
mod proceeds;
mod progress;
mod recorded;
mod structure;
mod structure_audit;
mod together;
mod told;
mod trace;

pub use audit::EnergyAudit;
pub use bounces::{Bounces, BouncesEnd};
pub(crate) use collection::Collection;
pub(crate) use collector::Collector;
#[cfg(feature = "python")]
pub(crate) use noted::Noted;
pub use options::RunOptions;
pub(crate) use proceeds::Proceeds;
#[cfg_attr(not(feature = "python"), expect(unused_imports))]
pub(crate) use progress::Tables;
pub(crate) use recorded::Kept;
pub use recorded::{Recorded, Row};
pub use structure::{StopContactRecord, StopGrazeRecord, StopImpactRecord};
pub use structure_audit::StructureAudit;
pub(crate) use together::{Together, run_together};
pub(crate) use trace::{Begins, Copies, Trace, TracedLeg};

use serde::{Deserialize, Serialize};

use crate::contact::sustained::ContactMode;
use crate::flight::{Apart, stays_apart};
use crate::model::error::{ParameterError, SimulationError, StateError};
use crate::model::parameters::System;
use crate::model::state::{Clock, State};
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::{EventRecord, StopEvent, StopReason};
use crate::simulate::tolerances::DEFAULT_MAX_EVENTS;
use crate::simulate::{Anchor, AnchorOf, CheckpointOf, FlightStart, Phase, Simulation};

/// Why a run could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RunError<M: Recorded = System> {
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
        done: Box<Run<M>>,
    },
}

/// State at the end of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FinalState<S = State, K = ContactMode> {
    /// The state, after the impact if one falls on that instant.
    pub state: S,
    /// Periods and time in the period.
    pub clock: Clock,
    /// Time since the start.
    pub time: f64,
    /// Contact mode; `None` in flight.
    pub mode: Option<K>,
}

/// A run: what was kept, how it ended, and what is needed to go on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "M: Serialize", deserialize = "M: Deserialize<'de>"))]
pub struct Run<M: Recorded = System> {
    /// The system.
    pub system: M,
    /// How it was made.
    pub options: RunOptions,
    /// Impacts in the window.
    #[serde(skip)]
    pub impacts: Vec<M::ImpactRow>,
    /// States at the stroboscopic sections in the window.
    #[serde(skip)]
    pub stroboscopic: Vec<M::Section>,
    /// Grazes in the window.
    #[serde(skip)]
    pub grazes: Vec<M::GrazeRow>,
    /// Events of lasting contact in the window.
    #[serde(skip)]
    pub contacts: Vec<M::ContactRow>,
    /// Events in the window.
    #[serde(skip)]
    pub events: Vec<EventRecord>,
    /// What is known of them beyond the tables.
    #[serde(skip)]
    pub(crate) trace: Trace<M>,
    /// State at the end.
    pub final_state: FinalState<M::State, M::Mode>,
    /// Why the run ended.
    pub stop_reason: StopReason,
    /// Impacts since t = 0, kept or not.
    pub impact_count: u64,
    /// Evaluations of the gap function; 0 in a run from a file.
    #[serde(skip)]
    pub evaluations: u64,
    /// Start of the window.
    pub(crate) window: Clock,
    /// Number of the first section in the window.
    pub(crate) first_section: i64,
    /// The flight in which the window begins.
    window_anchor: AnchorOf<M>,
    checkpoint: CheckpointOf<M>,
}

/// Makes a run, which `cancel` ends with what is done.
///
/// # Errors
/// [`RunError`]: a bad option or start before any work, or a failed computation.
pub fn run<M: Recorded>(
    system: &M,
    initial: M::State,
    options: RunOptions,
    cancel: &CancelToken,
) -> Result<Run<M>, RunError<M>> {
    let mut collection = Collection::begin(system, initial, options)?;
    collection.proceed(cancel);
    collection.into_run()
}

impl<M: Recorded> Run<M> {
    /// Goes on to a further horizon, with the same bits as one long run; keeps the last `keep`
    /// periods of the continuation (all of it if `None`).
    ///
    /// # Errors
    /// [`RunError`]: bad options, a run that ended for good, or a failed computation.
    pub fn resume(&self, options: RunOptions, cancel: &CancelToken) -> Result<Run<M>, RunError<M>> {
        let mut collection = self.begin_resuming(options)?;
        collection.proceed(cancel);
        collection.into_run()
    }

    /// The continuation, of which nothing is made yet.
    pub(crate) fn begin_resuming(&self, options: RunOptions) -> Result<Collection<M>, RunError<M>> {
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
    pub(crate) fn resumed(&self) -> Simulation<M> {
        let mut point = self.checkpoint.clone();
        point.stopped = None;
        let most = point.events.saturating_add(DEFAULT_MAX_EVENTS);
        Simulation::from_checkpoint(&self.system, point)
            .max_events(most)
            .chatter_tolerance(self.options.chatter_tolerance)
    }

    /// Events since t = 0 that were worked out, and of a run from a file all of those before its window.
    #[cfg(feature = "python")]
    pub(crate) fn followed_events(&self) -> u64 {
        self.checkpoint.events.saturating_sub(self.trace.repeated)
    }

    /// Whether the end lies among skipped impacts.
    pub(crate) fn skips_at_end(&self) -> bool {
        self.checkpoint.skips()
    }

    /// Start of the kept window.
    #[must_use]
    pub fn kept_from(&self) -> f64 {
        self.system.own_drive().time(self.window)
    }
}

impl<M: Recorded> Run<M> {
    /// Where its window begins, and the first section in it.
    pub(crate) fn kept(&self) -> (Clock, i64) {
        (self.window, self.first_section)
    }

    /// Whether it has kept all events since a start apart, and between them the bodies fly.
    pub(crate) fn is_all_flights(&self) -> bool {
        self.is_whole() && self.contacts.is_empty() && !self.skips_at_end()
    }

    /// The leg with which it begins, if it has kept all events.
    pub(crate) fn whole_from(&self) -> Option<&AnchorOf<M>> {
        (self.window == Clock::START).then_some(&self.window_anchor)
    }

    /// Whether it has kept all events since a start apart.
    pub(crate) fn is_whole(&self) -> bool {
        let apart = matches!(self.window_anchor.phase, Phase::Flight(FlightStart::Apart));
        self.window == Clock::START && apart
    }

    /// Whether the trace is that of its events, of which the stop has none.
    pub(crate) fn is_traced(&self) -> bool {
        self.trace.residuals.len() + 1 == self.events.len()
    }
}

impl Run {
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
        checkpoint: &CheckpointOf<System>,
        stroboscopic: Vec<[f64; 4]>,
    ) -> Run {
        let kept = i64::try_from(stroboscopic.len()).unwrap_or(i64::MAX);
        Run {
            system: self.system.clone(),
            options: self.options,
            impacts: Vec::new(),
            stroboscopic,
            grazes: Vec::new(),
            contacts: Vec::new(),
            events: Vec::new(),
            trace: Trace::default(),
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
}
