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
mod period;
mod run;
mod simulate;
mod state;
mod sweep;
pub mod tolerance;

pub use error::{ParameterError, SimulationError, StateError};
pub use event::{
    Event, EventKind, EventRecord, GrazeEvent, GrazeRecord, ImpactEvent, ImpactRecord, StopEvent,
    StopReason,
};
pub use flight::{Flight, FreeMotion};
pub use gap::GapPoint;
pub use params::{Contact, ImpactLaw, System, SystemBuilder};
pub use period::{Growth, Kind, PeriodReport, detect_period, resolve_by_growth};
pub use run::{FinalState, Run, RunError, RunOptions, run};
pub use simulate::{Horizon, Observer, Simulation};
pub use state::{Clock, State};
pub use sweep::{PointStatus, SweepPoint, SweepStart, Workers, run_many, sweep};

#[cfg(feature = "python")]
mod python;
