//! How far a run has come, without its system and its tables: what is needed to go on with it.

use serde::{Deserialize, Serialize};

use super::recorded::Recorded;
use super::trace::Trace;
use super::{FinalState, Run, RunOptions};
use crate::model::state::Clock;
use crate::simulate::event::{EventRecord, StopReason};
use crate::simulate::{AnchorOf, CheckpointOf};

/// All of a run but its system and its tables.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub(crate) struct Progress<M: Recorded> {
    options: RunOptions,
    final_state: FinalState<M::State, M::Mode>,
    stop_reason: StopReason,
    impact_count: u64,
    evaluations: u64,
    window: Clock,
    first_section: i64,
    window_anchor: AnchorOf<M>,
    checkpoint: CheckpointOf<M>,
}

/// The tables of a run.
pub(crate) struct Tables<M: Recorded> {
    pub impacts: Vec<M::ImpactRow>,
    pub stroboscopic: Vec<M::Section>,
    pub grazes: Vec<M::GrazeRow>,
    pub contacts: Vec<M::ContactRow>,
    pub events: Vec<EventRecord>,
}

#[cfg_attr(not(feature = "python"), expect(dead_code))]
impl<M: Recorded> Run<M> {
    pub(crate) fn progress(&self) -> Progress<M> {
        Progress {
            options: self.options,
            final_state: self.final_state.clone(),
            stop_reason: self.stop_reason,
            impact_count: self.impact_count,
            evaluations: self.evaluations,
            window: self.window,
            first_section: self.first_section,
            window_anchor: self.window_anchor.clone(),
            checkpoint: self.checkpoint.clone(),
        }
    }

    /// A run from its parts.
    pub(crate) fn of(system: M, progress: Progress<M>, tables: Tables<M>) -> Self {
        let Tables { impacts, stroboscopic, grazes, contacts, events } = tables;
        Self {
            system,
            options: progress.options,
            impacts,
            stroboscopic,
            grazes,
            contacts,
            events,
            trace: Trace::default(),
            final_state: progress.final_state,
            stop_reason: progress.stop_reason,
            impact_count: progress.impact_count,
            evaluations: progress.evaluations,
            window: progress.window,
            first_section: progress.first_section,
            window_anchor: progress.window_anchor,
            checkpoint: progress.checkpoint,
        }
    }
}
