//! The equation of motion of one body, x'' + 2 c x' + w^2 x = f cos psi + load, and its usual
//! solution: a body that swings about its equilibrium, and answers the drive with its steady
//! response. No branch in it needs a jump,
//! so that it can be evaluated for one body or for several in the lanes of a register.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use super::{BodyFlight, BodyFlights, Motion};
use crate::flight::drive::{Trig, Trigs, Turn};
use crate::flight::resonance::Beat;
use crate::flight::tolerances::{DECAYED, SHORT_ORDERS};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::{MOST_TURNED, decay, decay_minus_1, fused_sin_cos};
use crate::numerics::lanes::{LANES, Lanes, lanes_of};
use crate::numerics::reciprocals::reciprocals;

/// Highest order of the Taylor series.
const MOST_TERMS: usize = SHORT_ORDERS[SHORT_ORDERS.len() - 1].1;

/// 1/n.
pub(super) const INVERSE: [f64; MOST_TERMS + 2] = reciprocals();

const THIRD: f64 = 1.0 / 3.0;

/// Constants of one body's equation of motion.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Equation {
    pub natural: f64,
    pub natural_squared: f64,
    /// c = zeta w.
    pub decay_rate: f64,
    pub forcing: f64,
    /// Constant load.
    pub load: f64,
    /// The equilibrium load/w^2 about which the free motion is written; 0 where it is not.
    pub equilibrium: f64,
    pub omega: f64,
    /// Damped frequency (or kappa) to 32 digits.
    pub damped: DoubleDouble,
    /// Real and imaginary part of P = f/(w^2 - omega^2 + 2 i c omega); not finite at resonance
    /// without damping.
    pub steady_re: f64,
    pub steady_im: f64,
    /// |P|.
    pub steady_size: f64,
    /// |x^(n+1)| of a free oscillation is at most this times the bound of |x^(n)|, n >= 1.
    pub growth: f64,
    /// Longest time for the Taylor series.
    pub short: f64,
}

lanes_of! {
    /// The equations of several bodies.
    Equations of Equation {
        natural: natural,
        natural_squared: natural_squared,
        decay_rate: decay_rate,
        forcing: forcing,
        load: load,
        equilibrium: equilibrium,
        omega: omega,
        damped: damped.hi,
        damped_rest: damped.lo,
        steady_re: steady_re,
        steady_im: steady_im,
        steady_size: steady_size,
        growth: growth,
        short: short,
    }
}

impl Equations {
    /// [`Equation::amplitude_change`] of each.
    #[inline(always)]
    pub fn amplitude_changes(&self, times: &Lanes) -> Lanes {
        let mut changes = [0.0; LANES];
        for j in 0..LANES {
            changes[j] = self.get(j).amplitude_change(times[j]);
        }
        changes
    }
}

impl Equation {
    /// Displacement and rate/omega of the steady response Re(P e^{i psi}) at the start of a flight.
    #[inline(always)]
    pub fn steady_start(&self, start: Trig) -> (f64, f64) {
        let (re, im) = (self.steady_re, self.steady_im);
        (re * start.cos - im * start.sin, -(re * start.sin + im * start.cos))
    }

    /// A flight with the steady response; of an unforced body that is zero.
    #[inline(always)]
    pub fn steady_flight(&self, x: f64, v: f64, start: Trig) -> BodyFlight {
        let (p, q) = self.steady_start(start);
        self.flight((x, v), (x - self.equilibrium - p, v - self.omega * q), (p, q))
    }

    /// A flight with a beat.
    #[inline(always)]
    pub fn beating_flight(&self, beat: &Beat, x: f64, v: f64, start: Trig) -> BodyFlight {
        let (p, q) = beat.factor(start);
        self.flight((x, v), (x - self.equilibrium, v - p), (p, q))
    }

    /// A flight from its state, its free part's displacement and rate, and its forced part's
    /// constants.
    #[inline(always)]
    pub fn flight(
        &self,
        (x, v): (f64, f64),
        (a, rate): (f64, f64),
        (p, q): (f64, f64),
    ) -> BodyFlight {
        let c = self.decay_rate;
        // Not by w^2, a constant whose rounding every flight would leave in the energy.
        let k = self.natural * (self.natural * a) + c * rate;
        BodyFlight { x, v, a, rate, b: rate + c * a, k, p, q }
    }

