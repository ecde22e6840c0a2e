//! The physics of the system: bodies that swing and are driven between contacts, the gap between
//! them, and what the second body is (docs/theory.md, section 1). The only place that knows the
//! pendulum:
//!
//! ```text
//! x1'' = f1 cos psi + c1 - 2 zeta1 omega0 x1' - omega0^2 x1
//! x2'' = f2 cos psi + c2 - 2 zeta2 x2' - x2
//! g = tip(x1) - x2 - delta,    tip(x1) = sin x1 (oblique), x1 (direct)
//! ```
//!
//! Formulas that are needed with derivatives too are generic in the number.

use crate::model::angle::Angle;
use crate::model::contact_coordinates::{ContactCoordinates, PreImpact};
use crate::model::parameters::{Contact, Parameters, System};
use crate::model::state::State;
use crate::model::tolerances::{LAST_IMPULSES, WALL_SLOPE};
use crate::numerics::dual::Number;

/// One body between contacts: x'' = f cos psi + c - 2 zeta w x' - w^2 x.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Body<T> {
    /// w.
    pub natural: T,
    /// zeta.
    pub damping: T,
    /// f.
    pub amplitude: T,
    /// c.
    pub constant: T,
}

impl<T: Number> Body<T> {
    /// The four terms of x'': drive, constant load, damping, stiffness.
    #[inline]
    pub fn terms(&self, x: T, v: T, cos_psi: T) -> [T; 4] {
        let &Self { natural, damping, amplitude, constant } = self;
        [amplitude * cos_psi, constant, -(damping * 2.0 * natural * v), -(natural * natural * x)]
    }

    /// x''.
    #[inline]
    pub fn acceleration(&self, x: T, v: T, cos_psi: T) -> T {
        let [drive, constant, damping, stiffness] = self.terms(x, v, cos_psi);
        drive + constant + damping + stiffness
    }

    /// The body in time over `unit`, a power of two so that no digit is lost.
    pub fn in_units_of(&self, unit: f64) -> Self {
        let Self { natural, damping, amplitude, constant } = *self;
        let square = unit * unit;
        Self {
            natural: natural * unit,
            damping,
            amplitude: amplitude * square,
            constant: constant * square,
        }
    }
}

impl Body<f64> {
    /// A bound of the rates at which its free motion turns or decays, w (1 + 2 zeta).
    pub fn fastest_rate(&self) -> f64 {
        self.natural * (1.0 + 2.0 * self.damping)
    }

    /// The fastest rate at which its free motion decays: w (zeta + sqrt(zeta^2 - 1)), or w zeta
    /// below critical damping.
    pub fn fastest_decay(&self) -> f64 {
        let zeta = self.damping;
        self.natural * (zeta + (zeta * zeta - 1.0).max(0.0).sqrt())
    }
}

impl<T: Number> Parameters<T> {
    /// The pendulum between contacts.
    pub fn pendulum(&self) -> Body<T> {
        Body {
            natural: self.frequency_ratio,
            damping: self.pendulum_damping,
            amplitude: self.moment_amplitude,
            constant: self.static_moment,
        }
    }

    /// The oscillator between contacts; its natural frequency is the unit.
    pub fn oscillator(&self) -> Body<T> {
        Body {
            natural: T::constant(1.0),
            damping: self.oscillator_damping,
            amplitude: self.force_amplitude,
            constant: self.static_force,
        }
    }
}

/// What the tip strikes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum SecondBody {
    /// A body that impacts act on, mbar = M1/M2 > 0.
    Free { mass_ratio: f64 },
    /// mbar = 0: a wall, which moves as the drive makes it whatever strikes it.
    Wall,
}

impl System {
    /// The pendulum between contacts.
    pub(crate) fn pendulum(&self) -> Body<f64> {
        Body {
            natural: self.frequency_ratio,
            damping: self.pendulum_damping,
            amplitude: self.moment_amplitude,
            constant: self.static_moment,
        }
    }

