//! What follows a motion of a structure with its derivatives, and takes note of them.

use std::sync::Arc;

use nalgebra::{DMatrix, RowDVector};

use super::error::SensitivityError;
use super::marks::{OneSided, OneSidedReason, note};
use super::span::Span;
use super::structure_legs::{From, SensitiveLeg, tell};
use super::structure_source::Source;
use super::table::SensitivityTable;
use crate::model::state::Clock;
use crate::simulate::ModelEvent;
use crate::simulate::event::StopReason;
use crate::simulate::structure::StructureEvent;
use crate::tangent::structure::{Linearised, Perturbed, add_moved};
use crate::tangent::tolerances::FEW_PERIODS;

/// Tables of derivatives, of the window and of what comes before it in the same drive period.
#[derive(Default)]
pub(super) struct Rows {
    /// Drive period and time of the impacts.
    pub impacts: Vec<(i64, f64)>,
    pub times: SensitivityTable,
    pub before: SensitivityTable,
    pub after: SensitivityTable,
    pub stroboscopic: SensitivityTable,
    pub one_sided: Vec<OneSided>,
    pub events: i64,
    pub earlier: i64,
    /// Where the last chatter ended.
    pub chatter: Option<Clock>,
}

/// What a step of a motion has come to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Turn {
    /// The motion goes on.
    Over,
    /// The run ends in it.
    Last,
    /// The caller has cancelled the rest.
    Cancelled,
}

pub(super) struct Follower<'a> {
    pub of: &'a Arc<Linearised>,
    pub span: Span,
    pub section_offset: f64,
    pub derivatives: Perturbed,
    pub legs: Vec<SensitiveLeg>,
    pub rows: Rows,
    /// The section at which the caller has cancelled the rest of a leg.
    pub given_up: Option<Clock>,
    /// So many events are next that are followed one by one, even if they come again.
    pub plain: u64,
}

