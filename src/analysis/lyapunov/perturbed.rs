//! Small perturbations of a motion, which the derivatives of its legs map from event to event. Who
//! follows the motion hands over its events.
//!
//! At an event a perturbation has the components (x1, x1', x2', t) of a node, as in shooting: the
//! time of the event differs, and only the condition of the event is divided by an approach
//! velocity. Between events it has those of the state at a fixed time, (x1, x1', x2', x2). The
//! change from one to the other before and after an impact is the saltation matrix S = R + (F+ - R
//! F-)(grad g)^T/g'^- (docs/theory.md, section 7).
//!
//! After some legs a motion no longer depends on all components: after stick in an impact not on
//! x1', after a plastic impact not on the approach velocity, in contact not on g and g', and in
//! stick not on x1' either. The rank counts the directions that are left; rounding errors would
//! hide the loss.

use crate::analysis::tolerances::{
    INDEPENDENT_SINE, LOW_APPROACH, MOST_CONTRACTION, MOST_CONTRACTION_STEPS,
};
use nalgebra::{Matrix4, Vector4};

use super::LyapunovError;
use crate::contact::sustained::ContactMode;
use crate::flight::Drive;
use crate::impact::RegimeKind;
use crate::model::parameters::System;
use crate::model::state::{Clock, State};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::dual::Number;
use crate::simulate::event::Event;
use crate::simulate::run::FinalState;
use crate::tangent::itinerary::{Leg, LegChange, LegReader, with_wall_at_rest};
use crate::tangent::tolerances::LOW_BOUNCE;
use crate::tangent::{
    Columns, Departure, Derivative, Dual, DualState, END, Model, Moment, Strike, fly, on_contact,
    slide, to_event, traverse,
};

/// Orthogonal columns without zeros.
const HADAMARD: Matrix4<f64> = Matrix4::new(
    1.0, 1.0, 1.0, 1.0, //
    1.0, -1.0, 1.0, -1.0, //
    1.0, 1.0, -1.0, -1.0, //
    1.0, -1.0, -1.0, 1.0,
);

/// The perturbations at one state of a motion.
#[derive(Clone)]
struct PerturbedState {
    state: State,
    clock: Clock,
    /// Whether it is the state after an event, or between two.
    at_event: bool,
    /// The flight that begins here, if its numbers are known.
    departure: Option<Departure>,
    /// The perturbations, one in each column.
    vectors: Matrix4<f64>,
    /// Number of columns that count.
    rank: usize,
    /// ln of the factors by which each column has been divided.
    logs: [f64; 4],
}

impl PerturbedState {
    /// Completes the columns that count to an orthonormal basis.
    fn restore_directions(&mut self, directions: usize) {
        let mut candidates = HADAMARD.column_iter();
        while self.rank < directions {
            let Some(candidate) = candidates.next() else { break };
            let mut column: Vector4<f64> = 0.5 * candidate;
            // Twice: after once, rounding errors are left.
            for j in (0..self.rank).chain(0..self.rank) {
                let before: Vector4<f64> = self.vectors.column(j).into();
                column -= before * before.dot(&column);
            }
            if column.norm() > INDEPENDENT_SINE {
                self.vectors.set_column(self.rank, &column.normalize());
                self.logs[self.rank] = 0.0;
                self.rank += 1;
            }
        }
    }

    /// The flight that begins here.
    fn departure(&self, model: &Model) -> Departure {
        let make = || Departure::new(model, &self.state, self.clock, self.at_event);
        self.departure.unwrap_or_else(make)
    }

    /// The perturbations that count, mapped.
    fn mapped(&self, derivative: &impl Derivative) -> Matrix4<f64> {
        let v = &self.vectors;
        if self.rank == 1 {
            let column = derivative.map(&[[v[0]], [v[1]], [v[2]], [v[3]]]);
            return Matrix4::from_fn(|r, c| if c == 0 { column[r][0] } else { 0.0 });
        }
        let rows: Columns<4> = std::array::from_fn(|r| std::array::from_fn(|c| v[(r, c)]));
        let rows = derivative.map(&rows);
        Matrix4::from_fn(|r, c| rows[r][c])
    }

    /// Takes over what a leg has made of the perturbations.
    fn set_vectors(
        &mut self,
        vectors: Matrix4<f64>,
        orthonormal: bool,
    ) -> Result<(), LyapunovError> {
        self.vectors = vectors;
        // Those that are lost must not overflow.
        self.vectors.columns_mut(self.rank, 4 - self.rank).fill(0.0);
        if !self.vectors.iter().all(|x| x.is_finite()) {
            return Err(LyapunovError::NoDerivative);
        }
        if orthonormal {
            self.orthonormalise();
        }
        Ok(())
    }

