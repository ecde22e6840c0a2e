//! Sliding on the contact: one step of the one-dimensional equation of motion by its Taylor series,
//! and the first event in it.
//!
//! Equations of `contact/sustained.rs`; the coefficients follow by the recursions of automatic differentiation
//! (Jorba & Zou (2005), Exp. Math. 14, 99), sums of products and one quotient. The series is the
//! dense output too: on it the events are found by the majorant search of the contact detection,
//! which cannot step over a root. The side of sin x1 = 0 and the direction of slip are constants of
//! a step, so that |sin x1| and sgn x1' have no kink in it. docs/contact-phase.md measures all this
//! against a general integrator.

use std::f64::consts::PI;

use super::ContactMode;
use crate::flight::Trig;
use crate::model::angle::Angle;
use crate::model::parameters::{Contact, Parameters, System};
use crate::model::state::State;
use crate::numerics::dual::Number;
use crate::numerics::majorant::first_root;
use crate::numerics::tolerance::{CONTACT_ANGLE, EPS, FORCE_NOISE, LEAST_STEP, REACH_LEVEL};

/// Order of the series of x1.
pub(super) const ORDER: usize = 24;
/// Order of the series of the force, two derivatives less.
const FORCED: usize = ORDER - 2;

type Series<T> = [T; ORDER + 1];

/// The series of a step, in time over `unit`, in which the motion is of order one: in plain time
/// the coefficients of a tip driven to the end of its reach overflow.
#[derive(Debug, Clone)]
pub(crate) struct SlideSeries<T> {
    x: Series<T>,
    v: Series<T>,
    /// sin x1 (direct: 0).
    sin: Series<T>,
    /// p (mbar + k cos x1): the free gap acceleration.
    free: Series<T>,
    /// mbar + k cos x1.
    inertia: Series<T>,
    /// k at the start.
    k: T,
    /// A power of two, so that no digit is lost.
    unit: f64,
}

/// One step of a slide.
#[derive(Debug, Clone)]
pub(crate) struct SlideStep {
    series: SlideSeries<f64>,
    /// Length of the step, in `unit`.
    reach: f64,
    mode: ContactMode,
    /// sgn(sin x1), 0 where friction plays no part.
    side: f64,
    /// Rounding of `free` and of x1''.
    noise: f64,
    acceleration_noise: f64,
    least_inertia: f64,
}

/// What ends a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SlideEnd {
    /// The series is used up.
    Continues,
    /// p falls through 0.
    Released,
    /// x1' reaches 0 (with friction only).
    Stopped,
    /// sin x1 = 0: the friction's side changes.
    Side,
    /// mbar + k cos x1 reaches 0.
    Painleve,
}

impl SlideEnd {
    /// Whether the slide goes on with another step.
    pub fn goes_on(self) -> bool {
        matches!(self, Self::Continues | Self::Side)
    }
}

/// Coefficient n of a product.
fn product<T: Number>(a: &Series<T>, b: &Series<T>, n: usize) -> T {
    (0..=n).fold(T::constant(0.0), |sum, j| sum + a[j] * b[n - j])
}
/// The equation of a slide, with or without derivatives.
struct Equation<'a, T> {
    parameters: &'a Parameters<T>,
    /// s sgn(sin x1): k = cos x1 + mu s |sin x1|.
    slip: f64,
    unit: f64,
}

