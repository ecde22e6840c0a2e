//! Starts that are refused, and every way a run can end but by chatter.

use vibroimpact::impact::RegimeKind;
use vibroimpact::{
    CancelToken, Contact, Event, Horizon, ImpactLaw, RunError, RunOptions, Simulation,
    SimulationError, State, StateError, StopReason, System, run,
};

use super::{ball, go, paper, paper_start, state, until};

fn refused(start: State) -> StateError {
    let system = paper(1.8).build().unwrap();
    let error = Simulation::new(&system, start).unwrap_err();
    let by_run = run(&system, start, RunOptions::periods(1), &CancelToken::never());
    assert_eq!(by_run.unwrap_err(), RunError::State(error.clone()));
    error
}

#[test]
fn a_start_beyond_contact_is_refused_with_its_gap() {
    let contact = 0.3f64.sin() - 0.5;
    match refused(state(0.3, 0.0, contact - 0.1, 0.0)) {
        StateError::Penetrating { gap, x1, .. } => {
            assert!((gap - 0.1).abs() < 1e-15);
            assert_eq!(x1, 0.3);
        }
        other => panic!("{other:?}"),
    }
    // A hair's breadth apart is apart.
    let system = paper(1.8).build().unwrap();
    assert!(Simulation::new(&system, state(0.3, 0.0, contact + 1e-13, 0.0)).is_ok());
    assert!(Simulation::new(&system, state(0.3, 0.0, contact, 0.0)).is_ok());
    for (bad, name) in [
        (State::new(f64::NAN, 0.0, 0.0, 0.0), "x1"),
        (State::new(0.0, f64::INFINITY, 0.0, 0.0), "v1"),
        (State::new(0.0, 0.0, 0.0, f64::NEG_INFINITY), "v2"),
    ] {
        assert!(matches!(bad, Err(StateError::NotFinite { name: found, .. }) if found == name));
    }
}

#[test]
fn the_event_cap_ends_a_run_after_so_many_events() {
    let system = paper(1.8).build().unwrap();
    let mut options = RunOptions::periods(600);
    options.max_events = 7;
    let capped = go(&system, paper_start(), options);
    assert_eq!(capped.stop_reason, StopReason::EventCap);
    assert_eq!(capped.impacts.len(), 7);
    let last = capped.impacts[6];
    assert_eq!(capped.final_state.time, last.time);
    assert_eq!(capped.final_state.state.v1, last.v1_post);
    options.max_events = 0;
    assert_eq!(go(&system, paper_start(), options).stop_reason, StopReason::EventCap);
}

#[test]
fn a_number_of_impacts_ends_a_run_or_its_time_cap_does() {
    let system = paper(1.8).build().unwrap();
    let horizon = |count, max_time| RunOptions::until(Horizon::Impacts { count, max_time });
    let counted = go(&system, paper_start(), horizon(25, 1e6));
    assert_eq!(counted.stop_reason, StopReason::Completed);
    assert_eq!(counted.impacts.len(), 25);
    assert_eq!(counted.final_state.time, counted.impacts[24].time);
    let cap = counted.impacts[9].time + 1e-3;
    let capped = go(&system, paper_start(), horizon(25, cap));
    assert_eq!(capped.stop_reason, StopReason::TimeCap);
    assert_eq!(capped.impacts, counted.impacts[..10]);
    assert!((capped.final_state.time - cap).abs() <= f64::EPSILON * cap);
}

#[test]
fn an_impact_at_the_very_end_belongs_to_the_run() {
    let system = paper(1.8).build().unwrap();
    let long = go(&system, paper_start(), RunOptions::periods(40));
    let impact = long.impacts[20];
    let short = go(&system, paper_start(), until(impact.time + 1e-12));
    assert_eq!(short.impacts.len(), 21);
    let short = go(&system, paper_start(), until(impact.time - 1e-12));
    assert_eq!(short.impacts.len(), 20);
}

#[test]
fn after_the_stop_nothing_comes() {
    let system = paper(1.8).build().unwrap();
    let mut simulation = Simulation::new(&system, paper_start()).unwrap().periods(3);
    let events: Vec<Event> = simulation.by_ref().map(Result::unwrap).collect();
    let stops = events.iter().filter(|event| matches!(event, Event::Stop(_))).count();
    assert_eq!(stops, 1);
    assert!(matches!(events.last(), Some(Event::Stop(stop)) if stop.clock.period == 3));
    assert!(simulation.next().is_none());
}

#[test]
fn zero_periods_is_a_run_that_ends_where_it_starts() {
    let system = paper(1.8).build().unwrap();
    let nothing = go(&system, paper_start(), RunOptions::periods(0));
    assert_eq!(nothing.stop_reason, StopReason::Completed);
    assert_eq!(nothing.final_state.state, paper_start());
    assert!(nothing.impacts.is_empty() && nothing.stroboscopic.is_empty());
}

