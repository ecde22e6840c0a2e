//! Sustained contact on g = 0: slip, stick, and what follows a landing, in contact coordinates
//! (model/contact_coordinates.rs) and whatever the bodies are (docs/theory.md, sections 5 and 12).
//!
//! With the free accelerations w' = alpha, v' = beta and g'' = gamma, the coupling b/h, the
//! mobility m, k = b/h + mu |h| s and s = sgn w:
//!
//! * slip: p = gamma/(m + k b/h), w' = alpha - k p;
//! * stick: w = 0, p = -beta/m, as long as |alpha - p b/h| <= mu p |h|;
//! * release where p falls through 0.
//!
//! m + k b/h <= 0 is a Painleve point. Against a wall at rest (m = 0) p = alpha/(b/h). What the
//! pendulum and body 2 answer when they are asked for these numbers is in contact/tip.rs.

mod slide;
mod stick;

pub(crate) use slide::{
    INVERSE, ORDER, Series, SlideEnd, SlideSeries, SlideStep, Sliding, product,
};
pub(crate) use stick::Stick;

use serde::{Deserialize, Serialize};

use crate::model::contact_coordinates::ContactCoordinates;
use crate::numerics::dual::Number;

/// What the bodies do along the contact while it lasts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ContactMode {
    /// Slides with x1' > 0. Without friction the direction plays no part: a phase keeps the name of
    /// the direction it began with.
    SlidePositive,
    /// Slides with x1' < 0.
    SlideNegative,
    /// x1' = 0: held by friction, or by a wall at rest.
    Stick,
}

impl ContactMode {
    /// The name used in Python and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::SlidePositive => "slide_positive",
            Self::SlideNegative => "slide_negative",
            Self::Stick => "stick",
        }
    }

    /// Slip in this direction.
    pub(crate) fn slide(direction: f64) -> Self {
        if direction > 0.0 { Self::SlidePositive } else { Self::SlideNegative }
    }

    /// s = sgn(x1'), 0 in stick.
    pub(crate) fn direction(self) -> f64 {
        match self {
            Self::SlidePositive => 1.0,
            Self::SlideNegative => -1.0,
            Self::Stick => 0.0,
        }
    }
}

/// Force in the contact, in units M1 l omega_2^2.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactForce {
    /// Normal force p >= 0.
    pub normal: f64,
    /// Friction on the tip, along the contact: -mu s sgn(sin x1) p in slip, what keeps x1' = 0 in
    /// stick. Its moment on the pendulum is sin x1 times it.
    pub tangential: f64,
}

/// What follows once the bodies are on the contact with g' = 0, or a contact mode has ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Next {
    /// Contact lasts, in this mode.
    Hold(ContactMode),
    /// The bodies separate with g'' < 0.
    Separate,
    /// They separate with g'' = 0 to rounding.
    Release,
    /// No contact force, or more than one, fits.
    Painleve,
    /// A moving wall (mbar = 0) against which the pendulum sticks.
    Jammed,
}

/// A contact with g = g' = 0, and the accelerations without a force in it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ClosedContact<T = f64> {
    pub at: ContactCoordinates<T>,
    /// w'.
    pub slip_acceleration: T,
    /// v'.
    pub parting_acceleration: T,
    /// g''.
    pub gap_acceleration: T,
}

impl<T: Number> ClosedContact<T> {
    /// m w' of a tip at rest under the force that keeps v' = 0, with the friction of slip in
    /// direction s, or without any (s = 0): with the sign of s the tip slips that way.
    pub fn slip_drive(&self, direction: f64) -> T {
        let Self { at, slip_acceleration, parting_acceleration, .. } = *self;
        at.mobility * slip_acceleration + parting_acceleration * at.slip_rate(direction)
    }

    /// w at the accumulation point of bounces that slip in this direction, to leading order, time `left`
    /// after an impact with separation velocity u, which shrinks by the ratio q: w + alpha T - k S,
    /// S = (1 + q) u/((1 - q)(m + k b/h)).
    pub fn slip_after_bounces(&self, direction: f64, (u, q): (T, T), left: T) -> T {
        let Self { at, slip_acceleration, .. } = *self;
        let (one, k) = (T::constant(1.0), at.slip_rate(direction));
        let impulse = (one + q) * u / ((one - q) * (at.mobility + k * at.coupling));
        at.slip + slip_acceleration * left - k * impulse
    }
}

