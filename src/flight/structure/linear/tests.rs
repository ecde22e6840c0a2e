//! Legs against the equations of motion in double-double, bounds and events against samples.

#[path = "../../../../tests/support/constrained.rs"]
#[allow(dead_code)]
mod constrained;

use constrained::{Constrained, Constraint, Point};
use double_double::Dd;
use nalgebra::Complex;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::draws::{Leg, chain, dots, draw};
use super::gap::{Ends, LinearGap};
use super::*;
use crate::model::Stop;
use crate::numerics::EPS;
use crate::search::coupled_oscillators::double_double;

impl Leg {
    fn truth(&self) -> (Constrained, Point) {
        let structure = &self.structure;
        let (re, im): (Vec<f64>, Vec<f64>) = self.drive.iter().map(|f| (f.re, f.im)).unzip();
        let mut constraints = Vec::new();
        for j in self.closed.stops() {
            let stop = &structure.stops()[j];
            let ahead = stop.phase() - structure.phase();
            let friction = match self.closed {
                Closed::Slide { direction, .. } => direction * stop.friction(),
                _ => 0.0,
            };
            let none = vec![0.0; self.q.len()];
            let tangent = stop.tangent().unwrap_or(&none);
            constraints.push(Constraint {
                row: stop.normal().to_vec(),
                direction: stop
                    .normal()
                    .iter()
                    .zip(tangent)
                    .map(|(&n, &t)| Dd::new(n) + Dd::new(friction) * Dd::new(t))
                    .collect(),
                amplitude: stop.amplitude(),
                ahead: [ahead.cos(), ahead.sin()],
            });
            if let Closed::Stick { .. } = self.closed {
                constraints.push(Constraint {
                    row: tangent.to_vec(),
                    direction: tangent.iter().map(|&t| Dd::new(t)).collect(),
                    amplitude: 0.0,
                    ahead: [1.0, 0.0],
                });
            }
        }
        let damping = structure.damping();
        let matrices = [structure.mass(), structure.stiffness(), &damping];
        let frequency = structure.drive_frequency();
        let exact = Constrained::new(matrices, &self.load, [&re, &im], frequency, constraints);
        let (sin, cos) = Dd::new(structure.phase()).sin_cos();
        let dd = |of: &[f64]| of.iter().map(|&x| Dd::new(x)).collect();
        (exact, Point { q: dd(&self.q), v: dd(&self.v), cos, sin })
    }

    fn motion(&self) -> Option<LinearMotion> {
        LinearMotion::new(&self.structure, self.closed.clone())
    }
}

/// q, v and forces at many times; the error in units of `EPS` times the sizes met so far.
#[test]
fn legs_obey_the_equations_of_motion() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut worst = [0.0f64; 4];
    for round in 0..48 {
        let kind = round % 4;
        let leg = draw(&mut rng, kind);
        let Some(motion) = leg.motion() else { continue };
        let (exact, mut point) = leg.truth();
        let flight = motion.flight(Clock::START, &leg.q, &leg.v);
        let (span, growth) = (motion.span(), motion.equation.growth);
        let (mut elapsed, mut sizes) = (Dd::ZERO, [0.0f64; 3]);
        for spans in [1e-6, 0.37, 1.0, 3.3, 9.0, 30.7] {
            if kind == 2 && growth * spans > 3.0 {
                // A slide may grow for ever, and rounding with it.
                break;
            }
            let until = Dd::new(spans * span);
            while (until - elapsed).hi > 0.0 {
                let step = (until - elapsed).hi.min(0.5 * span);
                point = exact.later(&point, Dd::new(step));
                elapsed = elapsed + Dd::new(step);
            }
            let elapsed = DoubleDouble { hi: elapsed.hi, lo: elapsed.lo };
            let (q, v) = motion.state_after(&flight, elapsed);
            let forces = motion.forces(&flight, elapsed);
            let exact_forces = exact.forces(&point);
            let largest = |of: &[Dd]| of.iter().fold(0.0, |most: f64, x| most.max(x.hi.abs()));
            for (size, of) in sizes.iter_mut().zip([&point.q, &point.v, &exact_forces]) {
                *size = size.max(largest(of));
            }
            let scale = 1.0 + sizes[0] + sizes[1] * (1.0 + spans * span) + sizes[2];
            for (told, exact) in q.iter().zip(&point.q).chain(v.iter().zip(&point.v)) {
                let error = (Dd::new(*told) - *exact).hi.abs() / (EPS * scale);
                worst[kind] = worst[kind].max(error);
            }
            for (force, exact) in forces.iter().zip(&exact_forces) {
                let error = (Dd::new(force.normal) - *exact).hi.abs() / (EPS * scale);
                worst[kind] = worst[kind].max(error);
            }
        }
    }
    println!("{worst:?}");
    assert!(worst.iter().all(|worst| *worst < 64.0), "{worst:?}");
}

