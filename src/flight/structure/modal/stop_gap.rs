//! The gap of one stop along a flight of a structure, as the contact search asks for it.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use super::begins::Begin;
use super::few_steps::Spot;
use super::shared::Shared;
use super::{ModalFlight, ModalMotion, StopMotion};
use crate::flight::drive::{Trig, Turn};
use crate::flight::oscillator::Motion;
use crate::numerics::lanes::LANES;
use crate::search::gap::{Gap, GapBounds, GapPoint, Higher, Speeds};
use crate::search::steps::{Jet, Jets, ScanStart, SteppedGap, Weights};
use crate::search::tolerances::{BOUND_MARGIN, REST_TIME, SCAN_SPANS};

/// The gap of one stop along a flight.
pub(super) struct StopGap<'a> {
    pub motion: &'a ModalMotion,
    pub flight: &'a ModalFlight,
    pub index: usize,
    pub stop: &'a StopMotion,
    pub begin: Begin,
    /// Later contacts are of no interest; infinite where any is.
    pub until: f64,
    /// What the gaps of many modes have in common.
    pub shared: Option<&'a Shared>,
}

impl StopGap<'_> {
    /// The modes that move it, with their part n . phi.
    #[inline(always)]
    fn parts(&self) -> impl Iterator<Item = (usize, f64)> {
        self.stop.row.iter().copied().enumerate().filter(|&(_, part)| part != 0.0)
    }

    fn sum(&self, of: impl Fn(usize) -> f64) -> f64 {
        self.parts().map(|(i, part)| part.abs() * of(i)).sum()
    }

    /// |A| omega^n.
    fn stop_bound(&self, order: i32) -> f64 {
        self.stop.amplitude.abs() * self.stop.drive.omega.powi(order)
    }
}

impl Gap for StopGap<'_> {
    /// The jet, and the next two derivatives.
    type Instant = (GapPoint, Higher);
    type State = ();
    const GROWS: bool = true;

    #[inline(always)]
    fn start(&self) -> (f64, f64) {
        (self.begin.value, self.begin.size)
    }

    fn bounds(&self) -> GapBounds {
        let bound = |order: usize| {
            self.sum(|i| {
                let body = &self.flight.modes[i];
                self.motion.modes[i].oscillator.bounds(body, self.flight.phases[i]).0[order]
            })
        };
        GapBounds {
            slope_noise: 0.0,
            rate: bound(0) + self.stop_bound(1),
            fourth: (bound(3) + self.stop_bound(4)) * BOUND_MARGIN,
            fifth: f64::INFINITY,
            sixth: f64::INFINITY,
        }
    }

    fn speeds(&self, bounds: &GapBounds) -> Speeds {
        let since = REST_TIME * self.flight.since.min(self.motion.longest);
        if !self.motion.grows {
            return Speeds { first: bounds.rate, growth: 0.0, since };
        }
        let (mut first, mut growth) = (self.stop_bound(1), self.stop_bound(2));
        for (i, part) in self.parts() {
            let body = &self.flight.modes[i];
            first += part.abs() * body.v.abs();
            growth += part.abs() * self.motion.modes[i].oscillator.growth(body);
        }
        Speeds { first, growth, since }
    }

    #[inline(always)]
    fn change(&self, s: f64) -> (GapPoint, Self::Instant) {
        if s == 0.0 {
            let Begin { point, higher, .. } = self.begin;
            return (point, (point, higher));
        }
        let (motions, turned) = self.motion.modes_at(self.flight, s);
        let mut sums = [0.0; 6];
        if self.stop.amplitude != 0.0 {
            sums = self.stop.motion(self.flight.stops[self.index], turned).map(|own| -own);
        }
        for (i, motion) in motions.iter().enumerate() {
            let part = self.stop.row[i];
            let [fourth, fifth, _] = self.motion.modes[i].oscillator.equation.higher(motion);
            let Motion { increment, rate, acceleration, jerk, .. } = *motion;
            for (sum, term) in
                sums.iter_mut().zip([increment, rate, acceleration, jerk, fourth, fifth])
            {
                *sum += part * term;
            }
        }
        let [value, rate, second, third, fourth, fifth] = sums;
        let point = GapPoint { value, rate, second, third };
        (point, (point, Higher { fourth, fifth }))
    }

    #[inline(always)]
    fn higher(&self, (_, higher): &Self::Instant) -> Higher {
        *higher
    }

    #[inline(always)]
    fn state(&self, _: &Self::Instant, _: f64) {}
}

