//! Structures of a sweep travel in lanes, too: what comes of one must be, to the last bit, what it
//! gives by itself, whatever runs beside it.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicUsize;

use nalgebra::Complex;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vibroimpact::{
    CancelToken, Horizon, ParameterError, PointStatus, RunError, RunOptions, StopReason, Structure,
    StructureCells, StructurePoint, StructureState, SweepOptions, SweepStart, Workers, run,
    structure_sweep,
};
use vibroimpact::{Simultaneous, Stop};

use crate::support::draws;
use crate::support::random_structures::{Drawn, Units};

struct Cells<'a>(Vec<&'a (Structure, StructureState)>);

impl StructureCells for Cells<'_> {
    fn count(&self) -> usize {
        self.0.len()
    }

    fn structure(&self, place: usize) -> Result<Structure, ParameterError> {
        Ok(self.0[place].0.clone())
    }

    fn initial(&self, place: usize) -> StructureState {
        self.0[place].1.clone()
    }
}

/// A structure that lanes can hold: up to four coordinates and stops at rest, with and without
/// damping and friction; plastic stops, which close, corners and resonance among them.
fn usual_structure(
    rng: &mut ChaCha8Rng,
    count: usize,
    stops: usize,
) -> (Structure, StructureState) {
    let mut uniform = |low: f64, high: f64| rng.random_range(low..high);
    let (mut mass, mut stiffness) = (vec![vec![0.0; count]; count], vec![vec![0.0; count]; count]);
    for i in 0..count {
        mass[i][i] = uniform(0.5, 2.0);
        stiffness[i][i] += uniform(0.3, 2.0);
        if i + 1 < count {
            let spring = uniform(0.3, 2.0);
            stiffness[i][i] += spring;
            stiffness[i + 1][i + 1] += spring;
            stiffness[i][i + 1] -= spring;
            stiffness[i + 1][i] -= spring;
        }
    }
    let force: Vec<_> = (0..count).map(|_| Complex::new(uniform(-1.5, 1.5), 0.3)).collect();
    let frequency = uniform(0.3, 3.0);
    let ratios: Vec<f64> = (0..count).map(|_| uniform(0.0, 0.1)).collect();
    let damped = uniform(0.0, 1.0) < 0.7;
    let mut builder = Structure::builder(mass, stiffness).drive(force, frequency, 0.4);
    if damped {
        builder = builder.damping_ratios(ratios);
    }
    if uniform(0.0, 1.0) < 0.3 {
        builder = builder.static_load((0..count).map(|_| uniform(-0.3, 0.3)).collect::<Vec<_>>());
    }
    let rules = [Simultaneous::Stop, Simultaneous::Sequence, Simultaneous::Together];
    let mut rubs = uniform(0.0, 1.0) < 0.3 && count > 1;
    builder = builder.simultaneous(rules[if rubs { 1 } else { uniform(0.0, 2.99) as usize }]);
    for stop in 0..stops {
        let mut normal = vec![0.0; count];
        normal[stop % count] = if (stop / count).is_multiple_of(2) { 1.0 } else { -1.0 };
        if uniform(0.0, 1.0) < 0.2 && count > 1 {
            normal[(stop + 1) % count] = -normal[stop % count];
        }
        let restitution = [0.0, 0.3, 0.6, 0.8, 0.95, 1.0][uniform(0.0, 5.99) as usize];
        let mut stop = Stop::new(normal, uniform(0.02, 0.6), restitution);
        if std::mem::take(&mut rubs) {
            let tangent: Vec<f64> = (0..count).map(|_| uniform(-1.0, 1.0)).collect();
            stop = stop.with_friction(uniform(0.0, 0.6), tangent);
        }
        builder = builder.stop(stop);
    }
    let velocity: Vec<f64> = (0..count).map(|_| uniform(-0.5, 0.5)).collect();
    (builder.build().unwrap(), StructureState::new(&vec![0.0; count], &velocity))
}

/// All of a point: every number as its shortest digits, so that NaN equals NaN, and 0 is not -0.
fn all(of: &impl std::fmt::Debug) -> String {
    format!("{of:?}")
}

