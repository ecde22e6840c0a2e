//! Instantaneous planar impact with Coulomb friction (docs/theory.md, section 4;
//! Han, Jin & Hu (2004), section 2).
//!
//! The law is written in contact coordinates (model/contact_coordinates.rs), for any
//! two bodies. With the normal impulse P on the contact,
//!
//! ```text
//! dw = -k dP,    dv = mobility dP,    k = b/h + mu |h| sgn w.
//! ```
//!
//! The impact is classified once, into a [`Regime`] with the impulse P* at which slip ends. Then
//! the impulse path is computed in closed form (impact/path.rs), with floats for runs and with
//! numbers that carry derivatives for saltation matrices. The law of restitution decides where the
//! path ends. [`incremental`] does the same in many small steps, as an independent check.

mod incremental;
mod laws;
mod outcome;
mod paper;
mod path;
mod regime;
mod structure;
#[cfg(test)]
mod tests;
pub(crate) mod tolerances;

pub use incremental::{IncrementalError, MAX_INCREMENTS, incremental};
pub use outcome::{ImpactOutcome, OutcomeError};
pub(crate) use path::{PathEnd, follow, slipping_path};
pub use regime::{Regime, RegimeKind};
pub use structure::{StopImpact, strike};
pub(crate) use structure::{approach_grows_at, strike_inline};

pub use crate::model::contact_coordinates::PreImpact;

use serde::{Deserialize, Serialize};

use self::laws::Law;
use self::regime::FirstSlip;
use crate::model::contact_coordinates::ContactCoordinates;
use crate::model::parameters::System;

/// What an impact does.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Impact {
    /// Regime, with the impulse at which slip ended, if it did.
    pub regime: Regime,
    /// x1' after.
    pub v1_post: f64,
    /// x2' after.
    pub v2_post: f64,
    /// Approach velocity u before.
    pub approach_velocity: f64,
    /// u after: not positive.
    pub separation_velocity: f64,
    /// Normal impulse P_I at which the approach ends.
    pub impulse_approach: f64,
    /// Whole normal impulse P >= 0, in units M1 l omega_2.
    pub impulse_normal: f64,
    /// Whole tangential impulse: -mu s sgn(sin x1) P in slip, what keeps x1' = 0 in stick.
    pub impulse_tangential: f64,
    /// Energy taken by restitution and friction, in M1 l^2 omega_2^2; finite also for mbar = 0.
    /// Negative where a law creates energy: `newton` and `paper` can.
    pub energy_loss: f64,
    /// The part of it that is friction's work, the integral of mu |sin x1| |x1'| dP; the rest is
    /// what restitution does not give back of the work of approach. Under `paper` the tangential
    /// impulse times the mean slip velocity, negative where that law's friction drives the slip.
    pub friction_loss: f64,
}

impl Impact {
    /// The velocities at the end of the path are x1' and x2'.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(crate) fn new(regime: Regime, end: &PathEnd<f64>) -> Self {
        Self {
            regime,
            v1_post: end.slip,
            v2_post: end.parting,
            approach_velocity: end.approach_velocity,
            separation_velocity: end.separation_velocity,
            impulse_approach: end.impulse_approach,
            impulse_normal: end.impulse_normal,
            impulse_tangential: end.impulse_tangential,
            energy_loss: end.energy_loss,
            friction_loss: end.friction_loss,
        }
    }

    /// Effective (kinematic) coefficient of restitution -u_post/u_pre.
    #[must_use]
    pub fn effective_restitution(&self) -> f64 {
        -self.separation_velocity / self.approach_velocity
    }

    /// Whether velocities, impulse and energy are numbers: energies are squares, and the first to
    /// leave the range of floats.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(crate) fn is_finite(&self) -> bool {
        (self.v1_post + self.v2_post + self.impulse_normal + self.energy_loss).is_finite()
    }

    /// Whether the bodies neither part nor slip after it: a plastic impact that ends in stick.
    #[inline]
    pub(crate) fn ends_at_rest(&self) -> bool {
        self.separation_velocity == 0.0 && self.v1_post == 0.0
    }
}

/// Why an impact has no outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ImpactFailure {
    /// mbar = 0 and a wall that keeps approaching: the pendulum sticks against it, which no impulse
    /// ends, or its tip has been driven to the end of its reach, sin x1 = -1, or is met at dead
    /// centre, sin x1 = 1.
    #[error("the pendulum is jammed against an approaching wall")]
    Jammed,
    /// law = paper: the bodies approach after the impact, or the result is not finite.
    #[error("the impact law gives no admissible outcome")]
    LawFailed,
}

/// The impact of `system` from a state just before it, u > 0.
///
/// # Errors
/// [`ImpactFailure`] where the law gives no outcome.
#[inline(always)]
#[allow(clippy::inline_always)]
pub fn resolve(system: &System, pre: &PreImpact) -> Result<Impact, ImpactFailure> {
    if pre.has_no_room(system) {
        return Err(ImpactFailure::Jammed);
    }
    if !system.law.is_coulomb() {
        return paper::resolve(system, pre);
    }
    let contact = pre.coordinates(system.mass_ratio, system.friction);
    let restitution = system.restitution_at(contact.approach_velocity());
    resolve_in_contact(&contact, restitution, &system.law)
}

/// The impact of two bodies in contact coordinates, under any law.
#[inline(always)]
#[allow(clippy::inline_always)]
fn resolve_in_contact(
    contact: &ContactCoordinates<f64>,
    restitution: f64,
    law: &impl Law,
) -> Result<Impact, ImpactFailure> {
    let regime = if contact.friction == 0.0 {
        Regime::Frictionless
    } else {
        regime::classify(contact, restitution)?
    };
    let (direction, switch) = regime.start(contact.slip);
    let end = follow(contact, (restitution, law), regime.kind(), direction, switch);
    Ok(Impact::new(regime, &end))
}

/// The impact if slip keeps its direction, and whether it does: computed without a branch.
#[inline(always)]
#[allow(clippy::inline_always)]
#[allow(clippy::needless_bitwise_bool)] // conditions without jumps, for the lanes
pub(crate) fn resolve_without_switch(
    contact: &ContactCoordinates<f64>,
    restitution: f64,
) -> (PathEnd<f64>, bool) {
    let first = FirstSlip::new(contact);
    let slips = (contact.scale != 0.0) & (contact.slip != 0.0);
    let continues = slips & first.continues(contact, restitution) & !first.approach_grows();
    let end = slipping_path(contact, restitution, 1f64.copysign(contact.slip));
    (end, (contact.friction == 0.0) | continues)
}

/// Whether slip in the direction it has before cannot stop the approach (mbar + k cos x1 <= 0): a
/// graze there has a finite effect and is undecidable (docs/theory.md, section 4).
pub(crate) fn approach_grows(system: &System, pre: &PreImpact) -> bool {
    let contact = pre.coordinates(system.mass_ratio, system.friction);
    contact.friction > 0.0 && contact.slip != 0.0 && FirstSlip::new(&contact).approach_grows()
}
