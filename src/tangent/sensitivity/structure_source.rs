//! Where the events of a run of a structure, and the legs between them, come from: from what the run has
//! kept, where that is all of them, or from a run in the making.

use super::making::Events;
use super::structure_kept::Kept;
use crate::model::error::SimulationError;
use crate::model::structure::{Structure, StructureState};
use crate::simulate::run::Collection;
use crate::simulate::structure::StructureEvent;
use crate::simulate::{AnchorOf, Cycle, Observer, Phase};

/// The turns of a motion: from an event, or what leads to a leg without one, to the next.
#[derive(Clone)]
pub(super) enum Source<'a> {
    /// As they are found while the run is made.
    Made(Box<Made>),
    /// As a run has kept them.
    Kept(Box<Kept<'a>>),
}

/// A run in the making, and what has been found to repeat.
#[derive(Clone)]
pub(super) struct Made {
    run: Collection<Structure>,
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

impl Events for Source<'_> {
    type Model = Structure;

    #[cfg(feature = "python")]
    fn made(&self) -> Option<&Collection<Structure>> {
        if let Self::Made(made) = self { Some(&made.run) } else { None }
    }

    fn made_mut(&mut self) -> Option<&mut Collection<Structure>> {
        if let Self::Made(made) = self { Some(&mut made.run) } else { None }
    }

    fn into_made(self) -> Option<Collection<Structure>> {
        if let Self::Made(made) = self { Some(made.run) } else { None }
    }
}

impl Source<'_> {
    /// A run in the making.
    pub fn made(run: Collection<Structure>) -> Self {
        let before = run.checkpoint().anchor.clone();
        Self::Made(Box::new(Made { run, cycle: None, before }))
    }

    /// The leg before the last turn,
    pub fn before(&self) -> &AnchorOf<Structure> {
        match self {
            Self::Made(made) => &made.before,
            Self::Kept(kept) => kept.before(),
        }
    }

    /// the present one,
    pub fn anchor(&self) -> &AnchorOf<Structure> {
        match self {
            Self::Made(made) => &made.run.checkpoint().anchor,
            Self::Kept(kept) => kept.anchor(),
        }
    }

    /// and whether impacts are skipped in it.
    pub fn skips(&self) -> bool {
        match self {
            Self::Made(made) => made.run.checkpoint().skips(),
            Self::Kept(kept) => kept.skips(),
        }
    }

    /// Whether the caller has ended the work.
    pub fn is_cancelled(&self) -> bool {
        match self {
            Self::Made(made) => made.run.is_cancelled(),
            Self::Kept(kept) => kept.is_cancelled(),
        }
    }

    /// The same of work that nobody goes on with.
    pub fn is_given_up(&self) -> bool {
        matches!(self, Self::Kept(kept) if kept.is_cancelled())
    }

    /// Goes on to the next leg, or within this one, with an event or without; takes note of the sections
    /// on the way.
    pub fn turn(
        &mut self,
        passed: &mut Vec<i64>,
    ) -> Result<Option<StructureEvent>, SimulationError> {
        match self {
            Self::Made(made) => {
                let Made { run, cycle, before } = &mut **made;
                before.clone_from(&run.checkpoint().anchor);
                let event = run.tell_step(&mut Passed(passed)).transpose()?;
                *cycle = run.found_to_repeat().or(*cycle);
                Ok(event)
            }
            Self::Kept(kept) => Ok(kept.turn(passed)),
        }
    }

    /// Events so far.
    pub fn events(&self) -> u64 {
        match self {
            Self::Made(made) => made.run.checkpoint().events,
            Self::Kept(kept) => kept.events() as u64,
        }
    }

    /// Whether a flight has just begun, in which no impacts are skipped.
    pub fn begins_flight(&self) -> bool {
        let begins = match self {
            Self::Made(made) => made.run.checkpoint().elapsed.hi == 0.0,
            Self::Kept(kept) => kept.is_after_event(),
        };
        begins && !self.skips() && matches!(self.anchor().phase, Phase::Flight(_))
    }

    /// Whether the present leg is known to have some length, without impacts that are skipped.
    pub fn lasts(&self) -> bool {
        match self {
            Self::Made(..) => false,
            Self::Kept(kept) => {
                let moves = matches!(kept.anchor().phase, Phase::Flight(_) | Phase::Contact(_));
                moves && kept.lasts()
            }
        }
    }

    /// Whether the next impacts may lead into contact.
    pub fn may_land(&mut self) -> bool {
        match self {
            Self::Made(..) => true,
            Self::Kept(kept) => kept.lands(),
        }
    }

    /// The cycle that comes again and again from here on.
    pub fn alike(&self) -> Option<Alike> {
        match self {
            Self::Made(made) => made.cycle.map(|cycle| Alike {
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

    /// How many whole cycles there are from here on that can be passed over at once: all before the
    /// window, of which nothing is told, or all in it.
    pub fn cycles_left(&self, alike: &Alike) -> i64 {
        match self {
            Self::Made(made) => alike.cycle.map_or(0, |cycle| made.run.cycles_left(&cycle)),
            Self::Kept(kept) => kept.cycles_left(),
        }
    }

    /// Passes over so many cycles.
    pub fn pass(&mut self, alike: &Alike, times: i64) {
        match self {
            Self::Made(made) => {
                if let Some(cycle) = &alike.cycle {
                    made.run.pass(cycle, times);
                }
                made.cycle = None;
            }
            Self::Kept(kept) => kept.pass(times),
        }
    }
}
