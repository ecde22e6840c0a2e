//! Gauss-Legendre quadrature.

use std::sync::LazyLock;

/// Panels of the energy audit's quadrature, as an angle of the fastest motion: [`POINTS`] integrate
/// a sine of twice that angle to rounding.
pub(crate) const PANEL_ANGLE: f64 = 1.5;

/// Points on each panel.
pub(crate) const POINTS: usize = 16;

/// Nodes and weights on [0, 1].
pub(crate) static PANEL: LazyLock<[(f64, f64); POINTS]> = LazyLock::new(gauss_legendre);

/// Nodes and weights on [0, 1], by Newton's method on the Legendre polynomial.
fn gauss_legendre<const N: usize>() -> [(f64, f64); N] {
    std::array::from_fn(|i| {
        let n = N as f64;
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..20 {
            let (mut p, mut before) = (1.0, 0.0);
            for k in 1..=N {
                let k = k as f64;
                (p, before) = (((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k, p);
            }
            slope = n * (x * p - before) / (x * x - 1.0);
            x -= p / slope;
        }
        (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
    })
}

#[cfg(test)]
mod tests {
    use super::PANEL;

    #[test]
    fn quadrature_is_exact_for_polynomials() {
        for power in 0..32 {
            let sum: f64 = PANEL.iter().map(|(x, w)| w * x.powi(power)).sum();
            assert!((sum * f64::from(power + 1) - 1.0).abs() < 1e-14, "{power} {sum}");
        }
    }
}
