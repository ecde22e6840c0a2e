//! What a run keeps and how it goes on: the iterator and the run, the window, sections, resuming.

use std::f64::consts::TAU;

use vibroimpact::{
    CancelToken, Contact, Event, Horizon, ImpactRecord, Observer, Run, RunOptions, Simulation,
    State, StopReason, System, Workers, run_many,
};

use super::{Draw, ball, chattering, go, paper, paper_start, state, until};

#[derive(Default)]
struct Sections(Vec<(i64, [f64; 4])>);

impl Observer for Sections {
    const SECTIONS: bool = true;
    fn section(&mut self, k: i64, state: &State) {
        self.0.push((k, state.to_array()));
    }
}

#[test]
fn the_iterator_and_the_run_see_the_same() {
    let mut draw = Draw::new(10);
    for _ in 0..20 {
        let system = draw.system();
        let start = draw.start(&system);
        let run = go(&system, start, RunOptions::periods(30));
        let events: Vec<Event> =
            Simulation::new(&system, start).unwrap().periods(30).map(Result::unwrap).collect();
        let impacts: Vec<ImpactRecord> = events
            .iter()
            .filter_map(|event| match event {
                Event::Impact(impact) => Some(impact.into()),
                _ => None,
            })
            .collect();
        assert_eq!(run.impacts, impacts);
        assert_eq!(run.impact_count as usize, impacts.len());
        assert_eq!(run.events.len(), events.len());
        let mut simulation = Simulation::new(&system, start).unwrap().periods(30);
        let mut sections = Sections::default();
        let Event::Stop(stop) =
            std::iter::from_fn(|| simulation.advance(&mut sections)).last().unwrap().unwrap()
        else {
            panic!("the last event is the stop");
        };
        assert_eq!(stop.state, run.final_state.state);
        let states: Vec<[f64; 4]> = sections.0.iter().map(|&(_, state)| state).collect();
        assert_eq!(states, run.stroboscopic);
        assert!(sections.0.iter().map(|&(k, _)| k).eq(1..=states.len() as i64));
    }
}

/// Flights start from records, whose times are rounded: the states agree to that rounding.
fn assert_same_motion(run: &Run, other: &Run, times: &[f64]) {
    let (found, expected) = (run.trajectory(times).unwrap(), other.trajectory(times).unwrap());
    let mut worst = 0f64;
    for (a, b) in found.iter().flatten().zip(expected.iter().flatten()) {
        worst = worst.max((a - b).abs() / b.abs().max(1.0));
    }
    assert!(worst <= 1e-13, "{worst:e}");
}

#[test]
fn the_window_holds_the_last_periods() {
    let mut draw = Draw::new(11);
    for _ in 0..20 {
        let system = draw.system();
        let start = draw.start(&system);
        let whole = go(&system, start, RunOptions::periods(40));
        let kept = go(&system, start, RunOptions::periods(40).keep(15));
        if whole.stop_reason != StopReason::Completed {
            continue;
        }
        assert_eq!(whole.stroboscopic.len(), 40);
        assert_eq!(kept.stroboscopic, whole.stroboscopic[25..]);
        assert_eq!(kept.final_state, whole.final_state);
        assert_eq!(whole.stroboscopic[39], whole.final_state.state.to_array());
        let (from, to) = (25.0 * system.drive_period(), 40.0 * system.drive_period());
        let inside: Vec<ImpactRecord> =
            whole.impacts.iter().copied().filter(|i| from < i.time && i.time <= to).collect();
        assert_eq!(kept.impacts, inside);
        assert_eq!(kept.impact_count, whole.impact_count);
        for (row, event) in kept.events.iter().filter(|e| e.kind == 0).enumerate() {
            assert_eq!(event.index, row as i64);
            assert_eq!(event.time, kept.impacts[row].time);
        }
        // The trajectory is that of the whole run, and ends where the window does.
        let times: Vec<f64> =
            (0..=300).map(|i| from + (to - from) * f64::from(i) / 300.0).collect();
        let times = &times[1..300];
        assert_same_motion(&kept, &whole, times);
        assert!(kept.trajectory(&[from - 1e-6]).is_none());
        assert!(kept.trajectory(&[to + 1e-6]).is_none());
        assert!(kept.trajectory(&[f64::NAN]).is_none());
        for (found, given) in whole.trajectory(&[0.0]).unwrap()[0].iter().zip(start.to_array()) {
            assert!((found - given).abs() <= f64::EPSILON);
        }
        let none = go(&system, start, RunOptions::periods(40).keep(0));
        assert!(none.impacts.is_empty() && none.stroboscopic.is_empty());
    }
}