impl SteppedGap for StopGap<'_> {
    type Place = Spot;
    /// The last place, and the step.
    type Places = (Spot, f64);

    #[inline(always)]
    fn scan_start(&self) -> ScanStart {
        let Begin { value, point, bounds, .. } = self.begin;
        ScanStart { start: Jet { value, rate: point.rate, second: point.second }, bounds }
    }

    #[inline(always)]
    fn bounds_hold(&self) -> f64 {
        let spans = if self.motion.steady { SCAN_SPANS } else { 1.0 };
        (spans * self.motion.span).min(self.until)
    }

    #[inline(always)]
    fn reach(&self) -> f64 {
        self.motion.reach.min(self.until)
    }

    #[inline(always)]
    fn extent(&self) -> f64 {
        self.begin.size
    }

    #[inline(always)]
    fn steps_hold(&self, _: f64) -> bool {
        true
    }

    /// By the amplitudes of all modes about their equilibria, and of the stop.
    #[inline(always)]
    fn never_meets(&self, slack: f64) -> bool {
        if self.until.is_finite() {
            // Another stop is met: this would be more work than to look up to there.
            return false;
        }
        let (mut nearest, mut size) = (self.stop.amplitude.abs(), 0.0);
        for (i, part) in self.parts() {
            let oscillator = &self.motion.modes[i].oscillator;
            let (free, steady) = oscillator.amplitudes(&self.flight.modes[i]);
            let rest = part * oscillator.equation.equilibrium;
            nearest += part.abs() * (free + steady) + rest;
            size += rest.abs();
        }
        nearest * BOUND_MARGIN + (BOUND_MARGIN - 1.0) * size < self.stop.gap - slack
    }

    #[inline(always)]
    fn higher_at_start(&self) -> (f64, f64) {
        (self.begin.point.third, self.begin.higher.fourth)
    }

    #[inline(always)]
    fn remainder_factor(&self) -> f64 {
        self.motion.remainder_factor
    }

    #[inline(always)]
    fn place(&self) -> Spot {
        Spot::default()
    }

    #[inline(always)]
    fn step(&self, level: usize) -> f64 {
        self.motion.step(level)
    }

    #[inline(always)]
    fn weights(&self, level: usize) -> &Weights {
        &self.motion.table(level).weights
    }

    #[inline(always)]
    fn eight_steps(&self, level: usize, from: &Spot) -> ((Spot, f64), Jets) {
        let mut jets = Jets::default();
        let StopMotion { gap, amplitude, row, .. } = self.stop;
        if *amplitude == 0.0 {
            for value in &mut jets.value {
                *value = -gap;
            }
        } else {
            self.add_own_steps(level, from.time, &mut jets);
        }
        let step = self.motion.step(level);
        let Some(shared) = self.shared else {
            let spot = self.motion.add_few_modes(self.flight, (level, from), self.stop, &mut jets);
            return ((spot, step), jets);
        };
        let stride = shared.stride(self.motion, self.flight, level, from.time);
        // Sum by sum, each of which compilers keep in whole registers.
        let Jets { mut value, mut rate, mut second } = jets;
        for ([xs, vs, accelerations], &part) in stride.modes.iter().zip(row) {
            for j in 0..LANES {
                value[j] += part * xs[j];
            }
            for j in 0..LANES {
                rate[j] += part * vs[j];
            }
            for j in 0..LANES {
                second[j] += part * accelerations[j];
            }
        }
        let jets = Jets { value, rate, second };
        ((*from, step), jets)
    }

    #[inline(always)]
    fn place_after((from, step): &(Spot, f64), j: usize) -> Spot {
        from.after(*step, j + 1)
    }
}

impl StopGap<'_> {
    /// The steps of a stop that moves.
    fn add_own_steps(&self, level: usize, from: f64, jets: &mut Jets) {
        let start = self.flight.stops[self.index];
        let place = -self.stop.gap - self.stop.amplitude * start.cos;
        let so_far = self.motion.drive.turned(Trig::ONE, from);
        let (c1, s1) = (so_far.cos_minus_1, so_far.sin);
        for j in 0..LANES {
            // Its motion goes on from the start of the flight.
            let Turn { cos_minus_1, sin, .. } = self.motion.table(level).turns[j];
            let turned = (
                c1 + cos_minus_1 + (c1 * cos_minus_1 - s1 * sin),
                s1 + sin + (s1 * cos_minus_1 + c1 * sin),
            );
            let own = self.stop.motion(start, turned);
            jets.value[j] = place - own[0];
            (jets.rate[j], jets.second[j]) = (-own[1], -own[2]);
        }
    }
}
