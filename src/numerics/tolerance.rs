//! Every threshold of the library, with its meaning and the reason for its value.

/// Unit roundoff of `f64` times two: the spacing of numbers at 1.
pub const EPS: f64 = f64::EPSILON;

/// Rounding of the gap function at the start of a flight, in units of
/// `EPS (|sin x1| + |x2| + |gap|)`: sine to one ulp, two subtractions, rounded state.
pub const GAP_NOISE: f64 = 4.0;

/// Rounding of an increment of the gap function over a flight of length s, in units of
/// `EPS s V`, V a bound of the gap rate: a rounded angle `w s` costs one such unit per
/// term, and there are four terms (two homogeneous, two forced).
pub const FLIGHT_NOISE: f64 = 6.0;

/// A hump of the gap function whose top lies within so many noise levels of zero is a graze.
pub const GRAZE_NOISE: f64 = 4.0;

/// A contact this close is read off the Taylor polynomial of the gap: the remainder
/// `M h^4/24` is below this part of the rounding level, so another evaluation adds nothing.
pub const TAYLOR_PART: f64 = 1.0 / 64.0;

/// The same for the instant of the contact itself, whose error stays in the motion, and has one
/// sign: over 10^8 impacts a bias of a hundredth of a rounding shows.
pub const SETTLE_PART: f64 = 1.0 / 4096.0;

/// A separation velocity below so many `EPS V` is rounding and counts as zero; twice what the
/// gap may rise by rounding alone per unit time.
pub const REST_NOISE: f64 = 2.0 * GRAZE_NOISE * FLIGHT_NOISE;

/// Factor on the bound of the gap's fourth derivative, so that the rounding of the bound
/// itself (a few dozen operations) cannot make it too small.
pub const BOUND_MARGIN: f64 = 1.0 + 1e-12;

/// Steps of the first pass of the contact search are at most so long that the remainder of the gap's
/// interpolant is this part of the size of its motion. Twice or half as much costs more.
pub const SCAN_REMAINDER: f64 = 0.02;

/// Eight of the longest steps of the first pass are this part of a local flight, 4/(pi (sqrt(5) - 1)): no
/// simple fraction of a turn, or the contacts of periodic motions would fall on the ends of steps, where
/// no sign is certain.
pub const SCAN_STEPS: f64 = 1.030_072_868_268_605;

/// Rounding of the gap in the first pass, relative to the size of its motion: some thousand
/// operations from step to step over the whole scan.
pub const SCAN_SLACK: f64 = 1e-12;

/// Local flights scanned at once where nothing is met.
pub const SCAN_SPANS: f64 = 8.0;

/// Local flights passed at once where the bodies are too far apart ever to meet; not more, so that the
/// caller is asked now and then.
pub const FREE_SPANS: f64 = 64.0;

/// The first pass is tried after an impact whose separation velocity is this part of what the gap
/// rate can be.
pub const SCAN_REST: f64 = 1e-7;

/// A flight is a short hop where g(h)/h has this part of its slope at the start to lose up to twice the
/// time of the hop.
pub const HOP_BEND: f64 = 1.0 / 16.0;

/// The search solves its quartic to this relative accuracy; the next evaluation of the gap
/// starts afresh from there. Values from 1e-3 to 1e-9 cost and err alike on average, and every
/// reference is met with each of them: the steps only need to be safe.
pub const QUARTIC_RTOL: f64 = 1e-4;

/// Steps of the solver of the quartic; it may stop anywhere, every iterate is a safe step.
pub const QUARTIC_STEPS: usize = 24;

/// Gap evaluations in one local flight before the search is declared stalled. Twenty are
/// usual; a graze at rounding level takes some ten more.
pub const SEARCH_STEPS: u64 = 200_000;

/// A local flight lasts so many turns of the fastest of the two bodies and the drive.
/// Angles then stay below 4 pi and lose no more than two bits to rounding.
pub const CHUNK_TURNS: f64 = 2.0;

/// Gap evaluations after which a search goes on as a new local flight, with bounds of its own.
pub const SEARCH_PATIENCE: u64 = 20_000;

/// A search that has come no further by then than this part of its span is stalled: at that pace the span
/// would take weeks. The tip turns 1e13 times in it, or more.
pub const LEAST_PROGRESS: f64 = 1e-9;

/// It does so where the bodies are apart by so many rounding levels of a fresh start.
pub const PAUSE_NOISE: f64 = 1024.0;

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

/// First and last part of a local flight at which a release with g''' = 0 is probed.
pub const RELEASE_PROBE: (f64, f64) = (1e-6, 1e-2);

/// Most steps of the incremental-impulse integrator: with more, the sum of their roundings would
/// approach the error of the steps themselves.
pub const MAX_INCREMENTS: u32 = 1_000_000;

/// Evaluations by which a contact near a double root is settled; each is a Newton step.
pub const SETTLE_STEPS: usize = 6;

/// A root of the gap's Taylor polynomial is summed as a series where the first term changes g' by at
/// most this part. The first term left out is then some forty times its fifth power, and the slope at the
/// start takes all but a hundredth of that.
pub const SERIES_TURN: f64 = 4e-3;

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
