//! One forced, damped linear oscillator, x'' + 2 c x' + w^2 x = f cos psi + load, c = zeta w, in
//! closed form for every damping, with the bounds on its derivatives that the contact search needs.
//!
//! The constant load moves the equilibrium to load/w^2, about which the free motion is written. Where
//! the spring is too weak for that, or there is none, the motion from rest under the load is added.
//!
//! Homogeneous part: x_h = a C + b S with C = e^{-cs} cos(wd s), S = e^{-cs} sin(wd s)/wd and
//! b = v + c a (Han, Jin & Hu (2004), (A.1), (A.2)); C and S stay finite through critical damping.
//! Forced part: the steady response Re(P e^{i psi}), or near resonance one that stays finite.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

mod bounds;
mod equation;
mod few;
mod free;
mod swinging;

pub(crate) use bounds::Bounds;
use equation::Series;
pub(crate) use equation::{Equation, Equations, SeriesLanes};
pub(crate) use few::FewEquations;
use free::Decay;
pub(crate) use free::FreeBody;

use nalgebra::Complex;

use super::drive::{Trig, Turn, turn};
use super::resonance::{Beat, RestResponse};
use crate::flight::tolerances::{LEAST_SPRING_ANGLE, RESONANCE_LOSS, SHORT_ANGLE};
use crate::model::oblique::Body;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::{self, decay_minus_1};
use crate::numerics::lanes::lanes_of;

/// How the forced motion is written.
#[derive(Debug, Clone, Copy)]
enum Response {
    Unforced,
    /// Re(P e^{i psi}).
    Steady,
    /// Near resonance P is huge and cancels: a motion that beats instead.
    Beat(Beat),
    /// Drive and both exponents close to zero: the motion that starts from rest.
    FromRest(RestResponse),
}

/// One body's equation of motion, worked out once per system.
#[derive(Debug, Clone)]
pub(crate) struct Oscillator {
    pub equation: Equation,
    decay: Decay,
    response: Response,
    /// The motion from rest under a constant load of 1, where it is not written about its
    /// equilibrium.
    under_load: Option<Box<RestResponse>>,
    /// Whether all motion is a free oscillation about an equilibrium and the steady response.
    steady: bool,
    span: f64,
}

/// One body's flight: its constants from the state at the start.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct BodyFlight {
    /// Displacement and rate at the start.
    pub x: f64,
    pub v: f64,
    /// Homogeneous displacement, rate, and the constants of x_h and v_h.
    pub a: f64,
    pub rate: f64,
    pub b: f64,
    pub k: f64,
    /// Steady response: displacement p and rate/omega q at the start. Beat: its complex factor
    /// p + i q at the start.
    pub p: f64,
    pub q: f64,
}

lanes_of! {
    /// The flights of several bodies.
    BodyFlights of BodyFlight { x: x, v: v, a: a, rate: rate, b: b, k: k, p: p, q: q }
}

/// Motion of one body at some time of a flight.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Motion {
    /// x(s) - x(0).
    pub increment: f64,
    /// x(s) as a sum: of x(0) and the increment, or after strong decay, where these cancel, of
    /// itself and 0.
    place: [f64; 2],
    pub rate: f64,
    pub acceleration: f64,
    pub jerk: f64,
}

lanes_of! {
    /// Several motions, without their place.
    MotionLanes of Motion {
        increment: increment, rate: rate, acceleration: acceleration, jerk: jerk
    }
}

impl Motion {
    /// Sets the place from where the motion started.
    #[inline(always)]
    pub fn place_after(&mut self, start: f64) {
        self.place = [start, self.increment];
    }

    /// x(s).
    #[inline(always)]
    pub fn displacement(&self) -> f64 {
        self.place[0] + self.place[1]
    }
}

impl Oscillator {
    /// Of a body driven at `omega`, for local flights of at most `span`.
    pub fn new(body: &Body<f64>, omega: f64, span: f64) -> Self {
        let free = FreeBody::on_spring(DoubleDouble::new(body.natural), body.damping);
        Self::under(free, body.amplitude, body.constant, omega, span)
    }

