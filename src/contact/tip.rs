//! The pendulum's tip on body 2: what a contact phase asks this machine for (docs/theory.md,
//! section 5). The displacement along the contact is x1, the velocity of slip x1'.

use std::f64::consts::PI;

use super::sustained::{
    ClosedContact, ContactForce, ContactInstant, ContactMode, INVERSE, Next, ORDER, Series,
    SlideSeries, SlideStep, Sliding, Stick, no_force_fits, product,
};
use crate::contact::tolerances::FORCE_NOISE;
use crate::flight::Trig;
use crate::model::angle::Angle;
use crate::model::contact_coordinates::ContactCoordinates;
use crate::model::oblique::Body;
use crate::model::parameters::{Contact, Parameters, System};
use crate::model::state::State;
use crate::numerics::EPS;
use crate::numerics::dual::Number;

impl<T: Number> Parameters<T> {
    /// The closed contact at an angle and velocities under these free accelerations.
    pub(crate) fn closed_contact(
        &self,
        Angle { sin, cos }: Angle<T>,
        (v1, v2): (T, T),
        (a1, a2): (T, T),
        side: f64,
    ) -> ClosedContact<T> {
        let at =
            ContactCoordinates::at_tip((sin, cos), (v1, v2), self.mass_ratio, self.friction, side);
        ClosedContact {
            at,
            slip_acceleration: a1,
            parting_acceleration: a2,
            gap_acceleration: Angle { sin, cos }.gap_acceleration(v1, (a1, a2)),
        }
    }
}

impl System {
    /// The contact at a phase of the loads.
    fn contact_instant(&self, phase: Trig, state: &State) -> ContactInstant {
        let angle = self.contact.angle(state.x1);
        let State { x1, v1, x2, v2 } = *state;
        let moment = self.pendulum().terms(x1, v1, phase.cos);
        let force = self.oscillator().terms(x2, v2, phase.cos);
        let sum = |terms: [f64; 4]| terms[0] + terms[1] + terms[2] + terms[3];
        // The load has the rounding of its phase.
        let shift = phase.sin.abs();
        let size1 = sum(moment.map(f64::abs)) + self.moment_amplitude.abs() * shift;
        let size2 = sum(force.map(f64::abs)) + self.force_amplitude.abs() * shift;
        let turn = v1 * v1 * angle.sin.abs();
        let omega = self.drive_frequency;
        let unforced = self.moment_amplitude == 0.0 && self.force_amplitude == 0.0;
        ContactInstant {
            contact: self.contact_under(angle, (v1, v2), (sum(moment), sum(force))),
            gap_noise: FORCE_NOISE * EPS * (size1 * angle.cos.abs() + turn + size2),
            slip_noise: FORCE_NOISE * EPS * size1,
            scale_noise: 2.0 * EPS * x1.abs().max(PI),
            clock_noise: if omega > 0.0 { 2.0 * PI * EPS / omega } else { 0.0 },
            scale_slope: angle.cos,
            fastest: self.fastest_rate(),
            turning: if self.contact == Contact::Oblique { v1.abs() } else { 0.0 },
            wall_at_rest: self.is_wall_at_rest(state),
            constant_loads: omega == 0.0 || unforced,
        }
    }

    fn contact_under(
        &self,
        angle: Angle,
        velocities: (f64, f64),
        accelerations: (f64, f64),
    ) -> ClosedContact {
        let side = 1f64.copysign(angle.sin);
        self.parameters(|_, value| value).closed_contact(angle, velocities, accelerations, side)
    }

    /// The bodies at rest in a state.
    pub(crate) fn stick(&self, state: &State) -> Stick {
        let angle = self.contact.angle(state.x1);
        let at_rest = State { v1: 0.0, v2: 0.0, ..*state };
        let loads = (self.moment_amplitude, self.force_amplitude);
        Stick {
            unloaded: self.contact_under(angle, (0.0, 0.0), self.free_accelerations(&at_rest, 0.0)),
            loads: self.contact_under(angle, (0.0, 0.0), loads),
            frequency: self.drive_frequency,
        }
    }

    /// One step of a slide.
    pub(crate) fn slide(&self, phase: Trig, state: &State, mode: ContactMode) -> SlideStep {
        let parameters = self.parameters(|_, value| value);
        let load = (phase.cos, phase.sin);
        SlideStep::new(&self.contact_instant(phase, state), mode, state.x1, |unit| {
            TipSlide::new(&parameters, load, unit, state.x1)
        })
    }

    /// One step of a slide, and its series with derivatives, from x1 and x1' at a phase of the loads (its
    /// cosine and sine).
    pub(crate) fn slide_with_derivatives<T: Number>(
        &self,
        phase: Trig,
        (parameters, load): (&Parameters<T>, (T, T)),
        (x1, v1): (T, T),
        mode: ContactMode,
    ) -> (SlideSeries<T>, f64) {
        let Angle { sin, cos } = parameters.contact.angle(x1);
        let (mass_ratio, friction) = (parameters.mass_ratio, parameters.friction);
        // The side is the step's own.
        let at = ContactCoordinates::at_tip((sin, cos), (v1, v1 * cos), mass_ratio, friction, 1.0);
        let now = self.contact_instant(phase, &self.on_contact(x1.value(), v1.value()));
        SlideSeries::with_derivatives(&now, mode, (&at, x1), |unit| {
            TipSlide::new(parameters, load, unit, x1)
        })
    }

