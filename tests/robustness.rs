//! No number, however odd, makes the library panic, hang or hand out what is not a number as a
//! result (docs/robustness.md): every float through the public entry points, and what fuzzing once
//! found.

mod ends;
mod frequencies;
mod huge_forces;
mod interrupts;

use crate::support::random_cases;
use proptest::num::f64::ANY;
use proptest::prelude::*;
use vibroimpact::analysis::basin::{ArrivalStatus, arrive};
use vibroimpact::analysis::shooting::Orbit;
use vibroimpact::impact::{ImpactOutcome, IncrementalError, PreImpact, incremental};
use vibroimpact::tangent::itinerary::{Itinerary, Leg, Node};
use vibroimpact::{
    CancelToken, Clock, Contact, Event, FreeMotion, Horizon, ImpactLaw, Run, RunError, RunOptions,
    Simulation, State, StateError, StopReason, System, SystemBuilder, Workers, detect_period, run,
    run_many,
};
use vibroimpact::{Found, Start, next_contact};

fn paper() -> SystemBuilder {
    System::builder()
        .mass_ratio(0.6)
        .frequency_ratio(2.0)
        .restitution(0.8)
        .gap(0.5)
        .drive_frequency(1.8)
        .moment_amplitude(1.0)
}

fn start() -> State {
    State { x1: 0.0, v1: 0.5, x2: 0.0, v2: 0.0 }
}

fn assert_finite(run: &Run) {
    let states = run.stroboscopic.iter().copied().chain([run.final_state.state.to_array()]);
    let impacts = run.impacts.iter().flat_map(|i| [i.time, i.x1, i.v1_post, i.x2, i.v2_post]);
    let mut all = states.flatten().chain(impacts).chain([run.final_state.time]);
    assert!(all.all(f64::is_finite), "{run:?}");
}

/// Numbers of every kind, and usual ones.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        3 => -2.0..4.0f64,
        1 => ANY,
        1 => prop::sample::select(vec![
            0.0, -0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN, 5e-324,
            f64::MIN_POSITIVE, f64::EPSILON, 1.0, 1e-154, 1e154, 9_007_199_254_740_992.0,
        ]),
    ]
}

fn contact() -> impl Strategy<Value = Contact> {
    prop::sample::select(vec![Contact::Oblique, Contact::Direct])
}

fn law() -> impl Strategy<Value = ImpactLaw> {
    prop::sample::select(vec![
        ImpactLaw::Poisson,
        ImpactLaw::Newton,
        ImpactLaw::Energetic,
        ImpactLaw::Paper,
    ])
}

/// The paper's system with one or two of its numbers exchanged for any others.
fn changed() -> impl Strategy<Value = System> {
    let change = || (prop::sample::select(System::NUMERIC.to_vec()), number());
    (change(), change(), contact(), law()).prop_filter_map(
        "no system",
        |((first, a), (second, b), contact, law)| {
            let system = paper().contact(contact).law(law).build().unwrap();
            system.with(first, a).ok()?.with(second, b).ok()
        },
    )
}

/// Whether a tip that is driven like this turns so often in a local flight that some flights take
/// seconds.
fn is_hectic(system: &System, [x1, v1, x2, v2]: [f64; 4]) -> bool {
    let natural = system.frequency_ratio();
    let loads = system.moment_amplitude().abs()
        + system.force_amplitude().abs()
        + system.static_moment().abs()
        + system.static_force().abs();
    let speed = v1.abs() + v2.abs() + x2.abs() + natural * x1.abs() + 20.0 * loads;
    (100.0..1e80).contains(&speed)
}

