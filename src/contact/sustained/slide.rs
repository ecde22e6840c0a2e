//! Sliding on the contact: one step of the one-dimensional equation of motion by its Taylor series,
//! and the first event in it.
//!
//! Equations of `contact/sustained.rs`; the coefficients follow by the recursions of automatic
//! differentiation (Jorba & Zou (2005), Exp. Math. 14, 99). Each order of the contact force is what
//! keeps g'' = 0, given all orders before it; g'' comes from the model ([`Sliding`]), which knows the
//! velocity along the normal and so needs no products for its rate. The series is the dense
//! output too: on it the events are found by the majorant search of the contact detection, which
//! cannot step over a root. The side of h = 0 and the direction of slip are constants of a step, so
//! that |h| and sgn w have no kink in it. docs/contact-phase.md measures all this against a general
//! integrator.

use super::{ContactInstant, ContactMode};
use crate::contact::tolerances::{CONTACT_ANGLE, LEAST_STEP};
use crate::model::contact_coordinates::ContactCoordinates;
use crate::model::tolerances::REACH_LEVEL;
use crate::numerics::EPS;
use crate::numerics::dual::Number;
use crate::numerics::majorant::first_root;
use crate::numerics::reciprocals::reciprocals;

/// Order of the series of the displacement along the contact.
pub(crate) const ORDER: usize = 24;
/// Order of the series of the force, two derivatives less.
const FORCED: usize = ORDER - 2;

/// 1/n.
pub(crate) const INVERSE: [f64; ORDER + 1] = reciprocals();

pub(crate) type Series<T> = [T; ORDER + 1];

/// Coefficient n of a product.
pub(crate) fn product<T: Number>(a: &Series<T>, b: &Series<T>, n: usize) -> T {
    (0..=n).fold(T::constant(0.0), |sum, j| sum + a[j] * b[n - j])
}

fn values<T: Number>(series: &Series<T>) -> Series<f64> {
    series.map(Number::value)
}

/// Bodies that slide along one another on g = 0, in a unit of time of their own. Asked for the orders
/// n = 0, 1, ... in turn.
pub(crate) trait Sliding<T: Number> {
    /// Coefficients n of b/h and of h.
    fn directions(&self, n: usize) -> [T; 2];
    /// Coefficients n along a slide whose displacement x and velocity w are known up to n, and zero beyond
    /// (x up to n + 1): of w' without a
    /// contact force, and of g'' without its part of w'(n) and of the contact force.
    fn accelerations(&mut self, n: usize, x: &Series<T>, w: &Series<T>) -> [T; 2];
    /// Coefficient n of g'' without any contact force, along this slide. Near the end of a tip's reach,
    /// where the force grows beyond bound, this has the digits that a product with it would lose.
    fn free_gap_acceleration(&self, n: usize, w: &Series<T>) -> T;
}

/// The series of a step, in time over `unit`, in which the motion is of order one: in plain time
/// the coefficients of a tip driven to the end of its reach overflow.
#[derive(Debug, Clone)]
pub(crate) struct SlideSeries<T: Number> {
    x: Series<T>,
    w: Series<T>,
    /// h.
    scale: Series<T>,
    /// A power of two, so that no digit is lost.
    unit: f64,
}

/// The unit of time of a step, and its side: sgn h, 0 where friction plays no part.
#[derive(Debug, Clone, Copy)]
struct Frame {
    unit: f64,
    side: f64,
}

/// One step of a slide.
#[derive(Debug, Clone)]
pub(crate) struct SlideStep {
    series: SlideSeries<f64>,
    /// p (m + k b/h): the free g''.
    free: Series<f64>,
    /// m + k b/h.
    inertia: Series<f64>,
    /// Length of the step, in `unit`.
    reach: f64,
    mode: ContactMode,
    side: f64,
    /// Rounding of `free`, of w' and of h.
    noise: f64,
    acceleration_noise: f64,
    scale_noise: f64,
    least_inertia: f64,
}

/// What ends a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SlideEnd {
    /// The series is used up.
    Continues,
    /// p falls through 0.
    Released,
    /// w reaches 0 (with friction only).
    Stopped,
    /// h = 0: the friction's side changes.
    Side,
    /// m + k b/h reaches 0.
    Painleve,
}

impl SlideEnd {
    /// Whether the slide goes on with another step.
    pub fn goes_on(self) -> bool {
        matches!(self, Self::Continues | Self::Side)
    }
}

impl Frame {
    fn of(now: &ContactInstant, mode: ContactMode) -> Self {
        let (at, fastest) = (&now.contact.at, now.fastest);
        let unit = (-(fastest + now.turning).log2().ceil()).exp2();
        let side = if at.friction == 0.0 {
            0.0
        } else if at.scale.abs() <= now.scale_noise {
            // On h = 0: the side the tip slides to. Its velocity may be against the mode by
            // rounding.
            let velocity = if at.slip == 0.0 { mode.direction() } else { at.slip };
            1f64.copysign(velocity * now.scale_slope)
        } else {
            1f64.copysign(at.scale)
        };
        Self { unit, side }
    }
}

