//! Motions that repeat to the last bit: their derivatives are worked out in one cycle, as affine
//! functions of those at its start, which then give all cycles.

use std::ops::Range;
use std::sync::Arc;

use super::columns::{Column, Columns, counted};
use super::error::SensitivityError;
use super::follow::{Follower, Step};
use super::legs::RepeatedLegs;
use super::marks::{OneSided, note};
use super::source::{Alike, Passed, Source};
use super::table::{Cycles, Growing, Later, first_not};
use crate::model::state::Clock;
use crate::numerics::repetition::applied;

/// Components of a state: by each, a column of the basis.
const COMPONENTS: usize = 4;

/// Columns from those of the basis and the own parts, by the columns at the start.
fn mapped<'a>(shown: &'a [Column], start: &'a [Column]) -> impl Iterator<Item = Column> + 'a {
    let (basis, own) = shown.split_at(COMPONENTS);
    let sum = |(own, column): (&Column, &Column)| {
        std::array::from_fn(|i| {
            let parts = basis.iter().zip(column).map(|(basis, part)| basis[i] * part);
            counted(own[i] + parts.sum::<f64>())
        })
    };
    own.iter().zip(start).map(sum)
}

impl Follower<'_> {
    /// Follows the motion through one of its cycles and, without looking, through all that are alike.
    pub(super) fn follow_alike(
        &mut self,
        (source, passed): (&mut Source, &mut Passed),
        alike: &Alike,
    ) -> Result<Step, SensitivityError> {
        let saved = source.clone();
        let of = self.of.with_basis();
        let mut one = self.with(&of, of.basis());
        // Those of this cycle stand for those of all.
        let first = std::mem::replace(&mut passed.first, i64::MIN);
        let mut step = Step::Goes;
        for _ in 0..alike.events {
            step = one.step(source, passed)?;
            if !matches!(step, Step::Goes) {
                break;
            }
        }
        passed.first = first;
        let times = match step {
            Step::Goes => source.pass(alike),
            Step::Ends(_) => Some(0),
            Step::Cancelled => None,
        };
        // Of cycles before the window nothing is told but what comes after them.
        let after = |times: i64| {
            let (map, early) = (&one.leg.here.columns, self.early(&one, alike.periods).min(times));
            let apply = |here: &mut Columns| *here = mapped(map, here).collect();
            let here = self.leg.here.columns.clone();
            let here = applied(here, early.unsigned_abs(), apply, || !source.is_cancelled())?;
            Some((times, early, here))
        };
        let Some((times, early, mut here)) = times.and_then(after) else {
            // So that it can go on from here, however short its parts are.
            *source = saved;
            passed.all.clear();
            self.plain = alike.events;
            return Ok(Step::Cancelled);
        };
        let map = &one.leg.here.columns;
        let told = times - early;
        let mut starts = Vec::with_capacity((told.unsigned_abs() as usize + 1) * 4 * here.len());
        starts.extend_from_slice(here.as_flattened());
        let mut next = here.clone();
        for _ in 0..told {
            next.iter_mut().zip(mapped(map, &here)).for_each(|(next, column)| *next = column);
            std::mem::swap(&mut here, &mut next);
            starts.extend_from_slice(here.as_flattened());
        }
        if matches!(step, Step::Goes) {
            next = mapped(map, &here).collect();
        }
        self.repeat(&mut one, &Arc::new(starts), Later { early, periods: alike.periods });
        if let Step::Ends(columns) = step {
            return Ok(Step::Ends(mapped(&columns, &here).collect()));
        }
        self.go_on_from(&one, (next, times * alike.periods));
        Ok(step)
    }

    /// How many cycles end a drive period or more before the window: this one, and those after it.
    fn early(&self, one: &Follower, periods: i64) -> i64 {
        ((self.span.window.period - 1 - one.began.period) / periods).max(0)
    }

    /// Takes the events of cycles, one of which was followed: some before the window, and those from these
    /// columns at their starts.
    fn repeat(&mut self, one: &mut Follower, starts: &Arc<Vec<f64>>, later: Later) {
        let drive = &self.of.model.motion.drive;
        let Some(instants) = one.instants.take() else { return };
        let k = self.of.by.len();
        let cycles = starts.len() / (COMPONENTS * k);
        // Of things that come so many times in each cycle, one after the other: the first that is not so.
        let first_not = |count: usize, is: &dyn Fn(usize, i64) -> bool| {
            first_not(0..count * cycles, |place| is(place % count, later.of(place / count)))
        };
        let then = |clock: &Clock, later: i64| Clock { period: clock.period + later, ..*clock };
        let window = self.span.window;
        let rows = &mut self.rows;
        let (events, early) = (instants.events.len() as i64, later.early);
        if !instants.marks.is_empty() {
            // Of the early ones, the others say nothing that the first does not.
            for cycle in (0..early.min(1)).chain(early..early + cycles as i64) {
                let before = rows.events + cycle * events;
                for (clock, mark) in instants.marks.iter().zip(&one.rows.one_sided) {
                    let clock = then(clock, cycle * later.periods);
                    let (index, time) = (before + mark.index, drive.time(clock));
                    let mark = OneSided { index, time, ..*mark };
                    note(&mut rows.one_sided, mark, clock < window);
                }
            }
        }
        let earlier = |i: usize, later: i64| then(&instants.events[i], later) < window;
        rows.earlier += early * events + first_not(instants.events.len(), &earlier) as i64;
        rows.events += (early + cycles as i64) * events;

        let impacts = instants.impacts.len();
        let earlier = |i: usize, later: i64| then(&instants.impacts[i], later) < window;
        let first = first_not(impacts, &earlier);
        if self.looks {
            rows.impacts.extend((first..impacts * cycles).map(|place| {
                let clock = then(&instants.impacts[place % impacts], later.of(place / impacts));
                (clock.period, drive.time(clock))
            }));
        }
        let table =
            |of: &[f64], rows: Range<usize>| Cycles::new(of, (COMPONENTS, k), starts).among(rows);
        let all = impacts * cycles;
        let rates = |column| vec![(column, self.of.period_rate())];
        let growing = self.of.late().map(|column| Growing { later, rates: rates(column) });
        let times = table(one.rows.times.followed(), first..all);
        rows.times.repeat(times.growing(growing));
        rows.before.repeat(table(one.rows.before.followed(), 4 * first..4 * all));
        rows.after.repeat(table(one.rows.after.followed(), 4 * first..4 * all));

        let numbers = &instants.sections;
        let before = |end: i64| first_not(numbers.len(), &|i, later: i64| numbers[i] + later < end);
        let [first, last] = [self.span.sections.start, self.span.sections.end].map(before);
        let stroboscopic = table(one.rows.stroboscopic.followed(), 4 * first..4 * last);
        rows.stroboscopic.repeat(stroboscopic);

        let legs = &instants.legs;
        let first = first_not(legs.len(), &|i, later: i64| then(&legs[i][1], later) < window);
        let begins: Vec<Clock> = legs.iter().map(|[begin, _]| *begin).collect();
        let cycle = std::mem::take(&mut one.rows.legs);
        let all = 4 * first..4 * legs.len() * cycles;
        let columns = table(cycle.rows(), all);
        rows.legs.repeat(cycle, RepeatedLegs { begins, first, later, columns });
    }
}

