//! An impact in a given regime, with its derivatives: the impulse path (impact/path.rs) with the
//! signs of x1' and sin x1 held fixed; and the functions that change sign where the regime ends.

use smallvec::SmallVec;

use super::{Dual, DualState, Model};
use crate::impact::{PathEnd, RegimeKind, follow};
use crate::model::angle::Angle;
use crate::model::contact_coordinates::ContactCoordinates;
use crate::model::parameters::ImpactLaw;
use crate::numerics::dual::Number;
use crate::tangent::border::{Border, BorderValue};
use crate::tangent::itinerary::Signs;

/// An impact in a given regime.
#[derive(Debug)]
pub(crate) struct RegimeImpact {
    /// State after.
    pub post: DualState,
    /// u before.
    pub approach_velocity: Dual,
    /// What must be positive for this regime.
    pub borders: Vec<BorderValue>,
}

/// The impulse at which slip ends in a regime that is held fixed, 0 where it does not, and the end of
/// the impulse path.
#[inline(always)]
#[allow(clippy::inline_always)] // as `Strike::map`
pub(super) fn regime_path<T: Number>(
    contact: &ContactCoordinates<T>,
    law: (T, &ImpactLaw),
    kind: RegimeKind,
    direction: f64,
) -> (T, PathEnd<T>) {
    let switch = if kind.has_switch() {
        contact.slip / contact.slip_rate(direction)
    } else {
        T::constant(0.0)
    };
    (switch, follow(contact, law, kind, direction, switch))
}

/// What must be positive for a regime with friction, beside the side of the contact; `one_body`: the
/// contact leaves nothing but its slip to move, so that two borders are equal by an identity.
pub(super) fn regime_borders<T: Number>(
    contact: &ContactCoordinates<T>,
    restitution: T,
    (kind, direction): (RegimeKind, f64),
    (switch, end): (T, &PathEnd<T>),
    one_body: bool,
) -> SmallVec<[BorderValue; 4]> {
    let mut borders = SmallVec::new();
    let mut border = |border, value: T| borders.push(BorderValue { border, value: value.value() });
    border(Border::SlipBefore, contact.slip * direction);
    if kind == RegimeKind::Slip {
        border(Border::StopAtEndOfImpact, end.slip * direction);
        return borders;
    }
    if !one_body {
        let parting = contact.parting + contact.mobility * switch;
        let past = if kind.switches_in_approach() { -parting } else { parting };
        border(Border::StopAtEndOfApproach, past);
    }
    if !kind.switches_in_approach() {
        let whole = (T::constant(1.0) + restitution) * end.impulse_approach;
        border(Border::StopAtEndOfImpact, whole - switch);
    }
    let coupling = contact.coupling * 1f64.copysign(contact.coupling.value());
    let grips = contact.grip() - coupling;
    border(Border::FrictionCone, if kind.sticks() { grips } else { -grips });
    borders
}

/// The impact from `pre` in this regime.
pub(crate) fn impact_in_regime(
    model: &Model,
    pre: &DualState,
    kind: RegimeKind,
    signs: Signs,
) -> RegimeImpact {
    let (direction, side) = (signs.direction.value(), signs.side.value());
    let p = &model.parameters;
    let law = &model.system.law;
    let Angle { sin, cos } = model.angle(pre.x1);
    let contact =
        ContactCoordinates::at_tip((sin, cos), (pre.v1, pre.v2), p.mass_ratio, p.friction, side);
    let restitution = model.restitution(contact.approach_velocity());
    let (switch, end) = regime_path(&contact, (restitution, law), kind, direction);
    let borders = if kind != RegimeKind::Frictionless && law.is_coulomb() {
        let mut borders =
            vec![BorderValue { border: Border::SideOfImpact, value: contact.scale.value * side }];
        borders.extend(regime_borders(
            &contact,
            restitution,
            (kind, direction),
            (switch, &end),
            model.wall_at_rest,
        ));
        borders
    } else {
        Vec::new()
    };
    RegimeImpact {
        post: DualState { v1: end.slip, v2: end.parting, ..*pre },
        approach_velocity: end.approach_velocity,
        borders,
    }
}
