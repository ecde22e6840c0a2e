//! Where the events of a run come from: from its tables, where they have all of them, or from a run in the
//! making. Both know where the motion repeats to the last bit.

use super::impact::FollowedImpact;
use super::making::Events;
use crate::contact::sustained::{ContactForce, ContactMode};
use crate::model::error::SimulationError;
use crate::model::parameters::System;
use crate::model::state::{Clock, State};
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::{
    ChatterEvent, ContactEvent, ContactRecord, Event, EventKind, EventRecord, GrazeEvent,
    GrazeRecord, StopEvent, StopReason,
};
use crate::simulate::run::{Collection, Copies, Recorded as _, Run};
use crate::simulate::{Cycle, Observer};

/// The sections that have been passed since they were last asked for, and the states there.
pub(super) struct Passed {
    /// The first one that is wanted.
    pub first: i64,
    pub all: Vec<(i64, State)>,
}

impl Observer for Passed {
    const SECTIONS: bool = true;

    fn section(&mut self, k: i64, state: &State) {
        self.all.push((k, *state));
    }

    fn first_section(&self) -> i64 {
        self.first
    }
}

/// What comes next in a motion.
pub(super) enum Next {
    Impact(FollowedImpact),
    /// An event that is none.
    Other(Event),
}

impl Next {
    pub fn clock(&self) -> Clock {
        match self {
            Self::Impact(impact) => impact.clock,
            Self::Other(event) => event.clock(),
        }
    }
}

/// The events of a run, one by one.
#[derive(Clone)]
pub(super) enum Source<'a> {
    /// As they are found while the run is made, and what has been found that the motion repeats.
    Made(Box<Made>),
    /// As they are kept.
    Kept(Kept<'a>),
}

/// A run in the making, and what has been found to repeat.
#[derive(Clone)]
pub(super) struct Made {
    run: Collection,
    cycle: Option<Cycle>,
}

/// The events that a run keeps.
#[derive(Clone)]
pub(super) struct Kept<'a> {
    run: &'a Run,
    cancel: &'a CancelToken,
    section_offset: f64,
    event: usize,
    section: usize,
    /// Which of the run's copies are the present ones, or the next.
    copies: usize,
    here: Clock,
}

/// Cycles of a motion, each from one event to the next one with the same numbers: so many together that
/// what is done once for all of them is little.
#[derive(Clone, Copy)]
pub(super) struct Alike {
    pub events: usize,
    pub periods: i64,
    together: i64,
    cycle: Option<Cycle>,
}

/// Fewest impacts of cycles that are taken together. One with contact is work enough by itself.
const TOGETHER: usize = 32;

/// Fewest drive periods of a window for which cycles are taken together.
const MANY_TOLD: i64 = 512;

impl Alike {
    /// Of cycles of so many events and drive periods; `many`: enough of them together.
    fn new((events, many): (usize, bool), periods: i64, cycle: Option<Cycle>) -> Self {
        let together = if many { TOGETHER.div_ceil(events.max(1)) } else { 1 };
        let count = together as i64;
        Self { events: together * events, periods: count * periods, together: count, cycle }
    }
}

impl<'a> Kept<'a> {
    pub fn new(run: &'a Run, section_offset: f64, cancel: &'a CancelToken) -> Self {
        Self { run, cancel, section_offset, event: 0, section: 0, copies: 0, here: Clock::START }
    }

    /// State just before the first event.
    pub fn first(&self) -> (Clock, State) {
        match self.next() {
            Some(Next::Impact(impact)) => (impact.clock, impact.pre),
            Some(Next::Other(Event::Graze(graze))) => (graze.clock, graze.state),
            Some(Next::Other(Event::Chatter(end))) => (end.clock, end.state),
            Some(Next::Other(
                Event::SlidePositive(contact)
                | Event::SlideNegative(contact)
                | Event::Stick(contact),
            )) => (contact.clock, contact.state),
            _ => (self.run.final_state.clock, self.run.final_state.state),
        }
    }