#[cfg(test)]
mod tests {
    use crate::model::parameters::System;
    use crate::model::state::State;
    use crate::numerics::cancel::CancelToken;
    use crate::simulate::run::{Proceeds, Run, RunOptions, run};
    use crate::tangent::sensitivity::{
        Sensitivity, SensitivityError, carried_out, run_with_sensitivity, sensitivity,
    };

    const PERIODS: i64 = 600;

    fn damped() -> crate::SystemBuilder {
        System::builder()
            .mass_ratio(0.6)
            .frequency_ratio(2.0)
            .restitution(0.8)
            .gap(0.5)
            .pendulum_damping(0.1)
            .oscillator_damping(0.1)
            .moment_amplitude(1.0)
            .force_amplitude(1.5)
    }

    /// Motions that repeat to the last bit: with impacts alone, with chatter that slides, and that slides
    /// and sticks.
    fn motions() -> [System; 3] {
        [
            damped().drive_frequency(0.75).build().unwrap(),
            damped().drive_frequency(0.25).build().unwrap(),
            damped()
                .restitution(0.3)
                .friction(0.3)
                .moment_amplitude(3.0)
                .drive_frequency(0.25)
                .build()
                .unwrap(),
        ]
    }

    fn of(run: &Run) -> Sensitivity {
        let start = State { x1: 0.0, v1: 0.5, x2: 0.0, v2: 0.0 };
        let names = ["gap", "v1", "drive_frequency", "friction"].map(String::from);
        sensitivity(run, start, &names, &CancelToken::never()).unwrap()
    }

