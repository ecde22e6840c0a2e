//! Derivatives of complete chatter.
//!
//! A bounce tells where its sequence ends to leading order, with an error O(u^2) in the separation
//! velocity u, and what it tells is a smooth function of u along the sequence: without a slope at u = 0.
//! So the impacts are followed one by one, with their derivatives, and what they tell is extrapolated to
//! u = 0 by polynomials for numbers that carry derivatives: the derivative of the extrapolated value,
//! which converges as the value does. At a small r few bounces are left, and they are enough.

use smallvec::SmallVec;

use super::border::{BorderValue, note_least};
use super::contact::{closed_contact, on_contact};
use super::{DIRECTIONS, Dual, DualState, Model, Moment, fly, impact_in_regime};
use crate::contact::tolerances::CHATTER_SPACING;
use crate::flight::{Found, next_contact};
use crate::impact::{PreImpact, RegimeKind, resolve};
use crate::model::state::{Clock, State};
use crate::numerics::EPS;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::dual::Number;
use crate::numerics::extrapolation::{level_weights, without_farthest};
use crate::search::Start;
use crate::tangent::itinerary::Signs;
use crate::tangent::tolerances::{
    CONVERGED, MOST_BOUNCES, MOST_EXTRAPOLATED, MOST_HOP_FLIGHTS, SAME_SLOPES,
};

/// Time, x1 and x1' at the end of a sequence.
pub(super) type End<const N: usize> = [Dual<N>; 3];

/// What a bounce tells of the end of its sequence: the time that is left until then, x1 and x1' there.
/// u is its separation velocity, which shrinks by this ratio; `slips`: as the impacts that follow do, if
/// the tip goes on in them. `None` where nothing pulls the bodies together.
pub(super) fn end_ahead<const N: usize>(
    model: &Model<N>,
    (state, moment): (&DualState<N>, &Moment<N>),
    (u, ratio): (Dual<N>, Dual<N>),
    slips: Option<Signs>,
) -> Option<End<N>> {
    let contact = closed_contact(model, state, moment, slips.map(|signs| signs.side.value()));
    let pull = contact.gap_acceleration;
    if ratio.value >= 1.0 || pull.value <= 0.0 {
        return None;
    }
    let left = u * 2.0 / ((Dual::constant(1.0) - ratio) * pull);
    let v1 = match slips {
        Some(signs) => contact.slip_after_bounces(signs.direction.value(), (u, ratio), left),
        None => Dual::constant(0.0),
    };
    Some([left, state.x1 + state.v1 * left, v1])
}

/// The end of a sequence, from what several of its bounces tell.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limit<E> {
    pub end: E,
    /// How much it differs from that of one bounce less, and its derivatives do, relative to 1 and their size.
    pub off: f64,
    pub slopes_off: f64,
}

impl<const N: usize> Limit<End<N>> {
    /// From u and what it tells of each bounce, the newest first; `noise`: rounding of the derivatives.
    pub fn new(nodes: &[Dual<N>], ends: &[End<N>], noise: f64) -> Self {
        let count = nodes.len();
        let weights: [_; MOST_EXTRAPOLATED] = level_weights(nodes);
        let weighted = |weights: [Dual<N>; MOST_EXTRAPOLATED], count: usize| {
            // In their sum small parts must not be rounded as the end is.
            let mut parts = [Dual::constant(0.0); 3];
            for (weight, other) in weights.iter().zip(ends).take(count).skip(1) {
                for ((sum, y), nearest) in parts.iter_mut().zip(other).zip(&ends[0]) {
                    *sum = *sum + *weight * (*y - *nearest);
                }
            }
            std::array::from_fn(|i| ends[0][i] + parts[i])
        };
        let end: End<N> = weighted(weights, count);
        if let [only] = nodes {
            // The order of what is left out, and of its derivatives.
            let u = only.value;
            return Self { end, off: u * u, slopes_off: u.max(noise) };
        }
        let (mut off, mut slopes_off) = (0.0f64, noise);
        let fewer: End<N> = weighted(without_farthest(nodes, weights), count - 1);
        for (a, b) in end.iter().zip(&fewer) {
            off = off.max((a.value - b.value).abs());
            for (a, b) in a.slope.iter().zip(&b.slope) {
                slopes_off = slopes_off.max((a - b).abs() / (1.0 + a.abs()));
            }
        }
        Self { end, off, slopes_off }
    }
}

impl<E> Limit<E> {
    /// Whether its derivatives are known as well as they can be.
    pub fn has_slopes(&self) -> bool {
        self.slopes_off <= SAME_SLOPES
    }

    /// Whether it is the end.
    pub fn has_converged(&self) -> bool {
        self.off <= CONVERGED
    }

    /// The better one of two; `None`: there is none yet.
    pub fn better(self, other: Option<Self>) -> Self {
        let order = |limit: &Self| (limit.off.max(EPS), limit.slopes_off);
        let better = |other: &Self| order(other) <= order(&self);
        other.filter(better).unwrap_or(self)
    }
}

