//! Derivatives of contact phases: slides by their Taylor series, sticks in closed form
//! (docs/theory.md, section 5).

use super::{Dual, DualState, Model, Moment};
use crate::dual::Number;
use crate::hold::{ContactMode, SlideEnd, SlideStep};
use crate::itinerary::StickEnd;
use crate::params::Contact;

/// Most steps of one slide.
const STEPS: usize = 10_000;

/// A slide in `mode` from `state`, for a time `s`: the state there. `watch` sees every step, as its
/// start, the free gap acceleration and x1' as functions of the local time, and its length.
pub(crate) fn slide(
    model: &Model,
    state: &DualState,
    mode: ContactMode,
    moment: &Moment,
    s: Dual,
) -> Option<DualState> {
    let contact = model.system.contact;
    let (mut x1, mut v1, mut at, mut left) = (state.x1, state.v1, *moment, s);
    for _ in 0..STEPS {
        let values = model.system.on_contact(x1.value, v1.value);
        let step =
            SlideStep::new(&model.system, model.motion.drive.trig_at(at.clock()), &values, mode);
        let series = step.with_derivatives(&model.parameters, contact, model.load(&at), x1, v1);
        // The friction's side changes at sin x1 = 0, where friction vanishes: no jump in the
        // equation, none in the derivatives.
        let length = match step.end() {
            (time, SlideEnd::Side) => time,
            _ => step.length(),
        };
        if left.value <= length {
            let (x1, v1) = series.at(left);
            return Some(on_contact(model, x1, v1));
        }
        let length = Dual::constant(length);
        (x1, v1) = series.at(length);
        at = at.later(length);
        left = left - length;
    }
    None
}

/// The state on the contact with this x1 and x1'.
pub(crate) fn on_contact(model: &Model, x1: Dual, v1: Dual) -> DualState {
    let (_, cos) = model.tip_angle(x1);
    let v2 = if model.wall_at_rest { Dual::constant(0.0) } else { v1 * cos };
    DualState { x1, v1, x2: model.contact_place(x1), v2 }
}

/// g'' of the free motion, which a contact force has to take away.
pub(crate) fn free_gap_acceleration(model: &Model, state: &DualState, moment: &Moment) -> Dual {
    let (a1, a2) = model.free_accelerations(state, moment);
    let a2 = if model.wall_at_rest { Dual::constant(0.0) } else { a2 };
    match model.system.contact {
        Contact::Oblique => {
            let (sin, cos) = state.x1.sin_cos();
            a1 * cos - state.v1 * state.v1 * sin - a2
        }
        Contact::Direct => a1 - a2,
    }
}

/// Conditions of a stick: all positive while it lasts; the one that ends it, and the others.
pub(crate) struct StickCondition {
    pub ends: Dual,
    pub others: Vec<(&'static str, f64)>,
}

/// The conditions of a stick at an instant.
pub(crate) fn stick_condition(
    model: &Model,
    state: &DualState,
    moment: &Moment,
    end: StickEnd,
) -> StickCondition {
    let p = &model.parameters;
    let (sin, cos) = model.tip_angle(state.x1);
    let (a1, a2) = model.free_accelerations(state, moment);
    if model.system.mass_ratio() == 0.0 {
        // A wall at rest: p = a1/cos x1.
        return StickCondition { ends: a1 * cos, others: Vec::new() };
    }
    let side = 1f64.copysign(sin.value);
    // s (mbar a1 + a2 k) < 0 holds the tip against slip in direction s.
    let held = |direction: f64| {
        let k = cos + p.friction * (direction * side) * sin;
        (p.mass_ratio * a1 + a2 * k) * -direction
    };
    let limits = [
        (StickEnd::SlipPositive, "slip+", held(1.0)),
        (StickEnd::SlipNegative, "slip-", held(-1.0)),
        (StickEnd::Release, "release", -a2),
    ];
    let ends = limits.iter().find(|limit| limit.0 == end).map_or(-a2, |limit| limit.2);
    let others = limits.iter().filter(|l| l.0 != end).map(|l| (l.1, l.2.value)).collect();
    StickCondition { ends, others }
}
