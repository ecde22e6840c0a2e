//! What must hold in every run of every system: bodies apart between impacts, separating after
//! them, energy where nothing dissipates, a bounded amount of work.

use vibroimpact::{Event, Horizon, RunOptions, Simulation, StopReason};

use super::{Draw, go, paper, paper_start};

#[test]
fn the_bodies_never_overlap() {
    let mut draw = Draw::new(20);
    let (mut samples, mut worst) = (0u64, f64::MIN);
    for i in 0..200 {
        let system = draw.system();
        let start = draw.start(&system);
        let run = go(&system, start, RunOptions::periods(20));
        let end = run.final_state.time;
        let times: Vec<f64> = (0..=1000).map(|j| (end * f64::from(j) / 1000.0).min(end)).collect();
        for [x1, v1, x2, v2] in run.trajectory(&times).unwrap() {
            let gap = system.gap_function(&super::state(x1, v1, x2, v2));
            let allowed = 1e-12 * x1.abs().max(x2.abs()).max(1.0);
            assert!(gap <= allowed, "system {i}: g = {gap:e} at {x1} {x2}, {system:?}");
            worst = worst.max(gap);
            samples += 1;
        }
    }
    println!("{samples} samples, largest gap function {worst:e}");
}

#[test]
fn the_bodies_separate_after_every_impact() {
    let mut draw = Draw::new(21);
    let mut count = 0;
    for _ in 0..200 {
        let system = draw.system();
        let start = draw.start(&system);
        for event in Simulation::new(&system, start).unwrap().periods(50) {
            if let Event::Impact(e) = event.unwrap() {
                assert!(e.impact.approach_velocity > 0.0 && e.impact.separation_velocity <= 0.0);
                assert!(e.impact.energy_loss >= 0.0 && e.impact.impulse_normal >= 0.0);
                let rate = system.approach_velocity(&e.post);
                let speed = e.post.v1.abs().max(e.post.v2.abs()).max(1.0);
                assert!(rate <= 8.0 * f64::EPSILON * speed, "{rate:e} {e:?}");
                count += 1;
            }
        }
    }
    println!("{count} impacts");
    assert!(count > 5000);
}

#[test]
fn energy_is_kept_where_nothing_takes_it() {
    let system = paper(1.0).moment_amplitude(0.0).restitution(1.0).gap(0.1).build().unwrap();
    let energy = |[x1, v1, x2, v2]: [f64; 4]| {
        0.5 * (v1 * v1 + 4.0 * x1 * x1) + 0.5 * (v2 * v2 + x2 * x2) / 0.6
    };
    let start = super::state(-0.3, 0.9, 0.2, -0.4);
    let horizon = Horizon::Impacts { count: 100_000, max_time: 1e7 };
    let mut options = RunOptions::until(horizon);
    options.max_events = 1_000_000;
    let run = go(&system, start, options);
    assert_eq!((run.stop_reason, run.impacts.len()), (StopReason::Completed, 100_000));
    let before = energy(start.to_array());
    let worst = run
        .impacts
        .iter()
        .map(|i| (energy([i.x1, i.v1_post, i.x2, i.v2_post]) / before - 1.0).abs())
        .fold(0.0, f64::max);
    println!("energy off by {worst:e} at most in 1e5 impacts");
    assert!(worst < 1e-11, "{worst:e}");
}

#[test]
fn energy_never_grows_without_forcing() {
    let mut draw = Draw::new(22);
    for _ in 0..50 {
        let forced = draw.system();
        let system = forced
            .with("moment_amplitude", 0.0)
            .and_then(|system| system.with("force_amplitude", 0.0))
            .unwrap();
        let start = draw.start(&system);
        let w2 = system.frequency_ratio().powi(2);
        let energy = |x1: f64, v1: f64, x2: f64, v2: f64| {
            0.5 * (v1 * v1 + w2 * x1 * x1) + 0.5 * (v2 * v2 + x2 * x2) / system.mass_ratio()
        };
        let first = energy(start.x1, start.v1, start.x2, start.v2);
        let mut last = first;
        for i in &go(&system, start, RunOptions::periods(40)).impacts {
            let arriving = energy(i.x1, i.v1_pre, i.x2, i.v2_pre);
            let leaving = energy(i.x1, i.v1_post, i.x2, i.v2_post);
            let rounding = 1e-13 * first;
            assert!(arriving <= last + rounding && leaving <= arriving + rounding);
            assert!((arriving - leaving - i.energy_loss).abs() <= rounding);
            last = leaving;
        }
    }
}

#[test]
fn a_flight_takes_a_bounded_number_of_evaluations() {
    let mut draw = Draw::new(23);
    let (mut evaluations, mut flights, mut worst) = (0.0, 0.0, 0f64);
    for _ in 0..200 {
        let system = draw.system();
        let start = draw.start(&system);
        let run = go(&system, start, RunOptions::periods(100));
        // Impacts, and local flights without one: at least one per two turns of the fastest.
        let fastest = system.frequency_ratio().max(system.drive_frequency()).max(1.0);
        let local = run.final_state.time * fastest / (2.0 * std::f64::consts::TAU);
        let here = run.impact_count as f64 + local;
        evaluations += run.evaluations as f64;
        flights += here;
        worst = worst.max(run.evaluations as f64 / here);
    }
    println!("evaluations per flight: mean {:.2}, worst system {worst:.2}", evaluations / flights);
    assert!(evaluations / flights < 30.0);
    assert!(worst < 100.0);
    // The same bits take the same work.
    let system = paper(1.8).build().unwrap();
    let count = || go(&system, paper_start(), RunOptions::periods(100)).evaluations;
    assert_eq!(count(), count());
}
