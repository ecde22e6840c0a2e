//! Motions that repeat to the last bit: their derivatives are worked out in one cycle, as affine
//! functions of those at its start, which then give all cycles.

use std::ops::Range;

use pulp::NullaryFnOnce;

use super::columns::{Column, Columns, counted};
use super::error::SensitivityError;
use super::follow::{Follower, Step};
use super::legs::Again;
use super::marks::OneSided;
use super::source::{Alike, Passed, Source};
use crate::model::state::Clock;
use crate::numerics::lanes::narrow;

/// Columns that all others of the start of a cycle are sums of.
pub(super) const BASIS: usize = 4;

/// A table of a cycle whose rows are sums: of each column the own part, and of those at the start of
/// the cycle this much.
struct Sums {
    width: usize,
    /// By the four columns of the basis, a number for each row.
    basis: [Vec<f64>; BASIS],
    /// A number for each column in each row.
    own: Vec<f64>,
}

/// Adds some rows of sums to a table.
struct Add<'a> {
    sums: &'a Sums,
    start: &'a [Column],
    rows: Range<usize>,
    to: &'a mut Vec<f64>,
}

impl Sums {
    /// Of a table with the columns of the basis before the others.
    fn new(table: &[f64], width: usize) -> Self {
        let rows = || table.chunks_exact(BASIS + width);
        Self {
            width,
            basis: std::array::from_fn(|j| rows().map(|row| row[j]).collect()),
            own: rows().flat_map(|row| &row[BASIS..]).copied().collect(),
        }
    }

    fn rows(&self) -> usize {
        self.basis[0].len()
    }

    fn add(&self, start: &[Column], rows: Range<usize>, to: &mut Vec<f64>) {
        narrow(Add { sums: self, start, rows, to });
    }
}

impl NullaryFnOnce for Add<'_> {
    type Output = ();

    #[inline(always)]
    #[allow(clippy::inline_always)] // compiled for several instruction sets
    fn call(self) {
        let Self { sums: &Sums { width, ref basis, ref own }, start, rows, to } = self;
        let [a, b, c, d] = basis.each_ref().map(|part| &part[rows.clone()]);
        let own = &own[rows.start * width..rows.end * width];
        let parts = a.iter().zip(b).zip(c).zip(d);
        if let &[column] = start {
            // Along the rows.
            to.extend(parts.zip(own).map(|((((a, b), c), d), own)| {
                own + (a * column[0] + b * column[1] + (c * column[2] + d * column[3]))
            }));
            return;
        }
        to.reserve(own.len());
        for ((((a, b), c), d), own) in parts.zip(own.chunks_exact(width)) {
            to.extend(own.iter().zip(start).map(|(own, column)| {
                own + (a * column[0] + b * column[1] + (c * column[2] + d * column[3]))
            }));
        }
    }
}

/// What one cycle of a motion has shown of all of them.
struct Shown {
    tables: [Sums; 5],
    /// At the end, by those at the start.
    end: Vec<Column>,
}

impl Shown {
    /// The columns at the end of a cycle.
    fn after(&self, start: &[Column]) -> Columns {
        mapped(&self.end, start)
    }
}

/// Columns from those of the basis and the own parts, by the columns at the start.
fn mapped(shown: &[Column], start: &[Column]) -> Columns {
    let (basis, own) = shown.split_at(BASIS);
    let sum = |(own, column): (&Column, &Column)| {
        std::array::from_fn(|i| {
            let parts = basis.iter().zip(column).map(|(basis, part)| basis[i] * part);
            counted(own[i] + parts.sum::<f64>())
        })
    };
    own.iter().zip(start).map(sum).collect()
}

