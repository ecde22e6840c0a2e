//! The tolerances of a run, and its defaults: what each means, and why it has its value.

/// Extrapolated time to the accumulation point and the leading order 2 u/(g'' (1 - q)) must
/// agree to this relative accuracy.
pub const CHATTER_LEADING_RTOL: f64 = 0.2;

/// Chatter is completed with at most this error even if a looser tolerance is asked for: the
/// difference of two orders is a bound only where the extrapolation converges well.
pub const LOOSEST_COMPLETION: f64 = 1e-7;

/// Changes of the contact mode without progress in time before time is moved on: what decides
/// between the modes is then at rounding level.
pub const STANDSTILL_EVENTS: u32 = 8;

/// Progress in time below this part of a local flight is hardly any.
pub const STANDSTILL_TIME: f64 = 1e-3;

/// Moves of time in a row after which a move below [`SHORTEST_MOVE`] ends the run as stalled.
pub const MOST_MOVES: u32 = 4096;

/// Part of a local flight: shorter moves do not end. The derivatives of the gap are then so large,
/// and the bodies so far away, that no digits are left in which the modes could differ.
pub const SHORTEST_MOVE: f64 = 1e-12;

/// Default tolerance where something is approximated (completion of chatter), in time and state, in
/// the scales that the model gives them. The contact phase is integrated to rounding whatever its value.
pub const DEFAULT_TOLERANCE: f64 = 1e-12;

/// Default cap on the events of one run.
pub const DEFAULT_MAX_EVENTS: u64 = 10_000_000;

/// Cap on the time of a run that was given no horizon: such a run must end even if the bodies
/// never meet again (some seconds of computing).
pub const DEFAULT_MAX_TIME: f64 = 1e7;

/// Stops whose gaps lie within so many roundings of zero are met at one instant.
pub const SAME_INSTANT: f64 = 64.0;

/// Most impacts at one instant, one after another.
pub const MOST_IN_SEQUENCE: u32 = 10_000;

/// 2^53: drive periods that can be counted without a gap in the numbers, and as much time, of which
/// a double tells no more than whole units.
pub const MOST_COUNTED: f64 = 9_007_199_254_740_992.0;
