//! A free flight and the impact at its end, as they map small perturbations of a motion: the
//! derivative of the leg applied to a few of them, without its matrix.
//!
//! With y the perturbation of (x1, x1', x2, x2') at a fixed time, F the rates of these four and
//! u = g' before the impact, the flight turns y by the free oscillation, and the impact
//! (docs/theory.md, section 7) comes later by dt:
//!
//! ```text
//! dt = -grad g . y/u        before: y + F- dt        after: the same, through the impulse path.
//! ```

#![allow(clippy::inline_always)] // one of them for each impact of a motion that is followed

use super::Model;
use super::impact::regime_path;
use super::itinerary::Signs;
use crate::flight::{Equation, Flight, FreeMotion};
use crate::impact::{PathEnd, RegimeKind, slipping_path};
use crate::model::angle::Angle;
use crate::model::contact_coordinates::ContactCoordinates;
use crate::model::parameters::{Contact, ImpactLaw};
use crate::model::restitution::RestitutionAt;
use crate::model::state::{Clock, State};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::dual::{Dual, Number};
use crate::simulate::event::ImpactEvent;

/// Components of N perturbations, one in each column: of a node (x1, x1', x2', t) after an event,
/// or of the state at a fixed time, (x1, x1', x2', x2).
pub(crate) type Columns<const N: usize> = [[f64; N]; 4];

/// Derivatives of (x, x') of the pendulum and of body 2 by those at an earlier time of a free
/// flight.
pub(crate) type Transitions = [[[f64; 2]; 2]; 2];

/// What maps perturbations.
pub(crate) trait Derivative {
    fn map<const N: usize>(&self, columns: &Columns<N>) -> Columns<N>;
}

/// x1', x2' and their free accelerations: how fast a free motion changes.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Rates {
    pub velocities: [f64; 2],
    pub accelerations: [f64; 2],
}

impl Rates {
    /// Of free motion from a state, at this phase of the drive.
    #[inline(always)]
    pub fn at(state: &State, cos_psi: f64, bodies: (&Equation, &Equation)) -> Self {
        let State { x1, v1, x2, v2 } = *state;
        let accelerations =
            [bodies.0.acceleration(x1, v1, cos_psi), bodies.1.acceleration(x2, v2, cos_psi)];
        Self { velocities: [v1, v2], accelerations }
    }

    /// After an impact that leaves these velocities: of the accelerations it changes the damping
    /// alone.
    #[inline(always)]
    pub fn after(&self, velocities: [f64; 2], decay_rates: [f64; 2]) -> Self {
        let after = |i: usize| {
            let change = velocities[i] - self.velocities[i];
            self.accelerations[i] - 2.0 * decay_rates[i] * change
        };
        let accelerations = [after(0), after(1)];
        Self { velocities, accelerations }
    }
}

/// Perturbations of a node, `slope` = dx2/dx1 on the contact, at a fixed time: an event that comes
/// later by dt leaves the flight behind by so much.
#[inline(always)]
fn at_fixed_time<const N: usize>(columns: &Columns<N>, rates: &Rates, slope: f64) -> Columns<N> {
    let ([x1, v1, v2, dt], [r1, r2], [a1, a2]) = (columns, rates.velocities, rates.accelerations);
    [
        std::array::from_fn(|i| x1[i] - r1 * dt[i]),
        std::array::from_fn(|i| v1[i] - a1 * dt[i]),
        std::array::from_fn(|i| v2[i] - a2 * dt[i]),
        std::array::from_fn(|i| slope * x1[i] - r2 * dt[i]),
    ]
}

/// Perturbations at a fixed time, turned by a free flight.
#[inline(always)]
fn turned<const N: usize>([x1, v1, v2, x2]: &Columns<N>, by: &Transitions) -> Columns<N> {
    let [[[xx1, xv1], [vx1, vv1]], [[xx2, xv2], [vx2, vv2]]] = *by;
    [
        std::array::from_fn(|i| xx1 * x1[i] + xv1 * v1[i]),
        std::array::from_fn(|i| vx1 * x1[i] + vv1 * v1[i]),
        std::array::from_fn(|i| vx2 * x2[i] + vv2 * v2[i]),
        std::array::from_fn(|i| xx2 * x2[i] + xv2 * v2[i]),
    ]
}

/// Perturbations of a node after a free flight from it.
#[inline(always)]
pub(crate) fn flown<const N: usize>(
    columns: &Columns<N>,
    rates: &Rates,
    slope: f64,
    by: &Transitions,
) -> Columns<N> {
    turned(&at_fixed_time(columns, rates, slope), by)
}

/// The numbers of the bodies that an impact depends on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Numbers {
    pub mass_ratio: f64,
    pub friction: f64,
    /// r at this impact.
    pub restitution: RestitutionAt,
    /// 1, or 0 where body 2 is a wall at rest, which perturbations leave out.
    pub moves: f64,
}

