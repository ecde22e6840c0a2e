//! A sweep runs a batch of simulations at once, one in each lane of the vector registers; what
//! comes of a system must be, to the last bit, what it gives by itself, whatever runs beside it.

mod draw;

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::Barrier;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use crate::support::draws;
use draw::{DRIVEN, Drawer, Family, Job, Place};
use rayon::prelude::*;
use vibroimpact::analysis::basin::{Arrival, ArrivalStatus, Target, arrive};
use vibroimpact::impact::PreImpact;
use vibroimpact::{
    CancelToken, Cell, Contact, Horizon, ImpactLaw, Kind, Measure, PointStatus, Run, RunError,
    RunOptions, State, StopReason, SweepOptions, SweepPoint, SweepStart, System, Workers,
    arrive_many, run, run_many, sweep,
};

/// The point of a cell that runs by itself.
fn alone(cell: &Cell, options: RunOptions) -> SweepPoint {
    let mut point = SweepPoint {
        status: PointStatus::Failed,
        impact_section: Vec::new(),
        regime: Vec::new(),
        stroboscopic: Vec::new(),
        period: None,
        exponents: [[f64::NAN; 2]; 4],
        final_state: None,
        contact_fraction: f64::NAN,
    };
    let run = match run(&cell.system, cell.initial, options, &CancelToken::never()) {
        Ok(run) => run,
        Err(RunError::State(_)) => return SweepPoint { status: PointStatus::Overlap, ..point },
        Err(_) => return point,
    };
    point.status = match run.stop_reason {
        StopReason::Completed => PointStatus::Completed { restarted: false },
        reason => PointStatus::Stopped(reason),
    };
    for impact in &run.impacts {
        let pre = State { x1: impact.x1, v1: impact.v1_pre, x2: impact.x2, v2: impact.v2_pre };
        let u = PreImpact::new(cell.system.contact(), &pre).approach_velocity();
        let [x1, v1, v2] = [impact.x1, impact.v1_pre, impact.v2_pre];
        point.impact_section.push([x1, v1, v2, impact.phase, u, impact.energy_loss]);
        point.regime.push(impact.regime as i8);
    }
    point.stroboscopic = run.stroboscopic.clone();
    let at_end = matches!(run.stop_reason, StopReason::Completed | StopReason::Rest);
    point.period = at_end.then(|| run.section_report(&CancelToken::never()));
    point.final_state = Some(run.final_state.state);
    point.contact_fraction = run.time_in_contact() / (run.final_state.time - run.kept_from());
    point
}

/// All of a point: every number as its shortest digits, so that NaN equals NaN, and 0 is not -0.
fn all(point: &SweepPoint) -> String {
    format!("{point:?}")
}

fn together(cells: &[Cell], options: RunOptions, workers: &Workers) -> Vec<SweepPoint> {
    sweep(
        cells,
        options.into(),
        SweepStart::Fresh,
        workers,
        &CancelToken::never(),
        &AtomicUsize::new(0),
    )
    .unwrap()
}

fn workers() -> [Workers; 3] {
    [1, 2, 3].map(|threads| Workers::new(Some(threads)).unwrap())
}

/// Every job alone, then in so many drawn sets of batches.
fn compare(jobs: &[Job], options: RunOptions, drawer: &mut Drawer, sets: usize) -> Vec<SweepPoint> {
    let singles: Vec<SweepPoint> = jobs.par_iter().map(|job| alone(&job.cell, options)).collect();
    for set in 0..sets {
        for (number, batch) in drawer.batches(jobs.len()).iter().enumerate() {
            let cells: Vec<Cell> = batch.iter().map(|&i| jobs[i].cell.clone()).collect();
            let workers = &workers()[(number + set) % 3];
            for (&i, point) in batch.iter().zip(together(&cells, options, workers)) {
                let (own, found) = (all(&singles[i]), all(&point));
                let job = &jobs[i];
                assert!(own == found, "{options:?} {job:?}\nalone {own}\nfound {found}");
            }
        }
    }
    singles
}

