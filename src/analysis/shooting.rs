//! Kernels of shooting: the conditions that make a sequence of legs a periodic motion, their exact
//! derivatives, what holds a motion inside its sequence, and the derivative of the return map.
//!
//! Unknowns are the nodes (x1, x1', x2', t) just after each event; x2 follows from g = 0, on which
//! all events lie. Each leg gives four equations: x1, x1', x2' at the next node, and the condition
//! of the event (g = 0; p = 0; x1' = 0; the cone of friction), or for chatter the time at which it
//! accumulates. A motion without events is a circuit: unknowns (x1, x1', x2', x2) at the start of a
//! drive period.
//!
//! ```
//! use nalgebra::{DMatrix, DVector};
//! use vibroimpact::analysis::shooting::Orbit;
//! use vibroimpact::tangent::itinerary::{Itinerary, Node};
//! use vibroimpact::{CancelToken, RunOptions, State, System, run};
//!
//! let system = System::builder()
//!     .mass_ratio(0.6).frequency_ratio(2.0).restitution(0.8).gap(0.5)
//!     .drive_frequency(1.8).moment_amplitude(1.0)
//!     .build()?;
//! let start = State::new(0.0, 0.5, 0.0, 0.0)?;
//! let never = CancelToken::never();
//! let settled = run(&system, start, RunOptions::periods(100), &never)?.final_state.state;
//! let (legs, mut nodes) = Itinerary::follow(&system, settled, 1, 1000, &never)?;
//! for _ in 0..10 {
//!     let residual = Orbit::new(&system, &legs, &nodes)?.residual(&[])?;
//!     let rows = residual.values.len();
//!     let jacobian = DMatrix::from_row_slice(rows, residual.columns, &residual.jacobian);
//!     let step = jacobian.lu().solve(&DVector::from_vec(residual.values)).ok_or("singular")?;
//!     for (node, change) in nodes.iter_mut().zip(step.as_slice().chunks(4)) {
//!         let moved: [f64; 4] = std::array::from_fn(|c| node.to_array()[c] - change[c]);
//!         *node = Node::from_array(moved);
//!     }
//! }
//! let return_map = Orbit::new(&system, &legs, &nodes)?.transfer()[0];
//! let largest = return_map.complex_eigenvalues().iter().map(|l| l.norm()).fold(0.0, f64::max);
//! assert!((largest - 0.958707).abs() < 1e-6);
//! assert_eq!(Orbit::new(&system, &legs, &nodes)?.verdict(1000, &never)?.rejection, None);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod hump;
mod trajectory;
mod verdict;

pub(crate) use verdict::{Digits, is_same_cycle, is_violated, largest};
pub use verdict::{Rejection, Verdict};

use crate::analysis::tolerances::NEGATIVE_LEG;
use nalgebra::Matrix4;

use crate::model::error::ParameterError;
use crate::model::parameters::System;
use crate::model::state::State;
use crate::numerics::EPS;
use crate::numerics::dual::Number;
use crate::tangent::border::BorderValue;
pub use crate::tangent::border::{Border, BorderKind, Condition, ConditionValue};
use crate::tangent::itinerary::{Itinerary, Leg, Node, StickEnd};
use crate::tangent::{
    DIRECTIONS, Dual, DualState, END, FREE, LegDetails, LegOutcome, Model, Moment, fly,
    free_gap_acceleration, least_in_slide, mode, slide, slip_from_rest, to_event, traverse,
};

/// Equations and unknowns per leg.
pub(crate) const PER_LEG: usize = 4;
/// Most parameters with respect to which derivatives are given at once.
pub(crate) const MOST_FREE: usize = DIRECTIONS - FREE;

/// The state in a leg that cannot be followed.
const NOWHERE: State = State { x1: f64::NAN, v1: f64::NAN, x2: f64::NAN, v2: f64::NAN };

/// Residual of a motion and its derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct Residual {
    /// 4 per leg.
    pub values: Vec<f64>,
    /// Row by row, with a column for each unknown and then for each free parameter.
    pub jacobian: Vec<f64>,
    /// Number of columns.
    pub columns: usize,
}

/// A motion that may be periodic: nodes for an itinerary.
#[derive(Debug, Clone)]
pub struct Orbit<'a> {
    itinerary: &'a Itinerary,
    nodes: &'a [Node],
    system: System,
}

