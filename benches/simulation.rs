//! Cost of whole runs by scene class, of what is kept, and of a sweep by threads and start. One run
//! is 600 drive periods of Han, Jin & Hu (2004), section 4, from (0, 0.5, 0, 0).

#![allow(missing_docs)] // criterion's macros
#![allow(clippy::unwrap_used)]

#[path = "support/paper.rs"]
mod paper;

use std::hint::black_box;
use std::sync::atomic::AtomicUsize;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use paper::{CHAOTIC, paper, start};
use vibroimpact::{
    CancelToken, Cell, Contact, Horizon, RunOptions, Simulation, State, SweepOptions, SweepStart,
    System, SystemBuilder, Workers, largest_lyapunov_exponent, largest_lyapunov_exponents,
    lyapunov_spectrum, run, sweep,
};

const PERIODS: i64 = 600;

/// Fig. 7(c) at omega = 0.25: each period has about 30 impacts before chatter is completed.
fn contact(friction: f64) -> SystemBuilder {
    paper(0.25)
        .restitution(0.3)
        .pendulum_damping(0.1)
        .oscillator_damping(0.1)
        .force_amplitude(1.5)
        .friction(friction)
}

/// Each class takes more work than the one before it, or of another kind.
fn scenes() -> Vec<(&'static str, System, State)> {
    let wall = System::builder()
        .mass_ratio(0.0)
        .frequency_ratio(1.0)
        .restitution(0.8)
        .gap(1.0)
        .drive_frequency(1.0)
        .pendulum_damping(0.05)
        .moment_amplitude(1.0)
        .contact(Contact::Direct);
    [
        ("no impacts", paper(1.8).gap(3.0)),
        ("direct, wall", wall),
        ("frictionless, undamped", paper(1.8)),
        ("frictionless, several impacts per period", paper(1.1)),
        ("friction, chaotic", paper(1.545).friction(0.5)),
        (
            "friction, damped, both bodies forced",
            paper(2.55)
                .friction(0.4)
                .pendulum_damping(0.01)
                .oscillator_damping(0.01)
                .force_amplitude(0.5),
        ),
        ("exact resonance", paper(2.0).pendulum_damping(0.05)),
        ("chatter and contact in every period", contact(0.0).restitution(0.8)),
        ("chatter, sliding and sticking in every period", contact(0.3).moment_amplitude(3.0)),
    ]
    .map(|(name, builder)| (name, builder.build().unwrap(), start()))
    .into()
}

fn simulation(c: &mut Criterion) {
    let mut group = c.benchmark_group("simulation");
    for (name, system, from) in scenes() {
        group.throughput(Throughput::Elements(PERIODS as u64));
        group.bench_function(name, |b| {
            b.iter(|| {
                Simulation::new(black_box(&system), from)
                    .unwrap()
                    .until(Horizon::Periods(PERIODS))
                    .count()
            });
        });
    }
    group.finish();
}

/// What is not kept is not stored, and sections are not computed before the window.
fn kept(c: &mut Criterion) {
    let mut group = c.benchmark_group("kept");
    let system = paper(1.545).friction(0.5).build().unwrap();
    for (name, options) in [
        ("nothing", RunOptions::periods(PERIODS).keep(0)),
        ("last 100 periods", RunOptions::periods(PERIODS).keep(100)),
        ("everything", RunOptions::periods(PERIODS)),
    ] {
        group.bench_function(name, |b| {
            b.iter(|| run(black_box(&system), start(), options, &CancelToken::never()).unwrap());
        });
    }
    let options = RunOptions::periods(PERIODS).keep(100);
    let periodic =
        run(&paper(1.1).build().unwrap(), start(), options, &CancelToken::never()).unwrap();
    group.bench_function("label of a periodic run", |b| {
        b.iter(|| black_box(&periodic).period(&CancelToken::never()))
    });
    group.finish();
}

