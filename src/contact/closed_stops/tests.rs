//! Landings against the enumeration of all sets of closed stops, and against what follows from
//! them.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::flight::structure::LegEvent;
use crate::flight::structure::draws::draw;
use crate::model::Stop;
use crate::numerics::double_double::DoubleDouble;

fn random(rng: &mut ChaCha8Rng, count: usize) -> Vec<f64> {
    (0..count).map(|_| rng.random_range(-1.0..1.0)).collect()
}

/// A structure at rest at q = 0 under a load, touching all of its stops, with its normals as
/// columns.
fn at_rest(load: Vec<f64>, normals: &[Vec<f64>]) -> Structure {
    let count = load.len();
    let unit = |i: usize, j: usize| f64::from(u8::from(i == j));
    let mass = (0..count).map(|i| (0..count).map(|j| (1.0 + i as f64) * unit(i, j)).collect());
    let zeros = vec![vec![0.0; count]; count];
    let builder = Structure::builder(mass.collect(), zeros).static_load(load);
    normals
        .iter()
        .fold(builder, |builder, normal| builder.stop(Stop::new(normal.clone(), 0.0, 0.5)))
        .build()
        .unwrap()
}

fn stay(landing: &Landing) -> Vec<usize> {
    match landing {
        Landing::Hold { closed, .. } => {
            let mut stops = closed.stops();
            stops.sort_unstable();
            stops
        }
        Landing::Separate { .. } => vec![],
        other => panic!("{other:?}"),
    }
}

/// All sets of closed stops, and those whose forces and gaps have the right signs.
fn enumerated(load: &[f64], normals: &[Vec<f64>]) -> Vec<Vec<usize>> {
    let count = normals.len();
    let mobility = |i: usize| 1.0 / (1.0 + i as f64);
    let by =
        |a: &[f64], b: &[f64]| -> f64 { (0..a.len()).map(|i| a[i] * b[i] * mobility(i)).sum() };
    let gram = DMatrix::from_fn(count, count, |i, j| by(&normals[i], &normals[j]));
    let free = DVector::from_fn(count, |i, _| by(&normals[i], load));
    (0..1usize << count)
        .map(|set| (0..count).filter(|i| set >> i & 1 == 1).collect::<Vec<_>>())
        .filter(|set| {
            let held = DMatrix::from_fn(set.len(), set.len(), |i, j| gram[(set[i], set[j])]);
            let right = DVector::from_fn(set.len(), |i, _| free[set[i]]);
            let forces = if set.is_empty() { Some(right) } else { held.lu().solve(&right) };
            let Some(forces) = forces else { return false };
            let left = |j: usize| {
                let pushed: f64 = set.iter().zip(&forces).map(|(&i, p)| gram[(j, i)] * p).sum();
                free[j] - pushed
            };
            let opens = (0..count).filter(|j| !set.contains(j)).all(|j| left(j) < 0.0);
            forces.iter().all(|p| *p > 0.0) && opens
        })
        .collect()
}

#[test]
fn the_stops_that_stay_closed_are_those_of_the_enumeration() {
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    let mut sizes = [0; 5];
    for round in 0..2000 {
        let count = rng.random_range(1..=6usize);
        let stops = rng.random_range(1..=count.min(4));
        let normals: Vec<_> = (0..stops).map(|_| random(&mut rng, count)).collect();
        let load = random(&mut rng, count);
        let structure = at_rest(load.clone(), &normals);
        let candidates: Vec<usize> = (0..stops).collect();
        let (q, v) = (vec![0.0; count], vec![0.0; count]);
        let landing = land(&structure, Clock::START, (&q, &v), &candidates, None);
        let fitting = enumerated(&load, &normals);
        assert_eq!(fitting.len(), 1, "{round}");
        assert_eq!(stay(&landing), fitting[0], "{round}");
        sizes[fitting[0].len()] += 1;
    }
    assert!(sizes.iter().all(|count| *count > 5), "{sizes:?}");
}

