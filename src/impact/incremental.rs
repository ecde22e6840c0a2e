//! The incremental-impulse integrator: an impact in many small steps of the normal impulse, the
//! direction of slip judged at each. It knows neither regimes nor closed forms and shares no code
//! with them but what a law is: it is the oracle that the impulse path is tested against.
//!
//! One step in contact coordinates, G the change of w by the tangential impulse:
//!
//! ```text
//! w += -b/h dP + G,  |G| <= mu |h| dP        v += (a - b^2/c) dP
//! G stops slip (w = 0) if it can, else it opposes what it could not stop
//! ```
//!
//! Source: the incremental impulse method of Han, Jin & Hu (2004), section 2 and reference 30;
//! docs/theory.md, section 4. The error is of first order in dP.

use super::laws::{Approach, Law, Restitution};
use super::{Impact, ImpactFailure, PreImpact, Regime};
use crate::model::contact_coordinates::ContactCoordinates;
use crate::model::error::ParameterError;
use crate::model::parameters::System;

/// Most steps of the incremental-impulse integrator: with more, the sum of their roundings would
/// approach the error of the steps themselves.
pub const MAX_INCREMENTS: u32 = 1_000_000;

/// Why [`incremental`] has no outcome.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IncrementalError {
    /// An argument outside its range, named with its value.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The impact itself has no outcome.
    #[error(transparent)]
    Impact(#[from] ImpactFailure),
}

/// The state of an impact part of the way along the impulse.
struct Increments {
    slip: f64,
    parting: f64,
    u: f64,
    impulse: f64,
    tangential: f64,
    /// Work done against the normal impulse while u > 0.
    approach_work: f64,
    /// Work given back by it since.
    restitution_work: f64,
    friction_work: f64,
}

impl Increments {
    /// One step dP.
    fn advance(&mut self, contact: &ContactCoordinates<f64>, step: f64) {
        let pushed = self.slip - contact.coupling * step;
        let grip = contact.friction * contact.scale.abs() * step;
        let slip = if pushed.abs() <= grip { 0.0 } else { pushed - grip.copysign(pushed) };
        let change = slip - pushed;
        if change != 0.0 && contact.scale != 0.0 {
            self.tangential += change / contact.scale;
            self.friction_work -= 0.5 * change * (self.slip + slip);
        }
        let parting = self.parting + contact.mobility * step;
        let u = slip * contact.coupling - parting;
        let work = 0.5 * step * (self.u + u);
        if self.u > 0.0 && u < 0.0 {
            // The step in which the approach ends belongs to both phases.
            let part = step / (self.u - u);
            self.approach_work += 0.5 * part * self.u * self.u;
            self.restitution_work += 0.5 * part * u * u;
        } else if self.u > 0.0 {
            self.approach_work += work;
        } else {
            self.restitution_work -= work;
        }
        self.impulse += step;
        (self.slip, self.parting, self.u) = (slip, parting, u);
    }
}

/// The impact of `system` from a state just before it, in steps of the normal impulse.
///
/// A step is the `steps`-th part of the impulse so far, or of the least impulse that can end an
/// approach, P0 = u/(mbar + |cos x1| (|cos x1| + mu |sin x1|)), while that is larger: an impact
/// takes `steps` (1 + ln(P/P0)) of them. Velocities are in error by a multiple of P/`steps`, and
/// by rounding, which adds up to about `steps` EPS. The regime is what the steps showed, its
/// switching impulse to within one of them. All quantities are dimensionless.
///
/// # Errors
/// [`IncrementalError::Parameter`] unless 1 <= `steps` <= [`MAX_INCREMENTS`], u > 0 and finite, and
/// the law is `poisson`, `newton` or `energetic`; [`IncrementalError::Impact`] if the impact is
/// jammed.
///
/// # Example
/// ```
/// use vibroimpact::System;
/// use vibroimpact::impact::{PreImpact, incremental, resolve};
///
/// let system = System::builder()
///     .mass_ratio(0.6).frequency_ratio(2.0).restitution(0.8).gap(0.5).drive_frequency(1.8)
///     .friction(0.5)
///     .build()?;
/// let pre = PreImpact { cos: 0.8, sin: 0.6, v1: 0.5, v2: -0.4 };
/// let (exact, stepped) = (resolve(&system, &pre)?, incremental(&system, &pre, 10_000)?);
/// assert!((exact.v1_post - stepped.v1_post).abs() < 1e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn incremental(
    system: &System,
    pre: &PreImpact,
    steps: u32,
) -> Result<Impact, IncrementalError> {
    check(system, pre.approach_velocity(), steps)?;
    if pre.has_no_room(system) {
        return Err(ImpactFailure::Jammed.into());
    }
    let contact = pre.coordinates(system.mass_ratio, system.friction);
    let restitution = system.restitution_at(contact.approach_velocity());
    integrate(&contact, (restitution, &system.law), steps)
}

