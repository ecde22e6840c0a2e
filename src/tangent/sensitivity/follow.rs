//! The motion of a run again, event by event, with its derivatives.

use super::by::By;
use super::chatter::Bounces;
use super::columns::{Column, Columns, Differentiated, Here, moves_stop};
use super::error::SensitivityError;
use super::impact::FollowedImpact;
use super::legs::{KeptLegs, SensitiveLeg};
use super::long_flight::Waypoints;
use super::making::Follows;
use super::marks::{OneSided, OneSidedReason, note, one_sided};
use super::source::{Next, Passed, Source};
use super::span::Span;
use super::table::SensitivityTable;
use crate::contact::sustained::ContactMode;
use crate::model::contact_coordinates::PreImpact;
use crate::model::state::{Clock, State};
use crate::simulate::event::{Event, StopReason};
use crate::tangent::itinerary::{LegChange, LegReader};
use crate::tangent::tolerances::{LOW_BOUNCE, SAME_TIME};

/// Tables of derivatives, of the window and of what comes before it in the same drive period.
#[derive(Default)]
pub(super) struct Rows {
    /// Drive period and time of the impacts, where they are looked at.
    pub impacts: Vec<(i64, f64)>,
    pub times: SensitivityTable,
    pub before: SensitivityTable,
    pub after: SensitivityTable,
    pub stroboscopic: SensitivityTable,
    pub legs: KeptLegs,
    pub one_sided: Vec<OneSided>,
    /// Events so far, and those before the window.
    pub events: i64,
    pub earlier: i64,
}

/// Fewest cycles ahead that are alike for which one of them is looked at more closely.
const FEWEST_ALIKE: i64 = 3;

/// Follows a motion.
pub(super) struct Follower<'a> {
    pub of: &'a Differentiated,
    pub span: Span,
    pub section_offset: f64,
    reader: LegReader,
    pub leg: SensitiveLeg,
    /// The instant at which it begins, with all of its digits.
    pub began: Clock,
    /// The last impacts, if they may lead into chatter.
    low: Option<Bounces>,
    /// u of the last impact, and the largest so far.
    last: f64,
    largest: f64,
    /// u after the last impact.
    separation: f64,
    pub rows: Rows,
    /// The section at which the caller has cancelled the rest of a flight.
    given_up: Option<Clock>,
    /// Whether the impacts may be others than the run's.
    pub looks: bool,
    /// So many events are next that are followed one by one, even if they come again.
    pub plain: usize,
    /// Where the rows are, in a cycle that is going to come again.
    pub instants: Option<Box<Instants>>,
}

/// What is told of a motion.
pub(super) struct Told {
    pub rows: Rows,
    /// Whether the impacts may be others than the run's.
    pub looks: bool,
    /// The derivatives of the state at the end, or
    pub last: Columns,
    /// where the caller has cancelled the rest, at this time.
    pub until: Option<f64>,
}

/// The instants of a cycle.
#[derive(Default)]
pub(super) struct Instants {
    pub events: Vec<Clock>,
    pub impacts: Vec<Clock>,
    /// Where the legs begin and end.
    pub legs: Vec<[Clock; 2]>,
    /// The numbers of the sections.
    pub sections: Vec<i64>,
    /// Where derivatives become one-sided.
    pub marks: Vec<Clock>,
}

/// What an event of the motion leads to.
pub(super) enum Step {
    Goes,
    /// The end of the run, and the derivatives of the state there.
    Ends(Columns),
    /// The caller has cancelled.
    Cancelled,
}

impl<'a> Follower<'a> {
    pub fn new(
        of: &'a Differentiated,
        initial: State,
        span: Span,
        section_phase: f64,
        (impacts, passed): (usize, usize),
    ) -> Self {
        let k = of.by.len();
        let rows = Rows {
            times: SensitivityTable::with_capacity(k * impacts),
            before: SensitivityTable::with_capacity(4 * k * impacts),
            after: SensitivityTable::with_capacity(4 * k * impacts),
            stroboscopic: SensitivityTable::with_capacity(4 * k * passed),
            legs: KeptLegs::with_capacity(impacts + 1, k),
            ..Rows::default()
        };
        let section_offset =
            if section_phase > 0.0 { section_phase / of.system.drive_frequency } else { 0.0 };
        let here = of.start(initial, Clock::START);
        let passed = Waypoints::default();
        let leg = SensitiveLeg { here, mode: None, hops: false, time: 0.0, passed };
        Self {
            of,
            span,
            section_offset,
            reader: LegReader { mode: None },
            leg,
            began: Clock::START,
            low: None,
            last: 0.0,
            largest: 0.0,
            separation: 0.0,
            rows,
            given_up: None,
            looks: false,
            plain: 0,
            instants: None,
        }
    }

