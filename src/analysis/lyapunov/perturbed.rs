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

mod lanes;
mod mapped;
#[cfg(test)]
mod tests;

pub(crate) use self::lanes::PerturbationLanes;

use nalgebra::Matrix4;

use self::mapped::{Flown, Struck, settle};
use super::LyapunovError;
use super::directions::Directions;
use crate::analysis::tolerances::{LOW_APPROACH, MOST_CONTRACTION, MOST_CONTRACTION_STEPS};
use crate::contact::sustained::ContactMode;
use crate::flight::{Drive, Flight};
use crate::impact::RegimeKind;
use crate::model::parameters::System;
use crate::model::state::{Clock, State};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::dual::Number;
use crate::numerics::lanes::narrow;
use crate::simulate::event::{Event, ImpactEvent};
use crate::simulate::run::FinalState;
use crate::tangent::itinerary::{Leg, LegChange, LegReader, with_wall_at_rest};
use crate::tangent::tolerances::LOW_BOUNCE;
use crate::tangent::{
    Columns, Departure, Dual, DualState, END, Model, Moment, fly, on_contact, slide, to_event,
    traverse,
};

/// The perturbations at one state of a motion.
#[derive(Clone)]
struct PerturbedState<const N: usize> {
    state: State,
    clock: Clock,
    /// Whether it is the state after an event, or between two.
    at_event: bool,
    /// The flight that begins here, if its numbers are known.
    departure: Option<Departure>,
    directions: Directions<N>,
}

impl<const N: usize> PerturbedState<N> {
    /// The flight that begins here.
    fn departure(&self, model: &Model) -> Departure {
        let make = || Departure::new(model, &self.state, self.clock, self.at_event);
        self.departure.unwrap_or_else(make)
    }
}

/// The last impacts, as far as they may lead into chatter.
enum Series<const N: usize> {
    /// Not known.
    None,
    /// The last one is not low, or not lower than the one before.
    High,
    /// They decrease: the state after the one before them, and its u.
    Decreasing(Box<PerturbedState<N>>, f64),
}

/// N perturbations of a motion.
pub(crate) struct Perturbations<const N: usize> {
    model: Model,
    reader: LegReader,
    here: PerturbedState<N>,
    /// Perturbations change only from the next event on.
    paused: bool,
    /// Whether the last impacts may turn out to be chatter.
    series: Series<N>,
    /// u of the last impact, and the largest so far.
    last: f64,
    largest: f64,
    /// The instant of the event before the last one.
    before: Clock,
    /// Whether the directions are kept orthonormal.
    orthonormal: bool,
    impacts: u64,
    /// Fastest decay of a free motion of either body.
    fastest_decay: f64,
}

