//! The system: its parameters with their ranges, its states and clocks, and what is refused.

pub(crate) mod angle;
mod choices;
mod coefficient;
pub(crate) mod contact_coordinates;
pub(crate) mod error;
pub(crate) mod oblique;
pub(crate) mod parameters;
pub(crate) mod point;
pub(crate) mod restitution;
pub(crate) mod state;
pub(crate) mod structure;
pub(crate) mod tip;
pub(crate) mod tolerances;

pub use error::{ParameterError, SimulationError, StateError};
pub use parameters::{Contact, ImpactLaw, Parameter, System, SystemBuilder};
pub use point::Point;
pub use restitution::{MOST_KNOTS, MOST_NUMBERS, RestitutionCurve};
pub use state::{Clock, State};
pub use structure::{
    Simultaneous, Stop, StopVariation, Structure, StructureBuilder, StructureParameter,
    StructureState, Variation,
};
