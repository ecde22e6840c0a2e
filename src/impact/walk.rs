//! The walk along the impulse in closed form: at most three straight segments.

#![allow(clippy::inline_always)] // a flight with its impact is compiled for several instruction sets

use super::laws::{Bend, Restitution};
use super::regime::{Regime, slip_constant};
use super::{Impact, PreImpact};
use crate::numerics::double_double::DoubleDouble;

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
pub(crate) struct Segment {
    k: f64,
    tangential: f64,
    friction: f64,
}

/// An impulse and what rounding left out of it: a rounded impulse would cost the velocities one
/// unit of *its* last place.
type Impulse = (f64, f64);

#[inline(always)]
fn quotient(numerator: DoubleDouble, denominator: DoubleDouble) -> Impulse {
    let rounded = numerator.hi / denominator.hi;
    let rest = (-rounded).mul_add(denominator.hi, numerator.hi)
        + (numerator.lo - rounded * denominator.lo);
    (rounded, rest / denominator.hi)
}

impl Walk {
    #[inline(always)]
    fn new(pre: &PreImpact) -> Self {
        let u = pre.approach_velocity();
        let (v1, v2) = (pre.v1, pre.v2);
        Self { v1, v2, u, impulse: 0.0, tangential: 0.0, loss: 0.0, friction: 0.0 }
    }

    /// One segment; `stops`: up to x1' = 0.
    #[inline(always)]
    fn step(
        &mut self,
        pre: &PreImpact,
        mass_ratio: f64,
        segment: &Segment,
        (impulse, rest): Impulse,
        stops: bool,
    ) {
        let changed = |v: f64, k: f64| {
            // Rounded once: twice is a bias.
            let sum = DoubleDouble::product_sum(k, impulse, v);
            sum.hi + k.mul_add(rest, sum.lo)
        };
        let v1 = if stops { 0.0 } else { changed(self.v1, -segment.k) };
        let v2 = changed(self.v2, mass_ratio);
        let u = v1 * pre.cos - v2;
        // Straight segments: the trapezoidal rule is exact. u dP is what restitution takes in
        // approach and gives back after, mu |sin x1| |x1'| dP the work of friction.
        let rubbed = segment.friction * (self.v1.abs() + v1.abs());
        self.loss += 0.5 * impulse * ((self.u + u) + rubbed);
        self.friction += 0.5 * impulse * rubbed;
        self.tangential += segment.tangential * impulse;
        self.impulse += impulse;
        (self.v1, self.v2, self.u) = (v1, v2, u);
    }
}

/// Slip in one direction; without friction, all the same for both.
#[inline(always)]
pub(crate) fn slip(pre: &PreImpact, friction: f64, direction: f64) -> Segment {
    Segment {
        k: slip_constant(pre, friction, direction),
        tangential: -(friction.copysign(direction)) * pre.sin.signum(),
        friction: friction * pre.sin.abs(),
    }
}

/// The impact whose slip keeps its direction, or that has no friction: where all laws agree, and none
/// gains energy.
#[inline(always)]
pub(crate) fn straight(
    pre: &PreImpact,
    mass_ratio: f64,
    restitution: f64,
    segment: &Segment,
    regime: Regime,
) -> Impact {
    let u = pre.approach_velocity();
    // 1 + r and mbar + k cos x1 with what rounding leaves out of them: constant in direct
    // contact, it would drain energy from every impact alike.
    let slowing = DoubleDouble::product_sum(segment.k, pre.cos, mass_ratio);
    let approach = DoubleDouble::product_sum(pre.v1, pre.cos, -pre.v2);
    let whole = DoubleDouble::sum(1.0, restitution) * approach;
    let mut walk = Walk::new(pre);
    walk.step(pre, mass_ratio, segment, quotient(whole, slowing), false);
    walk.loss = walk.loss.max(0.0);
    // -r u is exact; the difference of the velocities has rounding.
    walk.outcome(regime, u, -restitution * u, approach.hi / slowing.hi)
}

/// The impact whose slip ends: approach to u = 0 at P_I, restitution to where the law ends it.
/// Each law is compiled on its own, so that none pays for another.
pub(super) fn bent<L: Restitution>(
    pre: &PreImpact,
    mass_ratio: f64,
    restitution: f64,
    friction: f64,
    regime: Regime,
    (switch, in_approach, sticks): (f64, bool, bool),
) -> Impact {
    let first = slip(pre, friction, pre.v1);
    let second = if sticks {
        Segment { k: 0.0, tangential: pre.cos / pre.sin, friction: 0.0 }
    } else {
        slip(pre, friction, -pre.cos)
    };
    let slows = |segment: &Segment| segment.k.mul_add(pre.cos, mass_ratio);
    let u = pre.approach_velocity();
    let mut state = Walk::new(pre);
    state.step(pre, mass_ratio, &first, (switch, 0.0), true);
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
    state.step(pre, mass_ratio, &second, (end.impulse, 0.0), sticks);
    if let (true, Some(separation)) = (sticks, end.separation) {
        // u = -x2' in stick: exact too, also where r = 0 ends in rest.
        state.v2 = -separation;
    }
    let separation = end.separation.unwrap_or(match regime {
        Regime::StickInApproach { .. } => -state.v2,
        _ => state.u.min(0.0),
    });
    // A law that cannot gain energy has a loss below zero by rounding only.
    state.loss = if L::CAN_GAIN { state.loss } else { state.loss.max(0.0) };
    state.outcome(regime, u, separation, impulse_approach)
}

impl Walk {
    #[inline(always)]
    fn outcome(
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
            energy_loss: self.loss,
            friction_loss: self.friction,
        }
    }
}
