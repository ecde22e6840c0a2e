//! Arithmetic on a few numbers at once, written so that compilers turn it into vector instructions:
//! no branches, no calls. The operations are the same with any of them, and so are the bits.

#![allow(clippy::inline_always)] // all of a scan must be compiled with the same instructions
#![allow(clippy::needless_range_loop)] // loops over lanes read best with their index

/// Numbers treated together.
pub(crate) const LANES: usize = 8;

/// Eight values of one quantity.
pub(crate) type Lanes = [f64; LANES];

/// Sine and cosine to a few units in the last place for |x| up to [`crate::elementary::MOST_TURNED`]: reduction after
/// Cody & Waite (1980), minimax polynomials of FDLIBM.
#[inline(always)]
pub(crate) fn sin_cos(x: f64) -> (f64, f64) {
    // 1.5 * 2^52: the last bits of a sum with it are the nearest integer.
    const SHIFT: f64 = 6_755_399_441_055_744.0;
    // pi/2 in two parts; the first has so few digits that its multiples are exact.
    const HALF_PI: (f64, f64) = (1.570_796_326_734_125_6, 6.077_100_506_506_192e-11);
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
    let shifted = x * std::f64::consts::FRAC_2_PI + SHIFT;
    let quadrant = shifted.to_bits();
    let turns = shifted - SHIFT;
    let r = turns.mul_add(-HALF_PI.1, turns.mul_add(-HALF_PI.0, x));
    let z = r * r;
    let pair = |a: f64, b: f64| z.mul_add(b, a);
    let sum = |c: &[f64; 6]| {
        let w = z * z;
        w.mul_add(w.mul_add(pair(c[4], c[5]), pair(c[2], c[3])), pair(c[0], c[1]))
    };
    let sin = (r * z).mul_add(sum(&SIN), r).to_bits();
    let cos = (z * z).mul_add(sum(&COS), z.mul_add(-0.5, 1.0)).to_bits();
    // In odd quadrants sine and cosine change places; their signs are bits of the quadrant.
    let swap = (quadrant & 1).wrapping_neg();
    let minus_sin = (quadrant & 2) << 62;
    let minus_cos = (quadrant.wrapping_add(1) & 2) << 62;
    (
        f64::from_bits(((sin & !swap) | (cos & swap)) ^ minus_sin),
        f64::from_bits(((cos & !swap) | (sin & swap)) ^ minus_cos),
    )
}

#[cfg(test)]
mod tests {
    use super::sin_cos;
    use crate::elementary::MOST_TURNED;

    #[test]
    fn sine_and_cosine_agree_with_the_library() {
        let mut worst = 0f64;
        for i in -200_000..=200_000 {
            let x = MOST_TURNED * (f64::from(i) / 200_000.0).powi(5);
            let ((s, c), (sin, cos)) = (sin_cos(x), x.sin_cos());
            // Reduction leaves an absolute error that grows with the number of turns.
            let allowed = 2e-16 + 4e-21 * x.abs();
            worst = worst.max((s - sin).abs() / allowed).max((c - cos).abs() / allowed);
        }
        assert!(worst < 1.0, "{worst}");
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
    }
}
