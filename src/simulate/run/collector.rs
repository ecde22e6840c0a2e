//! Where the kept window of a run begins, and the sections in it.

use super::recorded::Recorded;
use crate::model::parameters::System;
use crate::model::state::{Clock, State};
use crate::simulate::{Anchor, AnchorOf, Observer};

/// Collects sections, and passes over what comes before the window.
#[derive(Clone)]
pub(crate) struct Collector<M: Recorded = System> {
    pub(super) sections: Vec<M::Section>,
    /// Start of the window, and whether what happens there belongs to it.
    pub(super) window: Clock,
    pub(super) inclusive: bool,
    /// The leg in which the window begins.
    pub(super) anchor: AnchorOf<M>,
}

impl<M: Recorded> Observer<M::State> for Collector<M> {
    const SECTIONS: bool = true;

    #[inline]
    fn section(&mut self, _: i64, state: &M::State) {
        self.sections.push(M::section(state));
    }

    #[inline]
    fn skips(&mut self, clock: Clock, state: &M::State) -> bool {
        if self.precedes(clock)
            && let Some(leg) = M::passed_over(clock, state)
        {
            self.anchor = leg;
            return true;
        }
        false
    }
}

impl Collector {
    /// From this instant on, after these sections.
    pub fn from(clock: Clock, sections: Vec<[f64; 4]>) -> Self {
        let anchor = Anchor::apart(clock, State::from_array([0.0; 4]));
        Self { sections, window: clock, inclusive: true, anchor }
    }
}

impl<M: Recorded> Collector<M> {
    /// The sections so far.
    pub fn sections(&self) -> &[M::Section] {
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
