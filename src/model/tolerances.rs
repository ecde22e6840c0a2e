//! The tolerances of the model: what each means, and why it has its value.

use crate::numerics::EPS;

/// Frequency ratios below this count as zero: much smaller ones have squares without correct
/// digits. The number is public (docs/notation.md), so a test has it too.
pub const LEAST_FREQUENCY: f64 = 1e-150;

/// With |cos x1| below this the tip has no room left before sin x1 = -1: 1 - |sin x1| is below
/// rounding. A wall (mbar = 0) that still approaches then jams it; its impacts would drive
/// x1' beyond all bounds.
pub const NO_ROOM: f64 = 1e-7;

/// With |cos x1| below this, in units of 1 + |gap|, a wall that approaches a tip at sin x1 = 1
/// meets it at dead centre: thrown aside at u/cos x1 it would be back before the gap has changed by
/// more than its rounding, and no number says what follows.
pub const DEAD_CENTRE: f64 = 64.0 * EPS;

/// With |cos x1| above this, x1 follows a wall (mbar = 0) on the contact; below, where x1 would
/// magnify the wall's rounding, the wall is moved by rounding instead.
pub const WALL_SLOPE: f64 = 0.1;

/// A landing changes x1' only by less than this part: what the impulses of bounces at rounding
/// level have left. More is no rounding, and belongs to body 2.
pub const LAST_IMPULSES: f64 = 1e-3;

/// mbar + k cos x1 below this part of its terms counts as zero: a Painleve point. The contact
/// force grows beyond all bounds there, and the steps of the integration shrink.
pub const PAINLEVE_LEVEL: f64 = 1e-9;

/// Against a wall (mbar = 0) k cos x1 below this counts as zero too: with |cos x1| = 1e-5 the wall
/// drives the tip 1e5 times as fast as itself, to the end of its reach.
pub const REACH_LEVEL: f64 = 1e-10;

/// An approach velocity within this part of a knot's is at the knot: some roundings.
pub const AT_KNOT: f64 = 64.0 * EPS;
