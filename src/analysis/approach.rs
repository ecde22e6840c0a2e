//! How a motion approaches a periodic one, from section to section.
//!
//! With the left eigenvectors w_i of the derivative D of the return map, w_i* D = lambda_i w_i*, the
//! distances of the sections X_k from the orbit X
//!
//! ```text
//! a_k = (sum_i |w_i* (X_k - X)|^2)^(1/2)
//! ```
//!
//! fall by |lambda_1| from turn to turn near the orbit, and do not beat, as other distances do; on a
//! torus they stay. (Left eigenvectors of a return map: Kuznetsov, Elements of Applied Bifurcation
//! Theory, section 5.4.)

use nalgebra::{Complex, DMatrix, DVector};

use crate::analysis::tolerances::{ATTRACTED_PART, BESIDE_MULTIPLIER, DISTANCES, INVERSE_STEPS};

/// ln of the factors by which the distance from the orbit changes from turn to turn; `off` are the
/// differences from it. `None` where the motion is on the orbit, or the eigenvectors are lost.
pub(super) fn rates_of_approach(
    derivative: &DMatrix<f64>,
    multipliers: &[Complex<f64>],
    off: impl Iterator<Item = DVector<f64>>,
) -> Option<Vec<f64>> {
    let by = left_eigenvectors(derivative, multipliers)?;
    let logarithms: Vec<f64> = off.map(|off| (&by * off.map(Complex::from)).norm().ln()).collect();
    let rates: Vec<f64> = logarithms.windows(2).map(|pair| pair[1] - pair[0]).collect();
    rates.iter().all(|rate| rate.is_finite()).then_some(rates)
}

/// Whether the distance from an orbit with this largest multiplier shrinks at these rates as it must.
/// One turn tells nothing, and who has arrived comes no nearer.
pub(super) fn approaches(rates: Option<Vec<f64>>, largest: f64) -> bool {
    rates.is_none_or(|rates| rates.is_empty() || mean_of(&rates) < ATTRACTED_PART * largest.ln())
}

pub(super) fn mean_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Unit left eigenvectors of the leading multipliers, in rows, by inverse iteration with D*.
fn left_eigenvectors(
    matrix: &DMatrix<f64>,
    multipliers: &[Complex<f64>],
) -> Option<DMatrix<Complex<f64>>> {
    let adjoint = matrix.transpose().map(Complex::from);
    let size = adjoint.nrows();
    // Of a pair one is enough: the other one is its conjugate.
    let leading = multipliers.iter().filter(|lambda| lambda.im >= 0.0).take(DISTANCES);
    let rows: Option<Vec<_>> = leading
        .map(|lambda| {
            // Beside the multiplier, where the equations can be solved.
            let shift = lambda.conj() * (1.0 + BESIDE_MULTIPLIER);
            let equations = (&adjoint - DMatrix::identity(size, size) * shift).lu();
            let mut vector = DVector::from_fn(size, |i, _| Complex::from(1.0 / (1.0 + i as f64)));
            for _ in 0..INVERSE_STEPS {
                vector = equations.solve(&vector)?;
                let length = vector.norm();
                vector.unscale_mut(length);
            }
            Some(vector.adjoint())
        })
        .collect();
    let rows = rows?;
    (!rows.is_empty()).then(|| DMatrix::from_rows(&rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn left_eigenvectors_are_those_of_the_multipliers() {
        // Multipliers 0.9 e^(+-0.4 i), 0.5 and -0.3, in oblique coordinates.
        let (s, c) = 0.4f64.sin_cos();
        let mut inner = DMatrix::zeros(4, 4);
        inner.view_mut((0, 0), (2, 2)).copy_from_slice(&[0.9 * c, 0.9 * s, -0.9 * s, 0.9 * c]);
        (inner[(2, 2)], inner[(3, 3)]) = (0.5, -0.3);
        let oblique =
            DMatrix::from_fn(4, 4, |i, j| if i == j { 1.0 } else { 0.2 * (i + 2 * j) as f64 });
        let matrix = &oblique * inner * oblique.clone().try_inverse().unwrap();
        let multipliers = [Complex::new(0.9 * c, 0.9 * s), Complex::new(0.9 * c, -0.9 * s)];
        let multipliers: Vec<_> =
            multipliers.into_iter().chain([0.5.into(), Complex::from(-0.3)]).collect();
        let rows = left_eigenvectors(&matrix, &multipliers).unwrap();
        assert_eq!(rows.nrows(), 3);
        for (row, lambda) in rows.row_iter().zip([multipliers[0], 0.5.into(), Complex::from(-0.3)])
        {
            let image = row * matrix.map(Complex::from);
            assert!((image - row * lambda).norm() < 1e-12);
            assert!((row.norm() - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn the_distance_from_an_orbit_falls_by_its_multiplier_and_does_not_beat() {
        let (s, c) = 1.3f64.sin_cos();
        let oblique = DMatrix::from_row_slice(2, 2, &[1.0, 0.9, 0.0, 0.1]);
        let turn = DMatrix::from_row_slice(2, 2, &[c, -s, s, c]) * 0.999;
        let matrix = &oblique * turn * oblique.clone().try_inverse().unwrap();
        let multipliers = [Complex::new(c, s) * 0.999, Complex::new(c, -s) * 0.999];
        let first = DVector::from_vec(vec![0.3, 0.7]);
        let off = std::iter::successors(Some(first), |off| Some(&matrix * off));
        let rates = rates_of_approach(&matrix, &multipliers, off.take(50)).unwrap();
        assert!(rates.iter().all(|rate| (rate - 0.999f64.ln()).abs() < 1e-9), "{rates:?}");
        assert!(approaches(Some(rates), 0.999));
        assert!(!approaches(Some(vec![0.0; 9]), 0.999));
    }
}
