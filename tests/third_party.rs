//! Values that others have published for special cases of the system, by simulation alone. The
//! bouncing balls are in tests/simulation/chatter.rs, the near-grazes in tests/near_grazes.rs.

use std::f64::consts::TAU;

use vibroimpact::{
    CancelToken, Contact, Horizon, Run, RunOptions, State, System, SystemBuilder, run,
};

/// A direct impact oscillator against a wall at rest at x1 = gap.
fn wall(gap: f64, restitution: f64) -> SystemBuilder {
    System::builder()
        .mass_ratio(0.0)
        .frequency_ratio(1.0)
        .restitution(restitution)
        .gap(gap)
        .contact(Contact::Direct)
}

fn go(system: &System, x1: f64, v1: f64, options: RunOptions) -> Run {
    let start = State::new(x1, v1, 0.0, 0.0).unwrap();
    run(system, start, options, &CancelToken::never()).unwrap()
}

/// COCO, hspo demo `impact`: omega0 = omega = 1, zeta1 = 0.05, wall at 1, r = 0.8.
fn coco(moment: f64) -> System {
    wall(1.0, 0.8)
        .drive_frequency(1.0)
        .pendulum_damping(0.05)
        .moment_amplitude(moment)
        .build()
        .unwrap()
}

#[test]
fn the_orbit_of_the_impact_oscillator_of_coco() {
    let run = go(&coco(1.0), 0.0, 0.0, RunOptions::periods(400).keep(100));
    assert_eq!(run.period(&CancelToken::never()).label(), "1-1");
    for impact in &run.impacts {
        assert!((impact.v1_pre - 1.695_732_937_594_882).abs() < 1e-14, "{impact:?}");
        assert!((impact.v1_post + 1.356_586_350_075_906).abs() < 1e-14, "{impact:?}");
        assert_eq!((impact.x2, impact.v2_post), (0.0, 0.0));
    }
}

#[test]
fn the_impact_oscillator_of_coco_grazes_where_its_free_response_reaches_the_wall() {
    // Amplitude f1/(2 zeta1) = 1 at f1 = 0.1.
    let below = go(&coco(0.1 * (1.0 - 1e-9)), 0.0, 0.0, RunOptions::periods(600).keep(100));
    assert_eq!(
        (below.impact_count, below.period(&CancelToken::never()).label().as_str()),
        (0, "1-0")
    );
    let above = go(&coco(0.1 * (1.0 + 1e-9)), 0.0, 0.0, RunOptions::periods(600).keep(100));
    assert!(above.impact_count > 0);
}

#[test]
fn the_orbit_of_budd_and_dux_with_one_impact_per_drive_period() {
    let system = wall(0.001, 0.4).drive_frequency(2.0).moment_amplitude(1.0).build().unwrap();
    let run = go(&system, 0.0, 0.0, RunOptions::periods(600).keep(100));
    assert_eq!(run.period(&CancelToken::never()).label(), "1-1");
    for impact in &run.impacts {
        assert!((impact.v1_pre - 2.222_212_222_199_72).abs() < 1e-13, "{impact:?}");
    }
}

/// A ball on a shaken table: gravity 1, r = 0.8, the table swings freely with amplitude `gamma`.
/// Phases of the last impacts in the table's swing, moved away from the wrap-around.
fn phases(gamma: f64) -> Vec<f64> {
    let system = wall(0.0, 0.8)
        .frequency_ratio(0.0)
        .drive_frequency(0.0)
        .moment_amplitude(1.0)
        .build()
        .unwrap();
    // One bounce per swing leaves and comes back with speed pi, where the table moves against the
    // fall with pi (1 - r)/(1 + r). Other motions coexist: start near this one, just after a
    // bounce.
    let v2 = -std::f64::consts::PI * (1.0 - 0.8) / (1.0 + 0.8);
    let x2 = -(gamma * gamma - v2 * v2).sqrt();
    let start = State::new(x2, -std::f64::consts::PI + 1e-3, x2, v2).unwrap();
    let options = RunOptions::until(Horizon::Time(3_000.0 * TAU));
    let run = run(&system, start, options, &CancelToken::never()).unwrap();
    let last = &run.impacts[run.impacts.len() - 40..];
    last.iter().map(|impact| (impact.time + 3.0).rem_euclid(TAU)).collect()
}

#[test]
fn the_shaken_table_doubles_its_period_where_theory_says() {
    // One bounce per swing loses stability at Gamma = 1.070836468247907 for r = 0.8:
    // Gamma^2 = (pi (1 - r)/(1 + r))^2 + (2 (1 + r^2)/(1 + r)^2)^2.
    let r: f64 = 0.8;
    let balance = std::f64::consts::PI * (1.0 - r) / (1.0 + r);
    let critical = balance.hypot(2.0 * (1.0 + r * r) / (1.0 + r).powi(2));
    assert!((critical - 1.070_836_468_247_907).abs() < 1e-15, "{critical}");
    let spread = |phases: &[f64], step: usize| {
        let apart = |w: &[f64]| (w[step] - w[0]).abs();
        phases.windows(step + 1).map(apart).fold(0.0, f64::max)
    };
    let below = phases(critical - 0.005);
    assert!(spread(&below, 1) < 1e-9, "{below:?}");
    let above = phases(critical + 0.005);
    assert!(spread(&above, 1) > 1e-2 && spread(&above, 2) < 1e-9, "{above:?}");
}
