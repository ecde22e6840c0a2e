//! The conditions of periodicity of a structure whose order of impacts is kept fixed, with their
//! exact derivatives (docs/theory.md, sections 8 and 12). Where that order is fixed, times and states
//! of the impacts are smooth functions of the parameters, so that a motion can be followed beyond
//! the place at which it ceases to be one.
//!
//! Unknowns are the nodes: q, q' and the time in the drive period just after each impact. A leg is
//! the flight from a node to the next impact; its equations are
//!
//! ```text
//! q- - q = 0,    q'+(q'-) - q' = 0,    g(q-, t) = 0
//! ```
//!
//! with q, q' and t of the next node. A motion without impacts has one node, q and q' at the start of
//! a drive period, and comes back to it.

mod by_parameter;
mod hump;
mod itinerary;
mod verdict;

pub use itinerary::{StopLeg, StructureItinerary};
pub use verdict::StructureRejection;

use std::sync::{Arc, OnceLock};

use nalgebra::{DMatrix, DVector};

use by_parameter::Response;

use crate::analysis::tolerances::NEGATIVE_LEG;
use crate::impact::RegimeKind;
use crate::model::error::ParameterError;
use crate::model::state::Clock;
use crate::model::structure::{Structure, StructureParameter, StructureState};
use crate::numerics::double_double::DoubleDouble;
use crate::simulate::{Anchor, AnchorOf, Model};
use crate::tangent::border::Border;
use crate::tangent::structure::{Linearised, StopInRegime};

/// A structure as shooting needs it, worked out once.
#[derive(Debug)]
pub struct StructureShooting {
    linearised: Arc<Linearised>,
    response: OnceLock<Option<Response>>,
}

/// A solution of the conditions of periodicity, or a guess of one.
#[derive(Debug)]
pub struct StructureCycle<'a> {
    of: &'a StructureShooting,
    itinerary: &'a StructureItinerary,
    nodes: Vec<Vec<f64>>,
}

/// One condition of a motion: a border of one of its legs, at a stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StopCondition {
    /// What vanishes.
    pub border: Border,
    /// Number of the leg.
    pub leg: usize,
    /// Number of the stop.
    pub stop: usize,
}

/// A condition with its value, positive as long as the leg is what it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StopConditionValue {
    /// Which condition.
    pub condition: StopCondition,
    /// Its value.
    pub value: f64,
    /// Time from the start of the leg at which it is taken.
    pub time: f64,
}

/// Residual of the conditions, and its derivatives, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureResidual {
    /// As many as there are unknowns.
    pub values: Vec<f64>,
    /// By the unknowns, then by the parameters.
    pub jacobian: Vec<f64>,
    /// Length of its rows.
    pub columns: usize,
}

/// A flight to an impact, or around a whole orbit.
pub(super) struct Flown {
    from: Clock,
    to: Clock,
    /// Time that it takes.
    elapsed: DoubleDouble,
    anchor: AnchorOf<Structure>,
    /// State at its end, before the impact.
    pre: StructureState,
    /// Its derivative by the start at fixed times, (2N, 2N).
    flow: DMatrix<f64>,
    /// Rates at its start and before its end.
    rates: [DVector<f64>; 2],
    strike: Option<Strike>,
}

/// An impact at the end of a flight.
struct Strike {
    stop: usize,
    gap: f64,
    approach_velocity: f64,
    impact: StopInRegime,
    post: StructureState,
    /// Derivative of the state after it by that before, (2N, 2N).
    through: DMatrix<f64>,
    /// Derivative of it by u alone: the stop's own velocity is part of it.
    by_rate: DVector<f64>,
    /// Derivatives of it by r and mu.
    by_law: [DVector<f64>; 2],
    /// dg by the state, and partial derivatives of g and u by time.
    normal: DVector<f64>,
    by_time: (f64, f64),
}

pub(super) fn numbers(state: &StructureState) -> DVector<f64> {
    DVector::from_iterator(2 * state.q.len(), state.numbers())
}

impl StructureShooting {
    /// Of a structure.
    #[must_use]
    pub fn new(structure: &Structure) -> Self {
        let linearised = Arc::new(Linearised::new(structure));
        Self { linearised, response: OnceLock::new() }
    }

    /// The structure.
    #[must_use]
    pub fn structure(&self) -> &Structure {
        &self.linearised.structure
    }

