//! The tolerances of the derivatives along a motion: what each means, and why it has its value.

/// Impacts before chatter with less than this part of the highest approach velocity belong to the
/// chatter's leg where derivatives are taken.
pub const LOW_BOUNCE: f64 = 0.1;

/// Most legs of an orbit: its dense matrix of derivatives has four rows for each, 128 MB in all.
pub const MOST_LEGS: usize = 1_000;

/// A damped wall that nothing drives, and that moves less than this, is at rest.
pub const STILL_WALL: f64 = 1e-6;

/// Part of a drive period at the ends of an orbit without events, if it is to be cut there.
pub const CLEAR_ENDS: f64 = 0.01;

/// Most impacts of a chatter that the extrapolation to its end uses.
pub const MOST_EXTRAPOLATED: usize = 10;

/// Most impacts of a chatter that are followed.
pub const MOST_BOUNCES: usize = 2_000;

/// Most local flights of one hop of a chatter.
pub const MOST_HOP_FLIGHTS: usize = 64;

/// Largest difference of the last two orders of an extrapolation that converges.
pub const CONVERGED: f64 = 1e-9;

/// Largest error of the derivatives of a structure where bounces end, relative to 1 and their size: a
/// flight of chatter has an error of EPS/u in its own time, and the contact that is closed at once, u
/// before its end, one of u^2, with a derivative of u by numbers that may be 1/u as large. Where no two
/// bounces can be compared their product is at most the root of EPS.
pub const CONVERGED_SLOPES: f64 = 1e-6;

/// Differences of the last two orders, or from one impact to the next, relative to 1 and the derivatives,
/// up to which the impacts of a chatter are followed by those that the run skips.
pub const SAME_SLOPES: f64 = 1e-12;

/// Most impacts of a chatter that are kept until it ends: in so many u falls to rounding.
pub const MOST_CLOSED: usize = 64;

/// Part of a local flight: what lasts no longer is no flight.
pub const STILL_FLIGHT: f64 = 1e-6;

/// Bounces of a structure so short, in parts of a local flight, and so slow, in parts of the
/// largest velocity, belong to a chatter: their derivatives have an error of EPS/u, which its limit
/// does not.
pub const SHORT_BOUNCE: f64 = 1e-5;
pub const SLOW_BOUNCE: f64 = 1e-6;

/// Separation velocity below which the impacts of a chatter are not followed: what they would add is
/// below rounding.
pub const LOWEST_BOUNCE: f64 = 1e-16;

/// Most steps of one slide.
pub const MOST_SLIDE_STEPS: usize = 10_000;

/// Points at which a step of a slide is sampled for minima.
pub const SLIDE_SAMPLES: usize = 12;

/// Longest step of the series that give derivatives by a flight's equation, as an angle of the fastest
/// motion: the terms of longer ones would cancel.
pub const LONGEST_STEP: f64 = 2.0;

/// The same of those that end a flight of whole steps in powers of two.
pub const LONGEST_SERIES: f64 = 0.5;

/// Where these series end: the bound of a term, relative to the first one.
pub const LEAST_TERM: f64 = 1e-21;

/// Derivatives follow from the steady response of a body where w^2 - omega^2 + 2 i zeta w omega, or w^2, is
/// at least this part of the fastest rate's square, in flights that turn something by at least this angle:
/// elsewhere they would be small differences.
pub const OFF_RESONANCE: f64 = 0.125;
pub const SHORTEST_RESPONSE: f64 = 1.0;

/// Derivatives below this are zero: of smaller ones digits would be lost, and much time.
pub const LEAST_DERIVATIVE: f64 = 1e-280;

/// Flights of more of these steps are carried in parts, each from a motion that is known exactly: an error of
/// rounding grows with the steps since it was made.
pub const PART_STEPS: f64 = 4096.0;

/// Least turn of the undamped motion in a part of a flight, and of a structure's leg in contact, in which each
/// step is followed.
pub const SHORTEST_PART: f64 = 1.0;
pub const SHORTEST_CONTACT_PART: f64 = 128.0;

/// Most of these steps in one part: bodies so strongly overdamped that more are needed are given no
/// derivatives by their equation.
pub const MOST_STEPS: f64 = 1_000_000.0;

/// Largest part that a number makes of a mode in another, relative to what it changes in its equation: the
/// motions of modes that are more alike, or near resonance, would cancel by more digits.
pub const MOST_MIXED: f64 = 256.0;

/// An impact or a chatter lies on a border where what vanishes there is no larger than this part of the
/// numbers it is computed from: some roundings.
pub const AT_BORDER: f64 = 64.0 * f64::EPSILON;

/// Chatter ends near its onset with a contact force below this part of the forces it is the difference of.
/// It falls as the root of the distance from the onset: numbers that differ by some 1e-6 take it away.
pub const NEAR_ONSET: f64 = 1e-3;

/// Times of impacts of one motion agree to this part: what is more is another motion, from another start.
pub const SAME_TIME: f64 = 1e-9;

/// Flights between two impacts that turn nothing by more than this angle are differentiated by what
/// changes in them.
pub const SHORT_HOP: f64 = 0.1;

/// A drive's frequency moves the times of its periods. Derivatives by it are carried along flights over more
/// of them than this in parts: at a fixed time they grow with the time that has gone by, which would cancel.
pub const FEW_PERIODS: i64 = 8;
