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
/// this angle in a local flight: the bound from its energy is then no larger than that from the
/// work of the load.
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

/// Span of a leg that is summed as one Taylor series (structure/linear.rs), as an angle of the
/// fastest of motion and drive, at most: with twice this its terms are e^4 times its sum, and two
/// digits are lost to rounding.
pub const LEG_ANGLE: f64 = 2.0;

/// Order of that series. It is summed up to a little more than two spans, where the next term is
/// below 4.1^41/41! = 4e-25; over one span it is exact in double-double, 2^41/41! = 7e-38.
pub const LEG_ORDER: usize = 40;

/// Least scales, in radians per span, of the norm in which derivatives of a leg are bounded.
/// Without friction the first has the lowest growth.
pub const SLOWEST_SCALES: [f64; 4] = [1.0 / 16.0, 1.0 / 4.0, 1.0, 2.0];

/// A first pass looks no further than the bounds of derivatives may grow by exp(this), or one span.
pub const GROWTH_IN_SCAN: f64 = 1.0;

/// A force or velocity of slip at the start of a leg, or a derivative of it, below so many `EPS`
/// times its bound is 0: as in the contact search. Less than what a landing takes for 0
/// (`contact::tolerances::CLOSED_NOISE`): what that has decided a leg does not decide again.
pub const LEADING_NOISE: f64 = crate::search::tolerances::REST_NOISE * crate::numerics::EPS;

/// Times that a force may fall to 0 and rise again in one span.
pub const MOST_GRAZES: usize = 100;

/// Times of one span at which a force that is 0 to many orders is looked at.
pub const QUIET_PROBES: usize = 64;