proptest! {
    #![proptest_config(random_cases(400, 3_000))]

    #[test]
    fn every_number_makes_a_system_in_range_or_a_named_error(
        values in prop::array::uniform13(number()),
        contact in contact(),
    ) {
        let built = System::builder()
            .mass_ratio(values[0])
            .frequency_ratio(values[1])
            .restitution(values[2])
            .gap(values[3])
            .drive_frequency(values[4])
            .pendulum_damping(values[5])
            .oscillator_damping(values[6])
            .moment_amplitude(values[7])
            .force_amplitude(values[8])
            .friction(values[9])
            .phase(values[10])
            .static_moment(values[11])
            .static_force(values[12])
            .contact(contact)
            .build();
        match built {
            Ok(system) => {
                prop_assert!(values.iter().all(|value| value.is_finite()));
                prop_assert!((0.0..=1.0).contains(&system.restitution()));
                prop_assert!(system.drive_period() > 0.0);
                let text = serde_json::to_string(&system).unwrap();
                prop_assert_eq!(serde_json::from_str::<System>(&text).unwrap(), system);
            }
            Err(error) => prop_assert!(System::NUMERIC.contains(&&*error.name), "{}", error),
        }
    }

    #[test]
    fn every_impact_is_whole_or_none(
        system in changed(),
        state in prop::array::uniform3(number()),
        steps in 1u32..40,
    ) {
        let [x1, v1, v2] = state;
        let stepped = ImpactOutcome::incremental(&system, x1, v1, v2, steps).ok();
        for row in ImpactOutcome::new(&system, x1, v1, v2).ok().into_iter().chain(stepped) {
            let outcome = [
                row.v1_post, row.v2_post, row.separation_velocity, row.impulse_normal,
                row.impulse_tangential, row.energy_loss, row.friction_loss,
                row.effective_restitution,
            ];
            let whole = outcome.iter().all(|value| value.is_finite());
            let none = outcome.iter().all(|value| value.is_nan());
            prop_assert!(if row.regime >= 0 { whole } else { none }, "{:?}", row);
        }
    }

    #[test]
    fn every_search_ends_within_its_span(
        system in changed(),
        state in prop::array::uniform4(number()),
        time in number(),
        span in number(),
        grazed in prop::option::of(number()),
        touching in any::<bool>(),
    ) {
        prop_assume!(!is_hectic(&system, state));
        let motion = FreeMotion::new(&system);
        let [x1, v1, x2, v2] = state;
        let flight = motion.flight(Clock::new(0, time), State { x1, v1, x2, v2 });
        let start = match (grazed, touching) {
            (Some(time), _) => Start::Grazed(time),
            (None, true) => Start::Touching,
            (None, false) => Start::Apart,
        };
        let span = span.min(motion.span());
        if let Found::Contact(touch) | Found::Graze(touch) | Found::Resting(touch) =
            next_contact(&motion, &flight, start, span).found
        {
            prop_assert!(touch.local_time() <= span, "{:?} {}", touch, span);
            prop_assert!(touch.state.to_array().iter().all(|x| x.is_finite()), "{:?}", touch);
        }
    }

    #[test]
    fn every_run_is_finite_or_says_why(
        system in changed(),
        state in prop::array::uniform4(number()),
        horizon in prop_oneof![
            (0i64..12).prop_map(Horizon::Periods),
            number().prop_map(Horizon::Time),
            any::<i64>().prop_map(Horizon::Periods),
            (any::<u64>(), number())
                .prop_map(|(count, max_time)| Horizon::Impacts { count, max_time }),
        ],
        chatter_tolerance in prop_oneof![4 => Just(1e-12), 1 => number()],
    ) {
        prop_assume!(!is_hectic(&system, state));
        let [x1, v1, x2, v2] = state;
        let start = State { x1, v1, x2, v2 };
        let options = RunOptions { max_events: 40, chatter_tolerance, ..RunOptions::until(horizon) };
        match run(&system, start, options, &CancelToken::after(2048)) {
            Ok(run) => assert_finite(&run),
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }

    #[test]
    fn every_section_has_a_period_or_none(
        sections in prop::collection::vec(prop::array::uniform4(number()), 0..60),
        impacts in prop::collection::vec(0u32..3, 60),
    ) {
        let report = detect_period(&sections, &impacts[..sections.len()], &CancelToken::never());
        prop_assert_eq!(report.orbit.is_some(), report.evidence.why().is_none());
        if let Some((m, _)) = report.orbit {
            prop_assert!(m <= sections.len() / 4 && !report.residual.is_nan(), "{:?}", report);
        }
    }
}

/// The fields of a state are open to anything.
#[test]
fn a_state_that_is_no_state_is_refused_wherever_it_comes_in() {
    let system = paper().build().unwrap();
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let bad = State { v1: value, ..start() };
        let is_named = |error: &StateError| {
            assert!(matches!(error, StateError::NotFinite { name, .. } if name == "v1"), "{error}");
        };
        is_named(&Simulation::new(&system, bad).unwrap_err());
        let options = RunOptions::periods(1);
        match run(&system, bad, options, &CancelToken::never()) {
            Err(RunError::State(error)) => is_named(&error),
            other => panic!("{other:?}"),
        }
        let both = [start(), bad];
        match run_many(&system, &both, options, &Workers::default(), &CancelToken::never()) {
            Err(RunError::State(StateError::OneOfSeveral { place: 1, error })) => is_named(&error),
            other => panic!("{other:?}"),
        }
        assert!(Itinerary::follow(&system, bad, 1, 100, &CancelToken::never()).is_err());
        let arrival = arrive(&system, bad, &[], options, &CancelToken::never());
        assert_eq!(arrival.status, ArrivalStatus::Overlap);
    }
}

