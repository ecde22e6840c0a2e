//! Kernels whose instructions are counted, by benches/instructions.py under valgrind.
//!
//! ```text
//! instructions --list          the kernels in JSON
//! instructions --conditions    what the counts depend on, beside compiler and source
//! instructions KERNEL N        does the work of a kernel N times
//! instructions --run SETUP N   makes a run N times, given in JSON (support/setup.rs)
//! ```
//!
//! The difference of two counts with different N is free of what happens once: start-up, inputs,
//! tables. Without arguments each kernel runs a little, so that tests see that it does.

#![allow(clippy::unwrap_used)]

#[path = "support/impacts.rs"]
mod impacts;
#[path = "support/paper.rs"]
mod paper;
#[path = "support/setup.rs"]
mod setup;
#[path = "support/structures.rs"]
mod structures;

use std::hint::black_box;
use std::sync::atomic::AtomicUsize;

use impacts::impacts;
use paper::{CHAOTIC, paper, start};
use serde::Serialize;
use setup::{Sections, Setup, simulate};
use structures::{CHAOTIC_TWO, at_rest, row_with_stops, two_stops};
use vibroimpact::impact::resolve;
use vibroimpact::{
    CancelToken, Cell, Clock, Event, Flight, FreeMotion, Horizon, ImpactEvent, Measure, Observer,
    ParameterError, Run, RunOptions, Simulation, Spectrum, State, Structure, StructureCells,
    StructureState, SweepOptions, SweepStart, System, SystemBuilder, Workers,
    largest_lyapunov_exponent, largest_lyapunov_exponents, lyapunov_spectrum, run, structure_sweep,
    sweep,
};
use vibroimpact::{Found, Start, Touch, next_contact};

/// Does a kernel's work so many times.
type Work = Box<dyn FnMut(u64)>;

/// Drive periods of a run, and those kept, as in the paper's diagrams.
const PERIODS: i64 = 600;
const KEEP: i64 = 100;
/// Drive frequencies of a diagram that are run, evenly spread.
const POINTS: u32 = 12;
/// The same of a sweep, in which eight travel together.
const SWEPT: u32 = 32;
/// Drive periods until a motion has settled.
const SETTLING: i64 = 500;
/// Drive periods over which perturbations are followed in the lanes.
const FOLLOWED: i64 = 4_000;

#[derive(Serialize)]
struct Kernel {
    name: String,
    /// What the count is per.
    unit: &'static str,
    /// Units in one repetition.
    units: u64,
    /// Repetitions of the two runs whose difference is taken.
    repetitions: [u64; 2],
    /// Kernel whose count is subtracted: what the two do not share is left.
    minus: Option<&'static str>,
    #[serde(skip)]
    prepare: Box<dyn Fn() -> Work>,
}

fn kernel(
    name: impl Into<String>,
    unit: &'static str,
    prepare: impl Fn() -> Work + 'static,
) -> Kernel {
    let (name, prepare) = (name.into(), Box::new(prepare));
    Kernel { name, unit, units: 1, repetitions: [100, 1100], minus: None, prepare }
}

/// A kernel that calls a function of known input again and again.
fn calls<T>(mut call: impl FnMut() -> T + 'static) -> Work {
    Box::new(move |n| {
        for _ in 0..n {
            black_box(call());
        }
    })
}

fn kernels() -> Vec<Kernel> {
    let mut all = flights();
    all.extend(searches());
    all.extend(impacts().into_iter().map(|(name, system, pre)| {
        kernel(format!("impact: {name}"), "impact", move || {
            let system = system.clone();
            calls(move || resolve(black_box(&system), black_box(&pre)))
        })
    }));
    all.extend(periods());
    all.extend(kept());
    all.extend(diagrams());
    all.extend(in_lanes());
    all.extend(of_structures());
    all
}

