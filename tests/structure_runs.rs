//! Runs of random structures: they end with a typed reason, penetrate no stop and explain their energy;
//! two bodies that meet head-on move as the system of the same name; other coordinates change nothing.

use nalgebra::Complex;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vibroimpact::{
    CancelToken, Contact, Horizon, Run, RunOptions, Simultaneous, State, Stop, StopReason,
    Structure, StructureState, System, run,
};

use crate::support::draws;

type Rows = Vec<Vec<f64>>;

fn uniform(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    rng.random_range(low..high)
}

/// A matrix A A^T + least.
fn definite(rng: &mut ChaCha8Rng, count: usize, least: f64, size: f64) -> Rows {
    let a: Rows =
        (0..count).map(|_| (0..count).map(|_| uniform(rng, -size, size)).collect()).collect();
    let entry = |i: usize, j: usize| {
        let sum: f64 = (0..count).map(|k| a[i][k] * a[j][k]).sum();
        sum + if i == j { least } else { 0.0 }
    };
    (0..count).map(|i| (0..count).map(|j| entry(i.min(j), i.max(j))).collect()).collect()
}

/// A structure of up to eight coordinates and six stops: all kinds of damping, loads, restitution,
/// moving stops, friction in one or several of them.
fn random_structure(rng: &mut ChaCha8Rng) -> (Structure, StructureState) {
    let count = rng.random_range(1..=8usize);
    let mass = definite(rng, count, 0.5, 0.4);
    let free = rng.random_bool(0.15);
    let stiffness = if free && count > 1 {
        // A chain that nothing holds.
        let mut k = vec![vec![0.0; count]; count];
        for i in 0..count - 1 {
            let spring = uniform(rng, 0.5, 4.0);
            k[i][i] += spring;
            k[i + 1][i + 1] += spring;
            k[i][i + 1] -= spring;
            k[i + 1][i] -= spring;
        }
        k
    } else {
        definite(rng, count, 0.5, 1.5)
    };
    let mut builder = Structure::builder(mass.clone(), stiffness.clone());
    let mix = uniform(rng, 0.0, 0.1);
    builder = match rng.random_range(0..4) {
        0 => builder,
        1 => builder.damping(definite(rng, count, 0.02, 0.2)),
        2 => builder.damping(
            mass.iter()
                .zip(&stiffness)
                .map(|(m, k)| m.iter().zip(k).map(|(m, k)| mix * (m + k)).collect())
                .collect(),
        ),
        _ if free => builder.damping(definite(rng, count, 0.02, 0.1)),
        _ => builder.damping_ratios((0..count).map(|_| uniform(rng, 0.0, 0.2)).collect::<Vec<_>>()),
    };
    let drive: Vec<_> = (0..count)
        .map(|_| Complex::new(uniform(rng, -1.5, 1.5), uniform(rng, -0.5, 0.5)))
        .collect();
    let loads: Vec<_> = (0..count).map(|_| uniform(rng, -0.4, 0.4)).collect();
    builder =
        builder.drive(drive, uniform(rng, 0.3, 3.0), uniform(rng, 0.0, 6.0)).static_load(loads);
    let stops = rng.random_range(1..=6usize);
    for _ in 0..stops {
        let mut normal = vec![0.0; count];
        let at = rng.random_range(0..count);
        normal[at] = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        if rng.random_bool(0.3) && count > 1 {
            let other = (at + 1) % count;
            normal[other] = -normal[at];
        }
        let restitution = [0.0, 0.2, 0.5, 0.8, 0.95, 1.0][rng.random_range(0..6usize)];
        let mut stop = Stop::new(normal.clone(), uniform(rng, 0.05, 1.0), restitution);
        if rng.random_bool(0.2) {
            stop = stop.moving(uniform(rng, 0.0, 0.04), uniform(rng, 0.0, 6.0));
        }
        if rng.random_bool(0.2) && count > 1 {
            let tangent: Vec<f64> = (0..count).map(|_| uniform(rng, -1.0, 1.0)).collect();
            stop = stop.with_friction(uniform(rng, 0.0, 0.8), tangent);
        }
        builder = builder.stop(stop);
    }
    let velocity: Vec<f64> = (0..count).map(|_| uniform(rng, -0.5, 0.5)).collect();
    (builder.build().unwrap(), StructureState::new(&vec![0.0; count], &velocity))
}

