//! Cost of the parts of a simulation: a flight and its evaluation, the search for the next contact,
//! an impact in each regime; and of the kernels of shooting on periodic motions. Inputs are built
//! outside the timed closures.

#![allow(missing_docs)] // criterion's macros
#![allow(clippy::unwrap_used)]

#[path = "support/impacts.rs"]
mod impacts;
#[path = "support/paper.rs"]
mod paper;

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use impacts::impacts;
use paper::start;
use vibroimpact::analysis::shooting::Orbit;
use vibroimpact::impact::resolve;
use vibroimpact::tangent::itinerary::Itinerary;
use vibroimpact::{
    CancelToken, Clock, Event, Flight, FreeMotion, RunOptions, Simulation, System, SystemBuilder,
    run,
};
use vibroimpact::{Start, next_contact};

fn paper() -> SystemBuilder {
    paper::paper(1.545)
}

/// What a flight can be spared: forcing, damping, the resonant form.
fn flights() -> Vec<(&'static str, System)> {
    [
        ("free", paper().moment_amplitude(0.0)),
        ("undamped, one body forced", paper()),
        (
            "damped, both bodies forced",
            paper().pendulum_damping(0.1).oscillator_damping(0.1).force_amplitude(1.5),
        ),
        ("exact resonance", paper().drive_frequency(2.0)),
        ("overdamped", paper().pendulum_damping(1.5).oscillator_damping(2.0)),
    ]
    .map(|(name, builder)| (name, builder.build().unwrap()))
    .into()
}

fn flight(c: &mut Criterion) {
    let mut group = c.benchmark_group("flight");
    for (name, system) in flights() {
        let motion = FreeMotion::new(&system);
        let clock = Clock::new(3, 0.4);
        group.bench_function(format!("start/{name}"), |b| {
            b.iter(|| motion.flight(black_box(clock), black_box(start())));
        });
        let flight = motion.flight(clock, start());
        group.bench_function(format!("evaluate/{name}"), |b| {
            b.iter(|| motion.state_at(&flight, black_box(0.7)));
        });
        group.bench_function(format!("evaluate after 1e6 periods/{name}"), |b| {
            b.iter(|| motion.state_after_periods(&flight, black_box(1_000_000), black_box(0.7)));
        });
    }
    group.finish();
}

fn contact_search(c: &mut Criterion) {
    let mut group = c.benchmark_group("contact");
    for (name, system) in [
        ("frictionless", paper().build().unwrap()),
        ("friction", paper().friction(0.5).build().unwrap()),
        ("out of reach", paper().gap(3.0).build().unwrap()),
    ] {
        let motion = FreeMotion::new(&system);
        // The flights after the first impacts of the motion, or the first flight.
        let mut flights: Vec<(Flight, Start)> = Simulation::new(&system, start())
            .unwrap()
            .periods(200)
            .filter_map(|event| match event.unwrap() {
                Event::Impact(e) => Some((motion.flight(e.clock, e.post), Start::Touching)),
                _ => None,
            })
            .collect();
        if flights.is_empty() {
            flights.push((motion.flight(Clock::START, start()), Start::Apart));
        }
        let mut next = flights.iter().cycle();
        let span = motion.span();
        group.bench_function(name, |b| {
            b.iter(|| {
                let (flight, from) = next.next().unwrap();
                next_contact(&motion, black_box(flight), *from, span)
            });
        });
    }
    group.finish();
}

fn impact(c: &mut Criterion) {
    let mut group = c.benchmark_group("impact");
    for (name, system, pre) in impacts() {
        group.bench_function(name, |b| b.iter(|| resolve(&system, black_box(&pre))));
    }
    group.finish();
}

/// Conditions of periodicity with their derivatives, by the nodes alone and by one parameter too
/// (which costs a quadrature per flight), and the return map.
fn shooting(c: &mut Criterion) {
    let mut group = c.benchmark_group("shooting");
    let damped = || paper().pendulum_damping(0.1).oscillator_damping(0.1).force_amplitude(1.5);
    for (name, builder, periods, count) in [
        ("1-1", paper().drive_frequency(1.8), 1, 1),
        ("4-5, friction", paper().drive_frequency(1.5752).friction(0.5).phase(1.0), 4, 5),
        ("1-inf, chatter and slide", damped().drive_frequency(0.3), 1, 13),
    ] {
        let system = builder.build().unwrap();
        let settled =
            run(&system, start(), RunOptions::periods(3000), &CancelToken::never()).unwrap();
        let state = settled.final_state.state;
        let (legs, nodes) =
            Itinerary::follow(&system, state, periods, 100_000, &CancelToken::never()).unwrap();
        assert_eq!(legs.legs.len(), count);
        let orbit = Orbit::new(&system, &legs, &nodes).unwrap();
        let parameter = ["drive_frequency".to_owned()];
        group.bench_function(format!("residual/{name}"), |b| b.iter(|| orbit.residual(&[])));
        group.bench_function(format!("residual, one parameter/{name}"), |b| {
            b.iter(|| orbit.residual(&parameter));
        });
        group.bench_function(format!("return map/{name}"), |b| b.iter(|| orbit.transfer()));
        group.bench_function(format!("test functions/{name}"), |b| b.iter(|| orbit.tests()));
    }
    group.finish();
}

fn quick() -> Criterion {
    Criterion::default()
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(800))
        .sample_size(30)
}

criterion_group! {
    name = benches;
    config = quick();
    targets = flight, contact_search, impact, shooting
}
criterion_main!(benches);
