//! What is measured of a run can be ended by its caller, too.

use vibroimpact::tangent::itinerary::{Itinerary, ItineraryError};
use vibroimpact::{
    CancelToken, ImpactLaw, Kind, RunError, RunOptions, SimulationError, State, StopReason, System,
    run,
};

use super::{paper, start};

/// More asks than any of these calls makes.
const MANY: u64 = 1 << 40;

/// On a torus the time to look for a period grows with the square of its sections: minutes for a
/// million.
#[test]
fn the_search_for_a_period_can_be_ended() {
    let torus = paper().gap(3.0).frequency_ratio(2f64.sqrt()).build().unwrap();
    let run = run(&torus, start(), RunOptions::periods(1_000_000), &CancelToken::never()).unwrap();
    let report = run.period(&CancelToken::after(3));
    assert!(report.is_interrupted() && report.orbit.is_none());
    assert_eq!((report.kind, report.label().as_str()), (Kind::Unresolved, "unresolved"));
}

#[test]
fn the_measurement_of_a_growth_can_be_ended() {
    let chaotic = paper().drive_frequency(2.6).restitution(1.0).build().unwrap();
    let run =
        run(&chaotic, start(), RunOptions::periods(2_000).keep(20), &CancelToken::never()).unwrap();
    let whole = run.period(&CancelToken::never());
    assert!(!whole.is_interrupted());
    let counted = CancelToken::after(MANY);
    assert_eq!(run.period(&counted), whole);
    let asks = MANY - counted.asks_left();
    assert!(asks > 100, "{asks}");
    for part in 1..=20 {
        assert!(run.period(&CancelToken::after(asks * part / 20)).is_interrupted());
    }
    assert_eq!(run.period(&CancelToken::after(asks + 1)), whole);
}

#[test]
fn a_motion_that_is_followed_can_be_left() {
    let lossless = paper().restitution(1.0).build().unwrap();
    let cancel = CancelToken::after(4_000);
    let followed = Itinerary::follow(&lossless, start(), 1_000_000, 1_000_000_000, &cancel);
    assert_eq!(followed.unwrap_err(), ItineraryError::Stopped(StopReason::Interrupted));
}

/// The tip slides on a wall that comes to rest at x1 = 0: once both lie within rounding of the line
/// where friction changes its side, a velocity against the mode by rounding led to steps of no
/// length, one after the other.
#[test]
fn a_slide_that_dies_on_the_line_of_friction_goes_on() {
    let system = System::builder()
        .mass_ratio(0.0)
        .frequency_ratio(1.423_679_742_339_847_7)
        .restitution(0.0)
        .gap(0.0)
        .drive_frequency(0.080_112_360_330_073_56)
        .pendulum_damping(0.3)
        .oscillator_damping(0.02)
        .moment_amplitude(1.665_365_719_640_424_6)
        .friction(0.7)
        .build()
        .unwrap();
    let start = State { x1: -1.0, v1: 0.654_491_906_403_750_7, x2: 0.5, v2: 0.1 };
    let cancel = CancelToken::after(200_000);
    let run = run(&system, start, RunOptions::periods(40), &cancel).unwrap();
    assert_eq!(run.stop_reason, StopReason::Completed);
}

/// Elastic bounces, 1,800 in a drive period: followed over tens of thousands of periods they took a
/// minute.
#[test]
fn a_growth_is_measured_over_a_million_impacts_at_most() {
    let system = System::builder()
        .mass_ratio(0.074_063_337_977_084_31)
        .frequency_ratio(2.767_299_338_244_233_5)
        .restitution(1.0)
        .gap(-0.169_611_863_904_130_3)
        .drive_frequency(1.074_636_776_462_990_3)
        .pendulum_damping(1.263_335_703_937_548)
        .oscillator_damping(0.711_963_457_231_502_1)
        .moment_amplitude(4.453_438_187_346_649_5)
        .force_amplitude(-0.181_150_055_823_442_46)
        .friction(2.716_695_410_397_751)
        .law(ImpactLaw::Energetic)
        .build()
        .unwrap();
    let start = State { x1: 0.0, v1: 0.5, x2: 1.0, v2: 0.0 };
    let run = run(&system, start, RunOptions::periods(8), &CancelToken::never()).unwrap();
    assert!(run.impact_count > 14_000 && run.stop_reason == StopReason::Completed);
    let counted = CancelToken::after(MANY);
    let report = run.period(&counted);
    // One for each flight: the growth over some hundred periods.
    let asks = MANY - counted.asks_left();
    assert!((100_000..1_200_000).contains(&asks), "{asks}");
    // It shrinks, and the motion returns in the same periods: 1-1800.
    let further = report.evidence.further();
    assert!((96..500).contains(&further), "{further}");
    assert_eq!(report.orbit.unwrap().0, 1, "{report:?}");
}

/// The gap of a tip at x1 = -1e154 has no digits: whether the bodies slide or part is rounding, and
/// time was moved on by 7e-16 each time.
#[test]
fn moves_without_an_end_are_a_stalled_search() {
    let system = System::builder()
        .mass_ratio(0.007_782_101_167_315_175)
        .frequency_ratio(0.0)
        .restitution(1.0)
        .gap(0.997_138_933_394_369_4)
        .drive_frequency(4.0)
        .moment_amplitude(-2.0)
        .force_amplitude(-2.360_069_566_848_285_7e116)
        .friction(0.509_086_747_539_482_7)
        .phase(6.976_073_853_665_98)
        .build()
        .unwrap();
    let start = State { x1: -1e154, v1: std::f64::consts::PI, x2: 3.01331437259e-312, v2: -1.5 };
    let cancel = CancelToken::after(200_000);
    let failure = run(&system, start, RunOptions::periods(1), &cancel).unwrap_err();
    let RunError::Simulation { error, done } = failure else { panic!("{failure}") };
    assert!(matches!(error, SimulationError::SearchStalled { time, .. } if time < 1e-6), "{error}");
    // Not at anybody's wish.
    assert_eq!(done.stop_reason, StopReason::Failed);
    assert!(!cancel.is_cancelled());
}

/// A free rotor under a load of period 1e5 turns 1e5 times in a unit of time: a search of seconds
/// for each of its flights, after which its caller is asked.
#[test]
fn a_search_that_crawls_can_be_ended() {
    let system = System::builder()
        .mass_ratio(0.001)
        .frequency_ratio(0.0)
        .restitution(0.0)
        .gap(1.5)
        .drive_frequency(6.1e-5)
        .moment_amplitude(-2.0)
        .build()
        .unwrap();
    let start = State { x1: -2.0, v1: 2e4, x2: 1.0, v2: 0.0 };
    let run = run(&system, start, RunOptions::periods(1), &CancelToken::after(4)).unwrap();
    assert_eq!(run.stop_reason, StopReason::Interrupted);
    // Three searches.
    assert!(run.evaluations < 300_000, "{}", run.evaluations);
}