#[test]
fn a_point_of_a_sweep_is_the_run_of_its_system_whatever_runs_beside_it() {
    let mut drawer = Drawer::new(1);
    let jobs = drawer.jobs(&DRIVEN, draws(700, 1_400));
    let mut options = RunOptions::periods(40).keep(25);
    options.max_events = 3_000;
    let points = compare(&jobs, options, &mut drawer, 3);
    // The systems have been through what they are meant to.
    let mut impacts: BTreeMap<(Family, &str), usize> = BTreeMap::new();
    let mut regimes: BTreeMap<i8, usize> = BTreeMap::new();
    for (job, point) in jobs.iter().zip(&points) {
        let key = (job.family, job.cell.system.contact().name());
        *impacts.entry(key).or_default() += point.regime.len();
        for &regime in &point.regime {
            *regimes.entry(regime).or_default() += 1;
        }
    }
    let count = |wanted: &dyn Fn(&Job, &SweepPoint) -> bool| {
        jobs.iter().zip(&points).filter(|(t, p)| wanted(t, p)).count()
    };
    println!("{impacts:?} {regimes:?}");
    assert!(impacts.len() == 13 && impacts.values().all(|&impacts| impacts > 100));
    assert!(regimes.len() == 6 && regimes.values().all(|&impacts| impacts > 10));
    assert!(count(&|t, p| t.place == Place::Overlapping && p.status == PointStatus::Overlap) > 5);
    for place in [Place::Apart, Place::Touching, Place::Resting] {
        assert!(count(&|t, p| t.place == place && p.regime.len() > 10) > 5, "{place:?}");
    }
    assert!(count(&|_, p| p.contact_fraction > 0.0) > 15);
    assert!(count(&|_, p| matches!(p.status, PointStatus::Completed { .. })) > 250);
}

#[test]
fn labels_and_exponents_are_those_of_runs_by_themselves() {
    let mut drawer = Drawer::new(7);
    let jobs = drawer.jobs(&DRIVEN, draws(140, 700));
    let run_options = RunOptions { max_events: 3_000, ..RunOptions::periods(60).keep(40) };
    let options = SweepOptions { measure: Measure::LargestExponent, ..run_options.into() };
    let never = CancelToken::never();
    let singles: Vec<_> = jobs
        .par_iter()
        .map(|job| {
            let run = run(&job.cell.system, job.cell.initial, run_options, &never).ok()?;
            let ended = matches!(run.stop_reason, StopReason::Completed | StopReason::Rest);
            ended.then(|| run.period_and_exponent(&never))
        })
        .collect();
    let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
    for (number, batch) in drawer.batches(jobs.len()).iter().enumerate() {
        let cells: Vec<Cell> = batch.iter().map(|&i| jobs[i].cell.clone()).collect();
        let workers = &workers()[number % 3];
        let points =
            sweep(&cells, options, SweepStart::Fresh, workers, &never, &AtomicUsize::new(0));
        for (&i, point) in batch.iter().zip(points.unwrap()) {
            let found = point.period.map(|report| (report, point.exponents[0]));
            assert_eq!(format!("{found:?}"), format!("{:?}", singles[i]), "{:?}", jobs[i]);
            if let Some((report, _)) = found {
                *kinds.entry(report.kind.name()).or_default() += 1;
            }
        }
    }
    println!("{kinds:?}");
    for kind in [Kind::Periodic, Kind::Chaotic, Kind::QuasiPeriodic] {
        assert!(kinds.get(kind.name()).is_some_and(|&motions| motions > 5), "{kinds:?}");
    }
}

#[test]
fn a_constant_load_runs_beside_a_drive() {
    let mut drawer = Drawer::new(2);
    let mut families = vec![Family::Constant; 7];
    families.extend(DRIVEN);
    let jobs = drawer.jobs(&families, 280);
    let mut options = RunOptions::until(Horizon::Time(60.0));
    options.max_events = 2_000;
    let points = compare(&jobs, options, &mut drawer, 2);
    let loaded = |job: &Job| job.family == Family::Constant;
    let both = jobs.iter().zip(&points);
    assert!(both.filter(|(t, p)| loaded(t) && p.regime.len() > 10).count() > 40);
}

#[test]
fn caps_and_sections_fall_where_they_do_alone() {
    let mut drawer = Drawer::new(3);
    let jobs = drawer.jobs(&DRIVEN, 105);
    let ends = |points: &[SweepPoint], status| points.iter().filter(|p| p.status == status).count();
    for (events, least) in [(0, 90), (1, 60), (3, 60), (40, 25)] {
        let options = RunOptions { max_events: events, ..RunOptions::periods(30) };
        let points = compare(&jobs, options, &mut drawer, 1);
        let capped = ends(&points, PointStatus::Stopped(StopReason::EventCap));
        assert!(capped >= least, "{events} {capped}");
    }
    for (count, max_time) in [(0, 10.0), (1, 10.0), (12, 30.0), (100, 20.0)] {
        let mut options = RunOptions::until(Horizon::Impacts { count, max_time });
        options.max_events = 2_000;
        let points = compare(&jobs, options, &mut drawer, 1);
        if count == 100 {
            assert!(ends(&points, PointStatus::Stopped(StopReason::TimeCap)) > 40);
        }
    }
    for section_phase in [1e-9, 1.0, TAU - 1e-9] {
        let mut options = RunOptions::periods(30).keep(10);
        (options.section_phase, options.max_events) = (section_phase, 2_000);
        let points = compare(&jobs, options, &mut drawer, 1);
        assert!(points.iter().filter(|point| point.stroboscopic.len() >= 9).count() > 60);
    }
}

