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
use smallvec::SmallVec;

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

/// Numbers extrapolated at once: all that a chatter of two bodies has.
const AT_ONCE: usize = 4;

/// Numbers carried to the limit beside the time and the velocity of slip.
pub trait Others: Clone + PartialEq + std::fmt::Debug {
    /// How many.
    fn count(&self) -> usize;
    /// One of them.
    fn at(&self, place: usize) -> f64;
    /// These, changed one by one.
    #[must_use]
    fn changed(&self, by: impl Fn(usize) -> f64) -> Self;
    /// What one of them is measured in.
    fn scale(&self, place: usize, scales: &Scales) -> f64;
}

/// What errors of an accumulation point are measured in: scales of the motion, so that no unit in
/// which it is written plays a part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// Of times.
    pub time: f64,
    /// Of coordinates and of velocities.
    pub place: f64,
    pub speed: f64,
    /// Of g'.
    pub rate: f64,
    /// Of the velocity of slip; infinite where the velocities tell it.
    pub slip: f64,
}

impl Scales {
    /// Those of numbers without units.
    pub const NONE: Self = Self { time: 1.0, place: 1.0, speed: 1.0, rate: 1.0, slip: 1.0 };
}

impl Others for [f64; 2] {
    fn count(&self) -> usize {
        2
    }

    fn at(&self, place: usize) -> f64 {
        self[place]
    }

    fn changed(&self, by: impl Fn(usize) -> f64) -> Self {
        [self[0] + by(0), self[1] + by(1)]
    }

    fn scale(&self, _: usize, scales: &Scales) -> f64 {
        scales.place
    }
}

/// What tells sequences of different kinds apart: regime, direction of slip, side of h = 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Character {
    regime: RegimeKind,
    forward: bool,
    upper: bool,
}

/// What an impact leaves behind.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bounce<V = [f64; 2]> {
    pub regime: RegimeKind,
    /// u just after it, positive.
    pub separation: f64,
    pub clock: Clock,
    /// w.
    pub slip: f64,
    /// Whether h > 0.
    pub upper: bool,
    /// What else is to be known in the limit.
    pub others: V,
}

impl<V> Bounce<V> {
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ChatterMonitor<V = [f64; 2]> {
    /// Approach velocity of the last impact, 0 before the first.
    last: f64,
    ratio: f64,
    kept: u32,
    /// Whether slip stopped during the last impact, which it may have reversed, too: of bounces that
    /// shrink it ends.
    pub stopped: bool,
    /// Whether the last impact ended without slip.
    #[serde(default)]
    pub stuck: bool,
    character: Option<Character>,
    samples: [Option<Bounce<V>>; MOST],
    /// The contact of the last impact, where there are several.
    #[serde(default, skip_serializing_if = "is_first")]
    contact: u32,
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde's way
fn is_first(contact: &u32) -> bool {
    *contact == 0
}

impl<V> Default for ChatterMonitor<V> {
    fn default() -> Self {
        Self {
            last: 0.0,
            ratio: 0.0,
            kept: 0,
            stopped: false,
            stuck: false,
            character: None,
            samples: [const { None }; MOST],
            contact: 0,
        }
    }
}

/// What of the memory decides about the next impacts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChatterKey {
    last: u64,
    ratio: u64,
    kept: u32,
    stopped: bool,
}

/// Where a chatter sequence accumulates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit<V = [f64; 2]> {
    /// Time from the last impact to the accumulation point.
    pub time: f64,
    /// w there, and the others.
    pub slip: f64,
    pub others: V,
    /// Ratio by which u shrinks.
    pub ratio: f64,
    /// Error of time and state, without rounding, in their scales.
    pub error: f64,
}

impl<V> Limit<V> {
    /// Rounding of the limit, where coordinates have this size, in its scale, and the separation
    /// velocity is the difference of velocities of this `speed`: T = 2 u/(g''(1 - q)).
    pub fn rounding(&self, size: f64, speed: f64, second: f64, scales: &Scales) -> f64 {
        CHATTER_NOISE * EPS * (size + speed / (second * (1.0 - self.ratio)) / scales.time)
    }
}

impl<V: Others> ChatterMonitor<V> {
    /// The impact that is taken next is one of this contact: of another one than the last, it
    /// begins anew.
    pub fn at_contact(&mut self, contact: u32) {
        if contact != self.contact {
            (self.contact, self.last, self.ratio, self.kept) = (contact, 0.0, 0.0, 0);
            (self.stopped, self.stuck, self.character) = (false, false, None);
            // The samples are many numbers, and mostly there is none.
            if self.samples[0].is_some() {
                self.samples = [const { None }; MOST];
            }
        }
    }

