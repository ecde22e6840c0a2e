//! Derivatives of a motion that has come to repeat itself.
//!
//! One cycle is followed with perturbations of its start beside: all that is told of it, and the
//! derivatives D at its end, are then linear in those at its start, D -> M D + b. The other cycles follow
//! from this, as the run copies its records; tables write their rows when they are read (table.rs).

use std::sync::Arc;

use nalgebra::DMatrix;

use super::marks::{OneSided, note};
use super::structure_follower::{Follower, Rows, Turn};
use super::structure_legs::{Cycled, Cycles, From, SensitiveLeg};
use super::structure_source::{Alike, Source};
use super::table::{self, Growing, Later, SensitivityTable};
use crate::flight::Drive;
use crate::model::state::Clock;
use crate::model::structure::{Structure, Variation};
use crate::numerics::repetition::applied;
use crate::simulate::AnchorOf;
use crate::tangent::structure::{Linearised, Perturbed};

/// What is told of a cycle, its legs, and the derivatives at its end.
pub(super) type OfCycle = (Rows, Vec<SensitiveLeg>, DMatrix<f64>);

/// Fewest cycles, beside the one that is followed, for which that is worth the while.
const FEWEST: i64 = 4;

impl Follower<'_> {
    /// A cycle that may begin here, where nothing of what has been before counts but the state, and that
    /// comes again often.
    pub(super) fn cycle_from(&self, source: &Source) -> Option<Alike> {
        let alike = source.alike()?;
        let begins = source.begins_flight() && self.derivatives.begins_anew();
        (begins && source.cycles_left(&alike) > FEWEST).then_some(alike)
    }

    /// What follows one cycle from here, the derivatives of the state at its start beside.
    pub(super) fn of_one_cycle<'b>(&self, unit: &'b Perturbed, clock: Clock) -> Follower<'b> {
        let (rows, count) = (self.derivatives.columns().nrows(), self.of.by.len());
        let columns = DMatrix::from_fn(rows, rows + count, |i, j| f64::from(u8::from(i == j)));
        Follower {
            of: unit.shared(),
            span: self.span.clone(),
            section_offset: self.section_offset,
            derivatives: unit.at(clock, columns),
            legs: Vec::new(),
            rows: Rows::default(),
            given_up: None,
            plain: 0,
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

    /// Follows one cycle, and takes the others from it; `None`: the motion stays where it is, as
    /// derivatives by some start are refused.
    pub(super) fn repeat(&mut self, source: &mut Source, alike: &Alike) -> Option<Turn> {
        let saved = source.clone();
        let start = source.anchor().clone();
        let events = source.events() + alike.events;
        self.derivatives.settle(&start);
        let unit = self.unit();
        let mut one = self.of_one_cycle(&unit, start.clock);
        one.leg(source);
        let turn = loop {
            let Ok(turn) = one.turn(source) else {
                *source = saved;
                return None;
            };
            if turn == Turn::Cancelled {
                return Some(self.leave(source, saved, alike));
            }
            if turn != Turn::Over || (source.events() >= events && source.begins_flight()) {
                break turn;
            }
        };
        let here = source.anchor().clone();
        let is_whole = turn == Turn::Over && here == later(&start, alike.periods);
        let times = if is_whole { source.cycles_left(alike) } else { 0 };
        if turn == Turn::Over {
            one.derivatives.settle(&here);
            // That is the first of the next cycle.
            one.legs.pop();
        }
        let (end, goes_on) = (one.span.end, || !source.is_cancelled());
        let all = (start.clock, times, alike.periods);
        if !self.take_cycles(one.into_cycle(), unit, all, goes_on) {
            return Some(self.leave(source, saved, alike));
        }
        self.span.end = end;
        if turn == Turn::Over {
            source.pass(alike, times);
            self.derivatives.begin_at(source.anchor().clock);
            self.leg(source);
        }
        Some(turn)
    }

    /// Leaves the motion at the start of a cycle, as the caller has cancelled the rest.
    fn leave<'a>(&mut self, source: &mut Source<'a>, saved: Source<'a>, alike: &Alike) -> Turn {
        *source = saved;
        // So that it can go on from here, however short its parts are.
        self.plain = alike.events;
        Turn::Cancelled
    }

    /// Takes a cycle that has been followed, from its start at this instant, and so many more; whether
    /// `goes_on` has not ended it.
    fn take_cycles(
        &mut self,
        (rows, legs, map): OfCycle,
        unit: Perturbed,
        (clock, times, periods): (Clock, i64, i64),
        goes_on: impl Fn() -> bool,
    ) -> bool {
        let shape @ (count, width) = self.derivatives.columns().shape();
        let after =
            |start: &DMatrix<f64>| map.columns(0, count) * start + map.columns(count, width);
        let next = clock.period + (times + 1) * periods;
        if times > 0 && next < self.span.window.period {
            // Of cycles before the window nothing is told but what comes after them.
            let here = self.derivatives.columns().clone();
            let apply = |here: &mut DMatrix<f64>| *here = after(here);
            let Some(here) = applied(here, times.unsigned_abs() + 1, apply, goes_on) else {
                return false;
            };
            *self.derivatives.columns_mut() = here;
            self.rows.take_cycles(&rows, (times + 1, periods), self.of.drive());
            return true;
        }
        let mut starts = Vec::new();
        for _ in 0..=times {
            let start = self.derivatives.columns();
            starts.extend_from_slice(start.as_slice());
            *self.derivatives.columns_mut() = after(start);
        }
        let drive = self.of.drive();
        self.rows.take_cycles(&rows, (times + 1, periods), drive);
        if legs.is_empty() {
            return true;
        }
        let starts = Arc::new(starts);
        let table = |of: &SensitivityTable| table::Cycles::new(of.followed(), shape, &starts);
        let all = &mut self.rows;
        let growing = self.of.later(1).map(|rates| {
            let rates = rates.iter().copied().enumerate().filter(|&(_, rate)| rate != 0.0);
            Growing { later: Later { early: 0, periods }, rates: rates.collect() }
        });
        all.times.repeat(table(&rows.times).growing(growing));
        all.before.repeat(table(&rows.before));
        all.after.repeat(table(&rows.after));
        all.stroboscopic.repeat(table(&rows.stroboscopic));
        if self.legs.last().is_some_and(|last| last.clock == clock) {
            self.legs.pop();
        }
        let of = Arc::new(Cycles { legs, unit, periods, starts, shape });
        let from = From::Cycled(Cycled { of, cycle: 0, place: 0 });
        self.legs.push(SensitiveLeg { time: drive.time(clock), clock, from });
        true
    }
}

