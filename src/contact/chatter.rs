//! Complete chatter: infinitely many impacts in finite time, carried to their accumulation point
//! (docs/theory.md, section 5).
//!
//! With the free gap acceleration g'' > 0 and impacts that shrink u by a ratio q < 1 (q = r to
//! leading order in `slip` and `frictionless`, else measured) the flights shrink by q too, and the
//! sequence ends after T = 2 u_post/(g''(1 - q)) to leading order. Time and state at the impacts
//! of one sequence are smooth functions of u, because the impact map is smooth and u = 0 is its
//! fixed points: so they are extrapolated to u = 0 by the polynomial through the last samples
//! (Neville's scheme), with an error O(u^n) for n samples. The larger one of the last two
//! differences between orders, with a factor of safety, is the stated error.
//!
//! Where slip reverses in each impact they are not smooth (x1'/u has a ratio of its own): such
//! sequences are followed bounce by bounce.

use serde::{Deserialize, Serialize};

use crate::flight::Drive;
use crate::impact::{Impact, RegimeKind};
use crate::model::state::{Clock, State};
use crate::numerics::tolerance::{
    CHATTER_IMPACTS, CHATTER_NOISE, CHATTER_RATIO_RTOL, CHATTER_SAFETY, CHATTER_SPACING, EPS,
};

/// Most samples, and so the highest order of the extrapolation.
const MOST: usize = 8;
/// Fewest, so that three orders can be compared and all mean something.
const FEWEST: usize = 4;

/// What tells sequences of different kinds apart: regime, direction of slip, side of sin x1 = 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Character {
    regime: RegimeKind,
    forward: bool,
    upper: bool,
}

/// Time and state just after an impact with separation velocity `u`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Sample {
    u: f64,
    clock: Clock,
    x1: f64,
    v1: f64,
    v2: f64,
}

/// Memory of the last impacts.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct ChatterMonitor {
    /// Approach velocity of the last impact, 0 before the first.
    last: f64,
    ratio: f64,
    kept: u32,
    /// Whether the tip stopped during the last impact.
    pub stopped: bool,
    character: Option<Character>,
    samples: [Option<Sample>; MOST],
}

/// What of the memory decides about the next impacts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ChatterKey {
    last: u64,
    ratio: u64,
    kept: u32,
    stopped: bool,
}

/// Where a chatter sequence accumulates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limit {
    /// Time from the last impact to the accumulation point.
    pub time: f64,
    /// x1 and x1' there.
    pub x1: f64,
    pub v1: f64,
    /// Ratio by which u shrinks.
    pub ratio: f64,
    /// Error of time and state, without rounding.
    pub error: f64,
}

impl Limit {
    /// Rounding of the limit, and of the time it takes from a separation velocity that has the
    /// rounding of the velocities: T = 2 u/(g''(1 - q)).
    pub fn rounding(&self, state: &State, second: f64) -> f64 {
        let size = state.to_array().iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        // A rounded x1 turns x1' cos x1 by |x1 x1'| roundings.
        let speed = state.v1.abs() * (1.0 + state.x1.abs()) + state.v2.abs();
        CHATTER_NOISE * EPS * (size + speed / (second * (1.0 - self.ratio)))
    }
}

impl ChatterMonitor {
    /// Takes an impact; returns whether enough of them have kept one ratio.
    #[inline]
    pub fn observe(&mut self, regime: RegimeKind, approach: f64, restitution: f64) -> bool {
        let slides = matches!(regime, RegimeKind::Frictionless | RegimeKind::Slip);
        let measured = if self.last > 0.0 { approach / self.last } else { f64::INFINITY };
        let predicted = if slides { restitution } else { self.ratio };
        let keeps = measured < 1.0
            && predicted < 1.0
            && (measured - predicted).abs() <= CHATTER_RATIO_RTOL * predicted;
        self.kept = if keeps { self.kept + 1 } else { 0 };
        if !keeps && self.samples[0].is_some() {
            (self.character, self.samples) = (None, [None; MOST]);
        }
        self.stopped = !slides;
        self.ratio = if measured.is_finite() { measured } else { 0.0 };
        self.last = approach;
        self.kept >= CHATTER_IMPACTS
    }

