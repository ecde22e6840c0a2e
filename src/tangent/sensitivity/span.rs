//! Which part of a motion is told, and where it ends.

use std::ops::Range;

use crate::model::state::Clock;
use crate::simulate::run::{Collection, Recorded, Run};

/// The part of a motion that is told.
#[derive(Clone)]
pub(super) struct Span {
    /// Its start, and where the run ends, or does at the latest.
    pub window: Clock,
    pub end: Clock,
    /// The numbers of its sections.
    pub sections: Range<i64>,
    /// Whether the run is made while it is followed.
    pub is_made: bool,
}

impl Span {
    /// That of a run that has been made.
    pub fn of<M: Recorded>(run: &Run<M>) -> Self {
        let last = run.first_section + run.stroboscopic.len() as i64;
        Self {
            window: run.window,
            end: run.final_state.clock,
            sections: run.first_section..last,
            is_made: false,
        }
    }

    /// That of a run in the making.
    pub fn of_made<M: Recorded>(run: &Collection<M>) -> Self {
        let (window, first) = run.window();
        let end = run.horizon_clock();
        Self { window, end, sections: first..i64::MAX, is_made: true }
    }
}