    /// The method of Gram and Schmidt, from the first column on.
    fn orthonormalise(&mut self) {
        for i in 0..self.rank {
            let mut column: Vector4<f64> = self.vectors.column(i).into();
            for j in 0..i {
                let before = self.vectors.column(j);
                column -= before * before.dot(&column);
            }
            let length = column.norm();
            if length == 0.0 {
                self.rank = i;
                return;
            }
            self.logs[i] += length.ln();
            self.vectors.set_column(i, &(column / length));
        }
    }
}

/// Perturbations of a motion.
pub(crate) struct Perturbations {
    model: Model,
    reader: LegReader,
    here: PerturbedState,
    /// Perturbations change only from the next event on.
    paused: bool,
    /// The state after the last impact before a series of decreasing ones, and its u. The series
    /// may turn out to be chatter.
    before_chatter: Option<(PerturbedState, f64)>,
    /// u of the last impact, and the largest so far.
    last: f64,
    largest: f64,
    /// Time between the last two impacts.
    interval: f64,
    /// Whether the columns are kept orthonormal.
    orthonormal: bool,
    impacts: u64,
    /// Fastest decay of a free motion of either body.
    fastest_decay: f64,
}

impl Perturbations {
    /// Of the motion that goes on from the end of a run, where impacts may be skipped: so many,
    /// kept orthonormal, or all four unit vectors, which are not.
    pub fn new(system: &System, end: &FinalState, skips: bool, wanted: Option<usize>) -> Self {
        let FinalState { state, clock, mode, .. } = *end;
        let still = system.is_wall_at_rest(&with_wall_at_rest(system, state));
        let mut perturbations = Self {
            model: Model::new(system, &[], still),
            reader: LegReader { mode },
            here: PerturbedState {
                state,
                clock,
                at_event: false,
                departure: None,
                vectors: Matrix4::zeros(),
                rank: 0,
                logs: [0.0; 4],
            },
            paused: skips,
            before_chatter: None,
            last: 0.0,
            largest: 0.0,
            interval: 0.0,
            orthonormal: wanted.is_some(),
            impacts: 0,
            fastest_decay: system.fastest_decay(),
        };
        perturbations.restart(wanted.unwrap_or(4));
        perturbations.reduce_rank_in_contact();
        perturbations
    }

    pub fn drive(&self) -> &Drive {
        &self.model.motion.drive
    }

    /// Number of directions: a wall at rest has none.
    pub fn directions(&self) -> usize {
        if self.model.wall_at_rest { 2 } else { 4 }
    }

    /// Starts with new perturbations. Orthonormal ones are not unit vectors: without contact, or
    /// without friction, a perturbation of one body never reaches the other, so each must be of
    /// both.
    pub fn restart(&mut self, wanted: usize) {
        self.here.vectors = if self.orthonormal { 0.5 * HADAMARD } else { Matrix4::identity() };
        self.here.rank = if self.orthonormal { wanted.min(self.directions()) } else { 4 };
        self.here.logs = [0.0; 4];
    }

    /// Replaces the directions that have been lost, before a measurement begins.
    pub fn restore_directions(&mut self) {
        let directions = self.directions();
        self.here.restore_directions(directions);
        if let Some((place, _)) = &mut self.before_chatter {
            place.restore_directions(directions);
        }
        self.reduce_rank_in_contact();
    }

    /// Number of perturbations that are left.
    pub fn rank(&self) -> usize {
        self.here.rank
    }

    /// The matrix of the perturbations: of x1, x1', x2', x2 at an instant.
    pub fn vectors(&self) -> &Matrix4<f64> {
        &self.here.vectors
    }

    /// Impacts since the start, those of complete chatter left out.
    pub fn impacts(&self) -> u64 {
        self.impacts
    }

    /// The last instant at which the perturbations are known, at an event or between two.
    pub fn clock(&self) -> Clock {
        self.here.clock
    }

    /// The state at that instant.
    pub fn state(&self) -> State {
        self.here.state
    }

    /// Whether there are no states before the next event: impacts are skipped, or the last ones may
    /// lead into chatter.
    pub fn has_no_states(&self) -> bool {
        self.paused || self.may_chatter()
    }

