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
use crate::numerics::EPS;

/// How the distance of a motion from an orbit changes.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Approach {
    /// ln of the factors from turn to turn.
    Rates(Vec<f64>),
    /// The motion is on the orbit to rounding; or it comes there at once, since all multipliers are 0.
    Arrived,
    /// The eigenvectors along which it would be measured are lost.
    Unknown,
}

/// How the distance from the orbit changes from turn to turn; `off` are the differences from it.
pub(super) fn approach_of(
    derivative: &DMatrix<f64>,
    multipliers: &[Complex<f64>],
    off: impl Iterator<Item = DVector<f64>>,
) -> Approach {
    // What is 0 to rounding is gone after a turn, and has no eigenvector that could be computed.
    let zero = EPS * derivative.norm();
    let first_zero = multipliers.iter().position(|lambda| lambda.norm() <= zero);
    let leading = &multipliers[..first_zero.unwrap_or(multipliers.len())];
    if leading.is_empty() {
        return Approach::Arrived;
    }
    let Some(by) = left_eigenvectors(derivative, leading) else {
        return Approach::Unknown;
    };
    let distances: Vec<f64> = off.map(|off| (&by * off.map(Complex::from)).norm()).collect();
    if distances.contains(&0.0) {
        return Approach::Arrived;
    }
    let rates: Vec<f64> = distances.windows(2).map(|pair| pair[1].ln() - pair[0].ln()).collect();
    if rates.iter().all(|rate| rate.is_finite()) {
        Approach::Rates(rates)
    } else {
        Approach::Unknown
    }
}

impl Approach {
    /// Whether the distance from an orbit with this largest multiplier shrinks as it must. One turn
    /// tells nothing, and who has arrived comes no nearer.
    pub fn is_as_fast_as(&self, largest: f64) -> bool {
        match self {
            Self::Rates(rates) => {
                rates.is_empty() || mean_of(rates) < ATTRACTED_PART * largest.ln()
            }
            Self::Arrived => true,
            Self::Unknown => false,
        }
    }
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
        let approach = approach_of(&matrix, &multipliers, off.take(50));
        let Approach::Rates(rates) = &approach else { panic!("{approach:?}") };
        assert!(rates.iter().all(|rate| (rate - 0.999f64.ln()).abs() < 1e-9), "{rates:?}");
        assert!(approach.is_as_fast_as(0.999));
        assert!(!Approach::Rates(vec![0.0; 9]).is_as_fast_as(0.999));
    }

    /// A multiplier 0.9 beside zeros: an exact one, and a chain of three that rounding spreads.
    #[test]
    fn zero_multipliers_leave_the_eigenvectors_of_the_others() {
        let oblique =
            DMatrix::from_fn(4, 4, |i, j| if i == j { 1.0 } else { 0.2 * (i + 2 * j) as f64 });
        let back = oblique.clone().try_inverse().unwrap();
        let chain = DMatrix::from_fn(4, 4, |i, j| {
            if i == 0 && j == 0 { 0.9 } else { f64::from(u8::from(i > 0 && j == i + 1)) }
        });
        let chain = &oblique * chain * &back;
        let mut spread: Vec<_> = chain.complex_eigenvalues().iter().copied().collect();
        spread.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
        assert!(spread[1].norm() > 1e-8, "{spread:?}");
        let mut plain = DMatrix::zeros(4, 4);
        plain[(0, 0)] = 0.9;
        let exact = [Complex::from(0.9), 0.0.into(), 0.0.into(), 0.0.into()];
        for (matrix, multipliers) in [(chain, &spread[..]), (plain, &exact[..])] {
            let first = DVector::from_vec(vec![0.3, 0.7, -0.2, 0.1]);
            let off = std::iter::successors(Some(first), |off| Some(&matrix * off));
            let approach = approach_of(&matrix, multipliers, off.skip(3).take(50));
            let Approach::Rates(rates) = &approach else { panic!("{approach:?}") };
            assert!(rates.iter().all(|rate| (rate - 0.9f64.ln()).abs() < 1e-9), "{rates:?}");
            assert!(approach.is_as_fast_as(0.9));
        }
    }

    #[test]
    fn a_motion_on_its_orbit_has_arrived_and_lost_eigenvectors_tell_nothing() {
        let half = DMatrix::from_diagonal_element(2, 2, 0.5);
        let on = || std::iter::repeat_n(DVector::zeros(2), 5);
        assert_eq!(approach_of(&half, &[0.5.into(), 0.5.into()], on()), Approach::Arrived);
        let off = || std::iter::repeat_n(DVector::from_element(2, 0.1), 5);
        let zeros = [Complex::from(0.0); 2];
        assert_eq!(approach_of(&DMatrix::zeros(2, 2), &zeros, off()), Approach::Arrived);
        let lost = DMatrix::from_element(2, 2, f64::NAN);
        assert_eq!(approach_of(&lost, &[0.5.into(), 0.5.into()], off()), Approach::Unknown);
        assert!(Approach::Arrived.is_as_fast_as(0.5) && !Approach::Unknown.is_as_fast_as(0.5));
    }
}
