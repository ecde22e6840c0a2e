//! A sample of the contact audit (docs/contact-audit.md): random flights, the library's first
//! contact against an independent dense search in double-double arithmetic.

use crate::support::audit::{Flights, HEADER, Outcome, audit, judge};
use crate::support::draws;

/// Not the seed of the large run.
const SEED: u64 = 2;

#[test]
fn no_contact_is_missed_or_invented() {
    holds(Flights { seed: SEED, loads: false });
}

#[test]
fn no_contact_is_missed_or_invented_under_constant_loads() {
    holds(Flights { seed: SEED, loads: true });
}

fn holds(from: Flights) {
    let flights = draws(2_500, 20_000) as u64;
    let tally = audit(from, flights, 10);
    println!("{tally}");
    assert!(tally.disagreements.is_empty(), "{tally}");
    // The sample has to reach what it is for.
    assert!(tally.contacts > flights / 4 && tally.grazes > flights / 200);
    assert!(tally.count(Outcome::Undecided) < flights / 10);
    for (_, row) in &tally.rows {
        assert_eq!(row.split(',').count(), HEADER.split(',').count());
    }
}

/// Flights of the large run that an earlier search told wrongly: humps too far below zero told as
/// grazes, a graze reported away from its top at the end of a flight, a constant load with
/// cos phi close to 0.
#[test]
fn flights_once_told_wrongly() {
    for index in [33_975, 243_456, 739_869, 95_370] {
        let judged = judge(Flights { seed: 1, loads: false }, index);
        assert!(!judged.outcome.is_disagreement(), "flight {index}: {:?}", judged.outcome);
    }
}
