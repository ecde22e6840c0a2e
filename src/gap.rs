//! Contact geometry: the gap function g (negative while the bodies are apart), its derivatives,
//! and the rounding of its evaluation (docs/theory.md, section 1).
//!
//! *oblique*: g = sin x1 - x2 - delta; *direct*: g = x1 - x2 - delta.

use crate::flight::{Flight, FreeMotion, Motion};
use crate::lanes;
use crate::params::{Contact, System};
use crate::state::State;
use crate::tolerance::{BOUND_MARGIN, EPS, FLIGHT_NOISE, GAP_NOISE, REST_NOISE};

/// Gap function and its first three derivatives at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GapPoint {
    /// g; zero in contact, negative apart.
    pub value: f64,
    /// g', positive in approach.
    pub rate: f64,
    /// g''.
    pub second: f64,
    /// g'''.
    pub third: f64,
}

impl GapPoint {
    /// The gap function a little later, from its Taylor polynomial.
    pub(crate) fn later(&self, h: f64) -> Self {
        let Self { value, rate, second, third } = *self;
        Self {
            value: value + h * (rate + h / 2.0 * (second + h / 3.0 * third)),
            rate: rate + h * (second + h / 2.0 * third),
            second: second + h * third,
            third,
        }
    }
}

/// What differs between the geometries. The angle enters through sin and cos of x1 at the start
/// of a flight, so that the gap is an increment too: relatively exact for short hops.
pub(crate) trait Geometry {
    /// Constants of a flight, from the pendulum's angle at its start.
    type Anchor: Copy;
    /// Whether the gap needs the sine of x1.
    const TURNS: bool;
    fn anchor(x1: f64) -> Self::Anchor;
    /// Position of the tip along the normal: sin x1, or x1.
    fn tip(anchor: Self::Anchor) -> f64;
    /// Increment of the tip's position, and its derivatives 1 to 3.
    fn tip_motion(anchor: Self::Anchor, p: &Motion) -> [f64; 4];
    /// Change of g' by the rounding of x1, at a rate x1' of this size.
    fn slope_noise(x1: f64, speed: f64) -> f64;
    /// Bound of the fourth derivative of the tip's position, from bounds of x1', ..., x1''''.
    fn fourth(bounds: &[f64; 4]) -> f64;
    /// Position of the tip and its two derivatives, for the first pass of the contact search.
    fn tip_fast(x1: f64, v1: f64, a1: f64) -> [f64; 3];
    /// Bounds of the derivatives 4 to 6 of the tip's position, from those of x1.
    fn high_derivatives(bounds: &[f64; 6]) -> [f64; 3];
}

pub(crate) struct Oblique;
pub(crate) struct Direct;

impl Geometry for Oblique {
    type Anchor = (f64, f64);
    const TURNS: bool = true;

    #[inline]
    fn anchor(x1: f64) -> (f64, f64) {
        x1.sin_cos()
    }

    #[inline]
    fn tip((sin, _): (f64, f64)) -> f64 {
        sin
    }

    #[inline]
    fn tip_motion((sin0, cos0): (f64, f64), p: &Motion) -> [f64; 4] {
        let (half_sin, half_cos) = (0.5 * p.increment).sin_cos();
        let twice = 2.0 * half_sin;
        let increment = twice * (cos0 * half_cos - sin0 * half_sin);
        let sin = sin0 + increment;
        let cos = cos0 - twice * (sin0 * half_cos + cos0 * half_sin);
        let (v, a) = (p.rate, p.acceleration);
        let v2 = v * v;
        [increment, v * cos, a * cos - v2 * sin, (p.jerk - v2 * v) * cos - 3.0 * v * a * sin]
    }

    fn slope_noise(x1: f64, speed: f64) -> f64 {
        EPS * x1.abs() * speed
    }

    fn fourth(&[v, a, j, s]: &[f64; 4]) -> f64 {
        // (sin x)'''' = cos x (x'''' - 6 x'^2 x'') - sin x (4 x' x''' + 3 x''^2 - x'^4)
        (s + 6.0 * v * v * a).hypot(4.0 * v * j + 3.0 * a * a + v.powi(4))
    }

    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn tip_fast(x1: f64, v1: f64, a1: f64) -> [f64; 3] {
        let (sin, cos) = lanes::sin_cos(x1);
        [sin, v1 * cos, a1 * cos - v1 * v1 * sin]
    }

    #[inline(always)]
    #[allow(clippy::inline_always)]
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
    type Anchor = f64;
    const TURNS: bool = false;

    #[inline]
    fn anchor(x1: f64) -> f64 {
        x1
    }

    #[inline]
    fn tip(x1: f64) -> f64 {
        x1
    }

    #[inline]
    fn tip_motion(_: f64, p: &Motion) -> [f64; 4] {
        [p.increment, p.rate, p.acceleration, p.jerk]
    }

    fn slope_noise(_: f64, _: f64) -> f64 {
        0.0
    }

    fn fourth(&[_, _, _, s]: &[f64; 4]) -> f64 {
        s
    }

    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn tip_fast(x1: f64, v1: f64, a1: f64) -> [f64; 3] {
        [x1, v1, a1]
    }

