//! The legs of a window, with the derivatives at their starts.

use super::columns::{Column, Columns, Differentiated, Here};
use super::error::SensitivityError;
use super::impact::FollowedImpact;
use super::long_flight::Waypoints;
use super::table::{Cycles, Later, first_not};
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
    /// On the way to an instant of it.
    pub passed: Waypoints,
}

/// Legs in order, with memory for no more columns than there are, and for one cycle of those that repeat.
#[derive(Default)]
pub(super) struct KeptLegs {
    /// What was followed.
    legs: Vec<Leg>,
    /// Of each: rows as in the tables, components (x1, x1', x2', x2 or t), and of each a number for each
    /// column.
    rows: Vec<f64>,
    /// What comes again, in order.
    repeated: Vec<Repeated>,
}

#[derive(Clone)]
struct Leg {
    time: f64,
    state: State,
    clock: Clock,
    after_event: bool,
    mode: Option<ContactMode>,
    hops: bool,
}

/// Legs of cycles, one cycle after the other, among others.
struct Repeated {
    /// How many of those that were followed come before.
    at: usize,
    /// Of one cycle.
    legs: Vec<Leg>,
    of: RepeatedLegs,
}

/// Legs of a motion that repeats.
pub(super) struct RepeatedLegs {
    /// Where those of a cycle begin.
    pub begins: Vec<Clock>,
    /// The first that is kept of all legs of all cycles.
    pub first: usize,
    pub later: Later,
    /// The columns, four rows for each leg.
    pub columns: Cycles,
}

impl Repeated {
    /// How many drive periods after the same one in the cycle that was followed a leg comes.
    fn later(&self, place: usize) -> i64 {
        self.of.later.of(place / self.legs.len())
    }

    /// When a leg begins.
    fn time(&self, place: usize, of: &Differentiated) -> f64 {
        let begin = self.of.begins[place % self.legs.len()];
        let period = begin.period + self.later(place);
        of.model.motion.drive.time(Clock { period, ..begin })
    }

    /// A leg, its time and its columns.
    fn leg(&self, place: usize, of: &Differentiated) -> (Leg, Vec<f64>) {
        let mut leg = self.legs[place % self.legs.len()].clone();
        leg.time = self.time(place, of);
        leg.clock.period += self.later(place);
        let mut rows = vec![0.0; 4 * of.by.len()];
        self.of.columns.write_rows(4 * place..4 * place + 4, &mut rows);
        (leg, rows)
    }
}

impl KeptLegs {
    pub fn with_capacity(legs: usize, columns: usize) -> Self {
        Self {
            legs: Vec::with_capacity(legs),
            rows: Vec::with_capacity(4 * legs * columns),
            repeated: Vec::new(),
        }
    }

    pub fn push(&mut self, leg: &SensitiveLeg) {
        let &SensitiveLeg { ref here, mode, hops, time, .. } = leg;
        for component in 0..4 {
            self.rows.extend(here.columns.iter().map(|column| column[component]));
        }
        let Departure { clock, slope, .. } = here.departure;
        let (state, after_event) = (here.state, slope.is_some());
        self.legs.push(Leg { time, state, clock, after_event, mode, hops });
    }

    /// The rows of what was followed.
    pub fn rows(&self) -> &[f64] {
        &self.rows
    }

    /// Adds those of a cycle that come again.
    pub fn repeat(&mut self, cycle: Self, of: RepeatedLegs) {
        if !of.columns.rows.is_empty() {
            self.repeated.push(Repeated { at: self.legs.len(), legs: cycle.legs, of });
        }
    }

    /// The last leg that begins not later than a time, or the first one.
    pub fn at(&self, time: f64, of: &Differentiated) -> SensitiveLeg {
        let begun = |repeated: &Repeated| repeated.time(repeated.of.first, of) <= time;
        let next = self.repeated.partition_point(begun);
        let to = self.repeated.get(next).map_or(self.legs.len(), |repeated| repeated.at);
        let last = next.checked_sub(1).map(|last| &self.repeated[last]);
        let from = last.map_or(0, |repeated| repeated.at);
        let followed = self.legs[from..to].partition_point(|leg| leg.time <= time);
        let (leg, rows) = if let (0, Some(repeated)) = (followed, last) {
            let all = repeated.of.first..repeated.of.columns.rows.end / 4;
            let after = first_not(all, |place| repeated.time(place, of) <= time);
            repeated.leg(after - 1, of)
        } else if from < to {
            let (place, width) = (from + followed.max(1) - 1, 4 * of.by.len());
            (self.legs[place].clone(), self.rows[place * width..][..width].to_vec())
        } else {
            let first = &self.repeated[next];
            first.leg(first.of.first, of)
        };
        let Leg { time, state, clock, after_event, mode, hops } = leg;
        let departure = Departure::new(&of.model, &state, clock, after_event);
        let k = of.by.len();
        let column = |i: usize| std::array::from_fn(|component| rows[component * k + i]);
        let columns: Columns = (0..k).map(column).collect();
        let here = Here { state, clock, trig: of.model.trig(clock), departure, columns };
        SensitiveLeg { here, mode, hops, time, passed: Waypoints::default() }
    }
}

impl SensitiveLeg {
    /// Derivatives of the state at a fixed instant of this leg, and its rates there; `known`: that state.
    pub fn at(
        &mut self,
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
                    let impact = FollowedImpact::found(&of.system, &impact);
                    of.strike(&mut here, &impact, impact.clock)?;
                }
            }
            return of.at(&here, &mut Waypoints::default(), (clock, known));
        }
        of.at(&self.here, &mut self.passed, (clock, known))
    }
}