#[test]
fn the_trajectory_is_right_continuous_and_passes_through_the_impacts() {
    let system = paper(1.8).friction(0.3).build().unwrap();
    let run = go(&system, paper_start(), RunOptions::periods(50));
    let times: Vec<f64> = run.impacts.iter().map(|impact| impact.time).collect();
    for (impact, state) in run.impacts.iter().zip(run.trajectory(&times).unwrap()) {
        let post = [impact.x1, impact.v1_post, impact.x2, impact.v2_post];
        // The rounded time is late by one spacing at most; accelerations stay below 10.
        let moved = 10.0 * f64::EPSILON * impact.time.max(1.0);
        for (found, expected) in state.iter().zip(post) {
            assert!((found - expected).abs() <= moved, "{state:?} {impact:?}");
        }
    }
    let before: Vec<f64> = times.iter().map(|time| time - 1e-9).collect();
    for (impact, state) in run.impacts.iter().zip(run.trajectory(&before).unwrap()) {
        let pre = [impact.x1, impact.v1_pre, impact.x2, impact.v2_pre];
        for (found, expected) in state.iter().zip(pre) {
            assert!((found - expected).abs() < 1e-8, "{state:?} {pre:?}");
        }
    }
}

/// The parts of a resumed run together are the whole.
fn assert_joined(whole: &Run, parts: &[Run]) {
    let joined = |pick: fn(&Run) -> usize| parts.iter().map(pick).sum::<usize>();
    assert_eq!(joined(|run| run.impacts.len()), whole.impacts.len());
    assert_eq!(joined(|run| run.stroboscopic.len()), whole.stroboscopic.len());
    assert!(parts.iter().flat_map(|run| &run.impacts).eq(&whole.impacts));
    assert!(parts.iter().flat_map(|run| &run.stroboscopic).eq(&whole.stroboscopic));
    let last = parts.last().unwrap();
    assert_eq!(last.final_state, whole.final_state);
    assert_eq!(last.stop_reason, whole.stop_reason);
    assert_eq!(last.impact_count, whole.impact_count);
}

fn in_parts(system: &System, start: State, ends: &[RunOptions]) -> Vec<Run> {
    let mut parts: Vec<Run> = Vec::new();
    for &options in ends {
        let next = match parts.last() {
            None => go(system, start, options),
            Some(run) if run.stop_reason == StopReason::Completed => {
                run.resume(options, &CancelToken::never()).unwrap()
            }
            Some(_) => break,
        };
        parts.push(next);
    }
    parts
}

#[test]
fn a_resumed_run_has_the_bits_of_one_long_run() {
    let mut draw = Draw::new(12);
    for _ in 0..25 {
        let system = draw.system();
        let start = draw.start(&system);
        let whole = go(&system, start, RunOptions::periods(60));
        for splits in [&[13, 60][..], &[1, 2, 3, 31, 60], &[60, 60]] {
            let ends: Vec<RunOptions> = splits.iter().map(|&n| RunOptions::periods(n)).collect();
            assert_joined(&whole, &in_parts(&system, start, &ends));
        }
        let end = 60.0 * system.drive_period();
        let timed = go(&system, start, until(end));
        let cuts = [0.017, 0.3, 0.3001, 0.77, 1.0].map(|part| until(part * end));
        assert_joined(&timed, &in_parts(&system, start, &cuts));
        // From every cap, one event at a time.
        let mut options = RunOptions::periods(60);
        options.max_events = 5;
        let mut run = go(&system, start, options);
        while run.stop_reason == StopReason::EventCap {
            options.max_events += 3;
            run = run.resume(options, &CancelToken::never()).unwrap();
        }
        assert_eq!((run.final_state, run.stop_reason), (whole.final_state, whole.stop_reason));
    }
}