/// A leg, computed from the node at its start.
struct FollowedLeg {
    /// x1, x1', x2' after the event at its end.
    image: [Dual; 3],
    /// Zero where the event is at the end time.
    condition: Dual,
    /// State just before that event.
    pre: State,
    /// Where it starts, and how long it takes.
    start: (DualState, Moment),
    length: f64,
    tests: Vec<ConditionValue>,
}

impl<'a> Orbit<'a> {
    /// An orbit of `system`.
    ///
    /// # Errors
    /// [`ParameterError`] if there is not one node for each leg, or no drive period.
    pub fn new(
        system: &System,
        itinerary: &'a Itinerary,
        nodes: &'a [Node],
    ) -> Result<Self, ParameterError> {
        if nodes.len() != itinerary.legs.len() {
            return Err(ParameterError::new("nodes", nodes.len(), "one for each leg"));
        }
        if system.drive_frequency() == 0.0 {
            return Err(ParameterError::new("drive_frequency", 0.0, "> 0 for a period"));
        }
        Ok(Self { itinerary, nodes, system: system.clone() })
    }

    /// The residual and its derivatives with respect to the nodes and the parameters `free`.
    ///
    /// Values are NaN where a leg cannot be followed.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown or too many parameters.
    pub fn residual(&self, free: &[String]) -> Result<Residual, ParameterError> {
        let model = self.model(free)?;
        let count = self.nodes.len();
        let unknowns = PER_LEG * count;
        let columns = unknowns + free.len();
        let mut values = vec![f64::NAN; unknowns];
        let mut jacobian = vec![f64::NAN; unknowns * columns];
        for i in 0..count {
            let Some(followed) = self.follow_leg(&model, i, false) else { continue };
            let next = (i + 1) % count;
            let target = self.nodes[next].to_array();
            let rows: [(Dual, f64, Option<usize>); PER_LEG] = if self.is_circuit() {
                let [x1, v1, v2] = followed.image;
                let x2 = followed.condition;
                std::array::from_fn(|c| ([x1, v1, v2, x2][c], target[c], Some(c)))
            } else {
                let [x1, v1, v2] = followed.image;
                [
                    (x1, target[0], Some(0)),
                    (v1, target[1], Some(1)),
                    (v2, target[2], Some(2)),
                    (followed.condition, 0.0, None),
                ]
            };
            for (c, (image, target, into)) in rows.into_iter().enumerate() {
                let row = PER_LEG * i + c;
                let line = &mut jacobian[row * columns..(row + 1) * columns];
                line.fill(0.0);
                values[row] = image.value - target;
                for d in 0..PER_LEG {
                    line[PER_LEG * i + d] += image.slope[d];
                }
                if !self.is_circuit() {
                    line[PER_LEG * next + 3] += image.slope[END];
                }
                if let Some(c) = into {
                    line[PER_LEG * next + c] -= 1.0;
                }
                for p in 0..free.len() {
                    line[unknowns + p] += image.slope[FREE + p];
                }
            }
        }
        Ok(Residual { values, jacobian, columns })
    }

    /// The functions that hold the motion inside its itinerary; those of a leg that cannot be
    /// followed are missing.
    #[must_use]
    pub fn tests(&self) -> Vec<ConditionValue> {
        let Ok(model) = self.model(&[]) else { return Vec::new() };
        (0..self.nodes.len())
            .filter_map(|i| Some(self.follow_leg(&model, i, true)?.tests))
            .flatten()
            .collect()
    }

    /// Derivative of each leg's map with respect to (x1, x1', x2', t) at its start (row by row):
    /// the eigenvalues of their product are the Floquet multipliers. Of a circuit, with respect to
    /// (x1, x1', x2', x2). NaN for a leg that cannot be followed.
    #[must_use]
    pub fn transfer(&self) -> Vec<Matrix4<f64>> {
        self.followed().iter().map(|followed| self.transfer_of(followed.as_ref())).collect()
    }

    fn transfer_of(&self, followed: Option<&FollowedLeg>) -> Matrix4<f64> {
        let Some(followed) = followed else { return Matrix4::from_element(f64::NAN) };
        let [x1, v1, v2] = followed.image;
        if self.is_circuit() {
            return Matrix4::from_fn(|r, c| [x1, v1, v2, followed.condition][r].slope[c]);
        }
        to_event(&followed.image, &followed.condition)
    }

