//! Sustained contact on g = 0: sliding, sticking, and what follows a landing (docs/theory.md,
//! section 5).
//!
//! With x2 = sin x1 - delta (direct: x1 - delta) and the free accelerations
//! a1 = f1 cos psi - 2 zeta1 omega0 x1' - omega0^2 x1, a2 = f2 cos psi - 2 zeta2 x2' - x2,
//! k = cos x1 + mu s |sin x1|, s = sgn(x1'):
//!
//! * slide: p = (a1 cos x1 - x1'^2 sin x1 - a2)/(mbar + k cos x1), x1'' = a1 - k p;
//! * stick: x1' = 0, p = -a2/mbar, as long as |a1 - p cos x1| <= mu p |sin x1|;
//! * release where p falls through 0.
//!
//! mbar + k cos x1 <= 0 is a Painleve point. Against a wall at rest (mbar = 0) p = a1/cos x1.

mod slide;
mod stick;

pub(crate) use slide::{SlideEnd, SlideStep};
pub(crate) use stick::next_change;

use serde::{Deserialize, Serialize};

use crate::flight::Trig;
use crate::model::angle::Angle;
use crate::model::oblique::SecondBody;
use crate::model::parameters::System;
use crate::model::state::State;
use crate::numerics::tolerance::{EPS, FORCE_NOISE, PAINLEVE_LEVEL, REACH_LEVEL, WALL_SLOPE};

