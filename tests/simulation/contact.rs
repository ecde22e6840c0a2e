//! Sustained contact: starts in contact, Coulomb's law, sections and resumed runs inside contact,
//! and every way it can end (docs/theory.md, section 5). Its numbers: tests/contact_reference.rs.

use vibroimpact::{
    CancelToken, Contact, ContactMode, ContactRecord, Event, EventKind, ImpactLaw, Run, RunOptions,
    Simulation, State, StopReason, System, Workers, run_many,
};

use super::{ball, chattering, go, paper, paper_start, state, until};

/// What Coulomb's law and the constraint ask of a run in contact.
fn check_contact(system: &System, run: &Run) -> usize {
    let ends: Vec<f64> = run.events.iter().map(|e| e.time).collect();
    let times: Vec<f64> = ends
        .windows(2)
        .flat_map(|w| (0..20).map(|i| w[0] + (w[1] - w[0]) * f64::from(i) / 20.0))
        .collect();
    let states = run.trajectory(&times).unwrap();
    let forces = run.contact_forces(&times).unwrap();
    let mut in_contact = 0;
    for (x, force) in states.iter().zip(&forces) {
        let now = state(x[0], x[1], x[2], x[3]);
        assert!(system.gap_function(&now) <= 1e-13, "{now:?}");
        assert!(force.normal >= 0.0);
        let limit = system.friction() * force.normal;
        assert!(force.tangential.abs() <= limit * (1.0 + 1e-9) + 1e-13, "{force:?} {now:?}");
        if force.normal > 0.0 {
            in_contact += 1;
            assert!(system.gap_function(&now).abs() < 1e-15);
            assert!(system.approach_velocity(&now).abs() < 1e-15);
            if now.v1.abs() > 1e-14 {
                // Full friction against the slip x1' sin x1.
                let against = -limit * (now.v1 * now.x1.sin()).signum();
                assert!((force.tangential - against).abs() <= 1e-15, "{force:?} {now:?}");
            }
        }
    }
    in_contact
}

#[test]
fn contact_obeys_coulomb_and_does_not_penetrate() {
    let mut looked_at = 0;
    for friction in [0.0, 0.1, 0.3, 0.7] {
        for omega in [0.22, 0.31, 0.4] {
            let system = chattering(omega).restitution(0.4).moment_amplitude(3.0);
            let system = system.friction(friction).build().unwrap();
            let run = go(&system, paper_start(), RunOptions::periods(6));
            assert_eq!(run.stop_reason, StopReason::Completed);
            looked_at += check_contact(&system, &run);
        }
    }
    assert!(looked_at > 1_000, "{looked_at}");
}

/// First events of a run from a start in contact.
fn first_event(system: &System, start: State) -> Event {
    Simulation::new(system, start).unwrap().periods(1).next().unwrap().unwrap()
}

