//! The events of the kept window, in their tables.

use super::recorded::{self, Recorded, Row};
use super::trace::Trace;
use crate::flight::Drive;
use crate::model::state::Clock;
use crate::simulate::event::{EventKind, EventRecord};

/// The tables of a run in the making.
#[derive(Clone)]
pub(super) struct Kept<M: Recorded> {
    pub impacts: Vec<M::ImpactRow>,
    pub grazes: Vec<M::GrazeRow>,
    pub contacts: Vec<M::ContactRow>,
    pub events: Vec<EventRecord>,
    pub trace: Trace<M>,
}

impl<M: Recorded> Kept<M> {
    /// With room for so many impacts.
    pub fn with_capacity(expected: usize) -> Self {
        Self {
            impacts: Vec::with_capacity(expected),
            grazes: Vec::new(),
            contacts: Vec::new(),
            events: Vec::with_capacity(expected),
            trace: Trace { residuals: Vec::with_capacity(expected), ..Trace::default() },
        }
    }

    /// Takes an event.
    #[inline(always)]
    #[allow(clippy::inline_always)] // nearly all events are impacts
    pub fn take(&mut self, event: &M::Event) {
        let (clock, time, kept) = M::kept(event);
        let (kind, index) = match kept {
            recorded::Kept::Impact(row) => (EventKind::Impact, added(&mut self.impacts, row)),
            recorded::Kept::Graze(row) => (EventKind::Graze, added(&mut self.grazes, row)),
            recorded::Kept::Contact(kind, row) => (kind, added(&mut self.contacts, row)),
            recorded::Kept::Nothing => return,
        };
        self.events.push(EventRecord { time, period: clock.period, kind: kind as i64, index });
        self.trace.residuals.push(clock.residual);
    }

    /// The last so many events again, so many drive periods later.
    pub fn repeat(&mut self, events: usize, periods: i64, drive: &Drive) {
        debug_assert!(events <= self.events.len(), "{events} of {}", self.events.len());
        let from = self.events.len().saturating_sub(events);
        self.trace.copied(events, periods);
        for place in from..self.events.len() {
            let (event, residual) = (self.events[place], self.trace.residuals[place]);
            let (period, row) = (event.period + periods, event.index.unsigned_abs() as usize);
            let at = |time_in_period: f64| drive.time(Clock { period, time_in_period, residual });
            let (time, index) = if event.kind == EventKind::Impact as i64 {
                repeated(&mut self.impacts, row, period, at)
            } else if event.kind == EventKind::Graze as i64 {
                repeated(&mut self.grazes, row, period, at)
            } else {
                repeated(&mut self.contacts, row, period, at)
            };
            self.events.push(EventRecord { time, period, index, ..event });
            self.trace.residuals.push(residual);
        }
    }
}

/// Adds a row of a table again, in another period; its time, and its place there.
fn repeated<R: Row>(
    table: &mut Vec<R>,
    row: usize,
    period: i64,
    at: impl Fn(f64) -> f64,
) -> (f64, i64) {
    let row = table[row].clone();
    let time = at(row.time_in_period());
    (time, added(table, row.moved(time, period)))
}

/// Adds a row to a table; its place there.
fn added<T>(table: &mut Vec<T>, row: T) -> i64 {
    table.push(row);
    table.len() as i64 - 1
}
