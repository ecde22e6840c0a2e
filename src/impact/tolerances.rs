//! The tolerances of an impact: what each means, and why it has its value.

use crate::numerics::EPS;

/// P* at least P_f (1 - this) counts as restitution: where both are equal by an identity
/// (wall at rest) rounding must not decide (theory.md, section 4).
pub const SIMULTANEOUS: f64 = 8.0 * EPS;

/// Rounding of the separation velocity of the law as printed, in units of `EPS` times the
/// velocities it is made of: some twenty operations.
pub const PAPER_NOISE: f64 = 16.0;