impl<const N: usize> Perturbations<N> {
    /// Of the motion that goes on from the end of a run, where impacts may be skipped: kept
    /// orthonormal, or unit vectors, which are not.
    pub fn new(system: &System, end: &FinalState, skips: bool, orthonormal: bool) -> Self {
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
                directions: Directions::unit_vectors(),
            },
            paused: skips,
            series: Series::None,
            last: 0.0,
            largest: 0.0,
            before: clock,
            orthonormal,
            impacts: 0,
            fastest_decay: system.fastest_decay(),
        };
        perturbations.restart();
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

    /// Starts with new perturbations.
    pub fn restart(&mut self) {
        self.here.directions = if self.orthonormal {
            Directions::orthonormal(self.directions())
        } else {
            Directions::unit_vectors()
        };
    }

    /// Replaces the directions that have been lost, before a measurement begins.
    pub fn restore_directions(&mut self) {
        let directions = self.directions();
        self.here.directions.restore(directions);
        if let Series::Decreasing(before, _) = &mut self.series {
            before.directions.restore(directions);
        }
        self.reduce_rank_in_contact();
    }

    /// Number of perturbations that are left.
    pub fn rank(&self) -> usize {
        self.here.directions.rank()
    }

    /// The perturbations of (x1, x1', x2', x2) at an instant, one in each column.
    pub fn columns(&self) -> &Columns<N> {
        self.here.directions.columns()
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
    pub fn logs_at(&self, clock: Clock) -> Result<[f64; N], LyapunovError> {
        match &self.series {
            Series::Decreasing(before, _) if self.may_chatter() => {
                let mut directions = before.directions.clone();
                directions.reduce_rank(self.rank());
                Ok(directions.logs())
            }
            _ if self.rank() == 0 || clock <= self.here.clock => Ok(self.here.directions.logs()),
            _ => Ok(self.directions_at(clock)?.logs()),
        }
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

    /// Maps the perturbations through the leg that an event ends; `after`: the flight after an
    /// impact.
    pub fn take(&mut self, event: &Event, after: &Flight) -> Result<(), LyapunovError> {
        if let (Event::Impact(impact), None) = (event, self.reader.mode) {
            return self.take_impact(impact, after);
        }
        if let Event::Chatter(_) = event {
            // The rounding of g, divided by so low a u, would spoil the times of these impacts.
            let series = std::mem::replace(&mut self.series, Series::None);
            if let Series::Decreasing(before, _) = series {
                self.here = *before;
            }
        }
        if let Event::Impact(impact) = event {
            self.note_impact(impact.impact.approach_velocity);
        }
        let mode = self.reader.mode;
        match self.reader.read(&self.model.system, event) {
            LegChange::Ends(leg, clock, state) => {
                if self.counts() {
                    let derivative = self.derivative_of(leg, mode, clock)?;
                    let directions = &mut self.here.directions;
                    let finite = directions.map(&derivative);
                    settle(directions, finite, self.orthonormal)?;
                }
                self.here.departure = None;
                self.arrive(leg, clock, state);
                if !matches!(event, Event::Impact(_)) {
                    self.series = Series::None;
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

    /// As [`Self::take`], for an impact after a free flight: most legs are such.
    fn take_impact(&mut self, impact: &ImpactEvent, after: &Flight) -> Result<(), LyapunovError> {
        self.note_impact(impact.impact.approach_velocity);
        let regime = Leg::regime_of(&self.model.system, (impact.impact.regime, &impact.pre));
        if self.counts() {
            let (model, orthonormal) = (&self.model, self.orthonormal);
            let PerturbedState { state, clock, at_event, departure, directions } = &mut self.here;
            // In place: what is copied at once after it was written in parts is waited for.
            let departure =
                departure.get_or_insert_with(|| Departure::new(model, state, *clock, *at_event));
            narrow(Struck { model, departure, impact, after, regime, directions, orthonormal })?;
        } else {
            self.here.departure = None;
        }
        self.arrive(Leg::Impact(regime.0, regime.1), impact.clock, impact.post);
        Ok(())
    }

    /// Whether there are perturbations to be mapped.
    fn counts(&self) -> bool {
        !self.paused && self.rank() > 0
    }

    /// At the end of a leg.
    fn arrive(&mut self, leg: Leg, clock: Clock, state: State) {
        self.reduce_rank_by(leg);
        self.impacts += u64::from(matches!(leg, Leg::Impact(..)));
        let here = &mut self.here;
        self.before = here.clock;
        (here.state, here.clock, here.at_event) = (state, clock, true);
        self.paused = false;
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
        let outcome =
            traverse(&self.model, leg, &start, &from, &end).ok_or(LyapunovError::NoDerivative)?;
        Ok(to_event(&outcome.image, &outcome.condition))
    }

    /// Before the impact that comes next is mapped: if it is a low one after a higher one, keeps the
    /// state before it.
    fn note_impact(&mut self, u: f64) {
        self.largest = self.largest.max(u);
        let decreases = u < self.last || u < LOW_APPROACH * self.largest;
        if u >= LOW_BOUNCE * self.largest || !decreases {
            self.series = Series::High;
        } else {
            match self.series {
                Series::None => self.series = Series::High,
                Series::High => {
                    self.series = Series::Decreasing(Box::new(self.here.clone()), self.last);
                }
                Series::Decreasing(..) => {}
            }
        }
        self.last = u;
    }

    /// Whether u has decreased in the last impacts, as it does in chatter.
    fn may_chatter(&self) -> bool {
        matches!(self.series, Series::Decreasing(_, u) if self.last < u)
    }

    /// The next event is not before this instant. In chatter each flight is shorter than the one
    /// before: a longer one shows that this is none.
    fn rule_out_chatter(&mut self, clock: Clock) {
        if self.may_chatter() {
            let drive = &self.model.motion.drive;
            let flown = drive.until(self.here.clock, clock).value();
            if flown > drive.until(self.before, self.here.clock).value() {
                self.series = Series::None;
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
    fn directions_at(&self, clock: Clock) -> Result<Directions<N>, LyapunovError> {
        let mut directions = self.here.directions.clone();
        let finite = if self.reader.mode.is_none() {
            let (model, from) = (&self.model, self.here.departure(&self.model));
            narrow(Flown { model, from, clock, directions: &mut directions })
        } else {
            let DualState { x1, v1, x2, v2 } = self.state_at(clock)?;
            let rows = [x1, v1, v2, x2];
            directions.map(&Matrix4::from_fn(|r, c| rows[r].slope[c]))
        };
        settle(&mut directions, finite, self.orthonormal)?;
        Ok(directions)
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
        if self.rank() > 0 {
            self.here.directions = self.directions_at(clock)?;
        }
        let here = &mut self.here;
        (here.state, here.clock, here.at_event) = (state, clock, false);
        here.departure = None;
        self.series = Series::None;
        Ok(())
    }

    /// The present state, with derivatives by its components.
    fn start(&self, mode: Option<ContactMode>) -> (DualState, Moment) {
        let State { x1, v1, x2, v2 } = self.here.state;
        let (model, period) = (&self.model, self.here.clock.period);
        let rest = Dual::constant(0.0);
        let still = model.wall_at_rest;
        let (x1, v1) = (Dual::variable(x1, 0), Dual::variable(v1, 1));
        let v2 = if still { rest } else { Dual::variable(v2, 2) };
        if self.here.at_event {
            let time = Dual::variable(self.here.clock.time_in_period, 3);
            let x2 = model.contact_place(x1);
            return (DualState { x1, v1, x2, v2 }, Moment { period, time });
        }
        let state = match mode {
            None if still => DualState { x1, v1, x2: model.wall_place(), v2 },
            None => DualState { x1, v1, x2: Dual::variable(x2, 3), v2 },
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
            let most = self.directions().saturating_sub(lost);
            self.here.directions.reduce_rank(most);
        }
    }
}
