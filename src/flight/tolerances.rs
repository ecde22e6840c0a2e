//! The tolerances of a flight: what each means, and why it has its value.

/// A local flight lasts so many turns of the fastest of the two bodies and the drive.
/// Angles then stay below 4 pi and lose no more than two bits to rounding. Twice as long they lose
/// one more, and tests that allow places six roundings fail. With half of it a drive period is no
/// longer one local flight, as tests with exact times need it.
pub const CHUNK_TURNS: f64 = 2.0;

/// The steady response is used where it exceeds the true forced motion of a local flight at
/// most by this factor, else one that stays finite (more work per evaluation).
pub const RESONANCE_LOSS: f64 = 1.0;

/// The free motion is written about the equilibrium under a constant load if it turns by at least
/// this angle in a local flight: the bound from its energy is then no larger than that from the work
/// of the load.
pub const LEAST_SPRING_ANGLE: f64 = 1.0;

/// After a decay by exp(-this) a free motion is no longer computed as an increment from its start,
/// whose rounding would then exceed its own twentyfold.
pub const DECAYED: f64 = 3.0;

/// Damping ratios below this count as zero.
pub const LEAST_DAMPING: f64 = 1e-100;

/// Spread of the exponents times time below which divided differences are summed as series.
pub const SERIES_SPREAD: f64 = 1.0;

/// A flight over a smaller angle of the fastest of free motion, decay and drive is summed as a
/// Taylor series.
pub const SHORT_ANGLE: f64 = 1.0 / 4.0;

/// Orders of that series: the first pair whose part of [`SHORT_ANGLE`] is larger than the angle
/// names the order. The next term is then below angle^order/order! = 5e-20 of the first.
pub const SHORT_ORDERS: [(f64, usize); 4] = [(0.007, 6), (0.057, 8), (0.2, 10), (1.0, 14)];
