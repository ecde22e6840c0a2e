//! A motion with small perturbations, which the derivatives of its legs map from event to event.
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
use crate::impact::RegimeKind;
use crate::model::state::{Clock, State};
use crate::numerics::cancel::CancelToken;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::dual::Number;
use crate::simulate::event::{Event, StopReason};
use crate::simulate::run::{FinalState, Run};
use crate::simulate::{Horizon, Simulation};
use crate::tangent::itinerary::{Leg, LegChange, LegReader, with_wall_at_rest};
use crate::tangent::tolerances::LOW_BOUNCE;
use crate::tangent::{
    Dual, DualState, END, Model, Moment, fly, on_contact, slide, to_event, traverse,
};

/// Orthogonal columns without zeros.
const HADAMARD: Matrix4<f64> = Matrix4::new(
    1.0, 1.0, 1.0, 1.0, //
    1.0, -1.0, 1.0, -1.0, //
    1.0, 1.0, -1.0, -1.0, //
    1.0, -1.0, -1.0, 1.0,
);

/// One state of a motion, with its perturbations.
#[derive(Clone)]
struct PerturbedState {
    state: State,
    clock: Clock,
    /// Whether it is the state after an event, or between two.
    at_event: bool,
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
}

/// A motion with perturbations of it.
pub(crate) struct PerturbedMotion {
    simulation: Simulation,
    model: Model,
    reader: LegReader,
    /// An event after the present state.
    pending: Option<Event>,
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

impl PerturbedMotion {
    /// The motion that goes on from the end of `run`, with `wanted` perturbations, kept
    /// orthonormal, or with all four unit vectors, which are not.
    pub fn new(run: &Run, wanted: Option<usize>, cancel: &CancelToken) -> Self {
        let system = &run.system;
        let FinalState { state, clock, mode, .. } = run.final_state;
        let still = system.is_wall_at_rest(&with_wall_at_rest(system, state));
        let model = Model::new(system, &[], still);
        let simulation = run.resumed().cancel_with(cancel);
        let paused = simulation.checkpoint().skips();
        let mut motion = Self {
            simulation,
            model,
            reader: LegReader { mode },
            pending: None,
            here: PerturbedState {
                state,
                clock,
                at_event: false,
                vectors: Matrix4::zeros(),
                rank: 0,
                logs: [0.0; 4],
            },
            paused,
            before_chatter: None,
            last: 0.0,
            largest: 0.0,
            interval: 0.0,
            orthonormal: wanted.is_some(),
            impacts: 0,
            fastest_decay: system.fastest_decay(),
        };
        motion.restart(wanted.unwrap_or(4));
        motion.reduce_rank_in_contact();
        motion
    }