    /// Bounds of the derivatives 1 to 6 over a flight with the steady response, for ever. The
    /// energy sqrt(v^2 + w^2 x^2) of a free oscillation does not grow, and the derivative of one is
    /// another with at most w (zeta + sqrt(1 + zeta^2)) times the energy; the steady response adds
    /// |P| omega^n.
    #[inline(always)]
    pub fn steady_bounds(&self, f: &BodyFlight) -> [f64; 6] {
        let mut bounds = [0.0; 6];
        let mut free = (f.rate * f.rate + self.natural_squared * f.a * f.a).sqrt();
        let mut forced = self.steady_size * self.omega;
        for bound in &mut bounds {
            *bound = free + forced;
            free *= self.growth;
            forced *= self.omega;
        }
        bounds
    }

    /// Whether the free motion has decayed so far that its start would cancel.
    #[inline(always)]
    pub fn decayed(&self, s: f64) -> bool {
        self.decay_rate * s > DECAYED
    }

    /// e^{-c s} - 1, the relative change of the free oscillation's amplitude.
    #[inline(always)]
    pub fn amplitude_change(&self, s: f64) -> f64 {
        if self.decay_rate == 0.0 { 0.0 } else { decay_minus_1(-self.decay_rate * s) }
    }

    /// Increment of the displacement, and rate, of the free part by (C - 1, S).
    #[inline(always)]
    pub fn free(f: &BodyFlight, (c1, s1): (f64, f64)) -> (f64, f64) {
        (f.a * c1 + f.b * s1, f.rate + (f.rate * c1 - f.k * s1))
    }

    /// Increment of the displacement, and rate, of the free part and the steady response together.
    #[inline(always)]
    pub fn combine(&self, f: &BodyFlight, basis: (f64, f64), turn: &Turn) -> (f64, f64) {
        let (increment, rate) = Self::free(f, basis);
        (increment + (f.p * turn.cos_minus_1 + f.q * turn.sin), rate + self.steady_rate(f, turn))
    }

    #[inline(always)]
    pub fn steady_rate(&self, f: &BodyFlight, turn: &Turn) -> f64 {
        self.omega * (f.q + (f.q * turn.cos_minus_1 - f.p * turn.sin))
    }

    /// Increment of the displacement, and rate, at a local time `s` at which the free motion has
    /// not decayed; `change` of its amplitude, `turned`: (cos wd s - 1, sin wd s).
    #[inline(always)]
    pub fn swung(
        &self,
        f: &BodyFlight,
        change: f64,
        turned: (f64, f64),
        turn: &Turn,
    ) -> (f64, f64) {
        self.combine(f, self.swinging_basis(change, turned), turn)
    }

    /// Displacement (not its increment) and rate at a local time `s` at which the free motion has
    /// decayed, without the start's rounding.
    #[inline(always)]
    pub fn faded(
        &self,
        f: &BodyFlight,
        s: f64,
        (cos_minus_1, sin): (f64, f64),
        turn: &Turn,
    ) -> (f64, f64) {
        let left = decay(-self.decay_rate * s);
        let (cosine, sine) = (left * (1.0 + cos_minus_1), left * (sin / self.damped.hi));
        (
            (f.a * cosine + f.b * sine)
                + (f.p + (f.p * turn.cos_minus_1 + f.q * turn.sin))
                + self.equilibrium,
            (f.rate * cosine - f.k * sine) + self.steady_rate(f, turn),
        )
    }

    /// (C - 1, S) of a body that swings, from the change of its amplitude and
    /// (cos wd s - 1, sin wd s).
    #[inline(always)]
    pub fn swinging_basis(&self, change: f64, (cos_minus_1, sin): (f64, f64)) -> (f64, f64) {
        let remaining = 1.0 + change;
        (change + remaining * cos_minus_1, remaining * (sin / self.damped.hi))
    }