/// What the tip does while contact lasts.
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

    fn slide(direction: f64) -> Self {
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

/// Free accelerations and geometry at one instant of the contact.
#[derive(Debug, Clone, Copy)]
struct Instant {
    a1: f64,
    a2: f64,
    sin: f64,
    cos: f64,
    v1: f64,
    /// Sizes of the terms of a1 and a2, whose rounding they have.
    size1: f64,
    size2: f64,
}

impl Instant {
    /// The free gap acceleration.
    fn free(&self) -> f64 {
        let angle = Angle { sin: self.sin, cos: self.cos };
        angle.gap_acceleration(self.v1, (self.a1, self.a2))
    }

    /// Its rounding.
    fn noise(&self) -> f64 {
        let turn = self.v1 * self.v1 * self.sin.abs();
        FORCE_NOISE * EPS * (self.size1 * self.cos.abs() + turn + self.size2)
    }
}

impl System {
    fn instant(&self, phase: Trig, state: &State) -> Instant {
        let Angle { sin, cos } = self.contact.angle(state.x1);
        let State { x1, v1, x2, v2 } = *state;
        let moment = self.pendulum().terms(x1, v1, phase.cos);
        let force = self.oscillator().terms(x2, v2, phase.cos);
        let sum = |terms: [f64; 3]| terms[0] + terms[1] + terms[2];
        let (a1, a2) = (sum(moment), sum(force));
        // The load has the rounding of its phase.
        let shift = phase.sin.abs();
        let size1 = sum(moment.map(f64::abs)) + self.moment_amplitude.abs() * shift;
        let size2 = sum(force.map(f64::abs)) + self.force_amplitude.abs() * shift;
        Instant { a1, a2, sin, cos, v1, size1, size2 }
    }

    /// mbar + k cos x1 for slip in direction s; 0 where it is that to rounding, or less.
    fn slip_inertia(&self, sin: f64, cos: f64, direction: f64) -> f64 {
        let friction = self.friction * sin.abs() * direction;
        let inertia = self.mass_ratio + (cos + friction) * cos;
        let size = self.mass_ratio + (cos.abs() + friction.abs()) * cos.abs();
        if inertia <= self.painleve_level(size) { 0.0 } else { inertia }
    }

    fn painleve_level(&self, size: f64) -> f64 {
        // A wall is driven to the end of the tip's reach, cos x1 = 0, where all terms vanish.
        (PAINLEVE_LEVEL * size).max(if self.is_wall() { REACH_LEVEL } else { 0.0 })
    }

    /// No contact force fits: a Painleve point, or a wall that jams the pendulum.
    pub(crate) fn no_force_fits(&self) -> Next {
        if self.is_wall() { Next::Jammed } else { Next::Painleve }
    }

    /// Whether no motion from a state on the contact with g' = 0 fits, or more than one.
    pub(crate) fn has_no_contact_force(&self, phase: Trig, state: &State) -> bool {
        matches!(self.land(phase, state), Next::Painleve | Next::Jammed)
    }

    /// What the bodies do from a state on the contact with g' = 0, under the forcing `phase`.
    pub(crate) fn land(&self, phase: Trig, state: &State) -> Next {
        let i = self.instant(phase, state);
        let free = i.free();
        let noise = i.noise();
        let rubs = self.friction > 0.0 && i.sin != 0.0;
        if rubs && i.v1 != 0.0 && self.slip_inertia(i.sin, i.cos, i.v1.signum()) == 0.0 {
            // Pressed together no force fits; pulled apart, flight and contact do.
            return self.no_force_fits();
        }
        if free < -noise {
            let ambiguous = rubs
                && i.v1 == 0.0
                && self.slip_inertia(i.sin, i.cos, -i.cos.signum()) == 0.0
                && self.sticks(&i);
            return if ambiguous { self.no_force_fits() } else { Next::Separate };
        }
        let next = if i.v1 != 0.0 {
            self.slide(&i, i.v1)
        } else if self.is_wall_at_rest(state) || (rubs && self.sticks(&i)) || self.balances(&i) {
            Next::Hold(ContactMode::Stick)
        } else {
            // s = sgn(a1 - p_s cos x1); without friction this is the sign of x1'' too. Against a
            // wall the tip follows it: x1'' cos x1 = a2.
            self.slide(&i, self.mass_ratio * i.a1 + i.a2 * i.cos)
        };
        if free <= noise {
            // p = 0 to rounding: its growth decides.
            let falls = match next {
                Next::Hold(ContactMode::Stick) => stick::falls(self, phase, state),
                Next::Hold(mode) => SlideStep::new(self, phase, state, mode).falls(),
                _ => false,
            };
            if falls {
                return Next::Release;
            }
        }
        next
    }

    fn slide(&self, i: &Instant, direction: f64) -> Next {
        if self.slip_inertia(i.sin, i.cos, direction.signum()) == 0.0 {
            return self.no_force_fits();
        }
        Next::Hold(ContactMode::slide(direction))
    }

    /// Whether friction can hold the tip at x1' = 0: p_s = -a2/mbar >= 0 in the cone. Multiplied
    /// by mbar.
    fn sticks(&self, i: &Instant) -> bool {
        !self.is_wall()
            && i.a2 <= 0.0
            && (self.mass_ratio * i.a1 + i.a2 * i.cos).abs() <= -self.friction * i.a2 * i.sin.abs()
    }

    /// Whether a constant load leaves the bodies where they are, without friction.
    fn balances(&self, i: &Instant) -> bool {
        let unforced = self.moment_amplitude == 0.0 && self.force_amplitude == 0.0;
        !self.is_wall()
            && (self.drive_frequency == 0.0 || unforced)
            && self.mass_ratio * i.a1 + i.a2 * i.cos == 0.0
    }

    /// Contact force in a mode.
    pub(crate) fn contact_force(
        &self,
        phase: Trig,
        state: &State,
        mode: ContactMode,
    ) -> ContactForce {
        let i = self.instant(phase, state);
        if mode == ContactMode::Stick {
            let (normal, tangential) = match self.second_body() {
                SecondBody::Wall => (i.a1 / i.cos, 0.0),
                SecondBody::Free { mass_ratio } => {
                    let normal = -i.a2 / mass_ratio;
                    // On sin x1 = 0 friction has no moment.
                    let held = if i.sin == 0.0 { 0.0 } else { (normal * i.cos - i.a1) / i.sin };
                    (normal, held)
                }
            };
            return ContactForce { normal: normal.max(0.0), tangential };
        }
        let direction = mode.direction();
        let friction = self.friction * direction;
        let inertia = self.mass_ratio + (i.cos + friction * i.sin.abs()) * i.cos;
        let free = i.free();
        let normal = (free / inertia).max(0.0);
        // On sin x1 = 0: the side the tip slides to.
        let side = if i.sin == 0.0 { direction * i.cos } else { i.sin };
        let tangential = if friction == 0.0 { 0.0 } else { -friction * side.signum() * normal };
        ContactForce { normal, tangential }
    }

    /// x1' at the accumulation point of bounces that slide, to leading order, time `left` after an
    /// impact with separation velocity u: x1' + a1 T - k S, S = (1 + q) u/((1 - q)(mbar + k cos x1)).
    pub(crate) fn after_bounces(
        &self,
        phase: Trig,
        state: &State,
        u: f64,
        q: f64,
        left: f64,
    ) -> f64 {
        let i = self.instant(phase, state);
        let friction = (self.friction * i.sin.abs()).copysign(i.v1);
        let k = i.cos + friction;
        let impulse = (1.0 + q) * u / ((1.0 - q) * (self.mass_ratio + k * i.cos));
        state.v1 + i.a1 * left - k * impulse
    }

    /// A state with g = 0 to rounding, moved onto the contact so that rounding does not add up.
    /// What a wall (mbar = 0) does is not touched.
    pub(crate) fn touching(&self, state: State) -> State {
        self.touching_at(state).0
    }

    /// The same with sine and cosine of its x1.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(crate) fn touching_at(&self, state: State) -> (State, Angle) {
        let angle = self.contact.angle(state.x1);
        let tip = self.contact.tip(state.x1, angle);
        if self.is_wall() && angle.cos.abs() > WALL_SLOPE {
            let x1 = state.x1 - (tip - state.x2 - self.gap) / angle.cos;
            return (State { x1, ..state }, self.contact.angle(x1));
        }
        (State { x2: tip - self.gap, ..state }, angle)
    }

    /// The same with g' = 0.
    pub(crate) fn landed(&self, state: State) -> State {
        let state = self.touching(state);
        let slope = self.tip_slope(state.x1);
        if self.is_wall() && slope.abs() > WALL_SLOPE {
            return State { v1: state.v2 / slope, ..state };
        }
        // As an impact does it: what the impulses of the last bounces have left is small beside the
        // motion, but not beside its rounding.
        let friction = self.friction * self.contact.angle(state.x1).sin.abs();
        let k = slope + if state.v1 == 0.0 { 0.0 } else { friction.copysign(state.v1) };
        let change = k * (state.v1 * slope - state.v2) / (self.mass_ratio + k * slope);
        let small = change.abs() <= 1e-3 * state.v1.abs();
        let v1 = if !self.is_wall() && small { state.v1 - change } else { state.v1 };
        State { v1, v2: v1 * slope, ..state }
    }
}