    /// What the bodies do from a state on the contact with g' = 0, under the forcing `phase`.
    pub(crate) fn land(&self, phase: Trig, state: &State) -> Next {
        self.contact_instant(phase, state).land(|mode| match mode {
            ContactMode::Stick => self.stick(state).falls(phase),
            mode => self.slide(phase, state, mode).falls(),
        })
    }

    /// Whether no motion from a state on the contact with g' = 0 fits, or more than one.
    pub(crate) fn has_no_contact_force(&self, phase: Trig, state: &State) -> bool {
        matches!(self.land(phase, state), Next::Painleve | Next::Jammed)
    }

    /// What follows where no contact force fits.
    pub(crate) fn no_force_fits(&self, state: &State) -> Next {
        no_force_fits(&self.tip_contact(state))
    }

    /// Contact force in a mode.
    pub(crate) fn contact_force(
        &self,
        phase: Trig,
        state: &State,
        mode: ContactMode,
    ) -> ContactForce {
        self.contact_instant(phase, state).force(mode)
    }

    /// x1' at the accumulation point of bounces that slide, to leading order, time `left` after an
    /// impact with separation velocity u; they shrink by the ratio q.
    pub(crate) fn slip_after_bounces(
        &self,
        phase: Trig,
        state: &State,
        (u, q): (f64, f64),
        left: f64,
    ) -> f64 {
        let contact = self.contact_instant(phase, state).contact;
        contact.slip_after_bounces(1f64.copysign(contact.at.slip), (u, q), left)
    }
}

/// The tip on its way along body 2: x2 = tip(x1) - delta.
pub(crate) struct TipSlide<'a, T: Number> {
    parameters: &'a Parameters<T>,
    bodies: [Body<T>; 2],
    omega: T,
    sin: Series<T>,
    cos: Series<T>,
    /// sin x1 x1'.
    turning: Series<T>,
    /// x1'' and x2'' without a contact force.
    free: [Series<T>; 2],
    /// Coefficient n of cos x1 x1' without its part cos(0) w(n).
    known_rate: T,
    /// Coefficients n and n + 1 of cos psi.
    load: [T; 2],
}

impl<'a, T: Number> TipSlide<'a, T> {
    /// From x1, at a phase of the loads (its cosine and sine).
    pub fn new(
        parameters: &'a Parameters<T>,
        (cos_psi, sin_psi): (T, T),
        unit: f64,
        x1: T,
    ) -> Self {
        let omega = parameters.drive_frequency * unit;
        let zero = [T::constant(0.0); ORDER + 1];
        let (mut sin, mut cos) = (zero, zero);
        Angle { sin: sin[0], cos: cos[0] } = parameters.contact.angle(x1);
        Self {
            parameters,
            bodies: [parameters.pendulum(), parameters.oscillator()]
                .map(|body| body.in_units_of(unit)),
            omega,
            sin,
            cos,
            turning: zero,
            free: [zero; 2],
            known_rate: T::constant(0.0),
            load: [cos_psi, -omega * sin_psi],
        }
    }
}

impl<T: Number> Sliding<T> for TipSlide<'_, T> {
    fn directions(&self, n: usize) -> [T; 2] {
        [self.cos[n], self.sin[n]]
    }

    fn accelerations(&mut self, n: usize, x: &Series<T>, v: &Series<T>) -> [T; 2] {
        let Self { parameters, bodies: [pendulum, oscillator], omega, sin, cos, .. } = self;
        let oblique = parameters.contact == Contact::Oblique;
        // The velocity of the tip along the normal, cos x1 x1', which is x2'.
        let rate = self.known_rate + cos[0] * v[n];
        let tip = if oblique { sin[n] } else { x[n] };
        let place = if n == 0 { tip - parameters.gap } else { tip };
        let load = self.load[0];
        let [a1, a2] = &mut self.free;
        a1[n] = pendulum.acceleration(x[n], v[n], load);
        a2[n] = oscillator.acceleration(place, rate, load);
        // A constant load has no other coefficient.
        (pendulum.constant, oscillator.constant) = (T::constant(0.0), T::constant(0.0));
        if oblique {
            self.turning[n] = product(sin, v, n);
            cos[n + 1] = -self.turning[n] * INVERSE[n + 1];
            sin[n + 1] = rate * INVERSE[n + 1];
            self.known_rate = product(cos, v, n + 1);
        }
        let others = self.known_rate * (n + 1) as f64 - a2[n];
        // Coefficients of cos psi by (cos psi)'' = -omega^2 cos psi.
        let next = -(*omega * *omega) * load * (INVERSE[n + 1] * INVERSE[n + 2]);
        self.load = [self.load[1], next];
        [a1[n], others]
    }

    fn free_gap_acceleration(&self, n: usize, v: &Series<T>) -> T {
        let [a1, a2] = &self.free;
        product(a1, &self.cos, n) - product(&self.turning, v, n) - a2[n]
    }
}
