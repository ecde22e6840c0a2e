//! What all targets share: numbers, systems, states and options made from bytes, and what has to
//! hold after an execution.

mod draw;
mod memory;

pub use draw::Draw;
pub use memory::execution;

use std::sync::LazyLock;

use vibroimpact::{
    CancelToken, Event, EventRecord, ImpactLaw, Observer, Run, RunError, SimulationError, State,
    System,
};

/// Most events of a run, so that an execution takes about a millisecond.
pub const MOST_EVENTS: u64 = 60;
/// Local flights after which a run is asked to end.
pub const MOST_FLIGHTS: u64 = 100;

/// Most sections in one leg: a local flight lasts two turns of the fastest motion, a rest 256 of
/// them.
const MOST_SECTIONS: u32 = 1_000;

/// Ends a simulation after so many flights, and looks at its sections.
pub struct Limited {
    /// Counts the local flights, and ends them.
    pub cancel: CancelToken,
    /// A section that is not finite, which a run that comes to its end must not have.
    pub bad_section: Option<State>,
    last: i64,
    /// Flights left at the last section, and sections since.
    left: u64,
    unasked: u32,
}

impl Limited {
    /// With so many local flights left.
    pub fn to(flights: u64) -> Self {
        let cancel = CancelToken::after(flights);
        Self { cancel, bad_section: None, last: 0, left: flights, unasked: 0 }
    }
}

impl Observer for Limited {
    const SECTIONS: bool = true;

    fn section(&mut self, k: i64, state: &State) {
        assert!(k > self.last, "section {k} after {}", self.last);
        self.last = k;
        if self.left != self.cancel.asks_left() {
            (self.left, self.unasked) = (self.cancel.asks_left(), 0);
        }
        self.unasked += 1;
        assert!(self.unasked < MOST_SECTIONS, "the caller is not asked");
        if state.to_array().iter().any(|x| !x.is_finite()) {
            self.bad_section = Some(*state);
        }
    }
}

/// All numbers of a motion: those of the system that may grow beyond bounds, and the state.
pub fn numbers(system: &System, state: &State) -> [f64; 13] {
    [
        system.mass_ratio(),
        system.frequency_ratio(),
        system.drive_frequency(),
        system.pendulum_damping(),
        system.oscillator_damping(),
        system.moment_amplitude(),
        system.force_amplitude(),
        system.static_moment(),
        system.static_force(),
        state.x1,
        state.v1,
        state.x2,
        state.v2,
    ]
}

/// Whether the tip may turn so often in one local flight that a few flights take longer than an
/// execution may. Where it turns beyond counting the search ends at once, with an error.
pub fn is_hectic(system: &System, start: &State) -> bool {
    let fastest = system.frequency_ratio().max(system.drive_frequency()).max(1.0);
    let span = 4.0 * std::f64::consts::PI / fastest;
    let loads = system.moment_amplitude().abs()
        + system.force_amplitude().abs()
        + system.static_moment().abs()
        + system.static_force().abs();
    let tip = start.v1.abs()
        + system.frequency_ratio() * start.x1.abs()
        + loads * span.max(1.0)
        // A free rotor under a slow load.
        + loads / system.frequency_ratio().max(system.drive_frequency()).max(0.1);
    let both = tip + start.v2.abs() + start.x2.abs();
    // Body 2 turns the tip only where they meet.
    [tip, both].iter().any(|speed| (60.0..1e80).contains(&(speed * span)))
}

/// Whether following a motion for so many drive periods takes longer than an execution may: calls
/// that nobody can end are not made then.
pub fn is_long(system: &System, start: &State, periods: f64) -> bool {
    let (natural, drive) = (system.frequency_ratio(), system.drive_frequency());
    let decay = 2.0 * (system.pendulum_damping() * natural).max(system.oscillator_damping());
    let flights = natural.max(drive).max(decay).max(1.0) * periods * system.drive_period();
    // Such laws may create energy without bound.
    let gains = matches!(system.law(), ImpactLaw::Paper | ImpactLaw::Newton);
    gains || is_hectic(system, start) || flights.is_nan() || flights > 1e3
}

