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

use crate::flight::{Flight, FreeMotion};
use crate::gap::{Direct, GapFlight, GapPoint, Geometry, Oblique};
use crate::params::Contact;
use crate::tolerance::{
    EPS, GRAZE_NOISE, QUARTIC_RTOL, QUARTIC_STEPS, REST_NOISE, SEARCH_STEPS,
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
    /// g = 0 with g' > 0 at this local time, for the first time.
    Contact {
        /// Local time.
        time: f64,
        /// The gap function there, |value| a few roundings at most.
        gap: GapPoint,
    },
    /// The gap rises to zero within rounding and falls again: no impulse.
    Graze {
        /// Local time of the hump's top.
        time: f64,
        /// The gap function there.
        gap: GapPoint,
    },
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

/// Power of h that is divided out of q at a start on the contact.
#[derive(Clone, Copy, PartialEq)]
enum Lift {
    None,
    Once,
    Twice,
}

impl<G: Geometry> Search<'_, G> {
    fn evaluate(&mut self, s: f64) -> GapPoint {
        self.evaluations += 1;
        self.gap.at(s)
    }

    fn run(&mut self, start: Start) -> Found {
        let mut s = if let Start::Grazed(time) = start { time } else { 0.0 };
        let mut point = self.evaluate(s);
        let rest = REST_NOISE * EPS * self.gap.rate_bound;
        if !(self.gap.fourth_bound.is_finite() && point.value.is_finite()) {
            return Found::NotFinite;
        }
        let mut lift = match start {
            Start::Apart => Lift::None,
            Start::Grazed(_) => Lift::Twice,
            Start::Touching if point.rate < -rest => Lift::Once,
            Start::Touching if point.rate <= rest && point.second < 0.0 => Lift::Twice,
            Start::Touching => return Found::Resting,
        };
        // Beyond this q is useless: its last term alone exceeds what g' can do.
        let reach = 3.0 * (self.gap.rate_bound / self.gap.fourth_bound).cbrt();
        while self.evaluations < SEARCH_STEPS {
            let graze = GRAZE_NOISE * self.gap.noise(s);
            if lift == Lift::None && point.value >= -2.0 * graze {
                if point.rate > 0.0 {
                    return self.settle(s, point);
                }
                // On the contact to rounding, and leaving it.
                lift = if point.rate < -rest { Lift::Once } else { Lift::Twice };
                if lift == Lift::Twice && point.second >= 0.0 {
                    return Found::Resting;
                }
            }
            let limit = (self.span - s).min(reach);
            let step = self.safe_step(&point, lift, limit, graze);
            let next = if step >= self.span - s { self.span } else { s + step };
            if next <= s {
                // The root is nearer than the spacing of numbers: this is it.
                return self.settle(s, point);
            }
            s = next;
            if s >= self.span {
                return Found::Nothing;
            }
            lift = Lift::None;
            point = self.evaluate(s);
        }
        if point.value.is_finite() { Found::Stalled } else { Found::NotFinite }
    }

    /// Largest h <= limit found such that q + graze < 0 on (0, h).
    fn safe_step(&self, point: &GapPoint, lift: Lift, limit: f64, graze: f64) -> f64 {
        let GapPoint { value, rate, second, third } = *point;
        let fourth = self.gap.fourth_bound / 24.0;
        let creep = GRAZE_NOISE * (self.gap.noise(1.0) - self.gap.noise(0.0));
        let c = match lift {
            Lift::None => [value + graze, rate, second / 2.0, third / 6.0, fourth],
            Lift::Once => [rate + creep, second / 2.0, third / 6.0, fourth, 0.0],
            Lift::Twice => [second / 2.0, third / 6.0, fourth, 0.0, 0.0],
        };
        first_root(&c, limit)
    }

    /// On the contact to rounding and approaching: polish the root, or tell a graze.
    fn settle(&mut self, s: f64, point: GapPoint) -> Found {
        let level = GRAZE_NOISE * self.gap.noise(s);
        let (mut best, mut best_point) = (s, point);
        for _ in 0..12 {
            let GapPoint { value: g, rate: u, second: a, .. } = best_point;
            // Root, or top of the hump, of the parabola through (g, g', g'').
            let discriminant = u * u - 2.0 * a * g;
            if a < 0.0 && discriminant <= -2.0 * a * level {
                if let Some(graze) = self.hump(best, best_point, level) {
                    return graze;
                }
            }
            let slope = u + discriminant.max(0.0).sqrt();
            let next = (best - 2.0 * g / slope).clamp(0.0, self.span);
            if !next.is_finite() || next == best {
                break;
            }
            let candidate = self.evaluate(next);
            if candidate.rate <= 0.0 || candidate.value.abs() >= best_point.value.abs() {
                break;
            }
            (best, best_point) = (next, candidate);
        }
        Found::Contact { time: best, gap: best_point }
    }

    /// Top of the hump ahead, if it is no higher than `level`.
    fn hump(&mut self, s: f64, point: GapPoint, level: f64) -> Option<Found> {
        let (mut time, mut top) = (s, point);
        for _ in 0..12 {
            if top.second >= 0.0 {
                return None;
            }
            let next = time - top.rate / top.second;
            if next == time || !(0.0..=self.span).contains(&next) {
                break;
            }
            let candidate = self.evaluate(next);
            if candidate.rate.abs() >= top.rate.abs() {
                break;
            }
            (time, top) = (next, candidate);
        }
        (top.value <= level).then_some(Found::Graze { time, gap: top })
    }
}

