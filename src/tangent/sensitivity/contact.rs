//! Derivatives through contact phases: those of their legs along some columns at a time. Chatter whose
//! impacts are no smooth functions of u is a leg, too.

use std::sync::OnceLock;

use super::columns::{Column, Columns, Differentiated, Here};
use super::error::SensitivityError;
use super::models::{END, models};
use crate::contact::sustained::ContactMode;
use crate::model::state::{Clock, State};
use crate::numerics::dual::{Dual, Number};
use crate::tangent::itinerary::{Leg, StickEnd};
use crate::tangent::tolerances::AT_BORDER;
use crate::tangent::{
    DualState, Model, Moment, mode as slide_mode, on_contact, slide, slide_to_end, stick_end,
    traverse,
};

/// x1, x1', x2' after a leg, and what is zero where it ends.
type End<const N: usize> = ([Dual<N>; 3], Dual<N>);

/// What a leg does to columns.
struct Passage<'a> {
    here: &'a Here,
    mode: Option<ContactMode>,
    clock: Clock,
}

impl Differentiated {
    /// A slide in place of a stick at a wall, which a tip that sticks follows wherever it moves.
    fn slides_with_wall(&self, here: &Here) -> Option<bool> {
        let cos = self.system.contact.angle(here.state.x1).cos;
        self.system.is_wall().then_some(cos >= 0.0)
    }

    /// Derivatives of x1, x1', x2' and the time after the event that ends a leg from here, by chatter or
    /// contact, in this state; and whether what ends it does so without a rate, to rounding.
    pub fn passed(
        &self,
        here: &Here,
        (leg, mode): (Leg, Option<ContactMode>),
        (clock, state): (Clock, &State),
    ) -> Result<(Columns, bool), SensitivityError> {
        let leg = match (leg, self.slides_with_wall(here)) {
            (Leg::Stick(StickEnd::Release), Some(positive)) => Leg::SlideToRelease(positive),
            _ => leg,
        };
        let passage = Passage { here, mode, clock };
        let found = if leg == Leg::Chatter {
            self.along(&passage, &self.contact.chatter, |model, start, from, end| {
                let outcome = traverse(model, leg, start, from, end)?;
                Some((outcome.image, outcome.condition))
            })
        } else if self.by.len() == 1 {
            self.along(&passage, &self.contact.one, |model, start, from, end| {
                contact(model, leg, (start, from), end)
            })
        } else {
            self.along(&passage, &self.contact.few, |model, start, from, end| {
                contact(model, leg, (start, from), end)
            })
        };
        let (columns, rate) = found.ok_or_else(|| self.no_derivative(clock))?;
        let ends = leg != Leg::Chatter;
        Ok((columns, ends && rate.abs() <= AT_BORDER * self.changes(state, clock)))
    }

    /// The columns after a leg, and the rate of what ends it.
    fn along<const N: usize>(
        &self,
        &Passage { here, mode, clock }: &Passage,
        made: &OnceLock<Vec<Model<N>>>,
        leg: impl Fn(&Model<N>, &DualState<N>, &Moment<N>, &Moment<N>) -> Option<End<N>>,
    ) -> Option<(Columns, f64)> {
        let mut columns = Columns::with_capacity(self.by.len());
        let mut rate = f64::NAN;
        for (model, first) in models(made, &self.system, &self.names) {
            let (start, from) = start(model, here, mode, first);
            let time = Dual::variable(clock.time_in_period, END);
            let end = Moment { period: clock.period, time };
            let ([x1, v1, v2], condition) = leg(model, &start, &from, &end)?;
            rate = condition.slope[END];
            let count = (N - 1).min(self.by.len() - first);
            columns.extend((END + 1..).take(count).map(|i| {
                let delay = -condition.slope[i] / rate;
                let row = |dual: &Dual<N>| dual.slope[i] + dual.slope[END] * delay;
                [row(&x1), row(&v1), row(&v2), delay]
            }));
        }
        Some((columns, rate))
    }

    fn no_derivative(&self, clock: Clock) -> SensitivityError {
        SensitivityError::NoDerivative { time: self.model.motion.drive.time(clock) }
    }