impl Follower<'_> {
    pub(super) fn other_motion(&self, clock: Clock) -> SensitivityError {
        SensitivityError::OtherMotion { time: self.of.drive().time(clock) }
    }

    /// A turn of the motion.
    pub(super) fn turn(&mut self, source: &mut Source) -> Result<Turn, SensitivityError> {
        let mut passed = Vec::new();
        let event = source.turn(&mut passed)?;
        for k in passed {
            if self.span.sections.contains(&k) {
                let period = k - i64::from(self.section_offset > 0.0);
                let clock = Clock::new(period, self.section_offset);
                self.section(clock)?;
                if source.is_given_up() {
                    self.given_up = Some(clock);
                    return Ok(Turn::Cancelled);
                }
            }
        }
        let stop = event.as_ref().and_then(ModelEvent::as_stop);
        let clock = event.as_ref().map(ModelEvent::clock);
        if stop.is_some() || clock.is_some_and(|clock| clock > self.span.end) {
            if let Some(stop) = stop
                && stop.clock < self.span.end
            {
                if stop.reason == StopReason::Interrupted {
                    return Ok(Turn::Cancelled);
                }
                if !self.span.is_made {
                    return Err(self.other_motion(stop.clock));
                }
                self.span.end = stop.clock;
            }
            return Ok(Turn::Last);
        }
        self.derivatives.pass_to(source.before(), source.anchor(), event.as_ref())?;
        if let Some(event) = &event
            && self.take(event)
        {
            let time = self.of.drive().time(event.clock());
            return Err(SensitivityError::Overflow { time });
        }
        if source.before() != source.anchor() || source.skips() {
            self.leg(source);
        }
        Ok(Turn::Over)
    }

    pub(super) fn at_end(&self) -> Result<DMatrix<f64>, SensitivityError> {
        let Some(last) = self.legs.last() else { return Err(self.other_motion(self.span.end)) };
        let cycled = last.cycled_at(self.of.drive(), f64::INFINITY);
        cycled.as_ref().unwrap_or(last).at_fixed_time(&self.derivatives, self.span.end)
    }

    /// Takes note of the leg that begins, if the window needs it.
    pub(super) fn leg(&mut self, source: &mut Source) {
        self.derivatives.expect_rest(source.may_land());
        let (anchor, hops) = (source.anchor(), source.skips());
        let clock = anchor.clock;
        if clock <= self.span.window {
            self.legs.clear();
        }
        let from = if source.lasts() {
            self.derivatives.settle(anchor);
            From::leg(anchor, self.derivatives.columns().clone())
        } else {
            let derivatives = &self.derivatives;
            let derivatives = if hops { derivatives.clone() } else { derivatives.kept() };
            From::Any(Box::new((anchor.clone(), derivatives)), hops)
        };
        self.legs.push(SensitiveLeg { time: self.of.drive().time(clock), clock, from });
    }

    pub(super) fn section(&mut self, clock: Clock) -> Result<(), SensitivityError> {
        let Some(leg) = self.legs.last() else { return Err(self.other_motion(clock)) };
        let there = leg.at(&self.derivatives, clock)?;
        if self.section_offset > 0.0 && self.of.turns() {
            // At a fixed phase: omega t = 2 pi k + the section's.
            let later = -self.section_offset / self.of.structure.drive_frequency();
            let faster = self.of.by.iter().map(|varied| varied.by.drive_frequency * later);
            let later = RowDVector::from_iterator(self.of.by.len(), faster);
            let anchor = leg.anchor();
            let from = self.of.leg_from(&anchor);
            let state = self.of.state_at(&from, clock);
            let mut columns = there.columns().clone();
            add_moved(&mut columns, &self.of.rates(&from, clock, &state), &later);
            tell(&columns, &mut self.rows.stroboscopic);
        } else {
            tell(there.columns(), &mut self.rows.stroboscopic);
        }
        let periods = clock.period - leg.clock.period;
        // Sections of short flights are reached from their start.
        let is_short = matches!(leg.from, From::Flight(..)) && periods < FEW_PERIODS;
        if !(is_short || leg.hops()) {
            // Longer flights go on from there.
            let time = self.of.drive().time(clock);
            let from = match leg.from {
                From::Flight(..) => {
                    let state = self.of.state_at(&leg.anchor(), clock);
                    From::Flight(state, there.into_matrix())
                }
                From::Contact(ref from, _) => From::Contact(from.clone(), there.into_matrix()),
                _ => From::Any(Box::new((leg.anchor(), there.kept())), false),
            };
            self.legs.push(SensitiveLeg { time, clock, from });
        }
        Ok(())
    }

    /// Takes note of an event; whether derivatives are lost at one before the window. Of those in it the
    /// tables tell where they are lost.
    fn take(&mut self, event: &StructureEvent) -> bool {
        if let Some(reason) = self.one_sided(event) {
            let time = self.of.drive().time(event.clock());
            let mark = OneSided { index: self.rows.events, time, reason };
            note(&mut self.rows.one_sided, mark, event.clock() < self.span.window);
        }
        self.rows.events += 1;
        self.rows.earlier += i64::from(event.clock() < self.span.window);
        if let StructureEvent::Chatter(chatter) = event {
            self.rows.chatter = Some(chatter.clock);
        }
        let StructureEvent::Impact(impact) = event else { return false };
        let mut is_lost = false;
        let (rows, kept) = (&mut self.rows, impact.clock >= self.span.window);
        self.derivatives.tell(|[before, after], delay| {
            if !kept {
                is_lost = delay.iter().any(|x| !x.is_finite());
                return;
            }
            rows.impacts.push((impact.clock.period, impact.time));
            match self.of.later(impact.clock.period) {
                Some(later) => rows.times.extend((delay + later).iter().copied()),
                None => rows.times.extend(delay.iter().copied()),
            }
            tell(before, &mut rows.before);
            tell(after, &mut rows.after);
        });
        is_lost
    }

    fn one_sided(&self, event: &StructureEvent) -> Option<OneSidedReason> {
        let at_start = self.rows.events == 0 && event.clock() == Clock::START;
        match event {
            StructureEvent::Graze(_) => Some(OneSidedReason::Graze),
            StructureEvent::Stop(_) => None,
            _ if at_start => Some(OneSidedReason::StartOnContact),
            StructureEvent::Impact(impact) if self.of.is_at_border(impact) => {
                Some(OneSidedReason::RegimeBorder)
            }
            StructureEvent::Impact(event) if self.of.is_at_knot(&event.impact) => {
                Some(OneSidedReason::RestitutionKnot)
            }
            StructureEvent::Closed(contact) => {
                let chattered = self.rows.chatter == Some(contact.clock);
                let at_border = self.of.is_at_border_of_contact(contact, chattered);
                let onset = at_border && chattered;
                let reason = onset.then_some(OneSidedReason::ChatterOnset);
                at_border.then(|| reason.unwrap_or(OneSidedReason::ContactBorder))
            }
            _ => None,
        }
    }
}
