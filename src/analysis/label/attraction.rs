//! Whether a motion of a structure that seems quasi-periodic is on its way to a periodic one.
//!
//! A spiral onto a weakly attracting orbit differs from a torus by a slow decrease only, which the
//! growth of a perturbation shows late: over N drive periods its logarithm falls by N ln|lambda|,
//! which is less than ln N, what a shear may hide, for long. So the orbit beside the motion is looked
//! for, by Newton's method from the mean of the sections, and the motion's distance from it is
//! followed (approach.rs).

use nalgebra::DVector;

use crate::analysis::approach::{Approach, approach_of, mean_of};
use crate::analysis::lyapunov::standard_error;
use crate::analysis::period::{
    Evidence, ImpactCount, Kind, PeriodReport, distance, nearest_returns, residual,
};
use crate::analysis::structure_orbit::{StructureOrbit, StructureStability, structure_orbit};
use crate::analysis::tolerances::{
    ATTRACTED_PART, ERROR_BLOCKS, FEWEST_TURNS, ORBITS_TRIED, RETURN_RTOL, SETTLED_BEYOND,
    STEADY_GROWTH,
};
use crate::model::structure::{Structure, StructureState};
use crate::numerics::cancel::CancelToken;
use crate::simulate::run::{RunOptions, run};
use crate::tangent::structure::StructurePassage;

/// What becomes of the distance of a motion from the orbit beside it.
pub(super) enum Attraction {
    /// It shrinks: the motion settles on the orbit, from which this state is.
    Attracted(PeriodReport, StructureState),
    /// It does not, or there is no attracting orbit beside the motion.
    Free,
    /// It is not certain yet: the motion is to be followed further.
    Unclear,
}

/// The orbit on which a motion settles that is at `end` after these sections, which still move as
/// `report` says, if Newton's method finds it from there. It must attract, have the impacts of the
/// report, and lie no further away than sections go on that draw together by its multiplier; and the
/// motion must come nearer to it.
pub(super) fn orbit_beside(
    structure: &Structure,
    end: &StructureState,
    sections: &[StructureState],
    report: &PeriodReport,
    cancel: &CancelToken,
) -> Option<StructureOrbit> {
    let (m, n) = report.orbit?;
    let orbit = attracting(structure, end.clone(), u32::try_from(m).ok()?, cancel)?;
    let near = distance(&orbit.state, end) * (1.0 - largest(&orbit));
    if impacts_in(&orbit, m) != n || near > SETTLED_BEYOND * report.residual {
        return None;
    }
    let turns: Vec<&StructureState> =
        sections.iter().rev().step_by(orbit.periods as usize).collect();
    let approach = approach(&orbit, &turns[..turns.len().div_ceil(2)]);
    approach.is_as_fast_as(largest(&orbit)).then_some(orbit)
}

/// What becomes of a motion with these sections, and these impacts before each, if it has not come
/// back in them.
pub(super) fn attraction(
    structure: &Structure,
    sections: &[StructureState],
    counts: &[u32],
    cancel: &CancelToken,
) -> Attraction {
    // The first half of them may still be far from what the motion does later.
    let half = sections.len() / 2;
    let (late, counts) = (&sections[half..], &counts[half..sections.len()]);
    for m in nearest_returns(late, counts, late.len() / FEWEST_TURNS).into_iter().take(ORBITS_TRIED)
    {
        let Ok(periods) = u32::try_from(m) else { continue };
        let turns: Vec<&StructureState> = late.iter().rev().step_by(m).collect();
        let Some(orbit) = attracting(structure, mean(&turns), periods, cancel) else { continue };
        if impacts_in(&orbit, m) != ImpactCount::of(&counts[counts.len() - m..]) {
            continue;
        }
        let m = orbit.periods as usize;
        let turns: Vec<&StructureState> = late.iter().rev().step_by(m).collect();
        // Sections on the orbit would have returned: a motion that seems to be there goes on, too.
        let Approach::Rates(rates) = approach(&orbit, &turns) else { return Attraction::Unclear };
        let (by, error) = (mean_of(&rates), standard_error(&rates, ERROR_BLOCKS));
        let expected = largest(&orbit).ln();
        if by < ATTRACTED_PART * expected && by + STEADY_GROWTH * error < 0.0 {
            let rate = (by / m as f64).exp();
            let report = PeriodReport {
                orbit: Some((m, impacts_in(&orbit, m))),
                residual: residual(late, m),
                evidence: Evidence::Converging { rate, further: 0, from_orbit: true },
                kind: Kind::Periodic,
            };
            return Attraction::Attracted(report, orbit.state);
        }
        if by - 2.0 * error < ATTRACTED_PART * expected {
            return Attraction::Unclear;
        }
    }
    Attraction::Free
}

/// The attracting orbit that Newton's method finds from a state, with its shortest period: one that
/// takes its turns in alternation on either side (a multiplier near -1) looks like one of twice as
/// many.
fn attracting(
    structure: &Structure,
    start: StructureState,
    periods: u32,
    cancel: &CancelToken,
) -> Option<StructureOrbit> {
    let orbit = structure_orbit(structure, start, periods, cancel).ok()?;
    if orbit.stability != StructureStability::Stable {
        return None;
    }
    let size = orbit.state.numbers().fold(0.0, |most: f64, x| most.max(x.abs()));
    let closes = |parts: &u32| {
        let options = RunOptions::periods(i64::from(periods / parts)).keep(0);
        run(structure, orbit.state.clone(), options, cancel)
            .is_ok_and(|run| distance(&run.final_state.state, &orbit.state) <= RETURN_RTOL * size)
    };
    let parts = (2..=periods).rev().find(|parts| periods.is_multiple_of(*parts) && closes(parts));
    let Some(parts) = parts else { return Some(orbit) };
    structure_orbit(structure, orbit.state, periods / parts, cancel).ok()
}

fn largest(orbit: &StructureOrbit) -> f64 {
    orbit.multipliers.first().map_or(0.0, |largest| largest.norm())
}

/// Impacts of an orbit in so many periods, whole turns.
fn impacts_in(orbit: &StructureOrbit, periods: usize) -> ImpactCount {
    if orbit.passed.iter().any(|passed| matches!(passed, StructurePassage::Chatter(_))) {
        return ImpactCount::Infinite;
    }
    let each: usize = orbit.impacts.iter().map(|&count| count as usize).sum();
    ImpactCount::Finite(each * (periods / orbit.periods as usize))
}

/// A mean of states that keep the stops' distance keeps it, too: the gaps are linear.
fn mean(states: &[&StructureState]) -> StructureState {
    let mut mean = vec![0.0; 2 * states[0].q.len()];
    for state in states {
        mean.iter_mut().zip(state.numbers()).for_each(|(sum, x)| *sum += x);
    }
    for sum in &mut mean {
        *sum /= states.len() as f64;
    }
    StructureState::of_numbers(&mean)
}

/// How the distance from the orbit changes, given the last turn first.
fn approach(orbit: &StructureOrbit, turns: &[&StructureState]) -> Approach {
    let vector =
        |state: &StructureState| DVector::from_iterator(orbit.matrix.nrows(), state.numbers());
    let point = vector(&orbit.state);
    let off = turns.iter().rev().map(|turn| vector(turn) - &point);
    approach_of(&orbit.matrix, &orbit.multipliers, off)
}
