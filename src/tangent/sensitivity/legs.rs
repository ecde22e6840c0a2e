//! The legs of a window, with the derivatives at their starts.

use super::columns::{Column, Columns, Differentiated, Here};
use super::error::SensitivityError;
use crate::contact::sustained::ContactMode;
use crate::model::state::{Clock, State};
use crate::simulate::event::Event;
use crate::simulate::{Anchor, impacts_hop_by_hop};
use crate::tangent::strike::Departure;

/// What the bodies do from here to the next event.
#[derive(Debug, Clone)]
pub(super) struct SensitiveLeg {
    pub here: Here,
    pub mode: Option<ContactMode>,
    /// Impacts are skipped.
    pub hops: bool,
    pub time: f64,
}

/// Legs in order, with memory for no more columns than there are, and no more than their times and
/// columns of those that repeat.
#[derive(Default)]
pub(super) struct KeptLegs {
    legs: Vec<Kept>,
    different: Vec<Leg>,
    /// Of each: rows as in the tables, components (x1, x1', x2', x2 or t), and of each a number for each
    /// column.
    rows: Vec<f64>,
}

struct Kept {
    time: f64,
    /// Which of the different ones, and how many drive periods later than that.
    leg: usize,
    later: i64,
}

#[derive(Clone)]
struct Leg {
    state: State,
    clock: Clock,
    after_event: bool,
    mode: Option<ContactMode>,
    hops: bool,
}

/// Legs of a motion that repeats.
pub(super) struct Again<'a> {
    /// Of a cycle, and their times when they come again.
    pub cycle: &'a KeptLegs,
    pub times: &'a [f64],
    /// The first of them that is kept.
    pub first: usize,
    /// How many drive periods later.
    pub later: i64,
    /// Where the legs of the cycle are in these, if they are.
    pub place: &'a mut Option<usize>,
}

impl KeptLegs {
    pub fn with_capacity(legs: usize, columns: usize) -> Self {
        Self {
            legs: Vec::with_capacity(legs),
            different: Vec::new(),
            rows: Vec::with_capacity(4 * legs * columns),
        }
    }

    pub fn push(&mut self, leg: &SensitiveLeg) {
        let &SensitiveLeg { ref here, mode, hops, time } = leg;
        for component in 0..4 {
            self.rows.extend(here.columns.iter().map(|column| column[component]));
        }
        self.legs.push(Kept { time, leg: self.different.len(), later: 0 });
        let Departure { clock, slope, .. } = here.departure;
        let (state, after_event) = (here.state, slope.is_some());
        self.different.push(Leg { state, clock, after_event, mode, hops });
    }

    /// The rows, to which those of legs that come again are added.
    pub fn rows(&mut self) -> &mut Vec<f64> {
        &mut self.rows
    }

    /// Adds legs that come again, whose rows are added apart.
    pub fn again(&mut self, again: Again) {
        let Again { cycle, times, first, later, place } = again;
        let place = *place.get_or_insert_with(|| {
            self.different.extend_from_slice(&cycle.different);
            self.different.len() - cycle.different.len()
        });
        let legs = times.iter().zip(place..).skip(first);
        self.legs.extend(legs.map(|(&time, leg)| Kept { time, leg, later }));
    }

    /// The last leg that begins not later than a time.
    pub fn at(&self, time: f64, of: &Differentiated) -> SensitiveLeg {
        let place = self.legs.partition_point(|leg| leg.time <= time).max(1) - 1;
        let &Kept { time, leg, later } = &self.legs[place];
        let &Leg { state, mut clock, after_event, mode, hops } = &self.different[leg];
        clock.period += later;
        let departure = Departure::new(&of.model, &state, clock, after_event);
        let width = self.rows.len() / self.legs.len();
        let rows = &self.rows[place * width..][..width];
        let column = |i: usize| std::array::from_fn(|component| rows[component * width / 4 + i]);
        let columns: Columns = (0..width / 4).map(column).collect();
        let here = Here { state, clock, trig: of.model.trig(clock), departure, columns };
        SensitiveLeg { here, mode, hops, time }
    }
}

impl SensitiveLeg {
    /// Derivatives of the state at a fixed instant of this leg, and its rates there; `known`: that state.
    pub fn at(
        &self,
        of: &Differentiated,
        clock: Clock,
        known: Option<&State>,
    ) -> Result<(Columns, Column), SensitivityError> {
        if let Some(mode) = self.mode {
            return of.held(&self.here, mode, clock);
        }
        if self.hops && clock > self.here.clock {
            let mut here = self.here.clone();
            let anchor = Anchor::after_impact(here.clock, here.state);
            for event in impacts_hop_by_hop(&of.system, anchor, clock) {
                if let Event::Impact(impact) = event {
                    of.strike(&mut here, &impact, impact.clock)?;
                }
            }
            return of.at(&here, clock, known);
        }
        of.at(&self.here, clock, known)
    }
}
