//! One leg of a motion with its derivatives: which formulas belong to which kind of leg. Shooting
//! (shooting.rs) and Lyapunov exponents (lyapunov.rs) build on it.

use nalgebra::Matrix4;

use super::border::BorderValue;
use super::contact::StickCondition;
use super::impact::RegimeImpact;
use super::{
    Accumulation, Dual, DualState, END, Model, Moment, accumulate, fly, free_gap_acceleration,
    impact_in_regime, slide, stick_condition,
};
use crate::contact::sustained::ContactMode;
use crate::model::state::State;
use crate::numerics::dual::Number;
use crate::tangent::itinerary::Leg;

/// The end of a leg, with derivatives.
pub(crate) struct LegOutcome {
    /// x1, x1', x2' after the event at its end.
    pub image: [Dual; 3],
    /// Zero where the event is at the end time; of a circuit, which has none, x2.
    pub condition: Dual,
    /// State just before that event.
    pub pre: State,
    pub details: LegDetails,
}

/// Results that depend on the kind of leg.
pub(crate) enum LegDetails {
    Impact(RegimeImpact),
    /// Least values of the borders of the bounces' regimes.
    Chatter(Vec<BorderValue>),
    /// State at the end, and the free gap acceleration there, which the contact force takes away.
    Slide(DualState, Dual),
    Stick(StickCondition),
    Circuit,
}

/// Follows a leg from `start` at `from` to its end at `end`; `None` where it cannot be followed.
pub(crate) fn traverse(
    model: &Model,
    leg: Leg,
    start: &DualState,
    from: &Moment,
    end: &Moment,
) -> Option<LegOutcome> {
    let s = model.elapsed(from, end);
    let stop = Dual::constant(0.0);
    Some(match leg {
        Leg::Impact(regime, signs) => {
            let pre = fly(model, start, from, s);
            let impact = impact_in_regime(model, &pre, regime, signs);
            let DualState { x1, v1, v2, .. } = impact.post;
            LegOutcome {
                image: [x1, v1, v2],
                condition: model.gap(&pre),
                pre: pre.value(),
                details: LegDetails::Impact(impact),
            }
        }
        Leg::Chatter => {
            let Accumulation { state, moment, borders } = accumulate(model, start, from)?;
            LegOutcome {
                image: [state.x1, state.v1, state.v2],
                condition: model.elapsed(end, &moment),
                pre: state.value(),
                details: LegDetails::Chatter(borders),
            }
        }
        Leg::SlideToRelease(positive) | Leg::SlideToStop(positive) => {
            let stops = matches!(leg, Leg::SlideToStop(_));
            let Slid { state, force, image, condition } =
                slide_to_end(model, (start, from), end, (positive, stops))?;
            let details = LegDetails::Slide(state, force);
            LegOutcome { image, condition, pre: state.value(), details }
        }
        Leg::Stick(how) => {
            let condition = stick_condition(model, start, (from, end), how);
            LegOutcome {
                image: [start.x1, stop, stop],
                condition: condition.ends,
                pre: start.value(),
                details: LegDetails::Stick(condition),
            }
        }
        Leg::Circuit => {
            let state = fly(model, start, from, s);
            LegOutcome {
                image: [state.x1, state.v1, state.v2],
                condition: state.x2,
                pre: state.value(),
                details: LegDetails::Circuit,
            }
        }
    })
}

/// The end of a slide.
struct Slid {
    /// Just before the event, with the free gap acceleration, which the contact force takes away.
    state: DualState,
    force: Dual,
    /// As of any leg.
    image: [Dual; 3],
    condition: Dual,
}

/// Follows a slide, which stops at `end` or is released there; `None` where it cannot be followed.
fn slide_to_end(
    model: &Model,
    (start, from): (&DualState, &Moment),
    end: &Moment,
    (positive, stops): (bool, bool),
) -> Option<Slid> {
    let state = slide(model, start, mode(positive), from, model.elapsed(from, end))?;
    let force = free_gap_acceleration(model, &state, end);
    let stop = Dual::constant(0.0);
    let ([v1, v2], condition) =
        if stops { ([stop, stop], state.v1) } else { ([state.v1, state.v2], force) };
    Some(Slid { state, force, image: [state.x1, v1, v2], condition })
}

/// The contact mode of a slide.
pub(crate) fn mode(positive: bool) -> ContactMode {
    if positive { ContactMode::SlidePositive } else { ContactMode::SlideNegative }
}

/// Derivative of the node at the end of a leg with respect to its start. The event stays on its
/// condition: dt' = -(dh . dy)/h'.
pub(crate) fn to_event(image: &[Dual; 3], condition: &Dual) -> Matrix4<f64> {
    let time: [f64; 4] = std::array::from_fn(|c| -condition.slope[c] / condition.slope[END]);
    Matrix4::from_fn(|r, c| match r {
        3 => time[c],
        _ => image[r].slope[c] + image[r].slope[END] * time[c],
    })
}
