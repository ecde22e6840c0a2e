//! What a run of a structure has kept, turn by turn: the events of its tables, and the legs between them,
//! as impacts tell them or as the run has noted them.

use super::error::SensitivityError;
use crate::impact::StopImpact;
use crate::model::state::Clock;
use crate::model::structure::{Coordinates, Structure, StructureState};
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::{EventKind, EventRecord, StopEvent, StopReason};
use crate::simulate::run::{
    Begins, Copies, Recorded, Run, StopContactRecord, StopGrazeRecord, StopImpactRecord, TracedLeg,
};
use crate::simulate::structure::{
    StopChatterEvent, StopContactEvent, StopGrazeEvent, StopImpactEvent, StructureEvent, Touching,
};
use crate::simulate::{AnchorOf, FlightStart, Model, ModelEvent, Phase};

/// Kinds of events with which a stop closes.
const LANDINGS: [i64; 5] = [
    EventKind::Chatter as i64,
    EventKind::SlidePositive as i64,
    EventKind::SlideNegative as i64,
    EventKind::Stick as i64,
    EventKind::Closed as i64,
];

/// What a run has kept.
#[derive(Clone)]
pub(super) struct Kept<'a> {
    run: &'a Run<Structure>,
    legs: &'a [TracedLeg<Structure>],
    copies: Vec<Copies>,
    cancel: &'a CancelToken,
    section_offset: f64,
    /// The present leg and the one before, in this place or the other.
    anchors: [AnchorOf<Structure>; 2],
    present: usize,
    /// Whether impacts are skipped in it.
    skips: bool,
    /// Events so far, and legs without one since the last.
    events: usize,
    silent: usize,
    /// The next section.
    section: i64,
    /// Which of the copies are the present ones, or the next.
    copied: usize,
    /// The next event that may be a landing.
    landing: usize,
}

impl<'a> Kept<'a> {
    /// From the start of a run; `None` where it has not kept all that is needed.
    ///
    /// # Errors
    /// [`SensitivityError`]: this is not the start of the run.
    pub fn new(
        run: &'a Run<Structure>,
        initial: &StructureState,
        section_offset: f64,
        cancel: &'a CancelToken,
    ) -> Result<Option<Self>, SensitivityError> {
        let noted = run.trace.legs.as_deref().filter(|_| run.is_traced());
        let (legs, copies) = match noted {
            Some(legs) => (legs, run.trace.copies.clone()),
            None if is_plain(run) => (&[][..], repeated_impacts(run).into_iter().collect()),
            None => return Ok(None),
        };
        let Some(anchor) = run.whole_from() else { return Ok(None) };
        let kept = Self {
            run,
            legs,
            copies,
            cancel,
            section_offset,
            anchors: [anchor.clone(), anchor.clone()],
            present: 0,
            skips: false,
            events: 0,
            silent: 0,
            section: run.first_section,
            copied: 0,
            landing: 0,
        };
        if run.system.begin(initial.clone())? != *anchor {
            let clock = kept.next_clock();
            return Err(SensitivityError::OtherMotion { time: run.system.own_drive().time(clock) });
        }
        Ok(Some(kept))
    }

    /// The leg before the last turn,
    pub fn before(&self) -> &AnchorOf<Structure> {
        &self.anchors[1 - self.present]
    }

    /// the present one,
    pub fn anchor(&self) -> &AnchorOf<Structure> {
        &self.anchors[self.present]
    }

    /// and whether impacts are skipped in it.
    pub fn skips(&self) -> bool {
        self.skips
    }

    /// Events so far.
    pub fn events(&self) -> usize {
        self.events
    }

    /// Whether the present leg began with the last event.
    pub fn is_after_event(&self) -> bool {
        self.silent == 0
    }

    /// Whether the caller has ended the work.
    pub fn is_cancelled(&self) -> bool {
        self.cancel.is_cancelled()
    }

    /// How many whole cycles there are from here on.
    pub fn cycles_left(&self) -> i64 {
        let left = |copies: &Copies| (copies.end() - self.events) / copies.events;
        i64::try_from(self.present_copies().map_or(0, left)).unwrap_or(0)
    }

    /// Passes over so many of them.
    pub fn pass(&mut self, times: i64) {
        let Some(&Copies { events, periods, .. }) = self.present_copies() else { return };
        self.events += times.unsigned_abs() as usize * events;
        self.section += times * periods;
        self.anchors[self.present].clock.period += times * periods;
    }

    /// The leg that has been noted begins, so many drive periods later.
    fn begin(&mut self, leg: &TracedLeg<Structure>, later: i64) {
        self.present = 1 - self.present;
        let here = &mut self.anchors[self.present];
        here.clone_from(&leg.anchor);
        here.clock.period += later;
    }

