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
//! Where slip reverses in each impact they are not smooth (w/u has a ratio of its own): such
//! sequences are followed bounce by bounce.
//!
//! Nothing here knows the bodies: an impact is seen in contact coordinates, and what else is to be
//! carried to the limit is a list of numbers.

use serde::{Deserialize, Serialize};

use crate::contact::tolerances::{
    CHATTER_IMPACTS, CHATTER_NOISE, CHATTER_RATIO_RTOL, CHATTER_SAFETY, CHATTER_SPACING,
};
use crate::flight::Drive;
use crate::impact::RegimeKind;
use crate::model::state::Clock;
use crate::numerics::EPS;
use crate::numerics::extrapolation::at_zero;

/// Most samples, and so the highest order of the extrapolation.
const MOST: usize = 8;
/// Fewest, so that three orders can be compared and all mean something.
const FEWEST: usize = 4;

/// Numbers carried to the limit beside the time and the velocity of slip.
const OTHERS: usize = 2;

/// What tells sequences of different kinds apart: regime, direction of slip, side of h = 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Character {
    regime: RegimeKind,
    forward: bool,
    upper: bool,
}

/// What an impact leaves behind.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Bounce {
    pub regime: RegimeKind,
    /// u just after it, positive.
    pub separation: f64,
    pub clock: Clock,
    /// w.
    pub slip: f64,
    /// Whether h > 0.
    pub upper: bool,
    /// What else is to be known in the limit.
    pub others: [f64; OTHERS],
}

impl Bounce {
    fn character(&self) -> Character {
        let frictional = self.regime != RegimeKind::Frictionless;
        Character {
            regime: self.regime,
            forward: frictional && self.slip > 0.0,
            upper: frictional && self.upper,
        }
    }
}

/// Memory of the last impacts.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct ChatterMonitor {
    /// Approach velocity of the last impact, 0 before the first.
    last: f64,
    ratio: f64,
    kept: u32,
    /// Whether slip stopped during the last impact.
    pub stopped: bool,
    character: Option<Character>,
    samples: [Option<Bounce>; MOST],
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
    /// w there, and the others.
    pub slip: f64,
    pub others: [f64; OTHERS],
    /// Ratio by which u shrinks.
    pub ratio: f64,
    /// Error of time and state, without rounding.
    pub error: f64,
}

impl Limit {
    /// Rounding of the limit, where coordinates have this size and the separation velocity is the
    /// difference of velocities of this `speed`: T = 2 u/(g''(1 - q)).
    pub fn rounding(&self, size: f64, speed: f64, second: f64) -> f64 {
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

    /// Samples an impact of a sequence that keeps its ratio, and extrapolates to u = 0; `None`
    /// while there are too few samples.
    pub fn extrapolate(&mut self, drive: &Drive, bounce: &Bounce) -> Option<Limit> {
        let (regime, character) = (bounce.regime, Some(bounce.character()));
        if matches!(regime, RegimeKind::ReversalInApproach | RegimeKind::ReversalInRestitution) {
            return None;
        }
        if character != self.character || self.kept == CHATTER_IMPACTS {
            self.character = character;
            self.samples = [None; MOST];
        }
        let u = bounce.separation;
        let spaced = self.samples[0].is_none_or(|newest| u <= CHATTER_SPACING * newest.separation);
        if !spaced || u <= 0.0 {
            return None;
        }
        self.samples.rotate_right(1);
        self.samples[0] = Some(*bounce);
        let count = self.samples.iter().flatten().count();
        if count < FEWEST {
            return None;
        }
        let mut nodes = [0.0; MOST];
        let mut values = [[0.0; OTHERS + 2]; MOST];
        for (i, sample) in self.samples.iter().flatten().enumerate() {
            nodes[i] = sample.separation;
            let time = drive.until(bounce.clock, sample.clock).value();
            // Differences from the newest sample: their rounding is that of the state.
            let [first, second] = [0, 1].map(|c| sample.others[c] - bounce.others[c]);
            values[i] = [time, sample.slip - bounce.slip, first, second];
        }
        let through = |count: usize| at_zero(&nodes[..count], values);
        let (high, low, lower) = (through(count), through(count - 1), through(count - 2));
        let difference = |a: &[f64; OTHERS + 2], b: &[f64; OTHERS + 2]| {
            a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let slides = matches!(regime, RegimeKind::Frictionless | RegimeKind::Slip);
        let [time, slip, others @ ..] = high;
        let limit = Limit {
            time,
            // Slip that stopped during the impacts is at rest in the limit.
            slip: if slides { bounce.slip + slip } else { 0.0 },
            others: [0, 1].map(|c| bounce.others[c] + others[c]),
            ratio: self.ratio,
            error: CHATTER_SAFETY * difference(&high, &low).max(difference(&low, &lower)),
        };
        // Slip must go on to the end: w keeps its sign.
        let keeps = regime != RegimeKind::Slip
            || (limit.slip * bounce.slip > 0.0 && slip.abs() < limit.slip.abs());
        (limit.time > 0.0 && keeps).then_some(limit)
    }
}
