//! Double-double arithmetic for the contact audit: a number is the unevaluated sum hi + lo, about
//! 32 digits (Dekker (1971), Numer. Math. 18, 224-242). Shares no code with the library.

use std::ops::{Add, Mul, Neg, Sub};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dd {
    pub hi: f64,
    pub lo: f64,
}

/// Sum and rounding error of |a| >= |b|.
fn quick_two_sum(a: f64, b: f64) -> Dd {
    let hi = a + b;
    Dd { hi, lo: b - (hi - a) }
}

fn two_sum(a: f64, b: f64) -> Dd {
    let hi = a + b;
    let part = hi - a;
    Dd { hi, lo: (a - (hi - part)) + (b - part) }
}

/// High and low half of the digits (Veltkamp).
fn split(a: f64) -> (f64, f64) {
    let t = 134_217_729.0 * a;
    let high = t - (t - a);
    (high, a - high)
}

fn two_product(a: f64, b: f64) -> Dd {
    let hi = a * b;
    let ((ah, al), (bh, bl)) = (split(a), split(b));
    Dd { hi, lo: ((ah * bh - hi) + ah * bl + al * bh) + al * bl }
}

impl Dd {
    pub const ZERO: Self = Self { hi: 0.0, lo: 0.0 };
    pub const ONE: Self = Self { hi: 1.0, lo: 0.0 };

    pub fn new(hi: f64) -> Self {
        Self { hi, lo: 0.0 }
    }

    /// Exact sum of two doubles.
    pub fn sum(a: f64, b: f64) -> Self {
        two_sum(a, b)
    }

    pub fn value(self) -> f64 {
        self.hi + self.lo
    }

    pub fn is_negative(self) -> bool {
        self.hi < 0.0 || (self.hi == 0.0 && self.lo < 0.0)
    }

    pub fn abs(self) -> Self {
        if self.is_negative() { -self } else { self }
    }

    /// Product with a power of two, exact.
    pub fn scale(self, power_of_two: f64) -> Self {
        Self { hi: self.hi * power_of_two, lo: self.lo * power_of_two }
    }

    /// Quotient by a double.
    pub fn over(self, divisor: f64) -> Self {
        let first = self.hi / divisor;
        let product = two_product(first, divisor);
        let rest = ((self.hi - product.hi) - product.lo) + self.lo;
        quick_two_sum(first, rest / divisor)
    }

    /// Quotient.
    pub fn divide(self, divisor: Self) -> Self {
        let first = Self::new(self.hi / divisor.hi);
        let rest = self - first * divisor;
        let second = Self::new(rest.hi / divisor.hi);
        let last = (rest - second * divisor).hi / divisor.hi;
        (first + second) + Self::new(last)
    }

    /// Sine and cosine, the angle reduced by multiples of pi/2 (to 48 digits), then Taylor series
    /// on [-pi/4, pi/4].
    pub fn sin_cos(self) -> (Self, Self) {
        const HALF_PI: [f64; 3] =
            [std::f64::consts::FRAC_PI_2, 6.123_233_995_736_766e-17, -1.497_384_904_859_169_8e-33];
        let turns = (self.hi / HALF_PI[0]).round();
        let angle = HALF_PI.iter().fold(self, |angle, &part| angle - two_product(turns, part));
        let square = angle * angle;
        let (mut sine, mut cosine) = (angle, Self::ONE);
        let (mut odd, mut even) = (angle, Self::ONE);
        // (pi/4)^29/29! < 1e-33
        for n in (2..30).step_by(2) {
            let n = f64::from(n);
            even = -(even * square).over((n - 1.0) * n);
            odd = -(odd * square).over(n * (n + 1.0));
            cosine = cosine + even;
            sine = sine + odd;
        }
        match turns.rem_euclid(4.0) {
            0.0 => (sine, cosine),
            1.0 => (cosine, -sine),
            2.0 => (-sine, -cosine),
            _ => (-cosine, sine),
        }
    }
}

impl Add for Dd {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        let (high, low) = (two_sum(self.hi, other.hi), two_sum(self.lo, other.lo));
        let sum = quick_two_sum(high.hi, high.lo + low.hi);
        quick_two_sum(sum.hi, sum.lo + low.lo)
    }
}

impl Neg for Dd {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self { hi: -self.hi, lo: -self.lo }
    }
}

impl Sub for Dd {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Dd {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        let product = two_product(self.hi, other.hi);
        quick_two_sum(product.hi, product.lo + (self.hi * other.lo + self.lo * other.hi))
    }
}

#[cfg(test)]
mod tests {
    use super::Dd;

    #[test]
    fn sine_and_cosine_have_thirty_digits() {
        // To 32 digits by ball arithmetic (python-flint), as hi + lo.
        for (angle, [sine, cosine]) in [
            (
                1.0,
                [
                    (0.841_470_984_807_896_5, 1.776_845_092_935_536e-18),
                    (0.540_302_305_868_139_8, -4.760_954_612_604_417e-17),
                ],
            ),
            (
                3.0,
                [
                    (0.141_120_008_059_867_2, 8.577_269_787_017_502e-18),
                    (-0.989_992_496_600_445_4, -4.206_026_156_609_973_4e-17),
                ],
            ),
            (
                1000.0,
                [
                    (0.826_879_540_532_002_5, 3.867_581_909_641_312e-17),
                    (0.562_379_076_290_702_9, 5.161_142_354_384_820_4e-17),
                ],
            ),
        ] {
            let (sin, cos) = Dd::new(angle).sin_cos();
            for (found, (hi, lo)) in [(sin, sine), (cos, cosine)] {
                let error = (found - Dd { hi, lo }).hi.abs();
                assert!(error < 2e-31, "{angle}: {error:e}");
            }
        }
    }

    #[test]
    fn quotients_undo_products() {
        let (a, b) = (Dd { hi: 3.7, lo: 1.1e-17 }, Dd { hi: -0.3, lo: 7e-18 });
        assert!(((a * b).divide(b) - a).hi.abs() < 1e-30);
        assert!(((a * Dd::new(7.0)).over(7.0) - a).hi.abs() < 1e-30);
    }
}