/// Where no mode is coupled both paths are the same motion.
#[test]
fn a_leg_without_stops_is_the_motion_of_the_modes() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let mut worst = 0.0f64;
    for _ in 0..40 {
        let Leg { structure, q, v, drive, load, .. } = draw(&mut rng, 0);
        let [m, k] = [rng.random_range(0.0..0.1), rng.random_range(0.0..0.1)];
        let of = |i: usize, j: usize| m * structure.mass()[i][j] + k * structure.stiffness()[i][j];
        let count = q.len();
        let damping = (0..count).map(|i| (0..count).map(|j| of(i, j)).collect()).collect();
        let structure =
            Structure::builder(structure.mass().to_vec(), structure.stiffness().to_vec())
                .damping(damping)
                .static_load(load)
                .drive(drive, structure.drive_frequency(), structure.phase())
                .build()
                .unwrap();
        let modal = crate::flight::StructureMotion::new(&structure);
        let linear = LinearMotion::new(&structure, Closed::Frictionless(vec![])).unwrap();
        let (one, other) =
            (modal.flight(Clock::START, &q, &v), linear.flight(Clock::START, &q, &v));
        for spans in [1e-8, 0.1, 1.0, 7.9, 1e3, 1e6] {
            let time = spans * linear.span();
            let (q1, v1) = modal.state_after(&one, time, 0.0);
            let (q2, v2) = linear.state_after(&other, DoubleDouble::new(time));
            let largest = |of: &[f64]| of.iter().fold(1.0, |most: f64, x| most.max(x.abs()));
            // Where nothing holds a mode its rounding grows with time.
            let (place, rate) = (largest(&q1) + largest(&v) * time, largest(&v1));
            for (sizes, one, other) in [(place, &q1, &q2), (rate, &v1, &v2)] {
                for (one, other) in one.iter().zip(other) {
                    worst = worst.max((one - other).abs() / sizes);
                }
            }
        }
    }
    println!("{worst:e}");
    assert!(worst < 1e-14, "{worst:e}");
}

fn oscillator(square: f64, damping: f64, drive: f64, omega: f64) -> LinearMotion {
    let structure = Structure::builder(vec![vec![1.0]], vec![vec![square]])
        .damping(vec![vec![damping]])
        .static_load([0.25])
        .drive([Complex::new(drive, 0.0)], omega, 0.0)
        .build()
        .unwrap();
    LinearMotion::new(&structure, Closed::Frictionless(vec![])).unwrap()
}

/// Resonance, critical damping, a free body and one on a damper: closed forms, which eigenvectors
/// do not have.
#[test]
fn defective_motions_are_no_special_cases() {
    let close = |found: f64, wanted: f64, what: &str| {
        assert!((found - wanted).abs() < 2e-15 * (1.0 + wanted.abs()), "{what}: {found} {wanted}");
    };
    for time in [1e-6f64, 0.3, 2.0, 40.0, 1e4] {
        let after = |motion: &LinearMotion, x: f64, v: f64| {
            let flight = motion.flight(Clock::START, &[x], &[v]);
            let (q, v) = motion.state_after(&flight, DoubleDouble::new(time));
            (q[0], v[0])
        };
        // x'' + 4 x = 1/4 + cos 2t: x = 1/16 (1 - cos 2t) + t/4 sin 2t.
        let (x, v) = after(&oscillator(4.0, 0.0, 1.0, 2.0), 0.0, 0.0);
        let (sin, cos) = (2.0 * time).sin_cos();
        close(x, (1.0 - cos) / 16.0 + 0.25 * time * sin, "resonance");
        close(v, 0.125 * sin + 0.25 * sin + 0.5 * time * cos, "resonance, rate");
        // x'' + 2 x' + x = 1/4.
        let (x, v) = after(&oscillator(1.0, 2.0, 0.0, 0.0), 1.0, 0.0);
        close(x, 0.25 + 0.75 * (1.0 + time) * (-time).exp(), "critical");
        close(v, -0.75 * time * (-time).exp(), "critical, rate");
        // x'' = 1/4.
        let (x, v) = after(&oscillator(0.0, 0.0, 0.0, 0.0), 1.0, -0.5);
        close(x, 1.0 - 0.5 * time + 0.125 * time * time, "free");
        close(v, -0.5 + 0.25 * time, "free, rate");
        // x'' + 3 x' = 1/4: v = 1/12 + (v0 - 1/12) e^(-3t).
        let (x, v) = after(&oscillator(0.0, 3.0, 0.0, 0.0), 1.0, -0.5);
        let left = -0.5 - 1.0 / 12.0;
        close(x, 1.0 + time / 12.0 - left / 3.0 * (-3.0 * time).exp_m1(), "on a damper");
        close(v, 1.0 / 12.0 + left * (-3.0 * time).exp(), "on a damper, rate");
    }
}