impl<T: Number> Equation<'_, T> {
    /// The series from a forcing phase (its cosine and sine), x1 and x1'.
    fn series(&self, (cos_psi, sin_psi): (T, T), x1: T, v1: T) -> SlideSeries<T> {
        let &Self { parameters: p, slip, unit } = self;
        let oblique = p.contact == Contact::Oblique;
        let (pendulum, oscillator) =
            (p.pendulum().in_units_of(unit), p.oscillator().in_units_of(unit));
        let omega = p.drive_frequency * unit;
        let friction = p.friction * slip;
        let zero = [T::constant(0.0); ORDER + 1];
        let (mut x, mut v, mut sin, mut cos) = (zero, zero, zero, zero);
        let (mut a1, mut k, mut square) = (zero, zero, zero);
        let (mut free, mut inertia, mut force) = (zero, zero, zero);
        (x[0], x[1], v[0]) = (x1, v1 * unit, v1 * unit);
        Angle { sin: sin[0], cos: cos[0] } = p.contact.angle(x1);
        // Coefficients of cos psi by (cos psi)'' = -omega^2 cos psi.
        let (mut load, mut next_load) = (cos_psi, -omega * sin_psi);
        for n in 0..=FORCED {
            let order = (n + 1) as f64;
            let over = |numerator: T, divisor: f64| numerator / T::constant(divisor);
            // (n + 1) sin_(n+1): the rate of the tip, x2' too.
            let tip_rate = if oblique {
                let rate = product(&cos, &v, n);
                cos[n + 1] = over(-product(&sin, &v, n), order);
                sin[n + 1] = over(rate, order);
                rate
            } else {
                v[n]
            };
            let tip = if oblique { sin[n] } else { x[n] };
            let place = if n == 0 { tip - p.gap } else { tip };
            a1[n] = pendulum.acceleration(x[n], v[n], load);
            let a2 = oscillator.acceleration(place, tip_rate, load);
            k[n] = cos[n] + friction * sin[n];
            let slope = product(&k, &cos, n);
            inertia[n] = if n == 0 { p.mass_ratio + slope } else { slope };
            square[n] = product(&v, &v, n);
            let (pull, turn) = (product(&a1, &cos, n), product(&square, &sin, n));
            free[n] = pull - turn - a2;
            let earlier = (1..=n).fold(T::constant(0.0), |sum, j| sum + inertia[j] * force[n - j]);
            force[n] = (free[n] - earlier) / inertia[0];
            let acceleration = a1[n] - product(&k, &force, n);
            v[n + 1] = over(acceleration, order);
            x[n + 2] = over(v[n + 1], order + 1.0);
            (load, next_load) = (next_load, over(-omega * omega * load, order * (order + 1.0)));
        }
        SlideSeries { x, v, sin, free, inertia, k: k[0], unit }
    }
}

impl<T: Number> SlideSeries<T> {
    /// x1 and x1' at local time s.
    pub fn at(&self, s: T) -> (T, T) {
        let unit = T::constant(self.unit);
        let s = s / unit;
        (value(&self.x, s), value(&self.v, s) / unit)
    }
}

impl SlideStep {
    pub fn new(system: &System, phase: Trig, state: &State, mode: ContactMode) -> Self {
        let fastest = system.fastest_rate();
        let oblique = system.contact == Contact::Oblique;
        let turning = if oblique { state.v1.abs() } else { 0.0 };
        let unit = (-(fastest + turning).log2().ceil()).exp2();
        let square_unit = unit * unit;
        let Angle { sin: sin0, cos: cos0 } = system.contact.angle(state.x1);
        let rubs = system.friction > 0.0;
        let side = if !rubs {
            0.0
        } else if near_kink(state.x1, sin0) {
            // On the line: the side the tip slides to. Its velocity may be against the mode by rounding.
            let velocity = if state.v1 == 0.0 { mode.direction() } else { state.v1 };
            1f64.copysign(velocity * cos0)
        } else {
            1f64.copysign(sin0)
        };
        let slip = mode.direction() * side;
        let parameters = system.parameters(|_, value| value);
        let equation = Equation { parameters: &parameters, slip, unit };
        let series = equation.series((phase.cos, phase.sin), state.x1, state.v1);
        let (v, free, k, inertia) = (series.v, series.free, series.k, series.inertia);
        let omega = system.drive_frequency * unit;
        // The phase is rounded: the instant itself is known to this.
        let instant_noise = if omega > 0.0 { 2.0 * PI * EPS / omega } else { 0.0 };
        let instant = system.instant(phase, state);
        let friction = system.friction * slip;
        let terms = system.mass_ratio + (cos0.abs() + friction.abs() * sin0.abs()) * cos0.abs();
        Self {
            reach: reach(&series.x, &v, fastest * unit),
            mode,
            side,
            noise: instant.noise() * square_unit + instant_noise * free[1].abs(),
            acceleration_noise: FORCE_NOISE * EPS * instant.size1 * square_unit
                + (k / inertia[0]).abs() * instant.noise() * square_unit
                + instant_noise * 2.0 * v[2].abs(),
            least_inertia: system.painleve_level(terms),
            series,
        }
    }

