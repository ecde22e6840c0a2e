//! The highest maxima of the gaps inside a flight: where one reaches zero the flight grazes. They are
//! sampled closely; that a motion does not penetrate is guaranteed by the contact search alone.

use super::{Flown, StructureCycle};
use crate::analysis::tolerances::{END_LEVEL, END_OF_FLIGHT, HUMP_ANGLE, MOST_HUMP_SAMPLES};
use crate::model::structure::Structure;
use crate::numerics::double_double::DoubleDouble;
use crate::simulate::Model;

/// Most evaluations for one maximum.
const MOST_STEPS: usize = 100;

/// Fewest samples of a flight, however short.
const FEWEST_SAMPLES: f64 = 8.0;

/// How often the steps at both ends are halved: bounces may be so much shorter.
const HALVINGS: i32 = 10;

/// Evaluations that place where a rate turns, to 1e-8 of a step.
const TURN_STEPS: usize = 40;

impl StructureCycle<'_> {
    /// Time and value of the largest local maximum of the gap of each stop inside a flight, if there
    /// is one.
    pub(super) fn highest(&self, flown: &Flown) -> Vec<Option<(f64, f64)>> {
        let linearised = &self.of.linearised;
        let structure = self.structure();
        let length = flown.elapsed.value();
        let stops = structure.stops().len();
        let mut highest: Vec<Option<(f64, f64)>> = vec![None; stops];
        if length <= 0.0 {
            return highest;
        }
        let fastest =
            structure.frequencies().iter().fold(structure.drive_frequency(), |a, &b| a.max(b));
        #[allow(clippy::cast_sign_loss)] // at least 8
        let steps = (length * fastest / HUMP_ANGLE).ceil().clamp(FEWEST_SAMPLES, MOST_HUMP_SAMPLES)
            as usize;
        let motion = &linearised.motion;
        let flight = motion.leg(&flown.anchor, flown.from, flown.anchor.state.clone());
        let at = |time: f64| {
            let elapsed = DoubleDouble::new(time);
            let clock = linearised.drive().advance(flown.from, elapsed);
            (clock, motion.state_after(&flight, elapsed))
        };
        let gap = |stop: usize, time: f64| {
            let (clock, state) = at(time);
            motion.gap(stop, clock, &state)
        };
        let all = |time: f64| -> Vec<f64> {
            let (clock, state) = at(time);
            (0..stops).map(|stop| motion.gap(stop, clock, &state).1).collect()
        };
        let near = END_OF_FLIGHT * Structure::span(motion);
        let times = sampled(length, steps);
        let samples: Vec<Vec<f64>> = times.iter().map(|&time| all(time)).collect();
        for (stop, highest) in highest.iter_mut().enumerate() {
            let rate = |time: f64| gap(stop, time).1;
            let mut note = |from: (f64, f64), to: (f64, f64)| {
                if !(from.1 > 0.0 && to.1 <= 0.0) {
                    return;
                }
                let top = falling_root((from.0, to.0), (from.1, to.1), rate);
                let (value, _) = gap(stop, top);
                // Of a flight that begins or ends with u = 0 that is the contact itself.
                let is_end = top.min(length - top) < near && value > -END_LEVEL;
                if !is_end && highest.is_none_or(|(_, most)| value > most) {
                    *highest = Some((top, value));
                }
            };
            let at = |k: usize| (times[k], samples[k][stop]);
            for (k, &time) in times.iter().enumerate().take(times.len() - 1) {
                // A rate that turns may change its sign and back between two samples.
                let turn = (k > 0).then(|| turn([at(k - 1), at(k), at(k + 1)], rate)).flatten();
                match turn {
                    Some(turn) if turn.0 < time => {
                        note(at(k - 1), turn);
                        note(turn, at(k));
                        note(at(k), at(k + 1));
                    }
                    Some(turn) => {
                        note(at(k), turn);
                        note(turn, at(k + 1));
                    }
                    None => note(at(k), at(k + 1)),
                }
            }
        }
        highest
    }
}