/// The scene with everything: damping, friction, both bodies forced (Fig. 9(4)).
fn rubbing() -> System {
    damped(paper(2.55), 0.01, 0.5).friction(0.4).build().unwrap()
}

/// With both bodies damped, and a force on the oscillator.
fn damped(builder: SystemBuilder, damping: f64, force: f64) -> SystemBuilder {
    builder.pendulum_damping(damping).oscillator_damping(damping).force_amplitude(force)
}

fn flights() -> Vec<Kernel> {
    let prepared = || {
        let motion = FreeMotion::new(&rubbing());
        let flight = motion.flight(Clock::new(3, 0.4), start());
        (motion, flight)
    };
    vec![
        kernel("free motion of a system", "system", || {
            let system = rubbing();
            calls(move || FreeMotion::new(black_box(&system)))
        }),
        kernel("start of a flight", "flight", move || {
            let (motion, _) = prepared();
            calls(move || motion.flight(black_box(Clock::new(3, 0.4)), black_box(start())))
        }),
        kernel("state of a flight", "state", move || {
            let (motion, flight) = prepared();
            calls(move || motion.state_at(black_box(&flight), black_box(0.7)))
        }),
        kernel("state after 10^6 periods", "state", move || {
            let (motion, flight) = prepared();
            calls(move || motion.state_after_periods(black_box(&flight), 1_000_000, black_box(0.7)))
        }),
    ]
}

/// One search for the next contact.
struct Search {
    system: System,
    motion: FreeMotion,
    flight: Flight,
    start: Start,
    span: f64,
}

impl Search {
    fn first(system: System) -> Self {
        let motion = FreeMotion::new(&system);
        let (flight, span) = (motion.flight(Clock::START, start()), motion.span());
        Self { system, motion, flight, start: Start::Apart, span }
    }

    /// From the last impact of the settled motion to the next.
    fn settled(system: System) -> Self {
        let mut search = Self::first(system);
        let last = last_impact(&search.system);
        search.flight = search.motion.flight(last.clock, last.post);
        search.start = Start::Touching;
        search
    }

    /// A low bounce, which the forces end soon.
    fn hop() -> Self {
        let mut search = Self::first(fig6a());
        let x1 = 0.2;
        let low = State { x1, v1: 0.0, x2: x1.sin() - search.system.gap(), v2: 1e-3 };
        search.flight = search.motion.flight(Clock::START, low);
        search.start = Start::Touching;
        assert!(search.contact().is_some_and(|touch| touch.local_time() < 1e-3 * search.span));
        search
    }

    /// The gap parameter with which the first hump of the flight just touches, to rounding.
    fn grazing(mut self) -> Self {
        let (mut met, mut missed) = (0.5, 3.0);
        while let middle = 0.5 * (met + missed)
            && met < middle
            && middle < missed
        {
            self = self.with_gap(middle);
            if self.contact().is_some() { met = middle } else { missed = middle }
        }
        // Above the level of rounding, at which it would be a graze.
        self.with_gap(met - 1e-9)
    }

    fn with_gap(self, gap: f64) -> Self {
        let system = self.system.with("gap", gap).unwrap();
        Self { motion: FreeMotion::new(&system), system, ..self }
    }

    fn find(&self) -> Found {
        next_contact(&self.motion, black_box(&self.flight), self.start, self.span).found
    }

    fn contact(&self) -> Option<Touch> {
        match self.find() {
            Found::Contact(touch) => Some(touch),
            _ => None,
        }
    }

    fn work(self) -> Work {
        calls(move || self.find())
    }
}

fn searches() -> Vec<Kernel> {
    let met = || Search::settled(fig6a());
    let apart = |system| {
        let search = Search::first(system);
        assert!(matches!(search.find(), Found::Clear(time) if time >= search.span));
        search.work()
    };
    vec![
        kernel("search without contact", "search", move || {
            apart(paper(1.545).gap(3.0).build().unwrap())
        }),
        kernel("search without contact, damped", "search", move || {
            apart(rubbing().with("gap", 3.0).unwrap())
        }),
        kernel("search that meets a contact", "search", move || met().work()),
        kernel("search that meets the end of a short hop", "search", || Search::hop().work()),
        kernel("search that meets a near-graze", "search", || {
            let search = Search::first(paper(1.545).build().unwrap()).grazing();
            assert!(search.contact().is_some());
            search.work()
        }),
    ]
}

