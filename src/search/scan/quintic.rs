//! The interpolant of a step of a scan, by the gap function and its first two derivatives at both
//! ends.

#![allow(clippy::inline_always)] // a scan is compiled for several instruction sets

use crate::search::steps::Jet;

/// The quintic Hermite interpolant of a step: coefficients of the powers of a part t of it.
pub(super) struct Quintic([f64; 6]);

impl Quintic {
    #[inline(always)]
    pub fn new(start: &Jet, end: &Jet, h: f64) -> Self {
        let (c0, c1, c2) = (start.value, h * start.rate, 0.5 * (h * h) * start.second);
        let value = end.value - c0 - c1 - c2;
        let rate = h * end.rate - c1 - 2.0 * c2;
        let second = h * h * end.second - 2.0 * c2;
        let c3 = 10.0 * value - 4.0 * rate + 0.5 * second;
        let c4 = -15.0 * value + 7.0 * rate - second;
        let c5 = 6.0 * value - 3.0 * rate + 0.5 * second;
        Self([c0, c1, c2, c3, c4, c5])
    }

    #[inline(always)]
    pub fn value(&self, t: f64) -> f64 {
        let Self([c0, c1, c2, c3, c4, c5]) = self;
        let t2 = t * t;
        (c0 + t * c1) + t2 * ((c2 + t * c3) + t2 * (c4 + t * c5))
    }
}

/// Root of the interpolant of a rising step, as a part of the step; as a rule to some 1e-5, from
/// where the exact motion leads on.
#[inline(always)]
pub(super) fn root(start: &Jet, end: &Jet, h: f64) -> f64 {
    let quintic = Quintic::new(start, end, h);
    let &Quintic([c0, c1, c2, c3, c4, c5]) = &quintic;
    // Halley's step from the chord's root, and one more with its slope.
    let t = c0 / (c0 - end.value);
    let t2 = t * t;
    let g = quintic.value(t);
    let g1 = (c1 + t * (2.0 * c2)) + t2 * ((3.0 * c3 + t * (4.0 * c4)) + t2 * (5.0 * c5));
    let g2 = (c2 + t * (3.0 * c3)) + t2 * (6.0 * c4 + t * (10.0 * c5));
    let slope = g1 / (g1 * g1 - g * g2);
    let t = (t - g * slope).clamp(0.0, 1.0);
    (t - quintic.value(t) * slope).clamp(0.0, 1.0)
}
