//! Small dense matrices in double-double: eigenvectors of symmetric ones, linear equations, what is
//! orthogonal to some rows. For set-up, never in a contact search.

use std::ops::{Index, IndexMut};

use crate::numerics::double_double::DoubleDouble;

/// Sweeps of Jacobi's method; each squares what is left off the diagonal, and ten are many.
const MOST_SWEEPS: usize = 40;
/// What is left off the diagonal, as a part of the whole.
const DIAGONAL: f64 = 1e-31;
/// A row is in the span of others where less than this part of it is orthogonal to them: rows that
/// are rounded once, and combined, are off by less.
pub(crate) const DEPENDENT: f64 = 1e-12;

/// A matrix, by rows.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Matrix {
    pub rows: usize,
    pub columns: usize,
    entries: Vec<DoubleDouble>,
}

impl Index<(usize, usize)> for Matrix {
    type Output = DoubleDouble;
    fn index(&self, (i, j): (usize, usize)) -> &DoubleDouble {
        &self.entries[i * self.columns + j]
    }
}

impl IndexMut<(usize, usize)> for Matrix {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut DoubleDouble {
        &mut self.entries[i * self.columns + j]
    }
}

/// Sum of products.
pub(crate) fn dot(a: &[DoubleDouble], b: &[DoubleDouble]) -> DoubleDouble {
    a.iter().zip(b).fold(DoubleDouble::ZERO, |sum, (&a, &b)| sum + a * b)
}

impl Matrix {
    pub fn from_fn(
        rows: usize,
        columns: usize,
        mut entry: impl FnMut(usize, usize) -> DoubleDouble,
    ) -> Self {
        let mut entries = Vec::with_capacity(rows * columns);
        for i in 0..rows {
            entries.extend((0..columns).map(|j| entry(i, j)));
        }
        Self { rows, columns, entries }
    }

    pub fn diagonal(of: &[DoubleDouble]) -> Self {
        let entry = |i: usize, j| if i == j { of[i] } else { DoubleDouble::ZERO };
        Self::from_fn(of.len(), of.len(), entry)
    }

    /// Rows of one length.
    pub fn from_rows(rows: &[Vec<DoubleDouble>], columns: usize) -> Self {
        Self::from_fn(rows.len(), columns, |i, j| rows[i][j])
    }

    pub fn row(&self, i: usize) -> &[DoubleDouble] {
        &self.entries[i * self.columns..(i + 1) * self.columns]
    }

    pub fn transposed(&self) -> Self {
        Self::from_fn(self.columns, self.rows, |i, j| self[(j, i)])
    }

    pub fn times(&self, other: &Self) -> Self {
        let other = other.transposed();
        Self::from_fn(self.rows, other.rows, |i, j| dot(self.row(i), other.row(j)))
    }

    pub fn minus(&self, other: &Self) -> Self {
        Self::from_fn(self.rows, self.columns, |i, j| self[(i, j)] - other[(i, j)])
    }

    pub fn scaled(&self, factor: f64) -> Self {
        Self::from_fn(self.rows, self.columns, |i, j| self[(i, j)].scale(factor))
    }

    /// The entries rounded to one number each.
    pub fn rounded(&self) -> nalgebra::DMatrix<f64> {
        nalgebra::DMatrix::from_fn(self.rows, self.columns, |i, j| self[(i, j)].value())
    }

    /// X with self X = right, by elimination with row pivots; `None` where a pivot is 0.
    pub fn solve(&self, right: &Self) -> Option<Self> {
        let (count, mut left, mut x) = (self.rows, self.clone(), right.clone());
        for k in 0..count {
            let size = |i: usize| left[(i, k)].hi.abs();
            let pivot = (k..count).max_by(|&i, &j| size(i).total_cmp(&size(j)))?;
            if left[(pivot, k)].hi == 0.0 {
                return None;
            }
            left.swap_rows(k, pivot);
            x.swap_rows(k, pivot);
            for i in k + 1..count {
                let part = left[(i, k)].divide(left[(k, k)]);
                for j in k..count {
                    left[(i, j)] = left[(i, j)] - part * left[(k, j)];
                }
                for j in 0..x.columns {
                    x[(i, j)] = x[(i, j)] - part * x[(k, j)];
                }
            }
        }
        for j in 0..x.columns {
            for i in (0..count).rev() {
                let rest =
                    (i + 1..count).fold(x[(i, j)], |rest, k| rest - left[(i, k)] * x[(k, j)]);
                x[(i, j)] = rest.divide(left[(i, i)]);
            }
        }
        Some(x)
    }

    fn swap_rows(&mut self, i: usize, j: usize) {
        for k in 0..self.columns {
            self.entries.swap(i * self.columns + k, j * self.columns + k);
        }
    }