/// More normals than coordinates: forces are not unique, but the motion is. What holds it is
/// pressed by forces that do not pull.
#[test]
fn of_stops_too_many_those_that_press_come_first() {
    let mut rng = ChaCha8Rng::seed_from_u64(22);
    let mut held = 0;
    for round in 0..500 {
        let count = rng.random_range(1..=3usize);
        let stops = rng.random_range(count + 1..=5);
        let mut normals: Vec<_> = (0..count).map(|_| random(&mut rng, count)).collect();
        while normals.len() < stops {
            // Supports between others, to rounding.
            let parts = random(&mut rng, normals.len());
            let sum = |k: usize| {
                parts.iter().zip(&normals).map(|(part, n)| part.abs() * n[k]).sum::<f64>()
            };
            normals.push((0..count).map(sum).collect());
        }
        let load = random(&mut rng, count);
        let structure = at_rest(load.clone(), &normals);
        let candidates: Vec<usize> = (0..stops).collect();
        let (q, v) = (vec![0.0; count], vec![0.0; count]);
        let landing = land(&structure, Clock::START, (&q, &v), &candidates, None);
        let Landing::Hold { closed, .. } = &landing else { continue };
        held += 1;
        let motion = LinearMotion::new(&structure, closed.clone()).unwrap();
        let flight = motion.flight(Clock::START, &q, &v);
        let forces = motion.forces(&flight, DoubleDouble::ZERO);
        assert!(forces.iter().all(|force| force.normal > -1e-14), "{round} {forces:?}");
        let (after, _) = motion.state_after(&flight, DoubleDouble::new(1e-3));
        for normal in &normals {
            let gap: f64 = normal.iter().zip(&after).map(|(n, q)| n * q).sum();
            assert!(gap < 1e-18, "{round} {gap:e}");
        }
    }
    assert!(held > 200, "{held}");
}

/// g'' = 0: the next derivative that is not zero decides.
#[test]
fn higher_derivatives_decide_where_the_acceleration_is_zero() {
    // x'' = -x + cos(t + phase): at rest at 0 with cos = 0, the load grows or falls.
    for (phase, stays) in [(-1.0, true), (1.0, false)] {
        let phase = phase * std::f64::consts::FRAC_PI_2;
        let structure = Structure::builder(vec![vec![1.0]], vec![vec![1.0]])
            .drive([nalgebra::Complex::new(1.0, 0.0)], 1.0, phase)
            .stop(Stop::new([1.0], 0.0, 0.5))
            .build()
            .unwrap();
        let landing = land(&structure, Clock::START, (&[0.0], &[0.0]), &[0], None);
        let released = Landing::Separate { leaving: vec![(0, Start::Released)] };
        if stays {
            let closed = Closed::Frictionless(vec![0]);
            assert_eq!(landing, Landing::Hold { closed, leaving: vec![] });
        } else {
            assert_eq!(landing, released);
        }
    }
    // At rest without loads all is zero for good, and stays.
    let structure = at_rest(vec![0.0; 2], &[vec![1.0, 0.0], vec![0.0, 1.0]]);
    let landing = land(&structure, Clock::START, (&[0.0; 2], &[0.0; 2]), &[0, 1], None);
    assert_eq!(stay(&landing), [0, 1]);
    let closed = Closed::Frictionless(vec![0, 1]);
    let motion = LinearMotion::new(&structure, closed).unwrap();
    let flight = motion.flight(Clock::START, &[0.0; 2], &[0.0; 2]);
    assert!(matches!(motion.next_event(&flight, &[]), LegEvent::Clear(_)));
}

