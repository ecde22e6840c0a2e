//! Derivatives of a motion that has come to repeat itself.
//!
//! One cycle is followed with perturbations of its start beside: all that is told of it, and the
//! derivatives D at its end, are then linear in those at its start, D -> M D + b. The other cycles follow
//! from this, as the run copies its records.

use std::sync::Arc;

use nalgebra::{DMatrix, RowDVector};

use super::structure_follower::{Follower, Rows, Turn};
use super::structure_legs::{Cycled, From, OneCycle, SensitiveLeg};
use crate::model::state::Clock;
use crate::model::structure::{Structure, Variation};
use crate::simulate::run::{Run, StopImpactRecord};
use crate::simulate::{AnchorOf, Cycle, Phase, Simulation};
use crate::tangent::structure::{Linearised, Perturbed};

/// The impacts of a run that come again and again, the last ones of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RepeatedImpacts {
    /// The first impact after which everything is repeated, and how many there are in a cycle.
    pub first: usize,
    pub count: usize,
    pub periods: i64,
    /// How many whole cycles there are, beside one.
    pub left: i64,
}

impl RepeatedImpacts {
    /// Of impacts that are kept one and all.
    pub fn of(run: &Run<Structure>) -> Option<Self> {
        let rows = &run.impacts;
        let last = rows.len().checked_sub(1)?;
        let count = (1..=last).find(|&count| is_again(&rows[last - count], &rows[last]))?;
        let periods = rows[last].period - rows[last - count].period;
        let is_same = |&place: &usize| {
            let (row, later) = (&rows[place], &rows[place + count]);
            is_again(row, later) && later.period - row.period == periods
        };
        let first = (0..=last - count).rev().take_while(is_same).last()?;
        let left = i64::try_from((last - first) / count).unwrap_or(i64::MAX) - 1;
        (periods > 0 && left >= FEWEST).then_some(Self { first, count, periods, left })
    }
}

/// Whether the motion after two impacts is the same.
fn is_again(one: &StopImpactRecord, other: &StopImpactRecord) -> bool {
    one.time_in_period.to_bits() == other.time_in_period.to_bits()
        && one.stop == other.stop
        && one.q == other.q
        && one.v_pre == other.v_pre
        && one.v_post == other.v_post
}

/// What is told of a cycle, its legs, and the derivatives at its end.
pub(super) type OfCycle = (Rows, Vec<SensitiveLeg>, DMatrix<f64>);

/// Fewest cycles, beside the one that is followed, for which that is worth the while.
const FEWEST: i64 = 4;

