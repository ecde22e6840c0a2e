//! Flights that are certain to be a short hop before any sample of the gap.

#![allow(clippy::inline_always)] // all of a scan must be compiled with the same instructions

use crate::search::steps::SteppedGap;
use crate::search::tolerances::HOP_BEND;

/// About the time at which a short hop ends, the contact that a flight leaves with g' < 0 and g'' >
/// 0, as near as the exact evaluation needs it; `None` where it is not certain to be the first
/// contact. `hop`: its time to leading order.
///
/// The slope of g(h)/h = g' + g'' h/2 + g''' h^2/6 + ... is at least g''/2 - |g'''| h/3 - M h^2/8.
/// Where that is little less than g''/2 up to twice the time of the hop, there is one root, before
/// that. No sample is needed, however short the hop.
#[inline(always)]
pub(super) fn short_hop<G: SteppedGap>(
    gap: &G,
    span: f64,
    second: f64,
    hop: f64,
    fourth_bound: f64,
) -> Option<f64> {
    let allowed = HOP_BEND * second;
    let twice = 2.0 * hop;
    let bend = 0.125 * fourth_bound * (twice * twice);
    if !(second > 0.0 && bend <= allowed && twice <= span) {
        return None;
    }
    let (third, fourth) = gap.higher_at_start();
    if third.abs() * twice / 3.0 + bend > allowed {
        return None;
    }
    // With h = y hop: -1 + y + a y^2 + b y^3 = 0, and one of Newton's steps.
    let (a, b) = (third * hop / (3.0 * second), fourth * (hop * hop) / (12.0 * second));
    let y = 1.0 - a;
    let value = -1.0 + y * (1.0 + y * (a + y * b));
    let slope = 1.0 + y * (2.0 * a + y * (3.0 * b));
    Some(hop * (y - value / slope))
}
