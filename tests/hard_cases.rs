//! Cases that once hung, failed or came out wrong.

#![allow(clippy::unwrap_used)]

use vibroimpact::impact::{PreImpact, RegimeKind, resolve};
use vibroimpact::{
    Contact, Event, Horizon, Run, RunOptions, Simulation, State, StopReason, System,
};

fn paper() -> vibroimpact::SystemBuilder {
    System::builder()
        .mass_ratio(0.6)
        .frequency_ratio(2.0)
        .restitution(0.8)
        .gap(0.5)
        .drive_frequency(1.25)
        .moment_amplitude(1.0)
}

fn go(system: &System, start: [f64; 4], options: RunOptions) -> Run {
    let [x1, v1, x2, v2] = start;
    let start = State::new(x1, v1, x2, v2).unwrap();
    vibroimpact::run(system, start, options, &mut || true).unwrap()
}

/// Both bodies swing alike, apart by some units in the last place: the gap's hump is so flat that
/// every step off its top ends at rounding level.
#[test]
fn a_flat_top_at_rounding_level_is_passed() {
    for gap in [1e-9, 1e-12] {
        let system = paper()
            .frequency_ratio(1.0)
            .gap(gap)
            .moment_amplitude(0.0)
            .contact(Contact::Direct)
            .build()
            .unwrap();
        for k in [10.0, 20.0, 40.0, 48.0, 50.0, 56.0, 60.0, 64.0, 70.0, 100.0] {
            let start = [1.0, 0.0, 1.0 - gap + k * f64::EPSILON, 0.0];
            let run = go(&system, start, RunOptions::periods(5).keep(5));
            // Contact at rounding level may begin; nothing may repeat without end.
            let ended = run.stop_reason == StopReason::Completed;
            assert!(ended, "gap {gap} k {k}: {:?}", run.stop_reason);
            assert!(run.grazes.len() < 50, "gap {gap} k {k}: {} grazes", run.grazes.len());
            assert!(run.evaluations < 100_000, "gap {gap} k {k}: {}", run.evaluations);
        }
    }
}

#[test]
fn a_start_just_above_contact_falls_onto_it() {
    let system = paper().build().unwrap();
    let start = State::new(0.0, 0.0, -0.5 + 3e-15, 0.0).unwrap();
    let mut simulation = Simulation::new(&system, start).unwrap().periods(1);
    let Some(Ok(Event::Impact(impact))) = simulation.next() else { panic!("no impact") };
    // g = -3e-15, g'' = f1 + x2 = 0.5: t = sqrt(2 * 3e-15/0.5), u = t/2.
    let gap = system.gap_function(&start);
    let time = (-2.0 * gap / 0.5).sqrt();
    assert!((impact.time / time - 1.0).abs() < 1e-6, "{}", impact.time);
    assert!((impact.impact.approach_velocity / (0.5 * time) - 1.0).abs() < 1e-6);
}

#[test]
fn slip_that_cannot_go_on_sticks_however_slow_it_is() {
    let system = paper().friction(3.0).build().unwrap();
    for v1 in [1e-300, 5e-324] {
        let pre = PreImpact { cos: 0.1, sin: 0.995, v1: -v1, v2: -1.0 };
        let impact = resolve(&system, &pre).unwrap();
        assert_eq!(impact.regime.kind(), RegimeKind::StickInApproach);
        let energy = |v1: f64, v2: f64| 0.5 * v1 * v1 + 0.5 * v2 * v2 / 0.6;
        assert!(energy(impact.v1_post, impact.v2_post) <= energy(pre.v1, pre.v2));
    }
}

#[test]
fn times_beyond_counting_and_horizons_in_the_past_are_refused() {
    let system = paper().build().unwrap();
    let start = State::new(0.0, 0.5, 0.0, 0.0).unwrap();
    let options = RunOptions::until(Horizon::Time(1e25));
    assert!(vibroimpact::run(&system, start, options, &mut || true).is_err());
    let run = go(&system, start.to_array(), RunOptions::periods(10));
    assert!(run.resume(RunOptions::periods(5), &mut || true).is_err());
    assert!(run.resume(RunOptions::periods(11), &mut || true).is_ok());
}

#[test]
fn a_shifted_section_has_the_same_label() {
    let system = paper().friction(0.5).drive_frequency(1.545).build().unwrap();
    let options = RunOptions { section_phase: 1.0, ..RunOptions::periods(600).keep(100) };
    assert_eq!(go(&system, [0.0, 0.5, 0.0, 0.0], options).period().label(), "chaotic");
}

#[test]
fn a_drifting_rotor_far_from_zero_does_not_repeat() {
    let system = paper().frequency_ratio(0.0).gap(5.0).build().unwrap();
    let far = std::f64::consts::TAU * 1e6 - 0.5;
    let run = go(&system, [far, 1e-3, 0.0, 0.0], RunOptions::periods(200).keep(100));
    assert!(run.return_report().orbit.is_none());
}
