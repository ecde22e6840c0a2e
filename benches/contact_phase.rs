//! Cost of a contact phase, from its start to the release, by the library and by DOP853 of the
//! crate `differential-equations` at several tolerances, each with its error beside it
//! (docs/contact-phase.md).
//!
//! Scenes: the settled contact phases of Fig. 7(c) of Han, Jin & Hu (2004) at drive frequency 0.25
//! (one slide), and of a system with friction (slide, stick, slide back). The library's time
//! includes setting up a run.

#![allow(missing_docs)] // criterion's macros
#![allow(clippy::unwrap_used)]

#[path = "../tests/support/contact_ode.rs"]
mod contact_ode;

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Duration;

use contact_ode::{Change, Events, contact_phase};
use criterion::{Criterion, criterion_group, criterion_main};
use vibroimpact::{Event, Horizon, Simulation, State, System};

/// Both phases are over by then.
const HORIZON: f64 = 20.0;
const TOLERANCES: [f64; 4] = [1e-6, 1e-9, 1e-12, 1e-14];
/// The errors are differences from DOP853 at this tolerance, whose own are some 1e-14.
const REFERENCE: f64 = 1e-16;

struct Scene {
    name: &'static str,
    system: System,
    x1: f64,
    v1: f64,
}

impl Scene {
    fn start(&self) -> State {
        let x2 = self.x1.sin() - self.system.gap();
        State::new(self.x1, self.v1, x2, self.v1 * self.x1.cos()).unwrap()
    }
}

/// Starts as reached by simulation in the fourth drive period.
fn scenes() -> [Scene; 2] {
    let system = |moment_amplitude, friction, time: f64| {
        System::builder()
            .mass_ratio(0.6)
            .frequency_ratio(2.0)
            .restitution(0.8)
            .gap(0.5)
            .drive_frequency(0.25)
            .pendulum_damping(0.1)
            .oscillator_damping(0.1)
            .moment_amplitude(moment_amplitude)
            .force_amplitude(1.5)
            .friction(friction)
            .phase((0.25 * time) % TAU)
            .build()
            .unwrap()
    };
    [
        Scene {
            name: "slide",
            system: system(1.0, 0.0, 86.711_153_599_75),
            x1: -0.416_123_770_486_219_1,
            v1: -0.079_985_786_878_738_39,
        },
        Scene {
            name: "slide, stick, slide",
            system: system(3.0, 0.3, 85.364_983_227_931_3),
            x1: -0.667_574_920_931_896_9,
            v1: -0.171_435_985_726_079_1,
        },
    ]
}

/// Time and state of the release.
fn by_library(system: &System, start: State) -> Change {
    let simulation = Simulation::new(system, start).unwrap().until(Horizon::Time(HORIZON));
    let release = simulation.filter_map(|event| match event.unwrap() {
        Event::Release(e) => Some(e),
        _ => None,
    });
    let e = release.last().unwrap();
    Change { time: e.time, x1: e.state.x1, v1: e.state.v1, mode: None }
}

fn by_dop853(scene: &Scene, tolerance: f64, events: Events) -> Change {
    let start = (scene.x1, scene.v1);
    *contact_phase(&scene.system, start, HORIZON, tolerance, events).last().unwrap()
}

/// What a user of the crate would write first; what finds the events to the integrator's accuracy.
const WAYS: [(&str, Events); 3] = [
    ("crate's events", Events::Crate),
    ("dense output", Events::Dense),
    ("polished", Events::Polished(1)),
];

fn print_errors(scene: &Scene) {
    let exact = by_dop853(scene, REFERENCE, Events::Polished(64));
    let print = |name: &str, found: Change| {
        let time = (found.time - exact.time).abs();
        let state = (found.x1 - exact.x1).abs().max((found.v1 - exact.v1).abs());
        println!("{:<20} {name:<32} {time:10.1e} {state:10.1e}", scene.name);
    };
    println!("{:<20} {:<32} {:>10} {:>10}", "errors of the release", "", "time", "state");
    print("library", by_library(&scene.system, scene.start()));
    for tolerance in TOLERANCES {
        for (way, events) in WAYS {
            let name = format!("DOP853 {tolerance:e}, {way}");
            print(&name, by_dop853(scene, tolerance, events));
        }
    }
}

fn phases(c: &mut Criterion) {
    for scene in scenes() {
        print_errors(&scene);
        let mut group = c.benchmark_group(scene.name);
        let start = scene.start();
        group.bench_function("library", |b| {
            b.iter(|| by_library(black_box(&scene.system), black_box(start)));
        });
        for tolerance in TOLERANCES {
            for (way, events) in WAYS {
                group.bench_function(format!("DOP853 {tolerance:e}, {way}"), |b| {
                    b.iter(|| by_dop853(black_box(&scene), tolerance, events));
                });
            }
        }
        group.finish();
    }
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
    targets = phases
}
criterion_main!(benches);
