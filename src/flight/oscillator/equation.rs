//! The equation of motion of one body, x'' + 2 c x' + w^2 x = f cos psi, and its usual solution: a
//! body that swings, and answers the drive with its steady response. No branch in it needs a jump, so
//! that it can be evaluated for one body or for several in the lanes of a register.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use super::{BodyFlight, Motion};
use crate::double_double::DoubleDouble;
use crate::elementary::decay_minus_1;
use crate::flight::drive::{Trig, Turn};
use crate::lanes::lanes_of;
use crate::tolerance::DECAYED;

const THIRD: f64 = 1.0 / 3.0;

/// Constants of one body's equation of motion.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Equation {
    pub natural: f64,
    pub natural_squared: f64,
    /// c = zeta w.
    pub decay_rate: f64,
    pub forcing: f64,
    pub omega: f64,
    /// Damped frequency (or kappa) to 32 digits.
    pub damped: DoubleDouble,
    /// Real and imaginary part of P = f/(w^2 - omega^2 + 2 i c omega); not finite at resonance
    /// without damping.
    pub steady_re: f64,
    pub steady_im: f64,
}

lanes_of! {
    /// The equations of several bodies.
    Equations of Equation {
        natural: natural,
        natural_squared: natural_squared,
        decay_rate: decay_rate,
        forcing: forcing,
        omega: omega,
        damped: damped.hi,
        damped_rest: damped.lo,
        steady_re: steady_re,
        steady_im: steady_im,
    }
}

impl Equation {
    /// Displacement and rate/omega of the steady response Re(P e^{i psi}) at the start of a flight.
    #[inline(always)]
    pub fn steady_start(&self, start: Trig) -> (f64, f64) {
        let (re, im) = (self.steady_re, self.steady_im);
        (re * start.cos - im * start.sin, -(re * start.sin + im * start.cos))
    }

    /// A flight with the steady response; of an unforced body that is zero.
    #[inline(always)]
    pub fn steady_flight(&self, x: f64, v: f64, start: Trig) -> BodyFlight {
        let (p, q) = self.steady_start(start);
        self.flight((x, v), (x - p, v - self.omega * q), (p, q))
    }

    /// A flight from its state, its free part's displacement and rate, and its forced part's constants.
    #[inline(always)]
    pub fn flight(
        &self,
        (x, v): (f64, f64),
        (a, rate): (f64, f64),
        (p, q): (f64, f64),
    ) -> BodyFlight {
        let c = self.decay_rate;
        // Not by w^2, a constant whose rounding every flight would leave in the energy.
        let k = self.natural * (self.natural * a) + c * rate;
        BodyFlight { x, v, a, rate, b: rate + c * a, k, p, q }
    }

    /// Whether the free motion has decayed so far that its start would cancel.
    #[inline(always)]
    pub fn decayed(&self, s: f64) -> bool {
        self.decay_rate * s > DECAYED
    }

    /// (C - 1, S) from (cos wd s - 1, sin wd s/wd).
    #[inline(always)]
    pub fn damped_basis(&self, s: f64, cos_minus_1: f64, sine: f64) -> (f64, f64) {
        let shrink = decay_minus_1(-self.decay_rate * s);
        let remaining = 1.0 + shrink;
        (shrink + remaining * cos_minus_1, remaining * sine)
    }

    /// Increment of the displacement, and rate, of the free part by (C - 1, S).
    #[inline(always)]
    pub fn free(f: &BodyFlight, (c1, s1): (f64, f64)) -> (f64, f64) {
        (f.a * c1 + f.b * s1, f.rate + (f.rate * c1 - f.k * s1))
    }

    /// The same with the steady response.
    #[inline(always)]
    pub fn combine(&self, f: &BodyFlight, basis: (f64, f64), turn: &Turn) -> (f64, f64) {
        let (increment, rate) = Self::free(f, basis);
        (increment + (f.p * turn.cos_minus_1 + f.q * turn.sin), rate + self.steady_rate(f, turn))
    }

    #[inline(always)]
    pub fn steady_rate(&self, f: &BodyFlight, turn: &Turn) -> f64 {
        self.omega * (f.q + (f.q * turn.cos_minus_1 - f.p * turn.sin))
    }

    /// Motion at a local time `s` at which the free motion has not decayed; `turned`:
    /// (cos wd s - 1, sin wd s).
    #[inline(always)]
    pub fn swung(&self, f: &BodyFlight, s: f64, turned: (f64, f64), turn: &Turn) -> Motion {
        let (cos_minus_1, sine) = (turned.0, turned.1 / self.damped.hi);
        let basis = if self.decay_rate == 0.0 {
            (cos_minus_1, sine)
        } else {
            self.damped_basis(s, cos_minus_1, sine)
        };
        let (increment, rate) = self.combine(f, basis, turn);
        self.motion_from(increment, rate, [f.x, increment], turn)
    }

    /// The next derivatives from the equation of motion.
    #[inline(always)]
    pub fn motion_from(&self, increment: f64, rate: f64, place: [f64; 2], turn: &Turn) -> Motion {
        let (w2, c2) = (self.natural_squared, 2.0 * self.decay_rate);
        let x = place[0] + place[1];
        let acceleration = self.forcing * turn.phase.cos - c2 * rate - w2 * x;
        let jerk = -self.forcing * self.omega * turn.phase.sin - c2 * acceleration - w2 * rate;
        Motion { increment, place, rate, acceleration, jerk }
    }

    /// Derivatives 4 and 5 of the displacement: x'''' = -omega^2 f cos psi - 2 c x''' - w^2 x'', and
    /// so on; f cos psi and its rate from the equation of motion.
    #[inline(always)]
    pub fn higher(&self, m: &Motion) -> [f64; 2] {
        let (w2, c2) = (self.natural_squared, 2.0 * self.decay_rate);
        let omega2 = self.omega * self.omega;
        let load = m.acceleration + c2 * m.rate + w2 * m.displacement();
        let load_rate = m.jerk + c2 * m.acceleration + w2 * m.rate;
        let fourth = -omega2 * load - c2 * m.jerk - w2 * m.acceleration;
        [fourth, -omega2 * load_rate - c2 * fourth - w2 * m.jerk]
    }

    /// Displacement and rate a short time `h` after a motion, by Taylor polynomials up to the fifth
    /// derivative. (Energy would drift by the last term, whose sign is always the same.)
    #[inline(always)]
    pub fn later(&self, m: &Motion, h: f64) -> (f64, f64) {
        let [fourth, fifth] = self.higher(m);
        let (half, third, quarter) = (0.5 * h, THIRD * h, 0.25 * h);
        let tail = fourth + 0.2 * h * fifth;
        let displacement =
            h * (m.rate + half * (m.acceleration + third * (m.jerk + quarter * tail)));
        let tail = fourth + quarter * fifth;
        let speed = h * (m.acceleration + half * (m.jerk + third * tail));
        (m.place[0] + (m.place[1] + displacement), m.rate + speed)
    }

    /// From the equation of motion.
    #[inline(always)]
    pub fn acceleration(&self, x: f64, v: f64, cos_psi: f64) -> f64 {
        let free = self.natural_squared.mul_add(x, 2.0 * self.decay_rate * v);
        self.forcing.mul_add(cos_psi, -free)
    }
}
