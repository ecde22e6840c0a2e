//! Random admissible systems over the whole range of the parameters, run for 50 drive periods each:
//! every run must end with a typed reason, finite, and without penetration (docs/robustness.md).
//!
//! System number `index` has its own stream of ChaCha8, so that it is the same whatever the number
//! of threads and systems.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::fmt;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use vibroimpact::{CancelToken, Contact, EventKind, RunOptions, State, StopReason, System, run};

/// Drive periods of a run.
pub const PERIODS: i64 = 50;
/// Times at which the gap is looked at, besides those next to every event.
const LOOKS: usize = 2_000;
/// Allowed penetration, in units of max(1, |x1|, |x2|).
pub const PENETRATION: f64 = 1e-12;
/// Allowed change of energy that no work explains, in units of all works and the energies.
pub const IMBALANCE: f64 = 1e-10;

/// System number `index` of a seed, and its start.
pub fn draw(seed: u64, index: u64) -> (System, State) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(index);
    loop {
        if let Some(drawn) = Drawer(&mut rng).draw() {
            return drawn;
        }
    }
}

struct Drawer<'a>(&'a mut ChaCha8Rng);

impl Drawer<'_> {
    fn uniform(&mut self, from: f64, to: f64) -> f64 {
        self.0.random_range(from..to)
    }

    /// One in ten is the special value itself.
    fn or(&mut self, special: f64, value: f64) -> f64 {
        if self.0.random_bool(0.1) { special } else { value }
    }

    /// Uniform, or in one of three uniform in the logarithm, or a special value.
    fn positive(&mut self, most: f64, special: f64) -> f64 {
        let value = if self.0.random_bool(1.0 / 3.0) {
            most * 10f64.powf(self.uniform(-4.0, 0.0))
        } else {
            self.uniform(0.0, most)
        };
        self.or(special, value)
    }

    fn draw(&mut self) -> Option<(System, State)> {
        let direct = self.0.random_bool(0.2);
        let restitution = self.uniform(0.0, 1.0);
        let restitution = self.or(0.0, restitution);
        let system = System::builder()
            .mass_ratio(self.positive(100.0, 0.0))
            .frequency_ratio(self.positive(10.0, 0.0))
            .restitution(self.or(1.0, restitution))
            .gap(self.uniform(-0.5, 1.0))
            .drive_frequency(self.uniform(0.05, 20.0))
            .pendulum_damping(self.positive(3.0, 0.0))
            .oscillator_damping(self.positive(3.0, 0.0))
            .moment_amplitude(self.positive(10.0, 0.0))
            .force_amplitude(self.positive(10.0, 0.0))
            .friction(if direct { 0.0 } else { self.positive(5.0, 0.0) })
            .phase(self.uniform(0.0, TAU))
            .contact(if direct { Contact::Direct } else { Contact::Oblique })
            .build()
            .ok()?;
        let x1 = self.uniform(-PI, PI);
        let tip = if direct { x1 } else { x1.sin() };
        // One start in five on the contact, half of these with g' = 0.
        let touching = self.0.random_bool(0.2);
        let apart = if touching { 0.0 } else { self.uniform(0.0, 2.0) };
        let x2 = tip - system.gap() + apart;
        let v1 = self.uniform(-3.0, 3.0);
        let v1 = self.or(0.0, v1);
        let slope = if direct { 1.0 } else { x1.cos() };
        let v2 =
            if touching && self.0.random_bool(0.5) { v1 * slope } else { self.uniform(-3.0, 3.0) };
        let v2 = self.or(0.0, v2);
        Some((system, State::new(x1, v1, x2, v2).ok()?))
    }
}

/// How one run ended.
#[derive(Debug, Clone)]
pub struct Outcome {
    pub index: u64,
    /// Stop reason, or the error's text.
    pub end: String,
    pub failed: bool,
    pub impacts: u64,
    pub evaluations: u64,
    /// Numbers of chatter, slide, stick and release events.
    pub contacts: [u64; 4],
    /// Largest g/max(1, |x1|, |x2|) seen.
    pub penetration: f64,
    /// What of the energy no work explains, in units of all works and the energies.
    pub imbalance: f64,
    pub finite: bool,
}

