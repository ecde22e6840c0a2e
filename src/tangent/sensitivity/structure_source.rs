//! Where the events of a run of a structure, and the legs between them, come from: from what the run has
//! kept, where that is all of them, or from the motion once more.

use super::structure_kept::Kept;
use crate::model::error::SimulationError;
use crate::model::state::Clock;
use crate::model::structure::{Structure, StructureState};
use crate::simulate::structure::StructureEvent;
use crate::simulate::{AnchorOf, Cycle, Observer, Phase, Simulation};

/// The turns of a motion: from an event, or what leads to a leg without one, to the next.
#[derive(Clone)]
pub(super) enum Source<'a> {
    /// As a simulation makes them.
    Found(Box<Found>),
    /// As a run has kept them.
    Kept(Box<Kept<'a>>),
}

/// A simulation, and what it has found that the motion repeats.
#[derive(Clone)]
pub(super) struct Found {
    simulation: Simulation<Structure>,
    cycle: Option<Cycle>,
    /// The leg before the last turn.
    before: AnchorOf<Structure>,
}

/// A cycle of the motion.
#[derive(Clone, Copy)]
pub(super) struct Alike {
    pub events: u64,
    pub periods: i64,
    cycle: Option<Cycle>,
}

/// The sections that a turn of a simulation has passed.
struct Passed<'a>(&'a mut Vec<i64>);

impl Observer<StructureState> for Passed<'_> {
    const SECTIONS: bool = true;

    fn section(&mut self, k: i64, _: &StructureState) {
        self.0.push(k);
    }
}

impl Source<'_> {
    /// The motion that a simulation makes.
    pub fn found(mut simulation: Simulation<Structure>) -> Self {
        simulation.skips_repeats_until(Clock::START.period);
        let before = simulation.checkpoint().anchor.clone();
        Self::Found(Box::new(Found { simulation, cycle: None, before }))
    }

    /// The leg before the last turn,
    pub fn before(&self) -> &AnchorOf<Structure> {
        match self {
            Self::Found(found) => &found.before,
            Self::Kept(kept) => kept.before(),
        }
    }

    /// the present one,
    pub fn anchor(&self) -> &AnchorOf<Structure> {
        match self {
            Self::Found(found) => &found.simulation.checkpoint().anchor,
            Self::Kept(kept) => kept.anchor(),
        }
    }

    /// and whether impacts are skipped in it.
    pub fn skips(&self) -> bool {
        match self {
            Self::Found(found) => found.simulation.checkpoint().skips(),
            Self::Kept(kept) => kept.skips(),
        }
    }

    /// Goes on to the next leg, or within this one, with an event or without; takes note of the sections
    /// on the way.
    pub fn turn(
        &mut self,
        passed: &mut Vec<i64>,
    ) -> Result<Option<StructureEvent>, SimulationError> {
        match self {
            Self::Found(found) => {
                let Found { simulation, cycle, before } = &mut **found;
                before.clone_from(&simulation.checkpoint().anchor);
                let event = simulation.step(&mut Passed(passed)).transpose()?;
                if let Some((found, _)) = simulation.repeats() {
                    *cycle = Some(found);
                }
                Ok(event)
            }
            Self::Kept(kept) => Ok(kept.turn(passed)),
        }
    }

    /// Events so far.
    pub fn events(&self) -> u64 {
        match self {
            Self::Found(found) => found.simulation.checkpoint().events,
            Self::Kept(kept) => kept.events() as u64,
        }
    }

    /// Whether a flight has just begun, in which no impacts are skipped.
    pub fn begins_flight(&self) -> bool {
        let begins = match self {
            Self::Found(found) => found.simulation.checkpoint().elapsed.hi == 0.0,
            Self::Kept(kept) => kept.is_after_event(),
        };
        begins && !self.skips() && matches!(self.anchor().phase, Phase::Flight(_))
    }

    /// Whether the present leg is known to have some length, without impacts that are skipped.
    pub fn lasts(&self) -> bool {
        match self {
            Self::Found(..) => false,
            Self::Kept(kept) => {
                let moves = matches!(kept.anchor().phase, Phase::Flight(_) | Phase::Contact(_));
                moves && kept.lasts()
            }
        }
    }

    /// Whether the next impacts may lead into contact.
    pub fn may_land(&mut self) -> bool {
        match self {
            Self::Found(..) => true,
            Self::Kept(kept) => kept.lands(),
        }
    }

    /// The cycle that comes again and again from here on.
    pub fn alike(&self) -> Option<Alike> {
        match self {
            Self::Found(found) => found.cycle.map(|cycle| Alike {
                events: cycle.events,
                periods: cycle.periods,
                cycle: Some(cycle),
            }),
            Self::Kept(kept) => kept.present_copies().map(|copies| Alike {
                events: copies.events as u64,
                periods: copies.periods,
                cycle: None,
            }),
        }
    }

    /// How many whole cycles there are from here on, all before the window, of which nothing is told, or
    /// all in it, from this section on.
    pub fn cycles_left(&self, alike: &Alike, (window, first): (Clock, i64)) -> i64 {
        match self {
            Self::Found(found) => {
                let (simulation, Some(cycle)) = (&found.simulation, &alike.cycle) else { return 0 };
                let left = simulation.cycles_left_to_end(cycle);
                let point = simulation.checkpoint();
                let clock = point.anchor.clock;
                if clock <= window {
                    return left.min((window.period - 2 - clock.period).max(0) / cycle.periods);
                }
                if point.next_section >= first { left } else { 0 }
            }
            Self::Kept(kept) => kept.cycles_left(),
        }
    }

    /// Passes over so many cycles.
    pub fn pass(&mut self, alike: &Alike, times: i64) {
        match self {
            Self::Found(found) => {
                if let Some(cycle) = &alike.cycle {
                    found.simulation.repeat(cycle, times);
                }
                found.cycle = None;
            }
            Self::Kept(kept) => kept.pass(times),
        }
    }
}