    /// Of a body under a drive of amplitude `forcing` and a constant load.
    pub fn under(free: FreeBody, forcing: f64, load: f64, omega: f64, span: f64) -> Self {
        let FreeBody { natural, decay_rate, damped, decay, growth } = free;
        let stiffness =
            Complex::new((natural - omega) * (natural + omega), 2.0 * decay_rate * omega);
        let inverse = 1.0 / stiffness.norm();
        // Size of the forced motion within one local flight, per unit force.
        let mut reach = (0.5 * span * span).min(span / (natural + omega));
        if let Decay::Overdamped { kappa, .. } = decay {
            reach = reach.min(span / (2.0 * kappa));
        }
        let from_rest = |frequency: f64| {
            let exponents = match decay {
                Decay::Overdamped { kappa, slow } => {
                    [(-slow, DoubleDouble::ZERO), (-slow - 2.0 * kappa, DoubleDouble::ZERO)]
                }
                _ => [(-decay_rate, damped), (-decay_rate, -damped)],
            };
            RestResponse::new(frequency, exponents)
        };
        let response = if forcing == 0.0 {
            Response::Unforced
        } else if inverse <= RESONANCE_LOSS * reach {
            Response::Steady
        } else {
            match decay {
                Decay::Undamped { wd } | Decay::Underdamped { wd } if (omega + wd) * span > 1.0 => {
                    Response::Beat(Beat::new(forcing, omega, decay_rate, damped))
                }
                _ => Response::FromRest(from_rest(omega)),
            }
        };
        let turn = natural * span;
        let has_equilibrium = turn >= LEAST_SPRING_ANGLE && natural * turn >= 2.0 * decay_rate;
        let under_load = (load != 0.0 && !has_equilibrium).then(|| Box::new(from_rest(0.0)));
        let steady = if forcing == 0.0 {
            Complex::new(0.0, 0.0)
        } else {
            Complex::new(forcing, 0.0) / stiffness
        };
        Self {
            equation: Equation {
                natural,
                natural_squared: natural * natural,
                decay_rate,
                forcing,
                load,
                equilibrium: if load != 0.0 && has_equilibrium {
                    load / (natural * natural)
                } else {
                    0.0
                },
                omega,
                damped,
                steady_re: steady.re,
                steady_im: steady.im,
                growth,
                steady_size: steady.norm(),
                // Infinite where nothing turns or decays: the series is then finite.
                short: SHORT_ANGLE / natural.max(omega).max(2.0 * decay_rate),
            },
            decay,
            response,
            steady: matches!(response, Response::Unforced | Response::Steady)
                && under_load.is_none(),
            under_load,
            span,
        }
    }

    /// Whether all motion is a free oscillation about an equilibrium and the steady response.
    #[inline(always)]
    pub fn is_steady(&self) -> bool {
        self.steady
    }

    /// What `work` makes of this body without its constant load.
    pub fn without_constant<R>(&self, work: impl FnOnce(&Self) -> R) -> R {
        if self.has_constant() {
            let equation = Equation { load: 0.0, equilibrium: 0.0, ..self.equation };
            let steady = matches!(self.response, Response::Unforced | Response::Steady);
            work(&Self { equation, under_load: None, steady, ..self.clone() })
        } else {
            work(self)
        }
    }

    /// This body without its drive.
    pub fn without_drive(&self) -> Self {
        let equation = Equation {
            forcing: 0.0,
            steady_re: 0.0,
            steady_im: 0.0,
            steady_size: 0.0,
            ..self.equation
        };
        let steady = self.under_load.is_none();
        Self { equation, response: Response::Unforced, steady, ..self.clone() }
    }

    /// The slowest rate at which a free motion decays.
    pub fn slowest_decay(&self) -> f64 {
        match self.decay {
            Decay::Overdamped { slow, .. } => slow,
            _ => self.equation.decay_rate,
        }
    }

    /// Whether the drive acts on the body.
    pub fn is_forced(&self) -> bool {
        self.equation.forcing != 0.0
    }

    /// Whether a constant load acts on the body.
    pub fn has_constant(&self) -> bool {
        self.equation.load != 0.0
    }

    #[inline(always)]
    pub fn flight(&self, x: f64, v: f64, start: Trig) -> BodyFlight {
        let equation = &self.equation;
        match self.response {
            Response::Unforced | Response::Steady => equation.steady_flight(x, v, start),
            Response::Beat(beat) => equation.beating_flight(&beat, x, v, start),
            Response::FromRest(_) => {
                equation.flight((x, v), (x - equation.equilibrium, v), (0.0, 0.0))
            }
        }
    }

    /// (C - 1, S) at local time s.
    #[inline(always)]
    pub fn basis(&self, s: f64) -> (f64, f64) {
        match self.decay {
            Decay::Undamped { .. } | Decay::Underdamped { .. } => {
                let change = self.equation.amplitude_change(s);
                self.equation.swinging_basis(change, turn(self.equation.damped, s))
            }
            Decay::Critical | Decay::Overdamped { .. } => self.aperiodic_basis(s),
        }
    }

