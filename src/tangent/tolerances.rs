//! The tolerances of the derivatives along a motion: what each means, and why it has its value.

/// Impacts before chatter with less than this part of the highest approach velocity belong to the
/// chatter's leg where derivatives are taken.
pub const LOW_BOUNCE: f64 = 0.1;

/// Most legs of an orbit: its dense matrix of derivatives has four rows for each, 128 MB in all.
pub const MOST_LEGS: usize = 1_000;

/// A damped wall that nothing drives, and that moves less than this, is at rest.
pub const STILL_WALL: f64 = 1e-6;

/// Part of a drive period at the ends of an orbit without events, if it is to be cut there.
pub const CLEAR_ENDS: f64 = 0.01;
