//! The response from rest to a complex unit force e^{i omega t}, without cancellation at and near
//! resonance, critical damping, and zero frequencies.
//!
//! G(t) = int_0^t S(t - s) e^{i omega s} ds is the second divided difference of e^{zt} at
//! z = i omega and the two exponents of the free motion. Divided differences are summed as a
//! series where the exponents are close, else formed from the most distant pair
//! (McCurdy, Ng & Parlett (1984), Math. Comp. 43, 501-528).

use nalgebra::Complex;

use crate::double_double::DoubleDouble;
use crate::tolerance::SERIES_SPREAD;

type C64 = Complex<f64>;

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
        let orders =
            [[drive, first, second], [first, drive, second], [drive, second, first]];
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
            / (a.value() - c.value())
    }

    /// e^{mt} sum_k h_k(z - m) t^(k+2)/(k+2)!, h_k the complete homogeneous polynomials, m the mean.
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
    growth * C64::new(shrink * cos - 2.0 * half * half, (1.0 + shrink) * sin) / difference
}