/// Prints what was drawn if `SHOW` is set: to see what a saved input stands for.
pub fn shown<T: std::fmt::Debug>(drawn: T) -> T {
    static SHOW: LazyLock<bool> = LazyLock::new(|| std::env::var_os("SHOW").is_some());
    if *SHOW {
        eprintln!("{drawn:?}");
    }
    drawn
}

/// Ends a run after some thousand flights.
pub fn enough() -> CancelToken {
    CancelToken::after(2048)
}

/// Panics unless all values are finite.
pub fn assert_finite(what: &str, values: &[f64]) {
    assert!(values.iter().all(|v| v.is_finite()), "{what} = {values:?}");
}

/// Panics if one of the values is NaN.
pub fn assert_numbers(what: &str, values: &[f64]) {
    assert!(!values.iter().any(|v| v.is_nan()), "{what} = {values:?}");
}

/// An event that is not finite.
pub fn check_event(event: &Event) {
    let (time, state) = match event {
        Event::Impact(e) => {
            assert_finite("state before an impact", &e.pre.to_array());
            assert_numbers(
                "impulses and energies",
                &[
                    e.impact.impulse_normal,
                    e.impact.impulse_tangential,
                    e.impact.energy_loss,
                    e.impact.friction_loss,
                ],
            );
            (e.time, e.post)
        }
        Event::Graze(e) => (e.time, e.state),
        Event::Chatter(e) => {
            assert_finite("chatter", &[e.impacts_skipped, e.time_jump, e.error]);
            (e.time, e.state)
        }
        Event::SlidePositive(e) | Event::SlideNegative(e) | Event::Stick(e) | Event::Release(e) => {
            assert_numbers("contact force", &[e.force.normal, e.force.tangential]);
            (e.time, e.state)
        }
        Event::Stop(e) => (e.time, e.state),
        _ => return,
    };
    assert_finite("time of an event", &[time]);
    assert_finite("state at an event", &state.to_array());
    assert!(event.clock().time_in_period >= 0.0, "{event:?}");
}

/// An error that says nothing.
pub fn check_error(error: &SimulationError) {
    assert!(!error.to_string().is_empty());
}

/// The tables of a run, which came to its end or was cut short.
pub fn check_run(run: &Run) {
    let end = &run.final_state;
    assert_finite("time at the end", &[end.time, run.kept_from()]);
    assert_finite("state at the end", &end.state.to_array());
    for section in &run.stroboscopic {
        assert_finite("section", section);
    }
    for i in &run.impacts {
        assert_finite(
            "impact",
            &[
                i.time,
                i.time_in_period,
                i.x1,
                i.v1_pre,
                i.v1_post,
                i.x2,
                i.v2_pre,
                i.v2_post,
                i.phase,
            ],
        );
        assert_numbers("impact", &[i.impulse_normal, i.impulse_tangential, i.energy_loss]);
    }
    for c in &run.contacts {
        assert_finite("contact", &[c.time, c.time_in_period, c.x1, c.v1, c.x2, c.v2]);
    }
    for g in &run.grazes {
        assert_finite("graze", &[g.time, g.time_in_period]);
    }
    let order = |e: &[EventRecord]| e[0].time <= e[1].time;
    assert!(run.events.windows(2).all(order), "{:?}", run.events);
    assert!(run.kept_from() <= end.time, "{} > {}", run.kept_from(), end.time);
}

/// What is left of a run: itself, or what was done before it failed.
pub fn made(run: Result<Run, RunError>) -> Option<Run> {
    match run {
        Ok(run) => Some(run),
        Err(error) => {
            assert!(!error.to_string().is_empty());
            None
        }
    }
}