/// Every derivative of every condition, at samples of several spans.
#[test]
fn derivatives_stay_within_their_bounds() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut nearest = [0.0f64; 6];
    for round in 0..200 {
        let leg = draw(&mut rng, round % 4);
        let Some(motion) = leg.motion() else { continue };
        let flight = motion.flight(Clock::START, &leg.q, &leg.v);
        let span = motion.span();
        for condition in &motion.conditions {
            let gap = LinearGap::new(&motion, &flight, condition);
            for spans in [1.0, motion.equation.holds] {
                let bounds = gap.derivative_bounds(spans * span);
                for i in 0..=64 {
                    let time = spans * span * f64::from(i) / 64.0;
                    for (k, (bound, found)) in bounds.iter().zip(gap.derivatives(time)).enumerate()
                    {
                        nearest[k] = nearest[k].max(found.abs() / bound);
                        assert!(found.abs() <= *bound, "{round} {k} {time} {found} {bound}");
                    }
                }
            }
        }
    }
    println!("{nearest:?}");
    // Bounds that are never near would cost steps.
    assert!(nearest.iter().all(|part| *part > 0.5), "{nearest:?}");
}

impl LinearGap<'_> {
    /// Derivatives 1 to 6 at a time within the first spans.
    fn derivatives(&self, time: f64) -> [f64; 6] {
        let span = self.motion.span();
        let segment = (1..8).take_while(|&i| time >= f64::from(i) * span).count();
        let d = super::gap::taylor::<7>(self.series(segment), time / span - segment as f64);
        let factorials = [1.0, 2.0, 6.0, 24.0, 120.0, 720.0];
        std::array::from_fn(|k| d[k + 1] * factorials[k] / span.powi(k as i32 + 1))
    }
}

/// The first event against values of all conditions at many times: none is missed, none invented.
#[test]
fn the_first_event_of_a_leg_is_found() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let mut counts = [0usize; 5];
    for round in 0..400 {
        let leg = draw(&mut rng, round % 4);
        let Some(motion) = leg.motion() else { continue };
        let flight = motion.flight(Clock::START, &leg.q, &leg.v);
        let gaps: Vec<_> =
            motion.conditions.iter().map(|c| LinearGap::new(&motion, &flight, c)).collect();
        let value = |gap: &LinearGap<'_>, time: f64| gap.value_at(time);
        let noise = |gap: &LinearGap<'_>| {
            let (_, size) = crate::search::gap::Gap::start(gap);
            64.0 * EPS * (size + gap.derivative_bounds(motion.span())[0] * motion.span())
        };
        let event = motion.next_event(&flight, &[]);
        let (time, ends) = match event {
            LegEvent::Met { stop, time, offset } => (time + offset, Some(Ends::Open(stop))),
            LegEvent::Released { stop, time, offset } => (time + offset, Some(Ends::Held(stop))),
            LegEvent::SlipEnds { time, offset } => (time + offset, Some(Ends::Slip)),
            LegEvent::SlipBegins { direction, time, offset } => {
                (time + offset, Some(Ends::Stick(direction)))
            }
            LegEvent::Clear(time) => (time, None),
            other => panic!("{round} {other:?}"),
        };
        counts[match ends {
            Some(Ends::Open(_)) => 0,
            Some(Ends::Held(_)) => 1,
            Some(Ends::Slip) => 2,
            Some(Ends::Stick(_)) => 3,
            None => 4,
        }] += 1;
        if time == 0.0 {
            // A force that pulls, or too much friction, from the start.
            let at = gaps.iter().find(|gap| Some(gap.condition.ends) == ends).unwrap();
            assert!(value(at, 0.0) > 0.0, "{round} {event:?}");
            continue;
        }
        // Before it every condition is below zero, and in it its own is zero.
        for i in 0..1000 {
            let before = time.min(8.0 * motion.span()) * f64::from(i) / 1000.0;
            for gap in &gaps {
                assert!(value(gap, before) < noise(gap), "{round} {event:?} {before}");
            }
        }
        if let Some(ends) = ends {
            let at = gaps.iter().find(|gap| gap.condition.ends == ends).unwrap();
            assert!(value(at, time).abs() < noise(at), "{round} {event:?} {}", value(at, time));
            assert!(value(at, time + 1e-6 * motion.span()) > 0.0, "{round} {event:?}");
        }
    }
    println!("{counts:?}");
    assert!(counts.iter().all(|count| *count > 10), "{counts:?}");
}

