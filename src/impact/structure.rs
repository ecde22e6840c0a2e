//! The impact of a linear structure on one of its stops, by the one law (docs/theory.md, sections 4
//! and 12): v+ = v - M^-1 n P + M^-1 t Q.

use serde::{Deserialize, Serialize};

use super::regime::FirstSlip;
use super::{ImpactFailure, Regime, resolve_in_contact};
use crate::model::contact_coordinates::ContactCoordinates;
use crate::model::structure::Structure;

/// What an impact on a stop does.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StopImpact {
    /// Which stop.
    pub stop: usize,
    /// Regime, with the impulse at which slip ended, if it did.
    pub regime: Regime,
    /// u before, relative to the stop.
    pub approach_velocity: f64,
    /// u after: not positive.
    pub separation_velocity: f64,
    /// Normal impulse P >= 0, against the normal.
    pub impulse_normal: f64,
    /// Tangential impulse Q, along the tangent.
    pub impulse_tangential: f64,
    /// Energy taken by restitution and friction.
    pub energy_loss: f64,
    /// The part of it that is friction's work.
    pub friction_loss: f64,
}

/// The impact of a structure on a stop. `velocities` (N,) are those just before and become those
/// just after; `approach_velocity` is u > 0, relative to the stop.
///
/// # Errors
/// [`ImpactFailure`] where the law gives no outcome; the velocities are as they were.
///
/// # Example
/// ```
/// use vibroimpact::impact::strike;
/// use vibroimpact::{Stop, Structure};
///
/// let structure = Structure::builder(vec![vec![2.0]], vec![vec![1.0]])
///     .stop(Stop::new([1.0], 0.5, 0.8))
///     .build()?;
/// let mut velocities = [3.0];
/// let impact = strike(&structure, 0, 3.0, &mut velocities)?;
/// assert!((velocities[0] + 2.4).abs() < 1e-15);
/// assert!((impact.impulse_normal - 2.0 * 5.4).abs() < 1e-14);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Panics
/// If there is no such stop, or another number of velocities.
pub fn strike(
    structure: &Structure,
    stop: usize,
    approach_velocity: f64,
    velocities: &mut [f64],
) -> Result<StopImpact, ImpactFailure> {
    strike_inline(structure, stop, approach_velocity, velocities)
}

/// [`strike`], compiled with what calls it.
#[inline(always)]
#[allow(clippy::inline_always)] // a round of the lanes is compiled for several instruction sets
pub(crate) fn strike_inline(
    structure: &Structure,
    stop: usize,
    approach_velocity: f64,
    velocities: &mut [f64],
) -> Result<StopImpact, ImpactFailure> {
    let count = structure.coordinates();
    assert!(velocities.len() == count, "{count} velocities");
    let (at, rows) = (&structure.stops()[stop], structure.contact(stop));
    let slip = structure.slip(stop, velocities);
    let contact = ContactCoordinates::new(approach_velocity, slip, rows.mobilities, at.friction());
    let impact =
        resolve_in_contact(&contact, at.coefficient().at(approach_velocity), &structure.law())?;
    for ((v, n), t) in velocities.iter_mut().zip(&rows.by_normal).zip(&rows.by_tangent) {
        *v += impact.impulse_tangential * t - impact.impulse_normal * n;
    }
    Ok(StopImpact {
        stop,
        regime: impact.regime,
        approach_velocity: impact.approach_velocity,
        separation_velocity: impact.separation_velocity,
        impulse_normal: impact.impulse_normal,
        impulse_tangential: impact.impulse_tangential,
        energy_loss: impact.energy_loss,
        friction_loss: impact.friction_loss,
    })
}

/// Whether slip at a stop cannot stop the approach: a graze there has a finite effect.
pub(crate) fn approach_grows_at(structure: &Structure, stop: usize, velocities: &[f64]) -> bool {
    let (at, rows) = (&structure.stops()[stop], structure.contact(stop));
    let slip = structure.slip(stop, velocities);
    let contact = ContactCoordinates::new(0.0, slip, rows.mobilities, at.friction());
    at.friction() > 0.0 && slip != 0.0 && FirstSlip::new(&contact).approach_grows()
}
