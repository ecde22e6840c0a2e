//! The numbers of one body's equation of motion, and derivatives by them.

use super::Pair;

/// A number of one body's equation of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::tangent) enum Coefficient {
    Natural,
    Damping,
    Omega,
    Phase,
    Amplitude,
    Constant,
}

/// How many there are.
pub(super) const COEFFICIENTS: usize = 6;

/// Derivatives of displacement and rate after a time by the coefficients that are asked for, 0 by the
/// others.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::tangent) struct ByEquation(pub(super) [Pair; COEFFICIENTS]);

impl ByEquation {
    /// Where there are none.
    pub const NONE: Self = Self([[f64::NAN; 2]; COEFFICIENTS]);

    /// By one of them.
    pub fn of(&self, coefficient: Coefficient) -> Pair {
        self.0[coefficient as usize]
    }
}

/// In this order: what the frequency of the drive adds needs what its phase does.
pub(super) const ALL: [Coefficient; COEFFICIENTS] = [
    Coefficient::Natural,
    Coefficient::Damping,
    Coefficient::Phase,
    Coefficient::Omega,
    Coefficient::Amplitude,
    Coefficient::Constant,
];

impl Coefficient {
    /// The first component of z that counts, if only one more does.
    pub(super) fn place(self) -> Option<usize> {
        match self {
            Self::Natural | Self::Damping => None,
            Self::Constant => Some(2),
            Self::Omega | Self::Phase | Self::Amplitude => Some(3),
        }
    }
}
