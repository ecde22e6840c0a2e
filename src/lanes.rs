//! A few numbers treated together, written so that compilers turn loops over them into vector
//! instructions: no branches, no calls. The operations are the same with any of them, and so are the bits.

/// Numbers treated together.
pub(crate) const LANES: usize = 8;

/// Eight values of one quantity.
pub(crate) type Lanes = [f64; LANES];
