//! Derivatives of one body's flight by the numbers of its equation in closed form, from its steady
//! response and its free oscillation.
//!
//! With z = e^(i psi) the response to f cos psi is Re(f G z), G = 1/(w^2 - omega^2 + 2 i zeta w omega).
//! Derivatives by f, psi and omega begin at rest: they are those of the response, without what the
//! free oscillation makes of them at the start. By a constant load c the response is c/w^2.
//!
//! The damping and the natural frequency change the free oscillation, too. With a = zeta w and
//! D = w^2 - a^2 it takes what differs from the response on by
//!
//! ```text
//! p + a q     q            p = e^(-a t) cos(sqrt(D) t)      dp = -t p da - t q dD/2
//! -w^2 q      p - a q      q = e^(-a t) sin(sqrt(D) t)/sqrt(D)
//!                          dq = -t q da + (t p - q) dD/(2 D).
//! ```
//!
//! Far from resonance and critical damping, and in flights that are not short, nothing cancels in that.

#![allow(clippy::inline_always)] // what calls it is compiled for several instruction sets

use super::{Coefficient, Each, Pair};
use crate::flight::Trig;
use crate::model::oblique::Body;
use crate::tangent::tolerances::{OFF_RESONANCE, SHORTEST_RESPONSE};

/// A complex number.
type Complex = [f64; 2];

/// The steady response of a body.
#[derive(Debug, Clone, Copy)]
pub(super) struct Response {
    body: Body<f64>,
    omega: f64,
    /// f G, G, and its derivatives by omega, w and zeta.
    ahead: Complex,
    unit: Complex,
    by_omega: Complex,
    by_natural: Complex,
    by_damping: Complex,
    /// 1/w^2, a, and a/D.
    flexibility: f64,
    decay: f64,
    per_distance: f64,
    shortest: f64,
    /// Whether nothing cancels in what the load turns into, what a constant one does, and the free
    /// oscillation.
    is_far: bool,
    is_stiff: bool,
    swings: bool,
}

/// A flight.
#[derive(Debug, Clone, Copy)]
pub(in crate::tangent) struct Flown {
    /// Phases of the drive at its ends.
    pub start: Trig,
    pub end: Trig,
    pub time: f64,
    /// What the free oscillation makes of displacement and rate.
    pub transition: [[f64; 2]; 2],
}

impl Response {
    pub fn new(body: &Body<f64>, omega: f64, fastest: f64) -> Self {
        let (stiffness, decay) = (body.natural * body.natural, 2.0 * body.damping * body.natural);
        let [re, im] = [stiffness - omega * omega, decay * omega];
        let size = re * re + im * im;
        let enough = OFF_RESONANCE * fastest * fastest;
        let is_far = size.sqrt() >= enough;
        let distance = stiffness - 0.25 * decay * decay;
        // Near resonance it is used only where nothing drives the body; times that it must be 0.
        let unit = if is_far { [re / size, -im / size] } else { [0.0; 2] };
        // dG = -G^2 d(1/G).
        let square = times(unit, unit);
        let by = |re: f64, im: f64| times(square, [-re, -im]);
        Self {
            body: *body,
            omega,
            ahead: multiplied(unit, 0.0, body.amplitude),
            unit,
            by_omega: by(-2.0 * omega, decay),
            by_natural: by(2.0 * body.natural, 2.0 * body.damping * omega),
            by_damping: by(0.0, 2.0 * body.natural * omega),
            flexibility: 1.0 / stiffness,
            decay: 0.5 * decay,
            per_distance: 0.5 * decay / distance,
            shortest: SHORTEST_RESPONSE / fastest,
            is_far,
            is_stiff: stiffness >= enough,
            swings: stiffness >= enough && distance.abs() >= enough,
        }
    }

