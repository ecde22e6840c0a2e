//! Derivatives of contact phases: slides by their Taylor series, sticks in closed form
//! (docs/theory.md, section 5).

use super::{Dual, DualState, Model, Moment};
use crate::contact::sustained::{ClosedContact, ContactMode, SlideEnd, SlideStep};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::dual::Number;
use crate::tangent::border::{Border, BorderValue, note_least};
use crate::tangent::itinerary::StickEnd;
use crate::tangent::tolerances::{MOST_SLIDE_STEPS, SLIDE_SAMPLES};
use std::f64::consts::{PI, TAU};

/// A slide in `mode` from `state`, for a time `s`: the state there.
pub(crate) fn slide<const N: usize>(
    model: &Model<N>,
    state: &DualState<N>,
    mode: ContactMode,
    moment: &Moment<N>,
    s: Dual<N>,
) -> Option<DualState<N>> {
    Some(slide_with_rates(model, state, mode, moment, s)?.0)
}

/// The same, and the rates of x1 and x1' there.
pub(crate) fn slide_with_rates<const N: usize>(
    model: &Model<N>,
    state: &DualState<N>,
    mode: ContactMode,
    moment: &Moment<N>,
    s: Dual<N>,
) -> Option<(DualState<N>, [f64; 2])> {
    let (mut x1, mut v1, mut at, mut left) = (state.x1, state.v1, *moment, s);
    for _ in 0..MOST_SLIDE_STEPS {
        let phase = model.motion.drive.trig_at(at.clock());
        let parameters = (&model.parameters, model.load(&at));
        let (series, length) =
            model.system.slide_with_derivatives(phase, parameters, (x1, v1), mode);
        // The friction's side changes at sin x1 = 0, where friction vanishes: no jump in the
        // equation, none in the derivatives.
        if left.value <= length {
            let (x1, v1) = series.at(left);
            return Some((on_contact(model, x1, v1), series.rates(left.value)));
        }
        let length = Dual::constant(length);
        (x1, v1) = series.at(length);
        at = at.later(length);
        left = left - length;
    }
    None
}

/// Least local minima inside a slide of time `length` of the free gap acceleration and of |x1'|,
/// each with its time; `None` where there is none.
pub(crate) fn least_in_slide(
    model: &Model,
    state: &DualState,
    mode: ContactMode,
    moment: &Moment,
    length: f64,
) -> [Option<(f64, f64)>; 2] {
    let sign = mode.direction();
    let (mut x1, mut v1, mut clock, mut passed) =
        (state.x1.value, state.v1.value, moment.clock(), 0.0);
    let mut least = [None; 2];
    // Two samples before and the step before, so that a minimum at the end of a step is seen by the
    // next.
    let mut recent: [Vec<(f64, f64)>; 2] = [Vec::new(), Vec::new()];
    let mut before: Option<(SlideStep, f64)> = None;
    for _ in 0..MOST_SLIDE_STEPS {
        let start = model.system.on_contact(x1, v1);
        let step = model.system.slide(model.motion.drive.trig_at(clock), &start, mode);
        let end = match step.end() {
            (time, SlideEnd::Side) => time,
            _ => step.length(),
        }
        .min(length - passed);
        let at = |which: usize, time: f64| {
            let (step, s) = match &before {
                Some((step, began)) if time < passed => (step, time - began),
                _ => (&step, time - passed),
            };
            if which == 0 { step.free_acceleration(s) } else { sign * step.at(s).1 }
        };
        // A step begins where the one before ends.
        for i in usize::from(before.is_some())..=SLIDE_SAMPLES {
            let time = passed + end * i as f64 / SLIDE_SAMPLES as f64;
            for (which, recent) in recent.iter_mut().enumerate() {
                recent.push((time, at(which, time)));
                if let [.., a, b, c] = recent[..]
                    && b.1 < a.1
                    && b.1 <= c.1
                {
                    let (time, value) = minimum(a.0, c.0, |t| at(which, t));
                    if least[which].is_none_or(|(_, lowest)| value < lowest) {
                        least[which] = Some((time, value));
                    }
                }
            }
        }
        (x1, v1) = step.at(end);
        before = Some((step, passed));
        passed += end;
        clock = model.motion.drive.advance(clock, DoubleDouble::new(end));
        if passed >= length || end <= 0.0 {
            break;
        }
    }
    least
}

/// A local minimum between `a` and `b`, by golden sections.
fn minimum(mut a: f64, mut b: f64, f: impl Fn(f64) -> f64) -> (f64, f64) {
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    let (mut c, mut d) = (b - ratio * (b - a), a + ratio * (b - a));
    let (mut fc, mut fd) = (f(c), f(d));
    for _ in 0..60 {
        if fc < fd {
            (b, d, fd) = (d, c, fc);
            c = b - ratio * (b - a);
            fc = f(c);
        } else {
            (a, c, fc) = (c, d, fd);
            d = a + ratio * (b - a);
            fd = f(d);
        }
    }
    if fc < fd { (c, fc) } else { (d, fd) }
}

