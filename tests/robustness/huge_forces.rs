//! Forces near the end of the range of floats: errors or numbers, in all that a run hands out.

use crate::support::random_cases;
use proptest::prelude::*;
use vibroimpact::{
    CancelToken, Contact, Event, Horizon, ImpactLaw, Run, RunError, RunOptions, Simulation,
    SimulationError, State, StopReason, System, SystemBuilder, run,
};

use super::{assert_finite, contact, law, paper, start};

#[test]
fn a_run_that_stops_in_a_state_out_of_range_has_failed() {
    let system = paper().force_amplitude(f64::MAX).build().unwrap();
    match run(&system, start(), RunOptions::periods(5), &CancelToken::never()) {
        Err(RunError::Simulation { error: SimulationError::NotFinite { .. }, .. }) => {}
        other => panic!("{other:?}"),
    }
    // Of no events there is its start.
    let options = RunOptions { max_events: 0, ..RunOptions::periods(5) };
    let none = run(&system, start(), options, &CancelToken::never()).unwrap();
    assert_eq!((none.stop_reason, none.final_state.state), (StopReason::EventCap, start()));
}

#[test]
fn a_run_of_no_length_is_where_it_starts() {
    let system = System::builder()
        .mass_ratio(0.0)
        .frequency_ratio(0.0)
        .restitution(0.7)
        .gap(1.0)
        .drive_frequency(4.0)
        .pendulum_damping(1.5)
        .oscillator_damping(1.5)
        .force_amplitude(f64::MAX)
        .friction(3.0)
        .law(ImpactLaw::Newton)
        .build()
        .unwrap();
    let start = State { x1: 2.0, v1: 2.0, x2: 2f64.sin() - 1.0, v2: -2.0 };
    let run = run(&system, start, RunOptions::periods(0), &CancelToken::never()).unwrap();
    let end = run.final_state.state.to_array();
    assert_eq!(run.trajectory(&[0.0]), Some(vec![end]));
}

/// Near the start of a flight motions are Taylor series, whose omega^n leaves the range of floats.
#[test]
fn a_drive_beyond_counting_moves_bodies_by_numbers() {
    let swings = |damping: f64, frequency: f64| {
        let system = paper().restitution(0.0).gap(-0.5).drive_frequency(frequency);
        system.pendulum_damping(damping).oscillator_damping(0.5).force_amplitude(2.0).build()
    };
    let start = State { x1: 0.0, v1: -0.7, x2: 0.8, v2: -0.7 };
    for frequency in [1e15, 1e20, 1e25, 1e30, 9.7e44, 1e50] {
        for damping in [0.0, 0.3, 1.0, 1.3] {
            let system = swings(damping, frequency).unwrap();
            let options = RunOptions { max_events: 23, ..RunOptions::periods(84) };
            let run = run(&system, start, options, &CancelToken::never()).unwrap();
            look(&run);
            // Accelerations of some 10 have hardly had time to act.
            let time = 84.0 * system.drive_period();
            let end = run.final_state.state;
            let change = 20.0 * time + 1e-15;
            assert!((end.x1 - time * start.v1).abs() <= change * time, "{frequency:e} {end:?}");
            assert!((end.v1 - start.v1).abs() < change && (end.v2 - start.v2).abs() < change);
        }
    }
}

/// Panics unless a run's tables are in order, and it is made of numbers wherever one looks.
fn look(run: &Run) {
    assert_finite(run);
    assert!(run.events.windows(2).all(|e| e[0].time <= e[1].time), "{:?}", run.events);
    let numbers = |values: &[f64]| assert!(values.iter().all(|x| x.is_finite()), "{run:?}");
    for i in &run.impacts {
        numbers(&[i.impulse_normal, i.impulse_tangential, i.energy_loss]);
    }
    let (from, to) = (run.kept_from(), run.final_state.time);
    let parts = (0..=10).map(|i| (from + (to - from) * f64::from(i) / 10.0).clamp(from, to));
    let events = run.events.iter().map(|event| event.time.clamp(from, to));
    let times: Vec<f64> = parts.chain(events).collect();
    numbers(&run.trajectory(&times).unwrap().concat());
    for force in run.contact_forces(&times).unwrap() {
        numbers(&[force.normal, force.tangential]);
    }
    numbers(&[run.time_in_contact()]);
    let audit = run.energy_audit(&CancelToken::never()).unwrap();
    let sums = [audit.energy_start, audit.energy_end, audit.moment, audit.total, audit.residual()];
    let whole = sums.iter().all(|x| x.is_finite());
    assert!(whole || sums.iter().all(|x| x.is_nan()), "{audit:?}");
}

