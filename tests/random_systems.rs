//! A sample of the random systems of `examples/random_systems.rs` (docs/robustness.md): every run
//! ends with a typed reason, finite and without penetration.

use crate::support::{draws, random_systems};

/// Few enough for the elastic bounces (r = 1) that no number of events gets past.
const MOST_EVENTS: u64 = 50_000;

#[test]
fn random_systems_run_to_their_end() {
    // Of the hundred thousand that are recorded in docs/robustness.md the seed is 1.
    let sample = draws(400, 3_000) as u64;
    let tally = random_systems::examine_all(2, sample, MOST_EVENTS);
    println!("{tally}");
    assert!(tally.failed.is_empty(), "{tally}");
    // Few runs come near a Painleve point, or to millions of bounces, where rounding adds up to
    // more.
    assert!(tally.imbalance < 1e-12, "{tally}");
    let ends = |name: &str| tally.ends.get(name).map_or(0, |(number, _)| *number);
    assert_eq!(tally.ends.values().map(|(number, _)| number).sum::<u64>(), sample);
    assert!(ends("completed") > sample * 9 / 10);
    // The sample reaches what it is for.
    let [chatters, slides, sticks, releases] = tally.contacts;
    assert!(3 * chatters.min(slides).min(releases) > sample && 30 * sticks > sample, "{tally}");
}
