//! Nothing comes after the end of a run, and its caller can end it anywhere.

use vibroimpact::{
    CancelToken, Contact, Event, Horizon, ImpactLaw, Observer, Run, RunOptions, Simulation, State,
    StopReason, System, run,
};

use super::paper;

/// Panics if an event of the run is after its end, by its time or its clock, or after the next one.
fn assert_in_order(run: &Run) {
    assert!(run.events.windows(2).all(|e| e[0].time <= e[1].time), "{:?}", run.events);
    let end = (run.final_state.clock.period, run.final_state.clock.time_in_period);
    let impacts = run.impacts.iter().map(|i| (i.period, i.time_in_period));
    let grazes = run.grazes.iter().map(|g| (g.period, g.time_in_period));
    let contacts = run.contacts.iter().map(|c| (c.period, c.time_in_period));
    for clock in impacts.chain(grazes).chain(contacts) {
        assert!(clock <= end, "{clock:?} after {end:?}");
    }
}

/// With each drive period the force throws the tip off a wall so suddenly that it grazes it an
/// instant after the period has begun.
fn thrown_off() -> (System, State) {
    let system = System::builder()
        .mass_ratio(2.0)
        .frequency_ratio(0.0)
        .restitution(0.7547233969323223)
        .gap(-0.3708807217032283)
        .drive_frequency(2.165870837738557)
        .pendulum_damping(0.29410088100928095)
        .oscillator_damping(1.0117108305817997)
        .moment_amplitude(-5.816062023054516e154)
        .force_amplitude(5.0)
        .contact(Contact::Direct)
        .law(ImpactLaw::Energetic)
        .build()
        .unwrap();
    let start = State {
        x1: 0.36268546703589344,
        v1: -1.8893605763024537,
        x2: 0.9915200121219477,
        v2: -0.494456036762569,
    };
    (system, start)
}

/// The graze was told with a time one last digit after the end's.
#[test]
fn a_graze_just_after_the_end_belongs_to_what_follows() {
    let (system, start) = thrown_off();
    let go = |periods| {
        let options = RunOptions { max_events: 57, ..RunOptions::periods(periods) };
        run(&system, start, options, &CancelToken::never()).unwrap()
    };
    let whole = go(6);
    assert_in_order(&whole);
    assert!(whole.grazes.len() > 4, "{:?}", whole.grazes);
    for periods in 1..6 {
        let part = go(periods);
        assert_in_order(&part);
        let rest = part.resume(RunOptions::periods(6), &CancelToken::never()).unwrap();
        assert_in_order(&rest);
        assert_eq!([&part.grazes[..], &rest.grazes].concat(), whole.grazes, "{periods}");
        assert_eq!(rest.final_state, whole.final_state);
    }
}

/// A run that ends at one of its events, or a last digit beside it, has those before and, going on,
/// the others.
#[test]
fn a_run_may_end_at_any_event() {
    let slides = paper().friction(0.4).restitution(0.3).force_amplitude(0.5).build().unwrap();
    let strikes = paper().drive_frequency(2.6).build().unwrap();
    for (system, time) in [(slides, 120.0), (strikes, 60.0)] {
        let options = |time| RunOptions::until(Horizon::Time(time));
        let whole = run(&system, super::start(), options(time), &CancelToken::never()).unwrap();
        assert!(whole.events.len() > 10, "{}", whole.events.len());
        for event in &whole.events[..whole.events.len() - 1] {
            for end in [event.time.next_down(), event.time, event.time.next_up()] {
                let part =
                    run(&system, super::start(), options(end), &CancelToken::never()).unwrap();
                assert_in_order(&part);
                let rest = part.resume(options(time), &CancelToken::never()).unwrap();
                assert_in_order(&rest);
                // One at the end to rounding is told there.
                assert_eq!(part.impacts.len() + rest.impacts.len(), whole.impacts.len());
                assert_eq!([&part.contacts[..], &rest.contacts].concat(), whole.contacts);
                assert_eq!(rest.final_state, whole.final_state);
            }
        }
    }
}

