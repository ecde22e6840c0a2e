//! Arithmetic that knows no mechanics: elementary functions with the same bits in every lane,
//! numbers and matrices in double double, numbers with derivatives and intervals, quadrature, the
//! bound of a first root.

pub(crate) mod cancel;
pub(crate) mod dense;
pub(crate) mod double_double;
pub(crate) mod dual;
pub(crate) mod elementary;
pub(crate) mod extrapolation;
pub(crate) mod interval;
pub(crate) mod lanes;
pub(crate) mod majorant;
pub(crate) mod quadrature;
pub(crate) mod reciprocals;
pub(crate) mod repetition;

/// Spacing of floats at 1, twice the unit roundoff.
pub(crate) const EPS: f64 = f64::EPSILON;
