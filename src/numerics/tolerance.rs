//! Every threshold of the library, with its meaning and the reason for its value.

/// Unit roundoff of `f64` times two: the spacing of numbers at 1.
pub const EPS: f64 = f64::EPSILON;

/// A local flight lasts so many turns of the fastest of the two bodies and the drive.
/// Angles then stay below 4 pi and lose no more than two bits to rounding.
pub const CHUNK_TURNS: f64 = 2.0;

/// The steady response is used where it exceeds the true forced motion of a local flight at
/// most by this factor, else one that stays finite (more work per evaluation).
pub const RESONANCE_LOSS: f64 = 1.0;

/// After a decay by exp(-this) a free motion is no longer computed as an increment from its start,
/// whose rounding would then exceed its own twentyfold.
pub const DECAYED: f64 = 3.0;

/// Damping ratios below this count as zero.
pub const LEAST_DAMPING: f64 = 1e-100;

/// Frequency ratios below this count as zero.
pub const LEAST_FREQUENCY: f64 = 1e-150;

/// Spread of the exponents times time below which divided differences are summed as series.
pub const SERIES_SPREAD: f64 = 1.0;

/// Below this angle of the fastest of free motion, decay and drive, a flight is summed as a
/// Taylor series,
pub const SHORT_ANGLE: f64 = 1.0 / 4.0;

/// of the order that belongs to the first of these parts of `SHORT_ANGLE` which it stays below: the next
/// term is then below angle^order/order! = 5e-20 of the first.
pub const SHORT_ORDERS: [(f64, usize); 4] = [(0.007, 6), (0.057, 8), (0.2, 10), (1.0, 14)];

/// P* at least P_f (1 - this) counts as restitution: where both are equal by an identity
/// (wall at rest) rounding must not decide (theory.md, section 4).
pub const SIMULTANEOUS: f64 = 8.0 * EPS;

/// Rounding of the separation velocity of the law as printed, in units of `EPS` times the velocities it is made of:
/// some twenty operations.
pub const PAPER_NOISE: f64 = 16.0;

/// With |cos x1| below this the tip has no room left before sin x1 = -1: 1 - |sin x1| is below
/// rounding. A wall (mbar = 0) that still approaches then jams it; its impacts would drive
/// x1' beyond all bounds.
pub const NO_ROOM: f64 = 1e-7;

/// With |cos x1| below this, in units of 1 + |gap|, a wall that approaches a tip at sin x1 = 1 meets
/// it at dead centre: thrown aside at u/cos x1 it would be back before the gap has changed by more
/// than its rounding, and no number says what follows.
pub const DEAD_CENTRE: f64 = 64.0 * EPS;

/// Impacts in a row that must shrink by one ratio before a chatter sequence is sampled.
pub const CHATTER_IMPACTS: u32 = 3;

/// Allowed relative deviation of that ratio; the accuracy of the completion is judged apart.
pub const CHATTER_RATIO_RTOL: f64 = 0.05;

/// Impacts whose u has fallen by this factor since the last sample are sampled: closer ones
/// would make the extrapolation ill-conditioned.
pub const CHATTER_SPACING: f64 = 0.6;

/// Rounding of an extrapolated state, in units of `EPS` times its size: the rounding of one
/// impact, a few units, times the norm of the extrapolation, 27 at the above spacing.
pub const CHATTER_NOISE: f64 = 64.0;

/// Factor of safety on the difference of two orders of the extrapolation: without it the error is
/// up to 2.5 times the difference where a loose tolerance accepts it early
/// (tests/simulation/chatter.rs).
pub const CHATTER_SAFETY: f64 = 10.0;

/// Extrapolated time to the accumulation point and the leading order 2 u/(g'' (1 - q)) must
/// agree to this relative accuracy.
pub const CHATTER_LEADING_RTOL: f64 = 0.2;

/// Rounding of the free gap acceleration in contact, in units of `EPS` times its terms.
pub const FORCE_NOISE: f64 = 16.0;

