//! A sample of the audit of structures (docs/contact-audit.md): random flights, the library's first
//! contact against a dense search along the Taylor series of the equations of motion.

use crate::support::audit::Outcome;
use crate::support::audit::structures::{audit_structures, fastest, judged};
use crate::support::draws;

#[test]
fn no_contact_of_a_structure_is_missed_or_invented() {
    holds(11, false);
}

#[test]
fn no_contact_of_a_structure_with_coupled_modes_is_missed_or_invented() {
    holds(12, true);
}

fn holds(seed: u64, coupled: bool) {
    let flights = draws(1_500, 20_000) as u64;
    let tally = audit_structures(seed, coupled, flights);
    println!("{tally}");
    assert!(tally.disagreements.is_empty(), "{tally}");
    // The sample has to reach what it is for.
    assert!(tally.contacts > flights / 4 && tally.grazes > flights / 60);
    assert!(tally.count(Outcome::Undecided) < flights / 5);
}

/// A level with too small a V would call grazes contacts that are passed over.
#[test]
fn the_level_of_the_audit_has_a_bound_of_the_rate() {
    for coupled in [false, true] {
        let worst = (0..400).map(|index| fastest(13, coupled, index)).fold(0.0, f64::max);
        println!("coupled {coupled}: {worst}");
        assert!(worst > 0.5 && worst < 1.0 + 1e-12, "coupled {coupled}: {worst}");
    }
}

/// Structures that nothing holds, and whose velocities nearly cancel in the modes: rounding of the
/// mode shapes counts by the velocities of the coordinates, which the level does not know.
#[test]
fn modes_are_slow_to_rounding_where_coordinates_are_fast() {
    for (coupled, index) in [(false, 318_906), (false, 497_895), (true, 425_412)] {
        let flight = judged(1, coupled, index);
        assert!(flight.contacts == 1 && flight.disagreements.is_empty(), "{flight}");
    }
}