    fn simulated(system: &System, options: RunOptions) -> Run {
        let start = State { x1: 0.0, v1: 0.5, x2: 0.0, v2: 0.0 };
        run(system, start, options, &CancelToken::never()).unwrap()
    }

    fn assert_same(found: &[f64], others: &[f64]) {
        assert_eq!(found.len(), others.len());
        for (found, other) in found.iter().zip(others) {
            // Before the last bounces, the derivatives have an error of some roundings over u.
            assert!((found - other).abs() <= 1e-9 * (1.0 + other.abs()), "{found} {other}");
        }
    }

    #[test]
    fn cycles_that_repeat_have_the_derivatives_of_those_that_are_followed() {
        for system in motions() {
            let options = RunOptions { section_phase: 1.3, ..RunOptions::periods(PERIODS) };
            let all = simulated(&system, options);
            let copied: usize = all.trace.copies.iter().map(|all| all.times).sum();
            assert!(copied > 10, "{copied} cycles");
            let mut followed = all.clone();
            followed.trace.copies.clear();
            let (found, other) = (of(&all), of(&followed));
            assert_same(&found.times, &other.times);
            assert_same(&found.before, &other.before);
            assert_same(&found.after, &other.after);
            assert_same(&found.stroboscopic, &other.stroboscopic);
            assert_same(&found.final_state, &other.final_state);
            assert_eq!(found.one_sided, other.one_sided);
            let end = all.final_state.time;
            let times: Vec<f64> = (0..=997).map(|i| end * f64::from(i) / 997.0).collect();
            let along =
                |of: &Sensitivity| of.trajectory(&times, &CancelToken::never()).unwrap().unwrap();
            assert_same(&along(&found), &along(&other));
        }
    }

    #[test]
    fn a_run_made_with_its_derivatives_is_the_run_and_has_those_of_it() {
        let start = State { x1: 0.0, v1: 0.5, x2: 0.0, v2: 0.0 };
        let names = ["gap", "v1", "drive_frequency", "friction"].map(String::from);
        let never = CancelToken::never();
        for system in motions() {
            for (kept, section_phase) in [(0, 0.0), (1, 1.3), (7, 0.0), (400, 1.3), (600, 0.0)] {
                let options = RunOptions { section_phase, ..RunOptions::periods(PERIODS) };
                let options = options.keep(kept);
                let (mut made, found) =
                    run_with_sensitivity(&system, start, options, &names, &never).unwrap();
                let alone = simulated(&system, options);
                // How much was worked out differs, nothing else.
                made.evaluations = alone.evaluations;
                assert!(made == alone, "{kept}");
                assert_eq!(made.kept_from().to_bits(), alone.kept_from().to_bits());
                let other = of(&alone);
                assert_same(&found.times, &other.times);
                assert_same(&found.before, &other.before);
                assert_same(&found.after, &other.after);
                assert_same(&found.stroboscopic, &other.stroboscopic);
                assert_same(&found.final_state, &other.final_state);
                assert_eq!(found.one_sided, other.one_sided);
                let (first, end) = (alone.kept_from(), alone.final_state.time);
                let times: Vec<f64> = (0..=97)
                    .map(|i| (first + (end - first) * f64::from(i) / 97.0).min(end))
                    .collect();
                let along = |of: &Sensitivity| {
                    of.trajectory(&times, &CancelToken::never()).unwrap().unwrap()
                };
                assert_same(&along(&found), &along(&other));
            }
        }
    }

