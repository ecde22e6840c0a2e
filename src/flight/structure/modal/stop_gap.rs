//! The gap of one stop along a flight of a structure, as the contact search asks for it.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use super::shared::Shared;
use super::{ModalFlight, ModalMotion, StopMotion, Table};
use crate::flight::drive::{Trig, Turn};
use crate::flight::oscillator::Motion;
use crate::flight::table::Loads;
use crate::numerics::lanes::{LANES, Lanes};
use crate::search::gap::{Gap, GapBounds, GapPoint, Higher};
use crate::search::steps::{Jet, Jets, ScanStart, SteppedGap, Weights};
use crate::search::tolerances::{BOUND_MARGIN, SCAN_SPANS};

/// The gap of one stop along a flight.
pub(super) struct StopGap<'a> {
    pub motion: &'a ModalMotion,
    pub flight: &'a ModalFlight,
    pub index: usize,
    pub stop: &'a StopMotion,
    /// Where there are many stops.
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

    /// Derivatives 0 to 5 of the stop's motion A cos at a phase, its value as the increment from
    /// the start.
    #[inline(always)]
    fn stop_motion(&self, (c1, sin): (f64, f64)) -> [f64; 6] {
        let StopMotion { amplitude, drive, .. } = self.stop;
        if *amplitude == 0.0 {
            return [0.0; 6];
        }
        let start = self.flight.stops[self.index];
        let Trig { cos, sin: sin_psi } = Turn::new(start, c1, sin).phase;
        let (w, a) = (drive.omega, *amplitude);
        let increment = a * (start.cos * c1 - start.sin * sin);
        let (even, odd) = (a * w * w * cos, a * w * sin_psi);
        [increment, -odd, -even, odd * w * w, even * w * w, -odd * w.powi(4)]
    }

    #[inline(always)]
    fn turned(&self, s: f64) -> (f64, f64) {
        let turn = self.motion.drive.turned(Trig::ONE, s);
        (turn.cos_minus_1, turn.sin)
    }
}

