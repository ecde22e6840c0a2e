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
//! out, at one with g' = 0, g'' < 0 the factor h^2, at a release the factor h^3 (docs/theory.md,
//! section 3).

#![allow(clippy::inline_always)] // the usual way through a search is compiled for several instruction sets

mod first_pass;
mod release;

pub(crate) use first_pass::{FirstPass, short_time};

use first_pass::first_pass;

use crate::numerics::majorant::first_root;
use crate::search::gap::{BoundedGap, Gap, GapPoint};
use crate::search::steps::SteppedGap;
use crate::search::tolerances::{
    GRAZE_NOISE, LEAST_PROGRESS, PAUSE_NOISE, SEARCH_PATIENCE, SEARCH_STEPS, SETTLE_PART,
    SETTLE_STEPS, TAYLOR_PART,
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
    /// Released from contact: g = g' = g'' = 0, g''' < 0.
    Released,
}

/// What the search found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Found<S> {
    /// g = 0 with g' > 0, for the first time.
    Contact(Touch<S>),
    /// The gap rises to zero within rounding and falls again: no impulse.
    Graze(Touch<S>),
    /// No contact up to this local time: the end of the local flight or later; earlier only after
    /// very many evaluations. The search goes on as a new local flight, with bounds of its own.
    Clear(f64),
    /// The bodies are on the contact without separating (g = g' = 0 to rounding, g'' >= 0), as a
    /// rule at the start of the flight: contact lasts.
    Resting(Touch<S>),
    /// The gap is not a finite number.
    NotFinite,
    /// The step budget is used up.
    Stalled,
}

/// A contact or the top of a graze. The instant is `time + offset`: kept apart, because the root
/// lies between two neighbouring numbers and velocity times that spacing is not negligible.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch<S> {
    /// Local time of the last evaluation.
    pub time: f64,
    /// From there to the instant; so short that Taylor polynomials are exact to rounding.
    pub offset: f64,
    /// Gap function at the instant.
    pub gap: GapPoint,
    /// State at the instant.
    pub state: S,
}

impl<S> Touch<S> {
    /// The local time as one number.
    #[must_use]
    pub fn local_time(&self) -> f64 {
        self.time + self.offset
    }
}

/// Outcome and cost of one search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactReport<S> {
    /// What was found.
    pub found: Found<S>,
    /// Evaluations of the gap function.
    pub evaluations: u64,
}

/// First contact of a flight in (0, `span`]: the first pass, and the careful search where it stays
/// unsure.
#[inline(always)]
pub(crate) fn first_contact<G: SteppedGap>(
    gap: &G,
    start: Start,
    span: f64,
) -> ContactReport<G::State> {
    let (first_pass, mut scanned) = first_pass(gap, start, span);
    let clear = match first_pass {
        FirstPass::Clear(time) => {
            return ContactReport { found: Found::Clear(time), evaluations: scanned };
        }
        FirstPass::Ahead { near, after, bounds } => {
            let touching = start == Start::Touching;
            let bounded = BoundedGap::new(gap, touching, bounds);
            let mut search =
                Search { gap: bounded, begin: 0.0, span: span.max(near), evaluations: scanned };
            let (touch, settled) = search.meet(near, 0.0);
            scanned = search.evaluations;
            if touch.local_time() < 0.0 {
                return careful_search(gap, start, span, 0.0, scanned);
            }
            if settled && touch.gap.rate > 0.0 {
                return ContactReport { found: Found::Contact(touch), evaluations: scanned };
            }
            if after >= span {
                return ContactReport { found: Found::Clear(after), evaluations: scanned };
            }
            after
        }
        FirstPass::Unsure(time) => time,
    };
    careful_search(gap, start, span, clear, scanned)
}

/// The careful search, from local time `clear` < `span` on.
#[inline(never)]
pub(crate) fn careful_search<G: Gap>(
    gap: &G,
    start: Start,
    span: f64,
    clear: f64,
    scanned: u64,
) -> ContactReport<G::State> {
    let touching = matches!(start, Start::Touching | Start::Released);
    let gap = BoundedGap::new(gap, touching, gap.bounds());
    let begin = if let Start::Grazed(time) = start { time.max(0.0).min(span) } else { 0.0 };
    let mut search = Search { gap, begin, span, evaluations: scanned };
    let found = search.run(start, clear);
    ContactReport { found, evaluations: search.evaluations }
}

struct Search<'a, G> {
    gap: BoundedGap<'a, G>,
    /// The start, or a graze that the search goes on from: nothing before it counts.
    begin: f64,
    span: f64,
    evaluations: u64,
}

/// The gap and both bodies at one local time.
#[derive(Clone, Copy)]
struct Sample<I> {
    time: f64,
    gap: GapPoint,
    instant: I,
}

