//! First pass of the contact search: the gap at equal steps of a flight, eight at a time.
//!
//! On each step the gap function is its quintic Hermite interpolant plus the remainder
//! g^(6) (t - a)^3 (t - b)^3/720. In Bernstein form of degree 6 on [a, b] the remainder is a part of the
//! middle coefficient, at most |g^(6)| h^6/14400; all seven coefficients below zero prove that the step is
//! free of contact. A step for which that fails is cut into eight. A sign change on a step with g' > 0, proven
//! in the same way from g', g'' at its ends and a bound of g^(5), is the first contact. What stays
//! unsure is left to the careful search (contact.rs), which alone decides about grazes, rest and
//! release. The states come from tables (flight/table.rs), the rest is arithmetic on arrays; its
//! rounding is allowed for, and can only make steps unsure (docs/contact-detection.md).

#![allow(clippy::inline_always)] // all of a scan must be compiled with the same instructions
#![allow(clippy::needless_range_loop)] // loops over lanes read best with their index

use std::marker::PhantomData;

use crate::flight::{Flight, FreeMotion, LEVELS, Point, Table};
use crate::gap::{GapBounds, Geometry};
use crate::lanes::{LANES, Lanes, MOST_TURNED};
use crate::tolerance::{BOUND_MARGIN, SCAN_REMAINDER, SCAN_REST, SCAN_SLACK, SCAN_SPANS};

/// Halvings by which an unsure step is cut into eight.
const CUT: usize = 3;

/// What a scan can say of a flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Scan {
    /// No contact up to this local time, which may be several spans.
    Clear(f64),
    /// The first contact, a simple root, lies near one local time and after another.
    Contact { after: f64, near: f64 },
    /// No contact up to this local time; on from there with care.
    Unsure(f64),
}

/// Outcome and cost of a scan, and what it knows of the flight.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ScanReport {
    pub found: Scan,
    pub evaluations: u64,
    pub bounds: GapBounds,
}

/// Gap function and its first two derivatives.
type Jet = [f64; 3];

/// The jets at 0, h ... 8h.
struct Samples {
    value: [f64; LANES + 1],
    rate: [f64; LANES + 1],
    second: [f64; LANES + 1],
}

/// A scan, compiled for each kind of vector instructions.
struct Job<'a, G> {
    motion: &'a FreeMotion,
    flight: &'a Flight,
    delta: f64,
    touching: bool,
    span: f64,
    geometry: PhantomData<G>,
}

/// Scans a flight for its first contact with the widest vector instructions of this machine.
/// `touching`: it starts on the contact.
pub(crate) fn scan<G: Geometry>(
    motion: &FreeMotion,
    flight: &Flight,
    delta: f64,
    touching: bool,
    span: f64,
) -> ScanReport {
    pulp::Arch::new().dispatch(Job::<G> {
        motion,
        flight,
        delta,
        touching,
        span,
        geometry: PhantomData,
    })
}

impl<G: Geometry> pulp::NullaryFnOnce for Job<'_, G> {
    type Output = ScanReport;

    #[inline(always)]
    fn call(self) -> ScanReport {
        let Self { motion, flight, .. } = self;
        let p = motion.pendulum.derivative_bounds(&flight.pendulum);
        let o = motion.oscillator.derivative_bounds(&flight.oscillator);
        let [fourth, fifth, sixth] = G::high_derivatives(&p);
        let bounds = GapBounds {
            pendulum_rate: p[0],
            rate: p[0] + o[0],
            fourth: (fourth + o[3]) * BOUND_MARGIN,
        };
        let mut evaluations = 0;
        let found = self.run(&bounds, fifth + o[4], sixth + o[5], &mut evaluations);
        ScanReport { found, evaluations, bounds }
    }
}

