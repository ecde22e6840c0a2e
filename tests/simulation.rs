//! Whole runs: starts, caps and stop reasons, chatter, what is kept and resumed, sections, exact
//! third-party values, and invariants on random systems (docs/theory.md, sections 2 to 6).

mod chatter;
mod contact;
mod energy;
mod invariants;
mod kept;
mod labels;
mod loads;
mod repeats;
mod stops;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vibroimpact::{
    CancelToken, Contact, Horizon, Run, RunOptions, State, System, SystemBuilder, run,
};

fn state(x1: f64, v1: f64, x2: f64, v2: f64) -> State {
    State::new(x1, v1, x2, v2).unwrap()
}

fn go(system: &System, start: State, options: RunOptions) -> Run {
    run(system, start, options, &CancelToken::never()).unwrap()
}

fn until(time: f64) -> RunOptions {
    RunOptions::until(Horizon::Time(time))
}

/// The paper's system: mbar 0.6, omega0 2, r 0.8, gap 0.5, f1 1.
fn paper(drive_frequency: f64) -> SystemBuilder {
    System::builder()
        .mass_ratio(0.6)
        .frequency_ratio(2.0)
        .restitution(0.8)
        .gap(0.5)
        .drive_frequency(drive_frequency)
        .moment_amplitude(1.0)
}

fn paper_start() -> State {
    state(0.0, 0.5, 0.0, 0.0)
}

/// A ball that falls with acceleration `gravity` onto a wall at x1 = 0.
fn ball(gravity: f64, restitution: f64) -> System {
    System::builder()
        .mass_ratio(0.0)
        .frequency_ratio(0.0)
        .restitution(restitution)
        .gap(0.0)
        .drive_frequency(0.0)
        .moment_amplitude(gravity)
        .contact(Contact::Direct)
        .build()
        .unwrap()
}

/// Fig. 7(c)'s system: complete chatter and sustained contact in every period at low frequencies
/// (docs/theory.md, section 5 and E8).
fn chattering(drive_frequency: f64) -> SystemBuilder {
    paper(drive_frequency).pendulum_damping(0.1).oscillator_damping(0.1).force_amplitude(1.5)
}

/// Random systems of the paper's kind, each with a start that is apart.
struct Draw(ChaCha8Rng);

impl Draw {
    fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0.random_range(low..high)
    }

    /// Zero in half of the cases.
    fn some(&mut self, high: f64) -> f64 {
        if self.0.random_bool(0.5) { self.uniform(0.0, high) } else { 0.0 }
    }

    fn system(&mut self) -> System {
        System::builder()
            .mass_ratio(self.uniform(0.1, 3.0))
            .frequency_ratio(self.uniform(0.5, 4.0))
            .restitution(self.uniform(0.3, 1.0))
            .gap(self.uniform(-0.2, 0.9))
            .drive_frequency(self.uniform(0.4, 4.0))
            .pendulum_damping(self.some(0.2))
            .oscillator_damping(self.some(0.2))
            .moment_amplitude(self.uniform(0.2, 3.0))
            .force_amplitude(self.some(2.0))
            .friction(self.some(1.0))
            .phase(self.uniform(-3.0, 3.0))
            .build()
            .unwrap()
    }

    fn start(&mut self, system: &System) -> State {
        loop {
            let start = state(
                self.uniform(-1.0, 1.0),
                self.uniform(-1.0, 1.0),
                self.uniform(-1.0, 1.0),
                self.uniform(-1.0, 1.0),
            );
            if system.gap_function(&start) < -0.05 {
                return start;
            }
        }
    }
}
