//! Contact geometry: the gap function g (negative while the bodies are apart), its derivatives,
//! and the rounding of its evaluation (docs/theory.md, section 1).
//!
//! *oblique*: g = sin x1 - x2 - delta; *direct*: g = x1 - x2 - delta.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets
#![allow(clippy::needless_bitwise_bool)] // conditions without jumps, for the lanes

mod taylor;

pub use taylor::GapPoint;
pub(crate) use taylor::{GapPoints, Higher};

use std::f64::consts::FRAC_PI_2;
use std::marker::PhantomData;

use crate::flight::{Equation, Flight, FreeMotion, Motion};
use crate::model::angle::Angle;
use crate::model::parameters::{Contact, System};
use crate::model::state::State;
use crate::numerics::elementary;
use crate::numerics::lanes::lanes_of;
use crate::numerics::tolerance::{BOUND_MARGIN, EPS, FLIGHT_NOISE, GAP_NOISE, REST_NOISE};

/// What differs between the geometries. The angle enters through sin and cos of x1 at the start
/// of a flight, so that the gap is an increment too: relatively exact for short hops.
pub(crate) trait Geometry {
    /// Whether the gap needs the sine of x1.
    const TURNS: bool;
    /// Position of the tip along the normal: sin x1, or x1.
    fn tip(x1: f64, angle: Angle) -> f64;
    /// Increment of the tip's position since the start of a flight, where the angle was `start`, its
    /// derivatives 1 to 3, and the angle; `turned`: (cos - 1, sin) of the increment of x1.
    fn tip_motion(start: Angle, turned: (f64, f64), p: &Motion) -> ([f64; 4], Angle);
    /// Change of g' by the rounding of x1, at a rate x1' of this size.
    fn slope_noise(x1: f64, speed: f64) -> f64;
    /// Fourth derivative of the tip's position; that of x1 is `fourth`.
    fn tip_fourth(angle: Angle, p: &Motion, fourth: f64) -> f64;
    /// Its fifth derivative, from the fourth and fifth of x1.
    fn tip_fifth(angle: Angle, p: &Motion, higher: [f64; 2]) -> f64;
    /// Bound of the fourth derivative of the tip's position, from bounds of x1', ..., x1''''.
    fn fourth(bounds: &[f64; 4]) -> f64;
    /// Rate and acceleration of the tip, from x1', x1''.
    fn tip_rates(angle: Angle, v1: f64, a1: f64) -> [f64; 2];
    /// Position of the tip and its two derivatives, for the first pass of the contact search.
    fn tip_fast(x1: f64, v1: f64, a1: f64) -> [f64; 3];
    /// For |x1| <= r: bounds of the tip's position, and of how far it is ahead of x1.
    fn reach(r: f64) -> (f64, f64);
    /// Bounds of the derivatives 4 to 6 of the tip's position, from those of x1.
    fn high_derivatives(bounds: &[f64; 6]) -> [f64; 3];
}

pub(crate) struct Oblique;
pub(crate) struct Direct;

impl Geometry for Oblique {
    const TURNS: bool = true;

    #[inline(always)]
    fn tip(_: f64, angle: Angle) -> f64 {
        angle.sin
    }

    #[inline(always)]
    fn tip_motion(start: Angle, turned: (f64, f64), p: &Motion) -> ([f64; 4], Angle) {
        let Angle { sin: sin0, cos: cos0 } = start;
        let (turned_cos_minus_1, turned_sin) = turned;
        let increment = sin0 * turned_cos_minus_1 + cos0 * turned_sin;
        let sin = sin0 + increment;
        let cos = cos0 + (cos0 * turned_cos_minus_1 - sin0 * turned_sin);
        let (v, a) = (p.rate, p.acceleration);
        let v2 = v * v;
        let third = (p.jerk - v2 * v) * cos - 3.0 * v * a * sin;
        ([increment, v * cos, a * cos - v2 * sin, third], Angle { sin, cos })
    }

    #[inline(always)]
    fn tip_fourth(Angle { sin, cos }: Angle, p: &Motion, fourth: f64) -> f64 {
        let (v, a) = (p.rate, p.acceleration);
        let v2 = v * v;
        cos * (fourth - 6.0 * v2 * a) - sin * (4.0 * v * p.jerk + 3.0 * a * a - v2 * v2)
    }

