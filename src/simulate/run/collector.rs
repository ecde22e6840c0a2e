//! Where the kept window of a run begins, and the sections in it.

use crate::model::state::{Clock, State};
use crate::simulate::{Anchor, Observer};

/// Collects sections, and passes over what comes before the window.
pub(crate) struct Collector {
    pub(super) sections: Vec<[f64; 4]>,
    /// Start of the window, and whether what happens there belongs to it.
    pub(super) window: Clock,
    pub(super) inclusive: bool,
    /// The leg in which the window begins.
    pub(super) anchor: Anchor,
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
    pub fn repeat(&mut self, sections: usize) {
        debug_assert!(sections <= self.sections.len(), "{sections} of {}", self.sections.len());
        let from = self.sections.len().saturating_sub(sections);
        self.sections.extend_from_within(from..);
    }

    pub fn precedes(&self, clock: Clock) -> bool {
        // What happens at the start belongs to a run whose window is all of it.
        clock < self.window || (clock == self.window && !self.inclusive)
    }
}
