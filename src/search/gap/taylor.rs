//! The gap near one instant by its Taylor polynomial, and the root of that: the contact.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets
#![allow(clippy::needless_bitwise_bool)] // conditions without jumps, for the lanes

use crate::numerics::lanes::lanes_of;
use crate::search::tolerances::SERIES_TURN;

/// The fourth and fifth derivative of the gap at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Higher {
    pub fourth: f64,
    pub fifth: f64,
}

/// Gap function and its first three derivatives at one instant.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct GapPoint {
    /// g; zero in contact, negative apart.
    pub value: f64,
    /// g', positive in approach.
    pub rate: f64,
    /// g''.
    pub second: f64,
    /// g'''.
    pub third: f64,
}

lanes_of! {
    /// Several gaps at one instant each.
    GapPoints of GapPoint { value: value, rate: rate, second: second, third: third }
}

impl GapPoint {
    /// The gap function a little later, from its Taylor polynomial.
    #[inline(always)]
    pub(crate) fn later(&self, h: f64) -> Self {
        let Self { value, rate, second, third } = *self;
        Self {
            value: value + h * (rate + 0.5 * h * (second + (1.0 / 3.0) * h * third)),
            rate: rate + h * (second + 0.5 * h * third),
            second: second + h * third,
            third,
        }
    }
}

impl GapPoint {
    /// The gap function a little later, by the Taylor polynomial of order 5.
    #[inline(always)]
    fn with_higher(&self, Higher { fourth, fifth }: Higher, h: f64) -> Self {
        let cubic = self.later(h);
        let (half, third_part, quarter) = (0.5 * h, (1.0 / 3.0) * h, 0.25 * h);
        let cube = half * third_part * h;
        Self {
            value: cubic.value + quarter * (cube * (fourth + 0.2 * h * fifth)),
            rate: cubic.rate + cube * (fourth + quarter * fifth),
            second: cubic.second + half * h * (fourth + third_part * fifth),
            third: self.third + h * (fourth + half * fifth),
        }
    }

    /// Time to the root of the Taylor polynomial of a gap that rises, the one near `guess`, and how
    /// far from zero the polynomial may be there.
    #[inline(always)]
    pub(crate) fn rise(&self, higher: Higher, guess: f64) -> (f64, f64) {
        let (time, holds) = self.rise_by_series(higher);
        // At a slope of some least numbers the terms of the series are beyond range.
        if holds && !time.is_nan() { (time, 0.0) } else { self.rise_by_steps(higher, guess) }
    }

    /// Time to the root by reversion of the series, with one division; and whether that is exact
    /// enough.
    #[inline(always)]
    pub(crate) fn rise_by_series(&self, higher: Higher) -> (f64, bool) {
        let Self { value, rate, second, third } = *self;
        let inverse = 1.0 / rate;
        let first = -value * inverse;
        let (c2, c3) = (0.5 * second * inverse, (1.0 / 6.0) * third * inverse);
        let turn = (c2 * first).abs() + (c3 * first * first).abs();
        let c4 = (1.0 / 24.0) * higher.fourth * inverse;
        let c5 = (1.0 / 120.0) * higher.fifth * inverse;
        let square = c2 * c2;
        let fourth = 5.0 * c2 * (c3 - square) - c4;
        let fifth = 6.0 * c2 * c4 + 3.0 * c3 * c3 - c5 + 7.0 * square * (2.0 * square - 3.0 * c3);
        let bend = c2 - first * (2.0 * square - c3 + first * (fourth + first * fifth));
        let sum = first * (1.0 - first * bend);
        // What the series left, by the slope at the start.
        let time = sum - self.with_higher(higher, sum).value * inverse;
        (time, (rate > 0.0) & (turn <= SERIES_TURN))
    }

    /// Time to a root near a double root: the parabola's root first, as Newton's steps alone are
    /// short.
    #[inline(never)]
    fn rise_by_steps(&self, higher: Higher, mut time: f64) -> (f64, f64) {
        let near = self.with_higher(higher, time);
        let height = near.rate * near.rate - 2.0 * near.second * near.value;
        let slope = near.rate + height.max(0.0).sqrt();
        if slope > 0.0 {
            time -= 2.0 * near.value / slope;
        }
        let mut left = f64::INFINITY;
        for _ in 0..2 {
            let at = self.with_higher(higher, time);
            if at.rate > 0.0 {
                let step = at.value / at.rate;
                time -= step;
                left = 0.5 * at.second.abs() * step * step;
            }
        }
        (time, left)
    }
}