impl<T: Number> SlideSeries<T> {
    /// The slide of `bodies` from x and w on: w' = alpha - k p; `slip`: s sgn h, in k = b/h + mu s
    /// |h|. With b/h and k.
    fn new(
        bodies: &mut impl Sliding<T>,
        at: &ContactCoordinates<T>,
        slip: f64,
        unit: f64,
        start: T,
    ) -> (Self, [Series<T>; 2]) {
        let friction = at.friction * slip;
        let zero = [T::constant(0.0); ORDER + 1];
        let (mut x, mut w, mut scale) = (zero, zero, zero);
        let (mut force, mut coupling, mut k) = (zero, zero, zero);
        (x[0], x[1], w[0]) = (start, at.slip * unit, at.slip * unit);
        let mut per_inertia = T::constant(f64::NAN);
        for n in 0..=FORCED {
            let [along, across] = bodies.directions(n);
            let [slip_acceleration, others] = bodies.accelerations(n, &x, &w);
            (coupling[n], scale[n], k[n]) = (along, across, along + friction * across);
            if n == 0 {
                per_inertia = T::constant(1.0) / (at.mobility + k[0] * coupling[0]);
            }
            // w' = known - k(0) p and g'' = others + b/h w' - m p = 0. Without the difference in w': near
            // k = 0 the force has a pole that k p has not.
            let known = slip_acceleration - product(&k, &force, n);
            force[n] = (others + coupling[0] * known) * per_inertia;
            let rate = (at.mobility * known - k[0] * others) * per_inertia * INVERSE[n + 1];
            w[n + 1] = rate;
            x[n + 2] = rate * INVERSE[n + 2];
        }
        (Self { x, w, scale, unit }, [coupling, k])
    }

    /// As [`SlideStep::new`] for numbers that carry derivatives, on one side of h = 0: the series, and up
    /// to which local time. Contact and displacement at the start must have the values of `now`.
    pub fn with_derivatives<S: Sliding<T>>(
        now: &ContactInstant,
        mode: ContactMode,
        (at, start): (&ContactCoordinates<T>, T),
        bodies: impl Fn(f64) -> S,
    ) -> (Self, f64) {
        let Frame { unit, side } = Frame::of(now, mode);
        let slip = mode.direction() * side;
        let (series, _) = Self::new(&mut bodies(unit), at, slip, unit, start);
        let reach = reach(&values(&series.x), &values(&series.w), now.fastest * unit);
        let faint = at.friction.value() == 0.0 && !at.friction.is_constant();
        if !faint {
            let length = until_side(&values(&series.scale), side, (reach, now.scale_noise));
            return (series, length * unit);
        }
        // There is no friction, but it varies. It would act against the slip, whichever way that goes
        // here, and reverse with it: where it does, no rate jumps.
        let speed_noise = now.slip_noise * unit * unit * reach;
        let (scale, w) = (values(&series.scale), values(&series.w));
        let parts = [(&scale, now.scale_noise), (&w, speed_noise)];
        let [side, direction] = parts.map(|(series, noise)| leading_sign(series, reach, noise));
        let (series, _) = Self::new(&mut bodies(unit), at, direction * side, unit, start);
        let length = until_side(&scale, side, (reach, now.scale_noise));
        let length = until_side(&w, direction, (length, speed_noise));
        (series, length * unit)
    }

    /// x and w at local time s.
    pub fn at(&self, s: T) -> (T, T) {
        let per_unit = 1.0 / self.unit;
        let s = s * per_unit;
        let value = |c: &Series<T>| c.iter().rev().fold(T::constant(0.0), |sum, &c| sum * s + c);
        (value(&self.x), value(&self.w) * per_unit)
    }

    /// The rates of x and w at local time s.
    pub fn rates(&self, s: f64) -> [f64; 2] {
        let s = s / self.unit;
        let rate = |series: &Series<T>| {
            let terms = (1..=ORDER).rev();
            terms.fold(0.0, |sum, n| sum * s + n as f64 * series[n].value())
        };
        [rate(&self.x) / self.unit, rate(&self.w) / (self.unit * self.unit)]
    }
}

