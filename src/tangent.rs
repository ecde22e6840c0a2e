//! Derivatives of the legs of a motion: of flights, impacts in every regime, complete chatter and
//! contact phases, with respect to where and when a leg starts, when it ends, and up to two
//! parameters (docs/theory.md, section 7).
//!
//! Everything smooth within a leg is written for numbers that carry their derivatives; event times
//! are unknowns of their own, so that no leg divides by an approach velocity. Eliminating them
//! gives the derivative of the return map: dt' = -(dh . dy)/h', h the condition of the event, which
//! for an impact is what the saltation matrix S = R + (F+ - R F-)(grad g)^T/g'^- says.

pub mod border;
mod chatter;
mod contact;
mod equation;
mod flight;
mod impact;
pub mod itinerary;
mod leg;
mod long_flight;
mod sensitivity;
mod strike;
pub mod structure;
pub(crate) mod tolerances;

pub(crate) use contact::{
    free_gap_acceleration, least_in_slide, on_contact, slide, slide_with_rates, slip_from_rest,
    stick_end,
};
pub(crate) use flight::fly;
pub(crate) use leg::{LegDetails, LegOutcome, mode, to_event, traverse};
pub(crate) use strike::{
    Columns, Departure, Derivative, ImpactPoint, Numbers, Rates, Strike, flown, scaled,
};

pub use sensitivity::{
    Along, Legs, OneSided, OneSidedReason, Sensitivity, SensitivityError, SensitivityTable,
    StructureLegs, run_with_sensitivity, sensitivity, structure_run_with_sensitivity,
    structure_sensitivity,
};
#[cfg(feature = "python")]
pub(crate) use sensitivity::{carried_out, structure_carried_out};

use chatter::{Accumulation, accumulate};
use contact::stick_condition;
use impact::impact_in_regime;

use smallvec::SmallVec;

use crate::flight::{FreeMotion, Trig};
use crate::model::angle::Angle;
use crate::model::parameters::{Parameters, System};
use crate::model::restitution::RestitutionCurve;
use crate::model::state::{Clock, State};
use crate::numerics::dual::{self, Number};

/// The node a leg starts from (4), the time it ends at, two parameters.
pub(crate) const DIRECTIONS: usize = 7;
/// Direction of the end time.
pub(crate) const END: usize = 4;
/// Directions of the parameters.
pub(crate) const FREE: usize = 5;

pub(crate) type Dual<const N: usize = DIRECTIONS> = dual::Dual<N>;

/// A system with the derivatives of its parameters.
pub(crate) struct Model<const N: usize = DIRECTIONS> {
    pub system: System,
    pub motion: FreeMotion,
    pub parameters: Parameters<Dual<N>>,
    /// 2 pi/omega.
    pub period: Dual<N>,
    /// Body 2 is a wall at rest: left out.
    pub wall_at_rest: bool,
    /// Of pendulum and oscillator, whose equations vary.
    steps: [equation::Steps; 2],
    /// The numbers of the restitution curve that vary, with their directions.
    of_curve: SmallVec<[(usize, usize); 2]>,
}

/// State of both bodies, with derivatives.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DualState<const N: usize = DIRECTIONS> {
    pub x1: Dual<N>,
    pub v1: Dual<N>,
    pub x2: Dual<N>,
    pub v2: Dual<N>,
}

/// An instant: completed drive periods, and the time since.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moment<const N: usize = DIRECTIONS> {
    pub period: i64,
    pub time: Dual<N>,
}

impl<const N: usize> DualState<N> {
    pub fn value(&self) -> State {
        State { x1: self.x1.value, v1: self.v1.value, x2: self.x2.value, v2: self.v2.value }
    }
}

impl<const N: usize> Moment<N> {
    pub fn clock(&self) -> Clock {
        Clock::new(self.period, self.time.value)
    }

    pub fn later(self, by: Dual<N>) -> Self {
        Self { time: self.time + by, ..self }
    }
}

impl Model {
    /// With derivatives in the directions `FREE`, `FREE + 1` for the parameters named.
    pub fn new(system: &System, free: &[String], wall_at_rest: bool) -> Self {
        let of = |name: &str| free.iter().position(|wanted| wanted == name).map(|i| FREE + i);
        Self::by(system, of, wall_at_rest)
    }
}

