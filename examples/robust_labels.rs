//! How many labels are right (docs/labels.md): over the frequencies of four diagrams of Han, Jin & Hu
//! (2004) and over random systems of all regimes, laws and dampings, the label of 600 drive periods
//! against what the motion is found to be afterwards.
//!
//! A motion's label is *robust* if the largest Lyapunov exponents over the first and over the last
//! 10,000 of 20,000 further periods agree with it, and if the motion has it after them. Motions that
//! are still on their way need not keep their label, and are left out: those that change after the
//! first 10,000 periods, those that seem chaotic for 200 of the first 2,000, or from the beginning up to
//! any later moment among them, and later no more, and those that strike more or less often in the run than
//! the periodic motion they end on.
//!
//! `cargo run --release --example robust_labels -- [--every N] [--systems N] [--seed N] [--shift S]
//! [--truth FILE] [--misses yes]`
//!
//! A seed other than 1 draws other random systems, a shift between 0 and 1 takes frequencies between
//! those of the tables: motions that no rule was made with.
//!
//! The robust labels are written to FILE, or read from it if it exists: a later version is then scored
//! in seconds.

#[allow(dead_code)]
#[path = "../tests/support/random_systems.rs"]
mod random_systems;

use std::collections::HashMap;
use std::error::Error;
use std::fs;

use rayon::prelude::*;
use vibroimpact::{
    CancelToken, Horizon, ImpactCount, Kind, PeriodReport, Run, RunOptions, State, System,
    largest_lyapunov_exponent, lyapunov_spectrum, run,
};

const PERIODS: i64 = 600;
const KEPT: i64 = 100;
/// Of each of the two measurements after the run.
const FURTHER: u32 = 10_000;
/// So many times so many periods, in none of which a motion that is not chaotic may seem so.
const BEGINNING: (u32, u32) = (10, 200);
const FREQUENCIES: u32 = 4_000;
/// Motions with more events are not followed.
const MOST_EVENTS: u64 = 2_000_000;

struct Point {
    set: &'static str,
    index: u64,
    system: System,
    start: State,
}

fn paper(damping: f64, force: f64, friction: f64, frequency: f64) -> System {
    System::builder()
        .mass_ratio(0.6)
        .frequency_ratio(2.0)
        .restitution(0.8)
        .gap(0.5)
        .drive_frequency(frequency)
        .moment_amplitude(1.0)
        .force_amplitude(force)
        .pendulum_damping(damping)
        .oscillator_damping(damping)
        .friction(friction)
        .build()
        .expect("the paper's parameters are within their ranges")
}

fn points(every: usize, shift: f64, systems: u64, seed: u64) -> Vec<Point> {
    let figures = [
        ("Fig. 4", 0.0, 0.0, 0.0),
        ("Fig. 7(a)", 0.01, 0.5, 0.0),
        ("Fig. 8(a)", 0.0, 0.0, 0.5),
        ("Fig. 8(b)", 0.01, 0.5, 0.4),
    ];
    let start = State { x1: 0.0, v1: 0.5, x2: 0.0, v2: 0.0 };
    let mut points = Vec::new();
    for (set, damping, force, friction) in figures {
        points.extend((0..FREQUENCIES).step_by(every).map(|i| {
            let frequency = 0.2 + 3.8 * (f64::from(i) + shift) / f64::from(FREQUENCIES - 1);
            let system = paper(damping, force, friction, frequency);
            Point { set, index: u64::from(i), system, start }
        }));
    }
    points.extend((0..systems).map(|index| {
        let (system, start) = random_systems::draw(seed, index);
        Point { set: "random", index, system, start }
    }));
    points
}

fn first_run(point: &Point) -> Option<Run> {
    let options = RunOptions { max_events: MOST_EVENTS, ..RunOptions::periods(PERIODS).keep(KEPT) };
    run(&point.system, point.start, options, &CancelToken::never()).ok()
}

fn later(run: &Run, periods: u32) -> Option<Run> {
    let horizon = Horizon::Periods(run.final_state.clock.period + i64::from(periods));
    let options = RunOptions { horizon, max_events: 100 * MOST_EVENTS, ..run.options };
    run.resume(options, &CancelToken::never()).ok()
}

/// Whether the exponent over so many periods confirms a label: certainly positive of a chaotic
/// motion, not so of another, and zero of a quasi-periodic one. Shear makes perturbations grow like
/// the time.
fn fits(report: &PeriodReport, run: &Run, periods: u32) -> bool {
    let Ok(spectrum) = lyapunov_spectrum(run, periods, None, &CancelToken::never()) else {
        return false;
    };
    let (exponent, error) = (spectrum.exponents[0], spectrum.errors[0]);
    let shear = f64::from(periods).ln();
    let (total, uncertain) = (exponent * spectrum.time, 2.0 * error * spectrum.time);
    match report.kind {
        _ if spectrum.error.is_some() => false,
        Kind::Chaotic => total > 2.0 * shear && total > 2.0 * uncertain,
        Kind::QuasiPeriodic => total.abs() < shear + 1.0 && uncertain < shear + 1.0,
        Kind::Periodic => total < 2.0 * shear,
        _ => false,
    }
}

