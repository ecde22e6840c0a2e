//! Directions of small perturbations, kept orthonormal: what they have grown by is counted apart.

use nalgebra::Matrix4;

use crate::analysis::tolerances::INDEPENDENT_SINE;
use crate::tangent::{Columns, Derivative};

/// Orthogonal columns without zeros.
const HADAMARD: Columns<4> =
    [[1.0, 1.0, 1.0, 1.0], [1.0, -1.0, 1.0, -1.0], [1.0, 1.0, -1.0, -1.0], [1.0, -1.0, -1.0, 1.0]];

/// Between these bounds factors are multiplied; beyond them their logarithms are added.
const FACTORS: std::ops::Range<f64> = 1e-50..1e50;

/// N directions, of which the first so many count.
#[derive(Clone)]
pub(super) struct Directions<const N: usize> {
    columns: Columns<N>,
    rank: usize,
    /// ln of the factors by which each column has been divided, and those not in it yet.
    logs: [f64; N],
    factors: [f64; N],
}

impl<const N: usize> Directions<N> {
    /// The first so many orthonormal directions. They are no unit vectors: without contact, or
    /// without friction, a perturbation of one body never reaches the other, so each must be of
    /// both.
    pub fn orthonormal(rank: usize) -> Self {
        let columns = HADAMARD.map(|row| std::array::from_fn(|c| 0.5 * row[c]));
        Self { columns, rank: rank.min(N), logs: [0.0; N], factors: [1.0; N] }
    }

    /// Unit vectors.
    pub fn unit_vectors() -> Self {
        let columns = std::array::from_fn(|r| std::array::from_fn(|c| f64::from(u8::from(r == c))));
        Self { columns, ..Self::orthonormal(N) }
    }

    /// Number of directions that are left.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// No more than so many directions are left.
    pub fn reduce_rank(&mut self, most: usize) {
        self.rank = self.rank.min(most);
    }

    /// The components, one direction in each column.
    pub fn columns(&self) -> &Columns<N> {
        &self.columns
    }

    /// The directions with other components.
    pub fn set(&mut self, columns: Columns<N>) {
        self.columns = columns;
    }

    /// ln of the growth of each direction; -inf for those that are lost, the last ones.
    pub fn logs(&self) -> [f64; N] {
        let left = |i| if i < self.rank { self.length(i).ln() } else { f64::NEG_INFINITY };
        std::array::from_fn(|i| self.logs[i] + self.factors[i].ln() + left(i))
    }

    /// Of a single direction the length is not kept at 1.
    fn length(&self, i: usize) -> f64 {
        if N == 1 { self.dot(i, i).sqrt() } else { 1.0 }
    }

    /// Maps the directions; whether the images are finite numbers.
    #[inline(always)]
    #[allow(clippy::inline_always)] // one of them for each impact of a motion that is followed
    pub fn map(&mut self, derivative: &impl Derivative) -> bool {
        self.columns = derivative.map(&self.columns);
        if self.rank < N {
            // Those that are lost must not overflow.
            for row in &mut self.columns {
                row[self.rank..].fill(0.0);
            }
        }
        self.columns.iter().flatten().all(|x| x.is_finite())
    }

    /// Makes the directions orthonormal again, from the first one on (Gram and Schmidt). A single
    /// one is left as long as it is, unless that is extreme.
    pub fn orthonormalise(&mut self) {
        for i in 0..self.rank {
            for j in 0..i {
                self.subtract(i, j);
            }
            let square = self.dot(i, i);
            if square == 0.0 {
                self.rank = i;
                return;
            }
            if N == 1 && FACTORS.contains(&square) {
                return;
            }
            let length = square.sqrt();
            self.divide(i, length);
            self.factors[i] *= length;
            if !FACTORS.contains(&self.factors[i]) {
                self.logs[i] += self.factors[i].ln();
                self.factors[i] = 1.0;
            }
        }
    }

    /// Completes the directions that count to an orthonormal basis of so many.
    pub fn restore(&mut self, directions: usize) {
        for candidate in 0..4 {
            if self.rank >= directions.min(N) {
                return;
            }
            let i = self.rank;
            for (row, of_all) in self.columns.iter_mut().zip(HADAMARD) {
                row[i] = 0.5 * of_all[candidate];
            }
            // Twice: after once, rounding errors are left.
            for j in (0..i).chain(0..i) {
                self.subtract(i, j);
            }
            let length = self.dot(i, i).sqrt();
            if length > INDEPENDENT_SINE {
                self.divide(i, length);
                (self.logs[i], self.factors[i]) = (0.0, 1.0);
                self.rank += 1;
            }
        }
    }

    fn dot(&self, i: usize, j: usize) -> f64 {
        self.columns.iter().map(|row| row[i] * row[j]).sum()
    }

    /// Takes from column i what it has in the direction of column j.
    fn subtract(&mut self, i: usize, j: usize) {
        let part = self.dot(i, j);
        for row in &mut self.columns {
            row[i] -= part * row[j];
        }
    }

    fn divide(&mut self, i: usize, by: f64) {
        let inverse = 1.0 / by;
        for row in &mut self.columns {
            row[i] *= inverse;
        }
    }
}

impl Derivative for Matrix4<f64> {
    fn map<const N: usize>(&self, columns: &Columns<N>) -> Columns<N> {
        std::array::from_fn(|r| {
            std::array::from_fn(|i| (0..4).map(|c| self[(r, c)] * columns[c][i]).sum())
        })
    }
}
