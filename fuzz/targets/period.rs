//! Periods told from sections that may be anything.

#![no_main]

use libfuzzer_sys::fuzz_target;
use vibroimpact::{CancelToken, CHATTERING, ImpactCount, Kind, detect_period};
use vibroimpact_fuzz::{Draw, execution};

fn body(draw: &mut Draw) {
    let length = draw.below(4) * 64 + draw.below(64);
    let cycle = 1 + draw.below(9);
    let points: Vec<[f64; 4]> =
        (0..cycle).map(|_| std::array::from_fn(|_| draw.number(-1.0, 1.0))).collect();
    let impacts: Vec<u32> = (0..cycle)
        .map(|_| if draw.below(16) == 15 { CHATTERING } else { draw.below(3) as u32 })
        .collect();
    // A cycle that is drawn near to, exact, or with a drift.
    let (rate, away) = (draw.number(0.5, 1.0), draw.number(-0.1, 0.1));
    let mut shift = away;
    let mut sections = Vec::with_capacity(length);
    for k in 0..length {
        sections.push(points[k % cycle].map(|x| x + shift));
        shift *= rate;
    }
    let mut counts: Vec<u32> = (0..length).map(|k| impacts[k % cycle]).collect();
    if length > 0 && draw.below(4) == 3 {
        let place = draw.below(length);
        sections[place] = std::array::from_fn(|_| draw.any());
        counts[place] = draw.integer() as u32;
    }
    if draw.below(16) == 15 {
        counts.pop();
    }
    let report = detect_period(&sections, &counts, &CancelToken::never());
    assert!(!report.label().is_empty());
    assert!(!report.evidence.to_string().is_empty());
    assert_eq!(report.orbit.is_some(), report.evidence.why().is_none(), "{report:?}");
    if let Some((m, n)) = report.orbit {
        assert!(report.kind == Kind::Periodic);
        assert!((1..=length / 4).contains(&m), "{report:?} of {length} sections");
        assert!(!report.residual.is_nan(), "{report:?}");
        let chatters = counts[length - m..].contains(&CHATTERING);
        assert_eq!(n == ImpactCount::Infinite, chatters);
    }
}

fuzz_target!(|bytes: &[u8]| execution(|| body(&mut Draw::new(bytes))));
