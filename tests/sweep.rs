//! Sweeps over a parameter: the same bits for any number of threads and as single runs, a status
//! for every point, an early end that keeps what is done.

use std::sync::atomic::AtomicUsize;
use vibroimpact::{
    CancelToken, Cell, Measure, PointStatus, RunOptions, State, StopReason, SweepOptions,
    SweepPoint, SweepRows, SweepStart, System, Workers, lyapunov_spectrum, run, run_many, sweep,
};

fn paper() -> System {
    System::builder()
        .mass_ratio(0.6)
        .frequency_ratio(2.0)
        .restitution(0.8)
        .gap(0.5)
        .drive_frequency(1.0)
        .moment_amplitude(1.0)
        .friction(0.3)
        .build()
        .unwrap()
}

fn start() -> State {
    State::new(0.0, 0.5, 0.0, 0.0).unwrap()
}

fn values(low: f64, high: f64, count: usize) -> Vec<f64> {
    (0..count).map(|i| low + (high - low) * i as f64 / (count - 1) as f64).collect()
}

fn options() -> RunOptions {
    RunOptions::periods(60).keep(20)
}

fn cells(parameter: &str, values: &[f64]) -> Vec<Cell> {
    Cell::along(&paper(), parameter, values, start()).unwrap()
}

fn sweep_with(
    parameter: &str,
    values: &[f64],
    begin: SweepStart,
    threads: Option<usize>,
) -> Vec<SweepPoint> {
    let workers = Workers::new(threads).unwrap();
    sweep(
        &cells(parameter, values),
        options().into(),
        begin,
        &workers,
        &CancelToken::never(),
        &AtomicUsize::new(0),
    )
    .unwrap()
}

/// Bits, so that NaN equals NaN and 0 differs from -0.
fn bits(points: &[SweepPoint]) -> Vec<(PointStatus, Vec<u64>)> {
    points
        .iter()
        .map(|point| {
            let impacts = point.impact_section.iter().flatten();
            let rows = impacts.chain(point.stroboscopic.iter().flatten());
            let numbers = rows.chain(point.exponents.iter().flatten());
            let last = point.final_state.map(State::to_array);
            (point.status, numbers.chain(last.iter().flatten()).map(|x| x.to_bits()).collect())
        })
        .collect()
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    // More points than are handed out at a time.
    let frequencies = values(0.6, 4.0, 300);
    for begin in [SweepStart::Fresh, SweepStart::Forward, SweepStart::Backward] {
        let one = sweep_with("drive_frequency", &frequencies, begin, Some(1));
        assert_eq!(one.len(), 300);
        assert!(one.iter().filter(|p| !p.stroboscopic.is_empty()).count() > 250);
        for threads in [Some(2), Some(5), None] {
            let other = sweep_with("drive_frequency", &frequencies, begin, threads);
            assert!(bits(&one) == bits(&other), "{begin:?} {threads:?}");
        }
    }
}