#[test]
fn starts_in_contact_begin_as_their_velocities_and_forces_say() {
    let system = paper(0.7).force_amplitude(0.5).build().unwrap();
    let x2 = 0.3f64.sin() - 0.5;
    // Approaching: an impact at once, at t = 0.
    let start = state(0.3, 1.0, x2, 0.2);
    let Event::Impact(impact) = first_event(&system, start) else { panic!("no impact") };
    assert_eq!(impact.time, 0.0);
    assert_eq!((impact.pre.x1, impact.pre.v1, impact.pre.v2), (0.3, 1.0, 0.2));
    assert!((impact.impact.approach_velocity - (0.3f64.cos() - 0.2)).abs() < 1e-16);
    let run = go(&system, start, RunOptions::periods(3));
    assert_eq!((run.impacts[0].time, run.impacts[0].period), (0.0, 0));
    // Separating: a flight.
    let start = state(0.3, 0.1, x2, 0.2);
    let Event::Impact(impact) = first_event(&system, start) else { panic!("no impact") };
    assert!(impact.time > 1e-3);
    // At relative rest: contact if the free bodies would approach, a1 cos x1 - a2 > 0 ...
    for (f1, holds) in [(2.0, true), (-2.0, false)] {
        let system = paper(0.7).moment_amplitude(f1).build().unwrap();
        let push = (f1 - 4.0 * 0.3) * 0.3f64.cos() + x2;
        assert_eq!(push > 0.0, holds);
        match first_event(&system, state(0.3, 0.0, x2, 0.0)) {
            Event::SlidePositive(contact) => {
                assert!(holds);
                assert_eq!((contact.time, contact.mode), (0.0, Some(ContactMode::SlidePositive)));
                let normal = push / (0.6 + 0.3f64.cos().powi(2));
                assert!((contact.force.normal - normal).abs() < 1e-15);
            }
            event => assert!(!holds && !matches!(event, Event::Release(_)), "{event:?}"),
        }
    }
    // ... and held by friction where the cone allows it, with p = -a2/mbar = x2/mbar.
    let system = paper(0.7).friction(2.0).moment_amplitude(4.0).gap(0.0).build().unwrap();
    let x1: f64 = 1.2;
    let Event::Stick(stick) = first_event(&system, state(x1, 0.0, x1.sin(), 0.0)) else {
        let event = first_event(&system, state(x1, 0.0, x1.sin(), 0.0));
        panic!("{event:?}")
    };
    assert!((stick.force.normal - x1.sin() / 0.6).abs() < 1e-15);
    let moment = 4.0 - 4.0 * x1 - stick.force.normal * x1.cos() + x1.sin() * stick.force.tangential;
    assert!(moment.abs() < 1e-14, "{moment:e}");
}

#[test]
fn a_force_that_vanishes_at_the_start_is_decided_by_how_it_goes_on() {
    // Direct, wall: p = f1 cos psi - omega0^2 x1, zero at the start.
    let at = |x1: f64, f1: f64, phase: f64| {
        let system = paper(0.7)
            .mass_ratio(0.0)
            .contact(Contact::Direct)
            .gap(x1)
            .moment_amplitude(f1)
            .phase(phase)
            .build()
            .unwrap();
        let run = go(&system, state(x1, 0.0, 0.0, 0.0), RunOptions::periods(1));
        (run.contacts.first().map(|c| (c.kind, c.time)), run)
    };
    // It falls (sin psi > 0): flight. It rises: stick.
    let quarter = std::f64::consts::FRAC_PI_2;
    assert_ne!(at(0.0, 1.0, quarter).0.map(|(_, time)| time), Some(0.0));
    let (first, run) = at(0.0, 1.0, -quarter);
    assert_eq!(first, Some((EventKind::Stick as i64, 0.0)));
    // cos psi > 0 for half a period.
    let release = run.contacts[1];
    assert_eq!(release.kind, EventKind::Release as i64);
    assert!((release.time - std::f64::consts::PI / 0.7).abs() < 1e-14);
    // At its maximum: it falls with the second power of time. No force at all: rest.
    let (first, run) = at(0.5, 2.0, 0.0);
    assert_ne!(first.map(|(_, time)| time), Some(0.0));
    assert!(run.trajectory(&[0.1]).unwrap()[0][0] < 0.5);
    let (first, run) = at(0.0, 0.0, 0.0);
    assert_eq!(first, Some((EventKind::Stick as i64, 0.0)));
    assert_eq!(run.stop_reason, StopReason::Rest);
}

#[test]
fn sections_and_resumed_runs_inside_contact_are_those_of_one_run() {
    let system = chattering(0.25).friction(0.3).restitution(0.3).moment_amplitude(3.0);
    let system = system.build().unwrap();
    let whole = go(&system, paper_start(), RunOptions::periods(4));
    // Ends before, at and after every event of contact and between them.
    let mut ends: Vec<f64> = whole.contacts.iter().flat_map(|c| [c.time, c.time + 0.1]).collect();
    ends.retain(|&end| end < whole.final_state.time);
    for end in ends {
        let part = go(&system, paper_start(), until(end));
        let rest = part.resume(RunOptions::periods(4), &CancelToken::never()).unwrap();
        assert_eq!(rest.final_state, whole.final_state, "{end}");
        let contacts: Vec<ContactRecord> =
            part.contacts.iter().chain(&rest.contacts).copied().collect();
        assert_eq!(contacts, whole.contacts, "{end}");
    }
    // The section moved into contact: the same states as the trajectory's.
    let contact = whole.contacts.iter().find(|c| c.period == 2).unwrap();
    let mut options = RunOptions::periods(4);
    options.section_phase = 0.25 * (contact.time_in_period + 0.05);
    let run = go(&system, paper_start(), options);
    let time = contact.time + 0.05;
    let section = run.stroboscopic[2];
    let state = whole.trajectory(&[time]).unwrap()[0];
    assert!(section.iter().zip(&state).all(|(a, b)| (a - b).abs() < 1e-13));
    assert!(whole.contact_forces(&[time]).unwrap()[0].normal > 0.0);
    // A window that begins in contact.
    let kept = go(&system, paper_start(), options.keep(2));
    assert_eq!(kept.stroboscopic, run.stroboscopic[2..]);
}

