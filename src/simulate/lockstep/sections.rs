//! Sections before the contacts of several flights: many at once in the lanes, few one by one.

#![allow(clippy::inline_always)] // a round is compiled for several instruction sets

use super::encounters::Encounters;
use super::{FEWEST, Seats, Traveller};
use crate::flight::Flight;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::lanes::LANES;

/// Passes the next section of each of these flights that has one before its contact, and tells
/// which had.
#[inline(always)]
pub(super) fn pass_sections<T: Traveller>(
    crew: &mut [Option<T>; LANES],
    among: &Seats,
    encounters: &mut Encounters,
) -> Seats {
    let (mut times, mut rests) = (*encounters.near(), [0.0; LANES]);
    let (mut passing, mut together, mut alone) = <(Seats, Seats, Seats)>::default();
    for j in among.iter() {
        let Some(traveller) = &mut crew[j] else { continue };
        if !encounters.is_certain(j) {
            continue;
        }
        let (simulation, _) = traveller.parts();
        let (time, offset) = encounters.meets(j);
        let contact = DoubleDouble::sum(time, offset);
        let Some(at) = simulation.section_by(0, contact, false) else { continue };
        if simulation.ends_by(time, offset, true).is_some() {
            continue; // by itself
        }
        passing.push(j);
        (times[j], rests[j]) = (at.hi, at.lo);
        if at.hi <= simulation.motion.far && !simulation.motion.decays_by(at.hi) {
            together.push(j);
        } else {
            alone.push(j);
        }
    }
    if together.count < FEWEST {
        (alone, together) = (passing.clone(), Seats::default());
    } else {
        encounters.pass(&times);
    }
    for j in together.iter() {
        if let Some(traveller) = &mut crew[j] {
            let (simulation, watch) = traveller.parts();
            simulation.pass_section(&encounters.state(j, rests[j]), watch);
        }
    }
    for j in alone.iter() {
        if let Some(traveller) = &mut crew[j] {
            let (simulation, watch) = traveller.parts();
            let (pendulum, oscillator) = encounters.bodies(j);
            let flight = Flight { pendulum, oscillator, ..simulation.flight };
            let at = DoubleDouble { hi: times[j], lo: rests[j] };
            let state = simulation.motion.state_within(&flight, at);
            simulation.pass_section(&state, watch);
        }
    }
    passing
}
