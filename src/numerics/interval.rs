//! Interval arithmetic: every operation encloses all results of its operands' numbers.
//!
//! Sums and products are rounded to nearest and then moved outwards by one float. Sine and cosine
//! are those of `elementary`, moved by the bound of their errors, which is proven operation by
//! operation (tests/python/test_elementary.py). Products that underflow are not covered: numbers
//! here are of order one. A number that is NaN makes an interval that decides nothing (R. E. Moore,
//! R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis, SIAM 2009).

use std::ops::{Add, Mul, Sub};

use super::EPS;
use super::elementary::{self, MOST_TURNED};

/// Error of a value of an elementary function, relative to it. The bound is the one that is proven,
/// no more and no less; tests hold the numbers to it.
pub(crate) const RELATIVE_ERROR: f64 = 1.25 * EPS;
/// Error of the reduction of angles up to [`MOST_TURNED`].
pub(crate) const ABSOLUTE_ERROR: f64 = 4e-21;
/// Angles that need no reduction.
pub(crate) const UNREDUCED: f64 = 0.75;

/// A closed interval [lo, hi].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub lo: f64,
    /// Upper end.
    pub hi: f64,
}

/// The smaller number; NaN if one is.
#[inline]
fn least(a: f64, b: f64) -> f64 {
    if a < b || a.is_nan() { a } else { b }
}

/// The larger number; NaN if one is.
#[inline]
fn most(a: f64, b: f64) -> f64 {
    if a > b || a.is_nan() { a } else { b }
}

impl Interval {
    /// All numbers.
    pub const WHOLE: Self = Self { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

    /// A single number.
    #[must_use]
    pub fn point(x: f64) -> Self {
        Self { lo: x, hi: x }
    }

    /// Results between these two, before they are moved outwards.
    #[inline]
    fn outwards(lo: f64, hi: f64) -> Self {
        Self { lo: lo.next_down(), hi: hi.next_up() }
    }

    /// Whether 0 lies in the interval; also if it is NaN.
    #[must_use]
    #[inline]
    pub fn holds_zero(self) -> bool {
        // A comparison with NaN is false.
        !(self.lo > 0.0 || self.hi < 0.0)
    }

    /// A number near the middle; NaN for the whole line.
    #[must_use]
    #[inline]
    pub fn middle(self) -> f64 {
        least(most(0.5 * (self.lo + self.hi), self.lo), self.hi)
    }

    /// The common part; lo > hi if there is none.
    #[must_use]
    #[inline]
    pub fn meet(self, other: Self) -> Self {
        Self { lo: most(self.lo, other.lo), hi: least(self.hi, other.hi) }
    }

    /// x^2, which is never negative.
    #[must_use]
    #[inline]
    pub fn square(self) -> Self {
        let (lo, hi) = (self.lo.abs(), self.hi.abs());
        let smallest = if self.holds_zero() { 0.0 } else { least(lo, hi) };
        let largest = most(lo, hi);
        let square = Self::outwards(smallest * smallest, largest * largest);
        Self { lo: most(square.lo, 0.0), ..square }
    }

    /// 2 x.
    #[must_use]
    #[inline]
    pub fn twice(self) -> Self {
        Self::outwards(2.0 * self.lo, 2.0 * self.hi)
    }

    /// Sine and cosine: those of the ends, and 1 and -1 where a crest or a trough lies between.
    #[must_use]
    pub fn sin_cos(self) -> (Self, Self) {
        let at_lo = enclosed_sin_cos(self.lo);
        let at_hi = if self.lo == self.hi { at_lo } else { enclosed_sin_cos(self.hi) };
        // In turns; a crest that may lie inside within rounding counts as inside.
        let turns = |x: f64| x / std::f64::consts::TAU;
        let (first, last) = (turns(self.lo), turns(self.hi));
        let slack = 4.0 * EPS * (1.0 + most(first.abs(), last.abs()));
        let (first, last) = (first - slack, last + slack);
        let wave = |a: Self, b: Self, crest: f64| {
            let reaches = |place: f64| (first - place).ceil() <= last - place;
            let lo = if reaches(crest + 0.5) { -1.0 } else { most(least(a.lo, b.lo), -1.0) };
            let hi = if reaches(crest) { 1.0 } else { least(most(a.hi, b.hi), 1.0) };
            Self { lo, hi }
        };
        (wave(at_lo.0, at_hi.0, 0.25), wave(at_lo.1, at_hi.1, 0.0))
    }
}

/// Sine and cosine of a number; of one that is too large only that they lie in [-1, 1].
fn enclosed_sin_cos(x: f64) -> (Interval, Interval) {
    if x.is_nan() || x.abs() > MOST_TURNED {
        let all = Interval { lo: -1.0, hi: 1.0 };
        return (all, all);
    }
    let absolute = if x.abs() <= UNREDUCED { 0.0 } else { ABSOLUTE_ERROR };
    let widened = |value: f64| {
        let by = RELATIVE_ERROR * value.abs() + absolute;
        Interval::outwards(value - by, value + by)
    };
    let (sin, cos) = elementary::sin_cos(x);
    (widened(sin), widened(cos))
}

impl Add for Interval {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Self::outwards(self.lo + other.lo, self.hi + other.hi)
    }
}