/// An impact, as far as perturbations look at it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ImpactPoint {
    /// Of x1; whether the normal turns with it.
    pub angle: Angle,
    pub turns: bool,
    /// Before the impact.
    pub rates: Rates,
    pub approach_velocity: f64,
    pub numbers: Numbers,
}

impl ImpactPoint {
    /// The contact in an impact that comes later by a delay, sin x1 of this sign, with how much x1
    /// differs there, and the delay: from perturbations at a fixed time before the impact.
    #[inline(always)]
    fn contact<const N: usize>(
        &self,
        [x1, v1, v2, x2]: &Columns<N>,
        side: f64,
    ) -> (ContactCoordinates<Dual<N>>, [f64; N], [f64; N]) {
        let Self { angle, rates, approach_velocity, numbers, .. } = *self;
        let ([r1, _], [a1, a2]) = (rates.velocities, rates.accelerations);
        let per_approach = 1.0 / approach_velocity;
        let delay: [f64; N] = std::array::from_fn(|i| (x2[i] - angle.cos * x1[i]) * per_approach);
        let before = [
            std::array::from_fn(|i| x1[i] + r1 * delay[i]),
            std::array::from_fn(|i| v1[i] + a1 * delay[i]),
            std::array::from_fn(|i| numbers.moves * (v2[i] + a2 * delay[i])),
        ];
        let numbers = [numbers.mass_ratio, numbers.friction].map(Dual::constant);
        (self.contact_of(&before, numbers, side), before[0], delay)
    }

    /// The contact with mbar and mu, from derivatives of x1, x1' and x2' before the impact, at its own time.
    #[inline(always)]
    fn contact_of<const N: usize>(
        &self,
        [x1, v1, v2]: &[[f64; N]; 3],
        [mass_ratio, friction]: [Dual<N>; 2],
        side: f64,
    ) -> ContactCoordinates<Dual<N>> {
        let Self { angle, turns, rates, .. } = *self;
        let [r1, r2] = rates.velocities;
        let by_angle = |value: f64, rate: f64| {
            let slope = std::array::from_fn(|i| rate * x1[i]);
            if turns { Dual { value, slope } } else { Dual::constant(value) }
        };
        ContactCoordinates::at_tip(
            (by_angle(angle.sin, angle.cos), by_angle(angle.cos, -angle.sin)),
            (Dual { value: r1, slope: *v1 }, Dual { value: r2, slope: *v2 }),
            mass_ratio,
            friction,
            side,
        )
    }

    /// r, with its derivatives by the approach velocity.
    #[inline(always)]
    fn restitution<const N: usize>(&self, contact: &ContactCoordinates<Dual<N>>) -> Dual<N> {
        let RestitutionAt { value, by_speed } = self.numbers.restitution;
        if by_speed == 0.0 {
            return Dual::constant(value);
        }
        Dual::chain(value, [(by_speed, contact.approach_velocity())])
    }

    /// Perturbations at a fixed time before an impact without friction, or whose slip keeps its
    /// direction, mapped to the node after it.
    #[inline(always)]
    pub fn map_in_slip<const N: usize>(&self, columns: &Columns<N>) -> Columns<N> {
        let (contact, x1, delay) = self.contact(columns, 1f64.copysign(self.angle.sin));
        let direction = 1f64.copysign(self.rates.velocities[0]);
        let restitution = self.restitution(&contact);
        let end = slipping_path(&contact, restitution, direction);
        [x1, end.slip.slope, end.parting.slope, delay]
    }

    /// As [`ImpactPoint::map_in_slip`], of an impact in this regime.
    #[inline(always)]
    pub fn map_in_regime<const N: usize>(
        &self,
        columns: &Columns<N>,
        law: ImpactLaw,
        kind: RegimeKind,
        signs: Signs,
    ) -> Columns<N> {
        let (contact, x1, delay) = self.contact(columns, signs.side.value());
        let law = (self.restitution(&contact), &law);
        let (_, end) = regime_path(&contact, law, kind, signs.direction.value());
        [x1, end.slip.slope, end.parting.slope, delay]
    }
}

impl ImpactPoint {
    /// An impact in this regime with the derivatives of x1' and x2' after it, from those of x1, x1' and x2'
    /// before it, at its own time, and of mbar, mu and r.
    #[inline(always)]
    pub fn after<const N: usize>(
        &self,
        before: &[[f64; N]; 3],
        [mass_ratio, friction, restitution]: [[f64; N]; 3],
        law: ImpactLaw,
        (kind, signs): (RegimeKind, Signs),
    ) -> PathEnd<Dual<N>> {
        let number = |value: f64, slope: [f64; N]| Dual { value, slope };
        let Numbers { mass_ratio: m, friction: mu, .. } = self.numbers;
        let numbers = [number(m, mass_ratio), number(mu, friction)];
        let contact = self.contact_of(before, numbers, signs.side.value());
        let r = self.restitution(&contact) + number(0.0, restitution);
        regime_path(&contact, (r, &law), kind, signs.direction.value()).1
    }
}

