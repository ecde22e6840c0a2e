//! The tolerances of the contact search: what each means, and why it has its value.

/// Rounding of the gap function at the start of a flight, in units of
/// `EPS (|sin x1| + |x2| + |gap|)`: sine to one ulp, two subtractions, rounded state.
pub(crate) const GAP_NOISE: f64 = 4.0;

/// Rounding of an increment of the gap function over a flight of length s, in units of
/// `EPS s V`, V a bound of the gap rate: a rounded angle `w s` costs one such unit per
/// term, and there are four terms (two homogeneous, two forced). It is part of the guarantee
/// (docs/contact-detection.md), so the tests of the guarantee have the same number.
pub(crate) const FLIGHT_NOISE: f64 = 6.0;

/// A hump of the gap function whose top lies within so many noise levels of zero is a graze. It is
/// part of the guarantee, as [`FLIGHT_NOISE`].
pub(crate) const GRAZE_NOISE: f64 = 4.0;

/// A contact this close is read off the Taylor polynomial of the gap: the remainder
/// `M h^4/24` is below this part of the rounding level, so another evaluation adds nothing.
pub(crate) const TAYLOR_PART: f64 = 1.0 / 64.0;

/// As [`TAYLOR_PART`], for the instant of the contact itself: its error stays in the motion and has
/// one sign, and over 10^8 impacts a bias of a hundredth of a rounding shows.
pub(crate) const SETTLE_PART: f64 = 1.0 / 4096.0;

/// Evaluations by which a contact near a double root is settled; each is a Newton step.
pub(crate) const SETTLE_STEPS: usize = 6;

/// A separation velocity below so many `EPS V` is rounding and counts as zero; twice what the
/// gap may rise by rounding alone per unit time.
pub(crate) const REST_NOISE: f64 = 2.0 * GRAZE_NOISE * FLIGHT_NOISE;

/// Part of the time so far in which what loads do to a velocity counts for [`REST_NOISE`], where that
/// time is short beside a local flight: bounces that are rest are then over in a few roundings of it.
pub(crate) const REST_TIME: f64 = 1.0 / 16.0;

/// Factor on the bound of the gap's fourth derivative, so that the rounding of the bound
/// itself (a few dozen operations) cannot make it too small.
pub(crate) const BOUND_MARGIN: f64 = 1.0 + 1e-12;

/// Steps of the first pass of the contact search are at most so long that the remainder of the
/// gap's interpolant is this part of the size of its motion. Twice or half as much costs more.
pub(crate) const SCAN_REMAINDER: f64 = 0.02;

/// Eight of the longest steps of the first pass are this part of a local flight, 4/(pi (sqrt(5) -
/// 1)): no simple fraction of a turn, or the contacts of periodic motions would fall on the ends of
/// steps, where no sign is certain.
pub(crate) const SCAN_STEPS: f64 = 1.030_072_868_268_605;

/// Rounding of the gap in the first pass, relative to the size of its motion: some thousand
/// operations from step to step over the whole scan.
pub(crate) const SCAN_SLACK: f64 = 1e-12;

/// Local flights scanned at once where nothing is met.
pub(crate) const SCAN_SPANS: f64 = 8.0;

/// Local flights passed at once where the bodies are too far apart ever to meet; not more, so that
/// the caller is asked now and then.
pub(crate) const FREE_SPANS: f64 = 64.0;

/// The first pass is tried after an impact whose separation velocity is this part of what the gap
/// rate can be.
pub(crate) const SCAN_REST: f64 = 1e-7;

/// A flight is a short hop where g(h)/h has this part of its slope at the start to lose up to twice
/// the time of the hop. A test counts the evaluations of short hops: half of it needs more of them.
pub(crate) const HOP_BEND: f64 = 1.0 / 16.0;

/// Gap evaluations in one local flight before the search is declared stalled. Twenty are
/// usual; a graze at rounding level takes some ten more.
pub(crate) const SEARCH_STEPS: u64 = 200_000;

/// Gap evaluations after which a search goes on as a new local flight, with bounds of its own.
pub(crate) const SEARCH_PATIENCE: u64 = 20_000;

/// A search that has come no further by then than this part of its span is stalled: at that pace
/// the span would take weeks. The tip turns 1e13 times in it, or more.
pub(crate) const LEAST_PROGRESS: f64 = 1e-9;

/// It does so where the bodies are apart by so many rounding levels of a fresh start.
pub(crate) const PAUSE_NOISE: f64 = 1024.0;

/// First and last part of a local flight at which a release with g''' = 0 is probed.
pub(crate) const RELEASE_PROBE: (f64, f64) = (1e-6, 1e-2);

/// A root of the gap's Taylor polynomial is summed as a series where the first term changes g' by
/// at most this part. The first term left out is then some forty times its fifth power, and the
/// slope at the start takes all but a hundredth of that.
pub(crate) const SERIES_TURN: f64 = 4e-3;
