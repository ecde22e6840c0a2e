//! One impact as a row of numbers: what tables, grids and Python ask for (docs/notation.md).

use bytemuck::{Pod, Zeroable};

use super::{Impact, ImpactFailure, IncrementalError, PreImpact, incremental, resolve};
use crate::model::error::{ParameterError, StateError};
use crate::model::parameters::System;
use crate::model::state::State;

/// Bad input of [`ImpactOutcome::incremental`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OutcomeError {
    /// A law or number of steps that cannot be used.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A state that is not finite or from which the bodies do not approach.
    #[error(transparent)]
    State(#[from] StateError),
}

/// An impact with its outcome; NaN and the regime -1 where the law gives none, or none in the range
/// of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs)]
pub struct ImpactOutcome {
    pub x1: f64,
    pub v1_pre: f64,
    pub v2_pre: f64,
    pub v1_post: f64,
    pub v2_post: f64,
    /// u before.
    pub approach_velocity: f64,
    /// u after.
    pub separation_velocity: f64,
    /// Number of the regime, or -1.
    pub regime: i64,
    pub impulse_normal: f64,
    pub impulse_tangential: f64,
    pub energy_loss: f64,
    pub friction_loss: f64,
    /// -u_post/u.
    pub effective_restitution: f64,
}

impl ImpactOutcome {
    /// Column names and NumPy formats, in order.
    pub const COLUMNS: &'static [(&'static str, &'static str)] = &[
        ("x1", "<f8"),
        ("v1_pre", "<f8"),
        ("v2_pre", "<f8"),
        ("v1_post", "<f8"),
        ("v2_post", "<f8"),
        ("approach_velocity", "<f8"),
        ("separation_velocity", "<f8"),
        ("regime", "<i8"),
        ("impulse_normal", "<f8"),
        ("impulse_tangential", "<f8"),
        ("energy_loss", "<f8"),
        ("friction_loss", "<f8"),
        ("effective_restitution", "<f8"),
    ];

    /// The impact of `system` at angle `x1` with these velocities, by its law.
    ///
    /// # Errors
    /// [`StateError`] if an argument is not finite or the bodies do not approach.
    pub fn new(system: &System, x1: f64, v1: f64, v2: f64) -> Result<Self, StateError> {
        let pre = pre_impact(system, x1, v1, v2)?;
        Ok(Self::row(x1, &pre, resolve(system, &pre)))
    }

    /// The impact integrated in small steps of the impulse, as [`incremental`].
    ///
    /// # Errors
    /// [`OutcomeError`]: a state as in [`ImpactOutcome::new`], or `steps` or a law that
    /// [`incremental`] does not take.
    pub fn incremental(
        system: &System,
        x1: f64,
        v1: f64,
        v2: f64,
        steps: u32,
    ) -> Result<Self, OutcomeError> {
        let pre = pre_impact(system, x1, v1, v2)?;
        let impact = match incremental(system, &pre, steps) {
            Ok(impact) => Ok(impact),
            Err(IncrementalError::Impact(failure)) => Err(failure),
            Err(IncrementalError::Parameter(error)) => return Err(error.into()),
        };
        Ok(Self::row(x1, &pre, impact))
    }

    fn row(x1: f64, pre: &PreImpact, impact: Result<Impact, ImpactFailure>) -> Self {
        let before = Self {
            x1,
            v1_pre: pre.v1,
            v2_pre: pre.v2,
            v1_post: f64::NAN,
            v2_post: f64::NAN,
            approach_velocity: pre.approach_velocity(),
            separation_velocity: f64::NAN,
            regime: -1,
            impulse_normal: f64::NAN,
            impulse_tangential: f64::NAN,
            energy_loss: f64::NAN,
            friction_loss: f64::NAN,
            effective_restitution: f64::NAN,
        };
        let finite = |impact: &Impact| {
            // Energies are squares, and the first to leave the range of numbers.
            [
                impact.v1_post,
                impact.v2_post,
                impact.separation_velocity,
                impact.impulse_normal,
                impact.impulse_tangential,
                impact.energy_loss,
                impact.friction_loss,
                impact.effective_restitution(),
            ]
            .iter()
            .all(|value| value.is_finite())
        };
        let Some(impact) = impact.ok().filter(finite) else { return before };
        Self {
            v1_post: impact.v1_post,
            v2_post: impact.v2_post,
            separation_velocity: impact.separation_velocity,
            regime: impact.regime.kind() as i64,
            impulse_normal: impact.impulse_normal,
            impulse_tangential: impact.impulse_tangential,
            energy_loss: impact.energy_loss,
            friction_loss: impact.friction_loss,
            effective_restitution: impact.effective_restitution(),
            ..before
        }
    }
}

fn pre_impact(system: &System, x1: f64, v1: f64, v2: f64) -> Result<PreImpact, StateError> {
    for (name, value) in [("x1", x1), ("v1", v1), ("v2", v2)] {
        if !value.is_finite() {
            return Err(StateError::NotFinite { name: name.into(), value });
        }
    }
    let pre = PreImpact::new(system.contact, &State { x1, v1, x2: 0.0, v2 });
    let u = pre.approach_velocity();
    if u > 0.0 && u.is_finite() {
        Ok(pre)
    } else {
        Err(StateError::NotApproaching { u, x1, v1, v2 })
    }
}