fn made(structure: &Structure, start: &StructureState, periods: i64) -> Run<Structure> {
    let options = RunOptions { max_events: 5_000, ..RunOptions::periods(periods) };
    match run(structure, start.clone(), options, &CancelToken::never()) {
        Ok(run) => run,
        Err(error) => panic!("{error}: {structure:?} {start:?}"),
    }
}

#[test]
fn random_structures_end_for_a_reason_and_explain_their_energy() {
    let mut rng = ChaCha8Rng::seed_from_u64(24);
    let (mut impacts, mut contacts, mut completed) = (0, 0, 0);
    let (mut worst, mut deepest) = (0.0f64, 0.0f64);
    for case in 0..draws(300, 10_000) {
        let (structure, start) = random_structure(&mut rng);
        let run = made(&structure, &start, 12);
        assert_ne!(run.stop_reason, StopReason::Failed, "case {case}");
        completed += usize::from(run.stop_reason == StopReason::Completed);
        impacts += run.impacts.len();
        contacts += run.contacts.len();
        for row in &run.impacts {
            let size: f64 = row.v_pre.iter().map(|v| v * v).sum();
            assert!(row.impulse_normal >= 0.0, "case {case}");
            assert!(row.energy_loss >= -1e-12 * size.max(1.0), "case {case}: {row:?}");
        }
        let (from, to) = (run.kept_from(), run.final_state.time);
        let times: Vec<f64> =
            (0..=200).map(|i| (from + (to - from) * f64::from(i) / 200.0).min(to)).collect();
        for (time, state) in times.iter().zip(run.trajectory(&times).unwrap()) {
            for (j, stop) in structure.stops().iter().enumerate() {
                let place: f64 = stop.normal().iter().zip(&state.q).map(|(n, q)| n * q).sum();
                let own =
                    stop.amplitude() * (structure.drive_frequency() * time + stop.phase()).cos();
                let size: f64 = state.q.iter().map(|q| q.abs()).sum();
                let depth = (place - stop.gap() - own) / size.max(1.0);
                deepest = deepest.max(depth);
                assert!(depth < 1e-9, "case {case}: stop {j} at {time}: {depth}");
            }
        }
        let audit = run.energy_audit(&CancelToken::never()).unwrap();
        let error = audit.residual().abs() / audit.total.max(audit.energy_end).max(1e-3);
        worst = worst.max(error);
        assert!(error < 1e-9, "case {case}: {audit:?} {:?}", run.stop_reason);
    }
    println!(
        "{impacts} impacts, {contacts} changes of contact, {completed} runs completed; energy \
         {worst:e}, depth {deepest:e}"
    );
    assert!(impacts > 1_000 && contacts > 100);
}

/// A system of two bodies that meet head-on, and the structure that it is.
fn head_on(rng: &mut ChaCha8Rng) -> (System, Structure, [f64; 4]) {
    let [ratio, w, gap, omega] = [(0.1, 2.0), (0.3, 3.0), (0.05, 0.8), (0.3, 3.0)]
        .map(|(low, high)| uniform(rng, low, high));
    let [z1, z2] = [0, 1].map(|_| if rng.random_bool(0.3) { 0.0 } else { uniform(rng, 0.0, 0.2) });
    let [f1, f2, c1, c2] = [0, 1, 2, 3].map(|_| uniform(rng, -1.0, 1.0));
    let (restitution, phase) = (uniform(rng, 0.3, 1.0), uniform(rng, 0.0, 6.0));
    let system = System::builder()
        .mass_ratio(ratio)
        .frequency_ratio(w)
        .restitution(restitution)
        .gap(gap)
        .drive_frequency(omega)
        .moment_amplitude(f1)
        .force_amplitude(f2)
        .static_moment(0.3 * c1)
        .static_force(0.3 * c2)
        .pendulum_damping(z1)
        .oscillator_damping(z2)
        .phase(phase)
        .contact(Contact::Direct)
        .build()
        .unwrap();
    let diagonal = |a: f64, b: f64| vec![vec![a, 0.0], vec![0.0, b]];
    let structure = Structure::builder(diagonal(1.0, 1.0 / ratio), diagonal(w * w, 1.0 / ratio))
        .damping(diagonal(2.0 * z1 * w, 2.0 * z2 / ratio))
        .static_load([0.3 * c1, 0.3 * c2 / ratio])
        .drive([Complex::from(f1), Complex::from(f2 / ratio)], omega, phase)
        .stop(Stop::new([1.0, -1.0], gap, restitution))
        .build()
        .unwrap();
    (system, structure, [0.0, uniform(rng, -0.5, 0.5), 0.0, uniform(rng, -0.5, 0.5)])
}

