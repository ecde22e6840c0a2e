//! First contact of a flight, with a guarantee (docs/contact-detection.md).
//!
//! At time s the gap g and its first three derivatives are known, and |g''''| <= M on the rest of
//! the local flight, so
//!
//! > q(h) = g + g' h + g'' h^2/2 + g''' h^3/6 + M h^4/24 >= g(s + h),   h >= 0.
//!
//! The search steps to the first positive root of q (or just short of it): never past the first
//! contact, and towards it with order four. No sign change at step ends is needed, so a double
//! crossing cannot slip through. At a start on the contact with g' < 0 the factor h is divided
//! out, at one with g' = 0, g'' < 0 the factor h^2 (docs/theory.md, section 3).

use crate::flight::{Flight, FreeMotion, Motion};
use crate::gap::{Direct, GapFlight, GapPoint, Geometry, Oblique};
use crate::params::Contact;
use crate::state::State;
use crate::tolerance::{
    EPS, FLIGHT_NOISE, GRAZE_NOISE, QUARTIC_RTOL, QUARTIC_STEPS, REST_NOISE, SEARCH_STEPS,
    TAYLOR_PART,
};

/// How a local flight starts, as far as the contact is concerned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// Apart, g < 0.
    Apart,
    /// On the contact and separating: g = 0, g' < 0 (after an impact).
    Touching,
    /// Past a graze at this local time: g = g' = 0, g'' < 0 there.
    Grazed(f64),
}

/// What the search found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Found {
    /// g = 0 with g' > 0, for the first time.
    Contact(Touch),
    /// The gap rises to zero within rounding and falls again: no impulse.
    Graze(Touch),
    /// No contact in the local flight.
    Nothing,
    /// The flight starts on the contact without separating (g' = 0 to rounding, g'' >= 0):
    /// contact lasts.
    Resting,
    /// The gap is not a finite number.
    NotFinite,
    /// The step budget is used up.
    Stalled,
}

/// A contact or the top of a graze. The instant is `time + offset`: kept apart, because the root
/// lies between two neighbouring numbers and velocity times that spacing is not negligible.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Local time of the last evaluation.
    pub time: f64,
    /// From there to the instant; so short that Taylor polynomials are exact to rounding.
    pub offset: f64,
    /// Gap function at the instant.
    pub gap: GapPoint,
    /// State of both bodies at the instant.
    pub state: State,
}

impl Touch {
    /// The local time as one number.
    #[must_use]
    pub fn local_time(&self) -> f64 {
        self.time + self.offset
    }
}

/// Outcome and cost of one search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactReport {
    /// What was found.
    pub found: Found,
    /// Evaluations of the gap function.
    pub evaluations: u64,
}

/// First contact of `flight` in (0, `span`]; `delta` is the gap parameter.
#[must_use]
pub fn next_contact(
    motion: &FreeMotion,
    flight: &Flight,
    contact: Contact,
    delta: f64,
    start: Start,
    span: f64,
) -> ContactReport {
    match contact {
        Contact::Oblique => search::<Oblique>(motion, flight, delta, start, span),
        Contact::Direct => search::<Direct>(motion, flight, delta, start, span),
    }
}

fn search<G: Geometry>(
    motion: &FreeMotion,
    flight: &Flight,
    delta: f64,
    start: Start,
    span: f64,
) -> ContactReport {
    let touching = start == Start::Touching;
    let gap = GapFlight::<G>::new(motion, flight, delta, touching);
    let mut search = Search { gap, span, evaluations: 0 };
    let found = search.run(start);
    ContactReport { found, evaluations: search.evaluations }
}

struct Search<'a, G: Geometry> {
    gap: GapFlight<'a, G>,
    span: f64,
    evaluations: u64,
}

/// The gap and both bodies at one local time.
#[derive(Clone, Copy)]
struct Sample {
    time: f64,
    gap: GapPoint,
    bodies: (Motion, Motion),
}

/// What a rise of the gap to rounding level turned out to be.
enum Settled {
    Found(Found),
    /// The top of a hump that stays below zero by more than rounding.
    Below(Sample),
}

/// Power of h that is divided out of q at a start on the contact.
#[derive(Clone, Copy, PartialEq)]
enum Lift {
    None,
    Once,
    Twice,
}