    /// The same motion from here on, differentiated by more.
    pub fn with<'b>(&self, of: &'b Differentiated, columns: Columns) -> Follower<'b> {
        let here = Here { columns, ..self.leg.here.clone() };
        let leg = SensitiveLeg { here, passed: Waypoints::default(), ..self.leg };
        Follower {
            of,
            // All of it is told.
            span: Span { window: Clock::START, sections: i64::MIN..i64::MAX, ..self.span },
            section_offset: self.section_offset,
            reader: LegReader { mode: None },
            leg,
            began: self.began,
            low: None,
            last: self.last,
            largest: self.largest,
            separation: self.separation,
            rows: Rows::default(),
            given_up: None,
            looks: false,
            plain: 0,
            instants: Some(Box::default()),
        }
    }

    /// Goes on where another one has come, so many drive periods later, from these columns.
    pub fn go_on_from(&mut self, other: &Follower, (columns, later): (Columns, i64)) {
        let then = |clock: Clock| Clock { period: clock.period + later, ..clock };
        self.began = then(other.began);
        let time = self.of.model.motion.drive.time(self.began);
        self.leg = SensitiveLeg { time, passed: Waypoints::default(), ..other.leg.clone() };
        let here = &mut self.leg.here;
        (here.clock, here.columns) = (then(here.clock), columns);
        here.departure.clock = then(here.departure.clock);
        (self.last, self.largest) = (other.last, other.largest);
        self.separation = other.separation;
    }

    /// Whether the flight from the start is in this state at an instant.
    pub fn leads_to(&self, clock: Clock, state: &State) -> bool {
        let there = self.of.state_at(&self.leg.here, clock);
        let near = |a: f64, b: f64| (a - b).abs() <= SAME_TIME * (1.0 + b.abs());
        near(there.x1, state.x1)
            && near(there.v1, state.v1)
            && near(there.x2, state.x2)
            && near(there.v2, state.v2)
    }

    /// Follows the motion to its next event.
    pub fn step(
        &mut self,
        source: &mut Source,
        passed: &mut Passed,
    ) -> Result<Step, SensitivityError> {
        let Some(next) = source.advance(&self.of.system, passed) else {
            return Err(self.other_motion(self.leg.here.clock));
        };
        let (event, hops) = next?;
        let over = event.clock() > self.span.end || matches!(event, Next::Other(Event::Stop(_)));
        self.leg.hops = hops;
        for (k, state) in passed.all.drain(..) {
            if self.span.sections.contains(&k) {
                let period = k - i64::from(self.section_offset > 0.0);
                let clock = Clock::new(period, self.section_offset);
                self.section(clock, &state)?;
                if let Some(instants) = &mut self.instants {
                    instants.sections.push(k);
                }
                if source.is_given_up() {
                    self.given_up = Some(clock);
                    return Ok(Step::Cancelled);
                }
            }
        }
        if let Next::Other(Event::Stop(stop)) = event
            && stop.clock < self.span.end
        {
            if stop.reason == StopReason::Interrupted {
                return Ok(Step::Cancelled);
            }
            if !self.span.is_made {
                return Err(self.other_motion(stop.clock));
            }
            self.span.end = stop.clock;
        }
        if over {
            self.keep_leg(self.span.end);
            return Ok(Step::Ends(self.at(self.span.end)?));
        }
        self.take(&event)?;
        Ok(Step::Goes)
    }

    /// Derivatives in the present leg, at a fixed time since the start.
    fn at(&mut self, clock: Clock) -> Result<Columns, SensitivityError> {
        let (columns, rates) = self.leg.at(self.of, clock, None)?;
        Ok(self.of.at_fixed_time(columns, &rates, clock))
    }

    fn section(&mut self, clock: Clock, state: &State) -> Result<(), SensitivityError> {
        let (mut columns, rates) = self.leg.at(self.of, clock, Some(state))?;
        // At a fixed phase: omega t = 2 pi k + the section's.
        if let Some(i) = self.of.place(By::DriveFrequency) {
            let later = -self.section_offset / self.of.system.drive_frequency;
            for (x, rate) in columns[i].iter_mut().zip(rates) {
                *x += rate * later;
            }
        }
        append(&columns, &mut self.rows.stroboscopic);
        Ok(())
    }

    /// Takes note of the leg that ends, if the window needs it.
    fn keep_leg(&mut self, end: Clock) {
        self.rows.legs.push(&self.leg);
        if let Some(instants) = &mut self.instants {
            instants.legs.push([self.began, end]);
        }
    }

    fn other_motion(&self, clock: Clock) -> SensitivityError {
        SensitivityError::OtherMotion { time: self.of.model.motion.drive.time(clock) }
    }

    fn take(&mut self, event: &Next) -> Result<(), SensitivityError> {
        let (clock, time) = (event.clock(), self.of.model.motion.drive.time(event.clock()));
        if let Some(reason) = one_sided(self.of, event, self.leg.here.departure.slope.is_none()) {
            self.mark((clock, time), reason);
        }
        self.rows.events += 1;
        if let Some(instants) = &mut self.instants {
            instants.events.push(clock);
        }
        self.rows.earlier += i64::from(clock < self.span.window);
        let event = match event {
            Next::Other(Event::Graze(_)) => return Ok(()),
            Next::Other(event) => event,
            Next::Impact(impact) if self.reader.mode.is_none() => return self.impact(impact, time),
            // Bodies part before they strike.
            Next::Impact(_) => return Err(self.other_motion(clock)),
        };
        if clock >= self.span.window {
            self.keep_leg(clock);
        }
        let here = &self.leg.here;
        let low = self.low.take();
        let low = match event {
            Event::Chatter(_) => Some(low.unwrap_or_else(|| Bounces::new(here, self.separation))),
            _ => None,
        };
        let mode = self.reader.mode;
        match self.reader.read(&self.of.system, event) {
            LegChange::Ends(leg, clock, state) => {
                let (columns, is_flat) = match low {
                    Some(low) => (self.of.chatter(low, here, (clock, &state))?, false),
                    None => self.of.passed(here, (leg, mode), (clock, &state))?,
                };
                self.leg.here = self.of.event(columns, clock, state);
                if is_flat {
                    self.rows.events -= 1;
                    self.mark((clock, time), OneSidedReason::ContactBorder);
                    self.rows.events += 1;
                }
            }
            LegChange::Begins(state) => self.begin_contact(clock, state)?,
            LegChange::Nothing | LegChange::Stops(_) => {}
        }
        (self.last, self.separation) = (0.0, 0.0);
        (self.leg.mode, self.leg.time, self.began) = (self.reader.mode, time, event.clock());
        self.leg.passed.forget();
        Ok(())
    }

    /// Derivatives are one-sided from the next event on; of several reasons the first one says it.
    fn mark(&mut self, (clock, time): (Clock, f64), reason: OneSidedReason) {
        if self.rows.one_sided.last().is_none_or(|last| last.time != time) {
            let mark = OneSided { index: self.rows.events, time, reason };
            note(&mut self.rows.one_sided, mark, clock < self.span.window);
            if let Some(instants) = &mut self.instants {
                instants.marks.push(clock);
            }
        }
    }

    fn impact(&mut self, impact: &FollowedImpact, time: f64) -> Result<(), SensitivityError> {
        let u = impact.approach_velocity;
        self.largest = self.largest.max(u);
        // The impacts that lead into chatter are left to its leg (docs/theory.md, section 7).
        if u >= LOW_BOUNCE * self.largest || u >= self.last {
            self.low = None;
        } else if self.low.is_none() {
            self.low = Some(Bounces::new(&self.leg.here, self.separation));
        }
        self.last = u;
        // Tables of impacts have no more of the clock, which low bounces alone could tell.
        let clock = Clock::new(impact.clock.period, impact.clock.time_in_period);
        let clock = if self.low.is_none() { clock } else { impact.clock };
        let kept = impact.clock >= self.span.window;
        if kept {
            self.keep_leg(impact.clock);
        }
        let (before, separation) = self.of.strike(&mut self.leg.here, impact, clock)?;
        if let Some(low) = &mut self.low {
            low.take(self.of, impact, (&before, -separation), &self.leg.here);
        }
        self.separation = -separation;
        (self.leg.hops, self.leg.time, self.began) = (false, time, impact.clock);
        self.leg.passed.forget();
        if !kept {
            // Of those in the window the tables tell where they are lost.
            let is_lost = before.iter().any(|column| !column[3].is_finite());
            return if is_lost { Err(SensitivityError::Overflow { time }) } else { Ok(()) };
        }
        if let Some(instants) = &mut self.instants {
            instants.impacts.push(impact.clock);
        }
        let here = &self.leg.here;
        let late = self.of.late();
        let rows = &mut self.rows;
        if self.looks {
            rows.impacts.push((clock.period, time));
        }
        let rate = clock.period as f64 * self.of.period_rate();
        let times = before.iter().map(|column| column[3]).enumerate();
        rows.times.extend(times.map(|(i, dt)| if late == Some(i) { dt + rate } else { dt }));
        self.of.tell(here, &before, &mut rows.before);
        self.of.tell(here, &here.columns, &mut rows.after);
        Ok(())
    }

    /// Contact begins at an event that has just ended a flight, or at the start.
    fn begin_contact(&mut self, clock: Clock, state: State) -> Result<(), SensitivityError> {
        let drive = &self.of.model.motion.drive;
        // With all digits: of the same instant two events may have another last one in their tables.
        if drive.until(self.began, clock).value() > 0.0 {
            return Err(SensitivityError::Landing { time: drive.time(clock) });
        }
        if self.leg.here.departure.slope.is_some() {
            self.stay_closed(&state);
        }
        self.leg.here.state = state;
        Ok(())
    }

    /// Columns after an impact that ends in contact, where a number lets the bodies part: the bounces that
    /// then follow close the contact at once, by an impulse along the path of that impact.
    fn stay_closed(&mut self, state: &State) {
        let system = &self.of.system;
        let pre = PreImpact::new(system.contact, state);
        let contact = pre.coordinates(system.mass_ratio, system.friction);
        let slip_rate = match self.reader.mode {
            // A tip that sticks at a wall follows it wherever it moves.
            Some(ContactMode::Stick) if !contact.is_against_wall() => 0.0,
            mode => contact.slip_rate(mode.map_or(0.0, ContactMode::direction)),
        };
        let slows = contact.mobility + slip_rate * contact.coupling;
        if slows <= 0.0 {
            return;
        }
        let approach = self.of.approach(state);
        for column in &mut self.leg.here.columns {
            let impulse = approach(column) / slows;
            column[1] -= slip_rate * impulse;
            column[2] += contact.mobility * impulse;
        }
    }
}