#[test]
fn a_constant_load_has_no_periods() {
    let system = ball(9.8, 0.9);
    let start = state(-1.0, 0.0, 0.0, 0.0);
    match run(&system, start, RunOptions::periods(3), &CancelToken::never()).unwrap_err() {
        RunError::Parameter(error) => assert_eq!(error.name, "periods"),
        other => panic!("{other:?}"),
    }
    let timed = go(&system, start, until(1.0));
    assert_eq!(timed.stop_reason, StopReason::Completed);
    assert_eq!((timed.final_state.time, timed.final_state.clock.period), (1.0, 0));
    assert!(timed.stroboscopic.is_empty());
    assert!(timed.impacts.iter().all(|impact| impact.period == 0));
}

#[test]
fn options_that_make_no_sense_are_named() {
    let system = paper(1.8).build().unwrap();
    let with = |change: fn(&mut RunOptions)| {
        let mut options = RunOptions::periods(10);
        change(&mut options);
        match run(&system, paper_start(), options, &CancelToken::never()) {
            Err(RunError::Parameter(error)) => error.name.to_string(),
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(with(|o| o.horizon = Horizon::Periods(-1)), "periods");
    assert_eq!(with(|o| o.horizon = Horizon::Time(f64::NAN)), "time");
    assert_eq!(with(|o| o.horizon = Horizon::Time(-1.0)), "time");
    assert_eq!(with(|o| o.keep = Some(11)), "keep");
    assert_eq!(with(|o| o.keep = Some(-1)), "keep");
    assert_eq!(with(|o| o.chatter_tolerance = 0.0), "chatter_tolerance");
    assert_eq!(with(|o| o.section_phase = 7.0), "section_phase");
}

#[test]
fn the_caller_can_end_a_run_and_keeps_what_is_done() {
    // Without losses it never repeats.
    let system = paper(1.8).restitution(1.0).build().unwrap();
    let options = RunOptions::periods(100_000);
    let end_after = |asks| run(&system, paper_start(), options, &CancelToken::after(asks)).unwrap();
    let ended = end_after(6_000);
    assert_eq!(ended.stop_reason, StopReason::Interrupted);
    assert!((100..20_000).contains(&ended.impacts.len()), "{}", ended.impacts.len());
    assert_eq!(ended, end_after(6_000));
    assert!(end_after(6_001).final_state.time > ended.final_state.time);
    // It goes on as if nothing had happened.
    let whole = go(&system, paper_start(), RunOptions::periods(20_000));
    let rest = ended.resume(RunOptions::periods(20_000), &CancelToken::never()).unwrap();
    assert_eq!(ended.impacts.len() + rest.impacts.len(), whole.impacts.len());
    assert_eq!(rest.final_state, whole.final_state);
}

/// A free rotor over a swinging mass that meet after `time` at this state; no forcing, so both
/// come from closed forms.
fn meeting(time: f64, meet: State) -> State {
    let (s, c) = time.sin_cos();
    state(meet.x1 - meet.v1 * time, meet.v1, meet.x2 * c - meet.v2 * s, meet.v2 * c + meet.x2 * s)
}

fn rotor(mass_ratio: f64, friction: f64, gap: f64, law: ImpactLaw) -> System {
    System::builder()
        .mass_ratio(mass_ratio)
        .frequency_ratio(0.0)
        .restitution(0.5)
        .gap(gap)
        .drive_frequency(1.0)
        .friction(friction)
        .law(law)
        .build()
        .unwrap()
}

#[test]
fn a_graze_where_slip_cannot_stop_the_approach_is_undecidable() {
    // Tip at x1 = 1 moving down the slope: g = g' = 0, g'' = -v1^2 sin x1 + x2 < 0.
    let meet = |x1: f64, v1: f64, x2: f64| state(x1, v1, x2, v1 * x1.cos());
    let graze = meet(1.0, -0.5, -0.1);
    let gap = 1f64.sin() + 0.1;
    for time in [0.3, 0.7] {
        let start = meeting(time, graze);
        // mbar + k cos x1 = 0.05 + 0.29 - 0.45 mu.
        let decided = go(&rotor(0.05, 0.5, gap, ImpactLaw::Poisson), start, until(1.0));
        assert_eq!(decided.stop_reason, StopReason::Completed);
        assert_eq!((decided.grazes.len(), decided.impacts.len()), (1, 0), "{time}");
        assert!((decided.grazes[0].time - time).abs() < 1e-7);
        let open = go(&rotor(0.05, 1.5, gap, ImpactLaw::Poisson), start, until(1.0));
        assert_eq!(open.stop_reason, StopReason::UndecidableGraze);
        assert!((open.final_state.time - time).abs() < 1e-7);
        assert_eq!((open.grazes.len(), open.impacts.len()), (0, 0));
        assert!(open.resume(until(2.0), &CancelToken::never()).is_err());
    }
}

#[test]
fn a_gentle_impact_where_slip_cannot_stop_the_approach_sticks() {
    let meet = state(1.0, -0.5, -0.1, -0.5 * 1f64.cos() - 1e-6);
    let gap = 1f64.sin() + 0.1;
    let start = meeting(0.5, meet);
    let run = go(&rotor(0.05, 1.5, gap, ImpactLaw::Poisson), start, until(0.6));
    assert_eq!(run.impacts[0].regime, RegimeKind::StickInApproach as i64);
    assert_eq!(run.impacts[0].v1_post, 0.0);
}

#[test]
fn a_wall_that_pushes_a_sticking_tip_jams_it() {
    let meet = state(1.0, 0.5, -0.1, -0.4);
    let start = meeting(0.5, meet);
    let run = go(&rotor(0.0, 1.5, 1f64.sin() + 0.1, ImpactLaw::Poisson), start, until(2.0));
    assert_eq!(run.stop_reason, StopReason::Jammed);
    assert!((run.final_state.time - 0.5).abs() < 1e-14);
    assert!(run.impacts.is_empty());
}

#[test]
fn the_literal_law_stops_where_it_fails() {
    // The impact of E2 in docs/theory.md, section 9: P* < 0 taken for a reversal.
    let meet = state(0.9, -1.9, -0.1, -1.3);
    let gap = 0.9f64.sin() + 0.1;
    let start = meeting(0.2, meet);
    let failed = go(&rotor(0.4, 0.2, gap, ImpactLaw::Paper), start, until(1.0));
    assert_eq!(failed.stop_reason, StopReason::LawFailed);
    assert!((failed.final_state.time - 0.2).abs() < 1e-14);
    let sound = go(&rotor(0.4, 0.2, gap, ImpactLaw::Poisson), start, until(1.0));
    assert_eq!(sound.stop_reason, StopReason::Completed);
    assert_eq!(sound.impacts[0].regime, RegimeKind::Slip as i64);
}

/// The separation velocity of a plastic impact is zero to rounding: nine of ten runs ended there,
/// as `law_failed`.
#[test]
fn the_literal_law_takes_plastic_impacts() {
    for omega in [0.7, 0.9, 1.3, 1.8, 2.6] {
        let system = |law| paper(omega).restitution(0.0).law(law).build().unwrap();
        let as_printed = go(&system(ImpactLaw::Paper), paper_start(), RunOptions::periods(20));
        let sound = go(&system(ImpactLaw::Poisson), paper_start(), RunOptions::periods(20));
        assert_eq!(as_printed.stop_reason, StopReason::Completed, "{omega}");
        // Without friction both laws are the same.
        assert_eq!(as_printed.impacts.len(), sound.impacts.len(), "{omega}");
        assert!(sound.impacts.len() > 5);
        for (a, b) in as_printed.impacts.iter().zip(&sound.impacts) {
            let off = [a.time - b.time, a.x1 - b.x1, a.v1_post - b.v1_post, a.v2_post - b.v2_post];
            assert!(off.iter().all(|d| d.abs() < 1e-9), "{omega}: {a:?} {b:?}");
        }
    }
}

#[test]
fn a_motion_out_of_range_is_a_failed_computation() {
    let system = paper(1.8).moment_amplitude(1e308).build().unwrap();
    match run(&system, paper_start(), RunOptions::periods(5), &CancelToken::never()) {
        Err(RunError::Simulation { error: SimulationError::NotFinite { state, .. }, done }) => {
            assert_eq!(state, paper_start().to_array());
            assert_eq!(done.stop_reason, StopReason::Failed);
            assert_eq!(done.final_state.state, paper_start());
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_impact_whose_energy_is_no_number_is_an_error() {
    // Found by fuzzing: squares of velocities near 1e154 leave the range of floats.
    let system = paper(1.4218966964217594)
        .contact(Contact::Direct)
        .law(ImpactLaw::Paper)
        .mass_ratio(0.0)
        .frequency_ratio(3.0)
        .restitution(0.0)
        .gap(1.0)
        .moment_amplitude(-2.0)
        .force_amplitude(1e154)
        .build()
        .unwrap();
    let simulation = Simulation::new(&system, state(-2.0, -2.0, -3.0, -2.0)).unwrap().periods(2);
    for event in simulation {
        match event {
            Ok(Event::Impact(e)) => assert!(e.impact.energy_loss.is_finite(), "{e:?}"),
            Ok(_) => {}
            Err(error) => assert!(matches!(error, SimulationError::NotFinite { .. }), "{error}"),
        }
    }
}