impl SlideStep {
    /// From the displacement `start`; `bodies`: in a unit of time.
    pub fn new<S: Sliding<f64>>(
        now: &ContactInstant,
        mode: ContactMode,
        start: f64,
        bodies: impl FnOnce(f64) -> S,
    ) -> Self {
        let (at, fastest) = (&now.contact.at, now.fastest);
        let Frame { unit, side } = Frame::of(now, mode);
        let slip = mode.direction() * side;
        let mut bodies = bodies(unit);
        let (series, [coupling, k]) = SlideSeries::new(&mut bodies, at, slip, unit, start);
        let (mut inertia, mut free) = ([0.0; ORDER + 1], [0.0; ORDER + 1]);
        for n in 0..=FORCED {
            inertia[n] = product(&k, &coupling, n);
            free[n] = bodies.free_gap_acceleration(n, &series.w);
        }
        inertia[0] += at.mobility;
        let square_unit = unit * unit;
        let instant_noise = now.clock_noise / unit;
        let gap_noise = now.gap_noise * square_unit;
        Self {
            reach: reach(&series.x, &series.w, fastest * unit),
            mode,
            side,
            noise: gap_noise + instant_noise * free[1].abs(),
            acceleration_noise: now.slip_noise * square_unit
                + (k[0] / inertia[0]).abs() * gap_noise
                + instant_noise * 2.0 * series.w[2].abs(),
            scale_noise: now.scale_noise,
            least_inertia: at.painleve_level(),
            series,
            free,
            inertia,
        }
    }

    /// The free gap acceleration p (m + k b/h) at local time s.
    pub fn free_acceleration(&self, s: f64) -> f64 {
        let unit = self.series.unit;
        value(&self.free[..=FORCED], s / unit) / (unit * unit)
    }

    /// Whether its series is made of numbers: of a tip that turns or is pressed beyond counting it
    /// is not.
    pub fn is_finite(&self) -> bool {
        self.series.x.iter().chain(&self.series.w).all(|c| c.is_finite())
    }

    /// Whether m + k b/h is so small, or negative, that x may not resolve what happens: beside a
    /// tip at the end of its reach the other body is a wall.
    pub fn is_at_reach(&self) -> bool {
        self.inertia[0] <= REACH_LEVEL
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

    /// x and w at local time s.
    pub fn at(&self, s: f64) -> (f64, f64) {
        self.series.at(s)
    }

    /// Whether a contact force of 0 at the start falls.
    pub fn falls(&self) -> bool {
        (1..=FORCED)
            .find(|&n| self.free[n].abs() * self.reach.powi(n as i32) > self.noise)
            .is_some_and(|n| self.free[n] < 0.0)
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
        consider(&self.free, FORCED, -1.0, self.noise, SlideEnd::Released);
        if self.side != 0.0 {
            let direction = self.mode.direction();
            let noise = self.acceleration_noise * self.reach;
            consider(&self.series.w, ORDER - 1, -direction, noise, SlideEnd::Stopped);
            consider(&self.series.scale, FORCED, -self.side, self.scale_noise, SlideEnd::Side);
        }
        let mut margin = self.inertia;
        margin[0] -= self.least_inertia;
        consider(&margin, FORCED, -1.0, 0.0, SlideEnd::Painleve);
        (first.0 * self.series.unit, first.1)
    }
}

/// Step length at which the last two terms of the series of x and w are below rounding of the
/// motion's size, which the first four terms give (Jorba & Zou (2005), section 3.2); by iteration
/// from the longest step. The terms of w are n/h times those of x: where w' changes fast, and the
/// step is short, they bound it.
fn reach(x: &Series<f64>, w: &Series<f64>, fastest: f64) -> f64 {
    let size =
        |c: &Series<f64>, s: f64| value(&[c[0].abs(), c[1].abs(), c[2].abs(), c[3].abs()], s);
    let mut step = CONTACT_ANGLE / fastest;
    for _ in 0..4 {
        let displacement = size(x, step);
        let speed = displacement * fastest + size(w, step);
        for (n, last, scale) in [
            (ORDER, x[ORDER], displacement),
            (ORDER - 1, x[ORDER - 1], displacement),
            (ORDER - 1, w[ORDER - 1], speed),
            (ORDER - 2, w[ORDER - 2], speed),
        ] {
            let (last, least) = (last.abs(), EPS * scale);
            if last * step.powi(n as i32) > least {
                step = (least / last).powf(INVERSE[n]).min(step);
            }
        }
    }
    step
}

/// The part of a step of this reach in which a series, known to this rounding, keeps its sign.
fn until_side(series: &Series<f64>, sign: f64, (reach, noise): (f64, f64)) -> f64 {
    if sign == 0.0 {
        return reach;
    }
    let towards = series.map(|c| -sign * c);
    first_crossing(&towards[..=FORCED], reach, noise).unwrap_or(reach)
}

/// The sign of a series just after its start, as its first term that is more than rounding has it; 0 where
/// none is.
fn leading_sign(series: &Series<f64>, reach: f64, noise: f64) -> f64 {
    let counts = |n: &usize| series[*n].abs() * reach.powi(*n as i32) > noise;
    (0..=FORCED).find(counts).map_or(0.0, |n| 1f64.copysign(series[n]))
}

fn value(c: &[f64], s: f64) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| sum * s + c)
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
