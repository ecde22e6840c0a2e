//! Motions that repeat to the last bit.
//!
//! The motion after an impact depends on few numbers, and floats have finitely many values. So a
//! motion that settles has, after some time, an impact with exactly the numbers of an earlier one.
//! From there on it repeats. (Not if its impacts lie within some 1e-16 of the start of a drive
//! period, where the clock resolves much more.) Such a motion is not computed again: the clock
//! moves on by whole cycles, and the records of a cycle are copied (run/kept.rs). The results have
//! the same bits.

use super::{Horizon, Leg, Model, Simulation};
use crate::contact::chatter::ChatterKey;
use crate::model::state::Clock;

/// A reference is compared with at least so many impacts, and with at least one in so many of all
/// impacts so far. Cycles up to that length are found soon after the motion has settled.
const FEWEST: u64 = 8;
const PART: u64 = 8;

/// Looks for an impact with the numbers of an earlier one, the reference.
#[derive(Debug, Clone, Copy)]
pub(super) struct Recurrence<B> {
    /// Drive period up to which nothing is kept.
    until: i64,
    reference: Reference<B>,
    /// Impacts since the reference, and the number of them at which it is changed.
    age: u64,
    limit: u64,
    /// What lies between the reference and the present impact, if they are alike and it is kept.
    /// Who keeps impacts asks for it at each of them.
    found: Option<Cycle>,
}

/// All that the motion after an impact depends on, except the number of drive periods. (Whether a
/// plastic impact is followed by contact follows from the state and the chatter_key.)
#[derive(Debug, Clone, Copy, PartialEq)]
struct Numbers<B> {
    state: B,
    time_in_period: u64,
    residual: u64,
    chatter_key: ChatterKey,
    moves: u32,
}

/// The numbers of an impact, and how far the simulation was.
#[derive(Debug, Clone, Copy)]
struct Reference<B> {
    numbers: Option<Numbers<B>>,
    time_in_period: u64,
    period: i64,
    impacts: u64,
    events: u64,
    next_section: i64,
}

/// The motion from an impact to the next one with the same numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cycle {
    /// Drive periods, and so sections.
    pub periods: i64,
    impacts: u64,
    /// Events, the impacts among them.
    pub events: u64,
}

impl Cycle {
    /// Whether all of its events are impacts.
    pub fn is_all_impacts(&self) -> bool {
        self.impacts == self.events
    }
}

impl<B> Recurrence<B> {
    /// Whether the present impact, at this clock, may be the reference, or is to be the next one.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub fn may_repeat(&mut self, clock: Clock) -> bool {
        self.age += 1;
        self.reference.time_in_period == clock.time_in_period.to_bits() || self.age >= self.limit
    }

    /// The next impact is the reference.
    fn restart(&mut self) {
        self.reference.numbers = None;
        self.age = self.limit;
    }
}

impl<M: Model> Simulation<M> {
    /// Nothing is kept before this drive period: a motion that repeats is moved on up to there, and
    /// from there on [`Self::repeats`] tells of it.
    pub(crate) fn skips_repeats_until(&mut self, period: i64) {
        let reference = Reference {
            numbers: None,
            time_in_period: 0,
            period: 0,
            impacts: 0,
            events: 0,
            next_section: 0,
        };
        let (age, limit, found) = (0, FEWEST, None);
        let recurrence = Recurrence { until: period, reference, age, limit, found };
        self.recurrence = self.drive().has_period().then_some(recurrence);
    }

    /// The numbers of the present impact.
    fn numbers(&self) -> Option<Numbers<M::Bits>> {
        let Clock { time_in_period, residual, .. } = self.point.anchor.clock;
        Some(Numbers {
            state: M::bits(&self.point.anchor),
            time_in_period: time_in_period.to_bits(),
            residual: residual.to_bits(),
            chatter_key: self.point.monitor.chatter_key()?,
            moves: self.point.moves,
        })
    }

    /// Finds out whether the present impact is the reference, or makes it the next one. Where
    /// nothing is kept the clock then moves on by whole cycles.
    #[inline(never)]
    pub(super) fn look_for_repeat(&mut self) {
        let Some(mut recurrence) = self.recurrence.take() else { return };
        let period = self.point.anchor.clock.period;
        let is_kept = period >= recurrence.until;
        if is_kept && recurrence.reference.period < recurrence.until {
            recurrence.restart();
        }
        let (numbers, reference) = (self.numbers(), &recurrence.reference);
        let cycle = Cycle {
            periods: period - reference.period,
            impacts: self.point.impacts - reference.impacts,
            events: self.point.events - reference.events,
        };
        let sections = self.point.next_section - reference.next_section;
        // A section at the very instant of an impact may come before it or after it.
        let is_whole = !is_kept || sections == cycle.periods;
        if numbers.is_some() && numbers == reference.numbers && cycle.periods > 0 && is_whole {
            if is_kept {
                recurrence.found = Some(cycle);
            } else {
                self.skip_cycles(&cycle, self.cycles_left(&cycle, recurrence.until));
                recurrence.restart();
            }
        } else if recurrence.age >= recurrence.limit {
            recurrence.reference = Reference {
                numbers,
                time_in_period: self.point.anchor.clock.time_in_period.to_bits(),
                period,
                impacts: self.point.impacts,
                events: self.point.events,
                next_section: self.point.next_section,
            };
            recurrence.age = 0;
            recurrence.limit = FEWEST + self.point.impacts / PART;
        }
        self.recurrence = Some(recurrence);
    }