/// The same so many drive periods later.
fn later(anchor: &AnchorOf<Structure>, periods: i64) -> AnchorOf<Structure> {
    let mut anchor = anchor.clone();
    anchor.clock.period += periods;
    anchor
}

impl Rows {
    /// What is told of so many cycles, one after another, beside the tables.
    fn take_cycles(&mut self, one: &Rows, (cycles, periods): (i64, i64), drive: &Drive) {
        let time = |cycle: i64| drive.period.hi * (cycle * periods) as f64;
        // Of cycles before the window, the others say nothing that the first does not.
        let told = if one.earlier < one.events { cycles } else { 1 };
        for cycle in 0..told {
            let (later, time) = (cycle * periods, time(cycle));
            let before = self.events + cycle * one.events;
            let impacts = one.impacts.iter();
            self.impacts.extend(impacts.map(|&(period, at)| (period + later, at + time)));
            for at in &one.one_sided {
                let (index, time) = (at.index + before, at.time + time);
                note(&mut self.one_sided, OneSided { index, time, ..*at }, at.index < one.earlier);
            }
        }
        self.events += cycles * one.events;
        self.earlier += cycles * one.earlier;
        let later = (cycles - 1) * periods;
        let chatter = one.chatter.map(|at| Clock { period: at.period + later, ..at });
        self.chatter = chatter.or(self.chatter);
    }
}

#[cfg(test)]
mod tests {
    use crate::model::structure::{Stop, Structure, StructureState, Variation};
    use crate::numerics::cancel::CancelToken;
    use crate::simulate::run::{Proceeds, Run, RunOptions, run};
    use crate::tangent::sensitivity::structure::carried_out;
    use crate::tangent::sensitivity::{
        Sensitivity, SensitivityError, StructureLegs, structure_run_with_sensitivity,
        structure_sensitivity,
    };

    const PERIODS: i64 = 400;
    const NAMES: [&str; 4] = ["gap", "v_0", "drive_frequency", "stiffness[0, 1]"];

    fn between(gaps: [f64; 2], restitution: f64, drive_frequency: f64) -> Structure {
        let (mass, stiffness) = ([[1.0, 0.0], [0.0, 2.0]], [[2.0, -1.0], [-1.0, 1.0]]);
        Structure::builder(mass.map(Vec::from).into(), stiffness.map(Vec::from).into())
            .stop(Stop::new([1.0, 0.0], gaps[0], restitution))
            .stop(Stop::new([-1.0, 0.0], gaps[1], restitution))
            .damping_ratios(vec![0.02, 0.05])
            .drive(vec![0.0.into(), 1.0.into()], drive_frequency, 0.0)
            .build()
            .unwrap()
    }