/// The point of a run by itself.
fn alone((structure, start): &(Structure, StructureState), options: RunOptions) -> StructurePoint {
    let mut point = StructurePoint {
        status: PointStatus::Failed,
        period: None,
        exponents: Vec::new(),
        final_state: None,
        contact_fraction: f64::NAN,
        impacts: Vec::new(),
        stroboscopic: Vec::new(),
    };
    let never = CancelToken::never();
    let run = match run(structure, start.clone(), options, &never) {
        Ok(run) => run,
        Err(RunError::State(_)) => return StructurePoint { status: PointStatus::Overlap, ..point },
        Err(_) => return point,
    };
    point.status = match run.stop_reason {
        StopReason::Completed => PointStatus::Completed { restarted: false },
        reason => PointStatus::Stopped(reason),
    };
    let at_end = matches!(run.stop_reason, StopReason::Completed | StopReason::Rest);
    point.period = at_end.then(|| run.section_report(&never));
    point.contact_fraction = run.time_in_contact() / (run.final_state.time - run.kept_from());
    point.final_state = Some(run.final_state.state);
    (point.impacts, point.stroboscopic) = (run.impacts, run.stroboscopic);
    point
}

#[test]
fn a_structure_in_a_sweep_moves_as_by_itself_whatever_runs_beside_it() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let cases: Vec<_> = (0..draws(120, 3_000))
        .map(|case| {
            let (count, stops) = (1 + case % 4, 1 + case / 4 % 5);
            if case % 7 == 6 {
                let drawn = Drawn::random(&mut rng);
                (drawn.structure(Units::DRAWN), drawn.start(Units::DRAWN))
            } else {
                usual_structure(&mut rng, count, stops)
            }
        })
        .collect();
    let mut impacts = 0;
    for (number, options) in
        [RunOptions::periods(30), RunOptions::periods(40).keep(7)].into_iter().enumerate()
    {
        let options = RunOptions { max_events: 3_000, ..options };
        let singles: Vec<_> = cases.iter().map(|case| alone(case, options)).collect();
        // Those of one shape together, and all in the order in which they were drawn.
        let mut shapes: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
        for (place, (structure, _)) in cases.iter().enumerate() {
            let shape = (structure.coordinates(), structure.stops().len());
            shapes.entry(shape).or_default().push(place);
        }
        let mut batches: Vec<Vec<usize>> = shapes.into_values().collect();
        batches.push((0..cases.len()).collect());
        for (batch, places) in batches.iter().enumerate() {
            let cells = Cells(places.iter().map(|&place| &cases[place]).collect());
            let workers = Workers::new(Some(1 + (batch + number) % 3)).unwrap();
            let options = SweepOptions { rows: true, ..options.into() };
            let (never, done) = (CancelToken::never(), AtomicUsize::new(0));
            let points =
                structure_sweep(&cells, options, SweepStart::Fresh, &workers, &never, &done);
            for (&place, point) in places.iter().zip(points.unwrap()) {
                impacts += point.impacts.len();
                let (own, found) = (all(&singles[place]), all(&point));
                assert!(own == found, "{place}: {:?}\nalone {own}\nfound {found}", cases[place]);
            }
        }
    }
    assert!(impacts > 10_000, "{impacts}");
}

#[test]
fn starts_of_one_structure_that_travel_together_do_not_see_each_other() {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let never = CancelToken::never();
    let (mut impacts, mut contacts) = (0, 0);
    for case in 0..draws(16, 400) {
        let (structure, start) = usual_structure(&mut rng, 1 + case % 4, 1 + case % 5);
        let starts: Vec<_> = (0..13)
            .map(|i| {
                let v: Vec<f64> = start.v.iter().map(|v| v * (1.0 - 0.15 * f64::from(i))).collect();
                StructureState::new(&start.q, &v)
            })
            .collect();
        let horizon = if case % 3 == 0 {
            Horizon::Impacts { count: 150, max_time: 200.0 }
        } else {
            Horizon::Periods(25)
        };
        let mut options = RunOptions { horizon, max_events: 2_000, ..RunOptions::periods(25) };
        options.section_phase = if case % 2 == 0 { 0.0 } else { 1.3 };
        let cases: Vec<_> = starts.into_iter().map(|start| (structure.clone(), start)).collect();
        let (cells, done) = (Cells(cases.iter().collect()), AtomicUsize::new(0));
        let workers = Workers::new(Some(1 + case % 2)).unwrap();
        let rows = SweepOptions { rows: true, ..options.into() };
        let points = structure_sweep(&cells, rows, SweepStart::Fresh, &workers, &never, &done);
        for (case, point) in cases.iter().zip(points.unwrap()) {
            assert!(all(&alone(case, options)) == all(&point), "{case:?}");
            let own = run(&case.0, case.1.clone(), options, &never).unwrap();
            impacts += own.impacts.len();
            contacts += own.contacts.len();
        }
    }
    println!("{impacts} impacts, {contacts} events of contact");
    assert!(impacts > 10_000 && contacts > 500);
}