    fn high_derivatives(&[_, _, _, d, e, f]: &[f64; 6]) -> [f64; 3] {
        [d, e, f]
    }
}

/// Bounds of derivatives over a local flight.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GapBounds {
    /// Of |x1'|.
    pub pendulum_rate: f64,
    /// Of |g'|.
    pub rate: f64,
    /// Of the gap's fourth derivative.
    pub fourth: f64,
}

/// The gap function along one local flight.
pub(crate) struct GapFlight<'a, G: Geometry> {
    motion: &'a FreeMotion,
    flight: &'a Flight,
    anchor: G::Anchor,
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
}

impl<'a, G: Geometry> GapFlight<'a, G> {
    /// `touching`: the flight starts on the contact, g = 0 exactly (after an impact).
    pub fn new(motion: &'a FreeMotion, flight: &'a Flight, delta: f64, touching: bool) -> Self {
        let (p, o) = motion.bounds(flight);
        Self::within(
            motion,
            flight,
            delta,
            touching,
            GapBounds {
                pendulum_rate: p.0[0],
                rate: p.0[0] + o.0[0],
                fourth: (G::fourth(&p.0) + o.0[3]) * BOUND_MARGIN,
            },
        )
    }

    /// The same with bounds that are known.
    pub fn within(
        motion: &'a FreeMotion,
        flight: &'a Flight,
        delta: f64,
        touching: bool,
        bounds: GapBounds,
    ) -> Self {
        let anchor = G::anchor(flight.state.x1);
        let tip = G::tip(anchor);
        let fresh_noise = noise(tip, flight.state.x2, delta);
        let (start, start_noise) =
            if touching { (0.0, 0.0) } else { (tip - flight.state.x2 - delta, fresh_noise) };
        Self {
            motion,
            flight,
            anchor,
            start,
            start_noise,
            fresh_noise,
            rate_bound: bounds.rate,
            rest: REST_NOISE * EPS * bounds.rate
                + 2.0 * G::slope_noise(flight.state.x1, bounds.pendulum_rate),
            fourth_bound: bounds.fourth,
        }
    }

    /// Gap function and motion of both bodies at local time `s`.
    #[inline]
    pub fn at(&self, s: f64) -> (GapPoint, (Motion, Motion)) {
        self.gap(self.motion.at(self.flight, s))
    }

    /// The same with the rounding of all angles made good.
    pub fn at_exactly(&self, s: f64) -> (GapPoint, (Motion, Motion)) {
        self.gap(self.motion.at_exactly(self.flight, s))
    }

    #[inline]
    fn gap(&self, (p, o): (Motion, Motion)) -> (GapPoint, (Motion, Motion)) {
        let tip = G::tip_motion(self.anchor, &p);
        let gap = GapPoint {
            value: self.start + (tip[0] - o.increment),
            rate: tip[1] - o.rate,
            second: tip[2] - o.acceleration,
            third: tip[3] - o.jerk,
        };
        (gap, (p, o))
    }

    /// State `h` after a sampled local time, from the Taylor polynomials of both bodies.
    pub fn state_later(&self, bodies: &(Motion, Motion), h: f64) -> State {
        self.motion.state_later(bodies, h)
    }

    /// Bound of the rounding error of `at(s).value`.
    #[inline]
    pub fn noise(&self, s: f64) -> f64 {
        self.start_noise + FLIGHT_NOISE * EPS * self.rate_bound * s
    }
}

fn noise(tip: f64, x2: f64, delta: f64) -> f64 {
    GAP_NOISE * EPS * (tip.abs() + x2.abs() + delta.abs())
}

impl FreeMotion {
    /// The gap function and its derivatives at the start of a flight on the contact.
    pub(crate) fn contact_gap(&self, flight: &Flight, contact: Contact) -> GapPoint {
        match contact {
            Contact::Oblique => GapFlight::<Oblique>::new(self, flight, 0.0, true).at(0.0).0,
            Contact::Direct => GapFlight::<Direct>::new(self, flight, 0.0, true).at(0.0).0,
        }
    }
}

impl System {
    /// Position of the pendulum's tip along the contact normal: sin x1, or x1 in direct contact.
    pub(crate) fn tip(&self, x1: f64) -> f64 {
        match self.contact {
            Contact::Oblique => x1.sin(),
            Contact::Direct => x1,
        }
    }

    /// Gap function g = tip - x2 - delta of a state: negative while the bodies are apart.
    #[must_use]
    pub fn gap_function(&self, state: &State) -> f64 {
        self.tip(state.x1) - state.x2 - self.gap
    }

    /// Rounding level of [`System::gap_function`] there.
    pub(crate) fn gap_noise(&self, state: &State) -> f64 {
        noise(self.tip(state.x1), state.x2, self.gap)
    }

    /// Approach velocity u = g' = v1 cos x1 - v2.
    #[must_use]
    pub fn approach_velocity(&self, state: &State) -> f64 {
        match self.contact {
            Contact::Oblique => state.v1 * state.x1.cos() - state.v2,
            Contact::Direct => state.v1 - state.v2,
        }
    }
}