/// Where rounding decides between the modes of contact, time is moved on by 1e-15: beyond the end,
/// too.
#[test]
fn a_run_of_no_length_has_no_event_after_it() {
    let system = System::builder()
        .mass_ratio(3.66e-4)
        .frequency_ratio(0.0)
        .restitution(0.0)
        .gap(0.0)
        .drive_frequency(4.0)
        .pendulum_damping(0.765)
        .oscillator_damping(6.9e-307)
        .build()
        .unwrap();
    let start = State { x1: 0.0, v1: -2.0, x2: 0.0, v2: -2.0 };
    let whole = run(&system, start, RunOptions::periods(1), &CancelToken::never()).unwrap();
    for horizon in [Horizon::Periods(0), Horizon::Time(0.0), Horizon::Time(1e-15)] {
        let none = run(&system, start, RunOptions::until(horizon), &CancelToken::never()).unwrap();
        assert_in_order(&none);
        assert_eq!(none.stop_reason, StopReason::Completed);
        let rest = none.resume(RunOptions::periods(1), &CancelToken::never()).unwrap();
        assert_in_order(&rest);
        assert_eq!([&none.contacts[..], &rest.contacts].concat(), whole.contacts);
        assert_eq!(rest.final_state, whole.final_state);
    }
}

/// The clock of this impact is one of two with the same value: the stop had the other, which reads
/// as earlier.
#[test]
fn a_stop_at_an_impact_has_its_clock() {
    let system = System::builder()
        .mass_ratio(0.0)
        .frequency_ratio(0.29411764705882354)
        .restitution(1.0)
        .gap(1.0)
        .drive_frequency(4.0)
        .pendulum_damping(0.5119020370794232)
        .moment_amplitude(-2.0)
        .phase(-7.0)
        .contact(Contact::Direct)
        .build()
        .unwrap();
    let start = State { x1: -2.0, v1: -2.0, x2: -3.0, v2: -2.0 };
    for count in 1..40 {
        let horizon = Horizon::Impacts { count, max_time: 1e3 };
        assert_in_order(
            &run(&system, start, RunOptions::until(horizon), &CancelToken::never()).unwrap(),
        );
    }
}

/// Forces next to nothing: what the search finds beyond its flight is searched for again after the
/// graze only.
#[test]
fn a_search_that_begins_again_does_so_after_the_graze() {
    let system = System::builder()
        .mass_ratio(2.0)
        .frequency_ratio(3.0)
        .restitution(0.0)
        .gap(0.0)
        .drive_frequency(4.0)
        .oscillator_damping(1.3068894483863585)
        .moment_amplitude(1.485753562534434e-308)
        .law(ImpactLaw::Energetic)
        .build()
        .unwrap();
    let start = State { x1: 0.0, v1: 0.0, x2: 0.0, v2: 0.0 };
    let options = RunOptions { max_events: 60, ..RunOptions::periods(6) };
    assert_in_order(&run(&system, start, options, &CancelToken::never()).unwrap());
}

/// Counts the sections between two asks of the token, which ends the simulation with the hundredth.
struct Patience {
    cancel: CancelToken,
    left: u64,
    sections: u64,
    most: u64,
    since: u64,
}

impl Observer for Patience {
    const SECTIONS: bool = true;

    fn section(&mut self, k: i64, _: &State) {
        if self.left != self.cancel.asks_left() {
            (self.left, self.since) = (self.cancel.asks_left(), 0);
        }
        self.sections += 1;
        self.since += 1;
        self.most = self.most.max(self.since);
        assert_eq!(k.unsigned_abs(), self.sections);
    }
}

impl Default for Patience {
    fn default() -> Self {
        Self { cancel: CancelToken::after(100), left: 100, sections: 0, most: 0, since: 0 }
    }
}

