//! Sweeps over a parameter, and many starts at once, whose runs travel together in lanes.

#![no_main]

use std::sync::atomic::AtomicUsize;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use vibroimpact::{CancelToken, 
    Cell, Horizon, Measure, PointStatus, RunOptions, State, StopReason, SweepOptions, SweepStart,
    System, Workers, run_many, sweep,
};
use vibroimpact_fuzz::{
    Draw, assert_finite, assert_numbers, check_run, execution, is_hectic, is_long,
};

/// One thread: what many do is the same, and the fuzzer sees what it does.
static WORKERS: LazyLock<Workers> =
    LazyLock::new(|| Workers::new(Some(1)).expect("one thread is there"));

fn options(draw: &mut Draw) -> RunOptions {
    if draw.below(4) == 3 { draw.options() } else { draw.few_periods(6) }
}

/// So many periods of each run may be kept, where there are several.
const FEW: i64 = 10_000;

fn many(draw: &mut Draw, system: &System) {
    let starts: Vec<State> = (0..1 + draw.below(9)).map(|_| draw.state(system)).collect();
    if starts.iter().any(|start| is_hectic(system, start)) {
        return;
    }
    let mut options = options(draw);
    // A run over a billion periods has kept a million sections when its caller is first asked.
    if options.keep.is_none() && matches!(options.horizon, Horizon::Periods(FEW..)) {
        options.keep = Some(FEW);
    }
    match run_many(system, &starts, options, &WORKERS, &CancelToken::after(2048)) {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(runs) => {
            assert!(runs.len() <= starts.len());
            for run in runs.into_iter().flatten() {
                check_run(&run);
            }
        }
    }
}

fn along(draw: &mut Draw, system: &System) {
    let name = System::NUMERIC[draw.below(System::NUMERIC.len())];
    let values: Vec<f64> = (0..1 + draw.below(8)).map(|_| draw.number(0.0, 2.0)).collect();
    let Ok(cells) = Cell::along(system, name, &values, draw.state(system)) else { return };
    // What is measured of a point is not ended by the caller.
    if cells.iter().any(|cell| is_long(&cell.system, &cell.initial, 12.0)) {
        return;
    }
    let options =
        SweepOptions { run: options(draw), measure: Measure::Returns, rows: draw.below(4) > 0 };
    let start = [SweepStart::Fresh, SweepStart::Fresh, SweepStart::Forward, SweepStart::Backward]
        [draw.below(4)];
    match sweep(&cells, options, start, &WORKERS, &CancelToken::after(2048), &AtomicUsize::new(0)) {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(points) => {
            assert_eq!(points.len(), cells.len());
            for point in &points {
                assert!(point.status.code() >= 0, "{:?}", point.status);
                let complete = matches!(
                    point.status,
                    PointStatus::Completed { .. } | PointStatus::Stopped(StopReason::Rest)
                );
                if !complete {
                    continue;
                }
                for row in &point.impact_section {
                    assert_finite("impact section", &row[..5]);
                    assert_numbers("energy loss", &row[5..]);
                }
                for row in &point.stroboscopic {
                    assert_finite("stroboscopic section", row);
                }
                let state = point.final_state.expect("a point that is complete has a state");
                assert_finite("state at the end", &state.to_array());
            }
        }
    }
}

fn body(draw: &mut Draw) {
    let Some(system) = draw.system() else { return };
    if draw.below(2) == 0 { along(draw, &system) } else { many(draw, &system) }
}

fuzz_target!(|bytes: &[u8]| execution(|| body(&mut Draw::new(bytes))));
