//! What the first pass (src/search/scan.rs) tells of a flight.

#![allow(clippy::inline_always)] // the usual way through a search is compiled for several instruction sets

use super::Start;
use crate::search::gap::GapBounds;
use crate::search::scan::{Scan, scan};
use crate::search::steps::SteppedGap;

/// What the first pass tells of a flight.
#[derive(Clone, Copy)]
pub(crate) enum FirstPass {
    /// No contact up to this local time.
    Clear(f64),
    /// The first contact, a simple root, lies near one local time and after another.
    Ahead { near: f64, after: f64, bounds: GapBounds },
    /// No contact up to this local time; on from there with care.
    Unsure(f64),
}

/// The first pass, and its evaluations of the gap.
#[inline(always)]
pub(super) fn first_pass<G: SteppedGap>(gap: &G, start: Start, span: f64) -> (FirstPass, u64) {
    if !matches!(start, Start::Apart | Start::Touching) {
        return (FirstPass::Unsure(0.0), 0);
    }
    let scan_start = gap.scan_start();
    let (found, evaluations) = scan(gap, &scan_start, start == Start::Touching, span);
    (FirstPass::new(found, scan_start.bounds), evaluations)
}

/// A time of few digits: its products with the frequencies are exact, and what it leaves out is in
/// the offset of the contact.
#[inline(always)]
pub(crate) fn short_time(time: f64) -> f64 {
    f64::from(time as f32)
}

impl FirstPass {
    #[inline(always)]
    pub fn new(scan: Scan, bounds: GapBounds) -> Self {
        match scan {
            Scan::Clear(time) => Self::Clear(time),
            Scan::RisingStep(rise) => {
                Self::Ahead { near: short_time(rise.near()), after: rise.after, bounds }
            }
            Scan::Hop(near) => Self::Ahead { near: short_time(near), after: 0.0, bounds },
            Scan::Unsure(time) => Self::Unsure(time),
        }
    }
}