#[test]
fn a_run_that_fails_leaves_those_beside_it() {
    let system = paper().build().unwrap();
    let fast = State { v1: 1e200, ..start() };
    let starts = [start(), fast, start()];
    let workers = Workers::new(Some(1)).unwrap();
    let runs = run_many(&system, &starts, RunOptions::periods(5), &workers, &CancelToken::never())
        .unwrap();
    assert_eq!(runs.len(), 3);
    assert!(matches!(runs[1], Err(RunError::Simulation { .. })), "{:?}", runs[1]);
    assert!(runs[0].is_ok());
    assert_eq!(runs[0], runs[2]);
}

#[test]
fn a_system_that_is_read_is_validated() {
    let mut text = serde_json::to_value(paper().build().unwrap()).unwrap();
    text["restitution"] = 1.5.into();
    let error = serde_json::from_value::<System>(text.clone()).unwrap_err();
    assert!(error.to_string().contains("restitution"), "{error}");
    text["restitution"] = 0.5.into();
    text["drive_frequency"] = (-0.0).into();
    let read: System = serde_json::from_value(text).unwrap();
    assert_eq!(read.drive_period(), f64::INFINITY);
}

#[test]
fn horizons_beyond_counting_are_refused() {
    let refused = |system: &System, horizon| match run(
        system,
        start(),
        RunOptions::until(horizon),
        &CancelToken::after(2048),
    ) {
        Err(RunError::Parameter(error)) => error.name.to_string(),
        other => panic!("{other:?}"),
    };
    let system = paper().build().unwrap();
    let most = 1i64 << 53;
    assert_eq!(refused(&system, Horizon::Periods(i64::MAX)), "time");
    assert_eq!(refused(&system, Horizon::Periods(most + 2)), "time");
    assert_eq!(refused(&system, Horizon::Periods(most)), "periods");
    let slow = paper().drive_frequency(5e-324).build().unwrap();
    assert_eq!(refused(&slow, Horizon::Periods(1)), "periods");
    assert_eq!(refused(&slow, Horizon::Periods(0)), "periods");
}