    /// Motions that repeat to the last bit: with impacts alone, with chatter, with two stops that close, of
    /// which one moves, and with slip and stick.
    fn motions() -> [Structure; 4] {
        let row = |numbers: [f64; 2]| numbers.to_vec();
        let rubs = Stop::new([0.0, 1.0], 0.1, 0.2).with_friction(0.3, [1.0, 0.0]);
        let stick = Structure::builder(
            vec![row([1.0, 0.0]), row([0.0, 1.0])],
            vec![row([2.0, -1.0]), row([-1.0, 2.0])],
        )
        .stop(rubs)
        .damping_ratios(vec![0.02, 0.02])
        .drive(vec![1.0.into(), 0.3.into()], 0.37, 0.0)
        .static_load(vec![0.0, 0.4])
        .build()
        .unwrap();
        [
            between([0.3, 4.0], 0.5, 0.9),
            between([0.1, 0.3], 0.4, 0.41),
            between([0.05, 0.05], 0.5, 0.23),
            stick,
        ]
    }

    fn of(run: &Run<Structure>) -> Sensitivity<StructureLegs> {
        let by = |name: &str| (name.to_owned(), Variation::named(name, &run.system).unwrap());
        let never = CancelToken::never();
        structure_sensitivity(run, start(), NAMES.map(by).to_vec(), &never).unwrap()
    }

    fn start() -> StructureState {
        StructureState::new(&[0.01, 0.0], &[0.0, 0.0])
    }

    fn simulated(structure: &Structure, options: RunOptions) -> Run<Structure> {
        run(structure, start(), options, &CancelToken::never()).unwrap()
    }

    fn assert_same(found: &[f64], others: &[f64]) {
        assert_eq!(found.len(), others.len());
        for (found, other) in found.iter().zip(others) {
            assert!((found - other).abs() <= 1e-9 * (1.0 + other.abs()), "{found} {other}");
        }
    }

    /// At impacts: before the last bounces, derivatives have an error of some roundings over u.
    fn assert_same_at(run: &Run<Structure>, found: &[f64], others: &[f64]) {
        assert_eq!(found.len(), others.len());
        let size = (found.len() / run.impacts.len().max(1)).max(1);
        let rows = found.chunks_exact(size).zip(others.chunks_exact(size));
        for ((found, other), row) in rows.zip(&run.impacts) {
            for (found, other) in found.iter().zip(other) {
                let most = 1e-9 + 1e-13 / row.approach_velocity;
                assert!((found - other).abs() <= most * (1.0 + other.abs()), "{found} {other}");
            }
        }
    }

    #[test]
    fn cycles_that_repeat_have_the_derivatives_of_those_that_are_followed() {
        for structure in motions() {
            let options = RunOptions { section_phase: 1.3, ..RunOptions::periods(PERIODS) };
            let all = simulated(&structure, options);
            let copied: usize = all.trace.copies.iter().map(|all| all.times).sum();
            assert!(copied > 10, "{copied} cycles");
            let mut followed = simulated(&structure, options);
            // Each cycle has what it is a copy of noted for it.
            let copies = std::mem::take(&mut followed.trace.copies);
            let legs = followed.trace.legs.as_mut().unwrap();
            for copies in copies {
                let first = copies.first - copies.events;
                let cycle: Vec<_> = legs
                    .iter()
                    .filter(|leg| (first..copies.first).contains(&leg.events))
                    .cloned()
                    .collect();
                for time in 1..=copies.times {
                    for leg in &cycle {
                        let mut leg = leg.clone();
                        leg.events += time * copies.events;
                        leg.anchor.clock.period += time as i64 * copies.periods;
                        legs.push(leg);
                    }
                }
                legs.sort_by_key(|leg| leg.events);
            }
            let (found, other) = (of(&all), of(&followed));
            assert_same_at(&all, &found.times, &other.times);
            assert_same_at(&all, &found.before, &other.before);
            assert_same_at(&all, &found.after, &other.after);
            assert_same(&found.stroboscopic, &other.stroboscopic);
            assert_same(&found.final_state, &other.final_state);
            assert_eq!(found.one_sided, other.one_sided);
            let end = all.final_state.time;
            let times: Vec<f64> = (0..=997).map(|i| end * f64::from(i) / 997.0).collect();
            let along = |of: &Sensitivity<_>| {
                of.trajectory(&times, &CancelToken::never()).unwrap().unwrap()
            };
            assert_same(&along(&found), &along(&other));
        }
    }

