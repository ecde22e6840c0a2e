//! A motion that repeats to the last bit is copied, not computed again: every table has the bits of
//! the motion computed event by event.

use vibroimpact::{
    CancelToken, ContactRecord, Event, GrazeRecord, Horizon, ImpactRecord, Observer, Run,
    RunOptions, Simulation, State, StopReason, System, Workers, run, run_many,
};

use super::{Draw, chattering, go, paper, paper_start};

/// The motion computed event by event: nothing of it is copied.
struct Computed {
    impacts: Vec<ImpactRecord>,
    grazes: Vec<GrazeRecord>,
    contacts: Vec<ContactRecord>,
    sections: Vec<[f64; 4]>,
    end: State,
    reason: StopReason,
    evaluations: u64,
}

impl Observer for Computed {
    const SECTIONS: bool = true;

    fn section(&mut self, _: i64, state: &State) {
        self.sections.push(state.to_array());
    }
}

fn computed(system: &System, start: State, options: RunOptions) -> Computed {
    let mut simulation = Simulation::new(system, start)
        .unwrap()
        .until(options.horizon)
        .max_events(options.max_events)
        .section_phase(options.section_phase);
    let (end, reason) = (start, StopReason::Interrupted);
    let (impacts, grazes, contacts, sections) = Default::default();
    let mut all = Computed { impacts, grazes, contacts, sections, end, reason, evaluations: 0 };
    while let Some(event) = simulation.advance(&mut all) {
        match event.unwrap() {
            Event::Impact(e) => all.impacts.push((&e).into()),
            Event::Graze(e) => all.grazes.push((&e).into()),
            Event::Chatter(e) => all.contacts.push((&e).into()),
            Event::SlidePositive(e)
            | Event::SlideNegative(e)
            | Event::Stick(e)
            | Event::Release(e) => all.contacts.push((&e).into()),
            Event::Stop(e) => (all.end, all.reason) = (e.state, e.reason),
            _ => {}
        }
    }
    all.evaluations = simulation.evaluations();
    all
}

/// Whether the run is that motion, of which it keeps the last rows.
fn assert_is(run: &Run, computed: &Computed) {
    let last = |all: usize, kept: usize| all.checked_sub(kept).unwrap();
    let impacts = &computed.impacts[last(computed.impacts.len(), run.impacts.len())..];
    let grazes = &computed.grazes[last(computed.grazes.len(), run.grazes.len())..];
    let contacts = &computed.contacts[last(computed.contacts.len(), run.contacts.len())..];
    let sections = &computed.sections[last(computed.sections.len(), run.stroboscopic.len())..];
    assert!(run.impacts == impacts && run.grazes == grazes && run.contacts == contacts);
    assert!(run.stroboscopic == sections);
    assert_eq!((run.final_state.state, run.stop_reason), (computed.end, computed.reason));
    assert_eq!(run.impact_count, computed.impacts.len() as u64);
    assert_in_order(run);
}

/// The table of events leads to the others, row by row.
fn assert_in_order(run: &Run) {
    let mut rows = [0, 0, 0];
    for event in &run.events {
        let (table, period, time) = match event.kind {
            0 => (0, run.impacts[rows[0]].period, run.impacts[rows[0]].time),
            1 => (1, run.grazes[rows[1]].period, run.grazes[rows[1]].time),
            _ if event.index < 0 => continue,
            _ => (2, run.contacts[rows[2]].period, run.contacts[rows[2]].time),
        };
        assert_eq!((event.index, event.period, event.time), (rows[table] as i64, period, time));
        rows[table] += 1;
    }
    assert_eq!(rows, [run.impacts.len(), run.grazes.len(), run.contacts.len()]);
    assert_eq!(run.events.len(), 1 + rows.iter().sum::<usize>());
}

fn damped(place: u32) -> System {
    let system = paper(0.35 + 0.05 * f64::from(place));
    let restitution = [0.8, 0.3, 0.0][place as usize % 3];
    system
        .pendulum_damping(0.1)
        .oscillator_damping(0.1)
        .force_amplitude(0.5)
        .restitution(restitution)
        .friction(0.3 * f64::from(place % 2))
        .build()
        .unwrap()
}

