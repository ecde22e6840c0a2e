//! The state of a structure.

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

use crate::model::state::ModelState;

/// N numbers, without memory of their own where they are few.
pub type Coordinates = SmallVec<[f64; 6]>;

/// Coordinates and velocities of a structure, (N,) each.
#[derive(Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct StructureState {
    /// q.
    pub q: Coordinates,
    /// q'.
    pub v: Coordinates,
}

impl Clone for StructureState {
    // Not derived: numbers are copied as a whole.
    fn clone(&self) -> Self {
        Self { q: Coordinates::from_slice(&self.q), v: Coordinates::from_slice(&self.v) }
    }

    fn clone_from(&mut self, other: &Self) {
        if self.q.len() == other.q.len() && self.v.len() == other.v.len() {
            self.q.copy_from_slice(&other.q);
            self.v.copy_from_slice(&other.v);
        } else {
            *self = other.clone();
        }
    }
}

impl StructureState {
    /// From q and v.
    ///
    /// # Panics
    /// If they differ in length.
    #[must_use]
    pub fn new(q: &[f64], v: &[f64]) -> Self {
        assert_eq!(q.len(), v.len(), "as many velocities as coordinates");
        Self { q: Coordinates::from_slice(q), v: Coordinates::from_slice(v) }
    }

    /// From all numbers, those of q first.
    pub(crate) fn of_numbers(numbers: &[f64]) -> Self {
        let (q, v) = numbers.split_at(numbers.len() / 2);
        Self::new(q, v)
    }

    /// All numbers, those of q first.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        self.q.iter().chain(&self.v).copied()
    }
}

/// Size of the largest number.
pub(crate) fn largest_number(of: &[f64]) -> f64 {
    of.iter().fold(0.0, |most: f64, x| most.max(x.abs()))
}

impl ModelState for StructureState {
    fn is_finite(&self) -> bool {
        self.numbers().all(f64::is_finite)
    }

    fn earlier(mut self, time: f64) -> Self {
        for (q, v) in self.q.iter_mut().zip(&self.v) {
            *q -= time * v;
        }
        self
    }

    fn to_vec(&self) -> Vec<f64> {
        self.numbers().collect()
    }
}