/// The first cell decides about the geometry of a batch; the others go by themselves. One that
/// overlaps, and one that leaves the range of numbers, leave their lanes to others.
#[test]
fn a_batch_takes_any_jobs() {
    let mut drawer = Drawer::new(4);
    let options = RunOptions { max_events: 2_000, ..RunOptions::periods(30) };
    let mut drawn = |wanted: &dyn Fn(&Job) -> bool, count: usize| -> Vec<Cell> {
        let all = std::iter::repeat_with(|| drawer.job(Family::Usual));
        all.filter(|t| wanted(t)).map(|t| t.cell).take(count).collect()
    };
    let of = |contact: Contact| {
        move |t: &Job| t.place == Place::Apart && t.cell.system.contact() == contact
    };
    let [oblique, direct] = [Contact::Oblique, Contact::Direct].map(|c| drawn(&of(c), 20));
    let overlapping = drawn(&|t| t.place == Place::Overlapping, 12);
    let beyond = |cell: &Cell| Cell {
        system: cell.system.with("moment_amplitude", 1e308).unwrap(),
        ..*cell
    };
    let lasting = oblique.iter().filter(|cell| cell.system.law() != ImpactLaw::Paper);
    let failing: Vec<Cell> = lasting.take(12).map(beyond).collect();
    let mixed: Vec<Cell> =
        oblique.iter().zip(&direct).flat_map(|(o, d)| [o.clone(), d.clone()]).collect();
    let batches = [
        [&oblique[..1], &direct].concat(),
        [&direct[..1], &oblique].concat(),
        [&direct[..2], &oblique[..3], &direct[2..]].concat(),
        mixed.clone(),
        [&overlapping, &oblique[..]].concat(),
        [&oblique[..3], &overlapping, &oblique[3..]].concat(),
        [&failing, &oblique[..]].concat(),
        [&direct[..5], &failing, &overlapping, &direct[5..]].concat(),
        overlapping.clone(),
        failing.clone(),
    ];
    for (number, cells) in batches.iter().enumerate() {
        for workers in workers() {
            let points = together(cells, options, &workers);
            let status = |wanted| points.iter().filter(|point| point.status == wanted).count();
            for (cell, point) in cells.iter().zip(&points) {
                assert!(all(point) == all(&alone(cell, options)), "{number} {cell:?}");
            }
            let overlaps = cells.iter().filter(|cell| overlapping.contains(cell)).count();
            let fails = cells.iter().filter(|cell| failing.contains(cell)).count();
            assert_eq!(status(PointStatus::Overlap), overlaps, "{number}");
            assert_eq!(status(PointStatus::Failed), fails, "{number}");
        }
    }
}

/// Runs keep more than a point of a sweep does: times of all events, evaluations of the gap, where
/// to go on.
#[test]
fn runs_and_basins_from_many_starts_are_the_single_ones() {
    const STARTS: usize = 21;
    let mut drawer = Drawer::new(6);
    let mut options = RunOptions::periods(60).keep(20);
    options.max_events = 2_000;
    let [mut impacts, mut arrived, mut overlap] = [0; 3];
    for number in 0..draws(28, 56) {
        let first = drawer.job(DRIVEN[number % DRIVEN.len()]).cell;
        let mut starts = vec![first.initial];
        starts.extend((1..STARTS).map(|_| {
            let State { x1, v1, x2, v2 } = first.initial;
            let [a, b, c, d] = [0; 4].map(|_| drawer.uniform(-0.3, 0.3));
            State { x1: x1 + a, v1: v1 + b, x2: x2 + c, v2: v2 + d }
        }));
        let workers = &workers()[number % 3];
        let apart = |start: &State| first.system.gap_function(start) < -1e-6;
        let fitting: Vec<State> = starts.iter().copied().filter(apart).collect();
        let alone = |&start: &State| run(&first.system, start, options, &CancelToken::never());
        let singles: Vec<Result<Run, RunError>> = fitting.par_iter().map(alone).collect();
        let runs =
            run_many(&first.system, &fitting, options, workers, &CancelToken::never()).unwrap();
        assert!(format!("{runs:?}") == format!("{singles:?}"), "{first:?}");
        let Some(Ok(single)) = singles.first() else { continue };
        impacts += single.impacts.len();

        // A region around the last section of the first of them.
        let last = single.final_state.clock.period - 1;
        let count = single.impacts.iter().filter(|impact| impact.period == last).count();
        let row = |i: usize| std::array::from_fn(|j| if i == j { 5.0 } else { 0.0 });
        let factor = (0..4).map(row).collect();
        let center = single.final_state.state.to_array();
        let targets = [Target { center, factor, counts: vec![count as u32] }];
        let cancel = CancelToken::never();
        let follow = |&start: &State| arrive(&first.system, start, &targets, options, &cancel);
        let singles: Vec<Arrival> = starts.par_iter().map(follow).collect();
        let all = arrive_many(
            &first.system,
            &starts,
            &targets,
            options,
            workers,
            &CancelToken::never(),
            &AtomicUsize::new(0),
        );
        assert!(format!("{:?}", all.unwrap()) == format!("{singles:?}"), "{first:?}");
        let statuses = singles.iter().map(|arrival| arrival.status);
        arrived += statuses
            .clone()
            .filter(|status| matches!(status, ArrivalStatus::Arrived { .. }))
            .count();
        overlap += statuses.filter(|&status| status == ArrivalStatus::Overlap).count();
    }
    println!("{impacts} {arrived} {overlap}");
    assert!(impacts > 250 && arrived > 50 && overlap > 25);
}