#[test]
fn a_flight_longer_than_a_local_one_is_resumed_with_the_same_bits() {
    // Out of reach: one flight for ever, cut anywhere.
    let system = paper(1.37).gap(3.0).pendulum_damping(0.01).build().unwrap();
    let whole = go(&system, paper_start(), RunOptions::periods(50));
    assert_eq!(whole.impacts.len(), 0);
    let ends: Vec<RunOptions> = [7, 8, 23, 50].map(RunOptions::periods).into();
    assert_joined(&whole, &in_parts(&system, paper_start(), &ends));
    // A chain of cuts in time, none at a period.
    let timed = go(&system, paper_start(), until(100.0));
    let cuts: Vec<RunOptions> = (1..=20).map(|i| until(5.0 * f64::from(i))).collect();
    let parts = in_parts(&system, paper_start(), &cuts);
    assert_joined(&timed, &parts);
    assert_eq!(parts.len(), 20);
    // Sporadic impacts (Han, Jin & Hu (2004), Fig. 10).
    let system = paper(2.98).friction(0.3).build().unwrap();
    let whole = go(&system, paper_start(), RunOptions::periods(400));
    assert!(whole.impacts.len() > 2, "{}", whole.impacts.len());
    let longest = whole.impacts.windows(2).map(|w| w[1].time - w[0].time).fold(0.0, f64::max);
    assert!(longest > 10.0 * system.drive_period(), "{longest}");
    let ends: Vec<RunOptions> = (1..=40).map(|i| RunOptions::periods(10 * i)).collect();
    assert_joined(&whole, &in_parts(&system, paper_start(), &ends));
}

#[test]
fn a_resumed_window_and_trajectory_begin_where_the_run_ended() {
    let system = paper(1.1).build().unwrap();
    let whole = go(&system, paper_start(), RunOptions::periods(80));
    let first = go(&system, paper_start(), RunOptions::periods(33));
    let rest = first.resume(RunOptions::periods(80), &CancelToken::never()).unwrap();
    let from = 33.0 * system.drive_period();
    assert!((rest.kept_from() - from).abs() < 1e-12);
    let times: Vec<f64> = (1..200).map(|i| from + 0.13 * f64::from(i)).collect();
    assert_same_motion(&rest, &whole, &times);
    let last = first.resume(RunOptions::periods(80).keep(10), &CancelToken::never()).unwrap();
    assert_eq!(last.stroboscopic, whole.stroboscopic[70..]);
}

#[test]
fn a_run_that_ended_for_good_cannot_be_resumed() {
    // A wall that swings against a tip held by friction.
    let jams = paper(0.7).mass_ratio(0.0).friction(3.0).gap(0.0).frequency_ratio(0.0);
    let jams = jams.moment_amplitude(0.0).build().unwrap();
    let ended = go(&jams, state(1.2, 0.0, 1.2f64.sin(), 0.0), until(2.0));
    assert_eq!(ended.stop_reason, StopReason::Jammed);
    assert!(ended.resume(until(3.0), &CancelToken::never()).is_err());
    // One at rest goes on resting.
    let resting = go(&ball(9.8, 0.5), state(-1.0, 0.0, 0.0, 0.0), until(2.0));
    let later = resting.resume(until(3.0), &CancelToken::never()).unwrap();
    assert_eq!((later.stop_reason, later.final_state.time), (StopReason::Rest, 3.0));
}

#[test]
fn the_section_can_be_moved() {
    let mut draw = Draw::new(13);
    for _ in 0..10 {
        let system = draw.system();
        let start = draw.start(&system);
        let whole = go(&system, start, RunOptions::periods(30));
        if whole.stop_reason != StopReason::Completed {
            continue;
        }
        for section_phase in [1e-3, 1.0, 6.0] {
            let mut options = RunOptions::periods(30);
            options.section_phase = section_phase;
            let moved = go(&system, start, options);
            assert_eq!(moved.stroboscopic.len(), 30);
            assert_eq!(moved.impacts, whole.impacts);
            let times: Vec<f64> = (0..30)
                .map(|k| (TAU * f64::from(k) + section_phase) / system.drive_frequency())
                .collect();
            for (found, expected) in
                moved.stroboscopic.iter().zip(whole.trajectory(&times).unwrap())
            {
                for (a, b) in found.iter().zip(expected) {
                    assert!((a - b).abs() <= 1e-11 * (1.0 + b.abs()), "{found:?} {expected:?}");
                }
            }
            options.keep = Some(7);
            assert_eq!(go(&system, start, options).stroboscopic, moved.stroboscopic[23..]);
        }
    }
}