impl LinearGap<'_> {
    fn value_at(&self, time: f64) -> f64 {
        let span = self.motion.span();
        let segment = (1..8).take_while(|&i| time >= f64::from(i) * span).count();
        super::gap::taylor::<1>(self.series(segment), time / span - segment as f64)[0]
    }
}

/// Two stops with one normal: one carries the force, and no event ends the leg of the other.
#[test]
fn a_stop_too_many_carries_nothing() {
    let structure = Structure::builder(vec![vec![2.0]], vec![vec![1.0]])
        .static_load([3.0])
        .stop(Stop::new([1.0], 0.5, 0.8))
        .stop(Stop::new([2.0], 1.0, 0.8))
        .build()
        .unwrap();
    let both = LinearMotion::new(&structure, Closed::Frictionless(vec![1, 0])).unwrap();
    let flight = both.flight(Clock::START, &[0.5], &[0.0]);
    let forces = both.forces(&flight, DoubleDouble::new(0.3));
    assert!(forces.len() == 1 && forces[0].stop == 1, "{forces:?}");
    assert!((forces[0].normal - 1.25).abs() < 1e-15);
    assert!(matches!(both.next_event(&flight, &[]), LegEvent::Clear(_)));
    let one = LinearMotion::new(&structure, Closed::Frictionless(vec![0])).unwrap();
    let flight = one.flight(Clock::START, &[0.5], &[0.0]);
    assert!(matches!(one.next_event(&flight, &[]), LegEvent::Clear(_)));
    assert_eq!(one.state_after(&flight, DoubleDouble::new(1e5)), (vec![0.5], vec![0.0]));
}

/// a + mu s b <= 0 in one direction of slip.
#[test]
fn a_painleve_point_has_no_leg() {
    let structure = Structure::builder(vec![vec![1.0, 0.9], vec![0.9, 1.0]], chain(2))
        .stop(Stop::new([1.0, 0.0], 0.5, 0.8).with_friction(2.0, [0.0, 1.0]))
        .build()
        .unwrap();
    let slide = |direction| {
        LinearMotion::new(&structure, Closed::Slide { stop: 0, direction, beside: vec![] })
    };
    assert!(slide(1.0).is_none() && slide(-1.0).is_some());
}

/// Undamped, undriven, on stops at rest: no work is done, over any time.
#[test]
fn closed_stops_at_rest_do_no_work() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let mut worst = 0.0f64;
    for _ in 0..20 {
        let Leg { structure, q, v, .. } = draw(&mut rng, 1);
        let builder = Structure::builder(structure.mass().to_vec(), structure.stiffness().to_vec());
        let stop = structure.stops()[0].normal();
        let structure = builder.stop(Stop::new(stop, dots(stop, &q), 0.8)).build().unwrap();
        let motion = LinearMotion::new(&structure, Closed::Frictionless(vec![0])).unwrap();
        let energy = |q: &[f64], v: &[f64]| {
            let form = |matrix: &[Vec<f64>], x: &[f64]| -> f64 {
                matrix.iter().zip(x).map(|(row, a)| a * dots(row, x)).sum()
            };
            0.5 * (form(structure.mass(), v) + form(structure.stiffness(), q))
        };
        let flight = motion.flight(Clock::START, &q, &v);
        let (q, v) = motion.state_after(&flight, DoubleDouble::ZERO);
        let before = energy(&q, &v);
        for spans in [0.7, 20.0, 1e3, 1e5] {
            let (q, v) = motion.state_after(&flight, DoubleDouble::new(spans * motion.span()));
            // A free body goes far, and its place has the rounding of that.
            let size = q.iter().fold(1.0, |most: f64, q| most.max(q.abs())).powi(2);
            let allowed = 1e-14 * before + EPS * size;
            worst = worst.max((energy(&q, &v) - before).abs() / allowed);
        }
    }
    println!("{worst:e}");
    assert!(worst < 1.0, "{worst:e}");
}