    /// ln of the growth of each direction since the start, up to an instant before the next event;
    /// -inf for those that are lost, the last ones. What follows an impact that may lead into
    /// chatter counts once it is known whether it does.
    pub fn logs_at(&self, clock: Clock) -> Result<[f64; 4], LyapunovError> {
        let mut logs = match &self.before_chatter {
            Some((place, _)) if self.may_chatter() => place.logs,
            _ if self.here.rank == 0 || clock <= self.here.clock => self.here.logs,
            _ => {
                let mut there = self.here.clone();
                there.set_vectors(self.vectors_at(clock)?, self.orthonormal)?;
                there.logs
            }
        };
        logs[self.here.rank..].fill(f64::NEG_INFINITY);
        Ok(logs)
    }

    /// Comes closer to the next event or to an instant before it, where no state is needed:
    /// excludes what the time since the last event excludes, and covers most of a long flight.
    pub fn approach(&mut self, clock: Clock) -> Result<(), LyapunovError> {
        self.rule_out_chatter(clock);
        if self.reader.mode.is_none() && !self.may_chatter() {
            self.fly_in_steps(clock)?;
        }
        Ok(())
    }

    /// Maps the perturbations through the leg that an event ends.
    pub fn take(&mut self, event: &Event) -> Result<(), LyapunovError> {
        if let Event::Chatter(_) = event {
            // The rounding of g, divided by so low a u, would spoil the times of these impacts.
            if let Some((place, _)) = self.before_chatter.take() {
                self.here = place;
            }
        }
        let mode = self.reader.mode;
        match self.reader.read(&self.model.system, event) {
            LegChange::Ends(leg, clock, state) => {
                let mut departure = None;
                if !self.paused && self.here.rank > 0 {
                    let vectors = match (leg, event, mode) {
                        (Leg::Impact(kind, signs), Event::Impact(impact), None) => {
                            let from = self.here.departure(&self.model);
                            let strike = Strike::new(&self.model, &from, impact, (kind, signs));
                            departure = Some(strike.departure());
                            self.here.mapped(&strike)
                        }
                        _ => self.derivative_of(leg, mode, clock)? * self.here.vectors,
                    };
                    self.here.set_vectors(vectors, self.orthonormal)?;
                }
                self.reduce_rank_by(leg);
                self.impacts += u64::from(matches!(leg, Leg::Impact(..)));
                let here = &mut self.here;
                self.interval = self.model.motion.drive.until(here.clock, clock).value();
                (here.state, here.clock, here.at_event) = (state, clock, true);
                here.departure = departure;
                self.paused = false;
                if let Event::Impact(impact) = event {
                    self.note_impact(impact.impact.approach_velocity);
                } else {
                    self.before_chatter = None;
                }
            }
            LegChange::Begins(state) => {
                (self.here.state, self.here.departure) = (state, None);
                self.reduce_rank_in_contact();
            }
            LegChange::Nothing | LegChange::Stops(_) => {}
        }
        Ok(())
    }

    /// Derivative of the node at the end of a leg, at this clock, by the present one.
    fn derivative_of(
        &self,
        leg: Leg,
        mode: Option<ContactMode>,
        clock: Clock,
    ) -> Result<Matrix4<f64>, LyapunovError> {
        let (start, from) = self.start(mode);
        let time = Dual::variable(clock.time_in_period, END);
        let end = Moment { period: clock.period, time };
        let outcome = traverse(&self.model, leg, &start, &from, &end)
            .ok_or(LyapunovError::NoDerivative)?;
        Ok(to_event(&outcome.image, &outcome.condition))
    }

    /// Keeps the state after an impact, unless it is a low one after a higher one.
    fn note_impact(&mut self, u: f64) {
        self.largest = self.largest.max(u);
        let decreases = u < self.last || u < LOW_APPROACH * self.largest;
        if u >= LOW_BOUNCE * self.largest || !decreases || self.before_chatter.is_none() {
            self.before_chatter = Some((self.here.clone(), u));
        }
        self.last = u;
    }

    /// Whether u has decreased in the last impacts, as it does in chatter.
    fn may_chatter(&self) -> bool {
        self.before_chatter.as_ref().is_some_and(|(_, u)| self.last < *u)
    }

    /// The next event is not before this instant. In chatter each flight is shorter than the one
    /// before: a longer one shows that this is none.
    fn rule_out_chatter(&mut self, clock: Clock) {
        if self.may_chatter() {
            let flown = self.model.motion.drive.until(self.here.clock, clock).value();
            if flown > self.interval {
                self.before_chatter = None;
            }
        }
    }