impl Follower<'_> {
    /// Follows the motion through one of its cycles and, without looking, through all that are alike.
    pub(super) fn follow_alike(
        &mut self,
        (source, passed): (&mut Source, &mut Passed),
        alike: &Alike,
    ) -> Result<Step, SensitivityError> {
        let of = self.of.with_basis();
        let mut one = self.with(&of, of.basis());
        let mut step = Step::Goes;
        for _ in 0..alike.events {
            step = one.step(source, passed)?;
            if !matches!(step, Step::Goes) {
                break;
            }
        }
        let k = self.of.by.len();
        let rows = &mut one.rows;
        let shown = Shown {
            tables: [
                &rows.times,
                &rows.before,
                &rows.after,
                &rows.stroboscopic,
                &*rows.legs.rows(),
            ]
            .map(|table| Sums::new(table, k)),
            end: one.leg.here.columns.to_vec(),
        };
        let mut start = std::mem::take(&mut self.leg.here.columns);
        let mut place = None;
        self.again(&one, (&shown, &start), 0, &mut place);
        if let Step::Ends(columns) = step {
            return Ok(Step::Ends(mapped(&columns, &start)));
        }
        let times = if matches!(step, Step::Goes) { source.pass(alike) } else { 0 };
        start = shown.after(&start);
        for time in 1..=times {
            self.again(&one, (&shown, &start), time * alike.periods, &mut place);
            start = shown.after(&start);
        }
        self.go_on_from(&one, (start, times * alike.periods));
        Ok(step)
    }

    /// Takes the events of a cycle, so many drive periods later, from these columns at its start.
    fn again(
        &mut self,
        one: &Follower,
        (shown, start): (&Shown, &[Column]),
        later: i64,
        place: &mut Option<usize>,
    ) {
        let drive = &self.of.model.motion.drive;
        let Some(instants) = &one.instants else { return };
        let then = |clock: &Clock| Clock { period: clock.period + later, ..*clock };
        let earlier = |clock: &Clock| then(clock) < self.window;
        let time = |clock: &Clock| drive.time(then(clock));
        let rows = &mut self.rows;
        for (clock, mark) in instants.marks.iter().zip(&one.rows.one_sided) {
            let mark = OneSided { index: rows.events + mark.index, time: time(clock), ..*mark };
            rows.one_sided.push(mark);
        }
        rows.events += instants.events.len() as i64;
        rows.earlier += instants.events.partition_point(earlier) as i64;

        let [times, before, after, stroboscopic, legs] = &shown.tables;
        let first = instants.impacts.partition_point(earlier);
        let kept = one.rows.impacts[first..].iter().zip(&instants.impacts[first..]);
        rows.impacts.extend(kept.map(|((period, _), clock)| (period + later, time(clock))));
        let place_of_times = rows.times.len();
        times.add(start, first..times.rows(), &mut rows.times);
        if let Some(i) = self.of.late() {
            let rate = later as f64 * self.of.period_rate();
            for row in rows.times[place_of_times..].chunks_exact_mut(start.len()) {
                row[i] += rate;
            }
        }
        before.add(start, 4 * first..before.rows(), &mut rows.before);
        after.add(start, 4 * first..after.rows(), &mut rows.after);

        let before = |end: i64| instants.sections.partition_point(|number| number + later < end);
        let [first, last] = [self.sections.start, self.sections.end].map(before);
        stroboscopic.add(start, 4 * first..4 * last, &mut rows.stroboscopic);
        let first = instants.legs.partition_point(|[_, end]| earlier(end));
        legs.add(start, 4 * first..legs.rows(), rows.legs.rows());
        let times: Vec<f64> = instants.legs.iter().map(|[begin, _]| time(begin)).collect();
        rows.legs.again(Again { cycle: &one.rows.legs, times: &times, first, later, place });
    }
}

#[cfg(test)]
mod tests {
    use crate::model::parameters::System;
    use crate::model::state::State;
    use crate::numerics::cancel::CancelToken;
    use crate::simulate::run::{Run, RunOptions, run};
    use crate::tangent::sensitivity::{Sensitivity, sensitivity};

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
            let along = |of: &Sensitivity| of.trajectory(&times).unwrap().unwrap();
            assert_same(&along(&found), &along(&other));
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
                let along = |of: &Sensitivity| of.trajectory(&times).unwrap().unwrap();
                assert_same(&along(&found), &along(&all_of_it));
            }
        }
    }
}