/// A unit of time that is longer by a power of two changes no bit of a motion or of an event.
#[test]
fn legs_know_no_unit_of_time() {
    let mut rng = ChaCha8Rng::seed_from_u64(10);
    let scale = 2f64.powi(30);
    for _ in 0..40 {
        let Leg { structure, closed, q, v, drive, load } = draw(&mut rng, 1);
        let made = |unit: f64| {
            let times = |matrix: &[Vec<f64>], factor: f64| -> Vec<Vec<f64>> {
                matrix.iter().map(|row| row.iter().map(|x| x * factor).collect()).collect()
            };
            let square = unit * unit;
            let omega = unit * structure.drive_frequency();
            let builder =
                Structure::builder(structure.mass().to_vec(), times(structure.stiffness(), square))
                    .damping(times(&structure.damping(), unit))
                    .static_load(load.iter().map(|x| x * square).collect::<Vec<_>>())
                    .drive(
                        drive.iter().map(|x| x * square).collect::<Vec<_>>(),
                        omega,
                        structure.phase(),
                    );
            let stops = structure.stops().iter().cloned();
            stops.fold(builder, crate::model::StructureBuilder::stop).build().unwrap()
        };
        let told = |unit: f64| {
            let motion = LinearMotion::new(&made(unit), closed.clone()).unwrap();
            let v: Vec<f64> = v.iter().map(|v| v * unit).collect();
            let flight = motion.flight(Clock::START, &q, &v);
            let after = [0.7, 5.1, 1e4].map(|spans| {
                let (q, v) = motion.state_after(&flight, DoubleDouble::new(spans * motion.span()));
                (q, v.iter().map(|v| v / unit).collect::<Vec<_>>())
            });
            let time = match motion.next_event(&flight, &[]) {
                LegEvent::Met { time, .. }
                | LegEvent::Released { time, .. }
                | LegEvent::Clear(time) => time * unit,
                other => panic!("{other:?}"),
            };
            (motion.span() * unit, after, time)
        };
        assert_eq!(told(1.0), told(scale));
        assert_eq!(told(1.0), told(1.0 / scale));
    }
}

/// Masses, springs and dashpots that differ by many powers of ten: every search ends, and every
/// number is one.
#[test]
fn legs_of_ill_scaled_structures_end() {
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    let mut events = 0;
    for round in 0..60 {
        let mut scale = |range: f64| 10f64.powf(rng.random_range(-range..range));
        let (m, k, c) = ([scale(3.0), scale(3.0)], [scale(6.0), scale(6.0)], scale(6.0));
        let omega = scale(2.0);
        let structure = Structure::builder(
            vec![vec![m[0], 0.0], vec![0.0, m[1]]],
            vec![vec![k[0], 0.0], vec![0.0, k[1]]],
        )
        .damping(vec![vec![c, -c], vec![-c, c]])
        .drive([Complex::new(k[0], 0.0), Complex::new(0.0, k[1])], omega, 0.0)
        .stop(Stop::new([1.0, 0.0], 0.4, 0.8))
        .stop(Stop::new([1.0, -1.0], 0.3, 0.8))
        .build()
        .unwrap();
        let closed = [vec![], vec![1]][round % 2].clone();
        let motion = LinearMotion::new(&structure, Closed::Frictionless(closed)).unwrap();
        let (mut q, mut v) = (vec![0.0; 2], vec![0.0; 2]);
        if round % 2 == 1 {
            q = vec![0.3, 0.0];
        }
        let mut clock = Clock::START;
        for _ in 0..10 {
            let flight = motion.flight(clock, &q, &v);
            let time = match motion.next_event(&flight, &[]) {
                LegEvent::Clear(time) => time,
                LegEvent::Failed { stop } => panic!("{round} {stop} {structure:?}"),
                _ => {
                    events += 1;
                    break;
                }
            };
            let elapsed = DoubleDouble::new(time);
            (q, v) = motion.state_after(&flight, elapsed);
            clock = motion.clock_after(&flight, elapsed);
            assert!(q.iter().chain(&v).all(|x| x.abs() < 1e12), "{round} {q:?} {v:?}");
        }
    }
    assert!(events > 10, "{events}");
}
