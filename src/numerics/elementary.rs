//! Sine, cosine and exponential of the free motion, without calls and with hardly a branch: they
//! overlap with each other and with what is around them, keep the tail of an angle that one number
//! cannot hold, and give the same bits on every machine (a system's library does not).
//!
//! Kernels after FDLIBM (Sun Microsystems, 1993), reduction after Cody & Waite (1980); the errors
//! are below one unit in the last place (tests below).

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets
#![allow(clippy::needless_range_loop)] // loops over lanes read best with their index

/// Largest angle of the short reduction; larger ones go to the system's library.
pub(crate) const MOST_TURNED: f64 = 1e5;

/// 1.5 * 2^52: the last bits of a sum with it are the nearest integer.
const SHIFT: f64 = 6_755_399_441_055_744.0;

/// pi/2 in two parts; the first has so few digits that its multiples are exact.
const HALF_PI: (f64, f64) = (1.570_796_326_734_125_6, 6.077_100_506_506_192e-11);

/// Minimax coefficients of sin r/r and cos r on [-pi/4, pi/4], by powers of r^2 (FDLIBM).
const SIN: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];
const COS: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// Sine and cosine of a remainder in [-pi/4, pi/4] given as a sum, and cos - 1.
struct Kernel {
    sin: f64,
    cos: f64,
    cos_minus_1: f64,
}

impl Kernel {
    #[inline(always)]
    fn new(x: f64, tail: f64) -> Self {
        let z = x * x;
        let w = z * z;
        let s = (SIN[1] + z * (SIN[2] + z * SIN[3])) + z * w * (SIN[4] + z * SIN[5]);
        let v = z * x;
        let sin = x - ((z * (0.5 * tail - v * s) - tail) - v * SIN[0]);
        let c =
            z * (COS[0] + z * (COS[1] + z * COS[2])) + w * w * (COS[3] + z * (COS[4] + z * COS[5]));
        let half = 0.5 * z;
        let rest = z * c - x * tail;
        let rounded = 1.0 - half;
        Self { sin, cos: rounded + (((1.0 - rounded) - half) + rest), cos_minus_1: rest - half }
    }
}

/// Sine and cosine of an angle from those of its remainder. In odd quadrants they change places;
/// their signs are bits of the quadrant.
#[inline(always)]
fn into_quadrant(quadrant: u64, sin: f64, cos: f64) -> (f64, f64) {
    let (sin, cos) = (sin.to_bits(), cos.to_bits());
    let swap = (quadrant & 1).wrapping_neg();
    let sin_sign = (quadrant & 2) << 62;
    let cos_sign = (quadrant.wrapping_add(1) & 2) << 62;
    (
        f64::from_bits(((sin & !swap) | (cos & swap)) ^ sin_sign),
        f64::from_bits(((cos & !swap) | (sin & swap)) ^ cos_sign),
    )
}

/// (cos - 1, sin) of no turn.
pub(crate) const STRAIGHT: (f64, f64) = (0.0, 0.0);

/// Sine, cosine, and cosine minus 1 without cancellation, of `angle + tail`; |tail| is at most some
/// units in the last place of the angle.
#[inline(always)]
fn turn_of(angle: f64, tail: f64) -> (f64, f64, f64) {
    let shifted = angle * std::f64::consts::FRAC_2_PI + SHIFT;
    let quadrant = shifted.to_bits();
    let quarters = shifted - SHIFT;
    let first = angle - quarters * HALF_PI.0;
    let rest = quarters * HALF_PI.1 - tail;
    let remainder = first - rest;
    let kernel = Kernel::new(remainder, (first - remainder) - rest);
    let (turned_sin, turned_cos) = into_quadrant(quadrant, kernel.sin, kernel.cos);
    let cos_minus_1 = if quarters == 0.0 { kernel.cos_minus_1 } else { turned_cos - 1.0 };
    (turned_sin, turned_cos, cos_minus_1)
}

/// Sine and cosine of any number.
#[inline(always)]
pub(crate) fn sin_cos(x: f64) -> (f64, f64) {
    sin_cos_of_sum(x, 0.0)
}

/// Sine and cosine of `x + tail`, the tail at most some units in the last place of x.
#[inline(always)]
pub(crate) fn sin_cos_of_sum(x: f64, tail: f64) -> (f64, f64) {
    if x.abs() <= MOST_TURNED { sin_cos_within(x, tail) } else { far(x, tail) }
}

