//! On which stops a leg begins.

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

use super::StructureMode;
use super::event::ClosedStops;
use crate::impact::StopImpact;

/// How a leg begins at a stop on which it begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StopStart {
    /// g = 0 and g' < 0.
    Touching,
    /// g = g' = 0, g'' < 0.
    Separating,
    /// g = g' = g'' = 0.
    Released,
    /// g = g' = 0: contact lasts,
    Closed,
    /// or what follows is still to be decided,
    Landed,
    /// also of a stop where slip has stopped.
    Stuck,
}

impl StopStart {
    /// Whether g' = 0 there, and contact lasts or may last.
    fn is_held(self) -> bool {
        matches!(self, Self::Closed | Self::Landed | Self::Stuck)
    }
}

/// The stops on which a leg begins; from all others it is apart.
#[derive(Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Touching {
    /// By number, ascending.
    pub at: SmallVec<[(u32, StopStart); 4]>,
    /// The stops that were closed before the impacts of this instant.
    pub were_closed: ClosedStops,
    /// How they were held.
    #[serde(default)]
    pub were_held: Option<StructureMode>,
    /// Impacts at one instant so far, one after another.
    pub in_sequence: u32,
    /// The largest speed before the impacts of this instant.
    #[serde(default)]
    pub speed: f64,
    /// Impacts of the same instant that are still to be told.
    pub pending: SmallVec<[StopImpact; 1]>,
}

impl Clone for Touching {
    fn clone(&self) -> Self {
        let Self { at, were_closed, were_held, in_sequence, speed, pending } = self;
        Self {
            at: at.clone(),
            were_closed: were_closed.clone(),
            were_held: *were_held,
            in_sequence: *in_sequence,
            speed: *speed,
            pending: pending.clone(),
        }
    }

    // Nearly all legs begin on one stop, and nothing else is to be told of them.
    fn clone_from(&mut self, other: &Self) {
        match other.at[..] {
            [start] if self.is_plain() && other.is_plain() => {
                self.at.clear();
                self.at.push(start);
            }
            _ => *self = other.clone(),
        }
    }
}

impl Touching {
    /// Whether a leg begins on at most one stop, which it leaves, and nothing else is to be told.
    pub(crate) fn is_plain(&self) -> bool {
        let Self { at, were_closed, were_held, in_sequence, speed, pending } = self;
        let leaves = match at[..] {
            [] => true,
            [(_, start)] => start == StopStart::Touching,
            _ => false,
        };
        let alone = *in_sequence == 0 && pending.is_empty() && *speed == 0.0;
        leaves && alone && were_closed.is_empty() && were_held.is_none()
    }

    /// How the leg begins at this stop.
    pub fn of(&self, stop: u32) -> Option<StopStart> {
        self.at.iter().find(|(of, _)| *of == stop).map(|&(_, start)| start)
    }

    /// The leg begins so at this stop.
    pub fn set(&mut self, stop: u32, start: StopStart) {
        match self.at.binary_search_by_key(&stop, |&(of, _)| of) {
            Ok(place) => self.at[place].1 = start,
            Err(place) => self.at.insert(place, (stop, start)),
        }
    }

    /// The closed stops.
    pub fn closed(&self) -> ClosedStops {
        self.those(|start| start == StopStart::Closed)
    }

    /// The closed stops, and those that may be closed from now on.
    pub fn candidates(&self) -> ClosedStops {
        self.those(StopStart::is_held)
    }

    fn those(&self, which: impl Fn(StopStart) -> bool) -> ClosedStops {
        self.at.iter().filter(|(_, start)| which(*start)).map(|&(stop, _)| stop).collect()
    }

    /// The stops that are closed, or were so before the impacts of this instant.
    pub fn closed_before(&self) -> ClosedStops {
        let mut all = self.closed();
        let others = self.were_closed.iter().filter(|stop| !all.contains(stop)).copied();
        let others: ClosedStops = others.collect();
        all.extend(others);
        all.sort_unstable();
        all
    }

    /// What is left of it at a later instant, or still at the same one: what is left there is still
    /// touched, whatever rounding makes of its gap.
    pub fn after(&self, later: bool) -> Self {
        if later { self.landed() } else { Self { at: self.at.clone(), ..Self::default() } }
    }

    /// The same where one of the stops lands. Those that the structure leaves at this very instant by
    /// the forces there, g = g' = 0, may be pressed by the force of that one.
    pub fn landing(&self, later: bool) -> Self {
        let mut touching = self.after(later);
        for (_, start) in &mut touching.at {
            if matches!(start, StopStart::Separating | StopStart::Released) {
                *start = StopStart::Landed;
            }
        }
        touching
    }

    /// The candidates alone.
    pub fn landed(&self) -> Self {
        let at = self.at.iter().copied().filter(|(_, start)| start.is_held()).collect();
        Self { at, ..Self::default() }
    }
}
