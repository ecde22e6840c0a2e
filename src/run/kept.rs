//! The events of the kept window, in their tables.

use crate::event::{
    ContactRecord, Event, EventKind, EventRecord, GrazeRecord, ImpactEvent, ImpactRecord,
};
use crate::flight::Drive;
use crate::state::Clock;

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
        let from = self.events.len().saturating_sub(events);
        for place in from..self.events.len() {
            let (event, residual) = (self.events[place], self.residuals[place]);
            let period = event.period + periods;
            let again =
                |time_in_period: f64| drive.time(Clock { period, time_in_period, residual });
            let index = event.index.unsigned_abs() as usize;
            let (time, length) = if event.kind == EventKind::Impact as i64 {
                let impact = self.impacts[index];
                let time = again(impact.time_in_period);
                self.impacts.push(ImpactRecord { time, period, ..impact });
                (time, self.impacts.len())
            } else if event.kind == EventKind::Graze as i64 {
                let graze = self.grazes[index];
                let time = again(graze.time_in_period);
                self.grazes.push(GrazeRecord { time, period, ..graze });
                (time, self.grazes.len())
            } else {
                let contact = self.contacts[index];
                let time = again(contact.time_in_period);
                self.contacts.push(ContactRecord { time, period, ..contact });
                (time, self.contacts.len())
            };
            let index = length as i64 - 1;
            self.events.push(EventRecord { time, period, index, ..event });
            self.residuals.push(residual);
        }
    }
}
