//! The walk along the impulse in closed form: at most three straight segments.

use super::laws::{Bend, Restitution};
use super::regime::{Regime, slip_constant};
use super::{Impact, PreImpact};
use crate::double_double::DoubleDouble;

/// Work and impulses summed along the walk.
struct Walk {
    v1: f64,
    v2: f64,
    u: f64,
    impulse: f64,
    tangential: f64,
    loss: f64,
    friction: f64,
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

fn quotient(numerator: DoubleDouble, denominator: DoubleDouble) -> Impulse {
    let rounded = numerator.hi / denominator.hi;
    let rest = (-rounded).mul_add(denominator.hi, numerator.hi)
        + (numerator.lo - rounded * denominator.lo);
    (rounded, rest / denominator.hi)
}

/// The impact in a given regime: approach to u = 0 at P_I, restitution to where the law ends it.
/// Each law is compiled on its own, so that none pays for another.
pub(super) fn walk<L: Restitution>(
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
        friction: 0.0,
    };
    let mut step = |segment: &Segment, (impulse, rest): Impulse, stops: bool| {
        let changed = |v: f64, k: f64| {
            // Rounded once: twice is a bias.
            let sum = DoubleDouble::product(k, impulse) + DoubleDouble::new(v);
            sum.hi + k.mul_add(rest, sum.lo)
        };
        let v1 = if stops { 0.0 } else { changed(state.v1, -segment.k) };
        let v2 = changed(state.v2, mass_ratio);
        let u = v1 * pre.cos - v2;
        // Straight segments: the trapezoidal rule is exact. u dP is what restitution takes in
        // approach and gives back after, mu |sin x1| |x1'| dP the work of friction.
        let rubbed = segment.friction * (state.v1.abs() + v1.abs());
        state.loss += 0.5 * impulse * ((state.u + u) + rubbed);
        state.friction += 0.5 * impulse * rubbed;
        state.tangential += segment.tangential * impulse;
        state.impulse += impulse;
        (state.v1, state.v2, state.u) = (v1, v2, u);
    };
    let slows = |segment: &Segment| segment.k.mul_add(pre.cos, mass_ratio);
    let u = pre.approach_velocity();

    let (switch, in_approach, sticks) = match regime {
        Regime::Frictionless | Regime::Slip { .. } => {
            // 1 + r and mbar + k cos x1 with what rounding leaves out of them: constant in direct
            // contact, it would drain energy from every impact alike.
            let slowing = DoubleDouble::product(first.k, pre.cos) + DoubleDouble::new(mass_ratio);
            let approach = DoubleDouble::product(pre.v1, pre.cos) - DoubleDouble::new(pre.v2);
            let whole = DoubleDouble::sum(1.0, restitution) * approach;
            step(&first, quotient(whole, slowing), false);
            // All laws end here and none gains energy. -r u is exact; the difference of the
            // velocities has rounding.
            state.loss = state.loss.max(0.0);
            return state.outcome::<L>(regime, u, -restitution * u, approach.hi / slowing.hi);
        }
        Regime::ReversalInApproach { switch } => (switch, true, false),
        Regime::StickInApproach { switch } => (switch, true, true),
        Regime::ReversalInRestitution { switch } => (switch, false, false),
        Regime::StickInRestitution { switch } => (switch, false, true),
    };
    step(&first, (switch, 0.0), true);
    let second = after(sticks);
    let (slows_before, slows_after) = (slows(&first), slows(&second));
    // x1' = 0 at P*: u = -x2' there.
    let impulse_approach = match (in_approach, sticks) {
        (false, _) => u / slows_before,
        (true, false) => switch - (pre.v2 + mass_ratio * switch) / slows_after,
        // The approach ends at x2' = 0. A resting wall is there at once.
        (true, true) if mass_ratio > 0.0 => (-pre.v2 / mass_ratio).max(switch),
        (true, true) => switch,
    };
    let end = L::end(&Bend {
        restitution,
        approach_velocity: u,
        v2: pre.v2,
        switch,
        impulse_approach,
        u: -mass_ratio.mul_add(switch, pre.v2),
        slows_before,
        slows_after,
        in_approach,
        sticks_on_mass: sticks && mass_ratio > 0.0,
    });
    step(&second, (end.impulse, 0.0), sticks);
    if let (true, Some(separation)) = (sticks, end.separation) {
        // u = -x2' in stick: exact too, also where r = 0 ends in rest.
        state.v2 = -separation;
    }
    let separation = end.separation.unwrap_or(match regime {
        Regime::StickInApproach { .. } => -state.v2,
        _ => state.u.min(0.0),
    });
    state.outcome::<L>(regime, u, separation, impulse_approach)
}

impl Walk {
    fn outcome<L: Restitution>(
        self,
        regime: Regime,
        approach_velocity: f64,
        separation_velocity: f64,
        impulse_approach: f64,
    ) -> Impact {
        Impact {
            regime,
            v1_post: self.v1,
            v2_post: self.v2,
            approach_velocity,
            separation_velocity,
            impulse_approach,
            impulse_normal: self.impulse,
            impulse_tangential: self.tangential,
            // A law that cannot gain energy has a loss below zero by rounding only.
            energy_loss: if L::CAN_GAIN { self.loss } else { self.loss.max(0.0) },
            friction_loss: self.friction,
        }
    }
}
