//! Labels of short runs, with the growth that is measured where a motion does not return.

#![no_main]

use libfuzzer_sys::fuzz_target;
use vibroimpact::{CancelToken, Kind, PeriodReport, run};
use vibroimpact_fuzz::{Draw, assert_numbers, enough, execution, is_long, made};

/// Evaluations of the gap above which a run is too slow to be followed over thousands of periods.
const CHEAP: u64 = 120;

fn check(report: &PeriodReport) {
    assert!(!report.label().is_empty());
    let known = report.evidence.why().is_none();
    assert_eq!(known, report.kind != Kind::Unresolved, "{report:?}");
    if let Some(rate) = report.evidence.rate() {
        assert!((0.0..1.0).contains(&rate), "{report:?}");
    }
    if let Some((m, _)) = report.orbit {
        assert!(m >= 1 && report.residual >= 0.0, "{report:?}");
    }
    if let Some(growth) = report.evidence.growth() {
        assert_numbers("growth", &[growth.mean]);
    }
}

fn body(draw: &mut Draw) {
    let Some(system) = draw.system() else { return };
    let start = draw.state(&system);
    let Some(run) = made(run(&system, start, draw.few_periods(8), &enough())) else { return };
    check(&run.return_report(&CancelToken::never()));
    if run.evaluations > CHEAP || is_long(&system, &start, 20.0) {
        return;
    }
    match draw.below(16) {
        0 => check(&run.period(&CancelToken::never())),
        1 => {
            let (report, [exponent, _]) = run.period_and_exponent(&CancelToken::never());
            check(&report);
            assert!(exponent < f64::INFINITY || exponent.is_nan(), "{exponent}");
        }
        2 => {
            let (report, later) = run.on_attractor(&CancelToken::never());
            check(&report);
            assert!(later.is_none_or(|later| later.final_state.time >= run.final_state.time));
        }
        _ => check(&run.section_report(&CancelToken::never())),
    }
}

fuzz_target!(|bytes: &[u8]| execution(|| body(&mut Draw::new(bytes))));
