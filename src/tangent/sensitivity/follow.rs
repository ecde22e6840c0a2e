//! The motion of a run again, event by event, with its derivatives.

use std::ops::Range;

use super::by::By;
use super::columns::{Column, Columns, Differentiated, Here, moves_stop};
use super::error::SensitivityError;
use super::marks::{OneSided, OneSidedReason, one_sided};
use super::source::{Passed, Source};
use crate::contact::sustained::ContactMode;
use crate::model::state::{Clock, State};
use crate::simulate::event::{Event, ImpactEvent, StopReason};
use crate::simulate::{Anchor, impacts_hop_by_hop};
use crate::tangent::itinerary::{Leg, LegChange, LegReader};
use crate::tangent::strike::Departure;
use crate::tangent::tolerances::{LOW_BOUNCE, SAME_TIME};

/// What the bodies do from here to the next event.
#[derive(Debug, Clone)]
pub(super) struct SensitiveLeg {
    pub here: Here,
    pub mode: Option<ContactMode>,
    /// Impacts are skipped.
    pub hops: bool,
    pub time: f64,
}

/// The legs of a window, with memory for no more columns than there are.
#[derive(Default)]
pub(super) struct KeptLegs {
    legs: Vec<KeptLeg>,
    /// Of each.
    columns: Vec<Column>,
}

struct KeptLeg {
    state: State,
    departure: Departure,
    mode: Option<ContactMode>,
    hops: bool,
    time: f64,
}

impl KeptLegs {
    fn with_capacity(legs: usize, columns: usize) -> Self {
        Self { legs: Vec::with_capacity(legs), columns: Vec::with_capacity(legs * columns) }
    }

    fn push(&mut self, leg: &SensitiveLeg) {
        let &SensitiveLeg { ref here, mode, hops, time } = leg;
        self.columns.extend_from_slice(&here.columns);
        self.legs.push(KeptLeg { state: here.state, departure: here.departure, mode, hops, time });
    }

    /// The last leg that begins not later than a time.
    pub fn at(&self, time: f64, of: &Differentiated) -> SensitiveLeg {
        let place = self.legs.partition_point(|leg| leg.time <= time).max(1) - 1;
        let &KeptLeg { state, departure, mode, hops, time } = &self.legs[place];
        let width = self.columns.len() / self.legs.len();
        let columns = Columns::from_slice(&self.columns[place * width..][..width]);
        let clock = departure.clock;
        let here = Here { state, clock, trig: of.model.trig(clock), departure, columns };
        SensitiveLeg { here, mode, hops, time }
    }
}

/// Tables of derivatives, of the window and of what comes before it in the same drive period.
#[derive(Default)]
pub(super) struct Rows {
    /// Drive period and time of the impacts.
    pub impacts: Vec<(i64, f64)>,
    pub times: Vec<f64>,
    pub before: Vec<f64>,
    pub after: Vec<f64>,
    pub stroboscopic: Vec<f64>,
    pub legs: KeptLegs,
    pub one_sided: Vec<OneSided>,
    /// Events so far, and those before the window.
    pub events: i64,
    pub earlier: i64,
}

/// Follows a motion.
pub(super) struct Follower<'a> {
    pub of: &'a Differentiated,
    /// What comes before is not recorded.
    window: Clock,
    /// Where the run ends.
    end: Clock,
    pub section_offset: f64,
    /// Numbers of the sections that are recorded.
    sections: Range<i64>,
    reader: LegReader,
    leg: SensitiveLeg,
    /// Where a chatter begins that the last impacts may lead into, before the first low one.
    before_low: Option<Here>,
    /// u of the last impact, and the largest so far.
    last: f64,
    largest: f64,
    pub rows: Rows,
}