/// The last impact of a run that is long enough for its motion to settle.
fn last_impact(system: &System) -> ImpactEvent {
    let events = Simulation::new(system, start()).unwrap().until(Horizon::Periods(SETTLING));
    let impacts = events.filter_map(|event| match event.unwrap() {
        Event::Impact(impact) => Some(impact),
        _ => None,
    });
    impacts.last().unwrap()
}

fn fig6a() -> System {
    paper(0.73).moment_amplitude(2.3).build().unwrap()
}

/// The paper's single motions, which differ in what they need.
fn scenes() -> [(&'static str, System); 5] {
    [
        ("5a", paper(1.25).build().unwrap()),
        ("6a", fig6a()),
        ("9(1)", damped(paper(0.75), 0.1, 1.5).build().unwrap()),
        ("9(4)", rubbing()),
        // Complete chatter and lasting contact in every period.
        ("7(c) at 0.25", damped(paper(0.25), 0.1, 1.5).build().unwrap()),
    ]
}

/// So many drive periods of a settled motion: the difference of two horizons.
fn follow<O: Observer>(system: &System, periods: u64, observer: &mut O) {
    simulate(system, start(), SETTLING + periods as i64, observer);
}

fn periods() -> Vec<Kernel> {
    let mut all = scenes().map(|(name, system)| {
        kernel(format!("Fig. {name}"), "drive period", move || {
            let system = system.clone();
            Box::new(move |n| follow(&system, n, &mut ()))
        })
    });
    // Each of its periods has some hundred times the work of the others.
    all[4].repetitions = [2, 12];
    all.into()
}

/// What is added to a drive period of Fig. 5a by what is wanted of it.
fn kept() -> Vec<Kernel> {
    let system = || paper(1.25).build().unwrap();
    let options = |periods: i64| RunOptions::periods(SETTLING + periods);
    let mut added = [
        kernel("section, Fig. 5a", "section", move || {
            let system = system();
            Box::new(move |n| follow(&system, n, &mut Sections))
        }),
        kernel("history, Fig. 5a", "drive period", move || {
            let system = system();
            Box::new(move |n| {
                let kept = options(n as i64).keep(n as i64);
                black_box(run(&system, start(), kept, &CancelToken::never()).unwrap());
            })
        }),
        tangent("tangent, Fig. 5a", lyapunov_spectrum),
        tangent("one perturbation, Fig. 5a", largest_lyapunov_exponent),
    ];
    for kernel in &mut added {
        kernel.minus = Some("Fig. 5a");
    }
    added.into()
}

type Exponents = fn(&Run, u32, Option<f64>, &CancelToken) -> Result<Spectrum, ParameterError>;

fn tangent(name: &str, exponents: Exponents) -> Kernel {
    kernel(name, "drive period", move || {
        let system = paper(1.25).build().unwrap();
        let options = RunOptions::periods(SETTLING).keep(0);
        let settled = run(&system, start(), options, &CancelToken::never()).unwrap();
        Box::new(move |n| {
            let periods = u32::try_from(n).unwrap();
            black_box(exponents(&settled, periods, None, &CancelToken::never()).unwrap());
        })
    })
}

/// Chaotic motions of Fig. 4 in the lanes, and with one perturbation of each.
fn in_lanes() -> Vec<Kernel> {
    let settled = || {
        let options = RunOptions::periods(SETTLING).keep(0);
        let at = |frequency| {
            run(&paper(frequency).build().unwrap(), start(), options, &CancelToken::never())
        };
        CHAOTIC.map(|frequency| at(frequency).unwrap())
    };
    let workers = || Workers::new(Some(1)).unwrap();
    let motions = kernel("chaotic motions, Fig. 4, in lanes", "drive period", move || {
        let (runs, workers) = (settled(), workers());
        let cells = runs.map(|run| Cell { system: run.system, initial: run.final_state.state });
        let options = RunOptions::periods(FOLLOWED).keep(1);
        let options = SweepOptions { rows: false, ..options.into() };
        calls(move || {
            let (fresh, done) = (SweepStart::Fresh, AtomicUsize::new(0));
            sweep(black_box(&cells), options, fresh, &workers, &CancelToken::never(), &done)
        })
    });
    let perturbed = kernel("one perturbation, Fig. 4, in lanes", "drive period", move || {
        let (runs, workers) = (settled(), workers());
        let (steps, never) = (u32::try_from(FOLLOWED).unwrap(), CancelToken::never());
        calls(move || largest_lyapunov_exponents(black_box(&runs), steps, None, &workers, &never))
    });
    let perturbed = Kernel { minus: Some("chaotic motions, Fig. 4, in lanes"), ..perturbed };
    let units = CHAOTIC.len() as u64 * FOLLOWED as u64;
    [motions, perturbed].map(|kernel| Kernel { units, repetitions: [1, 2], ..kernel }).into()
}

/// Drive periods of structures with stops, their set-up apart: all impacts of motions that do not
/// repeat.
fn of_structures() -> Vec<Kernel> {
    let periods = |name: &str, structure: fn() -> Structure| {
        let prepare = move || -> Work {
            let (structure, never) = (structure(), CancelToken::never());
            Box::new(move |n| {
                let options = RunOptions::periods(n as i64).keep(1);
                let start = at_rest(structure.coordinates());
                black_box(run(black_box(&structure), start, options, &never).unwrap());
            })
        };
        Kernel { repetitions: [20, 120], ..kernel(name, "drive period", prepare) }
    };
    vec![
        periods("2 masses, 2 stops", || two_stops(0.8)),
        periods("20 masses, 20 stops", || row_with_stops(20, 0.9)),
        structures_in_lanes(),
    ]
}

/// Structures whose drive frequencies differ, from rest.
struct AtRest(Vec<Structure>);

impl StructureCells for AtRest {
    fn count(&self) -> usize {
        self.0.len()
    }

    fn structure(&self, place: usize) -> Result<Structure, ParameterError> {
        Ok(self.0[place].clone())
    }

    fn initial(&self, place: usize) -> StructureState {
        at_rest(self.0[place].coordinates())
    }
}

/// Chaotic motions of structures in the lanes.
fn structures_in_lanes() -> Kernel {
    let prepare = || -> Work {
        let cells = AtRest(CHAOTIC_TWO.map(two_stops).into());
        let options = SweepOptions { rows: false, ..RunOptions::periods(PERIODS).keep(1).into() };
        let (workers, never) = (Workers::new(Some(1)).unwrap(), CancelToken::never());
        calls(move || {
            let (fresh, done) = (SweepStart::Fresh, AtomicUsize::new(0));
            structure_sweep(black_box(&cells), options, fresh, &workers, &never, &done)
        })
    };
    let units = CHAOTIC_TWO.len() as u64 * PERIODS as u64;
    let swept = kernel("2 masses, 2 stops, in lanes", "drive period", prepare);
    Kernel { units, repetitions: [1, 2], ..swept }
}

/// Name, first and last drive frequency, and the system at one.
type Diagram = (&'static str, f64, f64, fn(f64) -> SystemBuilder);

/// All that a point of a diagram costs, settling included: run by itself, and in a sweep.
fn diagrams() -> Vec<Kernel> {
    let points = |count: u32, low: f64, high: f64, builder: fn(f64) -> SystemBuilder| {
        let width = (high - low) / f64::from(count);
        let frequencies = (0..count).map(|i| low + width * (f64::from(i) + 0.5));
        frequencies.map(|omega| builder(omega).build().unwrap()).collect::<Vec<System>>()
    };
    let fig7b = |omega| damped(paper(omega), 0.1, 0.5);
    let fig8b = |omega| damped(paper(omega), 0.01, 0.5).friction(0.4);
    let kept = RunOptions::periods(PERIODS).keep(KEEP);
    let diagrams: [Diagram; 3] = [
        ("Fig. 4", 0.2, 4.0, paper),
        ("Fig. 7(b)", 0.6, 3.0, fig7b),
        ("Fig. 8(b)", 0.2, 4.0, fig8b),
    ];
    let alone = diagrams.iter().map(|&(name, low, high, builder)| {
        let prepare = move || -> Work {
            let systems = points(POINTS, low, high, builder);
            calls(move || {
                for system in &systems {
                    let run = run(black_box(system), start(), kept, &CancelToken::never()).unwrap();
                    black_box(run.return_report(&CancelToken::never()));
                }
            })
        };
        let units = u64::from(POINTS) * PERIODS as u64;
        let diagram = kernel(format!("{name}, point by point"), "drive period", prepare);
        Kernel { units, repetitions: [1, 2], ..diagram }
    });
    let swept = |&(name, low, high, builder): &Diagram, what: &str, measure: Measure| {
        let prepare = move || -> Work {
            let systems = points(SWEPT, low, high, builder);
            let cells: Vec<Cell> =
                systems.into_iter().map(|system| Cell { system, initial: start() }).collect();
            let workers = Workers::new(Some(1)).unwrap();
            let options = SweepOptions { measure, ..kept.into() };
            calls(move || {
                sweep(
                    black_box(&cells),
                    options,
                    SweepStart::Fresh,
                    &workers,
                    &CancelToken::never(),
                    &AtomicUsize::new(0),
                )
            })
        };
        let units = u64::from(SWEPT) * PERIODS as u64;
        let diagram = kernel(format!("{name}, {what}"), "drive period", prepare);
        Kernel { units, repetitions: [1, 2], ..diagram }
    };
    let together = diagrams.iter().map(|diagram| swept(diagram, "sweep", Measure::Returns));
    // Per period of the unlabelled sweep, whatever is followed beyond it.
    let labelled = diagrams
        .iter()
        .map(|diagram| swept(diagram, "labels and exponents", Measure::LargestExponent));
    alone.chain(together).chain(labelled).collect()
}

#[derive(Serialize)]
struct Conditions {
    /// Vector instructions that are chosen at run time.
    vector: String,
    /// Whether the C library's functions may use fused operations.
    fused: bool,
}

fn conditions() -> Conditions {
    #[cfg(target_arch = "x86_64")]
    let fused = std::arch::is_x86_feature_detected!("fma");
    #[cfg(not(target_arch = "x86_64"))]
    let fused = true;
    let vector = format!("{:?}", pulp::Arch::new());
    Conditions { vector: vector.split(['(', ' ']).next().unwrap().to_owned(), fused }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--list"] => println!("{}", serde_json::to_string(&kernels()).unwrap()),
        ["--conditions"] => println!("{}", serde_json::to_string(&conditions()).unwrap()),
        ["--run", setup, repetitions] => {
            let setup: Setup = serde_json::from_str(setup).expect("a setup");
            (0..repetitions.parse().expect("a number of runs")).for_each(|_: u64| setup.work());
        }
        [name, repetitions] if !name.starts_with('-') => {
            let all = kernels();
            let kernel = all.iter().find(|kernel| kernel.name == name).expect("no such kernel");
            (kernel.prepare)()(repetitions.parse().expect("a number of repetitions"));
        }
        _ => kernels().iter().for_each(|kernel| (kernel.prepare)()(1)),
    }
}