#[test]
fn a_cap_between_two_events_of_one_instant_loses_none() {
    let whole = go(&ball(9.8, 0.5), state(-1.0, 0.0, 0.0, 0.0), until(2.0));
    let stick_slip = chattering(0.25).friction(0.3).restitution(0.3).moment_amplitude(3.0);
    let stick_slip = stick_slip.build().unwrap();
    let long = go(&stick_slip, paper_start(), RunOptions::periods(3));
    for (whole, system, start, options) in [
        (&whole, ball(9.8, 0.5), state(-1.0, 0.0, 0.0, 0.0), until(2.0)),
        (&long, stick_slip, paper_start(), RunOptions::periods(3)),
    ] {
        for cap in 1..whole.events.len() as u64 - 1 {
            let mut capped = options;
            capped.max_events = cap;
            let part = go(&system, start, capped);
            assert_eq!(part.stop_reason, StopReason::EventCap);
            let rest = part.resume(options, &CancelToken::never()).unwrap();
            let kinds = |run: &Run| run.events.iter().map(|e| (e.kind, e.time)).collect::<Vec<_>>();
            let mut both = kinds(&part);
            both.pop();
            both.extend(kinds(&rest));
            assert_eq!(both, kinds(whole), "cap {cap}");
            assert_eq!(rest.final_state, whole.final_state);
        }
    }
}

#[test]
fn a_window_that_begins_in_contact_is_the_end_of_the_whole() {
    // Drive phase such that a period ends in the middle of contact.
    let system = chattering(0.25).phase(3.58).build().unwrap();
    let whole = go(&system, paper_start(), RunOptions::periods(8));
    let kept = go(&system, paper_start(), RunOptions::periods(8).keep(3));
    let from = kept.kept_from();
    assert!(whole.contact_forces(&[from]).unwrap()[0].normal > 0.0);
    let times: Vec<f64> = (0..500).map(|i| from + 0.15 * f64::from(i)).collect();
    let (a, b) = (whole.trajectory(&times).unwrap(), kept.trajectory(&times).unwrap());
    for (x, y) in a.iter().flatten().zip(b.iter().flatten()) {
        assert!((x - y).abs() < 1e-13);
    }
    let after = |run: &Run| run.contacts.iter().filter(|c| c.time > from).count();
    assert_eq!(after(&whole), kept.contacts.len());
    let share = kept.time_in_contact() / (kept.final_state.time - from);
    assert!((share - 0.24).abs() < 0.01, "{share}");
}

#[test]
fn chattering_motions_are_labelled() {
    for (omega, label) in [(0.21, "1-inf"), (0.25, "1-inf"), (0.3, "1-inf"), (0.45, "1-inf")] {
        let system = chattering(omega).build().unwrap();
        let run = go(&system, paper_start(), RunOptions::periods(300).keep(100));
        assert_eq!(run.period(&CancelToken::never()).label(), label, "omega = {omega}");
    }
    // At rest for ever: no impacts in the window.
    let system = paper(1.0).mass_ratio(0.0).contact(Contact::Direct).restitution(0.3).gap(0.0);
    let system = system.frequency_ratio(0.0).moment_amplitude(0.0).pendulum_damping(0.0);
    let system = system.build().unwrap();
    let run = go(&system, state(-1.0, 1.0, 0.0, 0.0), RunOptions::periods(300).keep(100));
    // Free flights between bounces that shrink: u = 0.3^n, far apart, never at rest.
    assert!(run.impact_count <= 4 && run.stop_reason == StopReason::Completed);
    let load = ball(9.8, 0.5);
    assert_eq!(go(&load, state(-1.0, 0.0, 0.0, 0.0), until(2.0)).stop_reason, StopReason::Rest);
}