    /// The oscillator between contacts.
    pub(crate) fn oscillator(&self) -> Body<f64> {
        Body {
            natural: 1.0,
            damping: self.oscillator_damping,
            amplitude: self.force_amplitude,
            constant: self.static_force,
        }
    }

    /// x1'' and x2'' without contact.
    pub(crate) fn free_accelerations(&self, state: &State, cos_psi: f64) -> (f64, f64) {
        (
            self.pendulum().acceleration(state.x1, state.v1, cos_psi),
            self.oscillator().acceleration(state.x2, state.v2, cos_psi),
        )
    }

    /// What the tip strikes.
    pub(crate) fn second_body(&self) -> SecondBody {
        if self.mass_ratio > 0.0 {
            SecondBody::Free { mass_ratio: self.mass_ratio }
        } else {
            SecondBody::Wall
        }
    }

    /// Whether impacts do not act on body 2 (mbar = 0).
    #[must_use]
    pub fn is_wall(&self) -> bool {
        self.second_body() == SecondBody::Wall
    }

    /// Whether body 2 is a wall that rests in `state` and will never move.
    pub(crate) fn is_wall_at_rest(&self, state: &State) -> bool {
        let rests = state.x2 == self.static_force && state.v2 == 0.0;
        self.is_wall() && self.force_amplitude == 0.0 && rests
    }

    /// Whether the pendulum is a free rotor, whose angle counts modulo a turn.
    #[must_use]
    pub fn is_rotor(&self) -> bool {
        self.frequency_ratio == 0.0 && self.contact == Contact::Oblique
    }

    /// The highest of the frequencies of drive and bodies.
    pub(crate) fn highest_frequency(&self) -> f64 {
        self.frequency_ratio.max(self.drive_frequency).max(1.0)
    }

    /// A bound of the rates at which anything but the tip's angle turns or decays between contacts.
    pub(crate) fn fastest_rate(&self) -> f64 {
        let bodies = self.oscillator().fastest_rate().max(self.pendulum().fastest_rate());
        bodies.max(self.drive_frequency)
    }

    /// The fastest rate at which a free motion of either body decays.
    pub(crate) fn fastest_decay(&self) -> f64 {
        self.pendulum().fastest_decay().max(self.oscillator().fastest_decay())
    }

    /// Position of the pendulum's tip along the contact normal: sin x1, or x1 in direct contact.
    #[must_use]
    pub fn tip(&self, x1: f64) -> f64 {
        self.contact.tip(x1, self.contact.angle(x1))
    }

    /// Its derivative by x1: cos x1, or 1 in direct contact.
    #[must_use]
    pub fn tip_slope(&self, x1: f64) -> f64 {
        self.contact.angle(x1).cos
    }

    /// Gap function g = tip - x2 - delta of a state: negative while the bodies are apart.
    #[must_use]
    pub fn gap_function(&self, state: &State) -> f64 {
        self.tip(state.x1) - state.x2 - self.gap
    }

    /// Approach velocity u = g' = v1 cos x1 - v2.
    #[must_use]
    pub fn approach_velocity(&self, state: &State) -> f64 {
        self.contact.angle(state.x1).gap_rate(state.v1, state.v2)
    }

    /// g'' without contact.
    #[cfg_attr(not(any(test, feature = "python")), expect(dead_code))]
    pub(crate) fn gap_acceleration(&self, state: &State, cos_psi: f64) -> f64 {
        let accelerations = self.free_accelerations(state, cos_psi);
        self.contact.angle(state.x1).gap_acceleration(state.v1, accelerations)
    }

    /// The state on the contact that has this x1 and x1'.
    pub(crate) fn on_contact(&self, x1: f64, v1: f64) -> State {
        State { x1, v1, x2: self.tip(x1) - self.gap, v2: v1 * self.tip_slope(x1) }
    }

    /// A state with g = 0 to rounding, moved onto the contact so that rounding does not add up.
    /// What a wall (mbar = 0) does is not touched.
    pub(crate) fn touching(&self, state: State) -> State {
        self.touching_at(state).0
    }

