//! The stretch of a run between two events.

use crate::model::parameters::System;
use crate::model::state::Clock;
use crate::simulate::{AnchorOf, Model};

/// What the bodies do between two events.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind<S, K> {
    Flight,
    /// Skipped impacts of a chatter sequence, up to this state.
    Hops(S),
    Contact(K),
}

/// The stretch between two events.
#[derive(Debug, Clone)]
pub struct Leg<M: Model = System> {
    pub anchor: AnchorOf<M>,
    pub kind: Kind<M::State, M::Mode>,
    /// Time at its start, as in the tables.
    pub time: f64,
    /// Its end.
    pub end: Clock,
}
