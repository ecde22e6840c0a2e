//! Natural frequencies and mode shapes, K phi = w^2 M phi, in double-double: a frequency that is
//! wrong in its last digit moves a phase by that much in every radian of a run.

use crate::model::error::ParameterError;
use crate::numerics::dense::Matrix;
use crate::numerics::double_double::DoubleDouble;

/// Squares of natural frequencies below this part of the largest are those of rigid-body modes, 0.
pub(crate) const RIGID: f64 = 1e-12;

type Square = Vec<Vec<DoubleDouble>>;

/// Modes in the order of ascending natural frequency.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Modes {
    pub frequencies: Vec<DoubleDouble>,
    /// Shapes by mode, then coordinate; phi_i M phi_j is 1 for i = j, else 0.
    pub shapes: Square,
}

/// Why there are no modes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum NoModes {
    /// The leading minor of this order of the mass matrix is not positive.
    MassNotDefinite(usize),
    /// The stiffness matrix has this negative eigenvalue in the mass matrix's measure.
    StiffnessNegative(f64),
}

impl From<NoModes> for ParameterError {
    fn from(why: NoModes) -> Self {
        match why {
            NoModes::MassNotDefinite(order) => Self::new(
                "mass",
                format!("a matrix whose leading minor of order {order} is not positive"),
                "a positive definite matrix",
            ),
            NoModes::StiffnessNegative(square) => Self::new(
                "stiffness",
                format!("a matrix with w^2 = {square:e} for a mode"),
                "a positive semidefinite matrix",
            ),
        }
    }
}

/// The modes of symmetric matrices M, positive definite, and K, positive semidefinite.
pub(crate) fn modes(mass: &[Vec<f64>], stiffness: &[Vec<f64>]) -> Result<Modes, NoModes> {
    let lower = cholesky(mass)?;
    let count = mass.len();
    // A = L^-1 K L^-T, by columns and then by rows.
    let mut half: Square =
        stiffness.iter().map(|row| row.iter().map(|&k| DoubleDouble::new(k)).collect()).collect();
    for _ in 0..2 {
        half = (0..count)
            .map(|j| forward(&lower, &half.iter().map(|row| row[j]).collect::<Vec<_>>()))
            .collect();
    }
    let (squares, vectors) = Matrix::from_rows(&half, count).eigen();
    let largest = squares.iter().fold(0.0, |most: f64, square| most.max(square.hi));
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&i, &j| squares[i].hi.total_cmp(&squares[j].hi));
    if let Some(&least) = order.first()
        && squares[least].hi < -RIGID * largest.max(f64::MIN_POSITIVE)
    {
        return Err(NoModes::StiffnessNegative(squares[least].hi));
    }
    let frequencies =
        order
            .iter()
            .map(|&i| {
                if squares[i].hi < RIGID * largest { DoubleDouble::ZERO } else { squares[i].sqrt() }
            })
            .collect();
    let shapes = order
        .iter()
        .map(|&i| backward(&lower, &(0..count).map(|j| vectors[(j, i)]).collect::<Vec<_>>()))
        .collect();
    Ok(Modes { frequencies, shapes })
}

/// L with M = L L^T.
fn cholesky(mass: &[Vec<f64>]) -> Result<Square, NoModes> {
    let count = mass.len();
    let mut lower = vec![vec![DoubleDouble::ZERO; count]; count];
    for i in 0..count {
        for j in 0..=i {
            let rest = (0..j)
                .fold(DoubleDouble::new(mass[i][j]), |rest, k| rest - lower[i][k] * lower[j][k]);
            if i > j {
                lower[i][j] = rest.divide(lower[j][j]);
            } else if rest.hi > f64::EPSILON * mass[i][i].abs() {
                lower[i][i] = rest.sqrt();
            } else {
                return Err(NoModes::MassNotDefinite(i + 1));
            }
        }
    }
    Ok(lower)
}