/// What the motion of a point is for good, if it is robust.
fn robust(point: &Point) -> Option<String> {
    let first = first_run(point).filter(|run| run.impact_count < MOST_EVENTS / 10)?;
    let middle = later(&first, FURTHER)?;
    let last = later(&middle, FURTHER)?;
    let report = last.period(&CancelToken::never());
    let lasts = || fits(&report, &first, FURTHER) && fits(&report, &middle, FURTHER);
    (strikes_alike(&report, &first) && begins(&report, &first) && lasts()).then(|| report.label())
}

/// Whether the run already strikes as often as the periodic motion that it ends on.
fn strikes_alike(report: &PeriodReport, run: &Run) -> bool {
    let Some((m, ImpactCount::Finite(n))) = report.orbit else { return true };
    let expected = n as f64 * KEPT as f64 / m as f64;
    (run.impacts.len() as f64 - expected).abs() <= n as f64 + 1.0
}

/// Whether a motion that is not chaotic does not seem so in the beginning.
fn begins(report: &PeriodReport, first: &Run) -> bool {
    let (windows, periods) = BEGINNING;
    let (mut run, mut so_far) = (first.clone(), 0.0);
    report.kind == Kind::Chaotic
        || (1..=windows).all(|window| {
            let never = CancelToken::never();
            let Ok(spectrum) = largest_lyapunov_exponent(&run, periods, None, &never) else {
                return false;
            };
            let before = f64::from((window - 1) * periods);
            let grows = |log: f64, periods: f64| log > 2.0 * periods.ln();
            let mut moments = spectrum.history_time.iter().zip(&spectrum.history);
            let log = spectrum.exponents[0] * spectrum.time;
            let seems_chaotic = grows(log, f64::from(periods))
                || grows(so_far + log, before + f64::from(periods))
                || window > 1
                    && moments.any(|(time, rates)| {
                        grows(so_far + rates[0] * time, before + time / run.system.drive_period())
                    });
            so_far += log;
            !seems_chaotic && later(&run, periods).map(|next| run = next).is_some()
        })
}

fn main() -> Result<(), Box<dyn Error>> {
    let (mut every, mut systems, mut truth, mut misses) = (1, 2_000, None, false);
    let (mut shift, mut seed) = (0.0, 1);
    let mut arguments = std::env::args().skip(1);
    while let Some(flag) = arguments.next() {
        let value = arguments.next().ok_or_else(|| format!("{flag} needs a value"))?;
        match flag.as_str() {
            "--every" => every = value.parse()?,
            "--systems" => systems = value.parse()?,
            "--shift" => shift = value.parse()?,
            "--seed" => seed = value.parse()?,
            "--truth" => truth = Some(value),
            "--misses" => misses = value == "yes",
            _ => return Err(format!("unknown argument {flag}").into()),
        }
    }
    let points = points(every, shift, systems, seed);
    let known: HashMap<(String, u64), String> = match &truth {
        Some(file) if fs::exists(file)? => fs::read_to_string(file)?
            .lines()
            .filter_map(|line| {
                let mut parts = line.split(',');
                let key = (parts.next()?.to_owned(), parts.next()?.parse().ok()?);
                Some((key, parts.next()?.to_owned()))
            })
            .collect(),
        _ => points
            .par_iter()
            .filter_map(|p| Some(((p.set.to_owned(), p.index), robust(p)?)))
            .collect(),
    };
    if let Some(file) = truth.filter(|file| !fs::exists(file).unwrap_or(false)) {
        let rows: Vec<String> =
            known.iter().map(|((set, index), label)| format!("{set},{index},{label}\n")).collect();
        fs::write(file, rows.concat())?;
    }
    let labels: Vec<Option<PeriodReport>> = points
        .par_iter()
        .map(|point| Some(first_run(point)?.period(&CancelToken::never())))
        .collect();
    println!("set        points robust right     %   unresolved  exchanged");
    for set in ["Fig. 4", "Fig. 7(a)", "Fig. 8(a)", "Fig. 8(b)", "random"] {
        let (mut all, mut robust, mut right, mut unresolved, mut exchanged) = (0, 0, 0, 0, 0);
        for (point, report) in points.iter().zip(&labels).filter(|(point, _)| point.set == set) {
            all += 1;
            let Some(expected) = known.get(&(set.to_owned(), point.index)) else { continue };
            let found = report.map_or_else(|| "no run".to_owned(), |report| report.label());
            robust += 1;
            right += usize::from(found == *expected);
            unresolved += usize::from(found == "unresolved");
            let periodic = |label: &str| label.contains('-') && label != "quasi-periodic";
            let exchange = (periodic(&found) && expected == "chaotic")
                || (found == "chaotic" && periodic(expected));
            exchanged += usize::from(exchange);
            if misses && found != *expected {
                let evidence = report.map_or_else(String::new, |r| r.evidence.to_string());
                println!("  {set} {}: {found}, not {expected}: {evidence}", point.index);
            }
        }
        println!(
            "{set:<10} {all:6} {robust:6} {right:6} {:6.2} {unresolved:8} {exchanged:8}",
            100.0 * right as f64 / robust as f64
        );
    }
    Ok(())
}