/// Two stops with one normal that move apart or together: the one that closes in takes over.
#[test]
fn of_two_stops_with_one_normal_the_faster_one_holds() {
    // g1 = x - cos t, g2 = x - cos(t + pi) - 2: touched at x = 1, pressed by a load of 4.
    let pi = std::f64::consts::PI;
    let structure = |first: f64, second: f64| {
        Structure::builder(vec![vec![1.0]], vec![vec![0.0]])
            .static_load([4.0])
            .drive([nalgebra::Complex::default()], 1.0, 0.0)
            .stop(Stop::new([1.0], 1.0 - first, 0.5).moving(first, 0.0))
            .stop(Stop::new([1.0], 1.0 + second, 0.5).moving(second, pi))
            .build()
            .unwrap()
    };
    for (first, second) in [(0.5, 0.3), (-0.5, -0.3)] {
        let structure = structure(first, second);
        for candidates in [[0, 1], [1, 0]] {
            let landing = land(&structure, Clock::START, (&[1.0], &[0.0]), &candidates, None);
            let Landing::Hold { closed, leaving } = landing else { panic!("{landing:?}") };
            // The stop whose acceleration is lower: -first or second.
            let holds = usize::from(-first > second);
            assert_eq!(closed, Closed::Frictionless(vec![holds]));
            assert_eq!(leaving, [(1 - holds, LEFT)]);
        }
    }
    // Between stops that close in from both sides nothing fits.
    let jammed = Structure::builder(vec![vec![1.0]], vec![vec![0.0]])
        .drive([nalgebra::Complex::default()], 1.0, 0.0)
        .stop(Stop::new([1.0], -0.5, 0.5).moving(0.5, 0.0))
        .stop(Stop::new([-1.0], -0.5, 0.5).moving(0.5, 0.0))
        .build()
        .unwrap();
    assert_eq!(land(&jammed, Clock::START, (&[0.0], &[0.0]), &[0, 1], None), Landing::Painleve);
}

/// A block on a plane, pressed by 1: friction holds it against 0.5, and not against 0.7 (mu = 0.6).
#[test]
fn friction_holds_or_slides() {
    let block = |along: f64, press: f64| {
        Structure::builder(vec![vec![1.0, 0.0], vec![0.0, 1.0]], vec![vec![0.0; 2]; 2])
            .static_load([along, press])
            .stop(Stop::new([0.0, 1.0], 0.0, 0.5).with_friction(0.6, [1.0, 0.0]))
            .build()
            .unwrap()
    };
    let landed = |structure: &Structure, v: [f64; 2], ended| {
        land(structure, Clock::START, (&[0.0; 2], &v), &[0], ended)
    };
    let hold = |closed| Landing::Hold { closed, leaving: vec![] };
    let slide = |direction| hold(Closed::Slide { stop: 0, direction, beside: vec![] });
    let stick = || hold(Closed::Stick { stop: 0, beside: vec![] });
    assert_eq!(landed(&block(0.5, 1.0), [0.0; 2], None), stick());
    assert_eq!(landed(&block(0.7, 1.0), [0.0; 2], None), slide(1.0));
    assert_eq!(landed(&block(-0.7, 1.0), [0.0; 2], None), slide(-1.0));
    assert_eq!(landed(&block(0.5, 1.0), [-0.1, 0.0], None), slide(-1.0));
    assert_eq!(landed(&block(0.5, 1.0), [-1e-17, 0.0], Some(0)), stick());
    let leaving = vec![(0, LEFT)];
    assert_eq!(landed(&block(0.5, -1.0), [0.0; 2], None), Landing::Separate { leaving });
}

