//! Small perturbations carried along a motion, leg by leg.
//!
//! At an event a perturbation is one of the node (x1, x1', x2', t), as in shooting: its time differs,
//! and nothing is divided by an approach velocity but the condition of the event itself. At an
//! instant between events it is one of the state at fixed time, (x1, x1', x2', x2). Changing from one
//! to the other before and after an impact is the saltation matrix S = R + (F+ - R F-)(grad g)^T/g'^-
//! (docs/theory.md, section 7).
//!
//! Some legs lose directions for good: a tip that stops forgets x1' (stick in an impact), a plastic
//! impact the approach velocity, contact g and g', stick in contact x1' as well. The rank says how
//! many directions are left; rounding would not.

use nalgebra::{Matrix4, Vector4};

use crate::contact::sustained::ContactMode;
use crate::impact::RegimeKind;
use crate::model::error::SimulationError;
use crate::model::state::{Clock, State};
use crate::numerics::cancel::CancelToken;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::dual::Number;
use crate::simulate::event::{Event, StopReason};
use crate::simulate::run::{FinalState, Run};
use crate::simulate::{Horizon, Simulation};
use crate::tangent::itinerary::{Leg, LegReader, Reading, with_wall_at_rest};
use crate::tangent::tolerances::LOW_BOUNCE;
use crate::tangent::{
    Dual, DualState, END, Model, Moment, fly, on_contact, slide, to_event, traverse,
};

/// Impacts with less than this part of the highest u may not sink one after the other, by rounding.
const ROUNDING: f64 = 1e-6;

/// Sine of the angle from which on a direction is independent of others.
const INDEPENDENT: f64 = 0.1;
/// A flight's steps are so short that no direction contracts by more than exp of this against
/// another: rounding would make up the smaller one.
const MOST_CONTRACTION: f64 = 10.0;
/// Most such steps of one flight. Bodies so strongly overdamped that more were needed have no exact
/// exponents beyond the first ones.
const MOST_STEPS: f64 = 256.0;

/// Orthogonal columns without zeros.
const HADAMARD: Matrix4<f64> = Matrix4::new(
    1.0, 1.0, 1.0, 1.0, //
    1.0, -1.0, 1.0, -1.0, //
    1.0, 1.0, -1.0, -1.0, //
    1.0, -1.0, -1.0, 1.0,
);

/// Why perturbations cannot be carried on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Broken {
    /// The computation of the motion failed.
    Failed(SimulationError),
    /// The motion ends.
    Stopped(StopReason),
    /// A leg has no derivatives that could be computed.
    NoDerivative,
}

/// Where a motion is, with its perturbations.
#[derive(Clone)]
struct Place {
    state: State,
    clock: Clock,
    /// Whether it is an event, or an instant between two.
    at_event: bool,
    /// The perturbations, one in each column.
    vectors: Matrix4<f64>,
    /// So many columns count.
    rank: usize,
    /// ln of the factors taken out of each column.
    logs: [f64; 4],
}

impl Place {
    /// Completes the columns that count to an orthonormal basis.
    fn take_up_lost(&mut self, directions: usize) {
        let mut candidates = HADAMARD.column_iter();
        while self.rank < directions {
            let Some(candidate) = candidates.next() else { break };
            let mut column: Vector4<f64> = 0.5 * candidate;
            // Twice, since once leaves rounding of what was taken away.
            for j in (0..self.rank).chain(0..self.rank) {
                let before: Vector4<f64> = self.vectors.column(j).into();
                column -= before * before.dot(&column);
            }
            if column.norm() > INDEPENDENT {
                self.vectors.set_column(self.rank, &column.normalize());
                self.logs[self.rank] = 0.0;
                self.rank += 1;
            }
        }
    }
}

/// A motion with perturbations of it.
pub(crate) struct Along {
    simulation: Simulation,
    model: Model,
    reader: LegReader,
    /// An event that lies beyond the instant reached.
    pending: Option<Event>,
    here: Place,
    /// Nothing is carried before the next event.
    waits: bool,
    /// The impact before bounces that sink, which may turn out to be chatter, and its u.
    before_bounces: Option<(Place, f64)>,
    /// u of the last and of the hardest impact.
    last: f64,
    hardest: f64,
    /// Time between the last two impacts.
    hop: f64,
    /// Whether the columns are kept orthonormal.
    orthonormal: bool,
    impacts: u64,
    /// Fastest decay of a free motion of either body.
    fastest_decay: f64,
}