fn whole_or_failed(system: &System, start: State, options: RunOptions) -> Option<SimulationError> {
    match run(system, start, options, &CancelToken::after(2048)) {
        Ok(run) => {
            look(&run);
            None
        }
        Err(RunError::Simulation { error, done }) => {
            look(&done);
            Some(error)
        }
        Err(error) => panic!("{error}"),
    }
}

fn light() -> SystemBuilder {
    System::builder().mass_ratio(2.0).frequency_ratio(3.0).restitution(0.0).gap(0.0)
}

fn capped(max_events: u64) -> RunOptions {
    RunOptions { max_events, ..RunOptions::periods(2) }
}

/// The series of such slides are no numbers: they were taken for Painleve points, behind states,
/// sections and forces that were NaN.
#[test]
fn a_slide_beyond_counting_is_a_failed_computation() {
    let stuck = light()
        .gap(1.0)
        .drive_frequency(4.0)
        .pendulum_damping(1.5)
        .moment_amplitude(-2.0)
        .force_amplitude(-1e154)
        .friction(3.0)
        .phase(-6.9455)
        .law(ImpactLaw::Newton)
        .build()
        .unwrap();
    let start = State { x1: -1.5, v1: -1.5, x2: -1.5, v2: -1.5 };
    let error = whole_or_failed(&stuck, start, capped(13));
    assert!(matches!(error, Some(SimulationError::NotFinite { time, .. }) if time > 0.5));
    let pressed = light()
        .drive_frequency(3.4)
        .oscillator_damping(0.2)
        .moment_amplitude(-1.9)
        .force_amplitude(-2e139)
        .build()
        .unwrap();
    let start = State { x1: 1.8, v1: 0.9, x2: 1.8f64.sin(), v2: -2.0 };
    let options = RunOptions { section_phase: 0.7, ..capped(56) };
    let error = whole_or_failed(&pressed, start, options);
    assert!(matches!(error, Some(SimulationError::NotFinite { .. })), "{error:?}");
}

/// Other than loads out of range: x1 cannot resolve how so light a tip passes the end of its reach.
#[test]
fn a_slide_past_the_end_of_the_reach_is_still_a_painleve_point() {
    let system = System::builder()
        .mass_ratio(1e-30)
        .frequency_ratio(0.5)
        .restitution(0.0)
        .gap(0.0)
        .drive_frequency(1.0)
        .moment_amplitude(0.3)
        .force_amplitude(-3.0)
        .build()
        .unwrap();
    let x1 = -1.2f64;
    let start = State { x1, v1: -1.0, x2: x1.sin(), v2: -x1.cos() };
    let run = run(&system, start, RunOptions::periods(1), &CancelToken::never()).unwrap();
    assert_eq!(run.stop_reason, StopReason::Painleve);
    look(&run);
}

/// The search for the top of a graze once went back to before the graze it went on from.
#[test]
fn a_graze_comes_not_before_the_one_before_it() {
    let system = System::builder()
        .mass_ratio(1.891890616445433)
        .frequency_ratio(0.9116264601075915)
        .restitution(0.0)
        .gap(-0.5)
        .drive_frequency(1.3162153260477165)
        .pendulum_damping(0.6909802158412589)
        .oscillator_damping(1.1702977086612318)
        .moment_amplitude(-1.790645983753773e154)
        .force_amplitude(-3.6394455247193674e153)
        .phase(-6.796833195040233)
        .contact(Contact::Direct)
        .build()
        .unwrap();
    let start = State { x1: -2.0, v1: 2.0, x2: -0.5816462449871099, v2: 0.27167397402989657 };
    assert_eq!(whole_or_failed(&system, start, capped(34)), None);
}