    /// All legs, without their tests; `None` for one that cannot be followed.
    fn followed(&self) -> Vec<Option<FollowedLeg>> {
        let model = self.model(&[]).ok();
        (0..self.nodes.len())
            .map(|i| model.as_ref().and_then(|model| self.follow_leg(model, i, false)))
            .collect()
    }

    /// State just before the event that ends each leg; NaN for a leg that cannot be followed.
    #[must_use]
    pub fn before_events(&self) -> Vec<State> {
        self.followed().iter().map(|leg| leg.as_ref().map_or(NOWHERE, |leg| leg.pre)).collect()
    }

    /// State at a time after the start of a leg, free flight and contact alike, whether or not the
    /// bodies would overlap; chatter is left out. Not finite where the leg cannot be followed,
    /// `None` where there is none of this number.
    #[must_use]
    pub fn state_in_leg(&self, leg: usize, time: f64) -> Option<State> {
        let kind = *self.itinerary.legs.get(leg)?;
        let model = self.model(&[]).ok()?;
        let (start, moment) = self.start(&model, leg);
        let s = Dual::constant(time);
        Some(match kind {
            Leg::SlideToRelease(positive) | Leg::SlideToStop(positive) => {
                slide(&model, &start, mode(positive), &moment, s)?.value()
            }
            Leg::Stick(_) => start.value(),
            _ => fly(&model, &start, &moment, s).value(),
        })
    }

    fn model(&self, free: &[String]) -> Result<Model, ParameterError> {
        if free.len() > MOST_FREE {
            return Err(ParameterError::new("parameters", free.len(), "at most two"));
        }
        for name in free {
            if self.system.get(name).is_none() {
                return Err(self.system.unknown(name));
            }
        }
        Ok(Model::new(&self.system, free, self.itinerary.wall_at_rest))
    }

    fn is_circuit(&self) -> bool {
        self.itinerary.legs[0] == Leg::Circuit
    }

    /// State and instant at the start of a leg.
    fn start(&self, model: &Model, leg: usize) -> (DualState, Moment) {
        let [x1, v1, v2, last] = self.nodes[leg].to_array();
        let period = self.itinerary.clocks[leg];
        let variable = Dual::variable;
        let (x1, v1) = (variable(x1, 0), variable(v1, 1));
        let rest = Dual::constant(0.0);
        let still = model.wall_at_rest;
        let v2 = if still { rest } else { variable(v2, 2) };
        if self.is_circuit() {
            let x2 = if still { model.wall_place() } else { variable(last, 3) };
            return (DualState { x1, v1, x2, v2 }, Moment { period, time: rest });
        }
        let state = DualState { x1, v1, x2: model.contact_place(x1), v2 };
        (state, Moment { period, time: variable(last, 3) })
    }

    /// When a leg ends.
    fn end(&self, leg: usize) -> Moment {
        let next = (leg + 1) % self.nodes.len();
        let turn = if next == 0 { self.itinerary.periods } else { 0 };
        let period = self.itinerary.clocks[next] + turn;
        if self.is_circuit() {
            return Moment { period, time: Dual::constant(0.0) };
        }
        Moment { period, time: Dual::variable(self.nodes[next].time, END) }
    }

    /// Whether the leg before this one ends in an impact or an accumulation point.
    fn follows_impact(&self, leg: usize) -> bool {
        let count = self.nodes.len();
        let before = self.itinerary.legs[(leg + count - 1) % count];
        matches!(before, Leg::Impact(..) | Leg::Chatter)
    }

    /// What holds a slide in its direction at the start: x1', or where the tip is at rest, its
    /// acceleration. After a stick that is the condition of the leg before; a slide to a stop that
    /// begins with x1' = 0 has no length.
    fn slip_at_start(
        &self,
        model: &Model,
        leg: usize,
        start: &DualState,
        from: &Moment,
        positive: bool,
    ) -> Option<f64> {
        let count = self.nodes.len();
        let before = self.itinerary.legs[(leg + count - 1) % count];
        if model.system.friction() == 0.0 || matches!(before, Leg::Stick(_)) {
            return None;
        }
        let speed = if positive { start.v1.value } else { -start.v1.value };
        // Stick in an impact, chatter that stops the tip: x1' is zero to rounding.
        if matches!(before, Leg::SlideToStop(_)) || speed.abs() <= EPS {
            return slip_from_rest(model, start, from, mode(positive));
        }
        matches!(self.itinerary.legs[leg], Leg::SlideToRelease(_)).then_some(speed)
    }