impl<'a> Follows for Follower<'a> {
    type Source = Source<'a>;
    type Last = Columns;
    type Told = Told;

    fn follow(&mut self, source: &mut Source) -> Result<Option<Columns>, SensitivityError> {
        let mut passed = Passed { first: self.span.sections.start, all: Vec::new() };
        self.looks = matches!(source, Source::Made(_));
        loop {
            match self.step(source, &mut passed)? {
                Step::Goes => {}
                Step::Ends(columns) => return Ok(Some(columns)),
                Step::Cancelled => return Ok(None),
            }
            if self.plain > 0 {
                self.plain -= 1;
                continue;
            }
            let after_impact = self.leg.here.departure.slope.is_some() && self.leg.mode.is_none();
            let apart = after_impact && self.low.is_none();
            let Some((alike, times)) = source.alike(apart) else { continue };
            if times < FEWEST_ALIKE {
                continue;
            }
            match self.follow_alike((source, &mut passed), &alike)? {
                Step::Goes => {}
                Step::Ends(columns) => return Ok(Some(columns)),
                Step::Cancelled => return Ok(None),
            }
        }
    }

    fn told(mut self, last: Option<Columns>) -> Result<Told, SensitivityError> {
        let here = self.given_up.unwrap_or(self.leg.here.clock);
        let reached = |clock| self.of.model.motion.drive.time(clock);
        let until = last.is_none().then(|| self.given_up.map_or(self.leg.time, reached));
        let last = if let Some(columns) = last {
            columns
        } else {
            self.keep_leg(here);
            self.at(here)?
        };
        Ok(Told { rows: self.rows, looks: self.looks, last, until })
    }
}