    fn aperiodic_basis(&self, s: f64) -> (f64, f64) {
        if let Decay::Overdamped { kappa, slow } = self.decay {
            let slow_part = decay_minus_1(-slow * s);
            let fast_part = decay_minus_1(-(slow + 2.0 * kappa) * s);
            let split = -decay_minus_1(-2.0 * kappa * s) / (2.0 * kappa);
            return (0.5 * (slow_part + fast_part), (1.0 + slow_part) * split);
        }
        let shrink = decay_minus_1(-self.equation.decay_rate * s);
        (shrink, s * (1.0 + shrink))
    }

    /// (C - 1, S) after any time, the angle reduced in double-double.
    #[inline(always)]
    fn basis_far(&self, elapsed: DoubleDouble) -> (f64, f64) {
        if matches!(self.decay, Decay::Critical | Decay::Overdamped { .. }) {
            return self.aperiodic_basis(elapsed.hi);
        }
        let angle = (self.equation.damped * elapsed).reduced_angle();
        let change = self.equation.amplitude_change(elapsed.hi);
        self.equation.swinging_basis(change, elementary::turn(angle, 0.0))
    }

    /// The forced motion only if it is steady.
    #[inline(always)]
    fn combine(&self, f: &BodyFlight, basis: (f64, f64), turn: &Turn) -> (f64, f64) {
        match self.response {
            Response::Steady => self.equation.combine(f, basis, turn),
            _ => Equation::free(f, basis),
        }
    }

    /// Displacement (not its increment) and rate without the start's rounding, the forced motion
    /// only if it is steady, that under the load only if it is about an equilibrium.
    #[inline(never)]
    fn remainder(&self, f: &BodyFlight, elapsed: DoubleDouble, turn: &Turn) -> (f64, f64) {
        let s = elapsed.hi;
        let left = (-self.equation.decay_rate * s).exp();
        let combined =
            |cosine: f64, sine: f64| (f.a * cosine + f.b * sine, f.rate * cosine - f.k * sine);
        let (x, v) = match self.decay {
            Decay::Undamped { wd } | Decay::Underdamped { wd } => {
                let (sin, cos) = (self.equation.damped * elapsed).reduced_angle().sin_cos();
                combined(left * cos, left * sin / wd)
            }
            Decay::Critical => combined(left, s * left),
            Decay::Overdamped { kappa, slow } => {
                let fast = slow + 2.0 * kappa;
                let (slow_left, fast_left) = ((-slow * s).exp(), (-fast * s).exp());
                if kappa < 0.5 * self.equation.decay_rate {
                    let split = -(-2.0 * kappa * s).exp_m1() / (2.0 * kappa);
                    combined(0.5 * (slow_left + fast_left), slow_left * split)
                } else {
                    // C and S cancel too; the two modes do not.
                    let slow_part = (f.rate + fast * f.a) / (2.0 * kappa) * slow_left;
                    let fast_part = -(f.rate + slow * f.a) / (2.0 * kappa) * fast_left;
                    (slow_part + fast_part, -slow * slow_part - fast * fast_part)
                }
            }
        };
        let x = x + self.equation.equilibrium;
        match self.response {
            Response::Steady => (
                x + (f.p + (f.p * turn.cos_minus_1 + f.q * turn.sin)),
                v + self.equation.steady_rate(f, turn),
            ),
            _ => (x, v),
        }
    }

    /// Motion and rate that the load adds where it is not about an equilibrium; S of the free motion
    /// then.
    fn loaded(&self, elapsed: DoubleDouble, sine: f64) -> (f64, f64) {
        match &self.under_load {
            Some(response) => {
                let load = self.equation.load;
                (load * response.at(elapsed).re, load * sine)
            }
            None => (0.0, 0.0),
        }
    }

    /// Forced motion and its rate where it is not the steady response.
    fn resonant(
        &self,
        f: &BodyFlight,
        elapsed: DoubleDouble,
        (c1, sine): (f64, f64),
        start: Trig,
    ) -> Option<(f64, f64)> {
        match &self.response {
            Response::Beat(beat) => Some(beat.at(f.p, f.q, elapsed, c1, sine)),
            Response::FromRest(response) => {
                let phase = Complex::new(start.cos, start.sin) * self.equation.forcing;
                let g = response.at(elapsed);
                let rate = Complex::new(sine, 0.0) + Complex::new(0.0, self.equation.omega) * g;
                Some(((phase * g).re, (phase * rate).re))
            }
            _ => None,
        }
    }

    /// The forced motion of a body that swings and beats.
    pub fn beat(&self) -> Option<&Beat> {
        match &self.response {
            Response::Beat(beat) => Some(beat),
            _ => None,
        }
    }

