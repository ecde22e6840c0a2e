//! The walk along the impulse in closed form: at most three straight segments.

use super::regime::{Regime, slip_constant};
use super::{Impact, PreImpact};

/// Work and impulses summed along the walk.
struct Walk {
    v1: f64,
    v2: f64,
    u: f64,
    impulse: f64,
    tangential: f64,
    loss: f64,
}

/// One law of motion along the impulse: dx1' = -k dP, d(tangential) = t dP,
/// friction work mu |sin x1| |x1'| dP.
struct Segment {
    k: f64,
    tangential: f64,
    friction: f64,
}

/// An impulse and what rounding left out of it: a rounded impulse would cost the velocities one
/// unit of *its* last place.
type Impulse = (f64, f64);

fn quotient(numerator: f64, denominator: f64) -> Impulse {
    let rounded = numerator / denominator;
    (rounded, (-rounded).mul_add(denominator, numerator) / denominator)
}

/// Poisson's law in a given regime: approach to u = 0 at P_I, restitution to (1 + r) P_I.
pub(super) fn walk(
    pre: &PreImpact,
    mass_ratio: f64,
    restitution: f64,
    friction: f64,
    regime: Regime,
) -> Impact {
    let slope = friction * pre.sin.abs();
    let slip = |direction: f64| Segment {
        k: slip_constant(pre, friction, direction),
        tangential: -(friction.copysign(direction)) * pre.sin.signum(),
        friction: slope,
    };
    let first = match regime {
        Regime::Frictionless => Segment { k: pre.cos, tangential: 0.0, friction: 0.0 },
        Regime::Slip { direction } => slip(direction),
        _ => slip(pre.v1),
    };
    let after = |sticks: bool| {
        if sticks {
            Segment { k: 0.0, tangential: pre.cos / pre.sin, friction: 0.0 }
        } else {
            slip(-pre.cos)
        }
    };
    let mut state = Walk {
        v1: pre.v1,
        v2: pre.v2,
        u: pre.approach_velocity(),
        impulse: 0.0,
        tangential: 0.0,
        loss: 0.0,
    };
    let mut step = |segment: &Segment, (impulse, rest): Impulse, stops: bool| {
        let v1 = if stops { 0.0 } else { segment.k.mul_add(-impulse, state.v1) - segment.k * rest };
        let v2 = mass_ratio.mul_add(impulse, state.v2) + mass_ratio * rest;
        let u = v1 * pre.cos - v2;
        // Straight segments: the trapezoidal rule is exact. u dP is what restitution takes in
        // approach and gives back after, mu |sin x1| |x1'| dP the work of friction.
        state.loss +=
            0.5 * impulse * ((state.u + u) + segment.friction * (state.v1.abs() + v1.abs()));
        state.tangential += segment.tangential * impulse;
        state.impulse += impulse;
        (state.v1, state.v2, state.u) = (v1, v2, u);
    };
    let slows = |segment: &Segment| segment.k.mul_add(pre.cos, mass_ratio);
    let u = pre.approach_velocity();

    let impulse_approach = match regime {
        Regime::Frictionless | Regime::Slip { .. } => {
            let slowing = slows(&first);
            let total = quotient((1.0 + restitution) * u, slowing);
            step(&first, total, false);
            u / slowing
        }
        Regime::ReversalInRestitution { switch } | Regime::StickInRestitution { switch } => {
            let approach = u / slows(&first);
            let sticks = matches!(regime, Regime::StickInRestitution { .. });
            step(&first, (switch, 0.0), true);
            step(&after(sticks), (((1.0 + restitution) * approach - switch).max(0.0), 0.0), sticks);
            approach
        }
        Regime::ReversalInApproach { switch } => {
            step(&first, (switch, 0.0), true);
            let second = after(false);
            // x1' = 0: u = -x2'.
            let approach = switch - (pre.v2 + mass_ratio * switch) / slows(&second);
            step(&second, ((1.0 + restitution) * approach - switch, 0.0), false);
            approach
        }
        Regime::StickInApproach { switch } => {
            step(&first, (switch, 0.0), true);
            // Stick: the approach ends at x2' = 0. A resting wall is there at once.
            let rest = if mass_ratio > 0.0 { -pre.v2 / mass_ratio } else { switch };
            let approach = rest.max(switch);
            step(&after(true), ((1.0 + restitution) * approach - switch, 0.0), true);
            approach
        }
    };
    let v2_post = match regime {
        // Exact too, also where r = 0 ends in rest.
        Regime::StickInApproach { .. } if mass_ratio > 0.0 => -restitution * pre.v2,
        _ => state.v2,
    };
    let separation = match regime {
        // Exact identity; the difference of the velocities has their rounding.
        Regime::Frictionless | Regime::Slip { .. } => -restitution * u,
        Regime::StickInApproach { .. } => -v2_post,
        _ => state.u.min(0.0),
    };
    Impact {
        regime,
        v1_post: state.v1,
        v2_post,
        approach_velocity: u,
        separation_velocity: separation,
        impulse_approach,
        impulse_normal: state.impulse,
        impulse_tangential: state.tangential,
        energy_loss: state.loss.max(0.0),
    }
}
