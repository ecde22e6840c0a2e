//! Many states of a structure without loads and drive, along the same flight: what each mode makes of
//! a unit of its coordinate, and of its velocity, is worked out once.

#![allow(clippy::inline_always)] // a flight is compiled for several instruction sets

use smallvec::SmallVec;

use super::fours::{FOUR, Turned};
use super::{FEW, ModalFlight, ModalMotion};
use crate::flight::drive::{Trig, Turn};
use crate::model::structure::Structure;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::lanes;

/// States (q, v), one after another, that are carried from t = 0 on.
pub(super) struct Carried<'a> {
    pub motion: &'a ModalMotion,
    pub structure: &'a Structure,
    pub elapsed: DoubleDouble,
    pub states: &'a mut [f64],
}

impl ModalMotion {
    /// Displacement and rate of all modes that start from this one.
    #[inline(always)]
    fn unit_motions(&self, x: f64, v: f64, elapsed: DoubleDouble) -> SmallVec<[(f64, f64); FEW]> {
        let mut flight = ModalFlight {
            since: 0.0,
            modes: SmallVec::with_capacity(self.modes.len()),
            phases: SmallVec::from_elem(Trig::ONE, self.modes.len()),
            stops: SmallVec::new(),
        };
        for mode in &self.modes {
            flight.modes.push(mode.oscillator.flight(x, v, Trig::ONE));
        }
        if elapsed.hi <= self.reach {
            self.near(&flight, elapsed)
        } else {
            self.far(&flight, elapsed)
        }
    }
}

/// Displacement and rate that a mode without loads and drive comes to, from a displacement of 1, and from
/// a rate of 1.
pub(crate) type Transitions = SmallVec<[[(f64, f64); 2]; FEW]>;

impl ModalMotion {
    /// Transitions of all modes, of a structure without loads and drive.
    pub fn transitions(&self, elapsed: DoubleDouble) -> Transitions {
        lanes::narrow(Passed { motion: self, elapsed })
    }
}

/// Transitions, compiled for each set of vector instructions.
struct Passed<'a> {
    motion: &'a ModalMotion,
    elapsed: DoubleDouble,
}

impl pulp::NullaryFnOnce for Passed<'_> {
    type Output = Transitions;

    #[inline(always)]
    fn call(self) -> Transitions {
        let Self { motion, elapsed } = self;
        let (s, is_near) = (elapsed.hi, elapsed.hi <= motion.reach);
        let mut all = Transitions::with_capacity(motion.modes.len());
        for (four, modes) in motion.fours.iter().zip(motion.modes.chunks(FOUR)) {
            let turned = if is_near { four.turned(s) } else { Turned::default() };
            for (j, mode) in modes.iter().enumerate() {
                let (oscillator, equation) = (&mode.oscillator, &mode.oscillator.equation);
                if !is_near || equation.decayed(s) {
                    all.push([(1.0, 0.0), (0.0, 1.0)].map(|(x, v)| {
                        let body = oscillator.flight(x, v, Trig::ONE);
                        oscillator.after(&body, x, elapsed, &Turn::STILL)
                    }));
                    continue;
                }
                let basis = if oscillator.swings_or_beats() {
                    equation.swinging_basis(turned.change[j], turned.turned[j])
                } else {
                    oscillator.basis(s)
                };
                let [of_place, of_rate] = equation.transition_by(basis);
                all.push([0, 1].map(|from| {
                    let (x, v) = (of_place[from], of_rate[from]);
                    let a = -(equation.natural_squared * x + 2.0 * equation.decay_rate * v);
                    (x + elapsed.lo * v, v + elapsed.lo * a)
                }));
            }
        }
        all
    }
}

impl pulp::NullaryFnOnce for Carried<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { motion, structure, elapsed, states } = self;
        let count = structure.coordinates();
        let of_place = motion.unit_motions(1.0, 0.0, elapsed);
        let of_rate = motion.unit_motions(0.0, 1.0, elapsed);
        let (mut places, mut rates) = (vec![0.0; count], vec![0.0; count]);
        for state in states.chunks_exact_mut(2 * count) {
            let (q, v) = state.split_at_mut(count);
            for (k, four) in motion.fours.iter().enumerate() {
                let (x, u) = (four.sums(q), four.sums(v));
                for (j, i) in (FOUR * k..count.min(FOUR * k + FOUR)).enumerate() {
                    places[i] = of_place[i].0 * x[j] + of_rate[i].0 * u[j];
                    rates[i] = of_place[i].1 * x[j] + of_rate[i].1 * u[j];
                }
            }
            q.fill(0.0);
            v.fill(0.0);
            for ((&place, &rate), mode) in places.iter().zip(&rates).zip(structure.modes()) {
                for ((q, v), &shape) in q.iter_mut().zip(v.iter_mut()).zip(&mode.shape) {
                    *q += shape * place;
                    *v += shape * rate;
                }
            }
        }
    }
}
