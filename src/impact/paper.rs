//! The impact law as printed: Han, Jin & Hu (2004), eqs. (9), (10), (14)-(20), with the signed
//! sine in the friction moment, no sticking and no guard for P* < 0. For comparison only: it can
//! create energy (docs/theory.md, errata E1 to E3).

use super::regime::Regime;
use super::{Impact, ImpactFailure, PreImpact};
use crate::impact::tolerances::PAPER_NOISE;
use crate::model::parameters::System;
use crate::numerics::EPS;

/// The literal law; the stored regime is the paper's own case.
pub(super) fn resolve(system: &System, pre: &PreImpact) -> Result<Impact, ImpactFailure> {
    let &PreImpact { cos: c, sin, v1: th, v2: x } = pre;
    let &System { mass_ratio: m, friction, .. } = system;
    let u = pre.approach_velocity();
    let r = system.restitution_at(u);
    let sign = if th == 0.0 { 0.0 } else { th.signum() };
    let (plus, minus) = (c + friction * sign * sin, c - friction * sign * sin);
    let b2 = m + c * plus; // (17a)
    let p_f = u / b2; // (9)
    let p_star = th / plus; // (10)

    let (regime, v1, v2, approach) = if friction == 0.0 {
        // (19), (20)
        let q = m + c * c;
        let v1 = ((m - r * c * c) * th + (1.0 + r) * c * x) / q;
        let v2 = ((1.0 + r) * m * c * th + (c * c - r * m) * x) / q;
        (Regime::Frictionless, v1, v2, u / q)
    } else if p_star < p_f {
        // (14), (15): reversal in approach
        let mu_sin2 = (friction * sin).powi(2);
        let a = mu_sin2 * c - c.powi(3) - m * plus;
        let v1 = -minus / a * (m * th - r * th * c * minus + (1.0 + r) * x * plus);
        let v2 =
            -(x * c * (c * c - mu_sin2) + (1.0 + r) * m * th * c * minus - r * m * x * plus) / a;
        let approach = p_star - (x + m * p_star) / (m + minus * c);
        (Regime::ReversalInApproach { switch: p_star }, v1, v2, approach)
    } else if p_star < (1.0 + r) * p_f {
        // (16), (17): reversal in restitution
        let b1 = b2 * plus;
        let v1 = minus / b1 * (m * th - plus * (r * th * c - (1.0 + r) * x));
        let v2 = (x * c * plus + (1.0 + r) * m * th * c - r * m * x) / b2;
        (Regime::ReversalInRestitution { switch: p_star }, v1, v2, p_f)
    } else {
        // (18): slip keeps its direction
        let v1 = (m * th + plus * ((1.0 + r) * x - r * th * c)) / b2;
        let v2 = ((1.0 + r) * m * th * c + x * c * plus - r * m * x) / b2;
        (Regime::Slip { direction: sign }, v1, v2, p_f)
    };

    let impulse = (1.0 + r) * approach;
    // Moment balance of body 1: v1 - th = -cos P + sin T.
    let tangential = match regime {
        Regime::Frictionless => 0.0,
        _ if sin == 0.0 => 0.0,
        _ => (v1 - th + c * impulse) / sin,
    };
    // Work of the tangential impulse at the mean slip velocity of the tip, x1' sin x1.
    let friction_loss =
        if tangential == 0.0 { 0.0 } else { -0.5 * (v1 - th + c * impulse) * (th + v1) };
    // Work of the impulses on both bodies at the mean velocities.
    let loss = 0.5 * (th * th - v1 * v1) - 0.5 * impulse * (x + v2);
    let separation = v1 * c - v2;
    // With r = 0 it is zero to rounding, of either sign.
    let rounding = || PAPER_NOISE * EPS * ((v1 * c).abs() + v2.abs() + (th * c).abs() + x.abs());
    let fails = separation > 0.0 && separation > rounding();
    if !(v1.is_finite() && v2.is_finite() && tangential.is_finite()) || fails {
        return Err(ImpactFailure::LawFailed);
    }
    Ok(Impact {
        regime,
        v1_post: v1,
        v2_post: v2,
        approach_velocity: u,
        separation_velocity: separation.min(0.0),
        impulse_approach: approach,
        impulse_normal: impulse,
        impulse_tangential: tangential,
        energy_loss: loss,
        friction_loss,
    })
}