    #[inline(always)]
    fn tip_fifth(Angle { sin, cos }: Angle, p: &Motion, [fourth, fifth]: [f64; 2]) -> f64 {
        let (v, a, j) = (p.rate, p.acceleration, p.jerk);
        let v2 = v * v;
        cos * (fifth - 10.0 * v2 * j - 15.0 * v * a * a + v2 * v2 * v)
            - sin * (5.0 * v * fourth + 10.0 * a * j - 10.0 * v2 * v * a)
    }

    #[inline(always)]
    fn slope_noise(x1: f64, speed: f64) -> f64 {
        EPS * x1.abs() * speed
    }

    fn fourth(&[v, a, j, s]: &[f64; 4]) -> f64 {
        // (sin x)'''' = cos x (x'''' - 6 x'^2 x'') - sin x (4 x' x''' + 3 x''^2 - x'^4)
        (s + 6.0 * v * v * a).hypot(4.0 * v * j + 3.0 * a * a + v.powi(4))
    }

    #[inline(always)]
    fn tip_rates(Angle { sin, cos }: Angle, v1: f64, a1: f64) -> [f64; 2] {
        [v1 * cos, a1 * cos - v1 * v1 * sin]
    }

    #[inline(always)]
    fn tip_fast(x1: f64, v1: f64, a1: f64) -> [f64; 3] {
        let (sin, cos) = elementary::fused_sin_cos(x1);
        let [rate, second] = Self::tip_rates(Angle { sin, cos }, v1, a1);
        [sin, rate, second]
    }

    #[inline(always)]
    fn reach(r: f64) -> (f64, f64) {
        // Partial sums of the alternating series.
        let (r2, cubic) = (r * r, r * r * r / 6.0);
        let highest = if r < FRAC_PI_2 { (r - cubic * (1.0 - r2 / 20.0)).min(1.0) } else { 1.0 };
        (highest, cubic)
    }

    #[inline(always)]
    fn high_derivatives(&[a, b, c, d, e, f]: &[f64; 6]) -> [f64; 3] {
        // Complete Bell polynomials: all terms of the derivatives of sin x1(t), taken positive.
        let a2 = a * a;
        let fourth = d + a * (4.0 * c + a * (6.0 * b + a2)) + 3.0 * b * b;
        let fifth =
            e + a * (5.0 * d + a * (10.0 * c + a * (10.0 * b + a2)) + 15.0 * b * b) + 10.0 * b * c;
        let sixth = f
            + a * (6.0 * e
                + 60.0 * b * c
                + a * (15.0 * d + 45.0 * b * b + a * (20.0 * c + a * (15.0 * b + a2))))
            + b * (15.0 * d + 15.0 * b * b)
            + 10.0 * c * c;
        [fourth, fifth, sixth]
    }
}

impl Geometry for Direct {
    const TURNS: bool = false;

    #[inline(always)]
    fn tip(x1: f64, _: Angle) -> f64 {
        x1
    }

    #[inline(always)]
    fn tip_motion(start: Angle, _: (f64, f64), p: &Motion) -> ([f64; 4], Angle) {
        ([p.increment, p.rate, p.acceleration, p.jerk], start)
    }

    #[inline(always)]
    fn tip_fourth(_: Angle, _: &Motion, fourth: f64) -> f64 {
        fourth
    }

    #[inline(always)]
    fn tip_fifth(_: Angle, _: &Motion, [_, fifth]: [f64; 2]) -> f64 {
        fifth
    }

    #[inline(always)]
    fn slope_noise(_: f64, _: f64) -> f64 {
        0.0
    }

    fn fourth(&[_, _, _, s]: &[f64; 4]) -> f64 {
        s
    }

    #[inline(always)]
    fn tip_rates(_: Angle, v1: f64, a1: f64) -> [f64; 2] {
        [v1, a1]
    }

    #[inline(always)]
    fn tip_fast(x1: f64, v1: f64, a1: f64) -> [f64; 3] {
        [x1, v1, a1]
    }

