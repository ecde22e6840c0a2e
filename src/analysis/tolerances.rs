//! The tolerances of the analyses: what each means, and why it has its value.

/// Shortest step of a Lyapunov spectrum: exponents are per unit time, and over less may leave the
/// range of floats.
pub const SHORTEST_MEASURED: f64 = 1e-300;

/// Step, as an angle of the fastest motion, at which a flight is sampled for maxima of the gap.
pub const HUMP_ANGLE: f64 = 0.25;

/// Part of a local flight: a maximum of the gap this close to the end of a flight is at the end.
pub const END_OF_FLIGHT: f64 = 1e-6;

/// A maximum at the end that is this close to zero is the contact that ends the flight: the place
/// of a flat top is known to the root of rounding.
pub const END_LEVEL: f64 = 1e-12;
