//! Starts followed to targets that may be anything.

#![no_main]

use libfuzzer_sys::fuzz_target;
use vibroimpact::analysis::basin::{ArrivalStatus, Target, arrive};
use vibroimpact::{CHATTERING, CancelToken};
use vibroimpact_fuzz::{Draw, assert_finite, execution, is_long};

fn target(draw: &mut Draw) -> Target {
    let scale = 10f64.powi(draw.below(8) as i32 - 4);
    let odd = draw.below(4) == 3;
    let mut factor = vec![[0.0; 4]; 4];
    for (i, row) in factor.iter_mut().enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            *entry = match (odd, i == j) {
                (true, _) => draw.number(-1.0, 1.0),
                (false, true) => scale,
                (false, false) => 0.0,
            };
        }
    }
    let counts = (0..draw.below(5))
        .map(|_| if draw.below(8) == 7 { CHATTERING } else { draw.below(3) as u32 })
        .collect();
    Target { center: std::array::from_fn(|_| draw.number(-1.0, 1.0)), factor, counts }
}

fn body(draw: &mut Draw) {
    let Some(system) = draw.system() else { return };
    let start = draw.state(&system);
    let targets: Vec<Target> = (0..draw.below(4)).map(|_| target(draw)).collect();
    // Nothing asks to end it: only horizons that are short for any system.
    let mut options = draw.few_periods(10);
    if draw.below(2) == 0 {
        options = options.keep(draw.below(8) as i64);
    }
    if is_long(&system, &start, 10.0) || options.check(&system).is_err() {
        return;
    }
    let arrival = arrive(&system, start, &targets, options, &CancelToken::never());
    match arrival.status {
        ArrivalStatus::Arrived { target, periods } => {
            assert!(target < targets.len() && periods >= 0, "{arrival:?}");
            assert!(arrival.state.is_some());
        }
        ArrivalStatus::Elsewhere(_) => {
            assert_finite("state at the end", &arrival.state.expect("there is one"));
            for section in &arrival.tail {
                assert_finite("section", section);
            }
            assert_eq!(arrival.tail.len(), arrival.counts.len());
        }
        ArrivalStatus::Pending => unreachable!("nothing asked it to end"),
        _ => {}
    }
}

fuzz_target!(|bytes: &[u8]| execution(|| body(&mut Draw::new(bytes))));
