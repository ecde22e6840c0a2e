//! Derivatives of one body's flight by what drives it, from its steady response.
//!
//! With z = e^(i psi) the response to f cos psi is Re(f G z), G = 1/(w^2 - omega^2 + 2 i zeta w omega).
//! Derivatives by f, psi and omega begin at rest: they are those of the response, without what the
//! free oscillation makes of them at the start. By a constant load c the response is c/w^2.
//!
//! Far from resonance, and in flights that are not short, nothing cancels in that.

#![allow(clippy::inline_always)] // what calls it is compiled for several instruction sets

use super::{ByEquation, COEFFICIENTS, Coefficient, Pair};
use crate::flight::Trig;
use crate::model::oblique::Body;
use crate::tangent::tolerances::{OFF_RESONANCE, SHORTEST_RESPONSE};

/// A complex number.
type Complex = [f64; 2];

/// The steady response of a body.
#[derive(Debug, Clone, Copy)]
pub(super) struct Response {
    amplitude: f64,
    omega: f64,
    /// G, and its derivative by omega.
    unit: Complex,
    by_omega: Complex,
    /// 1/w^2.
    flexibility: f64,
    shortest: f64,
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
    /// That by which these coefficients, and no others, are differentiated by, if it tells that well.
    pub fn new(body: &Body<f64>, omega: f64, fastest: f64, wanted: &[Coefficient]) -> Option<Self> {
        let (stiffness, decay) = (body.natural * body.natural, 2.0 * body.damping * body.natural);
        let [re, im] = [stiffness - omega * omega, decay * omega];
        let size = re * re + im * im;
        let enough = OFF_RESONANCE * fastest * fastest;
        let tells = |coefficient: &Coefficient| match coefficient {
            Coefficient::Natural | Coefficient::Damping => false,
            Coefficient::Constant => stiffness >= enough,
            Coefficient::Omega | Coefficient::Phase | Coefficient::Amplitude => {
                size.sqrt() >= enough
            }
        };
        let unit = [re / size, -im / size];
        // G' = -G^2 (2 i zeta w - 2 omega).
        let by_omega = times(times(unit, unit), [2.0 * omega, -decay]);
        wanted.iter().all(tells).then(|| Self {
            amplitude: body.amplitude,
            omega,
            unit,
            by_omega,
            flexibility: 1.0 / stiffness,
            shortest: SHORTEST_RESPONSE / fastest,
        })
    }

    /// Derivatives after a flight; `None` after a short one.
    #[inline(always)]
    pub fn after(&self, wanted: &[Coefficient], flown: &Flown) -> Option<ByEquation> {
        let &Self { amplitude, omega, unit, by_omega, flexibility, shortest } = self;
        let &Flown { time, transition: [[xx, _], [vx, _]], .. } = flown;
        if time < shortest {
            return None;
        }
        let mut columns = [[0.0; 2]; COEFFICIENTS];
        let ahead = multiplied(unit, amplitude, 0.0);
        for &coefficient in wanted {
            columns[coefficient as usize] = match coefficient {
                Coefficient::Amplitude => {
                    let both = [unit, multiplied(unit, omega, 0.0)];
                    flown.at_rest_before(both, both)
                }
                Coefficient::Phase => {
                    let both = [ahead, multiplied(ahead, omega, 0.0)];
                    flown.at_rest_before(both, both)
                }
                Coefficient::Omega => {
                    let from = multiplied(by_omega, 0.0, amplitude);
                    let to = sum(from, multiplied(ahead, 0.0, time));
                    let [rate, rate_there] = [
                        sum(ahead, multiplied(from, omega, 0.0)),
                        sum(ahead, multiplied(to, omega, 0.0)),
                    ];
                    flown.at_rest_before([from, rate], [to, rate_there])
                }
                Coefficient::Constant => [(1.0 - xx) * flexibility, -vx * flexibility],
                Coefficient::Natural | Coefficient::Damping => return None,
            };
        }
        Some(ByEquation(columns))
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
    use super::{Flown, Response};
    use crate::flight::Drive;
    use crate::model::oblique::Body;
    use crate::numerics::double_double::DoubleDouble;
    use crate::tangent::equation::{Coefficient, Steps};
    use crate::{System, flight::FreeMotion};

    #[test]
    fn the_response_has_the_derivatives_of_the_steps() {
        let wanted =
            [Coefficient::Phase, Coefficient::Omega, Coefficient::Amplitude, Coefficient::Constant];
        let mut told = 0;
        for i in 0..400 {
            let part = |k: u32| f64::from((i * k + 13) % 101) / 101.0;
            let natural = 0.3 + 2.5 * part(17);
            let damping = if i % 3 == 0 { 0.0 } else { 1.4 * part(29) };
            let omega = 0.2 + 3.0 * part(53);
            let system = System::builder()
                .mass_ratio(0.6)
                .frequency_ratio(natural)
                .restitution(0.8)
                .gap(0.5)
                .drive_frequency(omega)
                .pendulum_damping(damping)
                .moment_amplitude(1.7)
                .static_moment(0.4)
                .build()
                .unwrap();
            let body: Body<f64> = system.pendulum();
            let steps = Steps::new(&body, omega, &wanted);
            let Some(response) = Response::new(&body, omega, steps.fastest, &steps.wanted) else {
                continue;
            };
            let (motion, drive) = (FreeMotion::new(&system), Drive::of(&system));
            let time = 9.0 * part(71);
            let start = drive.trig_at(drive.clock_at(40.0 * part(37)));
            let end = drive.turned_far(start, DoubleDouble::new(time)).phase;
            let [transition, _] = motion.transitions(time);
            let flown = Flown { start, end, time, transition };
            let Some(found) = response.after(&steps.wanted, &flown) else { continue };
            told += 1;
            let other = steps.after((0.3, -0.7), start, time).unwrap();
            for coefficient in wanted {
                for (a, b) in found.of(coefficient).iter().zip(other.of(coefficient)) {
                    assert!((a - b).abs() <= 1e-13 * (1.0 + time), "{i} {coefficient:?} {a} {b}");
                }
            }
        }
        assert!(told > 100, "{told}");
    }
}