#[test]
fn two_bodies_that_meet_head_on_are_the_system_of_that_name() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let (mut impacts, mut worst) = (0, 0.0f64);
    for case in 0..draws(200, 1_000) {
        let (system, structure, [x1, v1, x2, v2]) = head_on(&mut rng);
        let options = RunOptions { max_events: 2_000, ..RunOptions::periods(8) };
        let never = CancelToken::never();
        let of = |v1: f64| run(&system, State::new(x1, v1, x2, v2).unwrap(), options, &never);
        let (first, beside) = (of(v1).unwrap(), of(v1 * (1.0 + 1e-9) + 1e-9).unwrap());
        let second = made(&structure, &StructureState::new(&[x1, x2], &[v1, v2]), 8);
        let mut growth = 1.0f64;
        // Where a chatter is completed, after how many impacts, may differ.
        let cut = first.contacts.first().map_or(f64::INFINITY, |row| row.time);
        let cut = second.contacts.first().map_or(cut, |row| row.time.min(cut));
        for (k, (a, b)) in first.impacts.iter().zip(&second.impacts).enumerate() {
            // How far a neighbour is by then says what rounding may do.
            let Some(near) = beside.impacts.get(k) else { break };
            let apart = [near.x1 - a.x1, near.v1_pre - a.v1_pre, near.x2 - a.x2]
                .into_iter()
                .chain([near.v2_pre - a.v2_pre, near.time - a.time])
                .fold(0.0f64, |most, x| most.max(x.abs()));
            growth = growth.max(apart / 1e-9);
            if growth > 1e5 {
                break;
            }
            if a.time.max(b.time) >= cut {
                break;
            }
            let slow = b.approach_velocity.min(1.0);
            for (a, b) in [
                (a.time, b.time),
                (a.x1, b.q[0]),
                (a.x2, b.q[1]),
                (a.v1_pre, b.v_pre[0]),
                (a.v2_pre, b.v_pre[1]),
                (a.v1_post, b.v_post[0]),
                (a.v2_post, b.v_post[1]),
                (a.impulse_normal, b.impulse_normal),
            ] {
                let error = (a - b).abs() / (a.abs().max(1.0) * growth / slow * f64::EPSILON);
                worst = worst.max(error);
                assert!(error < 1_000.0, "case {case}, impact {k}: {a} {b}: {error}");
            }
            impacts += 1;
        }
    }
    println!("{impacts} impacts, worst {worst} eps");
    assert!(impacts > 1_000);
}