    fn next(&self) -> Option<Next> {
        let run = self.run;
        let &EventRecord { kind, index, .. } = run.events.get(self.event)?;
        let index = usize::try_from(index).ok();
        let is = |other: EventKind| kind == other as i64;
        // A run without contact can do without.
        let residual = run.trace.residuals.get(self.event).copied().unwrap_or_default();
        let clock = |period: i64, time_in_period: f64| Clock { period, time_in_period, residual };
        if is(EventKind::Impact) {
            let row = run.impacts.get(index?)?;
            let clock = clock(row.period, row.time_in_period);
            return FollowedImpact::kept(&run.system, row, clock).map(Next::Impact);
        }
        self.other(kind, index, clock).map(Next::Other)
    }

    /// An event that is no impact.
    fn other(
        &self,
        kind: i64,
        index: Option<usize>,
        clock: impl Fn(i64, f64) -> Clock,
    ) -> Option<Event> {
        let run = self.run;
        let is = |other: EventKind| kind == other as i64;
        if is(EventKind::Graze) {
            let row = run.grazes.get(index?)?;
            let &GrazeRecord { time, period, time_in_period, phase, gap_acceleration, .. } = row;
            let &GrazeRecord { x1, v1, x2, v2, .. } = row;
            let (clock, state) = (clock(period, time_in_period), State { x1, v1, x2, v2 });
            return Some(Event::Graze(GrazeEvent { clock, time, phase, state, gap_acceleration }));
        }
        if is(EventKind::Stop) {
            let end = &run.final_state;
            let (clock, time, state) = (end.clock, end.time, end.state);
            return Some(Event::Stop(StopEvent { clock, time, state, reason: run.stop_reason }));
        }
        let row = run.contacts.get(index?)?;
        Some(contact(row, clock(row.period, row.time_in_period)))
    }

    /// Copies that begin before the event that is next, by a cycle or more.
    fn alike(&mut self) -> Option<(Alike, i64)> {
        let all = &self.run.trace.copies;
        while self.event >= all.get(self.copies)?.end() {
            self.copies += 1;
        }
        let copies: &Copies = &all[self.copies];
        let &Copies { first, events, periods, .. } = copies;
        if self.event < first {
            return None;
        }
        let few = events < TOGETHER;
        let is_impact = |event: &EventRecord| event.kind == EventKind::Impact as i64;
        let all_impacts = few && self.run.events[first..first + events].iter().all(is_impact);
        let alike = Alike::new((events, all_impacts), periods, None);
        let times = (copies.end() - self.event) / alike.events.max(1);
        Some((alike, i64::try_from(times).ok()?))
    }

    fn advance(&mut self, passed: &mut Passed) -> Option<Next> {
        let end = &self.run.final_state;
        let event = self.next()?;
        // Events of one instant belong together.
        if event.clock() > self.here && self.cancel.is_cancelled() {
            let (clock, time, state) =
                (self.here, self.run.system.own_drive().time(self.here), end.state);
            let reason = StopReason::Interrupted;
            let stop = Event::Stop(StopEvent { clock, time, state, reason });
            return Some(Next::Other(stop));
        }
        let over = matches!(event, Next::Other(Event::Stop(_)));
        while let Some(&[x1, v1, x2, v2]) = self.run.stroboscopic.get(self.section) {
            let k = self.run.first_section + self.section as i64;
            let period = k - i64::from(self.section_offset > 0.0);
            // One that falls on an event is left for the leg after it.
            if !over && Clock::new(period, self.section_offset) >= event.clock() {
                break;
            }
            passed.section(k, &State { x1, v1, x2, v2 });
            self.section += 1;
        }
        self.event += 1;
        self.here = event.clock();
        Some(event)
    }
}

impl Events for Source<'_> {
    type Model = System;

    #[cfg(feature = "python")]
    fn made(&self) -> Option<&Collection> {
        if let Self::Made(made) = self { Some(&made.run) } else { None }
    }

    fn made_mut(&mut self) -> Option<&mut Collection> {
        if let Self::Made(made) = self { Some(&mut made.run) } else { None }
    }

    fn into_made(self) -> Option<Collection> {
        if let Self::Made(made) = self { Some(made.run) } else { None }
    }
}