    #[inline(always)]
    fn reach(r: f64) -> (f64, f64) {
        (r, 0.0)
    }

    #[inline(always)]
    fn high_derivatives(&[_, _, _, d, e, f]: &[f64; 6]) -> [f64; 3] {
        [d, e, f]
    }
}

/// Bounds of derivatives over a local flight.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct GapBounds {
    /// Of |x1'|.
    pub pendulum_rate: f64,
    /// Of |g'|.
    pub rate: f64,
    /// Of the gap's derivatives 4 to 6.
    pub fourth: f64,
    pub fifth: f64,
    pub sixth: f64,
}

lanes_of! {
    /// Several bounds.
    GapBoundsLanes of GapBounds {
        pendulum_rate: pendulum_rate, rate: rate, fourth: fourth, fifth: fifth, sixth: sixth
    }
}

/// The gap function along one local flight.
pub(crate) struct GapFlight<'a, G: Geometry> {
    motion: &'a FreeMotion,
    flight: &'a Flight,
    geometry: PhantomData<G>,
    start: f64,
    start_noise: f64,
    /// Rounding of g at the start of a flight that is not on the contact by definition.
    pub fresh_noise: f64,
    /// Bound of |g'|.
    pub rate_bound: f64,
    /// A separation velocity below this is rounding and counts as zero.
    pub rest: f64,
    /// Bound of |g''''|.
    pub fourth_bound: f64,
    /// Bounds of the fifth and sixth derivative; infinite where they are not known.
    pub fifth_bound: f64,
    sixth_bound: f64,
}

impl<'a, G: Geometry> GapFlight<'a, G> {
    /// `touching`: the flight starts on the contact, g = 0 exactly (after an impact).
    pub fn new(motion: &'a FreeMotion, flight: &'a Flight, touching: bool) -> Self {
        let (p, o) = motion.bounds(flight);
        Self::within(
            motion,
            flight,
            touching,
            GapBounds {
                pendulum_rate: p.0[0],
                rate: p.0[0] + o.0[0],
                fourth: (G::fourth(&p.0) + o.0[3]) * BOUND_MARGIN,
                fifth: f64::INFINITY,
                sixth: f64::INFINITY,
            },
        )
    }

    /// The same with bounds that are known.
    #[inline(always)]
    pub fn within(
        motion: &'a FreeMotion,
        flight: &'a Flight,
        touching: bool,
        bounds: GapBounds,
    ) -> Self {
        let tip = G::tip(flight.state.x1, flight.angle);
        let delta = motion.gap;
        let fresh_noise = noise(tip, flight.state.x2, delta);
        let (start, start_noise) =
            if touching { (0.0, 0.0) } else { (tip - flight.state.x2 - delta, fresh_noise) };
        Self {
            motion,
            flight,
            geometry: PhantomData,
            start,
            start_noise,
            fresh_noise,
            rate_bound: bounds.rate,
            rest: REST_NOISE * EPS * bounds.rate
                + 2.0 * G::slope_noise(flight.state.x1, bounds.pendulum_rate),
            fourth_bound: bounds.fourth,
            fifth_bound: bounds.fifth,
            sixth_bound: bounds.sixth,
        }
    }

    /// Gap function, angle, and motion of both bodies at local time `s`.
    #[inline(always)]
    pub fn at(&self, s: f64) -> (GapPoint, Angle, (Motion, Motion)) {
        let (p, o) = self.motion.at(self.flight, s);
        let turned =
            if G::TURNS { elementary::turn(p.increment, 0.0) } else { elementary::STRAIGHT };
        let (gap, angle) = gap_after::<G>(self.start, self.flight.angle, turned, &p, &o);
        (gap, angle, (p, o))
    }

    /// Higher derivatives at a sampled local time.
    #[inline(always)]
    pub fn higher(&self, angle: Angle, bodies: &(Motion, Motion)) -> Higher {
        let motion = self.motion;
        gap_higher::<G>((&motion.pendulum.equation, &motion.oscillator.equation), angle, bodies)
    }