/// Coordinates in another order, and any combinations of them, move alike.
#[test]
fn other_coordinates_change_nothing() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut compared = 0;
    for case in 0..draws(60, 1_000) {
        let count = rng.random_range(2..=5usize);
        let [mass, stiffness] =
            [(0.5, 0.4), (0.5, 1.2)].map(|(least, size)| definite(&mut rng, count, least, size));
        let damping = definite(&mut rng, count, 0.02, 0.15);
        let drive: Vec<f64> = (0..count).map(|_| uniform(&mut rng, -1.5, 1.5)).collect();
        let omega = uniform(&mut rng, 0.4, 2.5);
        let normals: Rows =
            (0..2).map(|_| (0..count).map(|_| uniform(&mut rng, -1.0, 1.0)).collect()).collect();
        let start: Vec<f64> = (0..count).map(|_| uniform(&mut rng, -0.5, 0.5)).collect();
        // q = B p, with rows and matrices on B.
        let b: Rows = (0..count)
            .map(|i| {
                let entry = |j| uniform(&mut rng, -0.3, 0.3) + f64::from(u8::from(i == j));
                (0..count).map(entry).collect()
            })
            .collect();
        let on = |row: &[f64]| -> Vec<f64> {
            (0..count).map(|j| (0..count).map(|i| row[i] * b[i][j]).sum()).collect()
        };
        let congruent = |a: &Rows| -> Rows {
            let half: Rows = a.iter().map(|row| on(row)).collect();
            let entry = |i: usize, j: usize| (0..count).map(|k| b[k][i] * half[k][j]).sum::<f64>();
            (0..count)
                .map(|i| (0..count).map(|j| 0.5 * (entry(i, j) + entry(j, i))).collect())
                .collect()
        };
        let structure = |m: Rows, k: Rows, c: Rows, f: &[f64], n: &[Vec<f64>]| {
            let drive: Vec<_> = f.iter().map(|&f| Complex::from(f)).collect();
            let builder = Structure::builder(m, k).damping(c).drive(drive, omega, 0.3);
            n.iter()
                .fold(builder, |builder, n| builder.stop(Stop::new(n.clone(), 0.4, 0.7)))
                .build()
                .unwrap()
        };
        let ours = structure(
            congruent(&mass),
            congruent(&stiffness),
            congruent(&damping),
            &on(&drive),
            &normals.iter().map(|n| on(n)).collect::<Vec<_>>(),
        );
        let given = structure(mass, stiffness, damping, &drive, &normals);
        let physical: Vec<f64> =
            b.iter().map(|row| row.iter().zip(&start).map(|(b, p)| b * p).sum()).collect();
        let rest = vec![0.0; count];
        let (one, other) = (
            made(&given, &StructureState::new(&rest, &physical), 4),
            made(&ours, &StructureState::new(&rest, &start), 4),
        );
        for (a, c) in one.impacts.iter().zip(&other.impacts).take(6) {
            assert_eq!(a.stop, c.stop, "case {case}");
            assert!((a.time - c.time).abs() < 1e-9, "case {case}: {} {}", a.time, c.time);
            compared += 1;
        }
    }
    assert!(compared > 100);
}

/// A body between two equal stops and an opposite one without clearance: no velocity leaves all.
#[test]
fn a_body_without_clearance_ends_as_simultaneous() {
    let structure = Structure::builder(vec![vec![1.0]], vec![vec![1.0]])
        .drive([0.0.into()], 1.0, 0.0)
        .simultaneous(Simultaneous::Together)
        .stop(Stop::new([1.0], 0.0, 0.5))
        .stop(Stop::new([1.0], 0.0, 0.5))
        .stop(Stop::new([-1.0], 0.0, 0.5))
        .build()
        .unwrap();
    let run = made(&structure, &StructureState::new(&[0.0], &[1.0]), 3);
    assert_eq!((run.stop_reason, run.impacts.len()), (StopReason::Simultaneous, 0));
}

/// A body falls into a corner, plastically, and stays there: both stops close at once, whatever
/// rounding is left of its velocity.
#[test]
fn a_body_comes_to_rest_in_a_corner() {
    let two = |of: f64| vec![vec![of, 0.0], vec![0.0, of]];
    for angle in [0.6, 0.28, -0.6] {
        let structure = Structure::builder(two(1.0), two(0.0))
            .static_load([1.0, 1.0])
            .simultaneous(Simultaneous::Together)
            .stop(Stop::new([1.0, 0.0], 0.0, 0.0))
            .stop(Stop::new([angle, f64::sqrt(1.0 - angle * angle)], 0.0, 0.0))
            .build()
            .unwrap();
        let start = StructureState::new(&[-1.5, -1.5], &[1.0, 1.0]);
        let options = RunOptions { max_events: 2_000, ..RunOptions::until(Horizon::Time(6.0)) };
        let run = run(&structure, start, options, &CancelToken::never()).unwrap();
        assert_eq!((run.stop_reason, run.impacts.len()), (StopReason::Rest, 2), "{angle}");
        assert_eq!(run.contacts.last().unwrap().closed.as_slice(), [0, 1], "{angle}");
        let end = &run.final_state.state;
        assert!(end.q.iter().chain(&end.v).all(|x| x.abs() < 1e-13), "{angle}: {end:?}");
    }
}
