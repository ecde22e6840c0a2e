//! Motions that can never meet are jumped over, by a bound that holds for ever
//! (src/search/scan.rs); what the bound does not prove is searched.

use vibroimpact::{
    CancelToken, Clock, FreeMotion, RunOptions, State, StopReason, System, SystemBuilder, run,
};

fn system() -> SystemBuilder {
    System::builder()
        .mass_ratio(0.6)
        .frequency_ratio(3f64.sqrt())
        .restitution(0.8)
        .drive_frequency(5f64.sqrt())
        .moment_amplitude(0.3)
}

fn start() -> State {
    State::new(0.1, 0.2, 0.05, 0.1).unwrap()
}

/// Highest value that sin x1 - x2 comes near to: its frequencies have no common measure.
fn highest() -> f64 {
    let omega = system().gap(1.0).build().unwrap().drive_frequency();
    let steady = 0.3 / (3.0 - omega * omega);
    let free = (0.1f64 - steady).hypot(0.2 / 3f64.sqrt());
    (free + steady.abs()).sin() + 0.05f64.hypot(0.1)
}

#[test]
fn the_bound_is_sharp_without_damping() {
    let options = RunOptions::periods(20_000).keep(0);
    let beyond = system().gap(highest() * (1.0 + 1e-5)).build().unwrap();
    let free = run(&beyond, start(), options, &CancelToken::never()).unwrap();
    assert_eq!((free.evaluations, free.impact_count), (0, 0));
    let within = system().gap(highest() * (1.0 - 1e-3)).build().unwrap();
    let met = run(&within, start(), options, &CancelToken::never()).unwrap();
    assert!(met.impact_count > 0);
}

#[test]
fn steady_responses_that_go_together_are_taken_together() {
    // Each by itself would meet: both bodies follow slow drives almost in phase.
    let slow = || system().drive_frequency(0.3).moment_amplitude(1.6).force_amplitude(0.4);
    let built = slow().gap(0.3).pendulum_damping(0.05).oscillator_damping(0.05).build().unwrap();
    let settled = |periods| {
        let options = RunOptions::periods(periods).keep(0);
        run(&built, State::new(0.0, 0.0, 0.0, 0.0).unwrap(), options, &CancelToken::never())
            .unwrap()
    };
    let (short, long) = (settled(100), settled(100_000));
    assert_eq!(short.stop_reason, StopReason::Completed);
    assert_eq!(short.impact_count, long.impact_count);
    // Proven once, for all that follows.
    assert_eq!(short.evaluations, long.evaluations);
}

#[test]
fn sections_of_a_long_flight_are_exact() {
    let free = system().gap(2.0).build().unwrap();
    let kept =
        run(&free, start(), RunOptions::periods(30_000).keep(3), &CancelToken::never()).unwrap();
    let motion = FreeMotion::new(&free);
    let flight = motion.flight(Clock::START, start());
    for (row, periods) in kept.stroboscopic.iter().zip([29_998, 29_999, 30_000]) {
        let exact = motion.state_after_periods(&flight, periods, 0.0).to_array();
        for (value, exact) in row.iter().zip(exact) {
            assert!((value - exact).abs() <= 4.0 * f64::EPSILON, "{row:?} {exact:?}");
        }
    }
}

#[test]
fn the_caller_is_asked_now_and_then() {
    let free = system().gap(2.0).build().unwrap();
    let options = RunOptions::periods(1_000_000_000).keep(0);
    let cut = run(&free, start(), options, &CancelToken::after(3)).unwrap();
    assert_eq!(cut.stop_reason, StopReason::Interrupted);
}