    /// As [`System::touching`], with sine and cosine of its x1.
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

    /// A state with g = g' = 0 to rounding, moved onto the contact with g' = 0.
    pub(crate) fn landed(&self, state: State) -> State {
        let state = self.touching(state);
        let slope = self.tip_slope(state.x1);
        if self.is_wall() && slope.abs() > WALL_SLOPE {
            return State { v1: state.v2 / slope, ..state };
        }
        // As an impact does it: what the impulses of the last bounces have left is small beside the
        // motion, but not beside its rounding.
        let at = self.tip_contact(&state);
        let k = at.slip_rate(if at.slip == 0.0 { 0.0 } else { at.slip.signum() });
        let change = k * at.approach_velocity() / (at.mobility + k * at.coupling);
        let small = change.abs() <= LAST_IMPULSES * state.v1.abs();
        let v1 = if !self.is_wall() && small { state.v1 - change } else { state.v1 };
        State { v1, v2: v1 * slope, ..state }
    }

    /// The contact of the tip with body 2 in a state.
    pub(crate) fn tip_contact(&self, state: &State) -> ContactCoordinates<f64> {
        PreImpact::new(self.contact, state).coordinates(self.mass_ratio, self.friction)
    }
}

impl<T: Number> Angle<T> {
    /// u = g' at the rates x1', x2'.
    #[inline(always)]
    #[allow(clippy::inline_always)] // as `Contact::angle`
    pub fn gap_rate(&self, v1: T, v2: T) -> T {
        v1 * self.cos - v2
    }

    /// g'' at the accelerations x1'', x2''.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub fn gap_acceleration(&self, v1: T, (a1, a2): (T, T)) -> T {
        a1 * self.cos - v1 * v1 * self.sin - a2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::dual::Dual;

    fn system(mass_ratio: f64, contact: Contact) -> System {
        System::builder()
            .mass_ratio(mass_ratio)
            .frequency_ratio(1.7)
            .restitution(0.8)
            .gap(0.3)
            .drive_frequency(1.25)
            .pendulum_damping(0.2)
            .oscillator_damping(0.1)
            .moment_amplitude(0.7)
            .force_amplitude(-0.4)
            .contact(contact)
            .build()
            .unwrap()
    }

    #[test]
    fn rates_of_the_gap_are_its_derivatives_along_a_free_motion() {
        for contact in [Contact::Oblique, Contact::Direct] {
            let system = system(0.6, contact);
            let state = State { x1: 0.9, v1: -1.3, x2: 0.2, v2: 0.5 };
            let (a1, a2) = system.free_accelerations(&state, 0.4);
            // x(t) = x + v t + a t^2/2: rate and, by its own derivative, acceleration at t = 0.
            let t = Dual::<1>::variable(0.0, 0);
            let at = |x: f64, v: f64, a: f64| {
                (t * v + t * t * (0.5 * a) + Dual::constant(x), t * a + Dual::constant(v))
            };
            let ((x1, v1), (x2, v2)) = (at(state.x1, state.v1, a1), at(state.x2, state.v2, a2));
            let angle = contact.angle(x1);
            let gap = contact.tip(x1, angle) - x2;
            let rate = angle.gap_rate(v1, v2);
            assert_eq!(rate.value, system.approach_velocity(&state));
            assert!((gap.slope[0] - rate.value).abs() < 1e-15);
            assert!((rate.slope[0] - system.gap_acceleration(&state, 0.4)).abs() < 1e-15);
        }
    }

    #[test]
    fn a_wall_has_no_mass_ratio() {
        assert_eq!(
            system(0.6, Contact::Oblique).second_body(),
            SecondBody::Free { mass_ratio: 0.6 }
        );
        assert!(system(0.0, Contact::Oblique).is_wall());
        assert!(!system(f64::MIN_POSITIVE, Contact::Oblique).is_wall());
    }
}
