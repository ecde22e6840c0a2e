//! What a short flight of one body changes, by its series alone: the change itself, not the difference
//! of two states.

#![allow(clippy::inline_always)] // what calls it is compiled for several instruction sets

use super::rows::sum;
use super::{Coefficient, Pair, Steps, Terms};
use crate::flight::Trig;
use crate::model::oblique::Body;

/// Changes over a short flight.
#[derive(Debug, Clone, Copy)]
pub(in crate::tangent) struct Hop {
    /// Of the transition: displacement and rate by those at the start.
    pub transition: [[f64; 2]; 2],
    /// Of the displacement.
    pub displacement: f64,
    /// Of displacement and rate by the phase of the drive at the start.
    pub by_phase: Pair,
}

/// The short flights of a body.
#[derive(Debug)]
pub(in crate::tangent) struct Hops(Steps);

impl Hops {
    /// Of a body driven at `omega`.
    pub fn new(body: &Body<f64>, omega: f64) -> Self {
        let loads =
            [(body.amplitude, Coefficient::Amplitude), (body.constant, Coefficient::Constant)];
        let wanted: Vec<Coefficient> =
            loads.iter().filter_map(|&(load, by)| (load != 0.0).then_some(by)).collect();
        Self(Steps::new(body, omega, &wanted))
    }

    /// A flight from displacement and rate at this phase of the drive, which turns nothing by more than an
    /// eighth.
    #[inline(always)]
    pub fn after(&self, (x, v): (f64, f64), start: Trig, time: f64) -> Hop {
        let Steps { body, length, .. } = &self.0;
        let (series, time) = (self.0.known_series(), time / length);
        let [xx, vx, xv, vv] = sum(&series.growth, time);
        let (mut displacement, mut by_phase) = (xx * x + xv * v, [0.0; 2]);
        for (wanted, terms) in &series.added {
            let Terms::Narrow(_, terms) = terms else { continue };
            let [x_first, v_first, x_second, v_second] = sum(terms, time);
            if *wanted == Coefficient::Constant {
                displacement += body.constant * x_first;
                continue;
            }
            // From a load cos psi, by cos psi and sin psi at the start.
            let Trig { cos, sin } = start;
            displacement += body.amplitude * (x_first * cos + x_second * sin);
            by_phase = [
                body.amplitude * (x_second * cos - x_first * sin),
                body.amplitude * (v_second * cos - v_first * sin),
            ];
        }
        Hop { transition: [[xx, xv], [vx, vv]], displacement, by_phase }
    }
}

#[cfg(test)]
mod tests {
    use super::Hops;
    use crate::System;
    use crate::flight::{Drive, FreeMotion};
    use crate::numerics::double_double::DoubleDouble;
    use crate::tangent::equation::by_phase;

    #[test]
    fn a_hop_changes_what_the_flight_does() {
        for i in 0..300 {
            let part = |k: u32| f64::from((i * k + 13) % 101) / 101.0;
            let natural = 0.3 + 2.5 * part(17);
            let system = System::builder()
                .mass_ratio(0.6)
                .frequency_ratio(natural)
                .restitution(0.8)
                .gap(0.5)
                .drive_frequency(0.2 + 3.0 * part(53))
                .pendulum_damping(if i % 3 == 0 { 0.0 } else { 1.4 * part(29) })
                .moment_amplitude(if i % 5 == 0 { 0.0 } else { 1.7 })
                .static_moment(if i % 7 == 0 { 0.4 } else { 0.0 })
                .build()
                .unwrap();
            let body = system.pendulum();
            let (motion, drive) = (FreeMotion::new(&system), Drive::of(&system));
            // Down to hops of which a difference of states would have no digit.
            let fastest = system.drive_frequency.max(body.fastest_rate());
            let time = 0.1 / fastest * (-0.1 * f64::from(i)).exp();
            let clock = drive.clock_at(40.0 * part(37));
            let start = drive.trig_at(clock);
            let hop = Hops::new(&body, system.drive_frequency).after((0.3, -0.7), start, time);

            let near = |a: f64, b: f64| assert!((a - b).abs() <= 4e-15 * b.abs(), "{i} {a} {b}");
            let pendulum = &motion.pendulum;
            let flight = pendulum.flight(0.3, -0.7, start);
            let flown = pendulum.at(&flight, time, &drive.turned(start, time));
            near(hop.displacement, flown.increment);
            let [[[xx, xv], [vx, vv]], _] = motion.transitions(DoubleDouble::new(time));
            let [[a, b], [c, d]] = hop.transition;
            near(1.0 + a, xx);
            near(b, xv);
            near(c, vx);
            near(1.0 + d, vv);
            // To leading order: x'' = -w^2 x - 2 zeta w v after no time.
            let (square, decay) = (natural * natural, 2.0 * body.damping * natural);
            let size = time * fastest;
            assert!((a + 0.5 * square * time * time).abs() <= size * square * time * time, "{i}");
            assert!((d + decay * time).abs() <= size * fastest * time, "{i}");
            for (a, b) in
                hop.by_phase.iter().zip(by_phase(pendulum, &drive, start, DoubleDouble::new(time)))
            {
                let scale = 1.7 * time * time.min(1.0);
                assert!((a - b).abs() <= 1e-14 * (b.abs() + scale), "{i} {a} {b}");
            }
        }
    }
}
