//! The tolerances of chatter and sustained contact: what each means, and why it has its value.

/// Impacts in a row that must shrink by one ratio before a chatter sequence is sampled.
pub const CHATTER_IMPACTS: u32 = 3;

/// Allowed relative deviation of that ratio; the accuracy of the completion is judged apart.
pub const CHATTER_RATIO_RTOL: f64 = 0.05;

/// Impacts whose u has fallen by this factor since the last sample are sampled: closer ones
/// would make the extrapolation ill-conditioned.
pub const CHATTER_SPACING: f64 = 0.6;

/// Rounding of an extrapolated state, in units of `EPS` times its size: the rounding of one
/// impact, a few units, times the norm of the extrapolation, 27 at the above spacing.
pub const CHATTER_NOISE: f64 = 64.0;

/// Factor of safety on the difference of two orders of the extrapolation: without it the error is
/// up to 2.5 times the difference where a loose tolerance accepts it early
/// (tests/simulation/chatter.rs).
pub const CHATTER_SAFETY: f64 = 10.0;

/// Rounding of the free gap acceleration in contact, in units of `EPS` times its terms.
pub const FORCE_NOISE: f64 = 16.0;

/// As [`FORCE_NOISE`], of the closed stops of a structure and of all orders, in norms of its modal
/// accelerations. More than `flight::tolerances::LEADING_NOISE`: what a landing has decided, the
/// leg that follows does not decide again.
pub const CLOSED_NOISE: f64 = 64.0;

/// Longest step of the contact phase, as an angle of the fastest of both bodies and the drive:
/// what a series of order `hold::slide::ORDER` still sums to rounding.
pub const CONTACT_ANGLE: f64 = 1.5;

/// A slide whose steps are shorter than this part of a local flight, of a tip that turns or decays
/// so fast, is stalled: it would never be done. (A light tip pressed past the end of its reach
/// turns 1e12 times.)
pub const LEAST_STEP: f64 = 1e-20;
