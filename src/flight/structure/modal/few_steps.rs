//! The gap of a stop at eight equal steps of a flight of few modes: what each displacement, rate
//! and phase makes of it is a table, so that nothing is computed of the modes themselves.

#![allow(clippy::inline_always)] // all of a scan must be compiled with the same instructions
#![allow(clippy::needless_range_loop)] // loops over lanes read best with their index

use super::{FEW, ModalFlight, ModalMotion, StopMotion};
use crate::flight::drive::{Trig, Turn};
use crate::flight::oscillator::{Equation, Oscillator};
use crate::flight::table::Response;
use crate::numerics::lanes::{LANES, Lanes};
use crate::search::steps::Jets;

/// Displacement, rate, cos and sin of the drive's phase of a mode: what its motion follows from.
type ModeState = [f64; 4];

/// The motion of one mode at eight steps.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(super) struct ModeSteps {
    /// Displacement, rate and acceleration per number of its state.
    of_state: [[Lanes; 3]; 4],
    /// The same of a loaded mode from rest.
    from_rest: Option<Box<[Lanes; 3]>>,
    /// cos and sin of what the drive turns.
    turns: [Lanes; 2],
}

/// Where a scan stands.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spot {
    pub time: f64,
    /// So many steps of a level after another place: its time, and the states of few modes there,
    /// unless it is the start of the flight.
    before: f64,
    states: [ModeState; FEW],
    level: usize,
    steps: usize,
}

impl ModeSteps {
    pub fn new(mode: &Oscillator, response: &Response, turns: &[Turn; LANES]) -> Self {
        let unloaded = Equation { load: 0.0, ..mode.equation };
        let none = [0.0; LANES];
        let (cos, sin) = (turns.map(|turn| turn.phase.cos), turns.map(|turn| turn.phase.sin));
        let with_acceleration = |equation: &Equation, (xs, vs): (&Lanes, &Lanes), cos: &Lanes| {
            let acceleration = |j: usize| equation.acceleration(xs[j], vs[j], cos[j]);
            [*xs, *vs, std::array::from_fn(acceleration)]
        };
        let [of_x, of_v, of_cos, of_sin, from_rest] = response.parts();
        let minus_sin = sin.map(|sin| -sin);
        Self {
            of_state: [
                with_acceleration(&unloaded, of_x, &none),
                with_acceleration(&unloaded, of_v, &none),
                with_acceleration(&unloaded, of_cos, &cos),
                with_acceleration(&unloaded, of_sin, &minus_sin),
            ],
            from_rest: mode
                .has_constant()
                .then(|| Box::new(with_acceleration(&mode.equation, from_rest, &none))),
            turns: [cos, sin],
        }
    }

    /// Adds the part of this mode, n . phi, to the jets of a gap.
    #[inline(always)]
    fn add(&self, state: &ModeState, part: f64, jets: &mut Jets) {
        let Jets { mut value, mut rate, mut second } = *jets;
        for ([xs, vs, accelerations], number) in self.of_state.iter().zip(state) {
            let by = part * number;
            for j in 0..LANES {
                value[j] = xs[j].mul_add(by, value[j]);
                rate[j] = vs[j].mul_add(by, rate[j]);
                second[j] = accelerations[j].mul_add(by, second[j]);
            }
        }
        if let Some(loaded) = &self.from_rest {
            let [xs, vs, accelerations] = &**loaded;
            for j in 0..LANES {
                value[j] = xs[j].mul_add(part, value[j]);
                rate[j] = vs[j].mul_add(part, rate[j]);
                second[j] = accelerations[j].mul_add(part, second[j]);
            }
        }
        *jets = Jets { value, rate, second };
    }

    /// The state at the end of step `j`.
    #[inline(always)]
    fn state(&self, &[x, v, cos, sin]: &ModeState, j: usize) -> ModeState {
        let [of_x, of_v, of_cos, of_sin] = &self.of_state;
        let sum = |which: usize| {
            let free = of_x[which][j].mul_add(x, of_v[which][j] * v);
            let forced = of_cos[which][j].mul_add(cos, of_sin[which][j] * sin);
            let loaded = self.from_rest.as_ref().map_or(0.0, |loaded| loaded[which][j]);
            free + (forced + loaded)
        };
        let (turned_cos, turned_sin) = (self.turns[0][j], self.turns[1][j]);
        [sum(0), sum(1), cos * turned_cos - sin * turned_sin, sin * turned_cos + cos * turned_sin]
    }
}