/// Stops with friction beside others: those that do not see them stay closed with them.
#[test]
fn friction_beside_other_stops() {
    let unit = |i: usize, count: usize| -> Vec<f64> {
        (0..count).map(|j| f64::from(u8::from(i == j))).collect()
    };
    let mass: Vec<Vec<f64>> = (0..4).map(|i| unit(i, 4)).collect();
    let built = |load: [f64; 4], stops: Vec<Stop>| {
        let builder = Structure::builder(mass.clone(), vec![vec![0.0; 4]; 4]).static_load(load);
        stops.into_iter().fold(builder, crate::model::StructureBuilder::stop).build().unwrap()
    };
    let rough = |n: usize, t: usize| Stop::new(unit(n, 4), 0.0, 0.5).with_friction(0.6, unit(t, 4));
    let smooth = |n: usize| Stop::new(unit(n, 4), 0.0, 0.5);
    let landed = |load: [f64; 4], stops: Vec<Stop>| {
        let candidates: Vec<usize> = (0..stops.len()).collect();
        land(&built(load, stops), Clock::START, (&[0.0; 4], &[0.0; 4]), &candidates, None)
    };
    let pressed = [0.1, 1.0, 1.0, 1.0];
    // Beside one that it does not see, and one that leaves.
    let landing = landed(pressed, vec![rough(1, 0), smooth(2)]);
    let closed = Closed::Stick { stop: 0, beside: vec![1] };
    assert_eq!(landing, Landing::Hold { closed, leaving: vec![] });
    // One in the way of its slip.
    assert_eq!(landed(pressed, vec![rough(1, 0), smooth(0)]), Landing::TooManyWithFriction);
    // Which is left, as the load pulls away from it.
    let landing = landed([-1.0, 1.0, 1.0, 1.0], vec![rough(1, 0), smooth(0)]);
    let closed = Closed::Slide { stop: 0, direction: -1.0, beside: vec![] };
    let leaving = vec![(1, LEFT)];
    assert_eq!(landing, Landing::Hold { closed, leaving });
    // Two with friction.
    assert_eq!(landed(pressed, vec![rough(1, 0), rough(2, 3)]), Landing::TooManyWithFriction);
    let landing = landed([0.1, 1.0, -1.0, 1.0], vec![rough(1, 0), rough(2, 3)]);
    let closed = Closed::Stick { stop: 0, beside: vec![] };
    let leaving = vec![(1, LEFT)];
    assert_eq!(landing, Landing::Hold { closed, leaving });
}

/// Any structure in motion, its stops moving: what stays is pressed, and what is left is left.
#[test]
fn landings_are_those_of_the_legs_that_follow() {
    let mut rng = ChaCha8Rng::seed_from_u64(23);
    let (mut held, mut left, mut rubbed) = (0, 0, 0);
    for round in 0..400 {
        let leg = draw(&mut rng, [1, 1, 2, 3][round % 4]);
        let candidates = leg.closed.stops();
        let at = (&leg.q[..], &leg.v[..]);
        let landing = land(&leg.structure, Clock::START, at, &candidates, None);
        let (closed, leaving) = match landing {
            Landing::Hold { closed, leaving } => (closed, leaving),
            Landing::Separate { leaving } => (Closed::Frictionless(vec![]), leaving),
            // A weak normal force against a steep coupling.
            Landing::Painleve => continue,
            Landing::TooManyWithFriction => panic!("{round}"),
        };
        held += closed.stops().len();
        left += leaving.len();
        rubbed += usize::from(!matches!(closed, Closed::Frictionless(_)));
        let motion = LinearMotion::new(&leg.structure, closed).unwrap();
        let flight = motion.flight(Clock::START, at.0, at.1);
        for (time, what) in [(0.0, "at once"), (1e-5 * motion.span(), "soon")] {
            let elapsed = DoubleDouble::new(time);
            for force in motion.forces(&flight, elapsed) {
                let friction = leg.structure.stops()[force.stop].friction();
                assert!(force.normal > 0.0, "{round} {what} {force:?}");
                let cone = friction * force.normal * (1.0 + 1e-12);
                assert!(force.tangential.abs() <= cone, "{round} {what} {force:?}");
            }
        }
        let soon = DoubleDouble::new(1e-3 * motion.span());
        let (q, v) = motion.state_after(&flight, soon);
        let clock = motion.clock_after(&flight, soon);
        let free = crate::flight::StructureMotion::new(&leg.structure);
        for (stop, start) in leaving {
            assert_eq!(start, LEFT);
            let (gap, rate) = free.gap(stop, clock, &q, &v);
            assert!(gap < 0.0 && rate < 0.0, "{round} {stop} {gap:e} {rate:e}");
        }
        // What has been decided is not decided again.
        let event = motion.next_event(&flight, &[]);
        assert!(!matches!(event, LegEvent::Released { time: 0.0, .. }), "{round} {event:?}");
    }
    assert!(held > 200 && left > 50 && rubbed > 50, "{held} {left} {rubbed}");
}
