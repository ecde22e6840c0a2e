//! What a run knows of its events beyond their tables. Derivatives use it (tangent/sensitivity).

use serde::{Deserialize, Serialize};

use crate::simulate::{AnchorOf, CheckpointOf, Model};

/// Of each event, and of what was copied. A run that was read from a file without it (noted.rs) has none.
#[derive(Debug, Clone)]
pub(crate) struct Trace<M: Model> {
    /// What the clocks of the events hold beyond the tables.
    pub residuals: Vec<f64>,
    /// In order.
    pub copies: Vec<Copies>,
    /// Events since t = 0 that were not worked out, because they repeat those before them.
    pub repeated: u64,
    /// The legs that events do not tell, in order; `None`: they have not been noted.
    pub legs: Option<Vec<TracedLeg<M>>>,
}

/// A leg that its event does not tell, or that begins without one.
#[derive(Debug, Clone)]
pub(crate) struct TracedLeg<M: Model> {
    /// Events before it, without its own.
    pub events: usize,
    /// What it begins with.
    pub begins: Begins<M::Impact>,
    pub anchor: AnchorOf<M>,
    /// Whether impacts are skipped in it.
    pub skips: bool,
}

/// What a leg begins with.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) enum Begins<I> {
    Silently,
    WithImpact(I),
    WithContact,
}

impl<I> Begins<I> {
    pub fn is_silent(&self) -> bool {
        matches!(self, Self::Silently)
    }
}

/// Events that were copied from those before them: they repeat to the last bit.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Copies {
    /// The first copied event.
    pub first: usize,
    /// Events of a cycle, its drive periods, and how many times it was copied.
    pub events: usize,
    pub periods: i64,
    pub times: usize,
}

/// How a run was made plays no part in what it is.
impl<M: Model> PartialEq for Trace<M> {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl<M: Model> Default for Trace<M> {
    fn default() -> Self {
        Self { residuals: Vec::new(), copies: Vec::new(), repeated: 0, legs: None }
    }
}

impl<M: Model> Trace<M> {
    /// Takes note of a copy of the last events, before it is made.
    pub fn copied(&mut self, events: usize, periods: i64) {
        let first = self.residuals.len();
        if let Some(last) = self.copies.last_mut()
            && (last.events, last.periods) == (events, periods)
            && last.end() == first
        {
            last.times += 1;
            return;
        }
        self.copies.push(Copies { first, events, periods, times: 1 });
    }

    /// Takes note of the leg that begins so, before its event is taken.
    pub fn begins(&mut self, point: &CheckpointOf<M>, begins: Begins<M::Impact>) {
        if let Some(legs) = &mut self.legs {
            let (events, anchor) = (self.residuals.len(), point.anchor.clone());
            legs.push(TracedLeg { events, begins, anchor, skips: point.skips() });
        }
    }
}

impl Copies {
    /// The first event after them.
    pub fn end(&self) -> usize {
        self.first + self.times * self.events
    }
}