    /// Takes an impact; returns whether enough of them have kept one ratio. The restitution is that of
    /// this and of all lower impacts; NaN where theirs is another, which is no chatter yet.
    #[inline]
    pub fn observe(&mut self, regime: RegimeKind, approach: f64, restitution: f64) -> bool {
        let slides = matches!(regime, RegimeKind::Frictionless | RegimeKind::Slip);
        let measured = if self.last > 0.0 { approach / self.last } else { f64::INFINITY };
        let follows = slides || restitution.is_nan();
        let predicted = if follows { restitution } else { self.ratio };
        let keeps = measured < 1.0
            && predicted < 1.0
            && (measured - predicted).abs() <= CHATTER_RATIO_RTOL * predicted;
        self.kept = if keeps { self.kept + 1 } else { 0 };
        if !keeps && self.samples[0].is_some() {
            (self.character, self.samples) = (None, [const { None }; MOST]);
        }
        self.stopped = !slides;
        self.stuck = regime.sticks();
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
    pub fn extrapolate(
        &mut self,
        drive: &Drive,
        bounce: &Bounce<V>,
        scales: &Scales,
    ) -> Option<Limit<V>> {
        let (regime, character) = (bounce.regime, Some(bounce.character()));
        if regime.reverses() {
            return None;
        }
        if character != self.character || self.kept == CHATTER_IMPACTS {
            self.character = character;
            self.samples = [const { None }; MOST];
        }
        let u = bounce.separation;
        let newest = self.samples[0].as_ref();
        let spaced = newest.is_none_or(|newest| u <= CHATTER_SPACING * newest.separation);
        if !spaced || u <= 0.0 {
            return None;
        }
        self.samples.rotate_right(1);
        self.samples[0] = Some(bounce.clone());
        let count = self.samples.iter().flatten().count();
        if count < FEWEST {
            return None;
        }
        let mut nodes = [0.0; MOST];
        for (node, sample) in nodes.iter_mut().zip(self.samples.iter().flatten()) {
            *node = sample.separation;
        }
        // Differences from the newest sample: their rounding is that of the state.
        let others = bounce.others.count();
        let number = |sample: &Bounce<V>, place: usize| match place {
            0 => drive.until(bounce.clock, sample.clock).value(),
            1 => sample.slip - bounce.slip,
            _ if place < 2 + others => sample.others.at(place - 2) - bounce.others.at(place - 2),
            _ => 0.0,
        };
        let scale = |place: usize| match place {
            0 => scales.time,
            1 => scales.slip,
            _ if place < 2 + others => bounce.others.scale(place - 2, scales),
            _ => 1.0,
        };
        let mut limits = SmallVec::<[f64; AT_ONCE]>::new();
        // The larger one of the last two differences between orders, of all numbers.
        let mut difference = 0.0f64;
        for first in (0..2 + others).step_by(AT_ONCE) {
            let mut values = [[0.0; AT_ONCE]; MOST];
            for (values, sample) in values.iter_mut().zip(self.samples.iter().flatten()) {
                *values = std::array::from_fn(|c| number(sample, first + c));
            }
            let through = |count: usize| at_zero(&nodes[..count], values);
            let (high, low, lower) = (through(count), through(count - 1), through(count - 2));
            for c in 0..AT_ONCE {
                let orders = (high[c] - low[c]).abs().max((low[c] - lower[c]).abs());
                difference = difference.max(orders / scale(first + c));
            }
            limits.extend_from_slice(&high);
        }
        let (time, slip) = (limits[0], limits[1]);
        let slides = matches!(regime, RegimeKind::Frictionless | RegimeKind::Slip);
        let limit = Limit {
            time,
            // Slip that stopped during the impacts is at rest in the limit.
            slip: if slides { bounce.slip + slip } else { 0.0 },
            others: bounce.others.changed(|i| limits[2 + i]),
            ratio: self.ratio,
            error: CHATTER_SAFETY * difference,
        };
        // Slip must go on to the end: w keeps its sign.
        let keeps = regime != RegimeKind::Slip
            || (limit.slip * bounce.slip > 0.0 && slip.abs() < limit.slip.abs());
        (limit.time > 0.0 && keeps).then_some(limit)
    }
}
