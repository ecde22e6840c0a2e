//! Runs of random structures: they end with a typed reason, penetrate no stop and explain their
//! energy; two bodies that meet head-on move as the system of the same name.

use std::collections::BTreeMap;

use nalgebra::Complex;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use vibroimpact::{
    CancelToken, Contact, Horizon, Run, RunOptions, Simultaneous, State, Stop, StopReason,
    Structure, StructureState, System, run,
};

use crate::support::draws;
use crate::support::random_structures::{Drawn, Units, uniform};

const MOST_EVENTS: u64 = 5_000;

fn made(structure: &Structure, start: &StructureState, periods: i64) -> Run<Structure> {
    let options = RunOptions { max_events: MOST_EVENTS, ..RunOptions::periods(periods) };
    match run(structure, start.clone(), options, &CancelToken::never()) {
        Ok(run) => run,
        Err(error) => panic!("{error}: {structure:?} {start:?}"),
    }
}

/// What a run of a random structure tells.
struct Told {
    reason: StopReason,
    impacts: usize,
    contacts: usize,
    /// Energy that no work explains, over all works.
    unexplained: f64,
    /// The deepest place in a stop, over the coordinates.
    depth: f64,
}

fn told(case: usize, drawn: &Drawn) -> Told {
    let (structure, start) = (drawn.structure(Units::DRAWN), drawn.start(Units::DRAWN));
    let run = made(&structure, &start, 12);
    for row in &run.impacts {
        let size: f64 = row.v_pre.iter().map(|v| v * v).sum();
        assert!(row.impulse_normal >= 0.0, "case {case}");
        let gains = drawn.may_gain() || row.energy_loss >= -1e-12 * size.max(1.0);
        assert!(gains, "case {case}: {row:?}");
    }
    let (from, to) = (run.kept_from(), run.final_state.time);
    let times: Vec<f64> =
        (0..=200).map(|i| (from + (to - from) * f64::from(i) / 200.0).min(to)).collect();
    let mut deepest = 0.0f64;
    for (time, state) in times.iter().zip(run.trajectory(&times).unwrap()) {
        for (j, stop) in structure.stops().iter().enumerate() {
            let place: f64 = stop.normal().iter().zip(&state.q).map(|(n, q)| n * q).sum();
            let own = stop.amplitude() * (structure.drive_frequency() * time + stop.phase()).cos();
            let size: f64 = state.q.iter().map(|q| q.abs()).sum();
            let depth = (place - stop.gap() - own) / size.max(1.0);
            deepest = deepest.max(depth);
            assert!(depth < 1e-12, "case {case}: stop {j} at {time}: {depth}");
        }
    }
    let audit = run.energy_audit(&CancelToken::never()).unwrap();
    let unexplained = audit.residual().abs() / audit.total.max(audit.energy_end).max(1e-3);
    // A rounding of each event, and what is stated of the ends of chatter, twice in v^2.
    let stated: f64 = run.contacts.iter().map(|row| row.error).sum();
    let allowed = MOST_EVENTS as f64 * f64::EPSILON + 2.0 * stated;
    assert!(unexplained < allowed, "case {case}: {audit:?} {:?}: {drawn:?}", run.stop_reason);
    Told {
        reason: run.stop_reason,
        impacts: run.impacts.len(),
        contacts: run.contacts.len(),
        unexplained,
        depth: deepest,
    }
}

#[test]
fn random_structures_end_for_a_reason_and_explain_their_energy() {
    let mut rng = ChaCha8Rng::seed_from_u64(24);
    let drawn: Vec<Drawn> = (0..draws(300, 10_000)).map(|_| Drawn::random(&mut rng)).collect();
    let all: Vec<Told> =
        drawn.par_iter().enumerate().map(|(case, drawn)| told(case, drawn)).collect();
    let mut reasons = BTreeMap::<String, usize>::new();
    for (case, told) in all.iter().enumerate() {
        assert_ne!(told.reason, StopReason::Failed, "case {case}");
        *reasons.entry(format!("{:?}", told.reason)).or_default() += 1;
    }
    let sum = |of: fn(&Told) -> usize| all.iter().map(of).sum::<usize>();
    let most = |of: fn(&Told) -> f64| all.iter().map(of).fold(0.0, f64::max);
    let (impacts, contacts) = (sum(|told| told.impacts), sum(|told| told.contacts));
    println!(
        "{} structures, {impacts} impacts, {contacts} changes of contact, {reasons:?}; energy {:e}, \
         depth {:e}",
        all.len(),
        most(|told| told.unexplained),
        most(|told| told.depth)
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
    for case in 0..draws(1_000, 10_000) {
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
            assert_eq!(a.regime, b.regime as i64, "case {case}, impact {k}");
            impacts += 1;
        }
    }
    println!("{impacts} impacts, worst {worst} eps");
    assert!(impacts > 5_000);
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