/// A number just below the first positive root of c0 + c1 h + c2 h^2 + c3 h^3 + c4 h^4 in
/// (0, limit], or `limit` if there is none; c0 < 0 and the last nonzero coefficient is positive.
///
/// Each step goes to the root of a parabola that bounds the polynomial from above on the rest of
/// the interval: its second derivative is convex, so largest at an end.
fn first_root(c: &[f64; 5], limit: f64) -> f64 {
    let curvature = |h: f64| 2.0 * c[2] + h * (6.0 * c[3] + h * 12.0 * c[4]);
    let at_limit = curvature(limit);
    let mut h = 0.0;
    for _ in 0..QUARTIC_STEPS {
        let value = c[0] + h * (c[1] + h * (c[2] + h * (c[3] + h * c[4])));
        if value >= 0.0 {
            return h;
        }
        let rate = c[1] + h * (2.0 * c[2] + h * (3.0 * c[3] + h * 4.0 * c[4]));
        let bend = curvature(h).max(at_limit);
        let discriminant = rate * rate - 2.0 * bend * value;
        if discriminant < 0.0 || (bend <= 0.0 && rate <= 0.0) {
            return limit;
        }
        // -2 value/(rate + root) is the smaller positive root; for rate < 0 in a stable form.
        let root = discriminant.sqrt();
        let step = if rate >= 0.0 { -2.0 * value / (rate + root) } else { (root - rate) / bend };
        h += step;
        if h >= limit {
            return limit;
        }
        if step <= QUARTIC_RTOL * h {
            return h;
        }
    }
    h
}

#[cfg(test)]
mod tests {
    use super::first_root;

    #[test]
    fn first_root_stays_below_and_comes_close() {
        // (h - 1)(h + 2)(h^2 + 1), and a double hump whose first root is at 0.1.
        for (c, root) in [
            ([-2.0, 1.0, -1.0, 1.0, 1.0], 1.0),
            ([-0.001, 0.0101, -0.0011, 0.1001, 1.0], 0.092_4),
        ] {
            let h = first_root(&c, 10.0);
            let p = |h: f64| c[0] + h * (c[1] + h * (c[2] + h * (c[3] + h * c[4])));
            assert!(p(h) <= 1e-12 && p(h + 1e-5) > 0.0, "{h} {root}");
        }
        assert_eq!(first_root(&[-1.0, 0.0, 0.0, 0.0, 0.5], 1.0), 1.0);
        assert_eq!(first_root(&[-1.0, 2.0, -2.0, 0.0, 0.01], 1.0), 1.0);
    }
}
