//! The trace of a run for a file: what of it does not follow from the tables.

use serde::{Deserialize, Serialize};

use super::Run;
use super::recorded::Recorded;
use super::trace::{Begins, Copies, Trace, TracedLeg};
use crate::model::error::ParameterError;
use crate::model::state::{Clock, ModelState};
use crate::simulate::event::EventKind;
use crate::simulate::{Anchor, AnchorOf, Phase};

/// A trace without its residuals.
#[derive(Serialize, Deserialize)]
#[serde(bound = "")]
pub(crate) struct Noted<M: Recorded> {
    copies: Vec<Copies>,
    legs: Option<Vec<NotedLeg<M>>>,
}

/// A leg that its event does not tell; see [`TracedLeg`].
#[derive(Serialize, Deserialize)]
#[serde(bound = "")]
struct NotedLeg<M: Recorded> {
    events: usize,
    /// `None`: the impact follows from its row.
    begins: Begins<Option<M::Impact>>,
    /// Where it begins, unless that is where its event ends or, without one, where the leg before it
    /// in this list begins.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    at: Option<(Clock, M::State)>,
    phase: Phase<M::Mode>,
    touching: M::Touching,
    skips: bool,
}

impl<M: Recorded> Run<M> {
    /// The trace of a run that has kept all of its events, and its residuals.
    pub(crate) fn noted(&self) -> Option<(Noted<M>, &[f64])> {
        if self.whole_from().is_none() || !self.is_traced() {
            return None;
        }
        let legs = self.trace.legs.as_deref().map(|legs| {
            let before = std::iter::once(None).chain(legs.iter().map(|leg| Some(&leg.anchor)));
            legs.iter().zip(before).map(|(leg, before)| self.noted_leg(leg, before)).collect()
        });
        Some((Noted { copies: self.trace.copies.clone(), legs }, &self.trace.residuals))
    }

    fn noted_leg(&self, leg: &TracedLeg<M>, before: Option<&AnchorOf<M>>) -> NotedLeg<M> {
        let TracedLeg { events, begins, ref anchor, skips } = *leg;
        let Anchor { clock, ref state, phase, ref touching } = *anchor;
        let is_known = self
            .told(events, begins.is_silent(), before)
            .is_some_and(|(at, known)| at == clock && known.bits() == state.bits());
        let at = (!is_known).then(|| (clock, state.clone()));
        let begins = match begins {
            Begins::WithImpact(impact) => {
                Begins::WithImpact(Some(impact).filter(|_| self.resolved(events) != Some(impact)))
            }
            Begins::WithContact => Begins::WithContact,
            Begins::Silently => Begins::Silently,
        };
        NotedLeg { events, begins, at, phase, touching: touching.clone(), skips }
    }

    /// What the impact of an event does, as its row tells.
    fn resolved(&self, event: usize) -> Option<M::Impact> {
        let event =
            self.events.get(event).filter(|event| event.kind == EventKind::Impact as i64)?;
        self.system.resolved(self.impacts.get(usize::try_from(event.index).ok()?)?)
    }

    /// Where a leg begins, as the tables or the leg before it tell.
    fn told(
        &self,
        events: usize,
        silently: bool,
        before: Option<&AnchorOf<M>>,
    ) -> Option<(Clock, M::State)> {
        if silently {
            return before.map(|leg| (leg.clock, leg.state.clone()));
        }
        let (event, &residual) = (self.events.get(events)?, self.trace.residuals.get(events)?);
        let leg = M::leg_after(self, event, &self.window_anchor)?;
        Some((Clock { residual, ..leg.clock }, leg.state))
    }

