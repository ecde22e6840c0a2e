//! The tolerances of the analyses: what each means, and why it has its value.

/// Shortest step of a Lyapunov spectrum: exponents are per unit time, and over less may leave the
/// range of floats.
pub const SHORTEST_MEASURED: f64 = 1e-300;

/// Step, as an angle of the fastest motion, at which a flight is sampled for maxima of the gap.
pub const HUMP_ANGLE: f64 = 0.25;

/// Part of a local flight: a maximum of the gap this close to the end of a flight is at the end.
pub const END_OF_FLIGHT: f64 = 1e-6;

/// A maximum at the end that is this close to zero is the contact that ends the flight: the place
/// of a flat top is known to the root of rounding.
pub const END_LEVEL: f64 = 1e-12;

/// A distance below this, relative to the extent of the motion, is a return. The steady state of a
/// damped motion repeats to 1e-13.
pub const RETURN_RTOL: f64 = 1e-9;

/// Sections in which a return is looked for while a motion is followed: a period of a quarter of them
/// is found at the next look, a longer one at the last.
pub const RETURN_WINDOW: usize = 400;

/// Part of its size at which a section has come back to one before: far more than what is left of a
/// motion that has settled, far less than what a torus comes back by in so few.
pub const COME_BACK: f64 = 1e-6;

/// Periods that are always tried while a motion is followed; and how many longer ones, those after
/// which the last section comes nearest to where it was.
pub const SHORT_PERIODS: usize = 8;
pub const NEAREST_TRIED: usize = 12;

/// While a motion converges, its extent decreases at least by this factor from each quarter of the
/// window to the next. Half of it would miss slow convergence; above 1 a torus would converge.
pub const EXTENT_DECREASE: f64 = 0.97;

/// The distance that is left to a converging motion is at most this part of its size.
pub const REMAINING_PART: f64 = 0.25;

/// Fewest sections that show a period: with fewer, a slow drift looks like convergence.
/// With twice as many, motions that settle late in a short window would not be seen to.
pub const SHORTEST_TAIL: usize = 100;

/// Drive periods of a step in which the growth of one perturbation is recorded.
pub const GROWTH_STEP: u32 = 8;

/// Drive periods after which a growth is looked at for the first time: many chaotic motions show it
/// by then. The growth is looked at again each time after half as many more.
pub const FIRST_GROWTH_PERIODS: u32 = 96;

/// Orbits that are looked for beside a motion that seems quasi-periodic: the periods after which it
/// comes back nearest, and first the shortest of them.
pub const ORBITS_TRIED: usize = 4;

/// Fewest turns in which its distance from an orbit is followed: blocks of them have an error.
pub const FEWEST_TURNS: usize = 2 * ERROR_BLOCKS;

/// Multipliers, the largest, along whose eigenvectors the distance from an orbit is measured: what
/// decays faster is gone by then.
pub const DISTANCES: usize = 4;

/// How far beside a multiplier, as part of it, inverse iteration looks for its eigenvector, and in how
/// many steps: each takes ten digits off the others.
pub const BESIDE_MULTIPLIER: f64 = 1e-10;
pub const INVERSE_STEPS: usize = 3;

/// A motion is attracted if its distance from an orbit shrinks by more than this part of what the
/// multipliers say. Near a torus around the orbit it does not shrink, or slower and slower.
pub const ATTRACTED_PART: f64 = 0.5;

/// Longest measurement of a growth, in lengths of the run; and its bounds, in drive periods.
pub const GROWTH_PER_RUN: u32 = 10;
pub const LONGEST_GROWTH: (u32, u32) = (1_536, 24_576);

/// Shortest measurement of a growth that an exponent is wanted of, in drive periods.
pub const EXPONENT_PERIODS: u32 = 320;

/// ln of the growth beyond shear that is certain. Over some hundred periods the logarithms of a
/// bounded growth come to a few.
pub const CERTAIN_GROWTH: f64 = 8.0;

/// Shortest and longest stretch by which a motion that seems to converge is followed, in drive
/// periods, where Newton's method does not find its orbit.
pub const CONVERGENCE_PERIODS: (u32, u32) = (400, 1_600);

/// Most impacts a growth is measured over: a second or two. Motions have some ten in a drive
/// period, but for bounces that never end (r = 1 with damping). Tests count this work.
pub const GROWTH_IMPACTS: f64 = 1e6;

/// An impact this close to the section may be on either side by rounding; in drive periods.
pub const AT_SECTION: f64 = 1e-6;

/// Residual below which a motion is close enough to its orbit for multipliers.
pub const SETTLED_RESIDUAL: f64 = 1e-8;