impl<'a> Follower<'a> {
    pub fn new(
        of: &'a Differentiated,
        initial: State,
        (window, end): (Clock, Clock),
        (sections, section_phase): (Range<i64>, f64),
        impacts: usize,
    ) -> Self {
        let k = of.by.len();
        let rows = Rows {
            impacts: Vec::with_capacity(impacts),
            times: Vec::with_capacity(k * impacts),
            before: Vec::with_capacity(4 * k * impacts),
            after: Vec::with_capacity(4 * k * impacts),
            stroboscopic: Vec::with_capacity(4 * k * sections.clone().count()),
            legs: KeptLegs::with_capacity(impacts + 1, k),
            ..Rows::default()
        };
        let section_offset =
            if section_phase > 0.0 { section_phase / of.system.drive_frequency } else { 0.0 };
        let here = of.start(initial, Clock::START);
        let leg = SensitiveLeg { here, mode: None, hops: false, time: 0.0 };
        Self {
            of,
            window,
            end,
            section_offset,
            sections,
            reader: LegReader { mode: None },
            leg,
            before_low: None,
            last: 0.0,
            largest: 0.0,
            rows,
        }
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

    /// Follows events to the end of the run; returns the derivatives of the state there, or nothing
    /// if the caller has cancelled.
    pub fn follow(&mut self, mut source: Source) -> Result<Option<Columns>, SensitivityError> {
        let mut passed = Passed::default();
        loop {
            let event = match source.advance(&mut passed) {
                Some(event) => event?,
                None => return Err(self.other_motion(self.leg.here.clock)),
            };
            let over = event.clock() > self.end || matches!(event, Event::Stop(_));
            if let Event::Stop(stop) = event
                && stop.clock < self.end
            {
                let cancelled = stop.reason == StopReason::Interrupted;
                return if cancelled { Ok(None) } else { Err(self.other_motion(stop.clock)) };
            }
            self.leg.hops = matches!(event, Event::Chatter(_)) || source.skips_at(&event);
            for (k, state) in passed.0.drain(..) {
                if self.sections.contains(&k) {
                    let period = k - i64::from(self.section_offset > 0.0);
                    self.section(Clock::new(period, self.section_offset), &state)?;
                }
            }
            if over {
                self.keep_leg();
                return Ok(Some(self.at(self.end)?));
            }
            self.take(&event)?;
        }
    }

    /// Derivatives in the present leg, at a fixed time since the start.
    fn at(&self, clock: Clock) -> Result<Columns, SensitivityError> {
        let (columns, rates) = self.leg.at(self.of, clock, None)?;
        Ok(self.of.at_fixed_time(columns, &rates, clock))
    }

    /// The time of the last event so far,
    pub fn reached(&self) -> f64 {
        self.leg.time
    }

    /// and the derivatives there.
    pub fn so_far(&mut self) -> Result<Columns, SensitivityError> {
        self.keep_leg();
        self.at(self.leg.here.clock)
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
    fn keep_leg(&mut self) {
        self.rows.legs.push(&self.leg);
    }

    fn other_motion(&self, clock: Clock) -> SensitivityError {
        SensitivityError::OtherMotion { time: self.of.model.motion.drive.time(clock) }
    }

    fn take(&mut self, event: &Event) -> Result<(), SensitivityError> {
        let (clock, time) = (event.clock(), self.of.model.motion.drive.time(event.clock()));
        if let Some(reason) = one_sided(self.of, event, self.leg.here.departure.slope.is_none()) {
            self.mark(time, reason);
        }
        self.rows.events += 1;
        self.rows.earlier += i64::from(clock < self.window);
        if let Event::Graze(_) = event {
            return Ok(());
        }
        if let (Event::Impact(impact), None) = (event, self.reader.mode) {
            return self.impact(impact, time);
        }
        if clock >= self.window {
            self.keep_leg();
        }
        if let Event::Chatter(_) = event {
            let start = self.before_low.take().unwrap_or_else(|| self.leg.here.clone());
            self.leg.here = start;
        }
        let mode = self.reader.mode;
        match self.reader.read(&self.of.system, event) {
            LegChange::Ends(leg, clock, state) => {
                let here = &self.leg.here;
                let accumulated = match leg {
                    Leg::Chatter => self.of.accumulated(here, clock, &state)?,
                    _ => None,
                };
                let (columns, is_flat) = match accumulated {
                    Some(columns) => (columns, false),
                    None => self.of.passed(here, (leg, mode), (clock, &state))?,
                };
                self.leg.here = self.of.event(columns, clock, state);
                if is_flat {
                    self.rows.events -= 1;
                    self.mark(time, OneSidedReason::ContactBorder);
                    self.rows.events += 1;
                }
            }
            LegChange::Begins(state) => self.begin_contact(clock, state)?,
            LegChange::Nothing | LegChange::Stops(_) => {}
        }
        (self.before_low, self.last) = (None, 0.0);
        (self.leg.mode, self.leg.time) = (self.reader.mode, time);
        Ok(())
    }

    /// Derivatives are one-sided from the next event on; of several reasons the first one says it.
    fn mark(&mut self, time: f64, reason: OneSidedReason) {
        if self.rows.one_sided.last().is_none_or(|last| last.time != time) {
            self.rows.one_sided.push(OneSided { index: self.rows.events, time, reason });
        }
    }

    fn impact(&mut self, impact: &ImpactEvent, time: f64) -> Result<(), SensitivityError> {
        let u = impact.impact.approach_velocity;
        self.largest = self.largest.max(u);
        // The impacts that lead into chatter are left to its leg (docs/theory.md, section 7).
        if u >= LOW_BOUNCE * self.largest || u >= self.last {
            self.before_low = None;
        } else if self.before_low.is_none() {
            self.before_low = Some(self.leg.here.clone());
        }
        self.last = u;
        // Tables of impacts have no more of the clock, which low bounces alone could tell.
        let clock = Clock::new(impact.clock.period, impact.clock.time_in_period);
        let clock = if self.before_low.is_none() { clock } else { impact.clock };
        let kept = impact.clock >= self.window;
        if kept {
            self.keep_leg();
        }
        let before = self.of.strike(&mut self.leg.here, impact, clock)?;
        (self.leg.hops, self.leg.time) = (false, time);
        if !kept {
            return Ok(());
        }
        let here = &self.leg.here;
        let late = self.of.place(By::DriveFrequency);
        let rows = &mut self.rows;
        rows.impacts.push((clock.period, time));
        let rate = clock.period as f64 * self.of.period_rate();
        let times = before.iter().map(|column| column[3]).enumerate();
        rows.times.extend(times.map(|(i, dt)| if late == Some(i) { dt + rate } else { dt }));
        self.of.tell(here, &before, &mut rows.before);
        self.of.tell(here, &here.columns, &mut rows.after);
        Ok(())
    }

    /// Contact begins at an event that has just ended a flight, or at the start.
    fn begin_contact(&mut self, clock: Clock, state: State) -> Result<(), SensitivityError> {
        let here = &mut self.leg.here;
        let drive = &self.of.model.motion.drive;
        // An impact has lost what its table does not tell.
        let [before, now] =
            [here.clock, clock].map(|clock| Clock::new(clock.period, clock.time_in_period));
        if drive.until(before, now).value() > 0.0 {
            return Err(SensitivityError::Landing { time: drive.time(clock) });
        }
        here.state = state;
        Ok(())
    }
}

impl SensitiveLeg {
    /// Derivatives of the state at a fixed instant of this leg, and its rates there; `known`: that state.
    pub fn at(
        &self,
        of: &Differentiated,
        clock: Clock,
        known: Option<&State>,
    ) -> Result<(Columns, Column), SensitivityError> {
        if let Some(mode) = self.mode {
            return of.held(&self.here, mode, clock);
        }
        if self.hops && clock > self.here.clock {
            let mut here = self.here.clone();
            let anchor = Anchor::after_impact(here.clock, here.state);
            for event in impacts_hop_by_hop(&of.system, anchor, clock) {
                if let Event::Impact(impact) = event {
                    of.strike(&mut here, &impact, impact.clock)?;
                }
            }
            return of.at(&here, clock, known);
        }
        of.at(&self.here, clock, known)
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

    /// The place of a number among those that are differentiated by.
    fn place(&self, by: By) -> Option<usize> {
        self.by.iter().position(|&other| other == by)
    }

    /// Appends rows x1, x1', x2, x2' at an event, from columns of (x1, x1', x2', t).
    fn tell(&self, here: &Here, columns: &[Column], rows: &mut Vec<f64>) {
        let slope = here.departure.slope.unwrap_or(0.0);
        rows.extend(columns.iter().map(|column| column[0]));
        rows.extend(columns.iter().map(|column| column[1]));
        let places = columns.iter().zip(&self.by);
        rows.extend(places.map(|(column, &by)| slope * column[0] - moves_stop(by)));
        rows.extend(columns.iter().map(|column| column[2]));
    }
}

/// Appends rows x1, x1', x2, x2' with a number of each column.
pub(super) fn append(columns: &[Column], rows: &mut Vec<f64>) {
    for row in [0, 1, 3, 2] {
        rows.extend(columns.iter().map(|column| column[row]));
    }
}