    /// The run with the trace of a file.
    ///
    /// # Errors
    /// [`ParameterError`]: it is that of another run.
    pub(crate) fn with_noted(
        mut self,
        noted: Noted<M>,
        residuals: Vec<f64>,
    ) -> Result<Self, ParameterError> {
        self.check_rows()?;
        let Noted { copies, legs } = noted;
        self.trace = Trace { residuals, copies, ..Trace::default() };
        if !self.is_traced() || !self.trace.residuals.iter().all(|rest| rest.is_finite()) {
            let value = format!("{} numbers", self.trace.residuals.len());
            let allowed = format!("a number for each of {} events", self.events.len());
            return Err(ParameterError::new("residuals", value, allowed));
        }
        self.check_copies()?;
        let copied = |copies: &Copies| (copies.times * copies.events) as u64;
        self.trace.repeated = self.trace.copies.iter().map(copied).sum();
        let Some(noted) = legs else { return Ok(self) };
        let mut legs: Vec<TracedLeg<M>> = Vec::with_capacity(noted.len());
        for (place, leg) in noted.into_iter().enumerate() {
            let before = legs.last();
            let NotedLeg { events, begins, at, phase, touching, skips } = leg;
            let known = self.told(events, begins.is_silent(), before.map(|leg| &leg.anchor));
            let follows = before.is_none_or(|leg| leg.events <= events);
            let known = at.or(known).filter(|_| follows && events < self.events.len());
            let begins = match begins {
                Begins::Silently => Some(Begins::Silently),
                Begins::WithContact => Some(Begins::WithContact),
                Begins::WithImpact(impact) => {
                    impact.or_else(|| self.resolved(events)).map(Begins::WithImpact)
                }
            };
            let leg = known.zip(begins).map(|((clock, state), begins)| {
                let anchor = Anchor { clock, state, phase, touching };
                TracedLeg { events, begins, anchor, skips }
            });
            let is_of_model = |leg: &TracedLeg<M>| {
                let impact = match &leg.begins {
                    Begins::WithImpact(impact) => Some(impact),
                    _ => None,
                };
                self.system.has_leg(&leg.anchor, impact)
            };
            let Some(leg) = leg.filter(is_of_model) else {
                let name = format!("legs[{place}]");
                let allowed = "a leg after the one before it, with its start, of the run's machine";
                return Err(ParameterError::new(name, format!("after {events} events"), allowed));
            };
            legs.push(leg);
        }
        self.trace.legs = Some(legs);
        Ok(self)
    }

    /// Each event has a row of its own, all in order, and the stop comes last.
    fn check_rows(&self) -> Result<(), ParameterError> {
        let [mut impacts, mut grazes, mut contacts] = [0; 3];
        for (place, event) in self.events.iter().enumerate() {
            let last = place + 1 == self.events.len();
            let next = if event.kind == EventKind::Impact as i64 {
                &mut impacts
            } else if event.kind == EventKind::Graze as i64 {
                &mut grazes
            } else if event.kind == EventKind::Stop as i64 && last && event.index == -1 {
                continue;
            } else {
                &mut contacts
            };
            if last || event.index != *next {
                let (name, value) = (format!("events[{place}]"), format!("{event:?}"));
                let allowed = "an event with the next row of its table, the stop as the last one";
                return Err(ParameterError::new(name, value, allowed));
            }
            *next += 1;
        }
        let tables = [self.impacts.len(), self.grazes.len(), self.contacts.len()];
        if [impacts, grazes, contacts].map(i64::unsigned_abs) != tables.map(|rows| rows as u64) {
            let value = format!("{tables:?} rows of impacts, grazes and contacts");
            return Err(ParameterError::new("events", value, "an event for each row"));
        }
        if !M::has_rows(self) {
            let allowed = "stops and coordinates of the run's machine";
            return Err(ParameterError::new("rows", "those of another one", allowed));
        }
        Ok(())
    }

    /// Copies repeat events before them, among all, one after the other.
    fn check_copies(&self) -> Result<(), ParameterError> {
        let mut from = 0;
        for (place, copies) in self.trace.copies.iter().enumerate() {
            let Copies { first, events, periods, times } = *copies;
            let end = times.checked_mul(events).and_then(|all| all.checked_add(first));
            let last = self.final_state.clock.period;
            let ends = periods.checked_mul(i64::try_from(times).unwrap_or(i64::MAX));
            let begins = from.max(events) <= first && events > 0 && periods > 0 && times > 0;
            let begins = begins && ends.is_some_and(|end| end <= last);
            let end = end.filter(|&end| begins && end <= self.trace.residuals.len());
            let Some(end) = end else {
                let (name, value) = (format!("copies[{place}]"), format!("{copies:?}"));
                let allowed = "copies of events before them, among those of the run";
                return Err(ParameterError::new(name, value, allowed));
            };
            from = end;
        }
        Ok(())
    }
}