impl Sub for Interval {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        Self::outwards(self.lo - other.hi, self.hi - other.lo)
    }
}

impl Mul for Interval {
    type Output = Self;

    #[inline]
    fn mul(self, other: Self) -> Self {
        let (a, b) = (self.lo * other.lo, self.lo * other.hi);
        let (c, d) = (self.hi * other.lo, self.hi * other.hi);
        Self::outwards(least(least(a, b), least(c, d)), most(most(a, b), most(c, d)))
    }
}

#[cfg(test)]
mod tests {
    use super::Interval;
    use crate::numerics::double_double::DoubleDouble;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn drawn(random: &mut ChaCha8Rng) -> (Interval, f64) {
        let (lo, width): (f64, f64) =
            (random.random_range(-3.0..3.0), random.random_range(0.0..0.5));
        let inside = (lo + width * random.random_range(0.0..1.0)).clamp(lo, lo + width);
        (Interval { lo, hi: lo + width }, inside)
    }

    /// Whether an exact number lies in an interval.
    fn holds(interval: Interval, exact: DoubleDouble) -> bool {
        (exact - DoubleDouble::new(interval.lo)).value() >= 0.0
            && (exact - DoubleDouble::new(interval.hi)).value() <= 0.0
    }

    #[test]
    fn results_of_numbers_inside_are_inside() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..20_000 {
            let ((x, a), (y, b)) = (drawn(&mut random), drawn(&mut random));
            let (exact_a, exact_b) = (DoubleDouble::new(a), DoubleDouble::new(b));
            assert!(holds(x + y, exact_a + exact_b), "{x:?} + {y:?}");
            assert!(holds(x - y, exact_a - exact_b), "{x:?} - {y:?}");
            assert!(holds(x * y, DoubleDouble::product(a, b)), "{x:?} * {y:?}");
            assert!(holds(x.square(), DoubleDouble::product(a, a)), "{x:?}^2");
            assert!(holds(x.twice(), exact_a + exact_a), "2 {x:?}");
            let (sin, cos) = x.sin_cos();
            assert!(sin.lo <= a.sin() && a.sin() <= sin.hi, "sin {x:?}");
            assert!(cos.lo <= a.cos() && a.cos() <= cos.hi, "cos {x:?}");
        }
    }

    #[test]
    fn crests_and_troughs_are_inside_waves() {
        let around = |x: f64| Interval { lo: x - 0.1, hi: x + 0.1 };
        let half = std::f64::consts::FRAC_PI_2;
        assert_eq!(around(half).sin_cos().0.hi, 1.0);
        assert_eq!(around(-half).sin_cos().0.lo, -1.0);
        assert_eq!(around(0.0).sin_cos().1.hi, 1.0);
        assert_eq!(around(2.0 * half).sin_cos().1.lo, -1.0);
        assert!(around(1.0).sin_cos().0.hi < 0.9);
        let far = Interval { lo: 1e6, hi: 1e6 + 0.1 };
        assert_eq!(far.sin_cos().0, Interval { lo: -1.0, hi: 1.0 });
    }

    #[test]
    fn nan_and_infinity_decide_nothing() {
        let none = Interval::point(f64::NAN);
        let whole = Interval::WHOLE;
        for x in [none, whole, none * Interval::point(1.0), whole * Interval::point(0.0)] {
            assert!(x.holds_zero() && x.square().lo.max(0.0) == 0.0, "{x:?}");
        }
    }
}