    #[test]
    fn a_run_made_with_its_derivatives_in_parts_is_that_made_at_once() {
        let start = State { x1: 0.0, v1: 0.5, x2: 0.0, v2: 0.0 };
        let names = ["gap", "v1", "drive_frequency", "friction"].map(String::from);
        for system in motions() {
            let options = RunOptions::periods(PERIODS).keep(400);
            let never = CancelToken::never();
            let (run, found) =
                run_with_sensitivity(&system, start, options, &names, &never).unwrap();
            for asks in [2, 10, 50] {
                let mut parts = 1;
                let in_parts = |work: &mut (dyn Proceeds + Send)| {
                    while !work.proceed(&CancelToken::after(asks)) {
                        parts += 1;
                    }
                    Ok::<_, SensitivityError>(())
                };
                let (mut other, again) =
                    carried_out(&system, start, options, &names, in_parts).unwrap();
                let again = again.unwrap();
                assert!(parts > 1, "{parts}");
                other.evaluations = run.evaluations;
                assert!(other == run, "{asks}");
                assert_same(&again.times, &found.times);
                assert_same(&again.after, &found.after);
                assert_same(&again.stroboscopic, &found.stroboscopic);
                assert_same(&again.final_state, &found.final_state);
            }
        }
    }

    #[test]
    fn a_window_of_a_motion_that_repeats_has_the_rows_of_all_of_it() {
        for system in motions() {
            for kept in [1, 7, 100] {
                let options = RunOptions::periods(PERIODS);
                let (all, part) =
                    (simulated(&system, options), simulated(&system, options.keep(kept)));
                let (all_of_it, found) = (of(&all), of(&part));
                let last = |table: &[f64], numbers: usize| table[table.len() - numbers..].to_vec();
                assert_eq!(found.times.len(), 4 * part.impacts.len());
                assert_same(&found.times, &last(&all_of_it.times, found.times.len()));
                assert_same(&found.before, &last(&all_of_it.before, found.before.len()));
                assert_same(&found.after, &last(&all_of_it.after, found.after.len()));
                let sections = last(&all_of_it.stroboscopic, found.stroboscopic.len());
                assert_same(&found.stroboscopic, &sections);
                assert_same(&found.final_state, &all_of_it.final_state);
                let (first, end) = (part.kept_from(), part.final_state.time);
                let times: Vec<f64> =
                    (0..=97).map(|i| first + (end - first) * f64::from(i) / 97.0).collect();
                let along = |of: &Sensitivity| {
                    of.trajectory(&times, &CancelToken::never()).unwrap().unwrap()
                };
                assert_same(&along(&found), &along(&all_of_it));
            }
        }
    }

    #[test]
    fn cycles_before_a_window_are_not_followed_one_by_one() {
        let start = State { x1: 0.0, v1: 0.5, x2: 0.0, v2: 0.0 };
        let names = ["gap", "v1", "friction"].map(String::from);
        let never = CancelToken::never();
        for system in motions() {
            // More than any memory has room for.
            let [few, many] = [PERIODS, 1_000_000_000_000].map(|periods| {
                let options =
                    RunOptions { max_events: i64::MAX as u64, ..RunOptions::periods(periods) };
                let options = options.keep(5);
                run_with_sensitivity(&system, start, options, &names, &never).unwrap().1
            });
            assert_same(&many.stroboscopic, &few.stroboscopic);
            assert_same(&many.final_state, &few.final_state);
        }
    }
}