#[test]
fn contact_ends_in_painleve_or_jams_by_name() {
    // mu >= 2 sqrt(mbar (1 + mbar)): slip can drive the bodies into each other. Sliding with mbar +
    // k cos x1 < 0, pressed together (no force fits) and pulled apart (flight fits, and p too).
    for (x1, v1) in [(2.0f64, 1.0), (-2.0, 1.0)] {
        let system = paper(0.7).mass_ratio(0.1).friction(3.0).gap(0.0).moment_amplitude(0.0);
        let system = system.build().unwrap();
        let k = x1.cos() + 3.0 * x1.sin().abs();
        assert!(0.1 + k * x1.cos() < 0.0);
        let run = go(&system, state(x1, v1, x1.sin(), v1 * x1.cos()), RunOptions::periods(1));
        assert_eq!((run.stop_reason, run.final_state.time), (StopReason::Painleve, 0.0));
    }
    // A wall (mbar = 0) swings against a tip that friction holds.
    let system = paper(0.7).mass_ratio(0.0).friction(3.0).gap(0.0).moment_amplitude(0.0);
    let system = system.frequency_ratio(0.0).build().unwrap();
    let x1: f64 = 1.2;
    let run = go(&system, state(x1, 0.0, x1.sin(), 0.0), RunOptions::periods(1));
    assert_eq!(run.stop_reason, StopReason::Jammed);
    assert_eq!(run.final_state.time, 0.0);
}

#[test]
fn a_plastic_impact_after_which_flight_and_stick_both_fit_is_a_painleve_point() {
    // Found by a random search: the tip stops at the eighth impact, the free bodies would part, and
    // mbar + k cos x1 <= 0 for one direction of slip, in which a stick fits too.
    let system = System::builder()
        .mass_ratio(0.025780432914300596)
        .frequency_ratio(0.16813134686179082)
        .restitution(0.0)
        .gap(0.9978781578756075)
        .drive_frequency(1.2979588500915182)
        .pendulum_damping(0.7496031596050503)
        .oscillator_damping(0.0005220994683542315)
        .moment_amplitude(4.160669164932863)
        .force_amplitude(0.5131235752743808)
        .friction(2.2503970377790403)
        .phase(4.230224974751675)
        .law(ImpactLaw::Energetic)
        .build()
        .unwrap();
    let start =
        state(-0.934055427722319, 1.1553121407706026, 0.5195305580856302, -0.9104553859139941);
    let run = go(&system, start, RunOptions::periods(12));
    assert_eq!((run.stop_reason, run.impact_count), (StopReason::Painleve, 8));
    let last = run.impacts.last().unwrap();
    assert_eq!((last.v1_post, last.time), (0.0, run.final_state.time));
    // The same in the lanes.
    let many = run_many(
        &system,
        &[start; 5],
        RunOptions::periods(12),
        &Workers::default(),
        &CancelToken::never(),
    );
    for other in many.unwrap() {
        assert_eq!(other.unwrap().events, run.events);
    }
}

#[test]
fn a_slide_of_a_light_body_ends_where_its_trajectory_does() {
    // Its steps are so short that they looked like a standstill.
    for exponent in [2, 4, 6, 8] {
        let system = System::builder()
            .mass_ratio(10f64.powi(-exponent))
            .frequency_ratio(0.0)
            .restitution(0.0)
            .gap(0.0)
            .drive_frequency(1.0)
            .build()
            .unwrap();
        let tip = (-1.3f64).sin();
        let run = go(&system, state(-1.3, 0.0, tip + 0.02, -1.0), until(0.3));
        let followed = run.trajectory(&[0.3]).unwrap()[0];
        for (end, found) in run.final_state.state.to_array().into_iter().zip(followed) {
            let error = (end - found).abs() / found.abs().max(1.0);
            assert!(error < 1e-12, "mbar = 1e-{exponent}: {end} {found}");
        }
    }
}