    /// Bound of what a Taylor polynomial of order 5 leaves out at `offset`.
    #[inline(always)]
    pub fn remainder(&self, offset: f64) -> f64 {
        gap_remainder(self.fourth_bound, self.fifth_bound, self.sixth_bound, offset)
    }

    /// State `h` after a sampled local time, from the Taylor polynomials of both bodies.
    #[inline(always)]
    pub fn state_later(&self, bodies: &(Motion, Motion), h: f64) -> State {
        self.motion.state_later(bodies, h)
    }

    /// Bound of the rounding error of `at(s).value`.
    #[inline(always)]
    pub fn noise(&self, s: f64) -> f64 {
        self.start_noise + flight_noise(self.rate_bound, s)
    }
}

/// Gap function and angle after a motion of both bodies; `turned`: (cos - 1, sin) of the increment of
/// x1.
#[inline(always)]
pub(crate) fn gap_after<G: Geometry>(
    start: f64,
    angle: Angle,
    turned: (f64, f64),
    p: &Motion,
    o: &Motion,
) -> (GapPoint, Angle) {
    let (tip, angle) = G::tip_motion(angle, turned, p);
    let gap = GapPoint {
        value: start + (tip[0] - o.increment),
        rate: tip[1] - o.rate,
        second: tip[2] - o.acceleration,
        third: tip[3] - o.jerk,
    };
    (gap, angle)
}

/// Higher derivatives of the gap after a motion of both bodies.
#[inline(always)]
pub(crate) fn gap_higher<G: Geometry>(
    (pendulum, oscillator): (&Equation, &Equation),
    angle: Angle,
    (p, o): &(Motion, Motion),
) -> Higher {
    let [fourth, fifth, _] = pendulum.higher(p);
    let [others_fourth, others_fifth, _] = oscillator.higher(o);
    Higher {
        fourth: G::tip_fourth(angle, p, fourth) - others_fourth,
        fifth: G::tip_fifth(angle, p, [fourth, fifth]) - others_fifth,
    }
}

/// The third and fourth derivative of the gap at the start of a flight.
#[inline(always)]
pub(crate) fn higher_at_start<G: Geometry>(motion: &FreeMotion, flight: &Flight) -> (f64, f64) {
    let bodies = motion.at_start(flight);
    let (p, o) = &bodies;
    let (gap, angle) = gap_after::<G>(0.0, flight.angle, elementary::STRAIGHT, p, o);
    let equations = (&motion.pendulum.equation, &motion.oscillator.equation);
    (gap.third, gap_higher::<G>(equations, angle, &bodies).fourth)
}

/// What a Taylor polynomial of order 5 of the gap leaves out at `offset`, from bounds of the derivatives
/// 4 to 6, infinite where they are not known.
#[inline(always)]
pub(crate) fn gap_remainder(fourth: f64, fifth: f64, sixth: f64, offset: f64) -> f64 {
    let square = offset * offset;
    // By lower bounds twice the first term left out, with room for the polynomial's own terms after it.
    let best = (fourth / 8.0).min(fifth / 60.0 * offset.abs()).min(sixth / 720.0 * square);
    best * (square * square)
}

/// Rounding of an increment of the gap over a flight of length `s`.
#[inline(always)]
pub(crate) fn flight_noise(rate_bound: f64, s: f64) -> f64 {
    FLIGHT_NOISE * EPS * rate_bound * s
}

#[inline(always)]
pub(crate) fn noise(tip: f64, x2: f64, delta: f64) -> f64 {
    GAP_NOISE * EPS * (tip.abs() + x2.abs() + delta.abs())
}

impl FreeMotion {
    /// The gap function and its derivatives at the start of a flight on the contact.
    pub(crate) fn contact_gap(&self, flight: &Flight) -> GapPoint {
        match self.contact {
            Contact::Oblique => GapFlight::<Oblique>::new(self, flight, true).at(0.0).0,
            Contact::Direct => GapFlight::<Direct>::new(self, flight, true).at(0.0).0,
        }
    }
}

impl System {
    /// Rounding level of [`System::gap_function`] there.
    pub(crate) fn gap_noise(&self, state: &State) -> f64 {
        noise(self.tip(state.x1), state.x2, self.gap)
    }
}