/// Motions that stay clear of contact for ever, that lie still or creep: the search was led out of
/// its flight to a contact at t = 1e17, up to which all was passed in one step.
#[test]
fn no_step_is_so_long_that_the_caller_cannot_end_it() {
    let still = System::builder()
        .mass_ratio(0.244)
        .frequency_ratio(0.0)
        .restitution(1.0)
        .gap(1.0)
        .drive_frequency(4.0)
        .pendulum_damping(1.5)
        .oscillator_damping(0.65)
        .friction(3.0)
        .phase(-2.9)
        .law(ImpactLaw::Energetic);
    let far = State { x1: -131_058.937_5, v1: -0.8, x2: 0.0, v2: -1.5 };
    let creeps = paper().gap(1.0).moment_amplitude(0.0).pendulum_damping(3.5e30);
    let clear = paper().gap(3.0);
    let cases = [
        (still.build().unwrap(), far),
        (creeps.clone().build().unwrap(), super::start()),
        (creeps.frequency_ratio(0.0).oscillator_damping(1.0).build().unwrap(), far),
        (clear.clone().build().unwrap(), super::start()),
        (clear.pendulum_damping(3.5e30).oscillator_damping(3.5e30).build().unwrap(), far),
    ];
    for (system, start) in cases {
        let mut patience = Patience::default();
        let horizon = Horizon::Periods(1_000_000_000);
        let mut simulation =
            Simulation::new(&system, start).unwrap().until(horizon).cancel_with(&patience.cancel);
        let last = std::iter::from_fn(|| simulation.advance(&mut patience)).last();
        match last {
            Some(Ok(Event::Stop(stop))) => {
                assert_eq!(stop.reason, StopReason::Interrupted, "{system:?}");
                // What is done is kept.
                assert_eq!(stop.clock.period.unsigned_abs(), patience.sections);
            }
            other => panic!("{other:?}"),
        }
        assert!(patience.most < 600, "{} sections in one step of {system:?}", patience.most);
    }
}

/// What happens at a graze that is no number, under forces beyond reckoning: a failed computation.
#[test]
fn a_graze_that_is_no_number_is_not_waited_for() {
    let system = System::builder()
        .mass_ratio(0.0)
        .frequency_ratio(0.0)
        .restitution(0.0)
        .gap(-0.4647058823529412)
        .drive_frequency(0.09411764705882353)
        .pendulum_damping(0.03529411764705882)
        .moment_amplitude(-1e154)
        .force_amplitude(-1e154)
        .phase(-5e-324)
        .contact(Contact::Direct)
        .law(ImpactLaw::Energetic)
        .build()
        .unwrap();
    let start = State { x1: 1.9932860303654536, v1: 2.0, x2: 3.457991912718395, v2: 0.0 };
    let mut patience = Patience::default();
    let mut simulation = Simulation::new(&system, start).unwrap().cancel_with(&patience.cancel);
    let last = std::iter::from_fn(|| simulation.advance(&mut patience)).last();
    assert!(last.is_some());
    assert!(patience.most < 600, "{} sections in one step", patience.most);
}

/// Velocities of a few of the least numbers there are: bounces too low to tell were carried on to
/// an end before the graze between them.
#[test]
fn chatter_does_not_end_before_its_last_bounce() {
    let constant = |builder: vibroimpact::SystemBuilder| {
        builder.gap(0.0).drive_frequency(0.0).contact(Contact::Direct).law(ImpactLaw::Energetic)
    };
    let rotor = constant(System::builder())
        .mass_ratio(0.41972937814351785)
        .frequency_ratio(0.0)
        .restitution(0.7463371630820252)
        .pendulum_damping(0.3252572855163687)
        .oscillator_damping(1.0402837364358688)
        .moment_amplitude(1e-323);
    let wall = constant(System::builder())
        .mass_ratio(0.0)
        .frequency_ratio(2.3049802659780583)
        .restitution(0.6255501532544128)
        .pendulum_damping(0.29645935954206737);
    for (builder, [x1, v1, x2, v2]) in
        [(rotor, [-5e-323, 0.0, -5e-323, 0.0]), (wall, [-9e-323, 1e-323, -9e-323, -9.4e-323])]
    {
        let options = RunOptions { max_events: 300, ..RunOptions::until(Horizon::Time(30.0)) };
        let start = State { x1, v1, x2, v2 };
        let run = run(&builder.build().unwrap(), start, options, &CancelToken::never()).unwrap();
        assert!(!run.grazes.is_empty() && !run.contacts.is_empty(), "{:?}", run.events);
        assert_in_order(&run);
    }
}