/// A closed contact at one instant, with all that decides what follows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactInstant {
    pub contact: ClosedContact,
    /// Rounding of the free g'', of w', and of h.
    pub gap_noise: f64,
    pub slip_noise: f64,
    pub scale_noise: f64,
    /// Rounding of the instant itself.
    pub clock_noise: f64,
    /// dh/dt at w = 1.
    pub scale_slope: f64,
    /// A bound of the rates at which the motion turns or decays, and at which slip turns the
    /// contact.
    pub fastest: f64,
    pub turning: f64,
    /// The other body is a wall that will never move.
    pub wall_at_rest: bool,
    /// No load changes with time.
    pub constant_loads: bool,
}

/// No contact force fits: a Painleve point, or a moving wall against which the bodies jam.
pub(crate) fn no_force_fits<T: Number>(at: &ContactCoordinates<T>) -> Next {
    if at.is_against_wall() { Next::Jammed } else { Next::Painleve }
}

impl ContactInstant {
    /// What the bodies do from here; `falls`: whether in this mode a contact force of 0 falls.
    pub fn land(&self, falls: impl FnOnce(ContactMode) -> bool) -> Next {
        let Self { contact, gap_noise, .. } = self;
        let (at, free) = (&contact.at, contact.gap_acceleration);
        let rubs = at.friction > 0.0 && at.scale != 0.0;
        if rubs && at.slip != 0.0 && at.slip_inertia(at.slip.signum()) == 0.0 {
            // Pressed together no force fits; pulled apart, flight and contact do.
            return no_force_fits(at);
        }
        if free < -gap_noise {
            let ambiguous = rubs
                && at.slip == 0.0
                && at.slip_inertia(-at.coupling.signum()) == 0.0
                && self.sticks();
            return if ambiguous { no_force_fits(at) } else { Next::Separate };
        }
        let next = if at.slip != 0.0 {
            self.slide(at.slip)
        } else if self.wall_at_rest || (rubs && self.sticks()) || self.balances() {
            Next::Hold(ContactMode::Stick)
        } else {
            // s = sgn(alpha - p_s b/h); without friction this is the sign of w' too. Against a wall
            // the tip follows it.
            self.slide(contact.slip_drive(0.0))
        };
        match next {
            // p = 0 to rounding: its growth decides.
            Next::Hold(mode) if free <= *gap_noise && falls(mode) => Next::Release,
            next => next,
        }
    }

    fn slide(&self, direction: f64) -> Next {
        let at = &self.contact.at;
        if at.slip_inertia(direction.signum()) == 0.0 {
            return no_force_fits(at);
        }
        Next::Hold(ContactMode::slide(direction))
    }

    /// Whether friction can hold the tip at w = 0: p_s = -beta/m >= 0 in the cone. Multiplied by m.
    fn sticks(&self) -> bool {
        let ClosedContact { at, parting_acceleration, .. } = &self.contact;
        let cone = -at.friction * parting_acceleration * at.scale.abs();
        !at.is_against_wall()
            && *parting_acceleration <= 0.0
            && self.contact.slip_drive(0.0).abs() <= cone
    }

    /// Whether constant loads leave the bodies where they are, without friction.
    fn balances(&self) -> bool {
        !self.contact.at.is_against_wall()
            && self.constant_loads
            && self.contact.slip_drive(0.0) == 0.0
    }

    /// Contact force in a mode.
    pub fn force(&self, mode: ContactMode) -> ContactForce {
        let ClosedContact { at, slip_acceleration, parting_acceleration, gap_acceleration } =
            &self.contact;
        if mode == ContactMode::Stick {
            let (normal, tangential) = if at.is_against_wall() {
                (slip_acceleration / at.coupling, 0.0)
            } else {
                let normal = -parting_acceleration / at.mobility;
                // Where h = 0 friction does not act on w.
                let held = (normal * at.coupling - slip_acceleration) / at.scale;
                (normal, if at.scale == 0.0 { 0.0 } else { held })
            };
            return ContactForce { normal: normal.max(0.0), tangential };
        }
        let direction = mode.direction();
        let inertia = at.mobility + at.slip_rate(direction) * at.coupling;
        let normal = (gap_acceleration / inertia).max(0.0);
        // Where h = 0: the side the tip slides to.
        let side = if at.scale == 0.0 { direction * self.scale_slope } else { at.scale };
        let friction = at.friction * direction;
        let tangential = if friction == 0.0 { 0.0 } else { -friction * side.signum() * normal };
        ContactForce { normal, tangential }
    }
}