/// Times of a flight: equal steps, the first and the last of which are halved again and again, for
/// low bounces next to an impact.
fn sampled(length: f64, steps: usize) -> Vec<f64> {
    let step = length / steps as f64;
    let halved = (1..=HALVINGS).rev().map(|k| step * 0.5f64.powi(k));
    let mut times: Vec<f64> = std::iter::once(0.0).chain(halved.clone()).collect();
    times.extend((1..steps).map(|k| step * k as f64));
    times.extend(halved.rev().map(|before| length - before));
    times.push(length);
    times
}

/// Where a function of one sign at three places turns between them and has the other sign, with its
/// value there.
fn turn(at: [(f64, f64); 3], f: impl Fn(f64) -> f64) -> Option<(f64, f64)> {
    let sign = 1f64.copysign(at[1].1);
    let [left, middle, right] = at.map(|(_, value)| sign * value);
    if !(left >= middle && middle <= right && left > 0.0 && middle > 0.0 && right > 0.0) {
        return None;
    }
    // The vertex of the parabola through them; one that stays far from zero does not reach it.
    let [first, second, third] = at.map(|(time, _)| time);
    let slope = (middle - left) / (second - first);
    let bend = ((right - middle) / (third - second) - slope) / (third - first);
    let slope = slope + bend * (second - first);
    if bend <= 0.0 || middle - 0.25 * slope * slope / bend > 0.5 * middle {
        return None;
    }
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let (mut low, mut high) = (at[0].0, at[2].0);
    for _ in 0..TURN_STEPS {
        let (first, second) = (high - golden * (high - low), low + golden * (high - low));
        let (one, other) = (sign * f(first), sign * f(second));
        if one.min(other) < 0.0 {
            let (place, value) = if one < other { (first, one) } else { (second, other) };
            return Some((place, sign * value));
        }
        if one < other {
            high = second;
        } else {
            low = first;
        }
    }
    None
}

/// Where a function that is positive on the left and not on the right falls through zero: regula
/// falsi with Illinois' weights.
fn falling_root(
    (mut left, mut right): (f64, f64),
    (mut above, mut below): (f64, f64),
    f: impl Fn(f64) -> f64,
) -> f64 {
    let mut last = 0.0;
    for _ in 0..MOST_STEPS {
        let place = left + (right - left) * (above / (above - below));
        if place <= left || place >= right {
            return if place <= left { left } else { right };
        }
        let value = f(place);
        if value > 0.0 {
            (left, above) = (place, value);
            below *= if last > 0.0 { 0.5 } else { 1.0 };
        } else if value < 0.0 {
            (right, below) = (place, value);
            above *= if last < 0.0 { 0.5 } else { 1.0 };
        } else {
            return place;
        }
        last = value;
    }
    0.5 * (left + right)
}

#[cfg(test)]
mod tests {
    use super::{falling_root, turn};

    #[test]
    fn finds_a_rate_that_changes_its_sign_between_samples() {
        for (place, depth) in [(0.6, 1e-4), (1.3, 1e-6), (1.0, 1e-2)] {
            for sign in [1.0, -1.0] {
                let f = |t: f64| sign * ((t - place) * (t - place) - depth);
                let at = [0.0, 1.0, 2.0].map(|t| (t, f(t)));
                if sign * at[1].1 <= 0.0 {
                    continue;
                }
                let (found, value) = turn(at, f).unwrap();
                assert!(sign * value < 0.0 && (found - place).abs() <= depth.sqrt());
            }
        }
        let never = |t: f64| (t - 1.2) * (t - 1.2) + 0.3;
        assert_eq!(turn([0.0, 1.0, 2.0].map(|t| (t, never(t))), never), None);
    }

    #[test]
    fn finds_where_a_function_falls_through_zero() {
        for shift in [0.1, 1e-9, 1.3] {
            let f = |t: f64| (shift - t) * (1.0 + t * t);
            let found = falling_root((0.0, 1.5), (f(0.0), f(1.5)), f);
            assert!((found - shift).abs() < 1e-15, "{found} {shift}");
        }
    }
}