    /// Derivatives of displacement and rate by those at the start, from (C - 1, S):
    /// x = a C + (v + c a) S.
    #[inline(always)]
    pub fn transition_by(&self, (c1, sine): (f64, f64)) -> [[f64; 2]; 2] {
        let shift = self.decay_rate * sine;
        [[1.0 + c1 + shift, sine], [-self.natural_squared * sine, 1.0 + c1 - shift]]
    }

    /// These derivatives of a body that swings, after a time in which it turns by at most
    /// [`MOST_TURNED`] and its amplitude has this change. With fused operations: for what is compiled
    /// where these are instructions.
    #[inline(always)]
    pub fn swung_transition(&self, time: f64, change: f64) -> [[f64; 2]; 2] {
        // No double-double: what rounding changes is no more than it changes in the time.
        let (sin, cos) = fused_sin_cos(self.damped.hi * time);
        self.transition_by(self.swinging_basis(change, (cos - 1.0, sin)))
    }

    /// Whether [`Equation::swung_transition`] holds for this time.
    #[inline(always)]
    pub fn turns_within(&self, time: f64) -> bool {
        self.damped.hi * time <= MOST_TURNED
    }

    /// Terms of the Taylor series that are needed at a time; 0 where it is too long for the series.
    pub fn series_order(&self, s: f64) -> usize {
        let needed = SHORT_ORDERS.iter().find(|&&(part, _)| s <= part * self.short);
        needed.map_or(0, |&(_, order)| order)
    }

    /// This equation of motion with `s` as the unit of time.
    pub fn in_units_of(&self, s: f64) -> Self {
        Self {
            natural_squared: self.natural_squared * s * s,
            decay_rate: self.decay_rate * s,
            forcing: self.forcing * s * s,
            load: self.load * s * s,
            omega: self.omega * s,
            short: self.short / s,
            ..*self
        }
    }

    /// The next derivatives from the equation of motion.
    #[inline(always)]
    pub fn motion_from(&self, increment: f64, rate: f64, place: [f64; 2], turn: &Turn) -> Motion {
        let (w2, c2) = (self.natural_squared, 2.0 * self.decay_rate);
        let x = place[0] + place[1];
        let acceleration = self.forcing * turn.phase.cos - c2 * rate - w2 * x + self.load;
        let jerk = -self.forcing * self.omega * turn.phase.sin - c2 * acceleration - w2 * rate;
        Motion { increment, place, rate, acceleration, jerk }
    }

    /// Derivatives 4 to 6 of the displacement: x'''' = -omega^2 f cos psi - 2 c x''' - w^2 x'', and
    /// so on; f cos psi and its rate from the equation of motion.
    #[inline(always)]
    pub fn higher(&self, m: &Motion) -> [f64; 3] {
        let (w2, c2) = (self.natural_squared, 2.0 * self.decay_rate);
        let omega2 = self.omega * self.omega;
        let drive = m.acceleration + c2 * m.rate + w2 * m.displacement() - self.load;
        let drive_rate = m.jerk + c2 * m.acceleration + w2 * m.rate;
        let fourth = -omega2 * drive - c2 * m.jerk - w2 * m.acceleration;
        let fifth = -omega2 * drive_rate - c2 * fourth - w2 * m.jerk;
        [fourth, fifth, omega2 * omega2 * drive - c2 * fifth - w2 * fourth]
    }

    /// Displacement and rate a short time `h` after a motion, by Taylor polynomials up to the sixth
    /// derivative. (Energy would drift by the last term, whose sign is always the same.)
    #[inline(always)]
    pub fn later(&self, m: &Motion, h: f64) -> (f64, f64) {
        let [fourth, fifth, sixth] = self.higher(m);
        let (half, third, quarter) = (0.5 * h, THIRD * h, 0.25 * h);
        let tail = fourth + 0.2 * h * fifth;
        let displacement =
            h * (m.rate + half * (m.acceleration + third * (m.jerk + quarter * tail)));
        let tail = fourth + quarter * (fifth + 0.2 * h * sixth);
        let speed = h * (m.acceleration + half * (m.jerk + third * tail));
        (m.place[0] + (m.place[1] + displacement), m.rate + speed)
    }