/// Shortest measurement that shows that perturbations do not grow, in drive periods.
pub const NO_GROWTH_PERIODS: usize = 480;

/// Shortest measurement over which a growth of no more than shear is enough whatever its error, in
/// drive periods: an exponent above 0.005 per period would have shown. And the part of the longest
/// that it takes: who wants weak chaos found gives longer runs.
pub const LONG_GROWTH_PERIODS: u32 = 1_600;
pub const LONG_PART: u32 = 4;

/// Drive periods without an impact after which it is asked whether the bodies meet again.
pub const QUIET_PERIODS: usize = 48;

/// Standard errors from 0 at which a growth goes on steadily. Of ten blocks, shear makes the first
/// so different from the others that its mean is less than four errors.
pub const STEADY_GROWTH: f64 = 5.0;

/// Distance from its image, as part of the motion's size, at which a state lies on a closed orbit:
/// a few roundings of a cycle.
pub const CLOSED_ORBIT: f64 = 1e-11;

/// As [`CLOSED_ORBIT`], but one of Newton's steps before: what changes from there on is the error of a
/// multiplier.
pub const NEARLY_CLOSED: f64 = 1e-5;

/// Most steps of Newton's method to a closed orbit: some six double the digits.
pub const MOST_RETURN_STEPS: usize = 12;

/// How much further than sections that draw together geometrically go on the orbit may lie: the
/// largest multiplier need not have shown yet.
pub const SETTLED_BEYOND: f64 = 10.0;

/// Largest relative difference between the rate seen in the sections of a convergence and that of
/// its multipliers.
pub const RATE_RTOL: f64 = 0.2;

/// One in so many steps, the first ones, only aligns the perturbations. Users see by the time of a
/// spectrum what is left.
pub const ALIGNING_STEPS: u32 = 10;

/// Blocks from which the standard error is computed that a verdict stands on: long ones, so that
/// what is bounded (the beat of a torus) hardly counts.
pub const ERROR_BLOCKS: usize = 10;

/// Numbers of blocks from which the error of an exponent is computed that is measured for a label,
/// the largest of which counts; each with Student's factor: two standard errors of so few blocks
/// hold 95.45 % of the means only if they are larger by so much.
pub const STATED_BLOCKS: [(usize, f64); 4] = [(20, 1.070), (10, 1.160), (5, 1.435), (3, 2.263)];

/// Below this part of the largest u, rounding decides whether u decreases from impact to impact.
pub const LOW_APPROACH: f64 = 1e-6;

/// Sine of the least angle between a direction and others that it is independent of.
pub const INDEPENDENT_SINE: f64 = 0.1;

/// In one step of a flight no direction contracts by more than exp of this against another:
/// rounding would decide the smaller one.
pub const MOST_CONTRACTION: f64 = 10.0;

/// Most such steps of one flight. Where damping is so strong that more are needed, only the first
/// exponents are exact.
pub const MOST_CONTRACTION_STEPS: f64 = 256.0;

/// This close to the attractor, as part of the region's radius, rounding may decide what is nearer.
pub const NEAR_ATTRACTOR: f64 = 1e-3;

/// Rounding of the sections relative to the size of the motion: what moves less has returned.
pub const SECTION_NOISE: f64 = 1e-13;

/// A leg may become shorter than nothing by this part of a local flight on the way to a solution.
pub const NEGATIVE_LEG: f64 = 0.05;

/// Most samples for the maxima of the gap of one local flight.
pub const MOST_HUMP_SAMPLES: f64 = 1e4;

/// A simulation over one orbit must come back this closely, times the largest growth on the way:
/// what shooting leaves of a residual is below, another motion is far above.
pub const CLOSES: f64 = 1e-7;

/// A simulation does not begin within this part of a drive period of an event.
pub const NEAR_EVENT: f64 = 1e-9;

/// A test function this close to zero is on its border.
pub const ON_BORDER: f64 = 1e-12;

/// A direction of which orthogonality leaves no more than this part is lost in rounding.
pub const LOST_LENGTH: f64 = 1e-14;

/// A periodic motion of a structure comes back to rounding: so many roundings of its state, times
/// the derivative of its return map.
pub const RESIDUAL_NOISE: f64 = 64.0;

/// Rounding of a multiplier of a structure, in units of `EPS` times the number of multipliers and
/// the size of the derivative.
pub const MULTIPLIER_NOISE: f64 = 64.0;

/// A multiplier is known to a few digits, and tells an exponent, from so many times its rounding on.
pub const CERTAIN_MULTIPLIER: f64 = 1e3;

/// A smaller part of the largest singular value is 0 to rounding.
pub const SINGULAR: f64 = 1e-14;