/// An angle and a speed whose products are no numbers gave a graze at no time.
#[test]
fn a_graze_that_is_no_number_is_a_failed_computation() {
    let system = light()
        .mass_ratio(0.0)
        .frequency_ratio(0.0)
        .restitution(0.2929579613946746)
        .drive_frequency(0.0)
        .friction(3.0)
        .law(ImpactLaw::Energetic)
        .build()
        .unwrap();
    let v2 = 0.34705882352941186;
    let start = State { x1: -1e154, v1: 1.2817050218750178e65, x2: v2, v2 };
    for event in Simulation::new(&system, start).unwrap().until(Horizon::Time(10.0)).max_events(50)
    {
        match event {
            Ok(Event::Graze(graze)) => panic!("{graze:?}"),
            Ok(_) => {}
            Err(error) => assert!(matches!(error, SimulationError::NotFinite { .. }), "{error}"),
        }
    }
}

/// A run that fails ends in the last state that is one.
#[test]
fn what_a_failed_run_has_done_ends_in_range() {
    let system = System::builder()
        .mass_ratio(0.0)
        .frequency_ratio(0.0)
        .restitution(0.9562319715784495)
        .gap(1.0)
        .drive_frequency(1.6602212094634483)
        .pendulum_damping(1.1217102810788397)
        .oscillator_damping(1.1997454100652785)
        .moment_amplitude(-4.2246737112544926e307)
        .force_amplitude(1.2936550262642315)
        .phase(7.0)
        .contact(Contact::Direct)
        .law(ImpactLaw::Newton)
        .build()
        .unwrap();
    let start = State {
        x1: -0.3889671974916298,
        v1: 0.4807119610939852,
        x2: -0.8772745047109283,
        v2: -0.1288928805955183,
    };
    match whole_or_failed(&system, start, RunOptions { keep: Some(1), ..RunOptions::periods(4) }) {
        Some(SimulationError::NotFinite { state, .. }) => {
            assert!(state.iter().all(|x| x.is_finite()), "{state:?}");
        }
        other => panic!("{other:?}"),
    }
}

/// Its square is no number.
#[test]
fn a_wall_is_pressed_on_by_a_force_of_1e154() {
    let system = System::builder()
        .mass_ratio(0.0)
        .frequency_ratio(0.0)
        .restitution(0.712121114694315)
        .gap(0.0)
        .drive_frequency(0.5)
        .oscillator_damping(0.5622521796105833)
        .force_amplitude(1.437287808926673e154)
        .phase(5.384956786719071)
        .build()
        .unwrap();
    let start = State { x1: 0.0, v1: 0.0, x2: 0.0, v2: 0.0 };
    assert_eq!(whole_or_failed(&system, start, capped(1)), None);
}

fn huge() -> impl Strategy<Value = f64> {
    (100.0..300.0f64, any::<bool>())
        .prop_map(|(power, negative)| 10f64.powf(power) * if negative { -1.0 } else { 1.0 })
}

proptest! {
    #![proptest_config(random_cases(400, 3_000))]

    #[test]
    fn every_huge_force_gives_numbers_or_an_error(
        forces in (prop_oneof![-2.0..5.0, huge()], huge(), any::<bool>()),
        masses in (prop_oneof![3 => 0.0..2.0, 1 => Just(0.0)], 0.0..3.0, 0.0..1.0, -0.5..1.0),
        drive in (0.5..4.0, -7.0..7.0f64),
        damping in (0.0..1.5, 0.0..1.5, prop_oneof![0.0..3.0, Just(0.0)]),
        kind in (contact(), law()),
        state in (-2.0..2.0f64, -2.0..2.0, prop_oneof![0.0..1.0, Just(0.0)], -2.0..2.0),
        max_events in 0u64..40,
    ) {
        let (one, other, swap) = forces;
        let (moment, force) = if swap { (other, one) } else { (one, other) };
        let direct = kind.0 == Contact::Direct;
        let system = System::builder()
            .mass_ratio(masses.0)
            .frequency_ratio(masses.1)
            .restitution(masses.2)
            .gap(masses.3)
            .drive_frequency(drive.0)
            .phase(drive.1)
            .pendulum_damping(damping.0)
            .oscillator_damping(damping.1)
            .friction(if direct { 0.0 } else { damping.2 })
            .moment_amplitude(moment)
            .force_amplitude(force)
            .contact(kind.0)
            .law(kind.1)
            .build()
            .unwrap();
        let (x1, v1, apart, v2) = state;
        let tip = if direct { x1 } else { x1.sin() };
        let start = State { x1, v1, x2: tip - masses.3 + apart, v2 };
        whole_or_failed(&system, start, capped(max_events));
    }
}