    /// From the equation of motion.
    #[inline(always)]
    pub fn acceleration(&self, x: f64, v: f64, cos_psi: f64) -> f64 {
        let c2 = 2.0 * self.decay_rate;
        let free = self.natural_squared.mul_add(x, c2.mul_add(v, -self.load));
        self.forcing.mul_add(cos_psi, -free)
    }
}

/// Motion a short time after the start, by its Taylor series: free and steady motion cancel there,
/// and a body that starts at rest would move by their rounding.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Series {
    /// Taylor coefficients of x.
    lower: f64,
    upper: f64,
    /// Those of f cos psi and f sin psi, by (cos)' = -omega sin.
    cos: f64,
    sin: f64,
    /// The constant load, which has one coefficient; then 0.
    load: f64,
    pub power: f64,
    pub increment: f64,
    pub rate: f64,
}

lanes_of! {
    /// Several series.
    SeriesLanes of Series {
        lower: lower,
        upper: upper,
        cos: cos,
        sin: sin,
        load: load,
        power: power,
        increment: increment,
        rate: rate,
    }
}

impl SeriesLanes {
    /// The series of several flights, one body of each, at the times of those that are short.
    #[inline(always)]
    pub fn sum(
        &mut self,
        equations: &Equations,
        flights: &BodyFlights,
        starts: &Trigs,
        times: &Lanes,
    ) {
        let (mut orders, mut most) = ([0.0; LANES], 0);
        for j in 0..LANES {
            // An empty lane has no short time.
            if equations.short[j] > 0.0 && times[j] <= equations.short[j] {
                let order = equations.get(j).series_order(times[j]);
                (orders[j], most) = (order as f64, most.max(order));
            }
        }
        self.sum_to(equations, flights, starts, times, (&orders, most));
    }

    /// The same to an order of each, the highest of which is `most`.
    #[inline(always)]
    pub fn sum_to(
        &mut self,
        equations: &Equations,
        flights: &BodyFlights,
        starts: &Trigs,
        times: &Lanes,
        (orders, most): (&Lanes, usize),
    ) {
        if most == 0 {
            return;
        }
        for j in 0..LANES {
            self.set(j, &Series::new(&equations.get(j), &flights.get(j), starts.get(j)));
        }
        for n in 1..=most {
            for j in 0..LANES {
                let mut one = self.get(j);
                // Terms of higher order vanish.
                one.power = if n as f64 <= orders[j] { one.power } else { 0.0 };
                one.add(&equations.get(j), n, times[j]);
                self.set(j, &one);
            }
        }
    }
}

impl Series {
    #[inline(always)]
    pub fn new(equation: &Equation, f: &BodyFlight, start: Trig) -> Self {
        Self {
            lower: f.x,
            upper: f.v,
            cos: equation.forcing * start.cos,
            sin: equation.forcing * start.sin,
            load: equation.load,
            power: 1.0,
            increment: 0.0,
            rate: 0.0,
        }
    }

    /// Increment and rate at a short time `s`.
    #[inline(always)]
    pub fn at(equation: &Equation, f: &BodyFlight, start: Trig, s: f64) -> (f64, f64) {
        let mut series = Self::new(equation, f, start);
        for n in 1..=equation.series_order(s) {
            series.add(equation, n, s);
        }
        (series.increment, series.rate)
    }

    /// Adds the n-th term at time `s`.
    #[inline(always)]
    pub fn add(&mut self, equation: &Equation, n: usize, s: f64) {
        let (w2, c2) = (equation.natural_squared, 2.0 * equation.decay_rate);
        let order = n as f64;
        let (part, next_part) = (INVERSE[n], INVERSE[n + 1]);
        let Self { lower, upper, cos, sin, .. } = *self;
        self.rate += order * upper * self.power;
        self.power *= s;
        self.increment += upper * self.power;
        let next = (cos - c2 * order * upper - w2 * lower + self.load) * (part * next_part);
        (self.lower, self.upper, self.load) = (upper, next, 0.0);
        (self.cos, self.sin) = (-equation.omega * sin * part, equation.omega * cos * part);
    }
}