impl<G: Geometry> Search<'_, G> {
    fn evaluate(&mut self, s: f64) -> Sample {
        self.evaluations += 1;
        let (gap, bodies) = self.gap.at(s);
        Sample { time: s, gap, bodies }
    }

    fn evaluate_exactly(&mut self, s: f64) -> Sample {
        self.evaluations += 1;
        let (gap, bodies) = self.gap.at_exactly(s);
        Sample { time: s, gap, bodies }
    }

    fn touch(&self, sample: &Sample, offset: f64) -> Touch {
        Touch {
            time: sample.time,
            offset,
            gap: sample.gap.later(offset),
            state: self.gap.state_later(&sample.bodies, offset),
        }
    }

    fn run(&mut self, start: Start) -> Found {
        let mut sample = self.evaluate(if let Start::Grazed(time) = start { time } else { 0.0 });
        if !(self.gap.fourth_bound.is_finite() && sample.gap.value.is_finite()) {
            return Found::NotFinite;
        }
        let rest = REST_NOISE * EPS * self.gap.rate_bound;
        let mut lift = match start {
            Start::Apart => Lift::None,
            Start::Grazed(_) => Lift::Twice,
            Start::Touching if sample.gap.rate < -rest => Lift::Once,
            Start::Touching if sample.gap.rate <= rest && sample.gap.second < 0.0 => Lift::Twice,
            Start::Touching => return Found::Resting,
        };
        // Beyond this q is useless: its last term alone exceeds what g' can do.
        let reach = 3.0 * (self.gap.rate_bound / self.gap.fourth_bound).cbrt();
        for _ in 0..SEARCH_STEPS {
            let (s, gap) = (sample.time, sample.gap);
            let graze = GRAZE_NOISE * self.gap.noise(s);
            if lift == Lift::None && gap.value >= -2.0 * graze {
                // A gap at rest that closes is met, not rested on: it was not started on.
                let closes = gap.value < 0.0 && gap.rate >= -rest && gap.second > 0.0;
                if gap.rate > 0.0 || closes {
                    match self.settle(&sample, 0.0) {
                        Settled::Found(found) => return found,
                        Settled::Below(top) => sample = top,
                    }
                    lift = Lift::Twice;
                    continue;
                }
                // On the contact to rounding, and leaving it.
                lift = if gap.rate < -rest { Lift::Once } else { Lift::Twice };
                if lift == Lift::Twice && gap.second >= 0.0 {
                    return Found::Resting;
                }
            }
            let left = self.span - s;
            let mut step = self.safe_step(&gap, lift, left.min(reach), graze);
            if step >= left {
                return Found::Nothing;
            }
            let remainder = self.gap.fourth_bound / 24.0 * step.powi(4);
            let tiny = remainder <= TAYLOR_PART * self.gap.noise(s + step) || s + step == s;
            if tiny && lift == Lift::Twice {
                // A top so flat that the step off it ends at rounding level: it goes on as one
                // graze while the gap stays there.
                step = self.flat_step(&gap, left.min(reach), graze);
                if step >= left {
                    return Found::Nothing;
                }
                sample = self.evaluate((s + step).max(s.next_up()));
                let level = GRAZE_NOISE * self.gap.noise(sample.time);
                let stays = sample.gap.value >= -2.0 * level && sample.gap.rate <= rest;
                lift = if stays { Lift::Twice } else { Lift::None };
                continue;
            }
            if tiny {
                match self.settle(&sample, step) {
                    Settled::Found(found) => return found,
                    Settled::Below(top) => sample = top,
                }
                lift = Lift::Twice;
                continue;
            }
            lift = Lift::None;
            sample = self.evaluate(s + step);
        }
        if sample.gap.value.is_finite() { Found::Stalled } else { Found::NotFinite }
    }

    /// Largest h <= limit found such that the gap does not rise above the graze level on (0, h),
    /// from a point at that level.
    fn flat_step(&self, point: &GapPoint, limit: f64, graze: f64) -> f64 {
        let GapPoint { value, rate, second, third } = *point;
        let fourth = self.gap.fourth_bound / 24.0;
        first_root(
            &[value.min(graze) - 2.0 * graze, rate, second / 2.0, third / 6.0, fourth],
            limit,
        )
    }

    /// Largest h <= limit found such that q + graze < 0 on (0, h).
    fn safe_step(&self, point: &GapPoint, lift: Lift, limit: f64, graze: f64) -> f64 {
        let GapPoint { value, rate, second, third } = *point;
        let fourth = self.gap.fourth_bound / 24.0;
        let creep = GRAZE_NOISE * FLIGHT_NOISE * EPS * self.gap.rate_bound;
        let c = match lift {
            Lift::None => [value + graze, rate, second / 2.0, third / 6.0, fourth],
            Lift::Once => [rate + creep, second / 2.0, third / 6.0, fourth, 0.0],
            Lift::Twice => [second / 2.0, third / 6.0, fourth, 0.0, 0.0],
        };
        first_root(&c, limit)
    }

    /// A contact lies so near after `sample`, at about `h`, that the Taylor polynomial of the gap
    /// gives it to rounding; unless it is a graze.
    fn settle(&mut self, sample: &Sample, h: f64) -> Settled {
        let near = sample.gap.later(h);
        // The hump's top by the parabola through (g, g', g'').
        let level = GRAZE_NOISE * self.gap.noise(sample.time + h);
        let height = near.rate * near.rate - 2.0 * near.second * near.value;
        if near.second < 0.0 && height <= -2.0 * near.second * level {
            if let Some(settled) = self.hump(sample, level) {
                return settled;
            }
        }
        // Once more with care: whatever is lost here stays in the motion.
        let sample = &self.evaluate_exactly(sample.time);
        // First the parabola's root, which exists by the above, then Newton on the cubic.
        let slope = near.rate + height.max(0.0).sqrt();
        let mut offset = h - if slope > 0.0 { 2.0 * near.value / slope } else { 0.0 };
        for _ in 0..3 {
            let at = sample.gap.later(offset);
            if at.rate > 0.0 {
                offset -= at.value / at.rate;
            }
        }
        Settled::Found(Found::Contact(self.touch(sample, offset)))
    }

    /// Top of the hump ahead, unless it is higher than `level`.
    fn hump(&mut self, sample: &Sample, level: f64) -> Option<Settled> {
        let mut top = *sample;
        for _ in 0..12 {
            if top.gap.second >= 0.0 {
                return None;
            }
            let next = (top.time - top.gap.rate / top.gap.second).clamp(0.0, self.span);
            if next == top.time {
                break;
            }
            let candidate = self.evaluate(next);
            if candidate.gap.rate.abs() >= top.gap.rate.abs() {
                break;
            }
            top = candidate;
        }
        if top.gap.value > level {
            return None;
        }
        Some(if top.time == self.span && top.gap.rate > 0.0 {
            // The top belongs to the next local flight.
            Settled::Found(Found::Nothing)
        } else if top.gap.value < -level {
            Settled::Below(top)
        } else {
            Settled::Found(Found::Graze(self.touch(&top, 0.0)))
        })
    }
}