#[test]
fn what_is_copied_has_the_bits_of_what_is_computed() {
    let systems: Vec<System> = (0..60).map(damped).collect();
    let (mut copied, mut copied_windows, mut in_contact) = (0, 0, 0);
    for system in &systems {
        let mut options = RunOptions::periods(600);
        let all = computed(system, paper_start(), options);
        let run = go(system, paper_start(), options);
        assert_is(&run, &all);
        assert_eq!(run.impacts.len(), all.impacts.len());
        assert_eq!(run.stroboscopic.len(), 600);
        let is_copied = run.evaluations < all.evaluations / 2;
        copied += usize::from(is_copied);
        in_contact += usize::from(is_copied && run.contacts.len() > 100);
        // The last periods, from another section.
        options.section_phase = 1.0;
        let moved = computed(system, paper_start(), options);
        let window = go(system, paper_start(), options.keep(100));
        assert_is(&window, &moved);
        assert_eq!(window.stroboscopic.len(), 100);
        copied_windows += usize::from(window.evaluations < all.evaluations / 2);
        // Caps, within a cycle or not.
        options.max_events = 1000;
        assert_is(&go(system, paper_start(), options), &computed(system, paper_start(), options));
        let horizons = [
            Horizon::Impacts { count: 301, max_time: 3e3 },
            Horizon::Time(417.3 * system.drive_period()),
        ];
        for horizon in horizons {
            let options = RunOptions::until(horizon);
            let run = go(system, paper_start(), options);
            assert_is(&run, &computed(system, paper_start(), options));
        }
    }
    let count = [copied, copied_windows, in_contact];
    assert!(copied > 30 && copied_windows > 30 && in_contact > 3, "of 60: {count:?}");
    // Those that travel together, too.
    for keep in [600, 100, 3] {
        for (place, system) in systems.iter().enumerate() {
            let starts = [paper_start(); 9];
            let options = RunOptions::periods(600).keep(keep);
            let workers = Workers::new(Some(1)).unwrap();
            let runs = run_many(system, &starts, options, &workers, &CancelToken::never()).unwrap();
            let alone = go(system, paper_start(), options);
            for run in runs {
                let run = run.unwrap();
                assert!(run.impacts == alone.impacts && run.events == alone.events, "{place}");
                assert!(run.stroboscopic == alone.stroboscopic, "{place}");
                assert_eq!(run.final_state, alone.final_state);
            }
        }
    }
}

#[test]
fn what_is_copied_can_be_resumed_and_ended() {
    for place in (0..60).step_by(7) {
        let system = damped(place);
        let all = computed(&system, paper_start(), RunOptions::periods(900));
        let first = go(&system, paper_start(), RunOptions::periods(437));
        let rest = first.resume(RunOptions::periods(900), &CancelToken::never()).unwrap();
        let impacts: Vec<_> = first.impacts.iter().chain(&rest.impacts).copied().collect();
        let sections: Vec<_> = first.stroboscopic.iter().chain(&rest.stroboscopic).collect();
        assert!(impacts == all.impacts && sections.into_iter().eq(&all.sections));
        assert_eq!(rest.final_state.state, all.end);
        assert_in_order(&rest);
        // So long that it is copied in parts, between which the caller may end it.
        let counted = CancelToken::after(1 << 40);
        run(&system, paper_start(), RunOptions::periods(900), &counted).unwrap();
        let cancel = CancelToken::after((1 << 40) - counted.asks_left() + 3);
        let long = RunOptions { max_events: u64::MAX, ..RunOptions::periods(1 << 40) };
        let ended = run(&system, paper_start(), long, &cancel).unwrap();
        assert_eq!(ended.stop_reason, StopReason::Interrupted);
        assert_in_order(&ended);
    }
}

#[test]
fn chatter_is_copied_too() {
    let mut copied = 0;
    for (place, drive_frequency) in [0.2, 0.25, 0.3, 0.35, 0.45, 0.5].into_iter().enumerate() {
        let system =
            chattering(drive_frequency).friction(0.2 * (place % 2) as f64).build().unwrap();
        let options = RunOptions::periods(300);
        let run = go(&system, paper_start(), options);
        let all = computed(&system, paper_start(), options);
        assert_is(&run, &all);
        let chatters = run.contacts.iter().filter(|c| c.impacts_skipped > 0.0).count();
        assert!(chatters > 290, "{chatters} at {drive_frequency}");
        copied += usize::from(run.evaluations < all.evaluations / 2);
        assert_is(&go(&system, paper_start(), options.keep(40)), &all);
    }
    assert!(copied > 3, "{copied} of 6");
}

#[test]
fn random_motions_keep_their_bits() {
    let mut draw = Draw::new(77);
    for _ in 0..60 {
        let system = draw.system();
        let start = draw.start(&system);
        let options = RunOptions::periods(300);
        let all = computed(&system, start, options);
        assert_is(&go(&system, start, options), &all);
        assert_is(&go(&system, start, options.keep(50)), &all);
    }
}