    /// The nodes of this sequence of impacts, row by row.
    ///
    /// # Errors
    /// [`ParameterError`] if there are not as many numbers as the nodes have, no drive, or no such
    /// stop.
    pub fn cycle<'a>(
        &'a self,
        itinerary: &'a StructureItinerary,
        nodes: &[f64],
    ) -> Result<StructureCycle<'a>, ParameterError> {
        let structure = self.structure();
        let count = itinerary.legs.len();
        let width = itinerary.width(structure.coordinates());
        if nodes.len() != count * width {
            let allowed = format!("{count} rows of {width} numbers");
            return Err(ParameterError::new("nodes", nodes.len(), allowed));
        }
        if structure.drive_frequency() == 0.0 {
            return Err(ParameterError::new("drive_frequency", 0.0, "> 0 for a period"));
        }
        let most = structure.stops().len();
        for leg in &itinerary.legs {
            if let StopLeg::Impact { stop, .. } = leg
                && *stop >= most
            {
                return Err(ParameterError::new("stop", stop, format!("one of {most} stops")));
            }
        }
        let nodes = nodes.chunks(width).map(<[f64]>::to_vec).collect();
        Ok(StructureCycle { of: self, itinerary, nodes })
    }

    /// Phi of a flight over this time.
    fn flow(&self, elapsed: DoubleDouble) -> DMatrix<f64> {
        let count = self.structure().coordinates();
        let motion = &self.linearised.homogeneous;
        let mut flow = DMatrix::identity(2 * count, 2 * count);
        for mut column in flow.column_iter_mut() {
            let start = StructureState::of_numbers(column.as_slice());
            let leg = motion.leg(&Anchor::apart(Clock::START, start.clone()), Clock::START, start);
            column.copy_from(&numbers(&motion.state_after(&leg, elapsed)));
        }
        flow
    }
}