/// (cos - 1, sin) of `x + tail`: relatively exact also for small angles.
#[inline(always)]
pub(crate) fn turn(x: f64, tail: f64) -> (f64, f64) {
    if x.abs() <= MOST_TURNED {
        turn_within(x, tail)
    } else {
        let (sin, cos) = far(x, tail);
        (cos - 1.0, sin)
    }
}

/// [`turn`] of an angle up to [`MOST_TURNED`].
#[inline(always)]
pub(crate) fn turn_within(x: f64, tail: f64) -> (f64, f64) {
    let (sin, _, cos_minus_1) = turn_of(x, tail);
    (cos_minus_1, sin)
}

/// [`sin_cos_of_sum`] of an angle up to [`MOST_TURNED`].
#[inline(always)]
pub(crate) fn sin_cos_within(x: f64, tail: f64) -> (f64, f64) {
    let (sin, cos, _) = turn_of(x, tail);
    (sin, cos)
}

/// [`turn`] of several angles up to [`MOST_TURNED`] at once.
#[inline(always)]
pub(crate) fn turns<const N: usize>(angles: [f64; N], tails: [f64; N]) -> [(f64, f64); N] {
    let (mut cos_minus_1, mut sin) = ([0.0; N], [0.0; N]);
    for j in 0..N {
        (cos_minus_1[j], sin[j]) = turn_within(angles[j], tails[j]);
    }
    std::array::from_fn(|j| (cos_minus_1[j], sin[j]))
}

/// Sine and cosine to a few units in the last place for |x| up to [`MOST_TURNED`], with fused
/// operations: for the scan, which is compiled where these are instructions.
#[inline(always)]
pub(crate) fn fused_sin_cos(x: f64) -> (f64, f64) {
    let shifted = x * std::f64::consts::FRAC_2_PI + SHIFT;
    let quarters = shifted - SHIFT;
    let r = quarters.mul_add(-HALF_PI.1, quarters.mul_add(-HALF_PI.0, x));
    let z = r * r;
    let pair = |a: f64, b: f64| z.mul_add(b, a);
    let sum = |c: &[f64; 6]| {
        let w = z * z;
        w.mul_add(w.mul_add(pair(c[4], c[5]), pair(c[2], c[3])), pair(c[0], c[1]))
    };
    let sin = (r * z).mul_add(sum(&SIN), r);
    let cos = (z * z).mul_add(sum(&COS), z.mul_add(-0.5, 1.0));
    into_quadrant(shifted.to_bits(), sin, cos)
}

#[cold]
fn far(x: f64, tail: f64) -> (f64, f64) {
    let (sin, cos) = x.sin_cos();
    (sin + tail * cos, cos - tail * sin)
}

/// e^x - 1 for x <= 0.
#[inline(always)]
pub(crate) fn decay_minus_1(x: f64) -> f64 {
    // e^-60 is far below the rounding of 1. (Written so that a NaN stays one.)
    let (scale, minus_1) = exponential(if x < -60.0 { -60.0 } else { x });
    scale * minus_1 + (scale - 1.0)
}

/// e^x for x <= 0, relatively exact; below -700 that of -700.
#[inline(always)]
pub(crate) fn decay(x: f64) -> f64 {
    let (scale, minus_1) = exponential(if x < -700.0 { -700.0 } else { x });
    scale * minus_1 + scale
}

/// A power of two, and e^r - 1 of what is left of x, |r| <= ln 2/2.
#[inline(always)]
fn exponential(x: f64) -> (f64, f64) {
    const LN_2: (f64, f64) = (6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10);
    // 1/n! from n = 3: the 14th power of ln 2/2 over 14! is 4e-18.
    const C: [f64; 11] = [
        1.0 / 6.0,
        1.0 / 24.0,
        1.0 / 120.0,
        1.0 / 720.0,
        1.0 / 5_040.0,
        1.0 / 40_320.0,
        1.0 / 362_880.0,
        1.0 / 3_628_800.0,
        1.0 / 39_916_800.0,
        1.0 / 479_001_600.0,
        1.0 / 6_227_020_800.0,
    ];
    let shifted = x * std::f64::consts::LOG2_E + SHIFT;
    let halvings = shifted - SHIFT;
    let first = x - halvings * LN_2.0;
    let rest = halvings * LN_2.1;
    let r = first - rest;
    let tail = (first - r) - rest;
    let (z, w) = (r * r, (r * r) * (r * r));
    let low = (C[0] + r * C[1]) + z * (C[2] + r * C[3]);
    let high = (C[4] + r * C[5]) + z * (C[6] + r * C[7]) + w * ((C[8] + r * C[9]) + z * C[10]);
    let powers = low + w * high;
    let minus_1 = r + (0.5 * z + (z * r * powers + tail * (1.0 + r)));
    let scale = f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52);
    (scale, minus_1)
}