/// A number at or just below (to rounding) the first positive root of c0 + c1 h + c2 h^2 + c3 h^3 + c4 h^4 in
/// (0, limit], or `limit` if there is none; c0 < 0 and c4 >= 0.
///
/// Each step goes to the root of a parabola that bounds the polynomial from above on a window
/// ahead: its second derivative is convex, so largest at an end of the window. The window
/// follows the steps, so that close to the root the parabola is tight and steps are Newton's.
fn first_root(c: &[f64; 5], limit: f64) -> f64 {
    let curvature = |h: f64| 2.0 * c[2] + h * (6.0 * c[3] + h * 12.0 * c[4]);
    let mut h = 0.0;
    let mut window = limit;
    for _ in 0..QUARTIC_STEPS {
        let value = c[0] + h * (c[1] + h * (c[2] + h * (c[3] + h * c[4])));
        if value >= 0.0 {
            return h;
        }
        let rate = c[1] + h * (2.0 * c[2] + h * (3.0 * c[3] + h * 4.0 * c[4]));
        let bend = curvature(h).max(curvature(h + window));
        let discriminant = rate * rate - 2.0 * bend * value;
        let step = if discriminant < 0.0 || (bend <= 0.0 && rate <= 0.0) {
            window
        } else {
            // The smaller positive root; for rate < 0 in a form that does not cancel.
            let root = discriminant.sqrt();
            let step =
                if rate >= 0.0 { -2.0 * value / (rate + root) } else { (root - rate) / bend };
            step.min(window)
        };
        h += step;
        if h >= limit {
            return limit;
        }
        if step <= QUARTIC_RTOL * h {
            return h;
        }
        window = (4.0 * step).min(limit - h);
    }
    h
}

#[cfg(test)]
mod tests {
    use super::first_root;

    fn value(c: &[f64; 5], h: f64) -> f64 {
        c[0] + h * (c[1] + h * (c[2] + h * (c[3] + h * c[4])))
    }

    #[test]
    fn first_root_stays_below_and_comes_close() {
        // (h - 1)(h + 2)(h^2 + 1); (h - 0.1)(h + 1)(h^2 + 1); a narrow hump at 0.3 before a
        // larger root, -(h - 0.3)^2 - 1e-9 + h^4/1000.
        for c in [
            [-2.0, 1.0, -1.0, 1.0, 1.0],
            [-0.1, 0.9, 0.9, 0.9, 1.0],
            [-0.09 - 1e-9, 0.6, -1.0, 0.0, 1e-3],
        ] {
            let h = first_root(&c, 10.0);
            let scanned =
                (1..=1_000_000).map(|i| 1e-5 * f64::from(i)).find(|&h| value(&c, h) >= 0.0);
            let first = scanned.unwrap();
            assert!(h <= first && h >= first - 3e-5, "{h} {first}");
        }
    }

    #[test]
    fn without_a_root_the_limit_is_returned() {
        assert_eq!(first_root(&[-1.0, 0.0, 0.0, 0.0, 0.5], 1.0), 1.0);
        assert_eq!(first_root(&[-1.0, 1.0, -2.0, 0.0, 0.01], 1.0), 1.0);
    }
}
