//! Derivatives of the motions of structures: against differences of simulated motions, and against what
//! holds exactly.

use nalgebra::{Complex, DMatrix};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vibroimpact::tangent::structure::{
    StructureDerivative, StructurePassage, StructureTangentError, structure_derivative,
};
use vibroimpact::{CancelToken, Horizon, Simultaneous, Stop, Structure, StructureState};

fn derivative(
    structure: &Structure,
    start: &StructureState,
    time: f64,
) -> Result<StructureDerivative, StructureTangentError> {
    structure_derivative(structure, start.clone(), Horizon::Time(time), &CancelToken::never())
}

fn numbers(state: &StructureState) -> Vec<f64> {
    state.q.iter().chain(&state.v).copied().collect()
}

fn from_numbers(all: &[f64]) -> StructureState {
    StructureState::new(&all[..all.len() / 2], &all[all.len() / 2..])
}

/// Central differences of two steps, extrapolated; `None` where a neighbour passes other events.
fn differences(
    structure: &Structure,
    start: &StructureState,
    time: f64,
    step: f64,
    passed: &[StructurePassage],
) -> Option<DMatrix<f64>> {
    let from = numbers(start);
    let count = from.len();
    let mut found = DMatrix::zeros(count, count);
    for c in 0..count {
        let end = |by: f64| {
            let mut moved = from.clone();
            moved[c] += by;
            let end = derivative(structure, &from_numbers(&moved), time).ok()?;
            (end.passed == passed).then(|| numbers(&end.state))
        };
        let slope = |by: f64| -> Option<Vec<f64>> {
            let (up, down) = (end(by)?, end(-by)?);
            Some(up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * by)).collect())
        };
        let (fine, coarse) = (slope(step)?, slope(2.0 * step)?);
        for (i, (fine, coarse)) in fine.iter().zip(&coarse).enumerate() {
            found[(i, c)] = (4.0 * fine - coarse) / 3.0;
        }
    }
    Some(found)
}

/// Largest difference, relative to the largest entry.
fn off(a: &DMatrix<f64>, b: &DMatrix<f64>) -> f64 {
    (a - b).amax() / b.amax().max(1.0)
}

struct Draw(ChaCha8Rng);

impl Draw {
    fn new(stream: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(2004);
        rng.set_stream(stream);
        Self(rng)
    }

    fn uniform(&mut self, from: f64, to: f64) -> f64 {
        self.0.random_range(from..to)
    }

    fn vector(&mut self, count: usize, size: f64) -> Vec<f64> {
        (0..count).map(|_| self.uniform(-size, size)).collect()
    }

    /// A A^T + least I.
    fn definite(&mut self, count: usize, least: f64) -> Vec<Vec<f64>> {
        let a: Vec<Vec<f64>> = (0..count).map(|_| self.vector(count, 1.0)).collect();
        let entry = |i: usize, j: usize| {
            let sum: f64 = a[i].iter().zip(&a[j]).map(|(x, y)| x * y).sum();
            if i == j { sum + least } else { sum }
        };
        (0..count).map(|i| (0..count).map(|j| entry(i.max(j), i.min(j))).collect()).collect()
    }

    /// A structure, with these coefficients of restitution at most and of friction.
    fn structure(&mut self, restitution: (f64, f64), friction: f64) -> Structure {
        let count = self.0.random_range(1..5usize);
        let (mass, stiffness) = (self.definite(count, 0.5), self.definite(count, 0.3));
        let drive: Vec<_> = (0..count)
            .map(|_| Complex::new(self.uniform(-2.0, 2.0), self.uniform(-2.0, 2.0)))
            .collect();
        let mut builder = Structure::builder(mass, stiffness)
            .static_load(self.vector(count, 0.5))
            .drive(drive, self.uniform(0.7, 2.5), self.uniform(0.0, 6.0));
        builder = if self.0.random_bool(0.5) {
            let ratios: Vec<f64> = (0..count).map(|_| self.uniform(0.0, 0.1)).collect();
            builder.damping_ratios(ratios)
        } else {
            let damping = self.definite(count, 0.0);
            builder.damping(damping.iter().map(|r| r.iter().map(|x| 0.1 * x).collect()).collect())
        };
        for _ in 0..self.0.random_range(1..3usize) {
            let normal = self.vector(count, 1.0);
            let stop = Stop::new(normal, self.uniform(0.1, 0.6), self.uniform(restitution.0, restitution.1))
                .moving(self.uniform(0.0, 0.1), self.uniform(0.0, 6.0));
            builder = builder.stop(if friction > 0.0 && count > 1 {
                stop.with_friction(self.uniform(0.0, friction), self.vector(count, 1.0))
            } else {
                stop
            });
        }
        builder.build().unwrap()
    }
}

/// Rest at q = 0 is apart from stops whose gap exceeds their amplitude.
fn start(draw: &mut Draw, count: usize) -> StructureState {
    StructureState::new(&vec![0.0; count], &draw.vector(count, 1.0))
}

#[derive(Default, Debug)]
struct Tally {
    compared: usize,
    impacts: u64,
    chatters: usize,
    contacts: usize,
    refused: usize,
    worst: f64,
}

fn compare(restitution: (f64, f64), friction: f64, draws: u64, time: f64) -> Tally {
    let mut tally = Tally::default();
    for stream in 0..draws {
        let mut draw = Draw::new(stream);
        let structure = draw.structure(restitution, friction);
        let from = start(&mut draw, structure.coordinates());
        let found = match derivative(&structure, &from, time) {
            Ok(found) => found,
            Err(error) => {
                println!("{stream}: {error}");
                tally.refused += 1;
                continue;
            }
        };
        let growth = found.matrix.amax().max(1.0);
        let step = 1e-4 / growth;
        let Some(wanted) = differences(&structure, &from, time, step, &found.passed) else {
            continue;
        };
        let error = off(&found.matrix, &wanted);
        if error > 1e-7 {
            println!("{stream}: N = {} {error:e} growth {growth:e} {:?}", structure.coordinates(), found.passed);
        }
        tally.compared += 1;
        tally.impacts += found.impacts.iter().sum::<u64>();
        let chatter = |p: &&StructurePassage| matches!(p, StructurePassage::Chatter(_));
        let closed = |p: &&StructurePassage| matches!(p, StructurePassage::Closed(..));
        tally.chatters += found.passed.iter().filter(chatter).count();
        tally.contacts += found.passed.iter().filter(closed).count();
        tally.worst = tally.worst.max(error);
    }
    println!("{restitution:?} {friction} {tally:?}");
    tally
}

#[test]
fn derivatives_are_those_of_simulated_motions() {
    compare((0.5, 1.0), 0.0, 60, 12.0);
}
#[test]
fn friction() {
    compare((0.5, 1.0), 0.6, 60, 12.0);
}
#[test]
fn chatter() {
    compare((0.0, 0.5), 0.0, 60, 12.0);
}
#[test]
fn plastic() {
    compare((0.0, 1e-300), 0.0, 60, 12.0);
}
#[test]
fn plastic_friction() {
    compare((0.0, 1e-300), 0.6, 60, 12.0);
}
#[test]
fn chatter_friction() {
    compare((0.0, 0.5), 0.6, 60, 12.0);
}
