//! The tolerances of the analyses: what each means, and why it has its value.

/// Shortest step of a Lyapunov spectrum: exponents are per unit time, and over less may leave the range of floats.
pub const SHORTEST_MEASURED: f64 = 1e-300;

/// Step, as an angle of the fastest motion, at which a flight is sampled for maxima of the gap.
pub const HUMP_ANGLE: f64 = 0.25;

/// A maximum of the gap this close to the end of a flight, as a part of a local flight,
pub const END_OF_FLIGHT: f64 = 1e-6;

/// and this close to zero is the contact that ends it: a flat top is known to the root of rounding.
pub const END_LEVEL: f64 = 1e-12;