/// The state on the contact with this x1 and x1'.
pub(crate) fn on_contact<const N: usize>(
    model: &Model<N>,
    x1: Dual<N>,
    v1: Dual<N>,
) -> DualState<N> {
    let v2 = if model.wall_at_rest { Dual::constant(0.0) } else { v1 * model.angle(x1).cos };
    DualState { x1, v1, x2: model.contact_place(x1), v2 }
}

/// A state on the contact as a closed one; `side`: sgn sin x1, unless it is given.
pub(super) fn closed_contact<const N: usize>(
    model: &Model<N>,
    state: &DualState<N>,
    moment: &Moment<N>,
    side: Option<f64>,
) -> ClosedContact<Dual<N>> {
    let angle = model.angle(state.x1);
    let (a1, a2) = model.free_accelerations(state, moment);
    let a2 = if model.wall_at_rest { Dual::constant(0.0) } else { a2 };
    let side = side.unwrap_or(1f64.copysign(angle.sin.value));
    model.parameters.closed_contact(angle, (state.v1, state.v2), (a1, a2), side)
}

/// g'' of the free motion, which a contact force has to take away.
pub(crate) fn free_gap_acceleration<const N: usize>(
    model: &Model<N>,
    state: &DualState<N>,
    moment: &Moment<N>,
) -> Dual<N> {
    closed_contact(model, state, moment, None).gap_acceleration
}

/// Conditions of a stick: all positive while it lasts; the one that ends it, and the least values
/// of all inside it, where they have minima, and of the others at its ends.
pub(crate) struct StickCondition {
    pub ends: Dual,
    pub others: Vec<BorderValue>,
}

/// The conditions of a stick from `start` to `end`.
pub(crate) fn stick_condition(
    model: &Model,
    state: &DualState,
    (start, end): (&Moment, &Moment),
    how: StickEnd,
) -> StickCondition {
    let limits = stick_limits(model, state, end);
    let ends = ending(&limits, how);
    let first = stick_limits(model, state, start);
    let mut others: Vec<BorderValue> = limits
        .iter()
        .zip(&first)
        .filter(|(l, _)| l.0 != how)
        .map(|(l, f)| BorderValue { border: l.1, value: l.2.value.min(f.2.value) })
        .collect();
    // Each is alpha + beta cos psi: extrema at psi = 0 and pi (mod 2 pi).
    let omega = model.system.drive_frequency;
    let length = model.elapsed(start, end).value;
    let phase = model.phase(start).1.value;
    for half_turns in 1..=2 {
        let turn = (f64::from(half_turns) * PI - phase).rem_euclid(TAU);
        let time = turn / omega;
        if time > 0.0 && time < length {
            let then = start.later(Dual::constant(time));
            for (_, border, value) in stick_limits(model, state, &then) {
                note_least(&mut others, BorderValue { border, value: value.value });
            }
        }
    }
    StickCondition { ends, others }
}

/// What ends a stick at this instant.
pub(crate) fn stick_end<const N: usize>(
    model: &Model<N>,
    state: &DualState<N>,
    end: &Moment<N>,
    how: StickEnd,
) -> Dual<N> {
    ending(&stick_limits(model, state, end), how)
}

/// The one of these limits that ends a stick so.
fn ending<const N: usize>(limits: &[(StickEnd, Border, Dual<N>)], how: StickEnd) -> Dual<N> {
    let found = limits.iter().find(|limit| limit.0 == how).or(limits.first());
    found.map_or(Dual::constant(f64::NAN), |limit| limit.2)
}

/// What is positive where a tip at rest begins to slide in `mode`; `None` where stick has no cone.
pub(crate) fn slip_from_rest(
    model: &Model,
    state: &DualState,
    moment: &Moment,
    mode: ContactMode,
) -> Option<f64> {
    let end = if mode.direction() > 0.0 { StickEnd::SlipPositive } else { StickEnd::SlipNegative };
    let limits = stick_limits(model, state, moment);
    limits.iter().find(|limit| limit.0 == end).map(|limit| -limit.2.value)
}

/// What must stay positive in stick, by how it would end.
fn stick_limits<const N: usize>(
    model: &Model<N>,
    state: &DualState<N>,
    moment: &Moment<N>,
) -> Vec<(StickEnd, Border, Dual<N>)> {
    let contact = closed_contact(model, state, moment, None);
    if contact.at.is_against_wall() {
        // A wall at rest: p = a1/cos x1.
        let force = contact.slip_acceleration * contact.at.coupling;
        return vec![(StickEnd::Release, Border::ForceInStick, force)];
    }
    // s (mbar a1 + a2 k) < 0 holds the tip against slip in direction s.
    let held = |direction: f64| contact.slip_drive(direction) * -direction;
    vec![
        (StickEnd::SlipPositive, Border::HoldPositive, held(1.0)),
        (StickEnd::SlipNegative, Border::HoldNegative, held(-1.0)),
        (StickEnd::Release, Border::ForceInStick, -contact.parting_acceleration),
    ]
}