/// Perturbations along a motion of one impact in a drive period, beside the motion alone.
fn tangent(c: &mut Criterion) {
    let mut group = c.benchmark_group("tangent, Fig. 5a");
    let system = paper(1.25).build().unwrap();
    let options = RunOptions::periods(PERIODS).keep(0);
    let settled = run(&system, start(), options, &CancelToken::never()).unwrap();
    let further = 10_000;
    group.throughput(Throughput::Elements(u64::from(further)));
    group.bench_function("the motion", |b| {
        b.iter(|| {
            Simulation::new(black_box(&system), settled.final_state.state)
                .unwrap()
                .until(Horizon::Periods(i64::from(further)))
                .count()
        });
    });
    group.bench_function("with one perturbation", |b| {
        b.iter(|| {
            largest_lyapunov_exponent(black_box(&settled), further, None, &CancelToken::never())
        });
    });
    group.bench_function("with four", |b| {
        b.iter(|| lyapunov_spectrum(black_box(&settled), further, None, &CancelToken::never()));
    });
    group.finish();
    tangent_in_lanes(c);
}

/// One perturbation of each of sixteen motions in the lanes, beside the motions alone; per impact.
fn tangent_in_lanes(c: &mut Criterion) {
    let mut group = c.benchmark_group("tangent in lanes, Fig. 4");
    let further = 16_000;
    let (workers, never) = (Workers::new(Some(1)).unwrap(), CancelToken::never());
    let cells = CHAOTIC.map(|frequency| {
        let system = paper(frequency).build().unwrap();
        let settled = run(&system, start(), RunOptions::periods(PERIODS).keep(0), &never).unwrap();
        Cell { system, initial: settled.final_state.state }
    });
    // One period of each, so that the same motions are compared, not others of the same systems.
    let runs = cells.each_ref().map(|cell| {
        run(&cell.system, cell.initial, RunOptions::periods(1).keep(0), &never).unwrap()
    });
    let measure = || largest_lyapunov_exponents(black_box(&runs), further, None, &workers, &never);
    let measured = measure().unwrap();
    // Of a motion that repeats the sweep alone would skip the rest.
    assert!(measured.iter().flatten().all(|found| found.exponents[0] > 0.0));
    // A tenth of the periods only aligns the perturbation.
    let counted: u64 = measured.iter().flatten().map(|found| found.impacts).sum();
    group.throughput(Throughput::Elements(counted * 10 / 9));
    let alone =
        SweepOptions { rows: false, ..RunOptions::periods(i64::from(further) + 1).keep(1).into() };
    group.bench_function("the motions", |b| {
        b.iter(|| {
            let (fresh, done) = (SweepStart::Fresh, AtomicUsize::new(0));
            sweep(black_box(&cells), alone, fresh, &workers, &never, &done)
        });
    });
    group.bench_function("with one perturbation", |b| b.iter(measure));
    group.finish();
}

fn sweeps(c: &mut Criterion) {
    let mut group = c.benchmark_group("sweep");
    let frequencies: Vec<f64> = (0..128).map(|i| 1.2 + 0.01 * f64::from(i)).collect();
    let system = paper(1.0).build().unwrap();
    let cells = Cell::along(&system, "drive_frequency", &frequencies, start()).unwrap();
    let options = RunOptions::periods(100).keep(20).into();
    group.throughput(Throughput::Elements(frequencies.len() as u64));
    for (name, begin, threads) in [
        ("fresh, 1 thread", SweepStart::Fresh, 1),
        ("fresh, 2 threads", SweepStart::Fresh, 2),
        ("forward", SweepStart::Forward, 1),
    ] {
        let workers = Workers::new(Some(threads)).unwrap();
        group.bench_function(name, |b| {
            b.iter(|| {
                sweep(
                    black_box(&cells),
                    options,
                    begin,
                    &workers,
                    &CancelToken::never(),
                    &AtomicUsize::new(0),
                )
            });
        });
    }
    group.finish();
}

fn quick() -> Criterion {
    Criterion::default()
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_millis(1500))
        .sample_size(20)
}

criterion_group! {
    name = benches;
    config = quick();
    targets = simulation, kept, tangent, sweeps
}
criterion_main!(benches);
