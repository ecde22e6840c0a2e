//! The incremental-impulse integrator: an impact in many small steps of the normal impulse, the
//! direction of slip judged at each. It knows neither regimes nor closed forms and shares no code
//! with them: it is the oracle that the walk along the impulse is tested against.
//!
//! One step, with M1 l^2 = 1 and G the moment of the tangential impulse:
//!
//! ```text
//! x1' += -cos x1 dP + G,  |G| <= mu |sin x1| dP        x2' += mbar dP
//! G stops the tip (x1' = 0) if it can, else it opposes what it could not stop
//! ```
//!
//! Source: the incremental impulse method of Han, Jin & Hu (2004), section 2 and reference 30;
//! docs/theory.md, section 4. The error is of first order in dP.

use super::{Impact, ImpactFailure, PreImpact, Regime, no_room};
use crate::model::error::ParameterError;
use crate::model::parameters::{ImpactLaw, System};
use crate::numerics::tolerance::MAX_INCREMENTS;

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
    v1: f64,
    v2: f64,
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
    fn advance(&mut self, system: &System, pre: &PreImpact, step: f64) {
        let pushed = self.v1 - pre.cos * step;
        let grip = system.friction * pre.sin.abs() * step;
        let v1 = if pushed.abs() <= grip { 0.0 } else { pushed - grip.copysign(pushed) };
        let moment = v1 - pushed;
        if moment != 0.0 && pre.sin != 0.0 {
            self.tangential += moment / pre.sin;
            self.friction_work -= 0.5 * moment * (self.v1 + v1);
        }
        let v2 = self.v2 + system.mass_ratio * step;
        let u = v1 * pre.cos - v2;
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
        (self.v1, self.v2, self.u) = (v1, v2, u);
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
    let approach_velocity = pre.v1 * pre.cos - pre.v2;
    check(system, approach_velocity, steps)?;
    if no_room(system, pre) {
        return Err(ImpactFailure::Jammed.into());
    }
    let (law, r) = (system.law, system.restitution);
    let friction = system.friction * pre.sin.abs();
    let least =
        approach_velocity / (system.mass_ratio + pre.cos.abs() * (pre.cos.abs() + friction));
    if least.is_nan() || least / f64::from(steps) == 0.0 {
        // The steps would be no numbers, and the impact would never end.
        let allowed = "large enough for so many steps of its impulse";
        return Err(ParameterError::new("approach_velocity", approach_velocity, allowed).into());
    }
    let mut now = Increments {
        v1: pre.v1,
        v2: pre.v2,
        u: approach_velocity,
        impulse: 0.0,
        tangential: 0.0,
        approach_work: 0.0,
        restitution_work: 0.0,
        friction_work: 0.0,
    };
    let mut approach = None;
    let mut stopped = None;
    let mut slipped = pre.v1;
    loop {
        let before = now.v1;
        now.advance(system, pre, least.max(now.impulse) / f64::from(steps));
        if !now.impulse.is_finite() {
            // No impulse ends this approach: k = 0 against a wall.
            return Err(ImpactFailure::Jammed.into());
        }
        if slipped == 0.0 {
            slipped = now.v1;
        }
        if stopped.is_none() && (now.v1 == 0.0 || now.v1 * slipped < 0.0) {
            let switch = if pre.v1 == 0.0 { 0.0 } else { now.impulse };
            stopped = Some((switch, now.u > 0.0));
        }
        if now.u <= 0.0 && approach.is_none() {
            approach = Some(now.impulse);
        }
        // Held against a wall: no impulse changes a velocity any more.
        let held = system.mass_ratio == 0.0 && before == 0.0 && now.v1 == 0.0;
        let ended = match (approach, law) {
            (None, _) if held => return Err(ImpactFailure::Jammed.into()),
            (None, _) => false,
            (Some(_), ImpactLaw::Newton) => held || now.u <= -r * approach_velocity,
            (Some(_), ImpactLaw::Energetic) => {
                (held && now.u == 0.0) || now.restitution_work >= r * r * now.approach_work
            }
            (Some(approach), _) => now.impulse >= (1.0 + r) * approach,
        };
        if ended {
            break;
        }
    }
    Ok(Impact {
        regime: regime(pre, friction, slipped, stopped),
        v1_post: now.v1,
        v2_post: now.v2,
        approach_velocity,
        separation_velocity: now.u,
        impulse_approach: approach.unwrap_or(now.impulse),
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
    if system.law == ImpactLaw::Paper {
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
fn regime(pre: &PreImpact, friction: f64, slipped: f64, stopped: Option<(f64, bool)>) -> Regime {
    if friction == 0.0 {
        return Regime::Frictionless;
    }
    let held = pre.cos.abs() <= friction;
    match stopped {
        None => Regime::Slip { direction: 1f64.copysign(slipped) },
        Some((switch, true)) if held => Regime::StickInApproach { switch },
        Some((switch, true)) => Regime::ReversalInApproach { switch },
        Some((switch, false)) if held => Regime::StickInRestitution { switch },
        Some((switch, false)) => Regime::ReversalInRestitution { switch },
    }
}
