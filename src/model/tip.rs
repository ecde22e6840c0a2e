//! The pendulum's tip along the normal of the contact, and its derivatives along a motion of the
//! angle: sin x1 in oblique contact, x1 in direct contact (docs/theory.md, section 1).

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use std::f64::consts::FRAC_PI_2;

use crate::model::angle::Angle;
use crate::numerics::{EPS, elementary};

/// What differs between oblique and direct contact. The angle enters through sin and cos of x1 at
/// the start of a flight, so that the gap is an increment too: relatively exact for short hops.
pub(crate) trait Tip {
    /// Whether the gap needs the sine of x1.
    const TURNS: bool;
    /// Position of the tip along the normal: sin x1, or x1.
    fn position(x1: f64, angle: Angle) -> f64;
    /// Change of the tip's position since the start of a flight, where the angle was `start`, its
    /// derivatives 1 to 3, and the angle now. `turned`: (cos - 1, sin) of the increment of x1;
    /// `motion`: that increment and the derivatives 1 to 3 of x1.
    fn change(start: Angle, turned: (f64, f64), motion: [f64; 4]) -> ([f64; 4], Angle);
    /// Rate and acceleration of the tip, from x1', x1''.
    fn rates(angle: Angle, v1: f64, a1: f64) -> [f64; 2];
    /// The derivatives 4 and 5 of the tip's position, from the derivatives 1 to 5 of x1.
    fn higher(angle: Angle, rates: [f64; 5]) -> [f64; 2];
    /// Position, rate and acceleration of the tip for the first pass of the contact search: a sine
    /// of few operations, exact enough up to [`elementary::MOST_TURNED`].
    fn fast(x1: f64, v1: f64, a1: f64) -> [f64; 3];
    /// For x1 at most r from `middle`: bounds of the tip's position, and of how far it is ahead of x1.
    fn reach(middle: f64, r: f64) -> (f64, f64);
    /// Bound of the fourth derivative of the tip's position, from bounds of x1', ..., x1''''.
    fn fourth_bound(bounds: &[f64; 4]) -> f64;
    /// Bounds of the derivatives 4 to 6 of the tip's position, from those of x1.
    fn high_bounds(bounds: &[f64; 6]) -> [f64; 3];
    /// Change of g' by the rounding of x1, at a rate x1' of this size.
    fn slope_noise(x1: f64, speed: f64) -> f64;
}

pub(crate) struct Oblique;
pub(crate) struct Direct;

impl Tip for Oblique {
    const TURNS: bool = true;

    #[inline(always)]
    fn position(_: f64, angle: Angle) -> f64 {
        angle.sin
    }

    #[inline(always)]
    fn change(start: Angle, turned: (f64, f64), [_, v, a, j]: [f64; 4]) -> ([f64; 4], Angle) {
        let Angle { sin: sin0, cos: cos0 } = start;
        let (turned_cos_minus_1, turned_sin) = turned;
        let increment = sin0 * turned_cos_minus_1 + cos0 * turned_sin;
        let sin = sin0 + increment;
        let cos = cos0 + (cos0 * turned_cos_minus_1 - sin0 * turned_sin);
        let v2 = v * v;
        let third = (j - v2 * v) * cos - 3.0 * v * a * sin;
        ([increment, v * cos, a * cos - v2 * sin, third], Angle { sin, cos })
    }

    #[inline(always)]
    fn rates(Angle { sin, cos }: Angle, v1: f64, a1: f64) -> [f64; 2] {
        [v1 * cos, a1 * cos - v1 * v1 * sin]
    }

    #[inline(always)]
    fn higher(Angle { sin, cos }: Angle, [v, a, j, fourth, fifth]: [f64; 5]) -> [f64; 2] {
        let v2 = v * v;
        [
            cos * (fourth - 6.0 * v2 * a) - sin * (4.0 * v * j + 3.0 * a * a - v2 * v2),
            cos * (fifth - 10.0 * v2 * j - 15.0 * v * a * a + v2 * v2 * v)
                - sin * (5.0 * v * fourth + 10.0 * a * j - 10.0 * v2 * v * a),
        ]
    }

    #[inline(always)]
    fn fast(x1: f64, v1: f64, a1: f64) -> [f64; 3] {
        let (sin, cos) = elementary::fused_sin_cos(x1);
        let [rate, second] = Self::rates(Angle { sin, cos }, v1, a1);
        [sin, rate, second]
    }

    #[inline(always)]
    fn reach(middle: f64, r: f64) -> (f64, f64) {
        // All of it lies within that range about 0.
        let r = middle.abs() + r;
        // Partial sums of the alternating series.
        let (r2, cubic) = (r * r, r * r * r / 6.0);
        let highest = if r < FRAC_PI_2 { (r - cubic * (1.0 - r2 / 20.0)).min(1.0) } else { 1.0 };
        (highest, cubic)
    }

    fn fourth_bound(&[v, a, j, s]: &[f64; 4]) -> f64 {
        // (sin x)'''' = cos x (x'''' - 6 x'^2 x'') - sin x (4 x' x''' + 3 x''^2 - x'^4)
        (s + 6.0 * v * v * a).hypot(4.0 * v * j + 3.0 * a * a + v.powi(4))
    }

    #[inline(always)]
    fn high_bounds(&[a, b, c, d, e, f]: &[f64; 6]) -> [f64; 3] {
        // Complete Bell polynomials: all terms of the derivatives of sin x1(t), taken positive.
        let a2 = a * a;
        let fourth = d + a * (4.0 * c + a * (6.0 * b + a2)) + 3.0 * b * b;
        let fifth =
            e + a * (5.0 * d + a * (10.0 * c + a * (10.0 * b + a2)) + 15.0 * b * b) + 10.0 * b * c;
        let sixth = f
            + a * (6.0 * e
                + 60.0 * b * c
                + a * (15.0 * d + 45.0 * b * b + a * (20.0 * c + a * (15.0 * b + a2))))
            + b * (15.0 * d + 15.0 * b * b)
            + 10.0 * c * c;
        [fourth, fifth, sixth]
    }

    #[inline(always)]
    fn slope_noise(x1: f64, speed: f64) -> f64 {
        EPS * x1.abs() * speed
    }
}

impl Tip for Direct {
    const TURNS: bool = false;

    #[inline(always)]
    fn position(x1: f64, _: Angle) -> f64 {
        x1
    }

    #[inline(always)]
    fn change(start: Angle, _: (f64, f64), motion: [f64; 4]) -> ([f64; 4], Angle) {
        (motion, start)
    }

    #[inline(always)]
    fn rates(_: Angle, v1: f64, a1: f64) -> [f64; 2] {
        [v1, a1]
    }

    #[inline(always)]
    fn higher(_: Angle, [.., fourth, fifth]: [f64; 5]) -> [f64; 2] {
        [fourth, fifth]
    }

    #[inline(always)]
    fn fast(x1: f64, v1: f64, a1: f64) -> [f64; 3] {
        [x1, v1, a1]
    }

    #[inline(always)]
    fn reach(middle: f64, r: f64) -> (f64, f64) {
        (middle + r, 0.0)
    }

    fn fourth_bound(&[.., fourth]: &[f64; 4]) -> f64 {
        fourth
    }

    #[inline(always)]
    fn high_bounds(&[.., d, e, f]: &[f64; 6]) -> [f64; 3] {
        [d, e, f]
    }

    #[inline(always)]
    fn slope_noise(_: f64, _: f64) -> f64 {
        0.0
    }
}