/// The impact of two bodies in contact coordinates, under any law.
pub(super) fn integrate(
    contact: &ContactCoordinates<f64>,
    (restitution, law): (f64, &impl Law),
    steps: u32,
) -> Result<Impact, IncrementalError> {
    let velocity = contact.slip * contact.coupling - contact.parting;
    let friction = contact.friction * contact.scale.abs();
    let coupling = contact.coupling.abs();
    let least = velocity / (contact.mobility + coupling * (coupling + friction));
    if least.is_nan() || least / f64::from(steps) == 0.0 {
        // The steps would be no numbers, and the impact would never end.
        let allowed = "large enough for so many steps of its impulse";
        return Err(ParameterError::new("approach_velocity", velocity, allowed).into());
    }
    let mut now = Increments {
        slip: contact.slip,
        parting: contact.parting,
        u: velocity,
        impulse: 0.0,
        tangential: 0.0,
        approach_work: 0.0,
        restitution_work: 0.0,
        friction_work: 0.0,
    };
    let mut approach: Option<Approach<f64>> = None;
    let mut stopped = None;
    let mut slipped = contact.slip;
    loop {
        let before = now.slip;
        now.advance(contact, least.max(now.impulse) / f64::from(steps));
        if !now.impulse.is_finite() {
            // No impulse ends this approach: k = 0 against a wall.
            return Err(ImpactFailure::Jammed.into());
        }
        if slipped == 0.0 {
            slipped = now.slip;
        }
        if stopped.is_none() && (now.slip == 0.0 || now.slip * slipped < 0.0) {
            let switch = if contact.slip == 0.0 { 0.0 } else { now.impulse };
            stopped = Some((switch, now.u > 0.0));
        }
        if now.u <= 0.0 && approach.is_none() {
            let (impulse, work) = (now.impulse, now.approach_work);
            approach = Some(Approach { restitution, velocity, impulse, work });
        }
        // Held against a wall: no impulse changes a velocity any more.
        let held = contact.mobility == 0.0 && before == 0.0 && now.slip == 0.0;
        let ended = match &approach {
            None if held => return Err(ImpactFailure::Jammed.into()),
            None => false,
            Some(approach) => match law.restitution(approach) {
                Restitution::Velocity(ratio) => held || now.u <= -ratio * velocity,
                Restitution::Work(ratio) => {
                    (held && now.u == 0.0) || now.restitution_work >= ratio * ratio * approach.work
                }
                Restitution::Impulse(ratio) => now.impulse >= (1.0 + ratio) * approach.impulse,
            },
        };
        if ended {
            break;
        }
    }
    Ok(Impact {
        regime: regime(contact, slipped, stopped),
        v1_post: now.slip,
        v2_post: now.parting,
        approach_velocity: velocity,
        separation_velocity: now.u,
        impulse_approach: approach.map_or(now.impulse, |approach| approach.impulse),
        impulse_normal: now.impulse,
        impulse_tangential: now.tangential,
        energy_loss: now.approach_work - now.restitution_work + now.friction_work,
        friction_loss: now.friction_work,
    })
}

fn check(system: &System, approach_velocity: f64, steps: u32) -> Result<(), ParameterError> {
    if !(1..=MAX_INCREMENTS).contains(&steps) {
        let allowed = format!("an integer from 1 to {MAX_INCREMENTS}");
        return Err(ParameterError::new("steps", steps, allowed));
    }
    if !system.law.is_coulomb() {
        let allowed = "poisson, newton or energetic for the incremental integrator";
        return Err(ParameterError::new("law", system.law.name(), allowed));
    }
    if !(approach_velocity > 0.0 && approach_velocity.is_finite()) {
        return Err(ParameterError::new("approach_velocity", approach_velocity, "u > 0"));
    }
    Ok(())
}

/// What the steps showed: `slipped` is the first velocity of slip, `stopped` where it first ended
/// and whether in approach.
fn regime(contact: &ContactCoordinates<f64>, slipped: f64, stopped: Option<(f64, bool)>) -> Regime {
    let friction = contact.friction * contact.scale.abs();
    if friction == 0.0 {
        return Regime::Frictionless;
    }
    let held = contact.coupling.abs() <= friction;
    match stopped {
        None => Regime::Slip { direction: 1f64.copysign(slipped) },
        Some((switch, true)) if held => Regime::StickInApproach { switch },
        Some((switch, true)) => Regime::ReversalInApproach { switch },
        Some((switch, false)) if held => Regime::StickInRestitution { switch },
        Some((switch, false)) => Regime::ReversalInRestitution { switch },
    }
}