    #[test]
    fn a_window_that_is_followed_again_has_the_rows_of_the_whole_run() {
        for structure in motions() {
            for kept in [1, 7, 390] {
                let options = RunOptions::periods(PERIODS);
                let all = simulated(&structure, options);
                let part = simulated(&structure, options.keep(kept));
                let (all_of_it, found) = (of(&all), of(&part));
                let last = |table: &[f64], numbers: usize| table[table.len() - numbers..].to_vec();
                assert_eq!(found.times.len(), NAMES.len() * part.impacts.len());
                assert_same_at(&part, &found.times, &last(&all_of_it.times, found.times.len()));
                let before = last(&all_of_it.before, found.before.len());
                assert_same_at(&part, &found.before, &before);
                let after = last(&all_of_it.after, found.after.len());
                assert_same_at(&part, &found.after, &after);
                let sections = last(&all_of_it.stroboscopic, found.stroboscopic.len());
                assert_same(&found.stroboscopic, &sections);
                assert_same(&found.final_state, &all_of_it.final_state);
                let (first, end) = (part.kept_from(), part.final_state.time);
                let times: Vec<f64> =
                    (0..=97).map(|i| first + (end - first) * f64::from(i) / 97.0).collect();
                let along = |of: &Sensitivity<_>| {
                    of.trajectory(&times, &CancelToken::never()).unwrap().unwrap()
                };
                assert_same(&along(&found), &along(&all_of_it));
            }
        }
    }

    #[test]
    fn a_run_made_with_its_derivatives_is_the_run_and_has_those_of_it() {
        let never = CancelToken::never();
        for structure in motions() {
            let by = |name: &str| (name.to_owned(), Variation::named(name, &structure).unwrap());
            for (kept, section_phase) in [(0, 0.0), (1, 1.3), (7, 0.0), (390, 1.3), (400, 0.0)] {
                let options = RunOptions { section_phase, ..RunOptions::periods(PERIODS) };
                let (options, by) = (options.keep(kept), NAMES.map(by).to_vec());
                let (mut made, found) =
                    structure_run_with_sensitivity(&structure, start(), options, by, &never)
                        .unwrap();
                let alone = simulated(&structure, options);
                // How much was worked out differs, nothing else.
                made.evaluations = alone.evaluations;
                assert!(made == alone, "{kept}");
                let other = of(&alone);
                assert_same_at(&alone, &found.times, &other.times);
                assert_same_at(&alone, &found.before, &other.before);
                assert_same_at(&alone, &found.after, &other.after);
                assert_same(&found.stroboscopic, &other.stroboscopic);
                assert_same(&found.final_state, &other.final_state);
                assert_eq!(found.one_sided, other.one_sided);
            }
        }
    }

    #[test]
    fn a_run_made_with_its_derivatives_in_parts_is_that_made_at_once() {
        let never = CancelToken::never();
        for structure in motions() {
            let by = |name: &str| (name.to_owned(), Variation::named(name, &structure).unwrap());
            let (options, by) = (RunOptions::periods(PERIODS).keep(300), NAMES.map(by).to_vec());
            let whole = structure_run_with_sensitivity;
            let (run, found) = whole(&structure, start(), options, by.clone(), &never).unwrap();
            for asks in [2, 10, 50] {
                let mut parts = 1;
                let in_parts = |work: &mut (dyn Proceeds + Send)| {
                    while !work.proceed(&CancelToken::after(asks)) {
                        parts += 1;
                    }
                    Ok::<_, SensitivityError>(())
                };
                let (mut other, again) =
                    carried_out(&structure, start(), options, by.clone(), in_parts).unwrap();
                let again = again.unwrap();
                assert!(parts > 1, "{parts}");
                other.evaluations = run.evaluations;
                assert!(other == run, "{asks}");
                assert_same_at(&run, &again.times, &found.times);
                assert_same_at(&run, &again.after, &found.after);
                assert_same(&again.stroboscopic, &found.stroboscopic);
                assert_same(&again.final_state, &found.final_state);
            }
        }
    }

    #[test]
    fn a_run_that_has_noted_nothing_is_followed_again() {
        for structure in motions() {
            let all = simulated(&structure, RunOptions::periods(40));
            let mut bare = all.clone();
            bare.trace = crate::simulate::run::Trace::default();
            let (found, other) = (of(&bare), of(&all));
            assert_same(&found.stroboscopic, &other.stroboscopic);
            assert_same(&found.final_state, &other.final_state);
        }
    }

    #[test]
    fn cycles_before_a_window_are_not_followed_one_by_one() {
        let never = CancelToken::never();
        for structure in motions() {
            let by = |name: &str| (name.to_owned(), Variation::named(name, &structure).unwrap());
            let by = ["gap", "v_0", "stiffness[0, 1]"].map(by).to_vec();
            // More than any memory has room for.
            let [few, many] = [PERIODS, 1_000_000_000_000].map(|periods| {
                let options =
                    RunOptions { max_events: i64::MAX as u64, ..RunOptions::periods(periods) };
                let options = options.keep(5);
                structure_run_with_sensitivity(&structure, start(), options, by.clone(), &never)
                    .unwrap()
                    .1
            });
            assert_same(&many.stroboscopic, &few.stroboscopic);
            assert_same(&many.final_state, &few.final_state);
        }
    }
}
