//! What is certain of a flight before any sample: that the bodies never meet, or that it is a short hop.

#![allow(clippy::inline_always)] // all of a scan must be compiled with the same instructions

use crate::flight::{Flight, FreeMotion};
use crate::numerics::tolerance::{BOUND_MARGIN, HOP_BEND};
use crate::search::gap::{Geometry, higher_at_start};

/// Whether the amplitudes of all parts of the motion keep the bodies apart for ever: those of the
/// steady responses each by itself, or as they go together.
#[inline(always)]
pub(super) fn never_meet<G: Geometry>(motion: &FreeMotion, flight: &Flight, slack: f64) -> bool {
    let FreeMotion { pendulum, oscillator, gap, .. } = motion;
    let (free1, steady1) = pendulum.amplitudes(&flight.pendulum);
    let (free2, steady2) = oscillator.amplitudes(&flight.oscillator);
    let (highest, ahead) = G::reach(free1 + steady1);
    let together = pendulum.steady_difference(oscillator) + free1 + free2 + ahead;
    (highest + free2 + steady2).min(together) * BOUND_MARGIN < gap - slack
}

/// About the time at which a short hop ends, the contact that a flight leaves with g' < 0 and g'' > 0, as
/// near as the exact evaluation needs it; `None` where it is not certain to be the first contact. `hop`: its time to leading order.
///
/// The slope of g(h)/h = g' + g'' h/2 + g''' h^2/6 + ... is at least g''/2 - |g'''| h/3 - M h^2/8. Where
/// that is little less than g''/2 up to twice the time of the hop, there is one root, before that. No
/// sample is needed, however short the hop.
#[inline(always)]
pub(super) fn short_hop<G: Geometry>(
    motion: &FreeMotion,
    flight: &Flight,
    second: f64,
    hop: f64,
    fourth_bound: f64,
) -> Option<f64> {
    let allowed = HOP_BEND * second;
    let twice = 2.0 * hop;
    let bend = 0.125 * fourth_bound * (twice * twice);
    if !(second > 0.0 && bend <= allowed && twice <= motion.span) {
        return None;
    }
    let (third, fourth) = higher_at_start::<G>(motion, flight);
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
