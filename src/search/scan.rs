//! First pass of the contact search: the gap at equal steps of a flight, eight at a time.
//!
//! On each step the gap function is its quintic Hermite interpolant plus the remainder g^(6) (t -
//! a)^3 (t - b)^3/720. In Bernstein form of degree 6 on [a, b] the remainder is a part of the
//! middle coefficient, at most |g^(6)| h^6/14400; all seven coefficients below zero prove that the
//! step is free of contact. A step for which that fails is cut into eight. A sign change on a step
//! with g' > 0, proven in the same way from the interpolant's derivative, is the first contact; on
//! a step that ends beyond what is searched the sign there decides. What stays unsure is left to
//! the careful search (first_contact.rs), which alone decides about grazes, rest and release. The
//! jets at the ends of steps come from the model, the rest is arithmetic on arrays; its rounding is
//! allowed for, and can only make steps unsure (docs/contact-detection.md).

#![allow(clippy::inline_always)] // all of a scan must be compiled with the same instructions
#![allow(clippy::needless_range_loop)] // loops over lanes read best with their index

mod quintic;
mod short_hop;

use quintic::{Quintic, root};
use short_hop::short_hop;

use crate::numerics::lanes::{LANES, Lanes, lanes_of};
use crate::search::steps::{Jet, Jets, LEVELS, ScanStart, SteppedGap, Weights};
use crate::search::tolerances::{FREE_SPANS, SCAN_REMAINDER, SCAN_REST, SCAN_SLACK, SCAN_SPANS};

/// Halvings by which an unsure step is cut into eight.
const CUT: usize = 3;

/// What a scan can say of a flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Scan {
    /// No contact up to this local time, which may be several spans.
    Clear(f64),
    /// The first contact, a simple root, lies on a step.
    RisingStep(RisingStep),
    /// The first contact is the end of a short hop, near this local time.
    Hop(f64),
    /// No contact up to this local time; on from there with care.
    Unsure(f64),
}

/// A step on which the gap rises through zero, once.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct RisingStep {
    /// Local time of its start.
    pub after: f64,
    /// Its length.
    pub h: f64,
    /// The jets at its ends.
    pub start: Jet,
    pub end: Jet,
}

lanes_of! {
    /// Several rising steps.
    RisingSteps of RisingStep {
        after: after,
        h: h,
        start_value: start.value,
        start_rate: start.rate,
        start_second: start.second,
        end_value: end.value,
        end_rate: end.rate,
        end_second: end.second,
    }
}

impl RisingStep {
    /// Local time near the contact.
    #[inline(always)]
    pub fn near(&self) -> f64 {
        self.after + self.h * root(&self.start, &self.end, self.h)
    }
}

/// Scans a flight for its first contact, and counts evaluations of the gap. `touching`: it starts
/// on the contact.
#[inline(always)]
pub(crate) fn scan<G: SteppedGap>(
    gap: &G,
    scan_start: &ScanStart,
    touching: bool,
    span: f64,
) -> (Scan, u64) {
    let mut scanner = Scanner::<G::Place>::default();
    if let Some(found) = scanner.begin(gap, scan_start, touching, span) {
        return (found, scanner.evaluations);
    }
    loop {
        let stride = scanner.stride(gap);
        if let Some(found) = scanner.judge(gap, &stride) {
            return (found, scanner.evaluations);
        }
    }
}

/// A scan in the making: where it stands, and what proves a step free.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scanner<P> {
    pub evaluations: u64,
    /// Local time up to which the flight is free.
    s: f64,
    /// The bodies and the jet there.
    place: P,
    start: Jet,
    /// Whether that is the start of a flight on the contact.
    touching: bool,
    level: usize,
    remainder: f64,
    coarse: usize,
    coarse_remainder: f64,
    slack: f64,
    span: f64,
    /// Local time up to which a contact is met in this local flight.
    reach: f64,
    /// Local time up to which the bounds hold.
    end: f64,
}

/// Eight steps on: states and jets, and what proves the steps free.
#[derive(Debug, Clone, Default)]
pub(crate) struct Stride<Q> {
    places: Q,
    jets: Jets,
    /// Of each step ([`Jets::highest`]).
    highest: Lanes,
}

