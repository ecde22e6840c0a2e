//! Equal steps along a flight, eight at a time: what the first pass asks a model for. Each level of
//! steps has half the length of the one before.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use crate::numerics::lanes::{Lanes, lanes_of};
use crate::search::gap::{Gap, GapBounds, GapBoundsLanes};

/// Step lengths, each half the one before; the first is nearly an eighth of a local flight.
pub(crate) const LEVELS: usize = 12;

/// A gap whose jets at equal steps are cheap, eight at a time; steps start anywhere.
pub(crate) trait SteppedGap: Gap {
    /// The bodies where a scan stands.
    type Place: Copy + Default;
    /// The bodies at the ends of eight steps.
    type Places: Default;

    /// The jet at the start, and bounds that hold up to [`Self::bounds_hold`].
    fn scan_start(&self) -> ScanStart;
    /// Local time up to which the bounds of the scan's start hold.
    fn bounds_hold(&self) -> f64;
    /// Longest local time at which a contact is met; a later one belongs to a local flight of its
    /// own.
    fn reach(&self) -> f64;
    /// Size of the bodies' coordinates at the start, which sets the rounding of the steps.
    fn extent(&self) -> f64;
    /// Whether the steps are good while no coordinate moves further than this.
    fn steps_hold(&self, moved: f64) -> bool;
    /// Whether the bodies stay apart by more than `slack` for ever.
    fn never_meets(&self, slack: f64) -> bool;
    /// The third and fourth derivative at the start.
    fn higher_at_start(&self) -> (f64, f64);
    /// Remainder of the interpolant on a step of level 0, per unit sixth derivative.
    fn remainder_factor(&self) -> f64;
    /// The bodies at the start.
    fn place(&self) -> Self::Place;
    /// Length of the steps of a level.
    fn step(&self, level: usize) -> f64;
    /// Weights that belong to that length.
    fn weights(&self, level: usize) -> &Weights;
    /// The bodies and the jets at the ends of eight steps.
    fn eight_steps(&self, level: usize, from: &Self::Place) -> (Self::Places, Jets);
    /// The bodies `j + 1` steps on.
    fn place_after(places: &Self::Places, j: usize) -> Self::Place;
}

/// Gap function and its first two derivatives.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Jet {
    pub value: f64,
    pub rate: f64,
    pub second: f64,
}

/// The jets at h ... 8h.
#[derive(Debug, Clone, Default)]
#[repr(align(64))]
pub(crate) struct Jets {
    pub value: Lanes,
    pub rate: Lanes,
    pub second: Lanes,
}

impl Jets {
    #[inline(always)]
    pub fn get(&self, j: usize) -> Jet {
        Jet { value: self.value[j], rate: self.rate[j], second: self.second[j] }
    }
}

/// What a scan starts from: the jet there, and bounds of the gap's derivatives.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ScanStart {
    pub start: Jet,
    pub bounds: GapBounds,
}

lanes_of! {
    /// What several scans start from.
    ScanStarts of ScanStart {
        value: start.value,
        rate: start.rate,
        second: start.second,
        slope_noise: bounds.slope_noise,
        rate_bound: bounds.rate,
        fourth: bounds.fourth,
        fifth: bounds.fifth,
        sixth: bounds.sixth,
    }
}

impl ScanStarts {
    /// Their bounds.
    #[inline(always)]
    pub fn bounds(&self) -> GapBoundsLanes {
        let Self { slope_noise, rate_bound, fourth, fifth, sixth, .. } = self;
        GapBoundsLanes {
            slope_noise: *slope_noise,
            rate: *rate_bound,
            fourth: *fourth,
            fifth: *fifth,
            sixth: *sixth,
        }
    }
}

/// Weights of rate and second derivative in Bernstein coefficients of degree 6 on a step: h/6, h/3,
/// h^2/30, h/5, h^2/40.
#[derive(Debug, Clone)]
pub(crate) struct Weights {
    pub(super) sixth: f64,
    pub(super) third: f64,
    pub(super) thirtieth: f64,
    pub(super) fifth: f64,
    pub(super) fortieth: f64,
}

impl Weights {
    /// For steps of length `h`.
    pub fn new(h: f64) -> Self {
        Self {
            sixth: h / 6.0,
            third: h / 3.0,
            thirtieth: h * h / 30.0,
            fifth: h / 5.0,
            fortieth: h * h / 40.0,
        }
    }
}

/// Remainder of the interpolant on a step of length `h`, per unit sixth derivative: h^6/14400.
pub(crate) fn sextic_remainder(h: f64) -> f64 {
    let cube = h * h * h;
    cube * cube / 14_400.0
}