impl ModalFlight {
    /// The state of a mode at the start.
    #[inline(always)]
    fn mode_state(&self, mode: usize) -> ModeState {
        let (body, Trig { cos, sin }) = (&self.modes[mode], self.phases[mode]);
        [body.x, body.v, cos, sin]
    }
}

impl ModalMotion {
    /// Adds the motions of few modes at eight steps of a level to the jets of a stop's gap; returns
    /// the place from which they start as the one that later places come after.
    #[inline(always)]
    pub(super) fn add_few_modes(
        &self,
        flight: &ModalFlight,
        (level, from): (usize, &Spot),
        stop: &StopMotion,
        jets: &mut Jets,
    ) -> Spot {
        let few = &self.table(level).few;
        let mut spot = Spot { before: from.time, level, ..*from };
        if from.time == 0.0 {
            for (i, mode) in few.iter().enumerate() {
                mode.add(&flight.mode_state(i), stop.row[i], jets);
            }
            return spot;
        }
        let reached = &self.table(from.level).few;
        for (i, mode) in few.iter().enumerate() {
            let before = if from.before == 0.0 { flight.mode_state(i) } else { from.states[i] };
            spot.states[i] = reached[i].state(&before, from.steps - 1);
            mode.add(&spot.states[i], stop.row[i], jets);
        }
        spot
    }
}

impl Spot {
    /// So many steps, each of this length, after the place that this is.
    #[inline(always)]
    pub fn after(&self, step: f64, steps: usize) -> Self {
        Self { time: self.time + step * steps as f64, steps, ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::structure::modal::shared::Shared;
    use crate::flight::structure::modal::stop_gap::StopGap;
    use crate::flight::structure::stop_motions;
    use crate::model::state::Clock;
    use crate::model::structure::{Stop, Structure};
    use crate::search::gap::Gap;
    use crate::search::steps::SteppedGap;

    #[test]
    fn steps_after_steps_are_those_of_the_exact_motion() {
        let (mass, stiffness) = ([[1.0, 0.2], [0.2, 2.0]], [[2.0, -1.0], [-1.0, 1.5]]);
        let structure =
            Structure::builder(mass.map(Vec::from).into(), stiffness.map(Vec::from).into())
                .stop(Stop::new([1.0, -0.4], 0.7, 0.8).moving(0.1, 0.3))
                .damping_ratios(vec![0.02, 0.3])
                .static_load(vec![0.3, -0.1])
                .drive(vec![0.3.into(), 1.0.into()], 0.9, 0.4)
                .build()
                .unwrap();
        let motion = ModalMotion::new(&structure, stop_motions(&structure));
        let flight = motion.flight(Clock::START, &[0.1, -0.2], &[0.5, 0.3]);
        let begin = motion.begins(&flight, &motion.mode_begins(&flight), 0).get(0);
        let common = Shared::default();
        for shared in [None, Some(&common)] {
            let (flight, stop, until) = (&flight, &motion.stops[0], f64::INFINITY);
            let gap = StopGap { motion: &motion, flight, index: 0, stop, begin, until, shared };
            let (mut place, mut worst) = (gap.place(), 0f64);
            for (level, step) in [(0, 7), (3, 2), (1, 4), (6, 0), (0, 3)] {
                let (places, jets) = gap.eight_steps(level, &place);
                for j in 0..LANES {
                    let exact = gap.change(StopGap::place_after(&places, j).time).0;
                    let jet = jets.get(j);
                    worst = worst.max((jet.value - (begin.value + exact.value)).abs());
                    worst = worst.max((jet.rate - exact.rate).abs());
                    worst = worst.max((jet.second - exact.second).abs());
                }
                place = StopGap::place_after(&places, step);
            }
            assert!(worst < 1e-14, "{worst}");
        }
    }
}
