//! Many states of a structure without loads and drive, along the same flight: what each mode makes of
//! a unit of its coordinate, and of its velocity, is worked out once.

#![allow(clippy::inline_always)] // a flight is compiled for several instruction sets

use smallvec::SmallVec;

use super::fours::FOUR;
use super::{FEW, ModalFlight, ModalMotion};
use crate::flight::drive::Trig;
use crate::model::structure::Structure;
use crate::numerics::double_double::DoubleDouble;

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