    /// What the motion is going to repeat, if the present impact is like one before that is kept,
    /// too; and how often before it ends.
    #[inline(always)]
    #[allow(clippy::inline_always)] // asked after every impact that is kept
    pub(crate) fn repeats(&mut self) -> Option<(Cycle, i64)> {
        let cycle = self.recurrence.as_mut()?.found.take()?;
        let times = self.cycles_left(&cycle, self.end.period);
        (times > 0).then_some((cycle, times))
    }

    /// How many more of these cycles there are before the end, if the present one goes on.
    pub(crate) fn cycles_left_to_end(&self, cycle: &Cycle) -> i64 {
        self.cycles_left(cycle, self.end.period)
    }

    /// The present impact becomes the one so many cycles later, and those between are passed over.
    pub(crate) fn repeat(&mut self, cycle: &Cycle, times: i64) {
        self.skip_cycles(cycle, times);
        self.point.next_section += times * cycle.periods;
        if let Some(recurrence) = &mut self.recurrence {
            recurrence.restart();
        }
    }

    /// How many more cycles end before this drive period, and before the caps.
    fn cycles_left(&self, cycle: &Cycle, period: i64) -> i64 {
        let Self { point, .. } = self;
        let fit = |room: u64, each: u64| {
            i64::try_from(room.saturating_sub(1) / each.max(1)).unwrap_or(i64::MAX)
        };
        // Not the last period: by its residual a clock may lie beyond its end.
        let mut left = (period - 2 - point.anchor.clock.period).max(0) / cycle.periods;
        left = left.min(fit(self.max_events.saturating_sub(point.events), cycle.events));
        if let Horizon::Impacts { count, .. } = self.horizon {
            left = left.min(fit(count.saturating_sub(point.impacts), cycle.impacts));
        }
        left
    }

    fn skip_cycles(&mut self, cycle: &Cycle, times: i64) {
        let shift = times * cycle.periods;
        self.point.impacts += times.unsigned_abs() * cycle.impacts;
        self.point.events += times.unsigned_abs() * cycle.events;
        self.repeated += times.unsigned_abs() * cycle.events;
        self.point.anchor.clock.period += shift;
        self.flight.later_by(shift);
    }
}

#[cfg(test)]
mod tests {
    use crate::model::state::State;
    use crate::numerics::cancel::CancelToken;
    use crate::simulate::{Horizon, Observer, Simulation};
    use crate::{Event, System};

    /// Collects sections.
    #[derive(Default)]
    struct Counter {
        sections: Vec<[f64; 4]>,
    }

    impl Observer for Counter {
        const SECTIONS: bool = true;

        fn section(&mut self, _: i64, state: &State) {
            self.sections.push(state.to_array());
        }
    }

    fn run(system: &System, passes: bool) -> (u64, Vec<[f64; 4]>, u64, Vec<Event>) {
        let start = State::new(0.0, 0.5, 0.0, 0.0).unwrap();
        let cancel = CancelToken::after(1 << 32);
        let mut simulation = Simulation::new(system, start)
            .unwrap()
            .until(Horizon::Periods(600))
            .cancel_with(&cancel);
        simulation.sections_from(501);
        if passes {
            simulation.skips_repeats_until(500);
        }
        let mut counter = Counter::default();
        let mut last = Vec::new();
        while let Some(event) = simulation.advance(&mut counter) {
            let event = event.unwrap();
            if simulation.clock().period >= 500 {
                last.push(event);
            }
        }
        ((1 << 32) - cancel.asks_left(), counter.sections, simulation.impact_count(), last)
    }

    #[test]
    fn a_motion_that_repeats_is_moved_on_and_nothing_else_changes() {
        let damped = |omega: f64, friction: f64, restitution: f64| {
            System::builder()
                .mass_ratio(0.6)
                .frequency_ratio(2.0)
                .restitution(restitution)
                .gap(0.5)
                .drive_frequency(omega)
                .pendulum_damping(0.1)
                .oscillator_damping(0.1)
                .moment_amplitude(1.0)
                .force_amplitude(0.5)
                .friction(friction)
                .build()
                .unwrap()
        };
        let mut moved = 0;
        for i in 0..40 {
            let omega = 0.35 + 0.05 * f64::from(i);
            let (friction, restitution) =
                (0.3 * f64::from(i % 3), if i % 2 == 0 { 0.8 } else { 0.3 });
            let system = damped(omega, friction, restitution);
            let (plain, passed) = (run(&system, false), run(&system, true));
            assert_eq!(plain.1, passed.1, "sections at {omega}");
            assert_eq!(plain.2, passed.2, "impacts at {omega}");
            assert!(plain.3 == passed.3, "events at {omega}");
            assert!(passed.0 <= plain.0);
            moved += usize::from(2 * passed.0 < plain.0);
        }
        assert!(moved > 20, "{moved} of 40 took less than half the flights");
    }
}