impl<P: Copy + Default> Scanner<P> {
    /// The start of a scan: the length of the steps; or the outcome.
    #[inline(always)]
    pub fn begin<G: SteppedGap<Place = P>>(
        &mut self,
        gap: &G,
        scan_start: &ScanStart,
        touching: bool,
        span: f64,
    ) -> Option<Scan> {
        let &ScanStart { mut start, bounds } = scan_start;
        let rate = bounds.rate;
        let extent = gap.extent();
        let slack = SCAN_SLACK * (extent + rate * span);
        self.evaluations = 0;
        let clear = if touching { start.rate < -SCAN_REST * rate } else { start.value < -slack };
        if !touching && clear && gap.never_meets(slack) {
            return Some(Scan::Clear(FREE_SPANS * span));
        }
        if !(clear && gap.steps_hold(SCAN_SPANS * rate * span)) {
            return Some(Scan::Unsure(0.0));
        }
        // Halving the step takes a 64th of the remainder; a NaN or too large a bound finds no
        // level.
        let allowed = SCAN_REMAINDER * (extent + rate * gap.step(0));
        let mut remainder = bounds.sixth * gap.remainder_factor();
        let mut coarse = 0;
        while remainder > allowed || remainder.is_nan() {
            coarse += 1;
            remainder *= 1.0 / 64.0;
            if coarse + CUT > LEVELS {
                return Some(Scan::Unsure(0.0));
            }
        }
        (self.coarse, self.coarse_remainder) = (coarse, remainder);
        let mut level = coarse;
        if touching {
            start.value = 0.0;
            // A hop lasts about this long.
            let hop = -2.0 * start.rate / start.second;
            if let Some(near) = short_hop(gap, span, start.second, hop, bounds.fourth) {
                return Some(Scan::Hop(near));
            }
            while hop > 0.0 && level + 1 < LEVELS && 8.0 * gap.step(level + 1) > 1.5 * hop {
                level += 1;
                remainder *= 1.0 / 64.0;
            }
        }
        (self.level, self.remainder) = (level, remainder);
        self.end = gap.bounds_hold();
        self.reach = gap.reach().max(span);
        (self.span, self.slack, self.touching, self.start) = (span, slack, touching, start);
        self.s = 0.0;
        self.place = gap.place();
        None
    }

    /// The next eight steps. Nothing in it depends on what is found, so that several scans overlap.
    #[inline(always)]
    pub fn stride<G: SteppedGap<Place = P>>(&mut self, gap: &G) -> Stride<G::Places> {
        self.evaluations += LANES as u64;
        let (places, jets) = gap.eight_steps(self.level, &self.place);
        let weights = gap.weights(self.level);
        let highest = jets.highest(&self.start, weights, self.remainder, self.slack, self.touching);
        Stride { places, jets, highest }
    }

    /// What follows from a stride: the outcome, or `None` if another stride is needed.
    #[inline(always)]
    pub fn judge<G: SteppedGap<Place = P>>(
        &mut self,
        gap: &G,
        stride: &Stride<G::Places>,
    ) -> Option<Scan> {
        let Stride { places, jets, highest } = stride;
        let j = first_unsure(highest);
        let h = gap.step(self.level);
        if j == LANES {
            self.s += h * LANES as f64;
            if self.s >= self.end {
                return Some(Scan::Clear(self.s));
            }
            (self.place, self.start) = (G::place_after(places, LANES - 1), jets.get(LANES - 1));
            (self.level, self.remainder) = (self.coarse, self.coarse_remainder);
            self.touching = false;
            return None;
        }
        // Not read from where it has just been written: a wide load would wait for that.
        let mut start = self.start;
        if j > 0 {
            self.s += h * j as f64;
            start = jets.get(j - 1);
            (self.place, self.start) = (G::place_after(places, j - 1), start);
            self.touching = false;
        }
        let s = self.s;
        if s >= self.reach {
            // Met with the angles reduced, in a local flight from here.
            return Some(Scan::Clear(s));
        }
        let next = jets.get(j);
        let weights = gap.weights(self.level);
        if !self.touching && is_rising_step(&start, &next, weights, self.remainder, self.slack) {
            let rise = RisingStep { after: s, h, start, end: next };
            let left = self.reach - s;
            if left >= h {
                return Some(Scan::RisingStep(rise));
            }
            // The step ends beyond: on which side of `reach` the contact lies says the sign of the
            // gap there, and not the interpolant's root, which may be off by a good part of a
            // coarse step.
            let there = Quintic::new(&rise.start, &rise.end, h).value(left / h);
            let doubt = self.remainder + self.slack;
            if there > doubt {
                return Some(Scan::RisingStep(rise));
            }
            if there < -doubt {
                return Some(Scan::Clear(self.reach));
            }
        }
        if self.level + CUT >= LEVELS {
            // With care from there; beyond one local flight in one of its own, whose rounding is
            // less.
            return Some(if s < self.span { Scan::Unsure(s) } else { Scan::Clear(s) });
        }
        self.level += CUT;
        self.remainder *= 1.0 / 262_144.0;
        None
    }
}

