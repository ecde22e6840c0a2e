//! Why a run has no derivatives.

use crate::model::error::{ParameterError, SimulationError, StateError};
use crate::simulate::run::{Recorded, RunError};
use crate::tangent::structure::StructureTangentError;

/// Why a run has no derivatives.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SensitivityError {
    /// A bad name.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The start is refused.
    #[error(transparent)]
    State(#[from] StateError),
    /// The computation of the motion failed.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The motion from this start is not the one of the run.
    #[error("the motion from this start is not the one of the run: they differ at t = {time}")]
    OtherMotion {
        /// When.
        time: f64,
    },
    /// A leg has no derivatives that could be computed.
    #[error(
        "the chatter or contact that ends at t = {time} has no derivatives that could be computed: \
         rounding hides how it ends, or derivatives were too large before it, as after a chaotic \
         transient; the largest was {largest:.1e}"
    )]
    NoDerivative {
        /// When it ends.
        time: f64,
        /// The largest derivative before it.
        largest: f64,
    },
    /// A body is damped too strongly.
    #[error(
        "a body is damped too strongly for derivatives by its equation, in the flight from t = {time}"
    )]
    Damping {
        /// When the flight begins.
        time: f64,
    },
    /// A leg of a structure has none.
    #[error(transparent)]
    Structure(StructureTangentError),
    /// Derivatives have grown beyond the range of numbers.
    #[error(
        "the derivatives have grown beyond 1e308 by t = {time}, as those of a chaotic motion do in time: \
         differentiate a run that ends before, or one from a later state"
    )]
    Overflow {
        /// The first impact with such derivatives, or the end.
        time: f64,
    },
    /// Contact begins without an impact: nearby motions do not reach it, or strike.
    #[error("the bodies come to contact without velocity at t = {time}: nearby motions differ")]
    Landing {
        /// When.
        time: f64,
    },
}

impl From<StructureTangentError> for SensitivityError {
    fn from(why: StructureTangentError) -> Self {
        match why {
            StructureTangentError::State(error) => error.into(),
            StructureTangentError::Simulation(error) => error.into(),
            other => Self::Structure(other),
        }
    }
}

impl<M: Recorded> From<RunError<M>> for SensitivityError {
    fn from(why: RunError<M>) -> Self {
        match why {
            RunError::Parameter(error) => error.into(),
            RunError::State(error) => error.into(),
            RunError::Simulation { error, .. } => error.into(),
        }
    }
}
