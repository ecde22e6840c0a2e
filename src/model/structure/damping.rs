//! The damping of a structure: ratios of its modes, or a matrix C.

use super::modes::{Modes, RIGID};
use super::{checked_matrix, checked_vector};
use crate::model::error::ParameterError;
use crate::numerics::dense::Matrix;
use crate::numerics::double_double::DoubleDouble;

/// What the modes couple by a damping matrix at most, as a part of its largest entry there.
const COUPLED: f64 = 1e-12;

/// As it was given.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Damping {
    None,
    Ratios(Vec<f64>),
    Matrix(Vec<Vec<f64>>),
}

/// Phi^T C Phi.
pub(super) struct ModalDamping {
    /// Half of its diagonal.
    pub decay_rates: Vec<f64>,
    /// All of it, where it is not diagonal.
    pub coupling: Option<Matrix>,
}

impl Damping {
    /// What it is in the modes, or why there is none.
    pub fn in_modes(&self, found: &Modes, count: usize) -> Result<ModalDamping, ParameterError> {
        match self {
            Self::None => Ok(ModalDamping { decay_rates: vec![0.0; count], coupling: None }),
            Self::Ratios(ratios) => {
                let decay_rates = rates_of_ratios(ratios, found, count)?;
                Ok(ModalDamping { decay_rates, coupling: None })
            }
            Self::Matrix(matrix) => of_matrix(matrix, found, count),
        }
    }

    /// C; of damping ratios M Phi diag(2 c) Phi^T M.
    pub fn matrix(&self, mass: &[Vec<f64>], found: &Modes, decay_rates: &[f64]) -> Vec<Vec<f64>> {
        let count = mass.len();
        match self {
            Self::Matrix(matrix) => return matrix.clone(),
            Self::None => return vec![vec![0.0; count]; count],
            Self::Ratios(_) => {}
        }
        let rows = Matrix::from_fn(count, count, |i, mode| {
            let terms = found.shapes[mode].iter().zip(&mass[i]);
            terms.fold(DoubleDouble::ZERO, |sum, (&s, &m)| sum + s.scale(m))
        });
        let entry = |i: usize, j: usize| {
            let terms = rows.row(i).iter().zip(rows.row(j)).zip(decay_rates);
            let sum = |sum, ((&a, &b), &c): ((&DoubleDouble, &DoubleDouble), &f64)| {
                sum + (a * b).scale(2.0 * c)
            };
            terms.fold(DoubleDouble::ZERO, sum).value()
        };
        (0..count).map(|i| (0..count).map(|j| entry(i, j)).collect()).collect()
    }
}

fn rates_of_ratios(
    ratios: &[f64],
    found: &Modes,
    count: usize,
) -> Result<Vec<f64>, ParameterError> {
    checked_vector("damping_ratios", ratios, count)?;
    let highest = found.frequencies.last().map_or(0.0, |w| w.hi);
    let mut rates = Vec::with_capacity(count);
    for (i, (&ratio, w)) in ratios.iter().zip(&found.frequencies).enumerate() {
        let name = || format!("damping_ratios[{i}]");
        if ratio < 0.0 {
            return Err(ParameterError::number(name(), ratio, "a finite number >= 0"));
        }
        if ratio > 0.0 && w.hi == 0.0 {
            let allowed = "0 for a mode of frequency 0 (damping= takes a matrix)";
            return Err(ParameterError::number(name(), ratio, allowed));
        }
        // Equal frequencies have no modes of their own, which unequal ratios would need.
        if i > 0 && ratio != ratios[i - 1] {
            let before = found.frequencies[i - 1];
            if (*w * *w - before * before).hi <= RIGID * highest * highest {
                let allowed = "the ratio of the mode before, whose frequency is the same";
                return Err(ParameterError::number(name(), ratio, allowed));
            }
        }
        let rate = w.scale(ratio).value();
        if !rate.is_finite() {
            let allowed = "a number whose product with the frequency is finite";
            return Err(ParameterError::number(name(), ratio, allowed));
        }
        rates.push(rate);
    }
    Ok(rates)
}

fn of_matrix(
    matrix: &[Vec<f64>],
    found: &Modes,
    count: usize,
) -> Result<ModalDamping, ParameterError> {
    checked_matrix("damping", matrix, count)?;
    let given = Matrix::from_fn(count, count, |i, j| DoubleDouble::new(matrix[i][j]));
    let shapes = Matrix::from_rows(&found.shapes, count);
    let mut modal = shapes.times(&given.times(&shapes.transposed()));
    let size = |off: bool, modal: &Matrix| {
        let places = (0..count).flat_map(|i| (0..count).map(move |j| (i, j)));
        places
            .filter(|(i, j)| (i != j) == off)
            .fold(0.0, |most: f64, place| most.max(modal[place].hi.abs()))
    };
    let largest = size(false, &modal).max(size(true, &modal));
    if size(true, &modal) <= COUPLED * largest {
        let rate = |i: usize| {
            let rate = 0.5 * modal[(i, i)].value();
            if rate.abs() <= COUPLED * largest { 0.0 } else { rate }
        };
        let decay_rates: Vec<f64> = (0..count).map(rate).collect();
        return match decay_rates.iter().position(|&rate| rate < 0.0) {
            Some(i) => Err(not_semidefinite(2.0 * decay_rates[i])),
            None => Ok(ModalDamping { decay_rates, coupling: None }),
        };
    }
    // Symmetric to the last digit: eigenvalues and bounds take it as that.
    for i in 0..count {
        for j in 0..i {
            modal[(i, j)] = modal[(j, i)];
        }
    }
    let (eigenvalues, _) = modal.clone().eigen();
    let least = eigenvalues.iter().fold(f64::INFINITY, |least: f64, e| least.min(e.hi));
    if least < -COUPLED * largest {
        return Err(not_semidefinite(least));
    }
    let decay_rates = (0..count).map(|i| 0.5 * modal[(i, i)].value()).collect();
    Ok(ModalDamping { decay_rates, coupling: Some(modal) })
}

fn not_semidefinite(eigenvalue: f64) -> ParameterError {
    let given = format!("a matrix with the eigenvalue {eigenvalue:e} in the modes");
    ParameterError::new("damping", given, "a positive semidefinite matrix")
}