/// Runs that never end, but are within each other's reach by the bounds of their amplitudes, take
/// all lanes sooner or later: only those before them come to an end.
#[test]
fn a_sweep_that_is_cancelled_has_no_wrong_points() {
    let mut drawer = Drawer::new(5);
    let usual = drawer.jobs(&[Family::Usual, Family::Rough], 60);
    let options = RunOptions::until(Horizon::Impacts { count: 150, max_time: 1e15 });
    let endless = Cell {
        system: System::builder()
            .mass_ratio(1.0)
            .frequency_ratio(2.0)
            .restitution(0.5)
            .gap(2.0)
            .drive_frequency(1.0)
            .moment_amplitude(0.1)
            .force_amplitude(1e-30)
            .build()
            .unwrap(),
        initial: State::new(0.0, 0.1, 0.0, 0.0).unwrap(),
    };
    // What ends, and soon.
    let bounces = |cell: &Cell| {
        let mut capped = RunOptions::until(Horizon::Impacts { count: 150, max_time: 1e3 });
        capped.max_events = 1_000;
        alone(cell, capped).status == PointStatus::Completed { restarted: false }
    };
    let bouncing: Vec<Cell> = usual.iter().map(|t| t.cell.clone()).filter(bounces).collect();
    assert!(bouncing.len() >= 30);
    for (threads, workers) in [1, 2, 3].into_iter().zip(workers()) {
        let mut cells = bouncing[..10].to_vec();
        for cell in &bouncing[10..] {
            cells.extend([endless.clone(), cell.clone(), endless.clone()]);
        }
        // Long after all lanes are taken by those that never end.
        let (cancel, count) = (CancelToken::after(300_000), AtomicUsize::new(0));
        let points =
            sweep(&cells, options.into(), SweepStart::Fresh, &workers, &cancel, &count).unwrap();
        let done = points.iter().filter(|point| point.status != PointStatus::Pending).count();
        assert!(done > 0 && count.load(Relaxed) == done, "{done} {count:?}");
        for (cell, point) in cells.iter().zip(&points) {
            let pending = point.status == PointStatus::Pending;
            assert!(pending || *cell != endless);
            if pending {
                assert!(point.final_state.is_none() && point.stroboscopic.is_empty());
                assert!(point.impact_section.is_empty() && point.regime.is_empty());
            } else {
                assert!(all(point) == all(&alone(cell, options)), "{threads} {cell:?}");
            }
        }
        assert!(
            points
                .iter()
                .zip(&cells)
                .any(|(point, cell)| { *cell != endless && point.status == PointStatus::Pending })
        );
    }
}

#[test]
fn a_thread_of_the_pool_may_ask_for_runs_while_others_are_free() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    assert_eq!(pool.install(four_runs), 4);
}

#[test]
fn a_thread_of_the_pool_may_ask_for_runs_while_others_are_busy() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let (begun, ended) = (Barrier::new(2), Barrier::new(2));
    let runs = pool.scope(|scope| {
        scope.spawn(|_| {
            begun.wait();
            ended.wait();
        });
        begun.wait(); // the other thread has taken it
        let runs = four_runs();
        ended.wait();
        runs
    });
    assert_eq!(runs, 4);
}

fn four_runs() -> usize {
    let (system, starts) = few();
    let workers = Workers::new(None).unwrap();
    let options = RunOptions::periods(20);
    run_many(&system, &starts, options, &workers, &CancelToken::never()).unwrap().len()
}

/// The system of Fig. 5(a) and four starts.
fn few() -> (System, [State; 4]) {
    let system = System::builder()
        .mass_ratio(0.6)
        .frequency_ratio(2.0)
        .restitution(0.8)
        .gap(0.5)
        .drive_frequency(1.25)
        .moment_amplitude(1.0)
        .build()
        .unwrap();
    (system, [0.3, 0.4, 0.5, 0.6].map(|v1| State::new(0.0, v1, 0.0, 0.0).unwrap()))
}
