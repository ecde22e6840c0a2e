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
use crate::flight::Flight;
use crate::impact::RegimeKind;
use crate::model::angle::Angle;
use crate::model::contact_coordinates::ContactCoordinates;
use crate::model::parameters::Contact;
use crate::model::state::{Clock, State};
use crate::numerics::dual::{Dual, Number};
use crate::simulate::event::ImpactEvent;

/// Components of N perturbations, one in each column: of a node (x1, x1', x2', t) after an event,
/// or of the state at a fixed time, (x1, x1', x2', x2).
pub(crate) type Columns<const N: usize> = [[f64; N]; 4];

/// What maps perturbations.
pub(crate) trait Derivative {
    fn map<const N: usize>(&self, columns: &Columns<N>) -> Columns<N>;
}

/// Where a flight begins, as far as its perturbations look at it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Departure {
    clock: Clock,
    /// x1', x2' and their free accelerations.
    rates: [f64; 2],
    accelerations: [f64; 2],
    /// dx2/dx1 on the contact; `None` where the flight begins between two events.
    slope: Option<f64>,
}

impl Departure {
    /// From this state at `clock`, after an event or between two.
    pub fn new(model: &Model, state: &State, clock: Clock, after_event: bool) -> Self {
        let cos_psi = model.motion.drive.trig_at(clock).cos;
        let (a1, a2) = model.system.free_accelerations(state, cos_psi);
        let slope = || if model.wall_at_rest { 0.0 } else { model.system.tip_slope(state.x1) };
        Self {
            clock,
            rates: [state.v1, state.v2],
            accelerations: [a1, a2],
            slope: after_event.then(slope),
        }
    }

    /// The free flight from here to an instant.
    #[inline(always)]
    pub fn flight(&self, model: &Model, end: Clock) -> FreeFlight {
        let time = model.motion.drive.roughly_until(self.clock, end);
        let [first, mut second] = model.motion.transitions(time);
        if model.wall_at_rest {
            second = [[0.0; 2]; 2];
        }
        FreeFlight { from: *self, transitions: [first, second] }
    }
}

/// A free flight between two fixed times, or from an event to a fixed time.
pub(crate) struct FreeFlight {
    from: Departure,
    /// Of (x1, x1') and of (x2, x2').
    transitions: [[[f64; 2]; 2]; 2],
}

impl Derivative for FreeFlight {
    #[inline(always)]
    fn map<const N: usize>(&self, [x1, v1, v2, last]: &Columns<N>) -> Columns<N> {
        let Departure { rates: [r1, r2], accelerations: [a1, a2], slope, .. } = self.from;
        let [[[xx1, xv1], [vx1, vv1]], [[xx2, xv2], [vx2, vv2]]] = self.transitions;
        let mut mapped = [[0.0; N]; 4];
        for i in 0..N {
            let (x1, v1, x2, v2) = match slope {
                // The event comes later by dt: at a fixed time the flight is behind by so much.
                Some(slope) => {
                    let dt = last[i];
                    (x1[i] - r1 * dt, v1[i] - a1 * dt, slope * x1[i] - r2 * dt, v2[i] - a2 * dt)
                }
                None => (x1[i], v1[i], last[i], v2[i]),
            };
            mapped[0][i] = xx1 * x1 + xv1 * v1;
            mapped[1][i] = vx1 * x1 + vv1 * v1;
            mapped[2][i] = vx2 * x2 + vv2 * v2;
            mapped[3][i] = xx2 * x2 + xv2 * v2;
        }
        mapped
    }
}

/// A free flight and the impact that ends it, to the node after it.
pub(crate) struct Strike<'a> {
    model: &'a Model,
    flight: FreeFlight,
    impact: &'a ImpactEvent,
    kind: RegimeKind,
    signs: Signs,
    angle: Angle,
    accelerations: [f64; 2],
}

impl<'a> Strike<'a> {
    /// The leg from this departure to an impact; `after`: the flight that begins there.
    #[inline(always)]
    pub fn new(
        model: &'a Model,
        from: &Departure,
        impact: &'a ImpactEvent,
        after: &Flight,
        (kind, signs): (RegimeKind, Signs),
    ) -> Self {
        let flight = from.flight(model, impact.clock);
        let (a1, a2) = model.system.free_accelerations(&impact.pre, after.start.cos);
        Self { model, flight, impact, kind, signs, angle: after.angle, accelerations: [a1, a2] }
    }

    /// Where the next flight begins.
    #[inline(always)]
    pub fn departure(&self) -> Departure {
        let ImpactEvent { clock, pre, post, .. } = *self.impact;
        let Self { model, angle, accelerations: [a1, a2], .. } = self;
        // Of the accelerations an impact changes the damping alone.
        let [c1, c2] = [&model.motion.pendulum, &model.motion.oscillator]
            .map(|body| 2.0 * body.equation.decay_rate);
        Departure {
            clock,
            rates: [post.v1, post.v2],
            accelerations: [a1 - c1 * (post.v1 - pre.v1), a2 - c2 * (post.v2 - pre.v2)],
            slope: Some(if model.wall_at_rest { 0.0 } else { angle.cos }),
        }
    }
}

impl Derivative for Strike<'_> {
    #[inline(always)]
    fn map<const N: usize>(&self, columns: &Columns<N>) -> Columns<N> {
        let Self { model, impact, kind, signs, angle, accelerations: [a1, a2], .. } = *self;
        let (system, pre) = (&model.system, &impact.pre);
        let [x1, v1, v2, x2] = self.flight.map(columns);
        let per_approach = 1.0 / impact.impact.approach_velocity;
        let delay: [f64; N] = std::array::from_fn(|i| (x2[i] - angle.cos * x1[i]) * per_approach);
        let at_impact = |value: f64, y: &[f64; N], rate: f64| Dual::<N> {
            value,
            slope: std::array::from_fn(|i| y[i] + rate * delay[i]),
        };
        let x1 = at_impact(pre.x1, &x1, pre.v1);
        let v1 = at_impact(pre.v1, &v1, a1);
        let constant = Dual::<N>::constant;
        let v2 = if model.wall_at_rest { constant(pre.v2) } else { at_impact(pre.v2, &v2, a2) };
        let turned = |value: f64, rate: f64| match system.contact {
            Contact::Oblique => Dual::<N> { value, slope: x1.slope.map(|slope| rate * slope) },
            Contact::Direct => constant(value),
        };
        let contact = ContactCoordinates::at_tip(
            (turned(angle.sin, angle.cos), turned(angle.cos, -angle.sin)),
            (v1, v2),
            constant(system.mass_ratio),
            constant(system.friction),
            signs.side.value(),
        );
        let law = (constant(system.restitution), &system.law);
        let (_, end) = regime_path(&contact, law, kind, signs.direction.value());
        [x1.slope, end.slip.slope, end.parting.slope, delay]
    }
}