#[test]
fn a_section_at_the_instant_of_an_impact_sees_the_state_after_it() {
    // A free body that strikes a wall after exactly one drive period (as a double: the true
    // period is a little longer or shorter, by less than its last bit).
    let mut draw = Draw::new(14);
    for _ in 0..50 {
        let system = System::builder()
            .mass_ratio(0.0)
            .frequency_ratio(0.0)
            .restitution(0.5)
            .gap(0.0)
            .drive_frequency(draw.uniform(0.5, 3.0))
            .contact(Contact::Direct)
            .build()
            .unwrap();
        let period = system.drive_period();
        let start = state(-period, 1.0, 0.0, 0.0);
        for options in
            [RunOptions::periods(1), RunOptions::periods(2), RunOptions::periods(2).keep(1)]
        {
            let run = go(&system, start, options);
            assert_eq!(run.impact_count, 1);
            let k = 1 - usize::from(options.keep.is_some());
            if k == 1 {
                assert_eq!(run.impacts.len(), 1);
                assert_eq!(run.stroboscopic[0][1], -0.5, "{}", system.drive_frequency());
            }
            assert_eq!(run.final_state.state.v1, -0.5);
        }
    }
}

#[test]
fn records_are_consistent() {
    let mut draw = Draw::new(15);
    for _ in 0..20 {
        let system = draw.system();
        let start = draw.start(&system);
        let run = go(&system, start, RunOptions::until(Horizon::Time(200.0)));
        let (omega, period) = (system.drive_frequency(), system.drive_period());
        for impact in &run.impacts {
            assert!((0.0..period).contains(&impact.time_in_period));
            let time = impact.period as f64 * period + impact.time_in_period;
            assert!((impact.time - time).abs() <= 4.0 * f64::EPSILON * time);
            assert!((0.0..TAU).contains(&impact.phase));
            let phase = (omega * impact.time_in_period + system.phase()).rem_euclid(TAU);
            let off = (impact.phase - phase).abs();
            assert!(off.min(TAU - off) < 1e-14, "{impact:?}");
            // On the contact by construction.
            let x2 = impact.x1.sin() - system.gap();
            assert!((impact.x2 - x2).abs() <= 2.0 * f64::EPSILON * (1.0 + system.gap()));
        }
        assert!(run.impacts.windows(2).all(|w| w[0].time < w[1].time));
    }
}

#[test]
fn a_run_that_moves_on_over_its_repetitions_is_the_end_of_the_whole_run() {
    let damped = |omega: f64| {
        paper(omega).force_amplitude(0.5).pendulum_damping(0.1).oscillator_damping(0.1).build()
    };
    let mut systems: Vec<(System, i64)> =
        (0..12).map(|i| (damped(0.7 + 0.15 * f64::from(i)).unwrap(), 400)).collect();
    // Chatter and contact in every period.
    systems.extend([(0.25, 3000), (0.45, 3000)].map(|(w, n)| (chattering(w).build().unwrap(), n)));
    for (system, periods) in systems {
        let whole = go(&system, paper_start(), RunOptions::periods(periods));
        let options = RunOptions::periods(periods).keep(50);
        let run = go(&system, paper_start(), options);
        let omega = system.drive_frequency();
        assert_eq!(run.impact_count, whole.impact_count, "{omega}");
        assert_eq!(run.final_state, whole.final_state, "{omega}");
        let first = whole.impacts.len() - run.impacts.len();
        assert!(run.impacts == whole.impacts[first..], "{omega}");
        assert!(run.stroboscopic == whole.stroboscopic[periods as usize - 50..], "{omega}");
        // From the flight in which the window begins on.
        let period = TAU / omega;
        let times: Vec<f64> =
            (0..500).map(|i| run.kept_from() + period * (0.01 * f64::from(i))).collect();
        assert_same_motion(&run, &whole, &times);
        let many = run_many(
            &system,
            &[paper_start(); 3],
            options,
            &Workers::default(),
            &CancelToken::never(),
        );
        for other in many.unwrap() {
            assert!(other.unwrap() == run, "{omega}");
        }
    }
}