    /// What decides about the next impacts; `None` within a sequence, where its samples do too.
    pub fn chatter_key(&self) -> Option<ChatterKey> {
        (self.kept < CHATTER_IMPACTS).then_some(ChatterKey {
            last: self.last.to_bits(),
            ratio: self.ratio.to_bits(),
            kept: self.kept,
            stopped: self.stopped,
        })
    }

    /// Ratio of the last bounces if they shrink as chatter does, and so does this one, which leaves
    /// the contact with `separation`; a plastic impact leaves it with 0 or with rounding.
    pub fn shrinks(&self, separation: f64) -> Option<f64> {
        let continues = separation > 0.5 * self.ratio * self.last;
        (self.kept > 0 && continues).then_some(self.ratio)
    }

    /// Samples the state just after an impact of a sequence that keeps its ratio, and extrapolates
    /// it; `None` while there are too few samples.
    pub fn extrapolate(
        &mut self,
        drive: &Drive,
        clock: Clock,
        state: &State,
        impact: &Impact,
    ) -> Option<Limit> {
        let frictional = impact.regime.kind() != RegimeKind::Frictionless;
        let character = Some(Character {
            regime: impact.regime.kind(),
            forward: frictional && state.v1 > 0.0,
            upper: frictional && state.x1.sin() > 0.0,
        });
        let u = -impact.separation_velocity;
        if matches!(
            impact.regime.kind(),
            RegimeKind::ReversalInApproach | RegimeKind::ReversalInRestitution
        ) {
            return None;
        }
        if character != self.character || self.kept == CHATTER_IMPACTS {
            self.character = character;
            self.samples = [None; MOST];
        }
        let spaced = self.samples[0].is_none_or(|newest| u <= CHATTER_SPACING * newest.u);
        if !spaced || u <= 0.0 {
            return None;
        }
        self.samples.rotate_right(1);
        self.samples[0] = Some(Sample { u, clock, x1: state.x1, v1: state.v1, v2: state.v2 });
        let count = self.samples.iter().flatten().count();
        if count < FEWEST {
            return None;
        }
        let mut nodes = [0.0; MOST];
        let mut values = [[0.0; 4]; MOST];
        for (i, sample) in self.samples.iter().flatten().enumerate() {
            nodes[i] = sample.u;
            let time = drive.until(clock, sample.clock).value();
            // Differences from the newest sample: their rounding is that of the state.
            values[i] = [time, sample.x1 - state.x1, sample.v1 - state.v1, sample.v2 - state.v2];
        }
        let high = at_zero(&nodes[..count], &values);
        let low = at_zero(&nodes[..count - 1], &values);
        let lower = at_zero(&nodes[..count - 2], &values);
        let difference = |a: &[f64; 4], b: &[f64; 4]| {
            a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let sliding = matches!(impact.regime.kind(), RegimeKind::Frictionless | RegimeKind::Slip);
        let limit = Limit {
            time: high[0],
            x1: state.x1 + high[1],
            // A tip that stopped during the impacts is at rest in the limit.
            v1: if sliding { state.v1 + high[2] } else { 0.0 },
            ratio: self.ratio,
            error: CHATTER_SAFETY * difference(&high, &low).max(difference(&low, &lower)),
        };
        // Slip must go on to the end: x1' keeps its sign, and the tip its side of sin x1 = 0.
        let keeps = impact.regime.kind() != RegimeKind::Slip
            || (limit.v1 * state.v1 > 0.0
                && high[2].abs() < limit.v1.abs()
                && (limit.x1.sin() > 0.0) == (state.x1.sin() > 0.0));
        (limit.time > 0.0 && keeps).then_some(limit)
    }
}

/// The polynomials through (u_i, y_i), newest first, at u = 0 (Neville's scheme).
fn at_zero(nodes: &[f64], values: &[[f64; 4]; MOST]) -> [f64; 4] {
    let mut table = *values;
    for level in 1..nodes.len() {
        for i in 0..nodes.len() - level {
            let (near, far) = (nodes[i], nodes[i + level]);
            let (upper, lower) = (table[i], table[i + 1]);
            // y + (y - y_far) u_near/(u_far - u_near).
            let weight = near / (far - near);
            table[i] = std::array::from_fn(|c| upper[c] + (upper[c] - lower[c]) * weight);
        }
    }
    table[0]
}
