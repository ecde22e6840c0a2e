//! Derivatives of the motions of structures: against differences of simulated motions, and against
//! what holds exactly.

use nalgebra::{Complex, DMatrix};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vibroimpact::tangent::structure::{
    StructureDerivative, StructurePassage, StructureTangentError, structure_derivative,
};
use vibroimpact::{
    CancelToken, Horizon, Simultaneous, Stop, StopReason, Structure, StructureState,
};

use crate::support::draws;

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
    fn structure(
        &mut self,
        restitution: (f64, f64),
        friction: f64,
        simultaneous: Simultaneous,
    ) -> Structure {
        let count = self.0.random_range(1..5usize);
        let (mass, stiffness) = (self.definite(count, 0.5), self.definite(count, 0.3));
        let drive: Vec<_> = (0..count)
            .map(|_| Complex::new(self.uniform(-2.0, 2.0), self.uniform(-2.0, 2.0)))
            .collect();
        let mut builder = Structure::builder(mass, stiffness)
            .simultaneous(simultaneous)
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
            let stop = Stop::new(
                normal,
                self.uniform(0.1, 0.6),
                self.uniform(restitution.0, restitution.1),
            )
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

/// What random structures have shown.
#[derive(Default, Debug)]
struct Tally {
    /// Why some are refused.
    why: Vec<(u64, String)>,
    compared: usize,
    impacts: u64,
    chatters: usize,
    closed: usize,
    refused: usize,
    worst: f64,
}

/// Derivatives over some time against differences, at restitutions in this range.
fn compare(restitution: (f64, f64), friction: f64, simultaneous: Simultaneous) -> Tally {
    let time = 12.0;
    let mut tally = Tally::default();
    for stream in 0..draws(40, 400) as u64 {
        let mut draw = Draw::new(stream);
        let structure = draw.structure(restitution, friction, simultaneous);
        let from = start(&mut draw, structure.coordinates());
        let found = match derivative(&structure, &from, time) {
            Ok(found) => found,
            Err(
                error @ (StructureTangentError::Stopped(
                    StopReason::Simultaneous | StopReason::SeveralFrictional | StopReason::Painleve,
                )
                | StructureTangentError::Chatter(..)
                | StructureTangentError::Simultaneous(..)),
            ) => {
                tally.why.push((stream, error.to_string()));
                tally.refused += 1;
                continue;
            }
            Err(error) => panic!("{stream}: {error}"),
        };
        let growth = found.matrix.amax().max(1.0);
        let mut error: Option<f64> = None;
        for step in [1e-4, 1e-5, 1e-6] {
            let wanted = differences(&structure, &from, time, step / growth, &found.passed);
            let Some(here) = wanted.map(|wanted| off(&found.matrix, &wanted)) else { continue };
            error = Some(error.map_or(here, |least| least.min(here)));
            if here < 1e-9 {
                break;
            }
        }
        // Within a step of a graze, or of another border.
        let Some(error) = error else { continue };
        let rank = found.matrix.clone().svd(false, false).rank(1e-12 * found.matrix.norm());
        assert!(rank <= found.rank, "{stream}: {rank} {}", found.rank);
        tally.compared += 1;
        tally.impacts += found.impacts.iter().sum::<u64>();
        for passed in &found.passed {
            tally.chatters += usize::from(matches!(passed, StructurePassage::Chatter(_)));
            tally.closed += usize::from(matches!(passed, StructurePassage::Closed(..)));
        }
        tally.worst = tally.worst.max(error);
    }
    println!("{restitution:?} {friction} {simultaneous:?} {tally:?}");
    tally
}

#[test]
fn derivatives_are_those_of_simulated_motions() {
    let tally = compare((0.5, 1.0), 0.0, Simultaneous::Stop);
    assert!(tally.worst < 1e-7 && tally.compared > 30 && tally.impacts > 200, "{tally:?}");
    let tally = compare((0.5, 1.0), 0.6, Simultaneous::Stop);
    assert!(tally.worst < 1e-7 && tally.compared > 30 && tally.impacts > 200, "{tally:?}");
}

#[test]
fn derivatives_go_on_through_chatter_and_contact() {
    let tally = compare((0.0, 0.5), 0.0, Simultaneous::Stop);
    assert!(tally.worst < 1e-7 && tally.compared > 30 && tally.chatters > 20, "{tally:?}");
    // Three motions come to rest on both of their stops at once, which this rule ends.
    let tally = compare((0.0, 0.5), 0.6, Simultaneous::Stop);
    assert!(tally.worst < 1e-7 && tally.compared > 30 && tally.chatters > 14, "{tally:?}");
}

#[test]
fn derivatives_go_on_through_plastic_impacts() {
    let tally = compare((0.0, 1e-300), 0.0, Simultaneous::Stop);
    assert!(tally.worst < 1e-7 && tally.compared > 30 && tally.closed > 50, "{tally:?}");
    let tally = compare((0.0, 1e-300), 0.6, Simultaneous::Stop);
    assert!(tally.worst < 1e-7 && tally.compared > 30 && tally.closed > 50, "{tally:?}");
}

#[test]
fn derivatives_go_on_through_several_impacts_at_one_instant() {
    for (restitution, simultaneous, friction) in [
        ((0.0, 0.4), Simultaneous::Sequence, 0.0),
        ((0.0, 0.4), Simultaneous::Together, 0.0),
        ((0.0, 0.4), Simultaneous::Sequence, 0.6),
        ((0.0, 1e-300), Simultaneous::Together, 0.0),
    ] {
        let tally = compare(restitution, friction, simultaneous);
        assert!(tally.worst < 1e-7 && tally.compared > 30 && tally.closed > 15, "{tally:?}");
    }
}

fn trace_of_decay(structure: &Structure) -> f64 {
    let count = structure.coordinates();
    let of = |rows: &[Vec<f64>]| DMatrix::from_fn(count, count, |i, j| rows[i][j]);
    of(structure.mass()).lu().solve(&of(&structure.damping())).unwrap().trace()
}

/// Frictionless impacts take r^2 each from volumes, moving or not, and damping exp(-t tr M^-1 C).
#[test]
fn volumes_shrink_as_impacts_and_damping_say() {
    let (mut worst, mut impacts) = (0.0f64, 0);
    for stream in 0..draws(60, 600) as u64 {
        let mut draw = Draw::new(stream);
        let structure = draw.structure((0.6, 1.0), 0.0, Simultaneous::Stop);
        let from = start(&mut draw, structure.coordinates());
        let Ok(found) = derivative(&structure, &from, 8.0) else { continue };
        if found.rank < found.matrix.nrows() {
            continue;
        }
        let ratios = found.impacts.iter().zip(structure.stops());
        let lost: f64 = ratios.map(|(&n, stop)| 2.0 * n as f64 * stop.restitution().ln()).sum();
        let wanted = (lost - 8.0 * trace_of_decay(&structure)).exp();
        let parts = found.matrix.clone().svd(false, false).singular_values;
        let condition = parts.max() / parts.min();
        let error = (found.matrix.determinant() / wanted - 1.0).abs() / condition;
        worst = worst.max(error);
        impacts += found.impacts.iter().sum::<u64>();
    }
    assert!(worst < 1e-13 && impacts > 150, "{worst:e} {impacts}");
}

/// A body that rests on a stop, and another that meets it.
fn pressed(simultaneous: Simultaneous) -> Structure {
    Structure::builder(vec![vec![1.0, 0.0], vec![0.0, 0.7]], vec![vec![1.0, 0.0], vec![0.0, 2.0]])
        .damping(vec![vec![0.1, 0.02], vec![0.02, 0.05]])
        .static_load([0.6, 0.9])
        .drive([0.1.into(), 0.4.into()], 1.7, 0.3)
        .simultaneous(simultaneous)
        .stop(Stop::new([1.0, 0.0], 0.0, 0.2))
        .stop(Stop::new([-1.0, 1.0], 0.1, 0.6))
        .build()
        .unwrap()
}

/// A body that rests on a stop is pressed by the impact of another: the stop is struck at the same
/// instant.
#[test]
fn impacts_at_one_instant_have_a_derivative() {
    for simultaneous in [Simultaneous::Sequence, Simultaneous::Together] {
        let structure = pressed(simultaneous);
        let from = StructureState::new(&[-0.01, -2.0], &[0.0, 0.0]);
        let found = derivative(&structure, &from, 2.0).unwrap();
        let struck = |stop| found.passed.contains(&StructurePassage::Impact(stop));
        assert!(struck(0) && struck(1), "{:?}", found.passed);
        let wanted = differences(&structure, &from, 2.0, 1e-4, &found.passed).unwrap();
        let error = off(&found.matrix, &wanted);
        assert!(error < 1e-8, "{simultaneous:?}: {error:e}");
    }
}

/// Balls that meet a third from both sides at one instant, and chatter of chatters.
#[test]
fn what_has_no_derivative_is_refused_by_name() {
    let diagonal = |of: f64| {
        let entry = |i, j| if i == j { of } else { 0.0 };
        (0..3).map(|i| (0..3).map(|j| entry(i, j)).collect()).collect::<Vec<Vec<f64>>>()
    };
    let structure = Structure::builder(diagonal(1.0), diagonal(0.0))
        .simultaneous(Simultaneous::Sequence)
        .stop(Stop::new([1.0, -1.0, 0.0], 1.0, 0.5))
        .stop(Stop::new([0.0, 1.0, -1.0], 1.0, 0.5))
        .build()
        .unwrap();
    let from = StructureState::new(&[-0.5, 0.0, 0.5], &[1.0, 0.0, -1.0]);
    let error = derivative(&structure, &from, 2.0).unwrap_err();
    assert!(matches!(error, StructureTangentError::Simultaneous(0, 1, 1.5)), "{error}");
    // Hits on a body that bounces to rest after each of them come ever faster, to rest on both stops.
    let from = StructureState::new(&[-0.01, -2.0], &[0.0, 0.0]);
    let found = derivative(&pressed(Simultaneous::Sequence), &from, 3.0).unwrap();
    assert_eq!((found.rank, found.matrix.amax()), (0, 0.0));
    let error = derivative(&pressed(Simultaneous::Stop), &from, 3.0).unwrap_err();
    assert_eq!(error, StructureTangentError::Stopped(StopReason::Simultaneous));
}