    /// Covers most of the flight to an instant, in steps short enough for strong damping.
    fn fly_in_steps(&mut self, clock: Clock) -> Result<(), LyapunovError> {
        if self.fastest_decay == 0.0 || self.paused || self.rank() == 0 || !self.orthonormal {
            return Ok(());
        }
        let drive = self.model.motion.drive;
        let time = drive.until(self.here.clock, clock).value();
        let steps =
            (time * self.fastest_decay / MOST_CONTRACTION).min(MOST_CONTRACTION_STEPS).floor();
        let step = DoubleDouble::new(time / (steps + 1.0));
        let mut done = 0.0;
        while done < steps {
            self.carry_to(drive.advance(self.here.clock, step))?;
            done += 1.0;
        }
        Ok(())
    }

    /// The perturbations at an instant before the next event.
    fn vectors_at(&self, clock: Clock) -> Result<Matrix4<f64>, LyapunovError> {
        if self.reader.mode.is_none() {
            let flight = self.here.departure(&self.model).flight(&self.model, clock);
            return Ok(self.here.mapped(&flight));
        }
        let DualState { x1, v1, x2, v2 } = self.state_at(clock)?;
        let rows = [x1, v1, v2, x2];
        Ok(Matrix4::from_fn(|r, c| rows[r].slope[c]) * self.here.vectors)
    }

    /// The state at an instant before the next event, with derivatives by the present one.
    fn state_at(&self, clock: Clock) -> Result<DualState, LyapunovError> {
        let (start, from) = self.start(self.reader.mode);
        let end = Moment { period: clock.period, time: Dual::constant(clock.time_in_period) };
        let s = self.model.elapsed(&from, &end);
        match self.reader.mode {
            None => Ok(fly(&self.model, &start, &from, s)),
            Some(ContactMode::Stick) => Ok(start),
            Some(mode) => {
                slide(&self.model, &start, mode, &from, s).ok_or(LyapunovError::NoDerivative)
            }
        }
    }

    /// Carries the perturbations to an instant before the next event.
    pub fn carry_to(&mut self, clock: Clock) -> Result<(), LyapunovError> {
        let state = self.state_at(clock)?.value();
        if self.here.rank > 0 {
            let vectors = self.vectors_at(clock)?;
            self.here.set_vectors(vectors, self.orthonormal)?;
        }
        let here = &mut self.here;
        (here.state, here.clock, here.at_event) = (state, clock, false);
        here.departure = None;
        self.before_chatter = None;
        Ok(())
    }

    /// The present state, with derivatives by its components.
    fn start(&self, mode: Option<ContactMode>) -> (DualState, Moment) {
        let State { x1, v1, x2, v2 } = self.here.state;
        let (model, period) = (&self.model, self.here.clock.period);
        let rest = Dual::constant(0.0);
        let still = model.wall_at_rest;
        let variable = |value, direction| {
            if still && direction >= 2 { rest } else { Dual::variable(value, direction) }
        };
        let (x1, v1, v2) = (Dual::variable(x1, 0), Dual::variable(v1, 1), variable(v2, 2));
        if self.here.at_event {
            let time = Dual::variable(self.here.clock.time_in_period, 3);
            let x2 = model.contact_place(x1);
            return (DualState { x1, v1, x2, v2 }, Moment { period, time });
        }
        let state = match mode {
            None => DualState { x1, v1, x2: variable(x2, 3), v2 },
            Some(ContactMode::Stick) => on_contact(model, x1, rest),
            Some(_) => on_contact(model, x1, v1),
        };
        (state, Moment { period, time: Dual::constant(self.here.clock.time_in_period) })
    }

    /// Takes away the directions that a leg maps to zero.
    fn reduce_rank_by(&mut self, leg: Leg) {
        let lost = match leg {
            Leg::Impact(kind, _) => {
                let stops =
                    matches!(kind, RegimeKind::StickInApproach | RegimeKind::StickInRestitution);
                usize::from(stops) + usize::from(self.model.system.restitution() == 0.0)
            }
            Leg::Chatter => 2,
            _ => 0,
        };
        self.reduce_rank(lost);
        self.reduce_rank_in_contact();
    }

    fn reduce_rank_in_contact(&mut self) {
        self.reduce_rank(match self.reader.mode {
            None => 0,
            Some(ContactMode::Stick) => 3,
            Some(_) => 2,
        });
    }

    fn reduce_rank(&mut self, lost: usize) {
        if self.orthonormal {
            self.here.rank = self.here.rank.min(self.directions().saturating_sub(lost));
        }
    }
}
