//! Double-double numbers (about 32 digits): drive period, damped frequencies and the reduction
//! of large angles, so that the millionth drive period is as exact as the first.
//!
//! Error-free transformations after Dekker (1971) and Knuth; used at set-up and once per long
//! flight, never in the contact search.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use std::f64::consts::PI;
use std::ops::{Add, Mul, Neg, Sub};

use serde::{Deserialize, Serialize};

/// An unevaluated sum `hi + lo` with `|lo| <= ulp(hi)/2`.
#[derive(Debug, Clone, Copy, Default, PartialEq, PartialOrd, Serialize, Deserialize)]
pub(crate) struct DoubleDouble {
    pub hi: f64,
    pub lo: f64,
}

/// 2 pi to 32 digits.
pub(crate) const TWO_PI: DoubleDouble =
    DoubleDouble { hi: 2.0 * PI, lo: 2.449_293_598_294_706_4e-16 };

#[inline(always)]
fn two_sum(a: f64, b: f64) -> DoubleDouble {
    let hi = a + b;
    let bb = hi - a;
    DoubleDouble { hi, lo: (a - (hi - bb)) + (b - bb) }
}

#[inline(always)]
fn quick_two_sum(a: f64, b: f64) -> DoubleDouble {
    let hi = a + b;
    DoubleDouble { hi, lo: b - (hi - a) }
}

#[inline(always)]
fn two_product(a: f64, b: f64) -> DoubleDouble {
    let hi = a * b;
    DoubleDouble { hi, lo: a.mul_add(b, -hi) }
}

impl DoubleDouble {
    pub const ZERO: Self = Self { hi: 0.0, lo: 0.0 };

    #[inline(always)]
    pub const fn new(hi: f64) -> Self {
        Self { hi, lo: 0.0 }
    }

    /// The exact sum of two doubles.
    #[inline(always)]
    pub fn sum(a: f64, b: f64) -> Self {
        two_sum(a, b)
    }

    /// The exact product of two doubles.
    #[inline(always)]
    pub fn product(a: f64, b: f64) -> Self {
        two_product(a, b)
    }

    /// a b + c to 32 digits of its larger term.
    #[inline(always)]
    pub fn product_sum(a: f64, b: f64, c: f64) -> Self {
        let product = two_product(a, b);
        let sum = two_sum(product.hi, c);
        quick_two_sum(sum.hi, sum.lo + product.lo)
    }

    #[inline(always)]
    pub fn value(self) -> f64 {
        self.hi + self.lo
    }

    /// Zero in place of a negative number.
    pub fn not_negative(self) -> Self {
        if self.hi > 0.0 { self } else { Self::ZERO }
    }

    #[inline(always)]
    pub fn scale(self, factor: f64) -> Self {
        let p = two_product(self.hi, factor);
        quick_two_sum(p.hi, self.lo.mul_add(factor, p.lo))
    }

    /// Quotient to 32 digits; the divisor must not be zero.
    pub fn divide(self, other: Self) -> Self {
        let first = self.hi / other.hi;
        let rest = self - other.scale(first);
        let second = rest.hi / other.hi;
        let rest = rest - other.scale(second);
        quick_two_sum(first, second) + Self::new(rest.hi / other.hi)
    }

    /// Square root to 32 digits of a number >= 0.
    pub fn sqrt(self) -> Self {
        if self.hi <= 0.0 {
            return Self::ZERO;
        }
        let root = self.hi.sqrt();
        let rest = self - two_product(root, root);
        quick_two_sum(root, rest.value() / (2.0 * root))
    }

    /// This angle modulo 2 pi, in [-pi, pi], with an absolute error of a few ulp of pi as long
    /// as the angle is below 1e15.
    #[inline(always)]
    pub fn reduced_angle(self) -> f64 {
        let turns = (self.hi / TWO_PI.hi).round();
        if turns == 0.0 {
            return self.value();
        }
        (self - TWO_PI.scale(turns)).value()
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { hi: -self.hi, lo: -self.lo }
    }
}

impl Add for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let s = two_sum(self.hi, other.hi);
        let t = two_sum(self.lo, other.lo);
        let s = quick_two_sum(s.hi, s.lo + t.hi);
        quick_two_sum(s.hi, s.lo + t.lo)
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let p = two_product(self.hi, other.hi);
        quick_two_sum(p.hi, p.lo + (self.hi * other.lo + self.lo * other.hi))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotient_and_root_invert_product() {
        let a = TWO_PI.divide(DoubleDouble::new(1.1));
        let back = a.scale(1.1) - TWO_PI;
        assert!(back.value().abs() < 1e-30);
        let root = TWO_PI.sqrt();
        assert!((root * root - TWO_PI).value().abs() < 1e-30);
    }

    #[test]
    fn a_million_turns_reduce_to_nothing() {
        let angle = TWO_PI.scale(1e6) + DoubleDouble::new(0.3);
        assert!((angle.reduced_angle() - 0.3).abs() < 1e-16);
    }
}