impl<const N: usize> Model<N> {
    /// With derivatives by each parameter in its direction, if it has one.
    pub fn by(
        system: &System,
        direction: impl Fn(&str) -> Option<usize>,
        wall_at_rest: bool,
    ) -> Self {
        let parameters = system.parameters(|name, value| match direction(name) {
            Some(i) => Dual::variable(value, i),
            None => Dual::constant(value),
        });
        let motion = FreeMotion::new(system);
        let period = motion.drive.period.value();
        let omega = parameters.drive_frequency;
        // Of a drive that stands still no periods are counted.
        let rate = if motion.drive.has_period() { -period / omega.value } else { 0.0 };
        let period = Dual::chain(period, [(rate, omega)]);
        let names = system.restitution_curve().map_or_else(Vec::new, RestitutionCurve::names);
        let of_curve = names.iter().filter_map(|name| {
            let place = system.coefficient().place_of(name)?;
            Some((place, direction(name)?))
        });
        let of_curve = of_curve.collect();
        let bodies = [parameters.pendulum(), parameters.oscillator()];
        let steps = bodies.map(|body| flight::steps(&body, omega));
        let system = system.clone();
        Self { system, motion, parameters, period, wall_at_rest, steps, of_curve }
    }

    /// Sine and cosine of x1; 0 and 1 in direct contact.
    pub fn angle(&self, x1: Dual<N>) -> Angle<Dual<N>> {
        self.parameters.contact.angle(x1)
    }

    /// Position of the tip along the normal.
    fn tip(&self, x1: Dual<N>) -> Dual<N> {
        self.parameters.contact.tip(x1, self.angle(x1))
    }

    /// g.
    pub fn gap(&self, state: &DualState<N>) -> Dual<N> {
        self.tip(state.x1) - state.x2 - self.parameters.gap
    }

    /// r of an impact at the approach velocity u.
    pub fn restitution(&self, u: Dual<N>) -> Dual<N> {
        let Some(curve) = self.system.restitution_curve() else {
            return self.parameters.restitution;
        };
        let at = curve.with_slope(u.value);
        let mut r = Dual::chain(at.value, [(at.by_speed, u)]);
        for &(place, direction) in &self.of_curve {
            r.slope[direction] += curve.by_number(u.value, place);
        }
        r
    }

    /// x2 of a wall at rest: its equilibrium under the constant force.
    pub fn wall_place(&self) -> Dual<N> {
        self.parameters.static_force
    }

    /// x2 on the contact.
    pub fn contact_place(&self, x1: Dual<N>) -> Dual<N> {
        if self.wall_at_rest { self.wall_place() } else { self.tip(x1) - self.parameters.gap }
    }

    /// u = g'.
    pub fn approach_velocity(&self, state: &DualState<N>) -> Dual<N> {
        self.angle(state.x1).gap_rate(state.v1, state.v2)
    }

    /// Cosine and sine of the forcing phase, the sine also of a drive that stands still, whose load
    /// changes with its phase.
    #[inline(always)]
    #[allow(clippy::inline_always)] // for each impact
    pub fn trig(&self, clock: Clock) -> Trig {
        let trig = self.motion.drive.trig_at(clock);
        let still = !self.motion.drive.has_period();
        if still { Trig { sin: self.system.phase.sin(), ..trig } } else { trig }
    }

    /// Cosine and sine of the forcing phase, and the phase as an angle.
    pub fn phase(&self, moment: &Moment<N>) -> (Trig, Dual<N>) {
        let trig = self.trig(moment.clock());
        let angle = self.parameters.drive_frequency * moment.time + self.parameters.phase;
        (trig, angle)
    }

    /// cos psi and sin psi, with derivatives.
    pub fn load(&self, moment: &Moment<N>) -> (Dual<N>, Dual<N>) {
        let (trig, angle) = self.phase(moment);
        (Dual::chain(trig.cos, [(-trig.sin, angle)]), Dual::chain(trig.sin, [(trig.cos, angle)]))
    }

    /// Time between two instants.
    pub fn elapsed(&self, from: &Moment<N>, to: &Moment<N>) -> Dual<N> {
        let value = self.motion.drive.until(from.clock(), to.clock()).value();
        let whole = (to.period - from.period) as f64;
        Dual::chain(value, [(1.0, to.time), (-1.0, from.time), (whole, self.period)])
    }

    /// Free accelerations of both bodies.
    pub fn free_accelerations(
        &self,
        state: &DualState<N>,
        moment: &Moment<N>,
    ) -> (Dual<N>, Dual<N>) {
        let (cos_psi, _) = self.load(moment);
        (
            self.parameters.pendulum().acceleration(state.x1, state.v1, cos_psi),
            self.parameters.oscillator().acceleration(state.x2, state.v2, cos_psi),
        )
    }
}