    /// Whether derivatives by this coefficient follow from it.
    pub fn tells(&self, coefficient: Coefficient) -> bool {
        match coefficient {
            Coefficient::Natural | Coefficient::Damping => {
                self.swings && (self.body.amplitude == 0.0 || self.is_far)
            }
            Coefficient::Constant => self.is_stiff,
            Coefficient::Omega | Coefficient::Phase | Coefficient::Amplitude => self.is_far,
        }
    }

    /// Columns after a flight from displacement and rate, if it is not short.
    #[inline(always)]
    pub fn after(
        &self,
        (wanted, columns): (&[Coefficient], &mut Each<Pair>),
        start: (f64, f64),
        flown: &Flown,
    ) -> bool {
        let &Self { ref body, omega, unit, ahead, flexibility, .. } = self;
        let &Flown { time, transition: [[xx, _], [vx, _]], .. } = flown;
        if time < self.shortest {
            return false;
        }
        let turning = |response: Complex| [response, multiplied(response, omega, 0.0)];
        let by_constant = [(1.0 - xx) * flexibility, -vx * flexibility];
        for &coefficient in wanted {
            columns[coefficient as usize] = match coefficient {
                Coefficient::Amplitude => flown.at_rest_before(turning(unit), turning(unit)),
                Coefficient::Phase => {
                    let quarter = turning(multiplied(ahead, 1.0, 0.0));
                    flown.at_rest_before(quarter, quarter)
                }
                Coefficient::Omega => {
                    let from = multiplied(self.by_omega, 0.0, body.amplitude);
                    let to = sum(from, multiplied(ahead, time, 0.0));
                    let [[_, rate], [_, rate_there]] = [turning(from), turning(to)];
                    // i omega changes with omega.
                    let own = multiplied(ahead, 1.0, 0.0);
                    flown.at_rest_before([from, sum(rate, own)], [to, sum(rate_there, own)])
                }
                Coefficient::Constant => by_constant,
                Coefficient::Natural | Coefficient::Damping => {
                    let is_natural = coefficient == Coefficient::Natural;
                    let by = if is_natural { self.by_natural } else { self.by_damping };
                    let response = turning(multiplied(by, 0.0, body.amplitude));
                    let own = self.own(start, flown, is_natural);
                    let driven = flown.at_rest_before(response, response);
                    // d(c/w^2)
                    let loaded = if is_natural { -2.0 * body.constant / body.natural } else { 0.0 };
                    [0, 1].map(|i| own[i] + driven[i] + loaded * by_constant[i])
                }
            };
        }
        true
    }

    /// What the natural frequency or the damping changes in the free oscillation.
    #[inline(always)]
    fn own(&self, (x, v): (f64, f64), flown: &Flown, is_natural: bool) -> Pair {
        let &Self { ref body, omega, ahead, flexibility, decay, per_distance, .. } = self;
        let &Flown { start, time, transition: [[xx, q], [_, vv]], .. } = flown;
        let Body { natural, damping, constant, .. } = *body;
        let x = x - along(ahead, start) - constant * flexibility;
        let v = v - along(multiplied(ahead, omega, 0.0), start);
        let p = 0.5 * (xx + vv);
        let slower = time * p - q;
        let (decays, p, q_change, stiffens) = if is_natural {
            let turns = natural - decay * damping;
            let (p, q_change) =
                (-time * (damping * p + turns * q), slower / natural - time * damping * q);
            (damping, p, q_change, 2.0 * natural * q)
        } else {
            let (p, q_change) =
                (-natural * time * (p - decay * q), -natural * (time * q + per_distance * slower));
            (natural, p, q_change, 0.0)
        };
        let damped = decays * q + decay * q_change;
        let to_rate = -(stiffens + natural * natural * q_change);
        [(p + damped) * x + q_change * v, to_rate * x + (p - damped) * v]
    }
}

