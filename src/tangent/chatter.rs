//! Derivatives of complete chatter.
//!
//! Time and state just after the impacts of one sequence are smooth functions of the separation
//! velocity u. The impacts are followed one by one, with their derivatives, and extrapolated to
//! u = 0 by the same polynomials for numbers that carry derivatives: the derivative of the
//! extrapolated value, which converges as the value does.

use super::border::{BorderValue, note_least};
use super::contact::on_contact;
use super::{Dual, DualState, Model, Moment, fly, free_gap_acceleration, impact_in_regime};
use crate::contact::tolerances::CHATTER_SPACING;
use crate::flight::{Found, next_contact};
use crate::impact::{PreImpact, RegimeKind, resolve};
use crate::model::state::{Clock, State};
use crate::numerics::EPS;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::dual::Number;
use crate::numerics::extrapolation::at_zero;
use crate::search::Start;
use crate::tangent::itinerary::Signs;
use crate::tangent::tolerances::{
    CONVERGED, LOWEST_REVERSING, MOST_BOUNCES, MOST_EXTRAPOLATED, MOST_HOP_FLIGHTS,
};

/// u, and differences from the first sample of time, x1 and x1' just after an impact.
type Sample = (Dual, [Dual; 3]);

/// Where a chatter sequence ends.
pub(crate) struct Accumulation {
    pub state: DualState,
    pub moment: Moment,
    /// The least value of each border of the regime over all impacts.
    pub borders: Vec<BorderValue>,
}

/// The accumulation point of the chatter that follows the state just after an impact; `None` if
/// there is none.
pub(crate) fn accumulate(
    model: &Model,
    start: &DualState,
    moment: &Moment,
) -> Option<Accumulation> {
    let (mut state, mut passed) = (*start, Dual::constant(0.0));
    let mut samples: Vec<Sample> = Vec::new();
    let mut best: Option<(f64, [Dual; 3])> = None;
    let mut borders: Vec<BorderValue> = Vec::new();
    let mut regime = None;
    let (mut stops, mut reverses, mut ratio) = (false, false, 1.0);
    for _ in 0..MOST_BOUNCES {
        let u = -model.approach_velocity(&state);
        if u.value <= 0.0 || (reverses && u.value <= LOWEST_REVERSING) {
            break;
        }
        if !reverses
            && samples.last().is_none_or(|(last, _)| u.value <= CHATTER_SPACING * last.value)
        {
            samples.push((u, [passed, state.x1 - start.x1, state.v1 - start.v1]));
            let newest = &samples[samples.len().saturating_sub(MOST_EXTRAPOLATED)..];
            if newest.len() >= 4 {
                let (nodes, values): (Vec<_>, Vec<_>) = newest.iter().rev().copied().unzip();
                let through = |count: usize| at_zero(&nodes[..count], values.clone());
                let (limit, lower) = (through(nodes.len()), through(nodes.len() - 1));
                let differences = limit.iter().zip(&lower).map(|(a, b)| (a.value - b.value).abs());
                let difference = differences.fold(0.0, f64::max);
                if best.is_none_or(|(least, _)| difference < least) {
                    best = Some((difference, limit));
                }
                if difference <= EPS || u.value <= LOWEST_REVERSING * LOWEST_REVERSING {
                    break;
                }
            }
        }
        // Flights at rounding level cannot be distinguished from contact.
        let Some(bounce) = bounce(model, &state, &moment.later(passed)) else { break };
        ratio = model.approach_velocity(&bounce.post).value / -u.value;
        (stops, reverses) = (bounce.stops, bounce.reverses);
        (state, passed) = (bounce.post, passed + bounce.time);
        if regime.replace(bounce.regime) != Some(bounce.regime) {
            // Only impacts in one regime, with one formula for r, are smooth functions of u.
            samples.clear();
            best = None;
        }
        for border in bounce.borders {
            note_least(&mut borders, border);
        }
    }
    let stop = Dual::constant(0.0);
    let (x1, v1, time) = if reverses {
        let now = moment.later(passed);
        let (u, pull) =
            (-model.approach_velocity(&state), free_gap_acceleration(model, &state, &now));
        if ratio >= 1.0 || pull.value <= 0.0 {
            return None;
        }
        let left = u * (2.0 / (1.0 - ratio)) / pull;
        (state.x1 + state.v1 * left, stop, passed + left)
    } else {
        let (_, [time, x1, v1]) = best.filter(|(difference, _)| *difference <= CONVERGED)?;
        // A tip that stops in each impact is at rest in the limit.
        (start.x1 + x1, if stops { stop } else { start.v1 + v1 }, time)
    };
    Some(Accumulation { state: on_contact(model, x1, v1), moment: moment.later(time), borders })
}

/// One flight and the impact at its end.
struct Bounce {
    post: DualState,
    time: Dual,
    /// Whether the tip stops in the impact, or reverses.
    stops: bool,
    reverses: bool,
    borders: Vec<BorderValue>,
    /// Regime and signs, and the piece of the restitution curve.
    regime: (RegimeKind, Signs, usize),
}

fn bounce(model: &Model, state: &DualState, moment: &Moment) -> Option<Bounce> {
    let system = &model.system;
    let (hop, approach) = next_touch(model, state.value(), moment.clock())?;
    let hop = Dual::constant(hop);
    let there = fly(model, state, moment, hop);
    // g = 0 at the end of the flight: the derivative of its time follows from that of g.
    let hop = Dual::chain(hop.value, [(-1.0 / approach, model.gap(&there))]);
    let pre = fly(model, state, moment, hop);
    let velocities = PreImpact::new(system.contact, &pre.value());
    let impact = resolve(system, &velocities).ok()?;
    let signs = Signs::of_regime(impact.regime, velocities.v1, velocities.sin);
    let kind = impact.regime.kind();
    let u = impact.approach_velocity;
    let impact = impact_in_regime(model, &pre, kind, signs);
    let post = DualState { x2: model.contact_place(pre.x1), ..impact.post };
    Some(Bounce {
        post,
        time: hop,
        stops: matches!(kind, RegimeKind::StickInApproach | RegimeKind::StickInRestitution),
        reverses: matches!(
            kind,
            RegimeKind::ReversalInApproach | RegimeKind::ReversalInRestitution
        ),
        borders: impact.borders,
        regime: (kind, signs, system.coefficient().piece(u)),
    })
}

/// Time to the next impact, and u there. The first flight of chatter may be long, and then takes
/// several local flights.
fn next_touch(model: &Model, mut state: State, mut clock: Clock) -> Option<(f64, f64)> {
    let motion = &model.motion;
    let (mut start, mut before) = (Start::Touching, 0.0);
    for _ in 0..MOST_HOP_FLIGHTS {
        let flight = motion.flight(clock, state);
        let found = next_contact(motion, &flight, start, motion.span).found;
        let passed = match found {
            Found::Contact(touch) => return Some((before + touch.local_time(), touch.gap.rate)),
            Found::Clear(time) => time,
            _ => return None,
        };
        state = motion.state_within(&flight, DoubleDouble::new(passed));
        clock = motion.drive.advance(clock, DoubleDouble::new(passed));
        start = Start::Apart;
        before += passed;
    }
    None
}