impl Gap for StopGap<'_> {
    /// The jet, and the next two derivatives.
    type Instant = (GapPoint, Higher);
    type State = ();

    #[inline(always)]
    fn start(&self) -> (f64, f64) {
        let StopMotion { gap, amplitude, .. } = self.stop;
        let own = gap + amplitude * self.flight.stops[self.index].cos;
        let (mut value, mut size) = (-own, gap.abs() + amplitude.abs());
        for (i, part) in self.parts() {
            let term = part * self.flight.modes[i].x;
            (value, size) = (value + term, size + term.abs());
        }
        (value, size)
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

    #[inline(always)]
    fn change(&self, s: f64) -> (GapPoint, Self::Instant) {
        let turned = self.turned(s);
        let mut sums = self.stop_motion(turned).map(|own| -own);
        let at = |i: usize| {
            let motion = self.motion.mode_at(self.flight, i, s, turned);
            (motion, self.motion.modes[i].oscillator.equation.higher(&motion))
        };
        let start = self.shared.filter(|_| s == 0.0);
        let start = start.map(|shared| shared.start(|| (0..self.modes()).map(at).collect()));
        for (i, part) in self.parts() {
            let (motion, [fourth, fifth, _]) = start.map_or_else(|| at(i), |known| known[i]);
            let Motion { increment, rate, acceleration, jerk, .. } = motion;
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

    fn higher(&self, (_, higher): &Self::Instant) -> Higher {
        *higher
    }

    fn state(&self, _: &Self::Instant, _: f64) {}
}

impl SteppedGap for StopGap<'_> {
    /// Local time where a scan stands.
    type Place = f64;
    /// Local time of the last place, and the step.
    type Places = (f64, f64);

    #[inline(always)]
    fn scan_start(&self) -> ScanStart {
        let (point, _) = self.change(0.0);
        let (value, _) = self.start();
        let mut bounds = [0.0; 6];
        let of =
            |i: usize| self.motion.modes[i].oscillator.derivative_bounds(&self.flight.modes[i]);
        let known = self.shared.map(|shared| shared.bounds(|| (0..self.modes()).map(of).collect()));
        for (i, part) in self.parts() {
            let own = known.map_or_else(|| of(i), |known| known[i]);
            for (bound, term) in bounds.iter_mut().zip(own) {
                *bound += part.abs() * term;
            }
        }
        let bound = |order: u8| bounds[usize::from(order) - 1] + self.stop_bound(order.into());
        ScanStart {
            start: Jet { value, rate: point.rate, second: point.second },
            bounds: GapBounds {
                slope_noise: 0.0,
                rate: bound(1),
                fourth: bound(4) * BOUND_MARGIN,
                fifth: bound(5),
                sixth: bound(6),
            },
        }
    }

    fn bounds_hold(&self) -> f64 {
        if self.motion.steady { SCAN_SPANS * self.motion.span } else { self.motion.span }
    }

    fn reach(&self) -> f64 {
        self.motion.reach
    }

    #[inline(always)]
    fn extent(&self) -> f64 {
        self.start().1
    }

    fn steps_hold(&self, _: f64) -> bool {
        true
    }

    /// By the amplitudes of all modes about their equilibria, and of the stop.
    #[inline(always)]
    fn never_meets(&self, slack: f64) -> bool {
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

    fn higher_at_start(&self) -> (f64, f64) {
        let (point, (_, higher)) = self.change(0.0);
        (point.third, higher.fourth)
    }

    fn remainder_factor(&self) -> f64 {
        self.motion.remainder_factor
    }

    fn place(&self) -> f64 {
        0.0
    }

    fn step(&self, level: usize) -> f64 {
        self.motion.step(level)
    }

    fn weights(&self, level: usize) -> &Weights {
        &self.motion.table(level).weights
    }

    #[inline(always)]
    fn eight_steps(&self, level: usize, from: &f64) -> ((f64, f64), Jets) {
        let table = self.motion.table(level);
        let turned = self.turned(*from);
        let mut jets = Jets::default();
        for j in 0..LANES {
            // The stop's own motion goes on from the start of the flight.
            let Turn { cos_minus_1, sin, .. } = table.turns[j];
            let c1 = turned.0 + cos_minus_1 + (turned.0 * cos_minus_1 - turned.1 * sin);
            let s1 = turned.1 + sin + (turned.1 * cos_minus_1 + turned.0 * sin);
            let own = self.stop_motion((c1, s1));
            jets.value[j] = self.own_place() - own[0];
            (jets.rate[j], jets.second[j]) = (-own[1], -own[2]);
        }
        let stride = |i: usize| self.mode_steps(table, i, *from, turned);
        let add = |jets: &mut Jets, part: f64, [xs, vs, accelerations]: &[Lanes; 3]| {
            for j in 0..LANES {
                jets.value[j] += part * xs[j];
                jets.rate[j] += part * vs[j];
                jets.second[j] += part * accelerations[j];
            }
        };
        if let Some(shared) = self.shared {
            let known = shared.stride(level, *from, || (0..self.modes()).map(stride).collect());
            for (i, part) in self.parts() {
                add(&mut jets, part, &known.modes[i]);
            }
        } else {
            for (i, part) in self.parts() {
                add(&mut jets, part, &stride(i));
            }
        }
        ((*from, self.motion.step(level)), jets)
    }

    fn place_after((from, step): &(f64, f64), j: usize) -> f64 {
        from + step * (j + 1) as f64
    }
}

impl StopGap<'_> {
    fn modes(&self) -> usize {
        self.motion.modes.len()
    }

    /// Displacements, rates and accelerations of a mode at eight steps from a local time on.
    #[inline(always)]
    fn mode_steps(&self, table: &Table, i: usize, from: f64, turned: (f64, f64)) -> [Lanes; 3] {
        let mode = &self.motion.modes[i].oscillator;
        let body = &self.flight.modes[i];
        let (x, v, phase) = if from == 0.0 {
            (body.x, body.v, self.flight.phases[i])
        } else {
            let motion = self.motion.mode_at(self.flight, i, from, turned);
            let phase = Turn::new(self.flight.phases[i], turned.0, turned.1).phase;
            (motion.displacement(), motion.rate, phase)
        };
        let (xs, vs) = table.responses[i].motion(x, v, phase, Loads::of(mode));
        let accelerations = std::array::from_fn(|j| {
            let Trig { cos, sin } = table.turns[j].phase;
            let cos_psi = phase.cos * cos - phase.sin * sin;
            mode.equation.acceleration(xs[j], vs[j], cos_psi)
        });
        [xs, vs, accelerations]
    }

    /// What the stop and its gap take from the gap at the start of the flight.
    #[inline(always)]
    fn own_place(&self) -> f64 {
        let StopMotion { gap, amplitude, .. } = self.stop;
        -gap - amplitude * self.flight.stops[self.index].cos
    }
}