/// mbar + k cos x1 below this part of its terms counts as zero: a Painleve point. The contact
/// force grows beyond all bounds there, and the steps of the integration shrink.
pub const PAINLEVE_LEVEL: f64 = 1e-9;

/// Against a wall (mbar = 0) k cos x1 below this counts as zero too: with |cos x1| = 1e-5 the wall
/// drives the tip 1e5 times as fast as itself, to the end of its reach.
pub const REACH_LEVEL: f64 = 1e-10;

/// With |cos x1| above this, x1 follows a wall (mbar = 0) on the contact; below, where x1 would
/// magnify the wall's rounding, the wall is moved by rounding instead.
pub const WALL_SLOPE: f64 = 0.1;

/// Longest step of the contact phase, as an angle of the fastest of both bodies and the drive:
/// what a series of order `hold::slide::ORDER` still sums to rounding.
pub const CONTACT_ANGLE: f64 = 1.5;

/// A slide whose steps are shorter than this part of a local flight, of a tip that turns or decays so fast,
/// is stalled: it would never be done. (A light tip pressed past the end of its reach turns 1e12 times.)
pub const LEAST_STEP: f64 = 1e-20;

/// Shortest step of a Lyapunov spectrum: exponents are per unit time, and over less may leave the range of floats.
pub const SHORTEST_MEASURED: f64 = 1e-300;

/// Panels of the energy audit's quadrature, as an angle of the fastest motion: 16 Gauss points
/// integrate a sine of twice that angle to rounding.
pub const AUDIT_ANGLE: f64 = 1.5;

/// Impacts before chatter with less than this part of the highest approach velocity belong to the
/// chatter's leg where derivatives are taken.
pub const LOW_BOUNCE: f64 = 0.1;

/// Most legs of an orbit: its dense matrix of derivatives has four rows for each, 128 MB in all.
pub const MOST_LEGS: usize = 1_000;

/// A damped wall that nothing drives, and that moves less than this, is at rest.
pub const STILL_WALL: f64 = 1e-6;

/// Part of a drive period at the ends of an orbit without events, if it is to be cut there.
pub const CLEAR_ENDS: f64 = 0.01;

/// Step, as an angle of the fastest motion, at which a flight is sampled for maxima of the gap.
pub const HUMP_ANGLE: f64 = 0.25;

/// A maximum of the gap this close to the end of a flight, as a part of a local flight,
pub const END_OF_FLIGHT: f64 = 1e-6;

/// and this close to zero is the contact that ends it: a flat top is known to the root of rounding.
pub const END_LEVEL: f64 = 1e-12;

/// Chatter is completed with at most this error even if a looser tolerance is asked for: the
/// difference of two orders is a bound only where the extrapolation converges well.
pub const LOOSEST_COMPLETION: f64 = 1e-7;

/// Changes of the contact mode without progress in time before time is moved on: what decides
/// between the modes is then at rounding level.
pub const STANDSTILL_EVENTS: u32 = 8;

/// Progress in time below this part of a local flight is hardly any.
pub const STANDSTILL_TIME: f64 = 1e-3;

/// After so many such moves in a row,
pub const MOST_MOVES: u32 = 4096;

/// one below this part of a local flight shows that they do not end: a gap whose derivatives are so
/// large, beside bodies so far away, has no digits in which the modes could differ.
pub const SHORTEST_MOVE: f64 = 1e-12;

/// Default tolerance where something is approximated (completion of chatter): absolute, in time
/// and state. The contact phase is integrated to rounding whatever its value.
pub const DEFAULT_TOLERANCE: f64 = 1e-12;

/// Default cap on the events of one run.
pub const DEFAULT_MAX_EVENTS: u64 = 10_000_000;

/// Cap on the time of a run that was given no horizon: such a run must end even if the bodies
/// never meet again (some seconds of computing).
pub const DEFAULT_MAX_TIME: f64 = 1e7;

/// 2^53: drive periods that can be counted without a gap in the numbers, and as much time, of which a double
/// tells no more than whole units.
pub const MOST_COUNTED: f64 = 9_007_199_254_740_992.0;
