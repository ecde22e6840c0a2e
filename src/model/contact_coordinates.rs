//! Two bodies that meet at one point, as an impact sees them: velocities and mobilities along the
//! normal and the tangent of the contact, whatever the bodies are (docs/theory.md, sections 4 and
//! 12). The one place that says which of them belong to the pendulum.
//!
//! With rows n and t of the contact, u = n.q', s = t.q', a = n M^-1 n, b = n M^-1 t, c = t M^-1 t,
//! and impulses P and Q against n and along t:
//!
//! ```text
//! du = -a dP + b dQ        ds = -b dP + c dQ
//! ```
//!
//! Held here is the pair that friction uncouples, in which no quotient is left where c = 0:
//!
//! ```text
//! w = s/h,  h = +-sqrt(c)          dw = -(b/h) dP + h dQ
//! v = (b/h) w - u                  dv = (a - b^2/c) dP
//! ```
//!
//! v is what friction cannot change: the speed at which the bodies would part if w were stopped.
//! For the pendulum h = sin x1, w = x1', v = x2', b/h = cos x1 and a - b^2/c = mbar: its own
//! equations of impact.

#![allow(clippy::inline_always)] // a flight with its impact is compiled for several instruction sets

use crate::model::angle::Angle;
use crate::model::parameters::{Contact, System};
use crate::model::state::State;
use crate::model::tolerances::{DEAD_CENTRE, NO_ROOM, PAINLEVE_LEVEL, REACH_LEVEL};
use crate::numerics::dual::Number;

/// Contact coordinates just before an impact, and the numbers of the contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ContactCoordinates<T> {
    /// w = s/h, the velocity of slip in units in which its mobility is 1.
    pub slip: T,
    /// v = (b/h) w - u, the speed of parting without slip.
    pub parting: T,
    /// b/h, how far slip and approach are coupled.
    pub coupling: T,
    /// a - b^2/c, the mobility of the normal in stick; 0: nothing but slip ends the approach.
    pub mobility: T,
    /// h, the velocity of the contact point along the tangent at w = 1.
    pub scale: T,
    /// The sign of h.
    pub side: f64,
    /// mu.
    pub friction: T,
}

impl ContactCoordinates<f64> {
    /// From u, s and the numbers a, b, c of a contact with friction mu; c = 0: without a tangent.
    pub fn new(u: f64, s: f64, [a, b, c]: [f64; 3], friction: f64) -> Self {
        let scale = c.sqrt();
        let (slip, coupling) = if c > 0.0 { (s / scale, b / scale) } else { (0.0, 0.0) };
        Self {
            slip,
            parting: coupling * slip - u,
            coupling,
            mobility: a - coupling * coupling,
            scale,
            side: 1.0,
            friction,
        }
    }
}

impl<T: Number> ContactCoordinates<T> {
    /// The pendulum's tip at body 2: n = (cos x1, -1), t = (sin x1, 0), M = diag(1, 1/mbar); `side`
    /// is the sign of sin x1.
    #[inline(always)]
    pub(crate) fn at_tip(
        (sin, cos): (T, T),
        (v1, v2): (T, T),
        mass_ratio: T,
        friction: T,
        side: f64,
    ) -> Self {
        Self {
            slip: v1,
            parting: v2,
            coupling: cos,
            mobility: mass_ratio,
            scale: sin,
            side,
            friction,
        }
    }

    /// u.
    #[inline(always)]
    pub(crate) fn approach_velocity(&self) -> T {
        self.slip * self.coupling - self.parting
    }

    /// Whether the other body is a wall: m = 0.
    #[inline(always)]
    pub(crate) fn is_against_wall(&self) -> bool {
        self.mobility.value() == 0.0
    }

    /// mu |h|: -dw/dP by friction.
    #[inline(always)]
    pub(crate) fn grip(&self) -> T {
        self.friction * (self.scale * self.side)
    }

    /// k = b/h + mu |h| sgn w: -dw/dP in slip.
    #[inline(always)]
    pub(crate) fn slip_rate(&self, direction: f64) -> T {
        self.coupling + self.grip() * direction
    }
}

impl ContactCoordinates<f64> {
    /// Whether friction can hold the contact point, |b| <= mu c.
    #[inline(always)]
    pub(crate) fn is_in_friction_cone(&self) -> bool {
        self.coupling.abs() <= self.grip()
    }

    /// m + k b/h for slip in direction s; 0 where it is that to rounding, or less.
    pub(crate) fn slip_inertia(&self, direction: f64) -> f64 {
        let inertia = self.mobility + self.slip_rate(direction) * self.coupling;
        if inertia <= self.painleve_level() { 0.0 } else { inertia }
    }

    /// The inertia below which slip meets a Painleve point.
    pub(crate) fn painleve_level(&self) -> f64 {
        let size = self.mobility + (self.coupling.abs() + self.grip()) * self.coupling.abs();
        // Against a wall all terms vanish where the reach of the tip ends.
        (PAINLEVE_LEVEL * size).max(if self.is_against_wall() { REACH_LEVEL } else { 0.0 })
    }
}

/// Velocities and geometry of the pendulum and body 2 just before an impact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PreImpact {
    /// cos x1 (1 in direct contact).
    pub cos: f64,
    /// sin x1 (0 in direct contact).
    pub sin: f64,
    /// x1' before.
    pub v1: f64,
    /// x2' before.
    pub v2: f64,
}

impl PreImpact {
    /// The state just before an impact, seen in this contact geometry.
    #[must_use]
    pub fn new(contact: Contact, state: &State) -> Self {
        Self::at(contact.angle(state.x1), state)
    }

    /// As [`PreImpact::new`], from a known sine and cosine of x1.
    #[inline(always)]
    pub(crate) fn at(Angle { sin, cos }: Angle, state: &State) -> Self {
        Self { cos, sin, v1: state.v1, v2: state.v2 }
    }

    /// Approach velocity u = x1' cos x1 - x2'.
    #[must_use]
    pub fn approach_velocity(&self) -> f64 {
        self.v1 * self.cos - self.v2
    }

    /// These velocities in contact coordinates.
    #[inline(always)]
    pub(crate) fn coordinates(&self, mass_ratio: f64, friction: f64) -> ContactCoordinates<f64> {
        let side = 1f64.copysign(self.sin);
        let (angle, velocities) = ((self.sin, self.cos), (self.v1, self.v2));
        ContactCoordinates::at_tip(angle, velocities, mass_ratio, friction, side)
    }

    /// A wall that approaches a tip at the end of its reach, which would drive x1' beyond all
    /// bounds, or at dead centre, where hardly any impulse acts on x1'.
    #[inline]
    pub(crate) fn has_no_room(&self, system: &System) -> bool {
        let approaches = system.mass_ratio == 0.0 && self.v2 < 0.0;
        let at_end = || self.sin < 0.0 && self.cos.abs() <= NO_ROOM;
        let at_dead_centre = || {
            self.sin > 0.0
                && self.cos.abs() <= DEAD_CENTRE * (1.0 + system.gap.abs())
                && -self.v2 > (self.v1 * self.cos).abs()
        };
        approaches && (at_end() || at_dead_centre())
    }
}
