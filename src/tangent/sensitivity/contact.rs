//! Derivatives through complete chatter and contact phases: those of their legs by where they start,
//! and by two parameters at a time.

use super::by::By;
use super::columns::{Column, Columns, Differentiated, Here};
use super::error::SensitivityError;
use crate::contact::sustained::ContactMode;
use crate::model::state::{Clock, State};
use crate::numerics::dual::Number;
use crate::tangent::itinerary::{Leg, StickEnd};
use crate::tangent::tolerances::AT_BORDER;
use crate::tangent::{
    Dual, DualState, END, FREE, Model, Moment, mode as slide_mode, on_contact, slide, traverse,
};

/// Parameters that are differentiated by at a time.
const AT_ONCE: usize = 2;

/// What the derivatives of a leg are applied to: columns, each with the direction of its parameter.
type Part = Vec<(usize, Option<usize>)>;

impl Differentiated {
    /// Systems that carry derivatives by parameters, until all columns have had theirs.
    fn parts(&self) -> Vec<(Model, Part)> {
        let (parameters, starts): (Vec<usize>, Vec<usize>) =
            (0..self.by.len()).partition(|&i| !matches!(self.by[i], By::Start(_)));
        let mut parts: Vec<Part> = parameters
            .chunks(AT_ONCE)
            .map(|part| part.iter().enumerate().map(|(j, &i)| (i, Some(FREE + j))).collect())
            .collect();
        if parts.is_empty() {
            parts.push(Part::new());
        }
        parts[0].extend(starts.iter().map(|&i| (i, None)));
        let model = |part: Part| {
            let names = part.iter().filter(|(_, direction)| direction.is_some());
            let free: Vec<String> = names.map(|&(i, _)| self.names[i].clone()).collect();
            (Model::new(&self.system, &free, false), part)
        };
        parts.into_iter().map(model).collect()
    }

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
        let mut columns = Columns::from_elem([0.0; 4], self.by.len());
        let (mut is_flat, ends) = (false, leg != Leg::Chatter);
        for (model, part) in self.parts() {
            let (start, from) = start(&model, here, mode);
            let time = Dual::variable(clock.time_in_period, END);
            let end = Moment { period: clock.period, time };
            let outcome = traverse(&model, leg, &start, &from, &end).ok_or_else(|| {
                SensitivityError::NoDerivative { time: model.motion.drive.time(clock) }
            })?;
            let condition = &outcome.condition;
            is_flat = ends && condition.slope[END].abs() <= AT_BORDER * self.changes(state, clock);
            let [x1, v1, v2] = &outcome.image;
            for (i, direction) in part {
                let along = |dual: &Dual| along(dual, &here.columns[i], direction);
                let delay = -along(condition) / condition.slope[END];
                let row = |dual: &Dual| along(dual) + dual.slope[END] * delay;
                columns[i] = [row(x1), row(v1), row(v2), delay];
            }
        }
        Ok((columns, is_flat))
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
        let (mut columns, mut rates) = (Columns::from_elem([0.0; 4], self.by.len()), [0.0; 4]);
        for (model, part) in self.parts() {
            let (start, from) = start(&model, here, Some(mode));
            let time = Dual::variable(clock.time_in_period, END);
            let end = Moment { period: clock.period, time };
            let s = model.elapsed(&from, &end);
            let DualState { x1, v1, x2, v2 } = match mode {
                ContactMode::Stick => start,
                _ => slide(&model, &start, mode, &from, s).ok_or_else(|| {
                    SensitivityError::NoDerivative { time: model.motion.drive.time(clock) }
                })?,
            };
            let rows = [x1, v1, v2, x2];
            rates = rows.map(|row| row.slope[END]);
            for (i, direction) in part {
                columns[i] = rows.map(|row| along(&row, &here.columns[i], direction));
            }
        }
        Ok((columns, rates))
    }
}

/// The derivative of a number by what a column is of.
fn along(dual: &Dual, column: &Column, direction: Option<usize>) -> f64 {
    let by_start: f64 = column.iter().zip(&dual.slope).map(|(x, slope)| x * slope).sum();
    by_start + direction.map_or(0.0, |direction| dual.slope[direction])
}

/// Where a leg starts, with derivatives by the components of the columns there.
fn start(model: &Model, here: &Here, mode: Option<ContactMode>) -> (DualState, Moment) {
    let state = here.state;
    let rest = Dual::constant(0.0);
    let x1 = Dual::variable(state.x1, 0);
    let v1 = if mode == Some(ContactMode::Stick) { rest } else { Dual::variable(state.v1, 1) };
    let time = here.clock.time_in_period;
    if here.departure.slope.is_none() {
        let moment = Moment { period: here.clock.period, time: Dual::constant(time) };
        let apart = || DualState {
            x1,
            v1,
            x2: Dual::variable(state.x2, 3),
            v2: Dual::variable(state.v2, 2),
        };
        return (mode.map_or_else(apart, |_| on_contact(model, x1, v1)), moment);
    }
    let moment = Moment { period: here.clock.period, time: Dual::variable(time, 3) };
    let apart =
        || DualState { x1, v1, x2: model.contact_place(x1), v2: Dual::variable(state.v2, 2) };
    (mode.map_or_else(apart, |_| on_contact(model, x1, v1)), moment)
}
