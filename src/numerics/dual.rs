//! Numbers that carry their derivatives (forward differentiation): formulas written for a
//! [`Number`] give values with `f64`, exact derivatives with [`Dual`].

#![allow(clippy::inline_always)] // a flight with its impact is compiled for several instruction sets

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::numerics::elementary;

/// What formulas are written for.
pub(crate) trait Number:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Mul<f64, Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// A number without derivatives.
    fn constant(value: f64) -> Self;
    /// The number without its derivatives.
    fn value(self) -> f64;
    /// Whether no direction matters.
    fn is_constant(&self) -> bool;
    /// This number, its value known better than by its formula. A number with derivatives stays on
    /// the formula: value and derivatives belong together.
    fn with_value(self, value: f64) -> Self;
    /// The bound in place of a number below it: for what only rounding can bring there. A number
    /// with derivatives stays on the formula, which goes on smoothly beyond its range.
    fn at_least(self, bound: Self) -> Self;
    fn sin_cos(self) -> (Self, Self);
    fn sqrt(self) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn value(self) -> f64 {
        self
    }

    #[inline(always)]
    fn is_constant(&self) -> bool {
        true
    }

    #[inline(always)]
    fn with_value(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn at_least(self, bound: Self) -> Self {
        self.max(bound)
    }

    fn sin_cos(self) -> (Self, Self) {
        elementary::sin_cos(self)
    }

    fn sqrt(self) -> Self {
        self.sqrt()
    }
}

/// A value and its derivatives in N directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Dual<const N: usize> {
    pub value: f64,
    pub slope: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// The independent variable of one direction.
    pub fn variable(value: f64, direction: usize) -> Self {
        let mut slope = [0.0; N];
        slope[direction] = 1.0;
        Self { value, slope }
    }

    /// f(a, b, ...) of this value, from its partial derivatives: the chain rule.
    pub fn chain<const K: usize>(value: f64, partials: [(f64, Self); K]) -> Self {
        let slope = std::array::from_fn(|i| {
            // A direction that does not matter must not bring in 0 times infinity.
            partials.iter().filter(|(_, a)| a.slope[i] != 0.0).map(|(d, a)| d * a.slope[i]).sum()
        });
        Self { value, slope }
    }

    #[inline(always)]
    fn map(self, value: f64, derivative: f64) -> Self {
        Self { value, slope: std::array::from_fn(|i| derivative * self.slope[i]) }
    }

    #[inline(always)]
    fn join(self, other: Self, value: f64, slope: impl Fn(f64, f64) -> f64) -> Self {
        Self { value, slope: std::array::from_fn(|i| slope(self.slope[i], other.slope[i])) }
    }
}

impl<const N: usize> Number for Dual<N> {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self { value, slope: [0.0; N] }
    }

    #[inline(always)]
    fn value(self) -> f64 {
        self.value
    }

    #[inline(always)]
    fn is_constant(&self) -> bool {
        self.slope.iter().all(|&slope| slope == 0.0)
    }

    #[inline(always)]
    fn with_value(self, _: f64) -> Self {
        self
    }

    #[inline(always)]
    fn at_least(self, _: Self) -> Self {
        self
    }

    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = elementary::sin_cos(self.value);
        (self.map(sin, cos), self.map(cos, -sin))
    }

    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.map(root, 0.5 / root)
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.join(other, self.value + other.value, |a, b| a + b)
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.join(other, self.value - other.value, |a, b| a - b)
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[allow(clippy::suspicious_arithmetic_impl)] // the product rule
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let value = self.value * other.value;
        self.join(other, value, |a, b| a * other.value + self.value * b)
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self.map(self.value * factor, factor)
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[allow(clippy::suspicious_arithmetic_impl)] // the quotient rule
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        self.join(other, value, |a, b| (a - value * b) / other.value)
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(-self.value, -1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::{Dual, Number};

    fn formula<T: Number>(x: T, y: T) -> T {
        let (sin, cos) = (x * y).sin_cos();
        (sin * sin - cos / y + T::constant(2.0) * 1.5).sqrt() - (-x)
    }

    #[test]
    fn derivatives_are_those_of_the_formula() {
        let (x, y, h) = (0.7, 1.3, 1e-5);
        let dual = formula(Dual::<2>::variable(x, 0), Dual::variable(y, 1));
        assert_eq!(dual.value, formula(x, y));
        let differences = [
            (formula(x + h, y) - formula(x - h, y)) / (2.0 * h),
            (formula(x, y + h) - formula(x, y - h)) / (2.0 * h),
        ];
        for (slope, difference) in dual.slope.iter().zip(differences) {
            assert!((slope - difference).abs() < 1e-9, "{slope} {difference}");
        }
    }
}