impl Source<'_> {
    /// A run in the making.
    pub fn made(run: Collection) -> Self {
        Self::Made(Box::new(Made { run, cycle: None }))
    }

    /// Whether the caller has ended the work.
    pub fn is_cancelled(&self) -> bool {
        match self {
            Self::Made(made) => made.run.is_cancelled(),
            Self::Kept(kept) => kept.cancel.is_cancelled(),
        }
    }

    /// The same of work that nobody goes on with.
    pub fn is_given_up(&self) -> bool {
        matches!(self, Self::Kept(kept) if kept.cancel.is_cancelled())
    }

    /// The next event, and whether impacts were skipped on the way to it.
    pub fn advance(
        &mut self,
        system: &System,
        passed: &mut Passed,
    ) -> Option<Result<(Next, bool), SimulationError>> {
        match self {
            Self::Made(made) => {
                let run = &mut made.run;
                let event = match run.tell(passed)? {
                    Ok(event) => event,
                    Err(error) => return Some(Err(error)),
                };
                let hops = matches!(event, Event::Chatter(_)) || run.skips_at(&event);
                let next = match &event {
                    Event::Impact(impact) => Next::Impact(FollowedImpact::found(system, impact)),
                    _ => Next::Other(event),
                };
                Some(Ok((next, hops)))
            }
            Self::Kept(kept) => {
                let next = kept.advance(passed)?;
                let hops = match next {
                    Next::Other(Event::Chatter(_)) => true,
                    Next::Other(Event::Stop(_)) => kept.run.skips_at_end(),
                    _ => false,
                };
                Some(Ok((next, hops)))
            }
        }
    }

    /// What the motion is going to repeat after the present impact, and how often before it ends; `apart`:
    /// the impact is none of those that may lead into chatter, which belong together.
    pub fn alike(&mut self, apart: bool) -> Option<(Alike, i64)> {
        match self {
            Self::Made(made) => {
                let Made { run, cycle } = &mut **made;
                *cycle = run.found_to_repeat().or(*cycle);
                let cycle = cycle.take_if(|_| apart)?;
                let (events, periods) = (usize::try_from(cycle.events).ok()?, cycle.periods);
                // Of a short window little is told.
                let many = cycle.is_all_impacts() && run.told_periods() > MANY_TOLD;
                let alike = Alike::new((events, many), periods, Some(cycle));
                Some((alike, run.cycles_left_to_end(&cycle) / alike.together))
            }
            Self::Kept(kept) => kept.alike().filter(|_| apart),
        }
    }

    /// Passes over all cycles that are left, after one of them; how many, or nothing if the caller has
    /// cancelled.
    pub fn pass(&mut self, alike: &Alike) -> Option<i64> {
        match self {
            Self::Made(made) => {
                let (run, cycle) = (&mut made.run, alike.cycle.as_ref()?);
                let times = run.cycles_left_to_end(cycle).max(0) / alike.together;
                run.pass_all(cycle, times * alike.together).then_some(times)
            }
            Self::Kept(kept) => {
                let times = kept.alike().map_or(0, |(_, times)| times);
                let count = usize::try_from(times).unwrap_or_default();
                kept.event += count * alike.events;
                kept.section += count * usize::try_from(alike.periods).unwrap_or_default();
                kept.here.period += times * alike.periods;
                Some(times)
            }
        }
    }
}

/// The event of a row, at this clock.
fn contact(row: &ContactRecord, clock: Clock) -> Event {
    let &ContactRecord { time, kind, x1, v1, x2, v2, phase, .. } = row;
    let &ContactRecord { impacts_skipped, time_jump, error, .. } = row;
    let state = State { x1, v1, x2, v2 };
    let force = ContactForce { normal: row.normal_force, tangential: row.tangential_force };
    if kind == EventKind::Chatter as i64 {
        return Event::Chatter(ChatterEvent {
            clock,
            time,
            phase,
            state,
            force,
            impacts_skipped,
            time_jump,
            error,
        });
    }
    let mode = EventKind::mode(kind);
    let event = ContactEvent { clock, time, phase, state, mode, force };
    match mode {
        Some(ContactMode::SlidePositive) => Event::SlidePositive(event),
        Some(ContactMode::SlideNegative) => Event::SlideNegative(event),
        Some(ContactMode::Stick) => Event::Stick(event),
        None => Event::Release(event),
    }
}