/// What the Bernstein coefficients of a step take from one of its ends: the two next to the value
/// there, and its part of the middle one.
#[inline(always)]
fn end_coefficients(
    Jet { value: g, rate, second }: Jet,
    w: &Weights,
    direction: f64,
) -> ([f64; 2], f64) {
    let outward = direction * rate;
    let curved = w.thirtieth.mul_add(second, g);
    let inner = [w.sixth.mul_add(outward, g), w.third.mul_add(outward, curved)];
    let middle = w.fifth.mul_add(outward, w.fortieth.mul_add(second, 0.5 * g));
    (inner, middle)
}

impl Jets {
    /// Of each step, the highest of its Bernstein coefficients, and `slack`: below zero where the
    /// step is free by more than rounding. `touching`: g = 0 at the start, which is no contact.
    ///
    /// Every step does the same, so that compilers turn all of it into whole registers: what is
    /// moved from step to step are the jets, and which step is the first that is not free is read
    /// later, from memory ([`first_unsure`]).
    #[inline(always)]
    fn highest(
        &self,
        start: &Jet,
        w: &Weights,
        remainder: f64,
        slack: f64,
        touching: bool,
    ) -> Lanes {
        let (mut right, mut left) = (self.clone(), Self::default());
        for j in 0..LANES {
            right.value[j] += slack;
        }
        // The left end of a step is the right end of the one before.
        let first = start.value + slack;
        left.value = after(first, right.value);
        left.rate = after(start.rate, right.rate);
        left.second = after(start.second, right.second);
        let at_left = after(if touching { f64::NEG_INFINITY } else { first }, right.value);
        let mut highest = [0.0; LANES];
        for j in 0..LANES {
            let (left, left_middle) = end_coefficients(left.get(j), w, 1.0);
            let (inner, right_middle) = end_coefficients(right.get(j), w, -1.0);
            let middle = remainder + (left_middle + right_middle);
            let left = larger(larger(at_left[j], left[0]), larger(left[1], middle));
            highest[j] = larger(left, larger(right.value[j], larger(inner[0], inner[1])));
        }
        highest
    }
}

/// The first that is not below zero; their number if there is none.
#[inline(always)]
fn first_unsure(highest: &Lanes) -> usize {
    // The signs, a bit for each step: comparisons would be told apart one by one.
    let mut below = 0u64;
    for j in 0..LANES {
        below |= (highest[j].to_bits() >> 63) << j;
    }
    (!below).trailing_zeros() as usize
}

/// The lanes moved up by one, `first` before them.
#[inline(always)]
fn after(first: f64, [a, b, c, d, e, f, g, _]: Lanes) -> Lanes {
    [first, a, b, c, d, e, f, g]
}

/// One vector instruction, unlike `f64::max`. All is finite here: the bounds are.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// One vector instruction, unlike `f64::min`.
#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Whether the gap rises through zero, and all the way, on a step: the Bernstein coefficients of
/// the interpolant's derivative (times h/5) exceed what the remainder may take from it,
/// sqrt(5)/30000 |g^(6)| h^5 (Agarwal & Wong (1993), Error Inequalities in Polynomial
/// Interpolation, section 1.2), here from `remainder` = |g^(6)| h^6/14400.
#[inline(always)]
fn is_rising_step(start: &Jet, end: &Jet, w: &Weights, remainder: f64, slack: f64) -> bool {
    const PART: f64 = 0.214_663;
    let (first, last) = (w.fifth * start.rate, w.fifth * end.rate);
    let (bend, last_bend) = (2.0 * w.fortieth * start.second, 2.0 * w.fortieth * end.second);
    let middle = (end.value - start.value) - 2.0 * (first + last) + (last_bend - bend);
    let ends = smaller(smaller(first, first + bend), smaller(last - last_bend, last));
    let least = smaller(ends, middle);
    start.value < -slack && end.value > slack && least > PART * remainder + slack
}
