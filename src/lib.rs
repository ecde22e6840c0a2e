//! Simulation and analysis of a two-degree-of-freedom oblique-impact vibrating system.
#![doc = ""]
#![allow(clippy::doc_markdown)]

mod chatter;
pub mod contact;
mod double_double;
mod error;
mod event;
mod flight;
mod gap;
pub mod impact;
mod params;
mod simulate;
mod state;
pub mod tolerance;

pub use error::{ParameterError, SimulationError, StateError};
pub use event::{
    Event, EventKind, EventRecord, GrazeEvent, GrazeRecord, ImpactEvent, ImpactRecord, StopEvent,
    StopReason,
};
pub use flight::{Flight, FreeMotion};
pub use gap::GapPoint;
pub use params::{Contact, ImpactLaw, System, SystemBuilder};
pub use simulate::{Horizon, Observer, Simulation};
pub use state::{Clock, State};