    /// Eigenvalues, and eigenvectors in columns, of a symmetric matrix, by Jacobi's rotations
    /// (Golub & Van Loan, *Matrix Computations*, section 8.5).
    pub fn eigen(mut self) -> (Vec<DoubleDouble>, Self) {
        let count = self.rows;
        let one = DoubleDouble::new(1.0);
        let mut vectors = Self::diagonal(&vec![one; count]);
        let size = |a: &Self, diagonal: bool| {
            let entries = (0..count).flat_map(|i| (0..count).map(move |j| (i, j)));
            entries
                .filter(|(i, j)| diagonal || i != j)
                .map(|place| a[place].hi.powi(2))
                .sum::<f64>()
        };
        let whole = size(&self, true);
        for _ in 0..MOST_SWEEPS {
            if size(&self, false) <= DIAGONAL * DIAGONAL * whole {
                break;
            }
            for p in 0..count {
                for q in p + 1..count {
                    if self[(p, q)].hi == 0.0 {
                        continue;
                    }
                    let theta = (self[(q, q)] - self[(p, p)]).divide(self[(p, q)].scale(2.0));
                    let root = (theta * theta + one).sqrt();
                    let tangent = if theta.hi < 0.0 {
                        one.divide(theta - root)
                    } else {
                        one.divide(theta + root)
                    };
                    let cos = one.divide((tangent * tangent + one).sqrt());
                    let sin = tangent * cos;
                    let turn =
                        |x: DoubleDouble, y: DoubleDouble| (cos * x - sin * y, sin * x + cos * y);
                    for i in 0..count {
                        (self[(i, p)], self[(i, q)]) = turn(self[(i, p)], self[(i, q)]);
                    }
                    for j in 0..count {
                        (self[(p, j)], self[(q, j)]) = turn(self[(p, j)], self[(q, j)]);
                    }
                    for i in 0..count {
                        (vectors[(i, p)], vectors[(i, q)]) = turn(vectors[(i, p)], vectors[(i, q)]);
                    }
                }
            }
        }
        ((0..count).map(|i| self[(i, i)]).collect(), vectors)
    }
}

/// What is left of a vector orthogonal to an orthonormal basis; twice, as rounding of the first
/// time is along the basis.
fn orthogonal(basis: &[Vec<DoubleDouble>], mut vector: Vec<DoubleDouble>) -> Vec<DoubleDouble> {
    for _ in 0..2 {
        for b in basis {
            let part = dot(b, &vector);
            for (v, &b) in vector.iter_mut().zip(b) {
                *v = *v - part * b;
            }
        }
    }
    vector
}

fn unit(vector: &[DoubleDouble]) -> Vec<DoubleDouble> {
    let length = dot(vector, vector).sqrt();
    vector.iter().map(|v| v.divide(length)).collect()
}

/// Euclidean norm.
pub(crate) fn length(vector: &[DoubleDouble]) -> f64 {
    vector.iter().map(|v| v.hi * v.hi).sum::<f64>().sqrt()
}

/// The rows that are no combination of those before them, by index; and an orthonormal basis, in
/// columns, of what is orthogonal to all rows.
pub(crate) fn complement(rows: &[Vec<DoubleDouble>], columns: usize) -> (Vec<usize>, Matrix) {
    let (mut independent, mut basis) = (Vec::new(), Vec::new());
    for (i, row) in rows.iter().enumerate() {
        let rest = orthogonal(&basis, row.clone());
        if length(&rest) > DEPENDENT * length(row) {
            basis.push(unit(&rest));
            independent.push(i);
        }
    }
    let taken = basis.len();
    let axis = |i: usize| -> Vec<DoubleDouble> {
        (0..columns).map(|j| DoubleDouble::new(f64::from(u8::from(i == j)))).collect()
    };
    // What an axis has left orthogonal to the basis, squared.
    let of_axis = |i: usize| 1.0 - basis.iter().map(|b: &Vec<_>| b[i].hi * b[i].hi).sum::<f64>();
    let mut left: Vec<f64> = (0..columns).map(of_axis).collect();
    while basis.len() < columns {
        // The axis that has most; of equal ones the first.
        let best = (1..columns).fold(0, |best, i| if left[i] > left[best] { i } else { best });
        let next = unit(&orthogonal(&basis, axis(best)));
        for (left, b) in left.iter_mut().zip(&next) {
            *left -= b.hi * b.hi;
        }
        basis.push(next);
    }
    (independent, Matrix::from_rows(&basis[taken..], columns).transposed())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some_matrix(rows: usize, columns: usize) -> Matrix {
        Matrix::from_fn(rows, columns, |i, j| {
            DoubleDouble::new(((7 * i + 3 * j * j + i * j) % 11) as f64 - 4.5)
        })
    }

    fn zeros(count: usize) -> Matrix {
        Matrix::diagonal(&vec![DoubleDouble::ZERO; count])
    }

    fn largest(of: &Matrix) -> f64 {
        of.entries.iter().fold(0.0, |most: f64, e| most.max(e.hi.abs()))
    }

    #[test]
    fn solutions_solve() {
        for count in 1..8 {
            let (left, right) = (some_matrix(count, count), some_matrix(count, 3));
            let x = left.solve(&right).unwrap();
            assert!(largest(&left.times(&x).minus(&right)) < 1e-28);
        }
        assert_eq!(zeros(2).solve(&zeros(2)), None);
    }

    #[test]
    fn complements_are_orthonormal_and_dependent_rows_are_left_out() {
        let rows: Vec<Vec<DoubleDouble>> = [[1.0, 2.0, 0.0, 1.0], [2.0, 4.0, 0.0, 2.0]]
            .iter()
            .chain(&[[0.1, 0.2, 0.3, 0.4], [1.1, 2.2, 0.3, 1.4]])
            .map(|row| row.iter().map(|&x| DoubleDouble::new(x)).collect())
            .collect();
        let (independent, basis) = complement(&rows, 4);
        assert_eq!(independent, [0, 2]);
        let one = Matrix::diagonal(&[DoubleDouble::new(1.0); 2]);
        assert!(largest(&basis.transposed().times(&basis).minus(&one)) < 1e-30);
        assert!(largest(&Matrix::from_rows(&rows, 4).times(&basis)) < 1e-15);
        let (none, all) = complement(&[], 3);
        assert_eq!((none, all), (vec![], Matrix::diagonal(&[DoubleDouble::new(1.0); 3])));
        assert_eq!(complement(&rows[..1], 4).1.columns, 3);
    }
}
