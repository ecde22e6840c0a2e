//! Derivatives through contact phases: those of their legs along some columns at a time.

use std::sync::OnceLock;

use super::columns::{Column, Columns, Differentiated, Here};
use super::error::SensitivityError;
use super::models::models;
use crate::contact::sustained::ContactMode;
use crate::model::state::{Clock, State};
use crate::numerics::dual::{Dual, Number};
use crate::tangent::itinerary::{Leg, StickEnd};
use crate::tangent::tolerances::AT_BORDER;
use crate::tangent::{
    DualState, Model, Moment, free_gap_acceleration, mode as slide_mode, on_contact,
    slide_with_rates, stick_end,
};

/// x1, x1', x2' after a leg and what is zero where it ends: along columns, for an end at a fixed time.
type AtEnd<const N: usize> = [Dual<N>; 4];

/// The end of a leg, and the rates of all that with its time.
type End<const N: usize> = (AtEnd<N>, [f64; 4]);

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

    /// Derivatives of x1, x1', x2' and the time after the event that ends a leg of contact from here, in
    /// this state; and whether what ends it does so without a rate, to rounding.
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
        let found = if self.by.len() == 1 {
            self.along(&passage, &self.contact.one, |model, start, from, end| {
                self.contact_ends(model, leg, (start, from), end)
            })
        } else {
            self.along(&passage, &self.contact.few, |model, start, from, end| {
                self.contact_ends(model, leg, (start, from), end)
            })
        };
        let (columns, rate) = found.ok_or_else(|| self.no_derivative(here, clock))?;
        Ok((columns, rate.abs() <= AT_BORDER * self.changes(state, clock)))
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
            let ([x1, v1, v2, condition], rates) = leg(model, &start, &from, &moment(clock))?;
            rate = rates[3];
            let count = N.min(self.by.len() - first);
            columns.extend((0..count).map(|i| {
                let delay = -condition.slope[i] / rate;
                let row = |dual: &Dual<N>, rate: f64| dual.slope[i] + rate * delay;
                [row(&x1, rates[0]), row(&v1, rates[1]), row(&v2, rates[2]), delay]
            }));
        }
        Some((columns, rate))
    }

    pub fn no_derivative(&self, before: &Here, clock: Clock) -> SensitivityError {
        let largest = before.columns.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
        SensitivityError::NoDerivative { time: self.model.motion.drive.time(clock), largest }
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
        found.ok_or_else(|| self.no_derivative(here, clock))
    }

    fn held_along<const N: usize>(
        &self,
        (here, mode, clock): (&Here, ContactMode, Clock),
        made: &OnceLock<Vec<Model<N>>>,
    ) -> Option<(Columns, Column)> {
        let (mut columns, mut rates) = (Columns::with_capacity(self.by.len()), [0.0; 4]);
        for (model, first) in models(made, &self.system, &self.names) {
            let (start, from) = start(model, here, Some(mode), first);
            let s = model.elapsed(&from, &moment(clock));
            let DualState { x1, v1, x2, v2 } = if mode == ContactMode::Stick {
                start
            } else {
                let (there, along) = slide_with_rates(model, &start, mode, &from, s)?;
                let DualState { x1, v1, v2, x2 } = self.moving(&there, along);
                rates = [x1, v1, v2, x2].map(|row| row.slope[0]);
                there
            };
            let rows = [x1, v1, v2, x2];
            let count = N.min(self.by.len() - first);
            columns.extend((0..count).map(|i| rows.map(|row| row.slope[i])));
        }
        Some((columns, rates))
    }

    /// The end of a leg of contact.
    fn contact_ends<const N: usize>(
        &self,
        model: &Model<N>,
        leg: Leg,
        (start, from): (&DualState<N>, &Moment<N>),
        end: &Moment<N>,
    ) -> Option<End<N>> {
        let stop = Dual::constant(0.0);
        let by_time = self.contact.by_time(&self.system);
        let time = Dual::variable(end.time.value, 0);
        let later = Moment { period: end.period, time };
        match leg {
            Leg::SlideToRelease(positive) | Leg::SlideToStop(positive) => {
                let (mode, s) = (slide_mode(positive), model.elapsed(from, end));
                let (there, along) = slide_with_rates(model, start, mode, from, s)?;
                if matches!(leg, Leg::SlideToStop(_)) {
                    let [rate, stops] = along;
                    return Some(([there.x1, stop, stop, there.v1], [rate, 0.0, 0.0, stops]));
                }
                let DualState { x1, v1, v2, .. } = there;
                let force = free_gap_acceleration(model, &there, end);
                let moving = self.moving(&there, along);
                let fall = free_gap_acceleration(by_time, &moving, &later);
                let rates = [moving.x1, moving.v1, moving.v2, fall].map(|row| row.slope[0]);
                Some(([x1, v1, v2, force], rates))
            }
            Leg::Stick(how) => {
                let ends = stick_end(model, start, end, how);
                let rests = self.moving(start, [0.0; 2]);
                let [rate] = stick_end(by_time, &rests, &later, how).slope;
                Some(([start.x1, stop, stop, ends], [0.0, 0.0, 0.0, rate]))
            }
            Leg::Impact(..) | Leg::Chatter | Leg::Circuit => None,
        }
    }

    /// A state on the contact whose x1 and x1' have these rates, with its derivatives by time.
    fn moving<const N: usize>(&self, state: &DualState<N>, rates: [f64; 2]) -> DualState<1> {
        let [x1, v1] = [(state.x1, rates[0]), (state.v1, rates[1])]
            .map(|(x, rate)| Dual { value: x.value, slope: [rate] });
        on_contact(self.contact.by_time(&self.system), x1, v1)
    }
}

/// An instant that stays where it is.
fn moment<const N: usize>(clock: Clock) -> Moment<N> {
    Moment { period: clock.period, time: Dual::constant(clock.time_in_period) }
}

/// Where a leg starts, with derivatives along the columns there from this one on.
pub(super) fn start<const N: usize>(
    model: &Model<N>,
    here: &Here,
    mode: Option<ContactMode>,
    first: usize,
) -> (DualState<N>, Moment<N>) {
    let State { x1, v1, x2, v2 } = here.state;
    let along = |value: f64, component: usize| {
        let mut dual = Dual::constant(value);
        for (slope, column) in dual.slope.iter_mut().zip(&here.columns[first..]) {
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