impl Follower<'_> {
    /// Whether a cycle may begin here: nothing of what has been before counts, but the state.
    pub(super) fn can_repeat(&self, simulation: &Simulation<Structure>, cycle: &Cycle) -> bool {
        let point = simulation.checkpoint();
        let anchor = &point.anchor;
        matches!(anchor.phase, Phase::Flight(_))
            && !point.skips()
            && point.elapsed.hi == 0.0
            && self.derivatives.begins_anew()
            && self.cycles_left(simulation, cycle) > FEWEST
    }

    /// How many cycles there are from here on, all before the window, of which nothing is told, or all in it.
    fn cycles_left(&self, simulation: &Simulation<Structure>, cycle: &Cycle) -> i64 {
        let (point, left) = (simulation.checkpoint(), simulation.cycles_left_to_end(cycle));
        let clock = point.anchor.clock;
        if clock <= self.window {
            return left.min((self.window.period - 2 - clock.period).max(0) / cycle.periods);
        }
        if point.next_section >= self.sections.start { left } else { 0 }
    }

    /// What follows one cycle from here, the derivatives of the state at its start beside.
    pub(super) fn of_one_cycle<'b>(&self, unit: &'b Perturbed, clock: Clock) -> Follower<'b> {
        let (rows, count) = (self.derivatives.columns().nrows(), self.of.by.len());
        let columns = DMatrix::from_fn(rows, rows + count, |i, j| f64::from(u8::from(i == j)));
        Follower {
            of: unit.shared(),
            window: self.window,
            end: self.end,
            section_offset: self.section_offset,
            sections: self.sections.clone(),
            derivatives: unit.at(clock, columns),
            legs: Vec::new(),
            rows: Rows::default(),
        }
    }

    /// What it has found.
    pub(super) fn into_cycle(self) -> OfCycle {
        (self.rows, self.legs, self.derivatives.into_matrix())
    }

    /// None of these perturbations; by their start, and by the numbers.
    pub(super) fn unit(&self) -> Perturbed {
        let starts = std::iter::repeat_n(Variation::default(), self.derivatives.columns().nrows());
        let by = starts.chain(self.of.by.iter().map(|varied| varied.by.clone())).collect();
        let of = Arc::new(Linearised::along(&self.of.structure, by));
        Perturbed::new(of, Clock::START, DMatrix::zeros(0, 0))
    }

    /// Follows one cycle of a simulation, and takes the others from it; `None`: the simulation stays where
    /// it is, as derivatives by some start are refused.
    pub(super) fn repeat(
        &mut self,
        simulation: &mut Simulation<Structure>,
        cycle: &Cycle,
    ) -> Option<Turn> {
        let saved = simulation.clone();
        let start = simulation.checkpoint().anchor.clone();
        let events = simulation.checkpoint().events + cycle.events;
        self.derivatives.settle(&start);
        let unit = self.unit();
        let mut one = self.of_one_cycle(&unit, start.clock);
        one.leg(simulation);
        let turn = loop {
            let Ok(turn) = one.turn(simulation) else {
                *simulation = saved;
                return None;
            };
            let point = simulation.checkpoint();
            let is_over = point.events >= events && point.elapsed.hi == 0.0;
            if turn != Turn::Over || is_over {
                break turn;
            }
        };
        let here = simulation.checkpoint().anchor.clone();
        let is_whole = turn == Turn::Over && here == later(&start, cycle.periods);
        let times = if is_whole { self.cycles_left(simulation, cycle) } else { 0 };
        if turn == Turn::Over {
            one.derivatives.settle(&here);
        }
        self.take_cycles(one.into_cycle(), unit, (times, cycle.periods));
        if turn == Turn::Over {
            simulation.repeat(cycle, times);
            let clock = simulation.checkpoint().anchor.clock;
            self.derivatives.begin_at(clock);
            self.leg(simulation);
        }
        Some(turn)
    }

    /// Takes a cycle that has been followed, and so many more.
    pub(super) fn take_cycles(
        &mut self,
        (rows, legs, map): OfCycle,
        unit: Perturbed,
        (times, periods): (i64, i64),
    ) {
        let cycle = Arc::new(OneCycle { unit, legs });
        let drive = *self.of.drive();
        for time in 0..=times {
            let later = time * periods;
            let start = Arc::new(self.derivatives.columns().clone());
            let after = (later, drive.period.hi * later as f64);
            self.rows.take_cycle(&rows, &start, after, self.of.later(later).as_ref());
            for (place, leg) in cycle.legs.iter().enumerate() {
                let clock = Clock { period: leg.clock.period + later, ..leg.clock };
                let (of, start) = (Arc::clone(&cycle), Arc::clone(&start));
                let from = From::Cycled(Cycled { of, place, periods: later, start });
                self.legs.push(SensitiveLeg { time: drive.time(clock), clock, from });
            }
            let count = start.nrows();
            let by_start = map.columns(0, count) * &*start;
            *self.derivatives.columns_mut() = by_start + map.columns(count, start.ncols());
        }
    }
}

/// The same so many drive periods later.
fn later(anchor: &AnchorOf<Structure>, periods: i64) -> AnchorOf<Structure> {
    let mut anchor = anchor.clone();
    anchor.clock.period += periods;
    anchor
}

impl Rows {
    /// What is told of a cycle, from the derivatives at its start.
    fn take_cycle(
        &mut self,
        one: &Self,
        start: &DMatrix<f64>,
        (periods, time): (i64, f64),
        later: Option<&RowDVector<f64>>,
    ) {
        let from = self.times.len();
        combine(&one.times, start, &mut self.times);
        if let Some(later) = later {
            for row in self.times[from..].chunks_exact_mut(start.ncols()) {
                row.iter_mut().zip(later.iter()).for_each(|(x, later)| *x += later);
            }
        }
        combine(&one.before, start, &mut self.before);
        combine(&one.after, start, &mut self.after);
        combine(&one.stroboscopic, start, &mut self.stroboscopic);
        self.impacts.extend(one.impacts.iter().map(|&(period, at)| (period + periods, at + time)));
        self.one_sided.extend(one.one_sided.iter().map(|at| super::marks::OneSided {
            index: at.index + self.events,
            time: at.time + time,
            ..*at
        }));
        self.events += one.events;
        self.earlier += one.earlier;
        let chatter = one.chatter.map(|at| Clock { period: at.period + periods, ..at });
        self.chatter = chatter.or(self.chatter);
    }
}

/// Appends what rows by the start and by the numbers are from derivatives of the start.
fn combine(rows: &[f64], start: &DMatrix<f64>, to: &mut Vec<f64>) {
    let (count, by) = start.shape();
    to.reserve(rows.len() / (count + by) * by);
    for row in rows.chunks_exact(count + by) {
        let (by_start, by_numbers) = row.split_at(count);
        let columns = start.as_slice().chunks_exact(count);
        to.extend(columns.zip(by_numbers).map(|(column, own)| {
            column.iter().zip(by_start).fold(*own, |sum, (d, x)| sum + d * x)
        }));
    }
}
