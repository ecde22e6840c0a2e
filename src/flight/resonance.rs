//! Forced motions that stay finite at and near resonance, critical damping, and zero frequencies,
//! where the steady response is infinite or cancels.
//!
//! The response from rest to e^{i omega t}, int_0^t S(t - s) e^{i omega s} ds, is the second
//! divided difference of e^{zt} at z0 = i omega and the exponents z1, z2 of the free motion. Where
//! z0 and z1 are close and z2 is not, it is (E - S)/(z0 - z2), E the first divided difference at
//! z0 and z1; the part with S is a free motion, so E/(z0 - z2) alone serves: the [`Beat`]. Where
//! all three may be close, [`RestResponse`] sums a series, or goes by the most distant pair
//! (McCurdy, Ng & Parlett (1984), Math. Comp. 43, 501-528).

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use nalgebra::Complex;

use super::drive::Trig;
use crate::flight::tolerances::SERIES_SPREAD;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::{self, decay_minus_1};
use crate::numerics::lanes::lanes_of;

type C64 = Complex<f64>;

/// Forced motion Re(F E(t)), F = f e^{i psi}/(z0 - z2) with psi at the flight's start, and E =
/// e^{(z0 + z1) t/2} t sinh(y)/y, y = (z0 - z1) t/2. It starts with displacement 0 and rate Re F.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Beat {
    factor: C64,
    omega: f64,
    decay_rate: f64,
    wd: f64,
    half_sum: DoubleDouble,
    half_difference: DoubleDouble,
}

lanes_of! {
    /// Several beats.
    Beats of Beat {
        factor_re: factor.re,
        factor_im: factor.im,
        omega: omega,
        decay_rate: decay_rate,
        wd: wd,
        half_sum: half_sum.hi,
        half_sum_rest: half_sum.lo,
        half_difference: half_difference.hi,
        half_difference_rest: half_difference.lo,
    }
}

impl Beat {
    pub fn new(forcing: f64, omega: f64, decay_rate: f64, damped: DoubleDouble) -> Self {
        let drive = DoubleDouble::new(omega);
        let half_sum = (drive + damped).scale(0.5);
        let distance = C64::new(decay_rate, 2.0 * half_sum.value());
        Self {
            factor: C64::new(forcing, 0.0) / distance,
            omega,
            decay_rate,
            wd: damped.value(),
            half_sum,
            half_difference: (drive - damped).scale(0.5),
        }
    }

    /// F, from the forcing phase at the start of a flight.
    #[inline(always)]
    pub fn factor(&self, start: Trig) -> (f64, f64) {
        let C64 { re, im } = self.factor;
        (re * start.cos - im * start.sin, re * start.sin + im * start.cos)
    }

    /// Displacement and rate at a time `t` within a local flight; C - 1 and S of the free motion
    /// then. No branch needs a jump.
    #[inline(always)]
    pub fn near(&self, (p, q): (f64, f64), t: f64, (c1, sine): (f64, f64)) -> (f64, f64) {
        let half_shrink = 0.5 * self.decay_rate * t;
        let (angle, sin, cos) = turned(self.half_difference, t);
        // e^{-half_shrink} sinh(y)/y
        let shrink = decay_minus_1(-2.0 * half_shrink);
        let (re, im) = (-0.5 * shrink * cos, (1.0 + 0.5 * shrink) * sin);
        // Neither underflows unless both are zero: a difference of frequencies is zero or above
        // 1e-33, damping zero or above 1e-100.
        let square = half_shrink * half_shrink + angle * angle;
        let quotient = (
            if square == 0.0 { 1.0 } else { (re * half_shrink + im * angle) / square },
            if square == 0.0 { 0.0 } else { (im * half_shrink - re * angle) / square },
        );
        let (_, sin, cos) = turned(self.half_sum, t);
        let e =
            ((quotient.0 * cos - quotient.1 * sin) * t, (quotient.0 * sin + quotient.1 * cos) * t);
        // E' = e^{z1 t} + z0 E
        let rate = (1.0 + c1 - self.omega * e.1, self.wd * sine + self.omega * e.0);
        (p * e.0 - q * e.1, p * rate.0 - q * rate.1)
    }

