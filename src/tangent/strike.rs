//! An impact in a given regime, with its derivatives, and the functions that change sign where the
//! regime ends. The formulas are those of the walk along the impulse (docs/theory.md, section 4),
//! with the signs of x1' and sin x1 held fixed: k = cos x1 + mu s sgn(sin x1) sin x1.

use super::{Dual, DualState, Model};
use crate::impact::RegimeKind;
use crate::model::angle::Angle;
use crate::model::parameters::ImpactLaw;
use crate::numerics::dual::Number;
use crate::tangent::itinerary::Signs;

/// A condition of the regime: positive inside.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Border {
    /// What vanishes at the border.
    pub name: &'static str,
    pub value: f64,
}

/// An impact.
#[derive(Debug)]
pub(crate) struct Struck {
    /// State after.
    pub post: DualState,
    /// u before.
    pub approach_velocity: Dual,
    pub borders: Vec<Border>,
}

/// The impact from `pre` in this regime.
pub(crate) fn strike(
    model: &Model,
    pre: &DualState,
    kind: RegimeKind,
    Signs { direction, side }: Signs,
) -> Struck {
    let p = &model.parameters;
    let Angle { sin, cos } = model.angle(pre.x1);
    let rubs = kind != RegimeKind::Frictionless;
    let friction = if rubs { p.friction * (direction * side) * sin } else { Dual::constant(0.0) };
    let k = cos + friction;
    let u = pre.v1 * cos - pre.v2;
    let slows = p.mass_ratio + k * cos;
    let one_and_r = p.restitution + Dual::constant(1.0);
    let in_approach = matches!(kind, RegimeKind::ReversalInApproach | RegimeKind::StickInApproach);
    let sticks = matches!(kind, RegimeKind::StickInApproach | RegimeKind::StickInRestitution);
    let mut borders = Vec::new();
    let mut border = |name, value: Dual| borders.push(Border { name, value: value.value });
    let literal = model.system.law == ImpactLaw::Paper;
    if rubs && !literal {
        border("sin x1 = 0", sin * side);
        border("x1' = 0 before", pre.v1 * direction);
    }
    let (v1, v2) = if matches!(kind, RegimeKind::Frictionless | RegimeKind::Slip) {
        let impulse = one_and_r * u / slows;
        let v1 = pre.v1 - k * impulse;
        if rubs && !literal {
            border("P* = (1 + r) P_f", v1 * direction);
        }
        (v1, pre.v2 + p.mass_ratio * impulse)
    } else {
        // x1' = 0 at P*.
        let switch = pre.v1 / k;
        let v2 = pre.v2 + p.mass_ratio * switch;
        let u_switch = -v2;
        let k_after = if sticks { Dual::constant(0.0) } else { cos - friction };
        let slows_after = p.mass_ratio + k_after * cos;
        let approach = if in_approach { switch + u_switch / slows_after } else { u / slows };
        let r = p.restitution;
        let remaining = if slows_after.value == 0.0 {
            // A resting wall: no further impulse changes a velocity.
            Dual::constant(0.0)
        } else {
            match model.system.law {
                ImpactLaw::Poisson | ImpactLaw::Paper => one_and_r * approach - switch,
                ImpactLaw::Newton => (r * u + u_switch) / slows_after,
                ImpactLaw::Energetic => {
                    let square = u_switch * u_switch;
                    // r stands before the root: it may be 0.
                    let speed = if in_approach {
                        r * (square + slows_after * switch * (u + u_switch)).sqrt()
                    } else {
                        (square + slows_after / slows * (r * r * u * u - square)).sqrt()
                    };
                    (speed + u_switch) / slows_after
                }
            }
        };
        if !literal {
            if !model.wall_at_rest {
                // Against a wall at rest both are equal by an identity.
                border("P* = P_f", u_switch * if in_approach { 1.0 } else { -1.0 });
            }
            if !in_approach {
                border("P* = (1 + r) P_f", remaining);
            }
            let grips = p.friction * side * sin - cos * 1f64.copysign(cos.value);
            border("|cos x1| = mu |sin x1|", if sticks { grips } else { -grips });
        }
        (-k_after * remaining, v2 + p.mass_ratio * remaining)
    };
    Struck { post: DualState { v1, v2, ..*pre }, approach_velocity: u, borders }
}