    /// Whether a body swings about an equilibrium, and answers the drive with its steady response or
    /// with a beat.
    pub fn swings_or_beats(&self) -> bool {
        let swings = matches!(self.decay, Decay::Undamped { .. } | Decay::Underdamped { .. });
        swings && !matches!(self.response, Response::FromRest(_)) && self.under_load.is_none()
    }

    /// Local time from which on [`Oscillator::swung`] holds: infinite for a body that creeps or is
    /// near resonance.
    pub fn swings_from(&self) -> f64 {
        let swings = matches!(self.decay, Decay::Undamped { .. } | Decay::Underdamped { .. });
        if swings && self.is_steady() { self.equation.short } else { f64::INFINITY }
    }

    /// Motion at local time `s`.
    pub fn at(&self, f: &BodyFlight, s: f64, turn: &Turn) -> Motion {
        if s <= self.equation.short {
            return self.short_motion(f, s, turn);
        }
        self.motion(f, s, self.basis(s), turn)
    }

    /// Motion at local time `s`, from known (C - 1, S).
    pub fn at_basis(&self, f: &BodyFlight, s: f64, basis: (f64, f64), turn: &Turn) -> Motion {
        if s <= self.equation.short {
            return self.short_motion(f, s, turn);
        }
        self.motion(f, s, basis, turn)
    }

    /// Motion a short time after the start.
    fn short_motion(&self, f: &BodyFlight, s: f64, turn: &Turn) -> Motion {
        let (increment, rate) = Series::at(&self.equation, f, turn.start, s);
        let (increment, rate) = if increment.is_finite() && rate.is_finite() {
            (increment, rate)
        } else {
            self.shortly_in_units_of(s, f, turn)
        };
        self.equation.motion_from(increment, rate, [f.x, increment], turn)
    }

    /// The short motion computed with `s` as the unit of time: omega^n may leave the range of floats
    /// where (omega s)^n does not.
    #[cold]
    #[inline(never)]
    fn shortly_in_units_of(&self, s: f64, f: &BodyFlight, turn: &Turn) -> (f64, f64) {
        if s == 0.0 {
            return (0.0, f.v);
        }
        let flight = BodyFlight { v: f.v * s, ..*f };
        let (increment, rate) = Series::at(&self.equation.in_units_of(s), &flight, turn.start, 1.0);
        (increment, rate / s)
    }

    #[inline(always)]
    fn motion(&self, f: &BodyFlight, s: f64, basis: (f64, f64), turn: &Turn) -> Motion {
        let elapsed = DoubleDouble::new(s);
        let forced = match &self.response {
            Response::Beat(beat) => beat.near((f.p, f.q), s, basis),
            _ => self.resonant(f, elapsed, basis, turn.start).unwrap_or((0.0, 0.0)),
        };
        let loaded = self.loaded(elapsed, basis.1);
        let forced = (forced.0 + loaded.0, forced.1 + loaded.1);
        if self.equation.decayed(s) {
            let (x, v) = self.remainder(f, elapsed, turn);
            let x = x + forced.0;
            return self.equation.motion_from(x - f.x, v + forced.1, [x, 0.0], turn);
        }
        let (increment, rate) = self.combine(f, basis, turn);
        let increment = increment + forced.0;
        self.equation.motion_from(increment, rate + forced.1, [f.x, increment], turn)
    }

    /// Displacement and rate after any time.
    #[inline(always)]
    pub fn after(&self, f: &BodyFlight, x: f64, elapsed: DoubleDouble, turn: &Turn) -> (f64, f64) {
        if elapsed.hi <= self.equation.short {
            let motion = self.short_motion(f, elapsed.hi, turn);
            return (x + motion.increment, motion.rate);
        }
        let basis = self.basis_far(elapsed);
        let forced = self.resonant(f, elapsed, basis, turn.start).unwrap_or((0.0, 0.0));
        let loaded = self.loaded(elapsed, basis.1);
        let forced = (forced.0 + loaded.0, forced.1 + loaded.1);
        if self.equation.decayed(elapsed.hi) {
            let (x, v) = self.remainder(f, elapsed, turn);
            return (x + forced.0, v + forced.1);
        }
        let (increment, rate) = self.combine(f, basis, turn);
        (x + (increment + forced.0), rate + forced.1)
    }

    /// Derivative of displacement and rate after `elapsed` with respect to those at the start:
    /// x = a C + (v + c a) S.
    pub fn transition(&self, elapsed: DoubleDouble) -> [[f64; 2]; 2] {
        self.equation.transition_by(self.basis_far(elapsed))
    }
}
