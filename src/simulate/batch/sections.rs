//! Sections before the contacts of several flights: many at once in the lanes, few one by one.

#![allow(clippy::inline_always)] // a round is compiled for several instruction sets

use super::impacts::ImpactLanes;
use super::{FEWEST, Job, LaneSet};
use crate::flight::Flight;
use crate::model::parameters::System;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::lanes::LANES;

/// Passes the next section of each of these flights that has one before its contact, and tells
/// which had.
#[inline(always)]
pub(super) fn pass_sections<T: Job<Model = System>>(
    jobs: &mut [Option<T>; LANES],
    among: LaneSet,
    impacts: &mut ImpactLanes,
) -> LaneSet {
    let (mut times, mut rests) = (*impacts.near(), [0.0; LANES]);
    let (mut passing, mut together, mut alone) = <(LaneSet, LaneSet, LaneSet)>::default();
    for j in among.iter() {
        let Some(job) = &mut jobs[j] else { continue };
        if !impacts.is_certain(j) {
            continue;
        }
        let (simulation, _) = job.parts();
        let (time, offset) = impacts.contact_time(j);
        let contact = DoubleDouble::sum(time, offset);
        let Some(at) = simulation.section_by(0, contact, false) else { continue };
        if simulation.horizon_before(time, offset, true).is_some() {
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
    if together.count() < FEWEST {
        (alone, together) = (passing, LaneSet::default());
    } else {
        impacts.pass(&times);
    }
    for j in together.iter() {
        if let Some(job) = &mut jobs[j] {
            let (simulation, watch) = job.parts();
            simulation.pass_section(&impacts.state(j, rests[j]), watch);
        }
    }
    for j in alone.iter() {
        if let Some(job) = &mut jobs[j] {
            let (simulation, watch) = job.parts();
            let (pendulum, oscillator) = impacts.bodies(j);
            let flight = Flight { pendulum, oscillator, ..simulation.flight };
            let at = DoubleDouble { hi: times[j], lo: rests[j] };
            let state = simulation.motion.state_within(&flight, at);
            simulation.pass_section(&state, watch);
        }
    }
    passing
}
