//! Random admissible systems, 50 drive periods each: how every run ends (docs/robustness.md).
//!
//! `cargo run --release --example random_systems -- [--systems N] [--seed S] [--only INDEX]`
//!
//! Ends with status 1 if a run fails, is not finite or penetrates.

#[path = "../tests/support/random_systems.rs"]
mod random_systems;

use std::error::Error;
use std::process::ExitCode;

use vibroimpact::Simulation;

/// Far above what 50 periods need, unless r = 1.
const MOST_EVENTS: u64 = 1_000_000;

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let (mut systems, mut seed, mut only) = (100_000, 1, None);
    let mut arguments = std::env::args().skip(1);
    while let Some(flag) = arguments.next() {
        let value = arguments.next().ok_or_else(|| format!("{flag} needs a value"))?;
        match flag.as_str() {
            "--systems" => systems = value.parse()?,
            "--seed" => seed = value.parse()?,
            "--only" => only = Some(value.parse()?),
            _ => return Err(format!("unknown argument {flag}").into()),
        }
    }
    if let Some(index) = only {
        let (system, start) = random_systems::draw(seed, index);
        println!("{system:#?}\n{start:?}");
        let events = Simulation::new(&system, start)?.periods(random_systems::PERIODS as u32);
        let tail: Vec<_> = events.enumerate().collect();
        for (number, event) in &tail[tail.len().saturating_sub(10)..] {
            println!("{number}: {event:?}");
        }
        println!("{:#?}", random_systems::examine(seed, index, MOST_EVENTS));
        return Ok(ExitCode::SUCCESS);
    }
    let tally = random_systems::examine_all(seed, systems, MOST_EVENTS);
    print!("seed {seed}, {systems} systems\n{tally}");
    Ok(if tally.failed.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
