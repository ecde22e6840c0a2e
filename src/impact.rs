//! Instantaneous planar impact with Coulomb friction (docs/theory.md, section 4;
//! Han, Jin & Hu (2004), section 2).
//!
//! With normal impulse P on the contact, s = sgn(x1'), k = cos x1 + mu s |sin x1|:
//! dx1' = -k dP, dx2' = mbar dP, du = -(mbar + k cos x1) dP for the approach velocity
//! u = x1' cos x1 - x2'. The impact is classified once, into a [`Regime`] with its impulse of
//! switching, and then resolved; the laws of restitution differ in where the walk along the
//! impulse ends. [`incremental`] does the same in many small steps, as an independent check.

mod incremental;
mod laws;
mod outcome;
mod paper;
mod regime;
mod walk;

pub use incremental::{IncrementalError, incremental};
pub use outcome::{ImpactOutcome, OutcomeError};
pub(crate) use regime::FirstSlip;
pub use regime::{Regime, RegimeKind};
pub(crate) use walk::{slip, straight};

use self::laws::{Energetic, Newton, Poisson};
use crate::model::angle::Angle;
use crate::model::parameters::{Contact, ImpactLaw, System};
use crate::model::state::State;
use crate::numerics::tolerance::{DEAD_CENTRE, NO_ROOM};

/// Velocities and geometry just before an impact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PreImpact {
    /// cos x1 (1 in direct contact).
    pub cos: f64,
    /// sin x1 (0 in direct contact).
    pub sin: f64,
    /// x1' before.
    pub v1: f64,
    /// x2' before.
    pub v2: f64,
}

impl PreImpact {
    /// The state just before an impact, seen in this contact geometry.
    #[must_use]
    pub fn new(contact: Contact, state: &State) -> Self {
        Self::at(contact.angle(state.x1), state)
    }

    /// The same where sine and cosine of x1 are known.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(crate) fn at(Angle { sin, cos }: Angle, state: &State) -> Self {
        Self { cos, sin, v1: state.v1, v2: state.v2 }
    }

    /// Approach velocity u = x1' cos x1 - x2'.
    #[must_use]
    pub fn approach_velocity(&self) -> f64 {
        self.v1 * self.cos - self.v2
    }
}

/// What an impact does.
#[derive(Debug, Clone, Copy, PartialEq)]
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
    /// Effective (kinematic) coefficient of restitution -u_post/u_pre.
    #[must_use]
    pub fn effective_restitution(&self) -> f64 {
        -self.separation_velocity / self.approach_velocity
    }

    /// Whether velocities, impulse and energy are numbers: energies are squares, and the first to leave
    /// the range of floats.
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
    if no_room(system, pre) {
        return Err(ImpactFailure::Jammed);
    }
    if system.law == ImpactLaw::Paper {
        return paper::resolve(pre, system.mass_ratio, system.restitution, system.friction);
    }
    let &System { mass_ratio, restitution, friction, .. } = system;
    let regime = if friction == 0.0 {
        Regime::Frictionless
    } else {
        regime::classify(pre, mass_ratio, restitution, friction)?
    };
    let end_of_slip = match regime {
        Regime::Frictionless => {
            let segment = walk::slip(pre, 0.0, 1.0);
            return Ok(walk::straight(pre, mass_ratio, restitution, &segment, regime));
        }
        Regime::Slip { direction } => {
            let segment = walk::slip(pre, friction, direction);
            return Ok(walk::straight(pre, mass_ratio, restitution, &segment, regime));
        }
        Regime::ReversalInApproach { switch } => (switch, true, false),
        Regime::StickInApproach { switch } => (switch, true, true),
        Regime::ReversalInRestitution { switch } => (switch, false, false),
        Regime::StickInRestitution { switch } => (switch, false, true),
    };
    let bent = match system.law {
        ImpactLaw::Newton => walk::bent::<Newton>,
        ImpactLaw::Energetic => walk::bent::<Energetic>,
        _ => walk::bent::<Poisson>,
    };
    Ok(bent(pre, mass_ratio, restitution, friction, regime, end_of_slip))
}

/// A wall that approaches a tip at the end of its reach, which would drive x1' beyond all bounds, or
/// at dead centre, where hardly any impulse acts on x1'.
#[inline]
pub(crate) fn no_room(system: &System, pre: &PreImpact) -> bool {
    let approaches = system.mass_ratio == 0.0 && pre.v2 < 0.0;
    let at_end = || pre.sin < 0.0 && pre.cos.abs() <= NO_ROOM;
    let at_dead_centre = || {
        pre.sin > 0.0
            && pre.cos.abs() <= DEAD_CENTRE * (1.0 + system.gap.abs())
            && -pre.v2 > (pre.v1 * pre.cos).abs()
    };
    approaches && (at_end() || at_dead_centre())
}

/// Whether slip in the direction of x1' cannot stop the approach (mbar + k cos x1 <= 0): a graze
/// there has a finite effect and is undecidable (docs/theory.md, section 4).
pub(crate) fn approach_grows(system: &System, pre: &PreImpact) -> bool {
    let slip = regime::slip_constant(pre, system.friction, pre.v1);
    system.friction > 0.0 && pre.v1 != 0.0 && system.mass_ratio + slip * pre.cos <= 0.0
}