    /// The free gap acceleration p (mbar + k cos x1) at local time s.
    pub fn free_acceleration(&self, s: f64) -> f64 {
        let unit = self.series.unit;
        value(&self.series.free[..=FORCED], s / unit) / (unit * unit)
    }

    /// Whether its series is made of numbers: of a tip that turns or is pressed beyond counting it is not.
    pub fn is_finite(&self) -> bool {
        self.series.x.iter().chain(&self.series.v).all(|c| c.is_finite())
    }

    /// Whether mbar + k cos x1 is so small, or negative, that x1 may not resolve what happens: beside a tip at the end of
    /// its reach body 2 is a wall.
    pub fn is_at_reach(&self) -> bool {
        self.series.inertia[0] <= REACH_LEVEL
    }

    /// Whether a slide of such steps would never be done, in local flights of this length.
    pub fn stalls(&self, span: f64) -> bool {
        self.unit() < LEAST_STEP * span
    }

    /// Time in which the motion changes by its own size.
    pub fn unit(&self) -> f64 {
        self.series.unit
    }

    /// Local time at which the step is used up.
    pub fn length(&self) -> f64 {
        self.reach * self.series.unit
    }

    /// The same step with derivatives: cosine and sine of the forcing phase, x1 and x1' at its
    /// start must have the values it was made with.
    pub fn with_derivatives<T: Number>(
        &self,
        parameters: &Parameters<T>,
        phase: (T, T),
        x1: T,
        v1: T,
    ) -> SlideSeries<T> {
        let slip = self.mode.direction() * self.side;
        Equation { parameters, slip, unit: self.series.unit }.series(phase, x1, v1)
    }

    /// x1 and x1' at local time s.
    pub fn at(&self, s: f64) -> (f64, f64) {
        self.series.at(s)
    }

    /// Whether a contact force of 0 at the start falls.
    pub fn falls(&self) -> bool {
        (1..=FORCED)
            .find(|&n| self.series.free[n].abs() * self.reach.powi(n as i32) > self.noise)
            .is_some_and(|n| self.series.free[n] < 0.0)
    }

    /// The first event of the step, and its local time.
    pub fn end(&self) -> (f64, SlideEnd) {
        let mut first = (self.reach, SlideEnd::Continues);
        let mut consider =
            |series: &Series<f64>, length: usize, sign: f64, noise: f64, end: SlideEnd| {
                let mut c = [0.0; ORDER + 1];
                for (c, s) in c[..=length].iter_mut().zip(series) {
                    *c = sign * s;
                }
                if let Some(time) = first_crossing(&c[..=length], first.0, noise) {
                    first = (time, end);
                }
            };
        consider(&self.series.free, FORCED, -1.0, self.noise, SlideEnd::Released);
        if self.side != 0.0 {
            let direction = self.mode.direction();
            let noise = self.acceleration_noise * self.reach;
            consider(&self.series.v, ORDER - 1, -direction, noise, SlideEnd::Stopped);
            consider(
                &self.series.sin,
                FORCED,
                -self.side,
                kink_noise(self.series.x[0]),
                SlideEnd::Side,
            );
        }
        let mut margin = self.series.inertia;
        margin[0] -= self.least_inertia;
        consider(&margin, FORCED, -1.0, 0.0, SlideEnd::Painleve);
        (first.0 * self.series.unit, first.1)
    }
}

/// Whether x1 is a multiple of pi to rounding.
fn near_kink(x1: f64, sin: f64) -> bool {
    sin.abs() <= kink_noise(x1)
}

fn kink_noise(x1: f64) -> f64 {
    2.0 * EPS * x1.abs().max(PI)
}

