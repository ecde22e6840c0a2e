//! The highest interior maximum of the gap function in a flight: where it reaches zero, the flight
//! grazes. It is sampled closely; this describes a flight, the guarantee that a motion does not
//! penetrate is the contact search's.

use crate::analysis::tolerances::{END_LEVEL, END_OF_FLIGHT, HUMP_ANGLE, MOST_HUMP_SAMPLES};
use crate::flight::Flight;
use crate::flight::gap::TipGap;
use crate::model::parameters::Contact;
use crate::model::tip::{Direct, Oblique, Tip};
use crate::numerics::double_double::DoubleDouble;
use crate::search::gap::GapPoint;
use crate::tangent::{DualState, Model, Moment};

/// Local flights after which no more maxima are looked for: at drive frequencies near zero a flight
/// may last for ever.
const MOST_CHUNKS: usize = 10_000;

/// Time and value of the largest local maximum of g inside (0, length).
pub(super) fn highest(
    model: &Model,
    state: &DualState,
    moment: &Moment,
    length: f64,
    touching: bool,
) -> Option<(f64, f64)> {
    let start = model.motion.flight(moment.clock(), state.value());
    let mut highest: Option<(f64, f64)> = None;
    let (mut passed, mut first) = (0.0, touching);
    // A flight from the contact has its largest gap, 0, at its start; a maximum after it rises
    // again from below. At a release g, g' and g'' begin as rounding.
    let mut lowest = if touching { 0.0 } else { f64::NEG_INFINITY };
    for _ in 0..MOST_CHUNKS {
        if passed >= length {
            break;
        }
        let span = model.motion.span.min(length - passed);
        let elapsed = DoubleDouble::new(passed);
        let flight = if passed == 0.0 {
            start
        } else {
            let clock = model.motion.drive.advance(start.clock, elapsed);
            model.motion.flight(clock, model.motion.state_after(&start, elapsed))
        };
        let found = match model.system.contact {
            Contact::Oblique => in_chunk::<Oblique>(model, &flight, span, first, &mut lowest),
            Contact::Direct => in_chunk::<Direct>(model, &flight, span, first, &mut lowest),
        };
        if let Some((time, gap)) = found {
            let top = passed + time;
            // Of a flight that ends with u = 0 the last hump is that end, to rounding.
            let is_end = length - top < END_OF_FLIGHT * model.motion.span && gap > -END_LEVEL;
            if !is_end && highest.is_none_or(|(_, most)| gap > most) {
                highest = Some((top, gap));
            }
        }
        (passed, first) = (passed + span, false);
    }
    highest
}

fn in_chunk<T: Tip>(
    model: &Model,
    flight: &Flight,
    span: f64,
    touching: bool,
    lowest: &mut f64,
) -> Option<(f64, f64)> {
    let tip_gap = TipGap::<T>::new(&model.motion, flight);
    let gap = tip_gap.bounded(touching);
    let at = |s: f64| gap.at(s).0;
    let turning = model.motion.bounds(flight).0.0[0];
    #[allow(clippy::cast_sign_loss)] // at least 1
    let steps = (span * (model.system.highest_frequency() + turning) / HUMP_ANGLE)
        .ceil()
        .clamp(1.0, MOST_HUMP_SAMPLES) as usize;
    let mut highest: Option<(f64, f64)> = None;
    let (mut from, mut before) = (0.0, at(0.0));
    for step in 1..=steps {
        let to = span * step as f64 / steps as f64;
        let after = at(to);
        *lowest = lowest.min(before.value);
        let bracket = if before.rate > 0.0 && after.rate <= 0.0 {
            Some((from, to))
        } else if before.rate <= 0.0
            && after.rate <= 0.0
            && before.second > 0.0
            && after.second < 0.0
        {
            // The rate may rise above zero in between.
            let top = bisect(from, to, |s| at(s).second);
            (at(top).rate > 0.0).then_some((top, to))
        } else {
            None
        };
        if let Some((left, right)) = bracket {
            let top = falling_root(left, right, at);
            let GapPoint { value, .. } = at(top);
            let rises = value > *lowest + gap.noise(top);
            if rises && highest.is_none_or(|(_, most)| value > most) {
                highest = Some((top, value));
            }
        }
        (from, before) = (to, after);
    }
    highest
}

/// Where the rate, positive at `left` and not at `right`, falls through zero, to rounding: Newton's
/// method, with bisection where a step would leave the bracket or not be half of the last one.
fn falling_root(mut left: f64, mut right: f64, at: impl Fn(f64) -> GapPoint) -> f64 {
    let (mut place, mut last) = (0.5 * (left + right), right - left);
    loop {
        let GapPoint { rate, second, .. } = at(place);
        if rate > 0.0 {
            left = place;
        } else {
            right = place;
        }
        let newton = place - rate / second;
        if newton == place {
            return place;
        }
        let converges = left < newton && newton < right && (newton - place).abs() < 0.5 * last;
        let next = if converges { newton } else { 0.5 * (left + right) };
        if next <= left || next >= right {
            return next;
        }
        last = (next - place).abs();
        place = next;
    }
}

/// Where a function that is positive at `left` and not at `right` falls through zero.
fn bisect(mut left: f64, mut right: f64, f: impl Fn(f64) -> f64) -> f64 {
    loop {
        let middle = 0.5 * (left + right);
        if middle <= left || middle >= right {
            return middle;
        }
        if f(middle) > 0.0 {
            left = middle;
        } else {
            right = middle;
        }
    }
}