    /// How fast accelerations change in this state, at most.
    fn changes(&self, state: &State, clock: Clock) -> f64 {
        let [a1, a2] = self.rates(state, clock).accelerations;
        (1.0 + self.fastest) * (a1.abs() + a2.abs())
    }

    /// Derivatives of the state at a fixed instant of a contact phase from here, and the rates of x1,
    /// x1', x2', x2 there.
    pub fn held(
        &self,
        here: &Here,
        mode: ContactMode,
        clock: Clock,
    ) -> Result<(Columns, Column), SensitivityError> {
        let mode = match (mode, self.slides_with_wall(here)) {
            (ContactMode::Stick, Some(positive)) => slide_mode(positive),
            _ => mode,
        };
        let found = if self.by.len() == 1 {
            self.held_along((here, mode, clock), &self.contact.one)
        } else {
            self.held_along((here, mode, clock), &self.contact.few)
        };
        found.ok_or_else(|| self.no_derivative(clock))
    }

    fn held_along<const N: usize>(
        &self,
        (here, mode, clock): (&Here, ContactMode, Clock),
        made: &OnceLock<Vec<Model<N>>>,
    ) -> Option<(Columns, Column)> {
        let (mut columns, mut rates) = (Columns::with_capacity(self.by.len()), [0.0; 4]);
        for (model, first) in models(made, &self.system, &self.names) {
            let (start, from) = start(model, here, Some(mode), first);
            let time = Dual::variable(clock.time_in_period, END);
            let end = Moment { period: clock.period, time };
            let s = model.elapsed(&from, &end);
            let DualState { x1, v1, x2, v2 } = match mode {
                ContactMode::Stick => start,
                _ => slide(model, &start, mode, &from, s)?,
            };
            let rows = [x1, v1, v2, x2];
            rates = rows.map(|row| row.slope[END]);
            let count = (N - 1).min(self.by.len() - first);
            columns.extend((END + 1..).take(count).map(|i| rows.map(|row| row.slope[i])));
        }
        Some((columns, rates))
    }
}

/// The end of a leg of contact.
fn contact<const N: usize>(
    model: &Model<N>,
    leg: Leg,
    (start, from): (&DualState<N>, &Moment<N>),
    end: &Moment<N>,
) -> Option<End<N>> {
    let stop = Dual::constant(0.0);
    match leg {
        Leg::SlideToRelease(positive) | Leg::SlideToStop(positive) => {
            let stops = matches!(leg, Leg::SlideToStop(_));
            let slid = slide_to_end(model, (start, from), end, (positive, stops))?;
            Some((slid.image, slid.condition))
        }
        Leg::Stick(how) => Some(([start.x1, stop, stop], stick_end(model, start, end, how))),
        Leg::Impact(..) | Leg::Chatter | Leg::Circuit => None,
    }
}

/// Where a leg starts, with derivatives along the columns there from this one on.
fn start<const N: usize>(
    model: &Model<N>,
    here: &Here,
    mode: Option<ContactMode>,
    first: usize,
) -> (DualState<N>, Moment<N>) {
    let State { x1, v1, x2, v2 } = here.state;
    let along = |value: f64, component: usize| {
        let mut dual = Dual::constant(value);
        let columns = here.columns[first..].iter().take(N - 1);
        for (slope, column) in dual.slope[END + 1..].iter_mut().zip(columns) {
            *slope = column[component];
        }
        dual
    };
    let rest = Dual::constant(0.0);
    let (x1, v1) =
        (along(x1, 0), if mode == Some(ContactMode::Stick) { rest } else { along(v1, 1) });
    let Clock { period, time_in_period, .. } = here.clock;
    let apart = here.departure.slope.is_none();
    let time = if apart { Dual::constant(time_in_period) } else { along(time_in_period, 3) };
    let state = if mode.is_some() {
        on_contact(model, x1, v1)
    } else {
        let x2 = if apart { along(x2, 3) } else { model.contact_place(x1) };
        DualState { x1, v1, x2, v2: along(v2, 2) }
    };
    (state, Moment { period, time })
}