/// Step length at which the last two terms of the series of x1 and x1' are below rounding of the
/// motion's size, which the first four terms give (Jorba & Zou (2005), section 3.2); by iteration
/// from the longest step. The terms of x1' are n/h times those of x1: where x1'' changes fast, and
/// the step is short, they bound it.
fn reach(x: &Series<f64>, v: &Series<f64>, fastest: f64) -> f64 {
    let size =
        |c: &Series<f64>, s: f64| value(&[c[0].abs(), c[1].abs(), c[2].abs(), c[3].abs()], s);
    let mut step = CONTACT_ANGLE / fastest;
    for _ in 0..4 {
        let displacement = size(x, step);
        let speed = displacement * fastest + size(v, step);
        for (n, last, scale) in [
            (ORDER, x[ORDER], displacement),
            (ORDER - 1, x[ORDER - 1], displacement),
            (ORDER - 1, v[ORDER - 1], speed),
            (ORDER - 2, v[ORDER - 2], speed),
        ] {
            if last != 0.0 {
                step = step.min((EPS * scale / last.abs()).powf(1.0 / n as f64));
            }
        }
    }
    step
}

fn value<T: Number>(c: &[T], s: T) -> T {
    c.iter().rev().fold(T::constant(0.0), |sum, &c| sum * s + c)
}

/// Value and first three derivatives, over their factorials.
fn local(c: &[f64], s: f64) -> [f64; 4] {
    let mut d = [0.0; 4];
    for c in c.iter().rev() {
        for i in (1..4).rev() {
            d[i] = d[i] * s + d[i - 1];
        }
        d[0] = d[0] * s + c;
    }
    d
}

/// First time in (0, end] at which a series that begins below zero reaches it. Leading terms at
/// rounding level (`noise`, over the whole step) are zero by definition: there the series starts
/// on the root, which does not count.
fn first_crossing(c: &[f64], end: f64, noise: f64) -> Option<f64> {
    let skip = (0..c.len().min(4)).find(|&n| c[n].abs() * end.powi(n as i32) > noise)?;
    let c = &c[skip..];
    if c[0] >= 0.0 {
        return Some(0.0);
    }
    // Bound of the fourth derivative over 4!.
    let choose = |n: usize| (n * (n - 1) * (n - 2) * (n - 3)) as f64 / 24.0;
    let fourth: f64 = (4..c.len()).map(|n| choose(n) * c[n].abs() * end.powi(n as i32 - 4)).sum();
    let level = noise / end.powi(skip as i32);
    let mut s = 0.0;
    for _ in 0..200 {
        let [value, rate, second, third] = local(c, s);
        if value >= -level && rate > 0.0 {
            return Some(polish(c, s, end));
        }
        let step = first_root(&[value, rate, second, third, fourth], end - s);
        if step >= end - s {
            return None;
        }
        if s + step <= s + EPS * s {
            return Some(polish(c, s, end));
        }
        s += step;
    }
    Some(polish(c, s, end))
}

/// Newton's last steps onto the root.
fn polish(c: &[f64], mut s: f64, end: f64) -> f64 {
    for _ in 0..3 {
        let [value, rate, ..] = local(c, s);
        if rate > 0.0 {
            s = (s - value / rate).clamp(0.0, end);
        }
    }
    s
}

#[cfg(test)]
mod tests {
    use super::first_crossing;

    #[test]
    fn crossings_are_found_after_the_start_and_before_the_end() {
        // (t - 0.25)(t - 0.5)^2 ... rises through zero at 0.25.
        let c = [-0.0625, 0.5, -1.25, 1.0];
        assert!((first_crossing(&c, 1.0, 1e-16).unwrap() - 0.25).abs() < 1e-15);
        assert_eq!(first_crossing(&c, 0.2, 1e-16), None);
        // A double crossing between the ends: -(t - 0.5)^2 + 1e-6.
        let c = [-0.25 + 1e-6, 1.0, -1.0];
        assert!((first_crossing(&c, 1.0, 1e-16).unwrap() - 0.499).abs() < 1e-12);
        // Starts on the root and leaves it: -t (1 - t).
        let c = [1e-18, -1.0, 1.0];
        assert!((first_crossing(&c, 2.0, 1e-16).unwrap() - 1.0).abs() < 1e-15);
        // At once.
        assert_eq!(first_crossing(&[1e-18, 1.0], 1.0, 1e-16), Some(0.0));
        assert_eq!(first_crossing(&[0.0, 0.0], 1.0, 1e-16), None);
    }
}