impl Along {
    /// The motion that goes on from the end of `run`, with `wanted` perturbations, kept orthonormal,
    /// or all four unit vectors, as they come.
    pub fn new(run: &Run, wanted: Option<usize>, cancel: &CancelToken) -> Self {
        let system = &run.system;
        let FinalState { state, clock, mode, .. } = run.final_state;
        let still = system.is_wall_at_rest(&with_wall_at_rest(system, state));
        let model = Model::new(system, &[], still);
        let simulation = run.resumed().cancel_with(cancel);
        let waits = simulation.checkpoint().skips();
        let mut along = Self {
            simulation,
            model,
            reader: LegReader { mode },
            pending: None,
            here: Place {
                state,
                clock,
                at_event: false,
                vectors: Matrix4::zeros(),
                rank: 0,
                logs: [0.0; 4],
            },
            waits,
            before_bounces: None,
            last: 0.0,
            hardest: 0.0,
            hop: 0.0,
            orthonormal: wanted.is_some(),
            impacts: 0,
            fastest_decay: system.fastest_decay(),
        };
        along.start_anew(wanted.unwrap_or(4));
        along.lose_to_contact();
        along
    }

    /// Lets the motion be followed up to `horizon`.
    pub fn extend(&mut self, horizon: Horizon) {
        self.pending = self.pending.take().filter(|event| !matches!(event, Event::Stop(_)));
        self.simulation.extend_to(horizon);
    }

    /// Number of directions there are: a wall at rest has none.
    pub fn directions(&self) -> usize {
        if self.model.wall_at_rest { 2 } else { 4 }
    }

    /// Begins again. Orthonormal perturbations are no unit vectors: without contact, or without
    /// friction, the bodies know nothing of each other, and one perturbation must be of both.
    pub fn start_anew(&mut self, wanted: usize) {
        self.here.vectors = if self.orthonormal { 0.5 * HADAMARD } else { Matrix4::identity() };
        self.here.rank = if self.orthonormal { wanted.min(self.directions()) } else { 4 };
    }

    /// Takes up the directions again that have died out: what was lost before a measurement begins
    /// says nothing of it.
    pub fn take_up_lost(&mut self) {
        let directions = self.directions();
        self.here.take_up_lost(directions);
        if let Some((place, _)) = &mut self.before_bounces {
            place.take_up_lost(directions);
        }
        self.lose_to_contact();
    }

    /// So many perturbations have not died out.
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

    /// ln of the growth of each direction since the last call; the last ones are -inf once they have
    /// died out.
    pub fn take_logs(&mut self) -> [f64; 4] {
        let mut logs = self.here.logs;
        let sinks = self.sinks();
        if let Some((place, _)) = &mut self.before_bounces {
            if sinks {
                // What has come since may yet turn out to be part of chatter, and be redone.
                logs = place.logs;
            }
            place.logs = [0.0; 4];
        }
        let rest = &mut self.here.logs;
        *rest = std::array::from_fn(|i| rest[i] - logs[i]);
        std::array::from_fn(|i| if i < self.here.rank { logs[i] } else { f64::NEG_INFINITY })
    }

    /// Goes on to the instant `end`, or where that falls into skipped impacts, to the next one that
    /// does not.
    pub fn reach(&mut self, end: Clock) -> Result<(), Broken> {
        loop {
            let event = match self.pending.take() {
                Some(event) => event,
                None => match self.simulation.advance(&mut ()) {
                    Some(event) => event.map_err(Broken::Failed)?,
                    None => return Err(Broken::Stopped(StopReason::Completed)),
                },
            };
            if let Event::Stop(stop) = event
                && !stop.reason.reached_the_end()
            {
                return Err(Broken::Stopped(stop.reason));
            }
            let clock = event.clock();
            let stops = matches!(event, Event::Stop(_));
            let chatters = matches!(event, Event::Chatter(_))
                || (stops && self.simulation.checkpoint().skips());
            if !chatters {
                self.doubt_chatter(if clock < end { clock } else { end });
            }
            if self.reader.mode.is_none() && !chatters && !self.sinks() {
                self.fly_to(if clock < end { clock } else { end })?;
            }
            if stops {
                self.pending = Some(event);
                // Among impacts that are or may be skipped there is no instant to go to.
                return if chatters || self.sinks() { Ok(()) } else { self.stand(end) };
            }
            // What lies between the last impact and the end of chatter has no fixed time of its own.
            let skipped = chatters || self.waits || self.sinks();
            if clock >= end && clock > self.here.clock && !skipped {
                self.pending = Some(event);
                return self.stand(if end > self.here.clock { end } else { self.here.clock });
            }
            self.pass(&event)?;
        }
    }