    /// What stays positive in a slide, with the times at which it is taken.
    fn slide_tests(
        &self,
        model: &Model,
        leg: usize,
        positive: bool,
        (start, from): (&DualState, &Moment),
        length: f64,
    ) -> Vec<(Border, f64, f64)> {
        let slip = self.slip_at_start(model, leg, start, from, positive);
        let [force, speed] = least_in_slide(model, start, mode(positive), from, length);
        let speed = speed.filter(|_| model.system.friction() > 0.0);
        slip.map(|value| (Border::SlipAtStart, value, 0.0))
            .into_iter()
            .chain(force.map(|(time, least)| (Border::ForceInSlide, least, time)))
            .chain(speed.map(|(time, least)| (Border::SpeedInSlide, least, time)))
            .collect()
    }

    fn follow_leg(&self, model: &Model, leg: usize, tested: bool) -> Option<FollowedLeg> {
        let (start, from) = self.start(model, leg);
        let end = self.end(leg);
        let s = model.elapsed(&from, &end);
        // A leg may become a little shorter than nothing on the way to a solution.
        if !s.value.is_finite() || s.value < -NEGATIVE_LEG * model.motion.span {
            return None;
        }
        let mut tests = Vec::new();
        let mut test = |border, value: f64, time: f64| {
            if tested {
                tests.push(ConditionValue { condition: Condition { border, leg }, value, time });
            }
        };
        let kind = self.itinerary.legs[leg];
        let held = !matches!(kind, Leg::Impact(..) | Leg::Chatter | Leg::Circuit);
        if held {
            let follows_impact = self.follows_impact(leg);
            if follows_impact {
                let force = free_gap_acceleration(model, &start, &from).value;
                test(Border::ForceAtStart, force, 0.0);
            }
            // A contact that begins and ends with no force has no length either.
            if !(follows_impact
                && matches!(kind, Leg::SlideToRelease(_) | Leg::Stick(StickEnd::Release)))
            {
                test(Border::Length, s.value, s.value);
            }
        }
        let LegOutcome { image, condition, pre, details } =
            traverse(model, kind, &start, &from, &end)?;
        match details {
            LegDetails::Impact(impact) => {
                test(Border::ApproachVelocity, impact.approach_velocity.value, s.value);
                for BorderValue { border, value } in impact.borders {
                    test(border, value, s.value);
                }
            }
            LegDetails::Chatter(borders) => {
                for BorderValue { border, value } in borders {
                    test(border, value, s.value);
                }
            }
            LegDetails::Slide(state, force) => {
                let positive = matches!(kind, Leg::SlideToRelease(true) | Leg::SlideToStop(true));
                if tested {
                    for (border, value, time) in
                        self.slide_tests(model, leg, positive, (&start, &from), s.value)
                    {
                        test(border, value, time);
                    }
                }
                if matches!(kind, Leg::SlideToStop(_)) {
                    test(Border::ForceAtStop, force.value, s.value);
                } else if model.system.friction() > 0.0 {
                    let direction = if positive { 1.0 } else { -1.0 };
                    let speed = state.v1.value * direction;
                    test(Border::SpeedAtRelease, speed, s.value);
                }
            }
            LegDetails::Stick(condition) => {
                for BorderValue { border, value } in condition.others {
                    test(border, value, s.value);
                }
            }
            LegDetails::Circuit => {}
        }
        if tested && !held && kind != Leg::Chatter {
            let touching = kind != Leg::Circuit;
            if let Some((time, gap)) = hump::highest(model, &start, &from, s.value, touching) {
                test(Border::Flight, -gap, time);
            }
        }
        let start = (start, from);
        Some(FollowedLeg { image, condition, pre, start, length: s.value, tests })
    }

    /// Largest local maximum of the gap inside each leg and its time from the leg's start; `None`
    /// where there is none, or no flight.
    #[must_use]
    pub fn humps(&self) -> Vec<Option<(f64, f64)>> {
        let Ok(model) = self.model(&[]) else { return vec![None; self.nodes.len()] };
        (0..self.nodes.len())
            .map(|i| {
                let kind = self.itinerary.legs[i];
                let followed = self.follow_leg(&model, i, false)?;
                let (state, moment) = &followed.start;
                matches!(kind, Leg::Impact(..) | Leg::Circuit).then_some(())?;
                hump::highest(&model, state, moment, followed.length, kind != Leg::Circuit)
            })
            .collect()
    }
}