/// L^-1 b.
fn forward(lower: &Square, b: &[DoubleDouble]) -> Vec<DoubleDouble> {
    let mut x: Vec<DoubleDouble> = Vec::with_capacity(b.len());
    for i in 0..b.len() {
        let rest = (0..i).fold(b[i], |rest, k| rest - lower[i][k] * x[k]);
        x.push(rest.divide(lower[i][i]));
    }
    x
}

/// L^-T b.
fn backward(lower: &Square, b: &[DoubleDouble]) -> Vec<DoubleDouble> {
    let count = b.len();
    let mut x = vec![DoubleDouble::ZERO; count];
    for i in (0..count).rev() {
        let rest = (i + 1..count).fold(b[i], |rest, k| rest - lower[k][i] * x[k]);
        x[i] = rest.divide(lower[i][i]);
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_of_a_chain_are_known() {
        // Equal masses and springs, both ends held: w = 2 sin(k pi/(2 (N + 1))).
        for count in [1usize, 2, 5, 12, 40] {
            let unit = |i: usize, j: usize| f64::from(u8::from(i == j));
            let mass: Vec<Vec<f64>> =
                (0..count).map(|i| (0..count).map(|j| unit(i, j)).collect()).collect();
            let stiffness: Vec<Vec<f64>> = (0..count)
                .map(|i| {
                    (0..count).map(|j| 2.0 * unit(i, j) - unit(i + 1, j) - unit(i, j + 1)).collect()
                })
                .collect();
            let found = modes(&mass, &stiffness).unwrap();
            for (k, frequency) in found.frequencies.iter().enumerate() {
                let angle = (k + 1) as f64 * std::f64::consts::PI / (2 * (count + 1)) as f64;
                assert!((frequency.hi - 2.0 * angle.sin()).abs() < 4e-16, "{count} {k}");
            }
        }
    }

    #[test]
    fn shapes_are_orthonormal_and_solve_the_equation_to_double_double() {
        let mass = vec![vec![2.0, 0.3, 0.1], vec![0.3, 1.5, -0.2], vec![0.1, -0.2, 0.7]];
        let stiffness = vec![vec![3.0, -1.0, 0.5], vec![-1.0, 2.0, 0.2], vec![0.5, 0.2, 9.0]];
        let found = modes(&mass, &stiffness).unwrap();
        let times = |matrix: &[Vec<f64>], x: &[DoubleDouble]| -> Vec<DoubleDouble> {
            let sum = |row: &Vec<f64>| {
                row.iter().zip(x).fold(DoubleDouble::ZERO, |sum, (&m, &x)| sum + x.scale(m))
            };
            matrix.iter().map(sum).collect()
        };
        for (w, shape) in found.frequencies.iter().zip(&found.shapes) {
            let (forces, inertia) = (times(&stiffness, shape), times(&mass, shape));
            for (k, m) in forces.iter().zip(&inertia) {
                assert!((*k - *w * *w * *m).hi.abs() < 1e-29);
            }
            for (v, other) in found.frequencies.iter().zip(&found.shapes) {
                let product =
                    inertia.iter().zip(other).fold(DoubleDouble::ZERO, |sum, (&a, &b)| sum + a * b);
                let wanted = f64::from(u8::from(v == w));
                assert!((product - DoubleDouble::new(wanted)).hi.abs() < 1e-29);
            }
        }
    }

    #[test]
    fn rigid_bodies_have_no_frequency() {
        let found =
            modes(&[vec![1.0, 0.0], vec![0.0, 3.0]], &[vec![2.0, -2.0], vec![-2.0, 2.0]]).unwrap();
        assert_eq!(found.frequencies[0], DoubleDouble::ZERO);
        assert!((found.frequencies[1].hi - (8.0f64 / 3.0).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn matrices_that_are_not_definite_are_named() {
        let unit = vec![vec![1.0, 0.0], vec![0.0, 1.0]];
        let saddle = vec![vec![1.0, 2.0], vec![2.0, 1.0]];
        assert_eq!(modes(&saddle, &unit).unwrap_err(), NoModes::MassNotDefinite(2));
        assert!(matches!(modes(&unit, &saddle), Err(NoModes::StiffnessNegative(_))));
    }
}
