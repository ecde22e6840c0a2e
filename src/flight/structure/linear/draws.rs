//! Random structures, and states on some of their stops, for tests.

use nalgebra::Complex;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::Closed;
use crate::model::{Stop, Structure};

/// A structure, which of its stops stay closed, and a state on them.
pub(crate) struct Leg {
    pub structure: Structure,
    pub closed: Closed,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub drive: Vec<Complex<f64>>,
    pub load: Vec<f64>,
}

pub(crate) fn dots(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn squares(rng: &mut ChaCha8Rng, count: usize, size: f64, least: f64) -> Vec<Vec<f64>> {
    let rows: Vec<Vec<f64>> =
        (0..count).map(|_| (0..count).map(|_| rng.random_range(-size..size)).collect()).collect();
    let sum = |i: usize, j: usize| {
        let sum: f64 = rows.iter().map(|row| row[i] * row[j]).sum();
        if i == j { sum + least } else { sum }
    };
    (0..count).map(|i| (0..count).map(|j| sum(i, j)).collect()).collect()
}

/// A chain that nothing holds.
pub(crate) fn chain(count: usize) -> Vec<Vec<f64>> {
    let entry = |i: usize, j: usize| match i.abs_diff(j) {
        0 => (usize::from(i > 0) + usize::from(i + 1 < count)) as f64,
        1 => -1.0,
        _ => 0.0,
    };
    (0..count).map(|i| (0..count).map(|j| entry(i, j)).collect()).collect()
}

/// `kind`: 0 free, 1 closed without friction, 2 slides, 3 sticks.
pub(crate) fn draw(rng: &mut ChaCha8Rng, kind: usize) -> Leg {
    let count = rng.random_range(if kind < 2 { 1..=8 } else { 2..=8 });
    let mass = squares(rng, count, 0.7, 0.5);
    let stiffness =
        if rng.random_bool(0.3) { chain(count) } else { squares(rng, count, 1.5, 0.01) };
    let damped = [0.0, 0.05, 0.5, 2.0][rng.random_range(0..4)];
    let damping = squares(rng, count, damped + 1e-300, 0.0);
    let vector = |rng: &mut ChaCha8Rng, size: f64| -> Vec<f64> {
        (0..count).map(|_| rng.random_range(-size..size)).collect()
    };
    let (q, mut v) = (vector(rng, 1.0), vector(rng, 1.0));
    let (re, im, mut load) = (vector(rng, 1.0), vector(rng, 1.0), vector(rng, 1.0));
    let drive: Vec<_> = re.iter().zip(&im).map(|(&re, &im)| Complex::new(re, im)).collect();
    let (omega, phase) = (rng.random_range(0.1..4.0), rng.random_range(-3.0..3.0));
    let held = match kind {
        0 => 0,
        1 => rng.random_range(1..=count.min(3)),
        _ => 1,
    };
    let mut stops: Vec<(Vec<f64>, f64, f64, Vec<f64>)> = Vec::new();
    for _ in 0..held + 2 {
        let (amplitude, own) = (rng.random_range(-0.3..0.3), rng.random_range(-3.0..3.0));
        let amplitude = if rng.random_bool(0.5) { amplitude } else { 0.0 };
        stops.push((vector(rng, 1.0), amplitude, own, vector(rng, 1.0)));
    }
    let inverse = |row: &[f64]| -> Vec<f64> {
        let made = Structure::builder(mass.clone(), stiffness.clone())
            .stop(Stop::new(row.to_vec(), 0.0, 1.0))
            .build()
            .unwrap();
        made.contact(0).by_normal.clone()
    };
    // Pressed, as a rule; onto the closed stops again and again: their normals are not orthogonal.
    let by: Vec<Vec<f64>> = stops[..held].iter().map(|(normal, ..)| inverse(normal)).collect();
    for (normal, ..) in &stops[..held] {
        load.iter_mut().zip(normal).for_each(|(load, n)| *load += 3.0 * n);
    }
    for _ in 0..2000 {
        for ((normal, amplitude, own, _), by) in stops[..held].iter().zip(&by) {
            let wanted = -amplitude * omega * own.sin();
            let part = (dots(normal, &v) - wanted) / dots(normal, by);
            v.iter_mut().zip(by).for_each(|(v, by)| *v -= part * by);
        }
        if held < 2 {
            break;
        }
    }
    if kind == 3 {
        // No velocity of slip either: of all velocities the one along the normal alone is left.
        v.fill(0.0);
        stops[0].1 = 0.0;
    }
    let friction = rng.random_range(0.1..0.8);
    let mut builder = Structure::builder(mass, stiffness)
        .damping(damping)
        .static_load(load.clone())
        .drive(drive.clone(), omega, phase);
    for (i, (normal, amplitude, own, tangent)) in stops.iter().enumerate() {
        let at = dots(normal, &q) - amplitude * own.cos();
        let gap = if i < held { at } else { at + rng.random_range(0.05..1.0) };
        let mut stop = Stop::new(normal.clone(), gap, 0.8).moving(*amplitude, *own);
        if kind >= 2 && i == 0 {
            stop = stop.with_friction(friction, tangent.clone());
        }
        builder = builder.stop(stop);
    }
    let structure = builder.build().unwrap();
    let closed = match kind {
        0 | 1 => Closed::Frictionless((0..held).collect()),
        2 => {
            let direction = dots(&stops[0].3, &v).signum();
            Closed::Slide { stop: 0, direction, beside: vec![] }
        }
        _ => Closed::Stick { stop: 0, beside: vec![] },
    };
    Leg { structure, closed, q, v, drive, load }
}
