//! The gap function along one flight, as the search for its first root sees it: g < 0 while the
//! bodies are apart, g = 0 in contact. What the bodies are, and what the gap measures, is the
//! model's business: it implements [`Gap`], and for the first pass `SteppedGap` (steps.rs).

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

mod taylor;

pub use taylor::GapPoint;
pub(crate) use taylor::{GapPoints, Higher};

use crate::numerics::EPS;
use crate::numerics::lanes::lanes_of;
use crate::search::tolerances::{FLIGHT_NOISE, GAP_NOISE, GRAZE_NOISE, REST_NOISE};

/// A gap function along one flight, in local time s from its start.
pub(crate) trait Gap {
    /// The bodies at one instant, as an evaluation leaves them.
    type Instant: Copy;
    /// The state that is handed on with a contact.
    type State: Copy;
    /// Whether [`Gap::speeds`] says more of the rounding than the bound of |g'| does.
    const GROWS: bool = false;

    /// Value of the gap at the start, and the sum of the sizes of its terms, which sets its
    /// rounding.
    fn start(&self) -> (f64, f64);
    /// Bounds of the derivatives on the local flight.
    fn bounds(&self) -> GapBounds;
    /// What |g'| and the terms of g' are bounded by at the start, and by what that grows per unit
    /// time: of short flights with a long span, under a load on a soft spring, say. And the time by
    /// whose growth a velocity at rest is told.
    fn speeds(&self, bounds: &GapBounds) -> Speeds {
        Speeds { first: bounds.rate, growth: 0.0, since: 0.0 }
    }
    /// The jet at `s`; its value is the change since the start, so that short flights are
    /// relatively exact.
    fn change(&self, s: f64) -> (GapPoint, Self::Instant);
    /// The fourth and fifth derivative at an instant.
    fn higher(&self, instant: &Self::Instant) -> Higher;
    /// The state a short time `h` after an instant.
    fn state(&self, instant: &Self::Instant, h: f64) -> Self::State;
}

/// A bound of |g'| that grows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Speeds {
    pub first: f64,
    pub growth: f64,
    pub since: f64,
}

/// Bounds of derivatives over a local flight.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct GapBounds {
    /// Change of g' by the rounding of the coordinates at the start.
    pub slope_noise: f64,
    /// Of |g'|.
    pub rate: f64,
    /// Of the gap's derivatives 4 to 6; infinite where they are not known.
    pub fourth: f64,
    pub fifth: f64,
    pub sixth: f64,
}

lanes_of! {
    /// Several bounds.
    GapBoundsLanes of GapBounds {
        slope_noise: slope_noise, rate: rate, fourth: fourth, fifth: fifth, sixth: sixth
    }
}

/// A gap along a local flight with bounds of its derivatives and of its rounding.
pub(crate) struct BoundedGap<'a, G> {
    gap: &'a G,
    start: f64,
    start_noise: f64,
    /// Rounding of g at the start of a flight that is not on the contact by definition.
    pub fresh_noise: f64,
    /// A separation velocity below this is rounding and counts as zero.
    pub rest: f64,
    /// What the gap may rise by rounding alone per unit time.
    pub creep: f64,
    pub bounds: GapBounds,
    speeds: Speeds,
}

impl<'a, G: Gap> BoundedGap<'a, G> {
    /// `touching`: the flight starts on the contact, g = 0 exactly (after an impact).
    #[inline(always)]
    pub fn new(gap: &'a G, touching: bool, bounds: GapBounds) -> Self {
        let (start, size) = gap.start();
        let fresh_noise = noise(size);
        let (start, start_noise) = if touching { (0.0, 0.0) } else { (start, fresh_noise) };
        let speeds = gap.speeds(&bounds);
        let speed = Self::speed(&speeds, &bounds, speeds.since);
        let rest = REST_NOISE * EPS * speed + 2.0 * bounds.slope_noise;
        let creep = GRAZE_NOISE * FLIGHT_NOISE * EPS * speed;
        Self { gap, start, start_noise, fresh_noise, rest, creep, bounds, speeds }
    }

    /// Bound of |g'| up to local time `s`.
    #[inline(always)]
    fn speed(speeds: &Speeds, bounds: &GapBounds, s: f64) -> f64 {
        if G::GROWS { bounds.rate.min(speeds.first + speeds.growth * s) } else { bounds.rate }
    }

    /// Gap function and bodies at local time `s`.
    #[inline(always)]
    pub fn at(&self, s: f64) -> (GapPoint, G::Instant) {
        let (change, instant) = self.gap.change(s);
        (GapPoint { value: self.start + change.value, ..change }, instant)
    }

    /// Higher derivatives at an instant.
    #[inline(always)]
    pub fn higher(&self, instant: &G::Instant) -> Higher {
        self.gap.higher(instant)
    }

    /// State `h` after an instant.
    #[inline(always)]
    pub fn state(&self, instant: &G::Instant, h: f64) -> G::State {
        self.gap.state(instant, h)
    }

    /// Bound of what a Taylor polynomial of order 5 leaves out at `offset`.
    #[inline(always)]
    pub fn remainder(&self, offset: f64) -> f64 {
        self.bounds.remainder(offset)
    }

    /// Bound of the rounding error of `at(s).value`.
    #[inline(always)]
    pub fn noise(&self, s: f64) -> f64 {
        let rate = Self::speed(&self.speeds, &self.bounds, s);
        self.start_noise + GapBounds { rate, ..self.bounds }.noise(s)
    }
}

impl GapBounds {
    /// What a Taylor polynomial of order 5 leaves out at `offset`.
    #[inline(always)]
    pub fn remainder(&self, offset: f64) -> f64 {
        let square = offset * offset;
        // By lower bounds twice the first term left out, with room for the polynomial's own terms
        // after it.
        let (fifth, sixth) = (self.fifth / 60.0 * offset.abs(), self.sixth / 720.0 * square);
        let best = (self.fourth / 8.0).min(fifth).min(sixth);
        best * (square * square)
    }

    /// Rounding of a change of the gap over a flight of length `s`.
    #[inline(always)]
    pub fn noise(&self, s: f64) -> f64 {
        FLIGHT_NOISE * EPS * self.rate * s
    }
}

/// Rounding of a gap whose terms have this size together.
#[inline(always)]
pub(crate) fn noise(size: f64) -> f64 {
    GAP_NOISE * EPS * size
}
