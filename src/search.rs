//! The first contact along a flight, found with a guarantee (docs/contact-detection.md).

pub(crate) mod first_contact;
pub(crate) mod gap;
pub(crate) mod scan;

pub use first_contact::{ContactReport, Found, Start, Touch, next_contact};
pub use gap::GapPoint;