impl Flown {
    /// What has displacement and rate as these parts of the turning load at both ends, without what the free
    /// oscillation makes of them.
    #[inline(always)]
    fn at_rest_before(&self, [from, rate]: [Complex; 2], [to, rate_there]: [Complex; 2]) -> Pair {
        let [[xx, xv], [vx, vv]] = self.transition;
        let (x, v) = (along(from, self.start), along(rate, self.start));
        let (x_there, v_there) = (along(to, self.end), along(rate_there, self.end));
        [x_there - (xx * x + xv * v), v_there - (vx * x + vv * v)]
    }
}

/// A sum.
#[inline(always)]
fn sum([a, b]: Complex, [c, d]: Complex) -> Complex {
    [a + c, b + d]
}

/// A product.
fn times([a, b]: Complex, [c, d]: Complex) -> Complex {
    [a * c - b * d, a * d + b * c]
}

/// A number times `ahead` i + `along`.
#[inline(always)]
fn multiplied([re, im]: Complex, ahead: f64, along: f64) -> Complex {
    [along * re - ahead * im, along * im + ahead * re]
}

/// The real part, turned with the load.
#[inline(always)]
fn along([re, im]: Complex, phase: Trig) -> f64 {
    re * phase.cos - im * phase.sin
}

#[cfg(test)]
mod tests {
    use super::Flown;
    use crate::flight::Drive;
    use crate::model::oblique::Body;
    use crate::numerics::double_double::DoubleDouble;
    use crate::tangent::equation::coefficient::ALL;
    use crate::tangent::equation::{ByEquation, Coefficient, Each, Steps};
    use crate::{System, flight::FreeMotion};

    /// Whether the response tells of the flight of this number; it tells what the steps do.
    fn agrees(i: u32, (resonant, amplitude): (bool, f64), wanted: &[Coefficient]) -> bool {
        let part = |k: u32| f64::from((i * k + 13) % 101) / 101.0;
        let natural = 0.3 + 2.5 * part(17);
        let damping = if i.is_multiple_of(3) { 0.0 } else { 1.4 * part(29) };
        let omega = if resonant { natural } else { 0.2 + 3.0 * part(53) };
        let system = System::builder()
            .mass_ratio(0.6)
            .frequency_ratio(natural)
            .restitution(0.8)
            .gap(0.5)
            .drive_frequency(omega)
            .pendulum_damping(damping)
            .moment_amplitude(amplitude)
            .static_moment(0.4)
            .build()
            .unwrap();
        let body: Body<f64> = system.pendulum();
        let steps = Steps::new(&body, omega, wanted);
        if !steps.stepped.is_empty() {
            return false;
        }
        let (motion, drive) = (FreeMotion::new(&system), Drive::of(&system));
        let time = 9.0 * part(71);
        let start = drive.trig_at(drive.clock_at(40.0 * part(37)));
        let end = drive.turned_far(start, DoubleDouble::new(time)).phase;
        let [transition, _] = motion.transitions(DoubleDouble::new(time));
        let flown = Flown { start, end, time, transition };
        let mut columns = Each::default();
        if !steps.response.after((&steps.told, &mut columns), (0.3, -0.7), &flown) {
            return false;
        }
        let found = ByEquation(columns);
        let other = steps.after((0.3, -0.7), start, time).unwrap();
        for &coefficient in wanted {
            for (a, b) in found.of(coefficient).iter().zip(other.of(coefficient)) {
                assert!((a - b).abs() <= 1e-13 * (1.0 + time), "{i} {coefficient:?} {a} {b}");
            }
        }
        true
    }

    #[test]
    fn the_response_has_the_derivatives_of_the_steps() {
        let told = (0..400).filter(|&i| agrees(i, (false, 1.7), &ALL)).count();
        assert!(told > 100, "{told}");
    }

    #[test]
    fn at_resonance_a_body_without_a_drive_has_the_derivatives_of_the_steps() {
        let wanted = [Coefficient::Natural, Coefficient::Damping, Coefficient::Constant];
        let told = (0..400).filter(|&i| agrees(i, (true, 0.0), &wanted)).count();
        assert!(told > 100, "{told}");
    }
}