/// What a rise of the gap to rounding level turned out to be.
enum Settled<I, S> {
    Found(Found<S>),
    /// The top of a hump that stays below zero by more than rounding.
    Below(Sample<I>),
}

/// Power of h that is divided out of q at a start on the contact.
#[derive(Clone, Copy, PartialEq)]
enum Lift {
    None,
    Once,
    Twice,
    Thrice,
}

impl<G: Gap> Search<'_, G> {
    #[inline(always)]
    fn evaluate(&mut self, s: f64) -> Sample<G::Instant> {
        self.evaluations += 1;
        let (gap, instant) = self.gap.at(s);
        Sample { time: s, gap, instant }
    }

    #[inline(always)]
    fn touch(&self, sample: &Sample<G::Instant>, offset: f64) -> Touch<G::State> {
        Touch {
            time: sample.time,
            offset,
            gap: sample.gap.later(offset),
            state: self.gap.state(&sample.instant, offset),
        }
    }

    /// `clear`: up to this local time there is no contact.
    fn run(&mut self, start: Start, clear: f64) -> Found<G::State> {
        let mut sample = self.evaluate(if let Start::Grazed(time) = start { time } else { clear });
        if !(self.gap.bounds.fourth.is_finite() && sample.gap.value.is_finite()) {
            return Found::NotFinite;
        }
        let first = sample.time;
        let rest = self.gap.rest;
        let mut lift = match start {
            _ if clear > 0.0 => Lift::None,
            Start::Apart => Lift::None,
            Start::Grazed(_) => Lift::Twice,
            Start::Touching if sample.gap.rate < -rest => Lift::Once,
            Start::Touching if sample.gap.rate <= rest && sample.gap.second < 0.0 => Lift::Twice,
            Start::Touching => return Found::Resting(self.touch(&sample, 0.0)),
            Start::Released if self.leaves(&sample.gap) => Lift::Thrice,
            Start::Released => {
                sample = self.after_flat_release(sample);
                let level = GRAZE_NOISE * self.gap.noise(sample.time);
                if sample.gap.value >= -2.0 * level {
                    return Found::Resting(self.touch(&sample, 0.0));
                }
                Lift::None
            }
        };
        // Beyond this q is useless: its last term alone exceeds what g' can do. It is no root.
        let reach = 3.0 * (self.gap.bounds.rate / self.gap.bounds.fourth).cbrt();
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
                    return Found::Resting(self.touch(&sample, 0.0));
                }
            }
            let left = self.span - s;
            let mut step = self.safe_step(&gap, lift, left.min(reach), graze);
            if step >= left {
                return Found::Clear(self.span);
            }
            let remainder = self.gap.bounds.fourth / 24.0 * step.powi(4);
            let rounding = TAYLOR_PART * self.gap.noise(s + step);
            let tiny = (step < reach && remainder <= rounding) || s + step == s;
            if tiny && lift == Lift::Twice {
                // A top so flat that the step off it ends at rounding level: it goes on as one
                // graze while the gap stays there.
                let level = GRAZE_NOISE * self.gap.noise(s + step);
                step = step.max(self.flat_step(&gap, left.min(reach), level));
                if step >= left {
                    return Found::Clear(self.span);
                }
                sample = self.evaluate((s + step).max(s.next_up()));
                let level = GRAZE_NOISE * self.gap.noise(sample.time);
                let stays = sample.gap.value >= -2.0 * level && sample.gap.rate <= rest;
                if stays && sample.gap.second > 0.0 {
                    // Still on the contact, and pressed on it by now.
                    return Found::Resting(self.touch(&sample, 0.0));
                }
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
            if self.evaluations > SEARCH_PATIENCE
                && -sample.gap.value > PAUSE_NOISE * self.gap.fresh_noise
            {
                // A tip that turns so fast would never be followed to the end of the local flight.
                let crawls = sample.time - first < LEAST_PROGRESS * self.span;
                return if crawls { Found::Stalled } else { Found::Clear(sample.time) };
            }
        }
        if sample.gap.value.is_finite() { Found::Stalled } else { Found::NotFinite }
    }

    /// Largest h <= limit found such that the gap does not rise above the graze level on (0, h),
    /// from a point at that level.
    fn flat_step(&self, point: &GapPoint, limit: f64, graze: f64) -> f64 {
        let GapPoint { value, rate, second, third } = *point;
        let fourth = self.gap.bounds.fourth / 24.0;
        first_root(
            &[value.min(graze) - 2.0 * graze, rate, second / 2.0, third / 6.0, fourth],
            limit,
        )
    }

    /// Largest h <= limit found such that q + graze < 0 on (0, h).
    fn safe_step(&self, point: &GapPoint, lift: Lift, limit: f64, graze: f64) -> f64 {
        let GapPoint { value, rate, second, third } = *point;
        let fourth = self.gap.bounds.fourth / 24.0;
        let c = match lift {
            Lift::None => [value + graze, rate, second / 2.0, third / 6.0, fourth],
            Lift::Once => [rate + self.gap.creep, second / 2.0, third / 6.0, fourth, 0.0],
            Lift::Twice => [second / 2.0, third / 6.0, fourth, 0.0, 0.0],
            Lift::Thrice => [third / 6.0, fourth, 0.0, 0.0, 0.0],
        };
        first_root(&c, limit)
    }

    /// A contact lies so near after `sample`, at about `h`, that the Taylor polynomial of the gap
    /// gives it to rounding; unless it is a graze.
    fn settle(&mut self, sample: &Sample<G::Instant>, h: f64) -> Settled<G::Instant, G::State> {
        let near = sample.gap.later(h);
        // The hump's top by the parabola through (g, g', g'').
        let level = GRAZE_NOISE * self.gap.noise(sample.time + h);
        let height = near.rate * near.rate - 2.0 * near.second * near.value;
        if near.second < 0.0
            && height <= -2.0 * near.second * level
            && let Some(settled) = self.hump(sample, level)
        {
            return settled;
        }
        let (mut touch, settled) = self.meet(sample.time, h);
        if !settled && touch.gap.rate > 0.0 && touch.local_time() > self.span {
            // A gap that stays at rounding level for long: no Taylor polynomial leads so far.
            let end = self.evaluate(self.span);
            if end.gap.value < 0.0 {
                return Settled::Found(Found::Clear(self.span));
            }
            touch = self.meet(end.time, 0.0).0;
        }
        // At a flat top the steps may lead far away, or to before the graze that was gone on from.
        // Where they have come to a root beyond the span, as of a short flight that another contact
        // ends at the same instant, it is the contact: `sample` is early by its rounding.
        let (s, span) = (touch.local_time(), self.span);
        let far = touch.offset > span && !settled;
        let astray = s < self.begin || (s > span && (touch.gap.rate <= 0.0 || far));
        if astray {
            touch = self.touch(sample, h);
        }
        if touch.gap.rate > 0.0 || astray {
            let found = if touch.gap.rate > 0.0 { Found::Contact } else { Found::Graze };
            return Settled::Found(found(touch));
        }
        // The steps have gone past the top of a hump that is at rounding level.
        let past = self.evaluate(touch.local_time().clamp(self.begin, self.span));
        Settled::Found(self.before_top(&past, &touch))
    }

    /// The contact before the top of a hump whose height is rounding, or the graze that it is.
    fn before_top(
        &mut self,
        past: &Sample<G::Instant>,
        touch: &Touch<G::State>,
    ) -> Found<G::State> {
        let GapPoint { rate, second, .. } = past.gap;
        if second >= 0.0 {
            return Found::Graze(*touch);
        }
        let top = self.evaluate((past.time - rate / second).clamp(self.begin, self.span));
        let before = (2.0 * top.gap.value.max(0.0) / -top.gap.second).sqrt();
        let rise = self.evaluate((top.time - before).max(self.begin));
        if rise.gap.rate > 0.0 && before > 0.0 {
            Found::Contact(self.touch(&rise, 0.0))
        } else {
            Found::Graze(self.touch(&top, 0.0))
        }
    }

    /// The contact that lies at about `offset` after `time`, and whether the steps have come to it:
    /// from afar they may leap over a double root.
    #[inline(always)]
    fn meet(&mut self, time: f64, mut offset: f64) -> (Touch<G::State>, bool) {
        // Once more with care: whatever is lost here stays in the motion.
        let mut sample = self.evaluate(time);
        for _ in 0..SETTLE_STEPS {
            let higher = self.gap.higher(&sample.instant);
            let left;
            (offset, left) = sample.gap.rise(higher, offset);
            // Near a double root it may lie further than the polynomials are exact.
            let remainder = left + self.gap.remainder(offset);
            let time = sample.time + offset;
            let inside = (0.0..=self.span).contains(&time);
            let settled = remainder <= SETTLE_PART * self.gap.noise(time.max(0.0));
            if settled || !inside {
                return (self.touch(&sample, offset), settled);
            }
            sample = self.evaluate(time);
            offset = 0.0;
        }
        (self.touch(&sample, offset), false)
    }

    /// Top of the hump ahead, unless it is higher than `level`.
    fn hump(
        &mut self,
        sample: &Sample<G::Instant>,
        level: f64,
    ) -> Option<Settled<G::Instant, G::State>> {
        let mut top = *sample;
        for _ in 0..12 {
            if top.gap.second >= 0.0 {
                return None;
            }
            let next = (top.time - top.gap.rate / top.gap.second).clamp(self.begin, self.span);
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
            Settled::Found(Found::Clear(self.span))
        } else if top.gap.value < -level {
            Settled::Below(top)
        } else {
            Settled::Found(Found::Graze(self.touch(&top, 0.0)))
        })
    }
}