#[test]
fn a_horizon_before_the_start_is_the_start() {
    let system = paper().build().unwrap();
    for horizon in [Horizon::Time(-3.0), Horizon::Time(f64::MIN), Horizon::Periods(i64::MIN)] {
        let mut simulation = Simulation::new(&system, start()).unwrap().until(horizon);
        match simulation.next() {
            Some(Ok(Event::Stop(stop))) => {
                assert_eq!((stop.reason, stop.time), (StopReason::Completed, 0.0));
                assert_eq!(stop.state, start());
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_search_over_nothing_finds_nothing() {
    let motion = FreeMotion::new(&paper().build().unwrap());
    let flight = motion.flight(Clock::START, start());
    for span in [0.0, -0.0, -1.0, f64::NAN, f64::NEG_INFINITY] {
        let report = next_contact(&motion, &flight, Start::Apart, span);
        assert_eq!((report.found, report.evaluations), (Found::Clear(0.0), 0));
    }
}

/// The tip passes its lowest point as fast as body 2 its middle, three times touching: the search
/// once led from the top at which it began to one before it.
#[test]
fn no_event_comes_before_the_one_before_it() {
    let system = System::builder()
        .mass_ratio(2.0)
        .frequency_ratio(0.0)
        .restitution(0.0)
        .gap(0.0)
        .drive_frequency(0.0)
        .build()
        .unwrap();
    let start = State { x1: 0.0, v1: 0.0, x2: 1.0, v2: 0.0 };
    let simulation = Simulation::new(&system, start).unwrap().until(Horizon::Time(300.0));
    let mut last = 0.0;
    let mut grazes = 0;
    for event in simulation.max_events(200) {
        let time = match event.unwrap() {
            Event::Impact(impact) => impact.time,
            Event::Graze(graze) => {
                grazes += 1;
                graze.time
            }
            Event::Stop(stop) => stop.time,
            _ => continue,
        };
        assert!(time >= last, "{time} after {last}");
        last = time;
    }
    assert!(grazes > 0);
}

/// The steps of the search once left the flight, and the place to which they led was told as a
/// graze.
#[test]
fn a_graze_lies_in_the_flight() {
    let system = System::builder()
        .mass_ratio(0.0)
        .frequency_ratio(3.0)
        .restitution(1.0)
        .gap(-0.013687342641336642)
        .drive_frequency(0.0)
        .oscillator_damping(1.018516823071641)
        .moment_amplitude(-2.0)
        .friction(1.2335545891508355)
        .phase(7.0)
        .build()
        .unwrap();
    let motion = FreeMotion::new(&system);
    let state = State { x1: 2.0, v1: 2.0, x2: 1.9229847694670184, v2: 2.0 };
    let flight = motion.flight(Clock::START, state);
    for start in [Start::Apart, Start::Touching, Start::Grazed(0.0), Start::Released] {
        let report = next_contact(&motion, &flight, start, motion.span());
        if let Found::Contact(touch) | Found::Graze(touch) | Found::Resting(touch) = report.found {
            assert!(touch.local_time() <= motion.span(), "{start:?} {touch:?}");
            // The others are no starts of this flight.
            assert!(start != Start::Apart || touch.gap.value.abs() < 1e-6, "{touch:?}");
        }
    }
}

/// What turns beyond counting in one local flight is not followed for ever.
#[test]
fn motions_beyond_following_are_failed_computations() {
    let light = System::builder().mass_ratio(2.0).drive_frequency(4.0);
    let whirling = light
        .clone()
        .frequency_ratio(0.0)
        .restitution(0.0)
        .gap(-0.5)
        .moment_amplitude(-2.0)
        .force_amplitude(1.7e50)
        .build()
        .unwrap();
    let sliding = light
        .frequency_ratio(3.0)
        .restitution(1.0)
        .gap(0.0)
        .oscillator_damping(1.5)
        .moment_amplitude(5.0)
        .force_amplitude(-1e154)
        .phase(-7.0)
        .build()
        .unwrap();
    for (system, x2) in [(whirling, -0.4092974268256817), (sliding, 0.1)] {
        let start = State { x1: -2.0, v1: -2.0, x2, v2: -2.0 };
        let cancel = CancelToken::after(1_000);
        let simulation = Simulation::new(&system, start).unwrap().periods(1).max_events(60);
        let last = simulation.cancel_with(&cancel).last();
        assert!(matches!(last, Some(Err(_))), "{last:?}");
        assert!(!cancel.is_cancelled(), "a thousand flights and steps");
    }
}

#[test]
fn small_steps_that_are_none_are_refused() {
    let system = paper().friction(0.5).build().unwrap();
    let pre = PreImpact { cos: 1.0, sin: 0.0, v1: 5e-324, v2: 0.0 };
    match incremental(&system, &pre, 1000) {
        Err(IncrementalError::Parameter(error)) => assert_eq!(error.name, "approach_velocity"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_impact_whose_energy_is_out_of_range_has_no_outcome() {
    let system = paper().friction(0.5).build().unwrap();
    let row = ImpactOutcome::new(&system, 0.5, 1e155, -1e155).unwrap();
    assert_eq!(row.regime, -1);
    assert!(row.v1_post.is_nan() && row.energy_loss.is_nan());
    let row = ImpactOutcome::new(&system, 0.5, 1e150, -1e150).unwrap();
    assert!(row.regime >= 0 && row.energy_loss.is_finite());
}

#[test]
fn clocks_of_an_itinerary_are_counted() {
    let legs = || vec!["impact:frictionless".parse::<Leg>().unwrap()];
    let most = 1i64 << 53;
    let name = |periods, clock| {
        Itinerary::new(legs(), periods, Some(vec![clock]), false).map_err(|error| error.name)
    };
    assert!(name(most, -most).is_ok());
    assert_eq!(name(most + 1, 0).unwrap_err(), "periods");
    assert_eq!(name(1, most + 1).unwrap_err(), "clocks");
    assert_eq!(name(1, i64::MIN).unwrap_err(), "clocks");
    let system = paper().build().unwrap();
    assert!(Itinerary::follow(&system, start(), i64::MAX, 100, &CancelToken::never()).is_err());
}

#[test]
fn a_leg_that_is_none_has_no_state() {
    let system = paper().build().unwrap();
    let itinerary = Itinerary::new(vec![Leg::Circuit], 1, None, false).unwrap();
    let nodes = [Node { x1: 0.1, v1: 0.2, v2: 0.3, time: 0.4 }];
    let orbit = Orbit::new(&system, &itinerary, &nodes).unwrap();
    let state = orbit.state_in_leg(0, 0.0).unwrap();
    assert_eq!(state.to_array(), [0.1, 0.2, 0.4, 0.3]);
    assert_eq!(orbit.state_in_leg(1, 0.0), None);
    assert_eq!(orbit.state_in_leg(usize::MAX, f64::NAN), None);
}
