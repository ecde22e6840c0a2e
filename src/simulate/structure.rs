//! A linear structure with stops in the event loop: what it asks of it (model.rs).

#![allow(private_interfaces)] // nobody outside of the crate can name the trait

mod event;
mod strike;
mod touching;

pub use event::{
    ClosedStops, StopChatterEvent, StopContactEvent, StopGrazeEvent, StopImpactEvent,
    StructureEvent,
};
pub use touching::{StopStart, Touching};

use serde::{Deserialize, Serialize};

use super::model::{ChatterView, Follows, Leg, Model, Skipped};
use super::{Anchor, AnchorOf, FlightStart, Observer, Phase, Simulation, Turn};
use crate::contact::chatter::{Bounce, Limit, Others};
use crate::flight::{Drive, Trig};
use crate::impact::StopImpact;
use crate::model::error::StateError;
use crate::model::state::{Clock, ModelState};
use crate::model::structure::{Coordinates, Structure, StructureState};
use crate::numerics::EPS;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::lanes::LANES;
use crate::search::Start;
use crate::search::first_contact::{ContactReport, Touch};
use crate::search::gap::noise;
use crate::search::tolerances::REST_NOISE;

/// How contact goes on at the closed stops.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StructureMode {
    /// Without friction.
    Closed,
    /// One stop with friction slides, t . q' > 0.
    SlidePositive,
    /// It slides, t . q' < 0.
    SlideNegative,
    /// It sticks.
    Stick,
}