#[test]
fn a_point_is_the_run_of_its_value() {
    let frequencies = values(0.6, 4.0, 40);
    let points = sweep_with("drive_frequency", &frequencies, SweepStart::Fresh, None);
    for (&value, point) in frequencies.iter().zip(&points) {
        let system = paper().with("drive_frequency", value).unwrap();
        let run = run(&system, start(), options(), &CancelToken::never()).unwrap();
        assert_eq!(point.stroboscopic, run.stroboscopic);
        assert_eq!(point.final_state, Some(run.final_state.state));
        assert_eq!(point.impact_section.len(), run.impacts.len());
        for ((row, regime), impact) in
            point.impact_section.iter().zip(&point.regime).zip(&run.impacts)
        {
            assert_eq!(row[..4], [impact.x1, impact.v1_pre, impact.v2_pre, impact.phase]);
            let approach_velocity = impact.v1_pre * impact.x1.cos() - impact.v2_pre;
            assert!((row[4] - approach_velocity).abs() <= 1e-15 * row[4].abs().max(1.0));
            assert_eq!(row[5], impact.energy_loss);
            assert_eq!(i64::from(*regime), impact.regime);
        }
        match point.status {
            PointStatus::Completed { restarted: false } => {
                assert_eq!(run.stop_reason, StopReason::Completed);
                assert_eq!(point.period, Some(run.return_report(&CancelToken::never())));
            }
            PointStatus::Stopped(reason) => assert_eq!(reason, run.stop_reason),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_followed_branch_hands_on_its_last_state() {
    let frequencies = values(1.7, 1.9, 15);
    let forward = sweep_with("drive_frequency", &frequencies, SweepStart::Forward, None);
    let mut from = start();
    for (&value, point) in frequencies.iter().zip(&forward) {
        let system = paper().with("drive_frequency", value).unwrap();
        let run = run(&system, from, options(), &CancelToken::never()).unwrap();
        assert_eq!(point.status, PointStatus::Completed { restarted: false });
        assert_eq!(point.stroboscopic, run.stroboscopic);
        from = run.final_state.state;
    }
    // Backward is forward over the reversed values.
    let reversed: Vec<f64> = frequencies.iter().rev().copied().collect();
    let mut there = sweep_with("drive_frequency", &reversed, SweepStart::Forward, None);
    there.reverse();
    let backward = sweep_with("drive_frequency", &frequencies, SweepStart::Backward, None);
    assert!(bits(&backward) == bits(&there));
    assert!(bits(&backward) != bits(&forward));
}

#[test]
fn a_state_that_does_not_fit_the_next_value_restarts_the_branch() {
    // The gap closes: a state from a wide gap overlaps in the narrow one, the start does not.
    let narrow = paper().with("gap", 0.01).unwrap();
    let wide = values(0.1, 1.2, 30)
        .into_iter()
        .find(|&gap| {
            let system = paper().with("gap", gap).unwrap();
            let run = run(&system, start(), options(), &CancelToken::never()).unwrap();
            narrow.gap_function(&run.final_state.state) > 0.0
        })
        .unwrap();
    let points = sweep_with("gap", &[wide, 0.01, wide], SweepStart::Forward, None);
    assert_eq!(points[1].status, PointStatus::Completed { restarted: true });
    let fresh = run(&narrow, start(), options(), &CancelToken::never()).unwrap();
    assert_eq!(points[1].stroboscopic, fresh.stroboscopic);
    assert_eq!(points[1].status.name(), "restarted");
}

#[test]
fn a_point_that_fails_or_stops_leaves_the_others_alone() {
    // Out of the range of numbers; and with a gap that the start violates.
    let amplitudes = [1.0, 1e308, 0.5];
    let gaps = [0.5, -0.5, 0.7];
    for begin in [SweepStart::Fresh, SweepStart::Forward, SweepStart::Backward] {
        let points = sweep_with("moment_amplitude", &amplitudes, begin, None);
        assert_eq!(points[1].status, PointStatus::Failed, "{begin:?}");
        assert_eq!(points[1].status.name(), "failed");
        assert!(points[1].stroboscopic.is_empty() && points[1].final_state.is_none());
        for i in [0, 2] {
            assert!(matches!(points[i].status, PointStatus::Completed { .. }), "{begin:?} {i}");
            assert_eq!(points[i].stroboscopic.len(), 20);
        }
    }
    let points = sweep_with("gap", &gaps, SweepStart::Fresh, None);
    assert_eq!(points[1].status, PointStatus::Overlap);
    assert_eq!(points[2].status, PointStatus::Completed { restarted: false });

    let mut capped = options();
    capped.max_events = 5;
    let workers = Workers::default();
    let two = cells("drive_frequency", &[1.8, 2.0]);
    let points = sweep(
        &two,
        capped.into(),
        SweepStart::Fresh,
        &workers,
        &CancelToken::never(),
        &AtomicUsize::new(0),
    )
    .unwrap();
    assert!(points.iter().all(|p| p.status == PointStatus::Stopped(StopReason::EventCap)));
    assert!(points.iter().all(|p| p.period.is_none() && p.final_state.is_some()));
}

#[test]
fn values_out_of_range_are_refused_before_any_run() {
    let workers = Workers::default();
    let never = CancelToken::after(1 << 40);
    let attempt = |parameter: &str, values: &[f64], options: RunOptions| {
        let done = AtomicUsize::new(0);
        Cell::along(&paper(), parameter, values, start())
            .and_then(|cells| {
                sweep(&cells, options.into(), SweepStart::Fresh, &workers, &never, &done)
            })
            .unwrap_err()
            .name
            .to_string()
    };
    assert_eq!(attempt("restitution", &[0.5, 1.5], options()), "restitution");
    assert_eq!(attempt("friction", &[0.5, f64::NAN], options()), "friction");
    assert_eq!(attempt("colour", &[0.5], options()), "parameter");
    // Without a drive there are no periods to run.
    assert_eq!(attempt("drive_frequency", &[1.0, 0.0], options()), "periods");
    assert_eq!(attempt("gap", &[0.5], options().keep(61)), "keep");
    assert_eq!(never.asks_left(), 1 << 40);
    for threads in [0, 1025, usize::MAX] {
        assert_eq!(Workers::new(Some(threads)).unwrap_err().name, "workers");
    }
    assert!(SweepStart::from_name("sideways").is_err());
}

#[test]
fn a_sweep_that_is_ended_early_keeps_what_is_done() {
    let cells = cells("drive_frequency", &values(0.6, 4.0, 300));
    let long = RunOptions::periods(6_000).keep(2);
    let workers = Workers::new(Some(2)).unwrap();
    for begin in [SweepStart::Fresh, SweepStart::Forward, SweepStart::Backward] {
        let whole = sweep(
            &cells,
            long.into(),
            begin,
            &workers,
            &CancelToken::never(),
            &AtomicUsize::new(0),
        )
        .unwrap();
        let (cancel, count) = (CancelToken::after(60_000), AtomicUsize::new(0));
        let points = sweep(&cells, long.into(), begin, &workers, &cancel, &count).unwrap();
        let done = count.into_inner();
        assert_eq!(points.len(), 300);
        let pending = |point: &SweepPoint| point.status == PointStatus::Pending;
        let left = points.iter().filter(|&point| pending(point)).count();
        assert!(done > 0 && left > 0 && left == 300 - done, "{done} {left}");
        // What is done has the bits of the whole sweep; a branch runs from its own end.
        for (point, other) in points.iter().zip(&whole).filter(|(point, _)| !pending(point)) {
            assert!(bits(std::slice::from_ref(point)) == bits(std::slice::from_ref(other)));
        }
        match begin {
            SweepStart::Forward => assert!(!points[..done].iter().any(pending)),
            SweepStart::Backward => assert!(!points[left..].iter().any(pending)),
            _ => {}
        }
    }
}

#[test]
fn the_rows_in_one_piece_are_those_of_the_points() {
    let points = sweep_with("drive_frequency", &values(0.6, 4.0, 37), SweepStart::Fresh, None);
    for (threads, points) in [(1, &points[..]), (2, &points), (5, &points[..3]), (2, &[])] {
        let rows = SweepRows::of(points, &Workers::new(Some(threads)).unwrap());
        let impacts: Vec<[f64; 6]> = points.iter().flat_map(|p| p.impact_section.clone()).collect();
        assert_eq!(rows.impact_section.len(), 6 * impacts.len());
        for (place, impact) in impacts.iter().enumerate() {
            for (column, &value) in impact.iter().enumerate() {
                assert_eq!(rows.impact_section[column * impacts.len() + place], value);
            }
        }
        assert!(points.iter().flat_map(|p| &p.regime).eq(&rows.regime));
        assert!(points.iter().flat_map(|p| &p.stroboscopic).eq(&rows.stroboscopic));
        assert_eq!(impacts.is_empty(), points.is_empty());
    }
}

#[test]
fn what_is_measured_is_what_the_run_says() {
    let cells = cells("drive_frequency", &[0.5, 1.2, 1.53, 1.545, 1.8, 2.9]);
    let workers = Workers::new(Some(2)).unwrap();
    let run_options = RunOptions::periods(200).keep(100);
    let with = |measure| {
        let options = SweepOptions { run: run_options, measure, rows: false };
        sweep(
            &cells,
            options,
            SweepStart::Fresh,
            &workers,
            &CancelToken::never(),
            &AtomicUsize::new(0),
        )
        .unwrap()
    };
    let [labelled, largest, spectra] =
        [Measure::Label, Measure::LargestExponent, Measure::Spectrum(300)].map(with);
    for (i, cell) in cells.iter().enumerate() {
        let run = run(&cell.system, cell.initial, run_options, &CancelToken::never()).unwrap();
        let report = run.period(&CancelToken::never());
        assert_eq!(labelled[i].period, Some(report));
        assert!(labelled[i].exponents.iter().flatten().all(|x| x.is_nan()));
        assert_eq!(largest[i].period, Some(report));
        assert_eq!(
            (report, largest[i].exponents[0]),
            run.period_and_exponent(&CancelToken::never())
        );
        let (_, later) = run.on_attractor(&CancelToken::never());
        let settled = later.as_ref().unwrap_or(&run);
        let spectrum = lyapunov_spectrum(settled, 300, None, &CancelToken::never()).unwrap();
        assert_eq!(spectra[i].period, Some(report));
        assert_eq!(spectra[i].exponents.map(|[value, _]| value), spectrum.exponents);
        assert_eq!(spectra[i].exponents.map(|[_, error]| error), spectrum.errors);
        for points in [&labelled, &largest, &spectra] {
            assert!(points[i].impact_section.is_empty() && points[i].stroboscopic.is_empty());
        }
    }
}

#[test]
fn a_long_point_is_cut_short() {
    let long = RunOptions::periods(2_000_000_000).keep(1);
    // Motions that do not repeat.
    let three = cells("drive_frequency", &[0.8, 0.85, 0.9]);
    let workers = Workers::new(Some(2)).unwrap();
    let (cancel, count) = (CancelToken::after(10_000), AtomicUsize::new(0));
    let points = sweep(&three, long.into(), SweepStart::Fresh, &workers, &cancel, &count).unwrap();
    assert!(points.iter().all(|point| point.status == PointStatus::Pending));
}

#[test]
fn runs_from_many_starts_are_the_single_runs() {
    let starts: Vec<State> = values(-0.3, 0.3, 150)
        .into_iter()
        .map(|x1| State::new(x1, 0.5, 0.0, 0.0).unwrap())
        .collect();
    let many = |threads| {
        let workers = Workers::new(threads).unwrap();
        run_many(&paper(), &starts, options(), &workers, &CancelToken::never()).unwrap()
    };
    let runs = many(Some(1));
    assert_eq!(runs, many(Some(2)));
    for (run_, &from) in runs.iter().zip(&starts) {
        assert_eq!(*run_, run(&paper(), from, options(), &CancelToken::never()));
    }
    let bad = [start(), State::new(0.0, 0.0, -1.0, 0.0).unwrap()];
    assert!(
        run_many(&paper(), &bad, options(), &Workers::default(), &CancelToken::never()).is_err()
    );
}

#[test]
fn every_status_has_a_number() {
    let reasons = [
        StopReason::EventCap,
        StopReason::TimeCap,
        StopReason::Rest,
        StopReason::Painleve,
        StopReason::UndecidableGraze,
        StopReason::Jammed,
        StopReason::LawFailed,
    ];
    let others = [
        PointStatus::Pending,
        PointStatus::Completed { restarted: false },
        PointStatus::Completed { restarted: true },
        PointStatus::Overlap,
        PointStatus::Failed,
    ];
    for status in reasons.map(PointStatus::Stopped).into_iter().chain(others) {
        let place = usize::try_from(status.code()).unwrap();
        assert_eq!(PointStatus::NAMES[place], status.name());
    }
    assert_eq!(PointStatus::Pending.code(), 0);
}
