//! The contact audit (docs/contact-audit.md): random flights, the library's first contact against
//! an independent dense search in double-double arithmetic.
//!
//! `cargo run --release --example contact_audit -- [--flights N] [--seed S] [--loads yes]
//! [--structures by-modes | coupled] [--csv FILE]`
//!
//! With `--loads yes` bodies may have constant loads; with `--structures` the flights are those of
//! linear structures with a stop, and there is no FILE. FILE receives all disagreements and 10,000
//! flights at equal distances, for the referee in ball arithmetic:
//! `cd tests && python -m reference.certify FILE`. Ends with status 1 if any flight disagrees.

#[path = "../tests/support/audit.rs"]
mod audit;

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::process::ExitCode;

/// Flights written for the referee besides the disagreements.
const ROWS: u64 = 10_000;

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let (mut flights, mut seed, mut loads, mut csv) = (1_000_000, 1, false, None);
    let mut structures = None;
    let mut arguments = std::env::args().skip(1);
    while let Some(flag) = arguments.next() {
        let value = arguments.next().ok_or_else(|| format!("{flag} needs a value"))?;
        match flag.as_str() {
            "--flights" => flights = value.parse()?,
            "--seed" => seed = value.parse()?,
            "--loads" => loads = value == "yes",
            "--structures" if ["by-modes", "coupled"].contains(&value.as_str()) => {
                structures = Some(value == "coupled");
            }
            "--csv" => csv = Some(value),
            _ => return Err(format!("unknown argument {flag}").into()),
        }
    }
    if let Some(coupled) = structures {
        let tally = audit::structures::audit_structures(seed, coupled, flights);
        println!(
            "structures, seed {seed}{}\n{tally}",
            if coupled { ", coupled modes" } else { "" }
        );
        let agrees = tally.disagreements.is_empty();
        return Ok(if agrees { ExitCode::SUCCESS } else { ExitCode::FAILURE });
    }
    let tally = audit::audit(audit::Flights { seed, loads }, flights, ROWS);
    println!("seed {seed}{}\n{tally}", if loads { ", with constant loads" } else { "" });
    if let Some(path) = csv {
        let mut file = BufWriter::new(File::create(path)?);
        writeln!(file, "{}", audit::HEADER)?;
        for (_, row) in &tally.rows {
            writeln!(file, "{row}")?;
        }
        file.flush()?;
    }
    Ok(if tally.disagreements.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
