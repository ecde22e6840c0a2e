//! Sustained contact (slide, stick, release) and the completion of chatter, which leads to it.

pub(crate) mod chatter;
pub(crate) mod closed_stops;
pub(crate) mod sustained;
pub(crate) mod tip;
pub(crate) mod tolerances;

pub use sustained::{ContactForce, ContactMode};