#[cfg(test)]
mod tests {
    use super::{MOST_TURNED, decay, decay_minus_1, fused_sin_cos, sin_cos, sin_cos_of_sum, turn};
    use crate::numerics::double_double::DoubleDouble;

    #[test]
    fn sine_and_cosine_agree_with_the_library() {
        let mut worst = 0f64;
        for i in -400_000..=400_000 {
            let x = 2.0 * MOST_TURNED * (f64::from(i) / 400_000.0).powi(5);
            let ((s, c), (sin, cos)) = (sin_cos(x), x.sin_cos());
            // Each within a unit in the last place; the reduction adds an absolute error.
            let error = |a: f64, b: f64| (a - b).abs() / (f64::EPSILON * b.abs() + 4e-21);
            worst = worst.max(error(s, sin)).max(error(c, cos));
        }
        assert!(worst <= 1.0, "{worst}");
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
        let (sin, cos) = sin_cos(f64::NAN);
        assert!(sin.is_nan() && cos.is_nan());
    }

    #[test]
    fn fused_sine_and_cosine_are_good_to_some_digits_more_than_a_scan_needs() {
        let mut worst = 0f64;
        for i in -200_000..=200_000 {
            let x = MOST_TURNED * (f64::from(i) / 200_000.0).powi(5);
            let ((s, c), (sin, cos)) = (fused_sin_cos(x), x.sin_cos());
            // Reduction leaves an absolute error that grows with the number of turns.
            let allowed = 2e-16 + 4e-21 * x.abs();
            worst = worst.max((s - sin).abs() / allowed).max((c - cos).abs() / allowed);
        }
        assert!(worst < 1.0, "{worst}");
        assert_eq!(fused_sin_cos(0.0), (0.0, 1.0));
    }

    #[test]
    fn a_tail_counts() {
        for i in 1..2_000 {
            let x = f64::from(i) * 0.01;
            let tail = 0.5 * f64::EPSILON * x * (f64::from(i % 7) / 3.5 - 1.0);
            let (s, c) = sin_cos_of_sum(x, tail);
            let (sin, cos) = x.sin_cos();
            assert!((s - (sin + tail * cos)).abs() <= f64::EPSILON * sin.abs() + 1e-30, "{x}");
            assert!((c - (cos - tail * sin)).abs() <= f64::EPSILON * cos.abs() + 1e-30, "{x}");
        }
    }

    #[test]
    fn small_turns_are_relatively_exact() {
        for i in 0..300 {
            let x = 0.78 * 0.9f64.powi(i);
            let (cos_minus_1, sin) = turn(x, 0.0);
            // 2 sin^2(x/2) in double-double.
            let half = (0.5 * x).sin();
            let exact = -DoubleDouble::product(half, half).scale(2.0).value();
            assert!((cos_minus_1 - exact).abs() <= 2.0 * f64::EPSILON * exact.abs(), "{x}");
            assert!((sin - x.sin()).abs() <= f64::EPSILON * x.sin().abs(), "{x}");
        }
    }

    #[test]
    fn exponential_agrees_with_the_library() {
        let mut worst = 0f64;
        for i in 0..200_000 {
            let x = -80.0 * (f64::from(i) / 200_000.0).powi(6);
            let exact = x.exp_m1();
            let error = (decay_minus_1(x) - exact).abs();
            worst = worst.max(error / (f64::EPSILON * exact.abs()).max(f64::MIN_POSITIVE));
        }
        assert!(worst <= 1.0, "{worst}");
        let mut worst = 0f64;
        for i in 0..200_000 {
            let x = -700.0 * (f64::from(i) / 200_000.0).powi(3);
            worst = worst.max((decay(x) - x.exp()).abs() / (f64::EPSILON * x.exp()));
        }
        assert!(worst <= 1.0, "{worst}");
        assert_eq!((decay(0.0), decay(f64::NEG_INFINITY)), (1.0, decay(-700.0)));
        assert!(decay(f64::NAN).is_nan());
        assert_eq!(decay_minus_1(0.0), 0.0);
        assert!((decay_minus_1(f64::NEG_INFINITY) + 1.0).abs() < f64::EPSILON);
        assert!(decay_minus_1(f64::NAN).is_nan());
    }
}