impl<G: Geometry> Job<'_, G> {
    #[inline(always)]
    fn run(&self, bounds: &GapBounds, fifth: f64, sixth: f64, evaluations: &mut u64) -> Scan {
        let &Self { motion, flight, delta, mut touching, span, .. } = self;
        let state = &flight.state;
        let place = state.x1.abs() + state.x2.abs() + delta.abs();
        let slack = SCAN_SLACK * (place + bounds.rate * span);
        let mut point =
            Point { x1: state.x1, v1: state.v1, x2: state.x2, v2: state.v2, psi: flight.start };
        let mut start = self.jet(&point);
        let clear = if touching { start[1] < -SCAN_REST * bounds.rate } else { start[0] < -slack };
        let turned = state.x1.abs() + SCAN_SPANS * bounds.rate * span;
        if !(clear && (turned <= MOST_TURNED || !G::TURNS)) {
            return Scan::Unsure(0.0);
        }
        // Halving the step takes a 64th of the remainder; a NaN or too large a bound finds no level.
        let first = sixth * motion.step(0).powi(6) / 14_400.0;
        let allowed = SCAN_REMAINDER * (place + bounds.rate * motion.step(0));
        let remainder = |level: usize| first * (1.0 / 64f64).powi(level as i32);
        let Some(coarse) = (0..=LEVELS - CUT).find(|&level| remainder(level) <= allowed) else {
            return Scan::Unsure(0.0);
        };
        let mut level = coarse;
        if touching {
            start[0] = 0.0;
            // A hop lasts about this long.
            let hop = -2.0 * start[1] / start[2];
            while hop > 0.0 && level + 1 < LEVELS && 8.0 * motion.step(level + 1) > 1.5 * hop {
                level += 1;
            }
        }
        // The bounds of steady motions hold for ever, others for one span.
        let steady = motion.pendulum.is_steady() && motion.oscillator.is_steady();
        let end = if steady { SCAN_SPANS * span } else { span };
        let mut s = 0.0;
        loop {
            let table = motion.table(level);
            let h = table.step;
            *evaluations += LANES as u64;
            let samples = self.sample(table, &point, &start);
            let Some(j) = samples.first_unsure(h, remainder(level), slack, touching) else {
                s += h * LANES as f64;
                if s >= end {
                    return Scan::Clear(s);
                }
                (point, start) = (table.point(&point, LANES - 1), samples.jet(LANES));
                (level, touching) = (coarse, false);
                continue;
            };
            if j > 0 {
                s += h * j as f64;
                (point, start, touching) = (table.point(&point, j - 1), samples.jet(j), false);
            }
            if s >= span {
                // Met with the angles reduced, in a local flight from here.
                return Scan::Clear(s);
            }
            let next = samples.jet(j + 1);
            if !touching && rises(&start, &next, h, fifth, slack) {
                let near = s + h * root(&start, &next, h);
                return if near <= span {
                    Scan::Contact { after: s, near }
                } else {
                    Scan::Clear(span)
                };
            }
            if level + CUT >= LEVELS {
                return Scan::Unsure(s);
            }
            level += CUT;
        }
    }

    #[inline(always)]
    fn jet(&self, p: &Point) -> Jet {
        let Self { motion, delta, .. } = self;
        let a1 = motion.pendulum.acceleration(p.x1, p.v1, p.psi.cos);
        let a2 = motion.oscillator.acceleration(p.x2, p.v2, p.psi.cos);
        let tip = G::tip_fast(p.x1, p.v1, a1);
        [tip[0] - p.x2 - delta, tip[1] - p.v2, tip[2] - a2]
    }

    #[inline(always)]
    fn sample(&self, table: &Table, from: &Point, first: &Jet) -> Samples {
        let Self { motion, delta, .. } = self;
        let mut samples = Samples {
            value: [first[0]; LANES + 1],
            rate: [first[1]; LANES + 1],
            second: [first[2]; LANES + 1],
        };
        let states = table.states(from);
        for j in 0..LANES {
            let (x1, v1, x2, v2) = (states.x1[j], states.v1[j], states.x2[j], states.v2[j]);
            let a1 = motion.pendulum.acceleration(x1, v1, states.cos_psi[j]);
            let a2 = motion.oscillator.acceleration(x2, v2, states.cos_psi[j]);
            let tip = G::tip_fast(x1, v1, a1);
            samples.value[j + 1] = tip[0] - x2 - delta;
            samples.rate[j + 1] = tip[1] - v2;
            samples.second[j + 1] = tip[2] - a2;
        }
        samples
    }
}

impl Samples {
    #[inline(always)]
    fn jet(&self, j: usize) -> Jet {
        [self.value[j], self.rate[j], self.second[j]]
    }

    /// The first step on which not all Bernstein coefficients are below zero by more than rounding.
    #[inline(always)]
    fn first_unsure(&self, h: f64, remainder: f64, slack: f64, touching: bool) -> Option<usize> {
        let (mut left, mut highest): (Lanes, Lanes) = ([0.0; LANES], [0.0; LANES]);
        for j in 0..LANES {
            let (g, rate, second) = (self.value[j], h * self.rate[j], h * h * self.second[j]);
            let inner = (g + rate / 6.0).max(g + rate / 3.0 + second / 30.0);
            left[j] = inner.max(g);
            highest[j] = 0.5 * g + 0.2 * rate + 0.025 * second + remainder;
        }
        if touching {
            // g = 0 at the start itself is no contact.
            let (rate, second) = (h * self.rate[0], h * h * self.second[0]);
            left[0] = (rate / 6.0).max(rate / 3.0 + second / 30.0);
        }
        for j in 0..LANES {
            let (g, rate, second) =
                (self.value[j + 1], h * self.rate[j + 1], h * h * self.second[j + 1]);
            let inner = (g - rate / 6.0).max(g - rate / 3.0 + second / 30.0);
            let middle = highest[j] + (0.5 * g - 0.2 * rate + 0.025 * second);
            highest[j] = left[j].max(middle).max(inner.max(g));
        }
        highest.iter().position(|&coefficient| coefficient.is_nan() || coefficient >= -slack)
    }
}

/// Whether the gap rises through zero, and all the way, on a step: the Bernstein coefficients of g',
/// of degree 4, are above zero.
#[inline(always)]
fn rises(start: &Jet, end: &Jet, h: f64, fifth: f64, slack: f64) -> bool {
    let (a, b) = (h * start[2], h * end[2]);
    let middle = 0.5 * ((start[1] + a / 3.0) + (end[1] - b / 3.0)) - fifth * h.powi(4) / 144.0;
    let inner = (start[1] + 0.25 * a).min(end[1] - 0.25 * b).min(middle);
    start[0] < -slack && end[0] > slack && start[1].min(end[1]).min(inner) > 0.0
}

/// Root of the quintic Hermite interpolant of a rising step, as a part of the step.
#[inline(always)]
fn root(start: &Jet, end: &Jet, h: f64) -> f64 {
    let (c0, c1, c2) = (start[0], h * start[1], 0.5 * h * h * start[2]);
    let value = end[0] - c0 - c1 - c2;
    let rate = h * end[1] - c1 - 2.0 * c2;
    let second = h * h * end[2] - 2.0 * c2;
    let c3 = 10.0 * value - 4.0 * rate + 0.5 * second;
    let c4 = -15.0 * value + 7.0 * rate - second;
    let c5 = 6.0 * value - 3.0 * rate + 0.5 * second;
    let mut t = c0 / (c0 - end[0]);
    for _ in 0..3 {
        let value = c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))));
        let rate = c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5)));
        t = (t - value / rate).clamp(0.0, 1.0);
    }
    t
}