/// Where a flight begins, as far as its perturbations look at it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Departure {
    pub clock: Clock,
    pub rates: Rates,
    /// dx2/dx1 on the contact; `None` where the flight begins between two events.
    pub slope: Option<f64>,
}

impl Departure {
    /// From this state at `clock`, after an event or between two.
    pub fn new(model: &Model, state: &State, clock: Clock, after_event: bool) -> Self {
        let slope = || if model.wall_at_rest { 0.0 } else { model.system.tip_slope(state.x1) };
        let rates = rates_at(model, state, model.motion.drive.trig_at(clock).cos);
        Self { clock, rates, slope: after_event.then(slope) }
    }

    /// The free flight from here to an instant.
    #[inline(always)]
    pub fn flight(&self, model: &Model, end: Clock) -> FreeFlight {
        // To the digits of the lanes, with which exponents agree to the last bit.
        let time = model.motion.drive.roughly_until(self.clock, end);
        let [first, second] = model.motion.transitions(DoubleDouble::new(time));
        let moves = moves(model);
        FreeFlight { from: *self, transitions: [first, scaled(second, moves)] }
    }
}

/// A matrix times a number.
#[inline(always)]
pub(crate) fn scaled([[a, b], [c, d]]: [[f64; 2]; 2], factor: f64) -> [[f64; 2]; 2] {
    [[factor * a, factor * b], [factor * c, factor * d]]
}

#[inline(always)]
fn rates_at(model: &Model, state: &State, cos_psi: f64) -> Rates {
    let FreeMotion { pendulum, oscillator, .. } = &model.motion;
    Rates::at(state, cos_psi, (&pendulum.equation, &oscillator.equation))
}

#[inline(always)]
fn moves(model: &Model) -> f64 {
    if model.wall_at_rest { 0.0 } else { 1.0 }
}

/// A free flight between two fixed times, or from an event to a fixed time.
pub(crate) struct FreeFlight {
    from: Departure,
    transitions: Transitions,
}

impl Derivative for FreeFlight {
    #[inline(always)]
    fn map<const N: usize>(&self, columns: &Columns<N>) -> Columns<N> {
        match self.from.slope {
            Some(slope) => flown(columns, &self.from.rates, slope, &self.transitions),
            None => turned(columns, &self.transitions),
        }
    }
}

/// A free flight and the impact that ends it, to the node after it.
pub(crate) struct Strike<'a> {
    model: &'a Model,
    flight: FreeFlight,
    impact: &'a ImpactEvent,
    point: ImpactPoint,
    regime: (RegimeKind, Signs),
}

impl<'a> Strike<'a> {
    /// The leg from this departure to an impact; `after`: the flight that begins there.
    #[inline(always)]
    pub fn new(
        model: &'a Model,
        from: &Departure,
        impact: &'a ImpactEvent,
        after: &Flight,
        regime: (RegimeKind, Signs),
    ) -> Self {
        let system = &model.system;
        let point = ImpactPoint {
            angle: after.angle,
            turns: system.contact == Contact::Oblique,
            rates: rates_at(model, &impact.pre, after.start.cos),
            approach_velocity: impact.impact.approach_velocity,
            numbers: Numbers {
                mass_ratio: system.mass_ratio,
                friction: system.friction,
                restitution: system.coefficient().with_slope(impact.impact.approach_velocity),
                moves: moves(model),
            },
        };
        Self { model, flight: from.flight(model, impact.clock), impact, point, regime }
    }

    /// Where the next flight begins.
    #[inline(always)]
    pub fn departure(&self) -> Departure {
        let Self { model, point, impact, .. } = self;
        let decay_rates =
            [&model.motion.pendulum, &model.motion.oscillator].map(|body| body.equation.decay_rate);
        Departure {
            clock: impact.clock,
            rates: point.rates.after([impact.post.v1, impact.post.v2], decay_rates),
            slope: Some(point.numbers.moves * point.angle.cos),
        }
    }
}

impl Derivative for Strike<'_> {
    #[inline(always)]
    fn map<const N: usize>(&self, columns: &Columns<N>) -> Columns<N> {
        let columns = self.flight.map(columns);
        let (kind, signs) = self.regime;
        let system = &self.model.system;
        let smooth = kind == RegimeKind::Frictionless && system.friction == 0.0;
        if system.law.is_coulomb() && (smooth || kind == RegimeKind::Slip) {
            return self.point.map_in_slip(&columns);
        }
        self.point.map_in_regime(&columns, system.law, kind, signs)
    }
}