    /// The flight after an impact begins.
    fn fly(&mut self, impact: &StopImpactEvent) {
        self.present = 1 - self.present;
        let here = &mut self.anchors[self.present];
        here.clock = impact.clock;
        here.state.clone_from(&impact.post);
        here.phase = Phase::Flight(FlightStart::Touching);
        here.touching.clone_from(&Touching::default());
    }

    /// The event of which the next one is a copy, and how many drive periods later it comes.
    fn original(&self) -> (usize, i64) {
        let Some(copies) = self.present_copies() else { return (self.events, 0) };
        let Copies { first, events, periods, .. } = *copies;
        let (cycles, place) = ((self.events - first) / events, (self.events - first) % events);
        (first - events + place, (cycles as i64 + 1) * periods)
    }

    /// The copies among which the next event is.
    pub fn present_copies(&self) -> Option<&Copies> {
        let copies = self.copies.get(self.copied)?;
        (copies.first <= self.events && self.events < copies.end()).then_some(copies)
    }

    /// What the run has noted of the next leg, in another drive period.
    fn noted(&self, place: usize) -> Option<&'a TracedLeg<Structure>> {
        let first = self.legs.partition_point(|leg| leg.events < place);
        self.legs.get(first + self.silent).filter(|leg| leg.events == place)
    }

    fn record(&self) -> Option<&'a EventRecord> {
        self.run.events.get(self.events)
    }

    /// A row of a table that an event has.
    fn row<R>(table: &'a [R], record: &EventRecord) -> Option<&'a R> {
        table.get(usize::try_from(record.index).ok()?)
    }

    fn clock(&self, period: i64, time_in_period: f64) -> Clock {
        let residual = self.run.trace.residuals.get(self.events).copied().unwrap_or_default();
        Clock { period, time_in_period, residual }
    }

    /// When the next event is.
    fn next_clock(&self) -> Clock {
        let run = self.run;
        let found = self.record().and_then(|record| {
            let at = |period, time_in_period| self.clock(period, time_in_period);
            if record.kind == EventKind::Impact as i64 {
                let row = Self::row(&run.impacts, record)?;
                Some(at(row.period, row.time_in_period))
            } else if record.kind == EventKind::Graze as i64 {
                let row = Self::row(&run.grazes, record)?;
                Some(at(row.period, row.time_in_period))
            } else {
                let row = Self::row(&run.contacts, record)?;
                Some(at(row.period, row.time_in_period))
            }
        });
        found.unwrap_or(run.final_state.clock)
    }

    /// Whether the next leg begins later than the present one, in which no impacts are skipped.
    pub fn lasts(&self) -> bool {
        let silent = self.noted(self.original().0).is_some_and(|leg| leg.begins.is_silent());
        !silent && !self.skips && self.next_clock() > self.anchor().clock
    }

    /// Whether bounces ahead may end in contact.
    pub fn lands(&mut self) -> bool {
        let ahead = &self.run.events[self.landing.max(self.events).min(self.run.events.len())..];
        let next = ahead.iter().position(|event| LANDINGS.contains(&event.kind));
        self.landing = self.run.events.len() - ahead.len() + next.unwrap_or(ahead.len());
        next.is_some()
    }

    /// Goes on to the next leg, with an event or without.
    pub fn turn(&mut self, passed: &mut Vec<i64>) -> Option<StructureEvent> {
        while self.copies.get(self.copied).is_some_and(|copies| self.events >= copies.end()) {
            self.copied += 1;
        }
        let (place, later) = self.original();
        let noted = self.noted(place);
        if let Some(leg) = noted
            && leg.begins.is_silent()
        {
            (self.silent, self.skips) = (self.silent + 1, leg.skips);
            self.begin(leg, later);
            self.pass_sections(Some(self.anchor().clock), passed);
            return None;
        }
        let (clock, here) = (self.next_clock(), self.anchor().clock);
        let end = &self.run.final_state;
        let stop = |clock, reason| {
            let (time, state) = (self.run.system.own_drive().time(clock), end.state.clone());
            Some(StructureEvent::stop(StopEvent { clock, time, state, reason }))
        };
        // Events of one instant belong together.
        if clock > here && self.cancel.is_cancelled() {
            return stop(here, StopReason::Interrupted);
        }
        let Some(event) = self.event(clock, noted) else {
            self.pass_sections(None, passed);
            return stop(end.clock, self.run.stop_reason);
        };
        self.pass_sections(Some(clock), passed);
        (self.events, self.silent) = (self.events + 1, 0);
        match (&event, noted) {
            (StructureEvent::Graze(_), _) => self.anchors[1 - self.present] = self.anchor().clone(),
            (_, Some(leg)) => {
                self.skips = leg.skips;
                self.begin(leg, later);
            }
            (StructureEvent::Impact(impact), None) => {
                self.skips = false;
                self.fly(impact);
            }
            _ => {}
        }
        Some(event)
    }

    /// The next event, with what has been noted of the leg after it; none: the stop.
    fn event(&self, clock: Clock, noted: Option<&TracedLeg<Structure>>) -> Option<StructureEvent> {
        let (run, record) = (self.run, self.record()?);
        if record.kind == EventKind::Impact as i64 {
            let row = Self::row(&run.impacts, record)?;
            let known = noted.and_then(|leg| match leg.begins {
                Begins::WithImpact(impact) => Some(impact),
                _ => None,
            });
            return kept_impact(&run.system, row, (clock, known)).map(StructureEvent::Impact);
        }
        if record.kind == EventKind::Graze as i64 {
            let row = Self::row(&run.grazes, record)?;
            let &StopGrazeRecord { time, phase, gap_acceleration, .. } = row;
            let (stop, state) = (usize::try_from(row.stop).ok()?, row.state.clone());
            let event = StopGrazeEvent { clock, time, phase, stop, state, gap_acceleration };
            return Some(StructureEvent::Graze(event));
        }
        let row = Self::row(&run.contacts, record)?;
        let &StopContactRecord { time, phase, kind, force, .. } = row;
        let (stop, state) = (usize::try_from(row.stop).ok()?, row.state.clone());
        let closed = row.closed.clone();
        if kind == EventKind::Chatter {
            let &StopContactRecord { impacts_skipped, time_jump, error, .. } = row;
            return Some(StructureEvent::Chatter(StopChatterEvent {
                clock,
                time,
                phase,
                stop,
                state,
                closed,
                impacts_skipped,
                time_jump,
                error,
            }));
        }
        let mode = noted.and_then(|leg| match leg.anchor.phase {
            Phase::Contact(mode) => Some(mode),
            _ => None,
        });
        let event = StopContactEvent { clock, time, phase, stop, state, mode, closed, force };
        Some(if kind == EventKind::Release {
            StructureEvent::Release(event)
        } else {
            StructureEvent::Closed(event)
        })
    }

    /// Tells the sections before an instant, or all.
    fn pass_sections(&mut self, until: Option<Clock>, passed: &mut Vec<i64>) {
        let end = self.run.first_section + self.run.stroboscopic.len() as i64;
        while self.section < end {
            let period = self.section - i64::from(self.section_offset > 0.0);
            // One that falls on an event is left for the leg after it.
            if until.is_some_and(|until| Clock::new(period, self.section_offset) >= until) {
                break;
            }
            passed.push(self.section);
            self.section += 1;
        }
    }
}

