//! An impact in a given regime, with its derivatives: the impulse path (impact/path.rs) with the signs of
//! x1' and sin x1 held fixed; and the functions that change sign where the regime ends.

use super::{Dual, DualState, Model};
use crate::impact::{RegimeKind, follow};
use crate::model::contact_coordinates::ContactCoordinates;
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
    let law = &model.system.law;
    let angle = model.tip_angle(pre.x1);
    let contact =
        ContactCoordinates::at_tip(angle, (pre.v1, pre.v2), p.mass_ratio, p.friction, side);
    let switch = contact.slip / contact.slip_rate(direction);
    let end = follow(&contact, (p.restitution, law), kind, direction, switch);
    let mut borders = Vec::new();
    let mut border = |name, value: Dual| borders.push(Border { name, value: value.value });
    if kind != RegimeKind::Frictionless && law.is_coulomb() {
        border("sin x1 = 0", contact.scale * side);
        border("x1' = 0 before", contact.slip * direction);
        if kind == RegimeKind::Slip {
            border("P* = (1 + r) P_f", end.slip * direction);
        } else {
            if !model.wall_at_rest {
                // Against a wall at rest both are equal by an identity.
                let parting = contact.parting + contact.mobility * switch;
                border("P* = P_f", if kind.switches_in_approach() { -parting } else { parting });
            }
            if !kind.switches_in_approach() {
                let whole = (Dual::constant(1.0) + p.restitution) * end.impulse_approach;
                border("P* = (1 + r) P_f", whole - switch);
            }
            let coupling = contact.coupling * 1f64.copysign(contact.coupling.value);
            let grips = contact.grip() - coupling;
            border("|cos x1| = mu |sin x1|", if kind.sticks() { grips } else { -grips });
        }
    }
    Struck {
        post: DualState { v1: end.slip, v2: end.parting, ..*pre },
        approach_velocity: end.approach_velocity,
        borders,
    }
}
