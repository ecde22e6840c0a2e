//! The first contact along a flight, found with a guarantee (docs/contact-detection.md).

pub(crate) mod first_contact;
pub(crate) mod gap;
pub(crate) mod scan;
pub(crate) mod steps;
pub(crate) mod tolerances;

#[cfg(test)]
pub(crate) mod coupled_oscillators;

pub use first_contact::Start;
pub use gap::GapPoint;