    /// Displacement and rate after `elapsed`; C - 1 and S of the free motion then.
    pub fn at(&self, p: f64, q: f64, elapsed: DoubleDouble, c1: f64, sine: f64) -> (f64, f64) {
        let t = elapsed.hi;
        let half_shrink = 0.5 * self.decay_rate * t;
        let angle = self.half_difference * elapsed;
        let (sin, cos) = angle.reduced_angle().sin_cos();
        // e^{-half_shrink} sinh(y)/y
        let quotient = if half_shrink == 0.0 {
            let angle = angle.value();
            C64::new(if angle == 0.0 { 1.0 } else { sin / angle }, 0.0)
        } else {
            let shrink = (-2.0 * half_shrink).exp_m1();
            C64::new(-0.5 * shrink * cos, (1.0 + 0.5 * shrink) * sin)
                / C64::new(half_shrink, angle.value())
        };
        let (sin, cos) = (self.half_sum * elapsed).reduced_angle().sin_cos();
        let e = quotient * C64::new(cos, sin) * t;
        // E' = e^{z1 t} + z0 E
        let rate = C64::new(1.0 + c1 - self.omega * e.im, self.wd * sine + self.omega * e.re);
        (p * e.re - q * e.im, p * rate.re - q * rate.im)
    }
}

/// The angle w t of a local flight, and its sine and cosine.
#[inline(always)]
fn turned(w: DoubleDouble, t: f64) -> (f64, f64, f64) {
    let angle = DoubleDouble::product(w.hi, t);
    let tail = angle.lo + w.lo * t;
    let (sin, cos) = elementary::sin_cos_within(angle.hi, tail);
    (angle.hi + tail, sin, cos)
}

/// A complex exponent; the imaginary part to 32 digits, for long times.
#[derive(Debug, Clone, Copy)]
struct Exponent {
    re: f64,
    im: DoubleDouble,
}

impl Exponent {
    fn minus(self, other: Self) -> (f64, DoubleDouble) {
        (self.re - other.re, self.im - other.im)
    }

    fn value(self) -> C64 {
        C64::new(self.re, self.im.value())
    }
}

/// Response from rest of one oscillator.
#[derive(Debug, Clone, Copy)]
pub(super) struct RestResponse {
    /// Ordered so that the first and the last are the most distant pair.
    exponents: [Exponent; 3],
    spread: f64,
}

impl RestResponse {
    pub fn new(omega: f64, [first, second]: [(f64, DoubleDouble); 2]) -> Self {
        let drive = Exponent { re: 0.0, im: DoubleDouble::new(omega) };
        let [first, second] = [first, second].map(|(re, im)| Exponent { re, im });
        let distance = |a: Exponent, b: Exponent| {
            let (re, im) = a.minus(b);
            re.hypot(im.value())
        };
        let orders = [[drive, first, second], [first, drive, second], [drive, second, first]];
        let mut exponents = orders[0];
        for order in orders {
            if distance(order[0], order[2]) > distance(exponents[0], exponents[2]) {
                exponents = order;
            }
        }
        Self { exponents, spread: distance(exponents[0], exponents[2]) }
    }

    pub fn at(&self, elapsed: DoubleDouble) -> C64 {
        let [a, b, c] = self.exponents;
        if self.spread * elapsed.hi <= SERIES_SPREAD {
            return self.series(elapsed.hi);
        }
        (first_difference(a, b, elapsed) - first_difference(b, c, elapsed))
            .fdiv(a.value() - c.value())
    }

    /// e^{mt} sum_k h_k(z - m) t^(k+2)/(k+2)!, h_k the complete homogeneous polynomials, m the
    /// mean.
    fn series(&self, t: f64) -> C64 {
        let z = self.exponents.map(Exponent::value);
        let mean = (z[0] + z[1] + z[2]) / 3.0;
        let d = z.map(|z| (z - mean) * t);
        let one = C64::new(1.0, 0.0);
        let (mut h1, mut h2, mut h3) = (one, one, one);
        let mut factor = 0.5 * t * t;
        let mut sum = one * factor;
        // |d| <= 1: the terms fall faster than 3^k/(k+2)!.
        for k in 1..=24 {
            h1 *= d[0];
            h2 = h1 + d[1] * h2;
            h3 = h2 + d[2] * h3;
            factor /= f64::from(k + 2);
            sum += h3 * factor;
        }
        (mean * t).exp() * sum
    }
}

/// First divided difference (e^{bt} - e^{at})/(b - a) = e^{at} expm1((b - a)t)/(b - a), a the
/// slower to decay.
fn first_difference(a: Exponent, b: Exponent, t: DoubleDouble) -> C64 {
    let (a, b) = if a.re >= b.re { (a, b) } else { (b, a) };
    let (re, im) = b.minus(a);
    let growth = C64::from_polar((a.re * t.hi).exp(), (a.im * t).reduced_angle());
    let difference = C64::new(re, im.value());
    if difference == C64::new(0.0, 0.0) {
        return growth * t.hi;
    }
    let angle = (im * t).reduced_angle();
    let shrink = (re * t.hi).exp_m1();
    let (half, _) = (0.5 * angle).sin_cos();
    let (sin, cos) = angle.sin_cos();
    // The square of the difference may underflow.
    let increase = C64::new(shrink * cos - 2.0 * half * half, (1.0 + shrink) * sin);
    growth * increase.fdiv(difference)
}