/// What bounces of one sequence are alike in: regime and signs, and the piece of the restitution curve.
/// Only with one formula for each impact are they smooth functions of u.
pub(super) type Formula = (RegimeKind, Signs, usize);

/// How the tip goes on slipping in bounces with this formula; `None`: it stops in each.
pub(super) fn slips((kind, signs, _): Formula) -> Option<Signs> {
    matches!(kind, RegimeKind::Slip | RegimeKind::Frictionless).then_some(signs)
}

/// Whether slip reverses in each bounce: then x1' falls by another factor than u, and nothing is
/// extrapolated.
pub(super) fn reverses((kind, ..): Formula) -> bool {
    kind.reverses()
}

/// Where a chatter sequence ends.
pub(crate) struct Accumulation {
    pub state: DualState,
    pub moment: Moment,
    /// The least value of each border of the regime over all impacts.
    pub borders: Vec<BorderValue>,
}

/// The bounces of a sequence, as far as they are extrapolated, the newest first, and the best limit so far.
#[derive(Default)]
struct Sequence {
    formula: Option<Formula>,
    nodes: SmallVec<[Dual; MOST_EXTRAPOLATED + 1]>,
    ends: SmallVec<[End<DIRECTIONS>; MOST_EXTRAPOLATED + 1]>,
    best: Option<Limit<End<DIRECTIONS>>>,
}

impl Sequence {
    /// Begins anew where the formula is another one; whether it is.
    fn begins(&mut self, formula: Formula) -> bool {
        let other = self.formula != Some(formula);
        if other {
            *self = Self { formula: Some(formula), ..Self::default() };
        }
        other
    }

    /// Takes a bounce, with the rounding of its derivatives.
    fn take(
        &mut self,
        model: &Model,
        (state, passed, moment): (&DualState, Dual, &Moment),
        (u, ratio): (Dual, Dual),
        noise: f64,
    ) {
        let Some(formula) = self.formula else { return };
        let close = self.nodes.first().is_some_and(|last| u.value > CHATTER_SPACING * last.value);
        if close || u.value <= 0.0 {
            return;
        }
        let now = moment.later(passed);
        let Some([left, x1, v1]) = end_ahead(model, (state, &now), (u, ratio), slips(formula))
        else {
            return;
        };
        if reverses(formula) {
            self.nodes.clear();
            self.ends.clear();
        }
        self.nodes.insert(0, u);
        self.ends.insert(0, [passed + left, x1, v1]);
        self.nodes.truncate(MOST_EXTRAPOLATED);
        self.ends.truncate(MOST_EXTRAPOLATED);
        let limit = Limit::new(&self.nodes, &self.ends, noise);
        self.best = Some(limit.better(self.best));
    }
}

/// The accumulation point of the chatter that follows the state just after an impact; `None` if
/// there is none.
pub(crate) fn accumulate(
    model: &Model,
    start: &DualState,
    moment: &Moment,
) -> Option<Accumulation> {
    let (mut state, mut passed) = (*start, Dual::constant(0.0));
    let mut sequence = Sequence::default();
    let mut borders: Vec<BorderValue> = Vec::new();
    for _ in 0..MOST_BOUNCES {
        let u = -model.approach_velocity(&state);
        // Rounding of the derivatives after the next impact, for which a gap is divided by u.
        let noise = EPS / u.value;
        let known = |best: Limit<_>| best.off <= EPS && best.slopes_off < noise;
        if u.value <= 0.0 || sequence.best.is_some_and(known) {
            break;
        }
        // Flights at rounding level cannot be distinguished from contact.
        let Some(bounce) = bounce(model, &state, &moment.later(passed)) else { break };
        let separation = -model.approach_velocity(&bounce.post);
        let ratio = separation / bounce.approach_velocity;
        if sequence.begins(bounce.formula) {
            // The state before has led to the same bounces.
            sequence.take(model, (&state, passed, moment), (u, ratio), 0.0);
        }
        (state, passed) = (bounce.post, passed + bounce.time);
        sequence.take(model, (&state, passed, moment), (separation, ratio), noise);
        for border in bounce.borders {
            note_least(&mut borders, border);
        }
        if sequence.best.is_some_and(|best| best.off <= EPS && best.has_slopes()) {
            break;
        }
    }
    let [time, x1, v1] = sequence.best.filter(Limit::has_converged)?.end;
    Some(Accumulation { state: on_contact(model, x1, v1), moment: moment.later(time), borders })
}

/// One flight and the impact at its end.
struct Bounce {
    post: DualState,
    time: Dual,
    /// u before it.
    approach_velocity: Dual,
    borders: Vec<BorderValue>,
    formula: Formula,
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
        approach_velocity: impact.approach_velocity,
        borders: impact.borders,
        formula: (kind, signs, system.coefficient().piece(u)),
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