/// Runs system number `index`, up to so many events.
pub fn examine(seed: u64, index: u64, most_events: u64) -> Outcome {
    let (system, start) = draw(seed, index);
    let mut options = RunOptions::periods(PERIODS);
    options.max_events = most_events;
    let mut outcome = Outcome {
        index,
        end: String::new(),
        failed: false,
        impacts: 0,
        evaluations: 0,
        contacts: [0; 4],
        penetration: f64::NEG_INFINITY,
        imbalance: 0.0,
        finite: true,
    };
    let run = match run(&system, start, options, &CancelToken::never()) {
        Ok(run) => run,
        Err(error) => {
            outcome.end = error.to_string().split(" after ").next().unwrap_or_default().into();
            outcome.failed = true;
            return outcome;
        }
    };
    outcome.end = run.stop_reason.name().into();
    outcome.impacts = run.impact_count;
    outcome.evaluations = run.evaluations;
    for contact in &run.contacts {
        let kind = contact.kind;
        let column = if kind == EventKind::Chatter as i64 {
            0
        } else if kind == EventKind::Stick as i64 {
            2
        } else if kind == EventKind::Release as i64 {
            3
        } else {
            1
        };
        outcome.contacts[column] += 1;
    }
    if !matches!(run.stop_reason, StopReason::Jammed | StopReason::Painleve) {
        // There velocity and force grow beyond all bounds.
        let audit = run.energy_audit(&CancelToken::never()).unwrap();
        let size = audit.total + audit.energy_start.abs() + audit.energy_end.abs();
        outcome.imbalance = audit.residual().abs() / size.max(f64::MIN_POSITIVE);
    }
    let (from, to) = (run.kept_from(), run.final_state.time);
    let step = (to - from) / LOOKS as f64;
    let mut times: Vec<f64> = (0..=LOOKS).map(|i| (from + i as f64 * step).min(to)).collect();
    let stride = run.events.len() / LOOKS + 1;
    for pair in run.events.windows(2).step_by(stride) {
        let (a, b) = (pair[0].time, pair[1].time);
        times.extend([0.0, 1e-6, 0.01, 0.5, 0.99, 1.0].map(|part| a + part * (b - a)));
    }
    // Rounding may lead out of the window.
    times.iter_mut().for_each(|time| *time = time.clamp(from, to));
    times.sort_by(f64::total_cmp);
    let Some(states) = run.trajectory(&times) else {
        outcome.end = format!("window {from} {to} {:?} {:?}", run.stop_reason, run.final_state);
        outcome.failed = true;
        return outcome;
    };
    for state in states.iter().chain(&run.stroboscopic) {
        let [x1, v1, x2, v2] = *state;
        let finite = state.iter().all(|c| c.is_finite());
        outcome.finite &= finite;
        let gap = system.gap_function(&State { x1, v1, x2, v2 });
        let size = x1.abs().max(x2.abs()).max(1.0);
        outcome.penetration = outcome.penetration.max(gap / size);
    }
    outcome
}

/// What many runs came to.
#[derive(Debug, Default)]
pub struct Tally {
    pub ends: BTreeMap<String, (u64, Vec<u64>)>,
    pub failed: Vec<Outcome>,
    pub impacts: u64,
    pub most_impacts: u64,
    pub contacts: [u64; 4],
    pub penetration: f64,
    pub imbalance: f64,
}

/// Systems whose numbers are listed for each way to end.
const LISTED: usize = 8;

/// Runs the systems number 0 ... count - 1.
pub fn examine_all(seed: u64, count: u64, most_events: u64) -> Tally {
    let outcomes: Vec<Outcome> =
        (0..count).into_par_iter().map(|index| examine(seed, index, most_events)).collect();
    let mut tally = Tally { penetration: f64::NEG_INFINITY, ..Tally::default() };
    for outcome in outcomes {
        let (number, listed) = tally.ends.entry(outcome.end.clone()).or_default();
        *number += 1;
        if listed.len() < LISTED {
            listed.push(outcome.index);
        }
        tally.impacts += outcome.impacts;
        tally.most_impacts = tally.most_impacts.max(outcome.impacts);
        for (sum, n) in tally.contacts.iter_mut().zip(outcome.contacts) {
            *sum += n;
        }
        tally.penetration = tally.penetration.max(outcome.penetration);
        tally.imbalance = tally.imbalance.max(outcome.imbalance);
        let wrong = outcome.penetration > PENETRATION || outcome.imbalance > IMBALANCE;
        if outcome.failed || !outcome.finite || wrong {
            tally.failed.push(outcome);
        }
    }
    tally
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (end, (number, listed)) in &self.ends {
            writeln!(f, "{number:>8} {end}, e.g. {listed:?}")?;
        }
        let [chatters, slides, sticks, releases] = self.contacts;
        writeln!(f, "{} impacts, at most {} in one run", self.impacts, self.most_impacts)?;
        writeln!(f, "{chatters} chatters, {slides} slides, {sticks} sticks, {releases} releases")?;
        writeln!(f, "deepest penetration {:e} max(1, |x1|, |x2|)", self.penetration)?;
        writeln!(f, "energy explained but for {:e} of all works", self.imbalance)?;
        writeln!(f, "{} failures", self.failed.len())?;
        for outcome in &self.failed {
            writeln!(f, "  {outcome:?}")?;
        }
        Ok(())
    }
}