    /// Takes the leg that an event ends.
    fn pass(&mut self, event: &Event) -> Result<(), Broken> {
        if let Event::Chatter(_) = event {
            // As legs of their own, bounces this low would have times with the rounding of g over u.
            if let Some((place, _)) = self.before_bounces.take() {
                self.here = place;
            }
        }
        let start = self.start();
        match self.reader.read(&self.model.system, event) {
            Reading::Ends(leg, clock, state) => {
                if !self.waits && self.here.rank > 0 {
                    let (start, from) = start;
                    let time = Dual::variable(clock.time_in_period, END);
                    let end = Moment { period: clock.period, time };
                    let passage = traverse(&self.model, leg, &start, &from, &end)
                        .ok_or(Broken::NoDerivative)?;
                    self.apply(&to_event(&passage.image, &passage.condition))?;
                }
                self.lose_to(leg);
                self.impacts += u64::from(matches!(leg, Leg::Impact(..)));
                let place = &mut self.here;
                self.hop = self.model.motion.drive.until(place.clock, clock).value();
                (place.state, place.clock, place.at_event) = (state, clock, true);
                self.waits = false;
                if let Event::Impact(impact) = event {
                    self.remember(impact.impact.approach_velocity);
                } else {
                    self.before_bounces = None;
                }
            }
            Reading::Begins(state) => {
                self.here.state = state;
                self.lose_to_contact();
            }
            Reading::Nothing | Reading::Stops(_) => {}
        }
        Ok(())
    }

    /// Keeps the place after an impact, unless it is a low one that follows on a higher one.
    fn remember(&mut self, u: f64) {
        self.hardest = self.hardest.max(u);
        let sinks = u < self.last || u < ROUNDING * self.hardest;
        if u >= LOW_BOUNCE * self.hardest || !sinks || self.before_bounces.is_none() {
            self.before_bounces = Some((self.here.clone(), u));
        }
        self.last = u;
    }

    /// Whether the last impacts sink, as those of chatter do.
    fn sinks(&self) -> bool {
        self.before_bounces.as_ref().is_some_and(|(_, u)| self.last < *u)
    }

    /// The motion flies on to this instant. Bounces of chatter follow one another faster and faster: after
    /// a flight longer than the one before, those that sink are none.
    fn doubt_chatter(&mut self, clock: Clock) {
        let flown = self.model.motion.drive.until(self.here.clock, clock).value();
        if self.sinks() && flown > self.hop {
            self.before_bounces = None;
        }
    }

    /// Flies most of the way to an instant, in steps short enough for strong damping.
    fn fly_to(&mut self, clock: Clock) -> Result<(), Broken> {
        if self.waits || self.rank() == 0 || !self.orthonormal {
            return Ok(());
        }
        let drive = self.model.motion.drive;
        let time = drive.until(self.here.clock, clock).value();
        let steps = (time * self.fastest_decay / MOST_CONTRACTION).min(MOST_STEPS).floor();
        let step = DoubleDouble::new(time / (steps + 1.0));
        let mut done = 0.0;
        while done < steps {
            self.stand(drive.advance(self.here.clock, step))?;
            done += 1.0;
        }
        Ok(())
    }

    /// Goes on to an instant before the next event.
    fn stand(&mut self, clock: Clock) -> Result<(), Broken> {
        let (start, from) = self.start();
        let time = Dual::constant(clock.time_in_period);
        let end = Moment { period: clock.period, time };
        let s = self.model.elapsed(&from, &end);
        let state = match self.reader.mode {
            None => fly(&self.model, &start, &from, s),
            Some(ContactMode::Stick) => start,
            Some(mode) => slide(&self.model, &start, mode, &from, s).ok_or(Broken::NoDerivative)?,
        };
        if self.here.rank > 0 {
            let rows = [state.x1, state.v1, state.v2, state.x2];
            self.apply(&Matrix4::from_fn(|r, c| rows[r].slope[c]))?;
        }
        let place = &mut self.here;
        (place.state, place.clock, place.at_event) = (state.value(), clock, false);
        self.before_bounces = None;
        Ok(())
    }

    /// The place reached, with the directions of its coordinates.
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

    fn apply(&mut self, map: &Matrix4<f64>) -> Result<(), Broken> {
        let place = &mut self.here;
        place.vectors = map * place.vectors;
        // Those that have died out must not grow beyond all numbers.
        place.vectors.columns_mut(place.rank, 4 - place.rank).fill(0.0);
        if !place.vectors.iter().all(|x| x.is_finite()) {
            return Err(Broken::NoDerivative);
        }
        if self.orthonormal {
            self.orthonormalise();
        }
        Ok(())
    }

    /// Gram and Schmidt, from the first column on.
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

    /// Directions that a leg leaves no trace of.
    fn lose_to(&mut self, leg: Leg) {
        let lost = match leg {
            Leg::Impact(kind, _) => {
                let stops =
                    matches!(kind, RegimeKind::StickInApproach | RegimeKind::StickInRestitution);
                usize::from(stops) + usize::from(self.model.system.restitution() == 0.0)
            }
            Leg::Chatter => 2,
            _ => 0,
        };
        self.lose(lost);
        self.lose_to_contact();
    }

    fn lose_to_contact(&mut self) {
        self.lose(match self.reader.mode {
            None => 0,
            Some(ContactMode::Stick) => 3,
            Some(_) => 2,
        });
    }

    fn lose(&mut self, lost: usize) {
        if self.orthonormal {
            self.here.rank = self.here.rank.min(self.directions().saturating_sub(lost));
        }
    }
}
