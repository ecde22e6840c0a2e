//! Stroboscopic sections of a leg, handed to the observer in order.

#![allow(clippy::inline_always)] // a flight is compiled for several instruction sets

use super::{Leg, Model, Observer, Simulation};
use crate::model::state::Clock;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::lanes::LANES;

impl<M: Model> Simulation<M> {
    /// Hands the sections up to local time `reached` to the observer; one that falls on an event
    /// is left for the leg after it.
    #[inline(always)]
    pub(super) fn pass_sections<O: Observer<M::State>>(
        &mut self,
        reached: DoubleDouble,
        inclusive: bool,
        observer: &mut O,
        state_at: impl Fn(&Self, DoubleDouble) -> M::State,
    ) {
        if !O::SECTIONS {
            return;
        }
        while let Some(at) = self.section_by(0, reached, inclusive) {
            if self.passes_over_section(observer) {
                continue;
            }
            let state = state_at(self, at);
            self.pass_section(&state, observer);
        }
    }

    /// Local time of the section after so many more, if it lies before `reached`; `inclusive`: or
    /// there, to rounding.
    #[inline(always)]
    pub(super) fn section_by(
        &self,
        more: i64,
        reached: DoubleDouble,
        inclusive: bool,
    ) -> Option<DoubleDouble> {
        if !self.drive().has_period() {
            return None;
        }
        let period = self.point.next_section + more - i64::from(self.section_offset > 0.0);
        let section = Clock::new(period, self.section_offset);
        if self.is_far(section, reached.hi) {
            return None;
        }
        let at = self.drive().until(self.flight.clock(), section);
        let (now, last) = (at.value(), reached.value());
        let passed = now < last || (inclusive && now == last);
        passed.then(|| at.not_negative())
    }

    #[inline(always)]
    pub(super) fn pass_section<O: Observer<M::State>>(
        &mut self,
        state: &M::State,
        observer: &mut O,
    ) {
        observer.section(self.point.next_section, state);
        self.point.next_section += 1;
    }

    /// Passes over the next section if it is not wanted.
    #[inline(always)]
    fn passes_over_section<O: Observer<M::State>>(&mut self, observer: &O) -> bool {
        let is_early = self.point.next_section < observer.first_section();
        self.point.next_section += i64::from(is_early);
        is_early
    }

    /// Hands over the sections within a flight: a single one by itself, which is the usual case,
    /// more of them together.
    #[inline(always)]
    pub(super) fn pass_sections_in_flight<O: Observer<M::State>>(
        &mut self,
        reached: DoubleDouble,
        inclusive: bool,
        observer: &mut O,
    ) {
        if !O::SECTIONS {
            return;
        }
        while let Some(first) = self.section_by(0, reached, inclusive) {
            if self.passes_over_section(observer) {
                continue;
            }
            match self.section_by(1, reached, inclusive) {
                None => {
                    let state = M::state_within(&self.motion, &self.flight, first);
                    return self.pass_section(&state, observer);
                }
                Some(second) => {
                    self.pass_several([first, second], reached, inclusive, observer);
                }
            }
        }
    }

    /// Passes these sections and those after them, as many as are evaluated at once.
    #[inline(never)]
    fn pass_several<O: Observer<M::State>>(
        &mut self,
        first: [DoubleDouble; 2],
        reached: DoubleDouble,
        inclusive: bool,
        observer: &mut O,
    ) {
        let (mut times, mut count) = ([DoubleDouble::ZERO; LANES], first.len());
        times[..count].copy_from_slice(&first);
        while count < LANES
            && let Some(at) = self.section_by(count as i64, reached, inclusive)
        {
            times[count] = at;
            count += 1;
        }
        let states = M::states_within(&self.motion, &self.flight, &times[..count]);
        for state in &states[..count] {
            self.pass_section(state, observer);
        }
    }
}
