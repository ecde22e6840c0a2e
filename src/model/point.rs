//! States as points, compared coordinate by coordinate.

use crate::model::structure::{Coordinates, StructureState};

/// Some numbers, compared one by one.
pub trait Point: Clone {
    /// From two of them, coordinate by coordinate.
    fn zip(&self, other: &Self, of: impl Fn(f64, f64) -> f64) -> Self;
    /// The largest, at least 0.
    fn largest(&self) -> f64;
    /// Sum of the products.
    fn dot(&self, other: &Self) -> f64;
    /// Whether all are finite.
    fn all_finite(&self) -> bool;
    /// Whether the distance is at most this.
    fn is_within(&self, other: &Self, most: f64) -> bool {
        self.zip(other, |a, b| (a - b).abs()).largest() <= most
    }
}

impl Point for [f64; 4] {
    #[inline(always)]
    #[allow(clippy::inline_always)] // asked millions of times
    fn zip(&self, other: &Self, of: impl Fn(f64, f64) -> f64) -> Self {
        std::array::from_fn(|i| of(self[i], other[i]))
    }

    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn largest(&self) -> f64 {
        self.iter().copied().fold(0.0, f64::max)
    }

    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn dot(&self, other: &Self) -> f64 {
        self.iter().zip(other).map(|(a, b)| a * b).sum()
    }

    fn all_finite(&self) -> bool {
        self.iter().all(|x| x.is_finite())
    }

    /// Told without a jump between the coordinates.
    #[inline(always)]
    #[allow(clippy::inline_always, clippy::needless_bitwise_bool)] // asked millions of times
    fn is_within(&self, other: &Self, most: f64) -> bool {
        let near = |i: usize| (self[i] - other[i]).abs() <= most;
        (near(0) & near(1)) & (near(2) & near(3))
    }
}

impl Point for StructureState {
    fn zip(&self, other: &Self, of: impl Fn(f64, f64) -> f64) -> Self {
        let both = |a: &Coordinates, b: &Coordinates| -> Coordinates {
            a.iter().zip(b).map(|(&a, &b)| of(a, b)).collect()
        };
        Self { q: both(&self.q, &other.q), v: both(&self.v, &other.v) }
    }

    fn largest(&self) -> f64 {
        self.numbers().fold(0.0, f64::max)
    }

    fn dot(&self, other: &Self) -> f64 {
        let both =
            |a: &Coordinates, b: &Coordinates| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        both(&self.q, &other.q) + both(&self.v, &other.v)
    }

    fn all_finite(&self) -> bool {
        self.numbers().all(f64::is_finite)
    }
}