impl StructureCycle<'_> {
    fn structure(&self) -> &Structure {
        self.of.structure()
    }

    fn unknowns(&self) -> usize {
        self.nodes.iter().map(Vec::len).sum()
    }

    fn is_circuit(&self) -> bool {
        self.itinerary.legs == [StopLeg::Circuit]
    }

    /// The state of a node.
    fn state(&self, leg: usize) -> StructureState {
        StructureState::of_numbers(&self.nodes[leg][..2 * self.structure().coordinates()])
    }

    /// The clock of a node, `turns` orbits later; the time itself may lie in another period.
    fn clock(&self, leg: usize, turns: i64) -> Clock {
        let period = self.itinerary.clocks[leg] + turns * self.itinerary.periods;
        let time = if self.is_circuit() { 0.0 } else { self.nodes[leg][self.nodes[leg].len() - 1] };
        self.of.linearised.drive().advance(Clock::new(period, 0.0), DoubleDouble::new(time))
    }

    /// Node and turn that follow on a leg.
    fn next(&self, leg: usize) -> (usize, i64) {
        if leg + 1 == self.nodes.len() { (0, 1) } else { (leg + 1, 0) }
    }

    /// A leg; None where it cannot be followed.
    fn fly(&self, leg: usize) -> Option<Flown> {
        let linearised = &self.of.linearised;
        let (next, turns) = self.next(leg);
        if self.nodes[leg].iter().chain(&self.nodes[next]).any(|x| !x.is_finite()) {
            return None;
        }
        let (from, to) = (self.clock(leg, 0), self.clock(next, turns));
        let elapsed = linearised.drive().until(from, to);
        // A leg may become a little shorter than nothing on the way to a solution.
        let span = Structure::span(&linearised.motion);
        if !elapsed.hi.is_finite() || elapsed.hi < -NEGATIVE_LEG * span {
            return None;
        }
        let start = self.state(leg);
        let anchor: AnchorOf<Structure> = Anchor::apart(from, start.clone());
        let flight = linearised.motion.leg(&anchor, from, start.clone());
        let pre = linearised.motion.state_after(&flight, elapsed);
        let rates = [(from, &start), (to, &pre)].map(|(clock, state)| {
            DVector::from_column_slice(&linearised.rates(&anchor, clock, state))
        });
        let strike = match self.itinerary.legs[leg] {
            StopLeg::Impact { stop, regime, direction } => {
                Some(self.strike(stop, (regime, f64::from(direction)), to, &pre))
            }
            StopLeg::Circuit => None,
        };
        Some(Flown { from, to, elapsed, anchor, flow: self.of.flow(elapsed), pre, rates, strike })
    }

    fn strike(
        &self,
        stop: usize,
        regime: (RegimeKind, f64),
        clock: Clock,
        pre: &StructureState,
    ) -> Strike {
        let (linearised, structure) = (&self.of.linearised, self.structure());
        let count = structure.coordinates();
        let (gap, approach_velocity) = linearised.motion.gap(stop, clock, pre);
        let slip = structure.slip(stop, &pre.v);
        let impact = StopInRegime::new(structure, stop, (approach_velocity, slip), regime);
        let (rows, at) = (structure.contact(stop), &structure.stops()[stop]);
        let [normal, tangential] = impact.impulses();
        let pushed = |p: f64, q: f64| {
            let mut push = DVector::zeros(2 * count);
            for i in 0..count {
                push[count + i] = q * rows.by_tangent[i] - p * rows.by_normal[i];
            }
            push
        };
        let by = |k: usize| pushed(normal.slope[k], tangential.slope[k]);
        let (by_rate, by_slip) = (by(0), by(1));
        let mut through = DMatrix::identity(2 * count, 2 * count);
        for (i, n) in at.normal().iter().enumerate() {
            let mut column = through.column_mut(count + i);
            column += &by_rate * *n;
            if let Some(tangent) = at.tangent() {
                column += &by_slip * tangent[i];
            }
        }
        let mut row = DVector::zeros(2 * count);
        row.rows_mut(0, count).copy_from_slice(at.normal());
        let post = numbers(pre) + pushed(normal.value, tangential.value);
        Strike {
            stop,
            gap,
            approach_velocity,
            post: StructureState::of_numbers(post.as_slice()),
            through,
            by_rate,
            by_law: [by(2), by(3)],
            normal: row,
            by_time: linearised.by_time(stop, clock),
            impact,
        }
    }

    /// The conditions of periodicity, and their derivatives by the nodes and by these parameters.
    /// NaN where a leg cannot be followed.
    #[must_use]
    pub fn residual(&self, parameters: &[StructureParameter]) -> StructureResidual {
        let size = 2 * self.structure().coordinates();
        let (count, width) = (self.unknowns(), self.nodes[0].len());
        let columns = count + parameters.len();
        let mut values = DVector::zeros(count);
        let mut jacobian: DMatrix<f64> = DMatrix::zeros(count, columns);
        for leg in 0..self.nodes.len() {
            let row = leg * width;
            let Some(flown) = self.fly(leg) else {
                values.rows_mut(row, width).fill(f64::NAN);
                jacobian.rows_mut(row, width).fill(f64::NAN);
                continue;
            };
            let (next, _) = self.next(leg);
            let (own, other) = (leg * width, next * width);
            let goal = numbers(&self.state(next));
            for (place, name) in parameters.iter().enumerate() {
                let by = self.by_parameter(&flown, leg, *name);
                jacobian.view_mut((row, count + place), (width, 1)).copy_from(&by.rows(0, width));
            }
            let mut part = jacobian.view_mut((row, other), (size, size));
            part -= DMatrix::identity(size, size);
            let Some(strike) = &flown.strike else {
                values.rows_mut(row, size).copy_from(&(numbers(&flown.pre) - goal));
                let mut part = jacobian.view_mut((row, own), (size, size));
                part += &flown.flow;
                continue;
            };
            values.rows_mut(row, size).copy_from(&(numbers(&strike.post) - goal));
            values[row + size] = strike.gap;
            let mut put = |column: usize, by: DVector<f64>, gap: f64| {
                let mut part = jacobian.view_mut((row, column), (size, 1));
                part += by;
                jacobian[(row + size, column)] += gap;
            };
            let into = |by: &DVector<f64>| (&strike.through * by, strike.normal.dot(by));
            for k in 0..size {
                let (by, gap) = into(&flown.flow.column(k).into_owned());
                put(own + k, by, gap);
            }
            // A later start is one that has come less far.
            let (by, gap) = into(&(&flown.flow * &flown.rates[0]));
            put(own + size, -by, -gap);
            let (by, gap) = into(&flown.rates[1]);
            let (gap_by_time, rate_by_time) = strike.by_time;
            put(other + size, by + &strike.by_rate * rate_by_time, gap + gap_by_time);
        }
        let jacobian = jacobian.transpose().as_slice().to_vec();
        StructureResidual { values: values.as_slice().to_vec(), jacobian, columns }
    }

    /// S of the impact that ends a leg; 1 where none does.
    fn saltation(&self, flown: &Flown) -> DMatrix<f64> {
        let size = 2 * self.structure().coordinates();
        let Some(strike) = &flown.strike else { return DMatrix::identity(size, size) };
        let anchor: AnchorOf<Structure> = Anchor::apart(flown.to, strike.post.clone());
        let after = self.of.linearised.rates(&anchor, flown.to, &strike.post);
        let after = DVector::from_column_slice(&after);
        let (gap_by_time, rate_by_time) = strike.by_time;
        let approach = strike.normal.dot(&flown.rates[1]) + gap_by_time;
        let jump = &strike.through * &flown.rates[1] + &strike.by_rate * rate_by_time - after;
        &strike.through - jump * (strike.normal.transpose() / approach)
    }

    /// The derivative of the return map from the start of a drive period. NaN where a leg cannot be
    /// followed, infinite where one ends in a graze.
    #[must_use]
    pub fn return_map(&self) -> DMatrix<f64> {
        let size = 2 * self.structure().coordinates();
        let count = self.nodes.len();
        let (first, since) = self.leg_at(0.0);
        let mut product = DMatrix::identity(size, size);
        for leg in (first..count).chain(0..first) {
            let Some(flown) = self.fly(leg) else {
                return DMatrix::from_element(size, size, f64::NAN);
            };
            // The orbit begins within this leg, and ends there.
            let flow = if leg == first {
                self.of.flow(flown.elapsed - DoubleDouble::new(since))
            } else {
                flown.flow.clone()
            };
            product = self.saltation(&flown) * (flow * product);
        }
        self.of.flow(DoubleDouble::new(since)) * product
    }

    /// The conditions of the legs.
    #[must_use]
    pub fn tests(&self) -> Vec<StopConditionValue> {
        let mut tests = Vec::new();
        for leg in 0..self.nodes.len() {
            let Some(flown) = self.fly(leg) else { continue };
            let length = flown.elapsed.value();
            let mut test = |border, stop, value, time| {
                let condition = StopCondition { border, leg, stop };
                tests.push(StopConditionValue { condition, value, time });
            };
            if let Some(strike) = &flown.strike {
                let stop = strike.stop;
                test(Border::ApproachVelocity, stop, strike.approach_velocity, length);
                for border in strike.impact.borders() {
                    test(border.border, stop, border.value, length);
                }
            }
            for (stop, top) in self.highest(&flown).into_iter().enumerate() {
                if let Some((time, gap)) = top {
                    test(Border::Flight, stop, -gap, time);
                }
            }
        }
        tests
    }

    /// States just before the impacts that end the legs; of a circuit at its end.
    #[must_use]
    pub fn before_events(&self) -> Vec<Option<StructureState>> {
        (0..self.nodes.len()).map(|leg| self.fly(leg).map(|flown| flown.pre)).collect()
    }

    /// State at a time after the start of a leg, whether or not the bodies overlap.
    #[must_use]
    pub fn state_in_leg(&self, leg: usize, time: f64) -> StructureState {
        let linearised = &self.of.linearised;
        let (from, start) = (self.clock(leg, 0), self.state(leg));
        let flight = linearised.motion.leg(&Anchor::apart(from, start.clone()), from, start);
        linearised.motion.state_after(&flight, DoubleDouble::new(time))
    }

    /// State at any time; the orbit repeats.
    #[must_use]
    pub fn state_at(&self, time: f64) -> StructureState {
        let (leg, since) = self.leg_at(time);
        self.state_in_leg(leg, since)
    }

    /// The leg at a time, and the time since its start.
    fn leg_at(&self, time: f64) -> (usize, f64) {
        let drive = self.of.linearised.drive();
        let length = drive.period.value() * self.itinerary.periods as f64;
        let since = |leg: usize| (time - drive.time(self.clock(leg, 0))).rem_euclid(length);
        let legs = (0..self.nodes.len()).map(|leg| (leg, since(leg)));
        legs.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0))
    }
}
