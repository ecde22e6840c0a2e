//! The events of the kept window, in their tables.

use crate::flight::Drive;
use crate::model::state::Clock;
use crate::simulate::event::{
    ContactRecord, Event, EventKind, EventRecord, GrazeRecord, ImpactEvent, ImpactRecord,
};

/// The tables of a run in the making.
#[derive(Default)]
pub(super) struct Kept {
    pub impacts: Vec<ImpactRecord>,
    pub grazes: Vec<GrazeRecord>,
    pub contacts: Vec<ContactRecord>,
    pub events: Vec<EventRecord>,
    /// What the clocks of the events hold beyond the tables.
    residuals: Vec<f64>,
}

impl Kept {
    /// With room for so many impacts.
    pub fn with_capacity(expected: usize) -> Self {
        Self {
            impacts: Vec::with_capacity(expected),
            events: Vec::with_capacity(expected),
            residuals: Vec::with_capacity(expected),
            ..Self::default()
        }
    }

    /// Takes an event.
    pub fn take(&mut self, event: &Event) {
        match event {
            Event::Impact(e) => self.take_impact(e),
            Event::Graze(e) => {
                self.note(e.clock, e.time, EventKind::Graze, self.grazes.len());
                self.grazes.push(GrazeRecord::from(e));
            }
            Event::Chatter(e) => {
                self.note(e.clock, e.time, EventKind::Chatter, self.contacts.len());
                self.contacts.push(ContactRecord::from(e));
            }
            Event::SlidePositive(e)
            | Event::SlideNegative(e)
            | Event::Stick(e)
            | Event::Release(e) => {
                self.note(e.clock, e.time, EventKind::of(e.mode), self.contacts.len());
                self.contacts.push(ContactRecord::from(e));
            }
            Event::Stop(_) => {}
        }
    }

    #[inline(always)]
    #[allow(clippy::inline_always)] // nearly all events are impacts
    fn take_impact(&mut self, e: &ImpactEvent) {
        self.note(e.clock, e.time, EventKind::Impact, self.impacts.len());
        self.impacts.push(ImpactRecord::from(e));
    }

    fn note(&mut self, clock: Clock, time: f64, kind: EventKind, index: usize) {
        let (kind, index) = (kind as i64, index as i64);
        self.events.push(EventRecord { time, period: clock.period, kind, index });
        self.residuals.push(clock.residual);
    }

    /// The last so many events again, so many drive periods later.
    pub fn repeat(&mut self, events: usize, periods: i64, drive: &Drive) {
        debug_assert!(events <= self.events.len(), "{events} of {}", self.events.len());
        let from = self.events.len().saturating_sub(events);
        for place in from..self.events.len() {
            let (event, residual) = (self.events[place], self.residuals[place]);
            let (period, row) = (event.period + periods, event.index.unsigned_abs() as usize);
            let at = |time_in_period: f64| drive.time(Clock { period, time_in_period, residual });
            let (time, index) = if event.kind == EventKind::Impact as i64 {
                let impact = self.impacts[row];
                let time = at(impact.time_in_period);
                (time, added(&mut self.impacts, ImpactRecord { time, period, ..impact }))
            } else if event.kind == EventKind::Graze as i64 {
                let graze = self.grazes[row];
                let time = at(graze.time_in_period);
                (time, added(&mut self.grazes, GrazeRecord { time, period, ..graze }))
            } else {
                let contact = self.contacts[row];
                let time = at(contact.time_in_period);
                (time, added(&mut self.contacts, ContactRecord { time, period, ..contact }))
            };
            self.events.push(EventRecord { time, period, index, ..event });
            self.residuals.push(residual);
        }
    }
}

/// Adds a row to a table; its place there.
fn added<T>(table: &mut Vec<T>, row: T) -> i64 {
    table.push(row);
    table.len() as i64 - 1
}