impl Differentiated {
    /// Derivatives at a fixed time since the start from those at a fixed time in a fixed period.
    pub fn at_fixed_time(&self, mut columns: Columns, rates: &Column, clock: Clock) -> Columns {
        if let Some(i) = self.place(By::DriveFrequency) {
            let later = -(clock.period as f64) * self.period_rate();
            for (x, rate) in columns[i].iter_mut().zip(rates) {
                *x += rate * later;
            }
        }
        columns
    }

    /// The place of the drive's frequency, with which the times of all drive periods change.
    pub fn late(&self) -> Option<usize> {
        self.place(By::DriveFrequency)
    }

    /// The place of a number among those that are differentiated by.
    fn place(&self, by: By) -> Option<usize> {
        self.by.iter().position(|&other| other == by)
    }

    /// Appends rows x1, x1', x2, x2' at an event, from columns of (x1, x1', x2', t).
    fn tell(&self, here: &Here, columns: &[Column], rows: &mut SensitivityTable) {
        let slope = here.departure.slope.unwrap_or(0.0);
        rows.extend(columns.iter().map(|column| column[0]));
        rows.extend(columns.iter().map(|column| column[1]));
        let places = columns.iter().zip(&self.by);
        rows.extend(places.map(|(column, &by)| slope * column[0] - moves_stop(by)));
        rows.extend(columns.iter().map(|column| column[2]));
    }
}

/// Appends rows x1, x1', x2, x2' with a number of each column.
pub(super) fn append(columns: &[Column], rows: &mut impl Extend<f64>) {
    for row in [0, 1, 3, 2] {
        rows.extend(columns.iter().map(|column| column[row]));
    }
}
