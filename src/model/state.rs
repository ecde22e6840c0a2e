//! The state of the system between impacts, and the clock that counts drive periods.

use std::fmt::Debug;

use serde::{Deserialize, Serialize};

use crate::model::error::StateError;

/// State of both bodies: pendulum angle and oscillator displacement with their rates
/// (dimensionless; Han, Jin & Hu (2004), eq. (23)).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Pendulum angle.
    pub x1: f64,
    /// Its rate dx1/dt.
    pub v1: f64,
    /// Oscillator displacement.
    pub x2: f64,
    /// Its rate dx2/dt.
    pub v2: f64,
}

impl State {
    /// A state with finite components.
    ///
    /// # Errors
    /// [`StateError::NotFinite`] names the first component that is NaN or infinite.
    pub fn new(x1: f64, v1: f64, x2: f64, v2: f64) -> Result<Self, StateError> {
        Self { x1, v1, x2, v2 }.checked()
    }

    /// This state if it is finite; the fields are open to any number.
    pub(crate) fn checked(self) -> Result<Self, StateError> {
        let Self { x1, v1, x2, v2 } = self;
        for (name, value) in [("x1", x1), ("v1", v1), ("x2", x2), ("v2", v2)] {
            if !value.is_finite() {
                return Err(StateError::NotFinite { name: name.into(), value });
            }
        }
        Ok(self)
    }

    /// The components (x1, v1, x2, v2).
    #[must_use]
    pub fn to_array(self) -> [f64; 4] {
        [self.x1, self.v1, self.x2, self.v2]
    }

    /// The state with the components (x1, v1, x2, v2).
    pub(crate) fn from_array([x1, v1, x2, v2]: [f64; 4]) -> Self {
        Self { x1, v1, x2, v2 }
    }
}

/// Coordinates and velocities.
pub trait ModelState: Clone + PartialEq + Debug + Send + Sync {
    /// Whether all numbers are finite.
    fn is_finite(&self) -> bool;
    /// A short time earlier, to first order: where the bounces left are too low to be told apart.
    #[must_use]
    fn earlier(self, time: f64) -> Self;
    /// All numbers.
    fn to_vec(&self) -> Vec<f64>;
    /// Their bits, which tell -0 from 0.
    fn bits(&self) -> Vec<u64> {
        self.to_vec().into_iter().map(f64::to_bits).collect()
    }
}

impl ModelState for State {
    #[inline]
    fn is_finite(&self) -> bool {
        self.to_array().iter().all(|c| c.is_finite())
    }

    fn earlier(self, time: f64) -> Self {
        Self { x1: self.x1 - time * self.v1, x2: self.x2 - time * self.v2, ..self }
    }

    fn to_vec(&self) -> Vec<f64> {
        self.to_array().to_vec()
    }
}

/// An instant as completed drive periods and the time since; exact at any number of periods.
/// Without a drive frequency the period stays 0.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct Clock {
    /// Completed drive periods since t = 0.
    pub period: i64,
    /// Time since the start of the current period, in [0, 2 pi/omega).
    pub time_in_period: f64,
    /// What rounding `time_in_period` to one number left out; at impacts in whole ticks of the
    /// drive.
    pub(crate) residual: f64,
}

impl Clock {
    /// The instant `time_in_period` after `period` completed periods.
    #[must_use]
    pub const fn new(period: i64, time_in_period: f64) -> Self {
        Self { period, time_in_period, residual: 0.0 }
    }

    /// The start of a run, t = 0.
    pub const START: Self = Self { period: 0, time_in_period: 0.0, residual: 0.0 };
}