/// Whether a run has kept all of its events, and these are impacts at instants of their own.
fn is_plain(run: &Run<Structure>) -> bool {
    let clock = |row: &StopImpactRecord| Clock::new(row.period, row.time_in_period);
    let apart = run.impacts.windows(2).all(|rows| clock(&rows[0]) < clock(&rows[1]));
    run.is_all_flights() && run.grazes.is_empty() && apart
}

/// A kept impact; what it does follows from the row where only one stop is struck.
fn kept_impact(
    structure: &Structure,
    row: &StopImpactRecord,
    (clock, known): (Clock, Option<StopImpact>),
) -> Option<StopImpactEvent> {
    let state = |v: &Coordinates| StructureState { q: row.q.clone(), v: v.clone() };
    let (pre, post) = (state(&row.v_pre), state(&row.v_post));
    let impact = known.or_else(|| structure.resolved(row))?;
    Some(StopImpactEvent { clock, time: row.time, phase: row.phase, pre, post, impact })
}

/// The impacts at the end of a run that come again and again, where impacts are all of its events.
fn repeated_impacts(run: &Run<Structure>) -> Option<Copies> {
    let rows = &run.impacts;
    let last = rows.len().checked_sub(1)?;
    let events = (1..=last).find(|&count| is_again(&rows[last - count], &rows[last]))?;
    let periods = rows[last].period - rows[last - events].period;
    let is_same = |&place: &usize| {
        let (row, later) = (&rows[place], &rows[place + events]);
        is_again(row, later) && later.period - row.period == periods
    };
    let first = (0..=last - events).rev().take_while(is_same).last()?;
    let times = (last + 1 - first) / events - 1;
    (periods > 0 && times > 0).then_some(Copies { first: first + events, events, periods, times })
}

/// Whether the motion after two impacts is the same.
fn is_again(one: &StopImpactRecord, other: &StopImpactRecord) -> bool {
    one.time_in_period.to_bits() == other.time_in_period.to_bits()
        && one.stop == other.stop
        && one.q == other.q
        && one.v_pre == other.v_pre
        && one.v_post == other.v_post
}