    /// Moves the horizon of the motion.
    pub fn extend(&mut self, horizon: Horizon) {
        self.pending = self.pending.take().filter(|event| !matches!(event, Event::Stop(_)));
        self.simulation.extend_to(horizon);
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

    /// The instant reached.
    pub fn clock(&self) -> Clock {
        self.here.clock
    }

    /// ln of the growth of each direction since the last call; -inf for those that are lost, the
    /// last ones.
    pub fn take_logs(&mut self) -> [f64; 4] {
        let mut logs = self.here.logs;
        let may_chatter = self.may_chatter();
        if let Some((place, _)) = &mut self.before_chatter {
            if may_chatter {
                // Later growth counts once it is known whether this is chatter.
                logs = place.logs;
            }
            place.logs = [0.0; 4];
        }
        let rest = &mut self.here.logs;
        *rest = std::array::from_fn(|i| rest[i] - logs[i]);
        std::array::from_fn(|i| if i < self.here.rank { logs[i] } else { f64::NEG_INFINITY })
    }

    /// Goes on to the instant `end`; if impacts are skipped there, to the first instant after them.
    pub fn advance_to(&mut self, end: Clock) -> Result<(), LyapunovError> {
        loop {
            let event = match self.pending.take() {
                Some(event) => event,
                None => match self.simulation.advance(&mut ()) {
                    Some(event) => event.map_err(LyapunovError::Simulation)?,
                    None => return Err(LyapunovError::Stopped(StopReason::Completed)),
                },
            };
            if let Event::Stop(stop) = event
                && !stop.reason.reached_the_end()
            {
                return Err(LyapunovError::Stopped(stop.reason));
            }
            let clock = event.clock();
            let stops = matches!(event, Event::Stop(_));
            let chatters = matches!(event, Event::Chatter(_))
                || (stops && self.simulation.checkpoint().skips());
            if !chatters {
                self.rule_out_chatter(if clock < end { clock } else { end });
            }
            if self.reader.mode.is_none() && !chatters && !self.may_chatter() {
                self.fly_in_steps(if clock < end { clock } else { end })?;
            }
            if stops {
                self.pending = Some(event);
                // Within chatter there are no states.
                return if chatters || self.may_chatter() { Ok(()) } else { self.carry_to(end) };
            }
            // Nor between the last impact and the end of chatter.
            let skipped = chatters || self.paused || self.may_chatter();
            if clock >= end && clock > self.here.clock && !skipped {
                self.pending = Some(event);
                return self.carry_to(if end > self.here.clock { end } else { self.here.clock });
            }
            self.take(&event)?;
        }
    }

    /// Maps the perturbations through the leg that an event ends.
    fn take(&mut self, event: &Event) -> Result<(), LyapunovError> {
        if let Event::Chatter(_) = event {
            // The rounding of g, divided by so low a u, would spoil the times of these impacts.
            if let Some((place, _)) = self.before_chatter.take() {
                self.here = place;
            }
        }
        let start = self.start();
        match self.reader.read(&self.model.system, event) {
            LegChange::Ends(leg, clock, state) => {
                if !self.paused && self.here.rank > 0 {
                    let (start, from) = start;
                    let time = Dual::variable(clock.time_in_period, END);
                    let end = Moment { period: clock.period, time };
                    let outcome = traverse(&self.model, leg, &start, &from, &end)
                        .ok_or(LyapunovError::NoDerivative)?;
                    self.apply(&to_event(&outcome.image, &outcome.condition))?;
                }
                self.reduce_rank_by(leg);
                self.impacts += u64::from(matches!(leg, Leg::Impact(..)));
                let place = &mut self.here;
                self.interval = self.model.motion.drive.until(place.clock, clock).value();
                (place.state, place.clock, place.at_event) = (state, clock, true);
                self.paused = false;
                if let Event::Impact(impact) = event {
                    self.note_impact(impact.impact.approach_velocity);
                } else {
                    self.before_chatter = None;
                }
            }
            LegChange::Begins(state) => {
                self.here.state = state;
                self.reduce_rank_in_contact();
            }
            LegChange::Nothing | LegChange::Stops(_) => {}
        }
        Ok(())
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
        let flown = self.model.motion.drive.until(self.here.clock, clock).value();
        if self.may_chatter() && flown > self.interval {
            self.before_chatter = None;
        }
    }

    /// Covers most of the flight to an instant, in steps short enough for strong damping.
    fn fly_in_steps(&mut self, clock: Clock) -> Result<(), LyapunovError> {
        if self.paused || self.rank() == 0 || !self.orthonormal {
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

    /// Carries the perturbations to an instant before the next event.
    fn carry_to(&mut self, clock: Clock) -> Result<(), LyapunovError> {
        let (start, from) = self.start();
        let time = Dual::constant(clock.time_in_period);
        let end = Moment { period: clock.period, time };
        let s = self.model.elapsed(&from, &end);
        let state = match self.reader.mode {
            None => fly(&self.model, &start, &from, s),
            Some(ContactMode::Stick) => start,
            Some(mode) => {
                slide(&self.model, &start, mode, &from, s).ok_or(LyapunovError::NoDerivative)?
            }
        };
        if self.here.rank > 0 {
            let rows = [state.x1, state.v1, state.v2, state.x2];
            self.apply(&Matrix4::from_fn(|r, c| rows[r].slope[c]))?;
        }
        let place = &mut self.here;
        (place.state, place.clock, place.at_event) = (state.value(), clock, false);
        self.before_chatter = None;
        Ok(())
    }

    /// The present state, with derivatives by its components.
    fn start(&self) -> (DualState, Moment) {
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
        let state = match self.reader.mode {
            None => DualState { x1, v1, x2: variable(x2, 3), v2 },
            Some(ContactMode::Stick) => on_contact(model, x1, rest),
            Some(_) => on_contact(model, x1, v1),
        };
        (state, Moment { period, time: Dual::constant(self.here.clock.time_in_period) })
    }

    fn apply(&mut self, map: &Matrix4<f64>) -> Result<(), LyapunovError> {
        let place = &mut self.here;
        place.vectors = map * place.vectors;
        // Those that are lost must not overflow.
        place.vectors.columns_mut(place.rank, 4 - place.rank).fill(0.0);
        if !place.vectors.iter().all(|x| x.is_finite()) {
            return Err(LyapunovError::NoDerivative);
        }
        if self.orthonormal {
            self.orthonormalise();
        }
        Ok(())
    }

    /// The method of Gram and Schmidt, from the first column on.
    fn orthonormalise(&mut self) {
        for i in 0..self.here.rank {
            let mut column: Vector4<f64> = self.here.vectors.column(i).into();
            for j in 0..i {
                let before = self.here.vectors.column(j);
                column -= before * before.dot(&column);
            }
            let length = column.norm();
            if length == 0.0 {
                self.here.rank = i;
                return;
            }
            self.here.logs[i] += length.ln();
            self.here.vectors.set_column(i, &(column / length));
        }
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
