//! What the gaps of several stops along one flight have in common: the motions of the modes.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use std::cell::{Ref, RefCell};

use smallvec::SmallVec;

use super::{FEW, ModalFlight, ModalMotion};
use crate::flight::drive::{Trig, Turn};
use crate::flight::table::Loads;
use crate::numerics::lanes::Lanes;

/// The motions of all modes along a flight at the steps that have been asked for.
#[derive(Default)]
pub(super) struct Shared(RefCell<Strides>);

#[derive(Default)]
struct Strides {
    all: SmallVec<[Stride; 1]>,
}

/// Displacements, rates and accelerations of each mode at eight steps of a level.
pub(super) struct Stride {
    level: usize,
    from: f64,
    pub modes: SmallVec<[[Lanes; 3]; FEW]>,
}

impl Shared {
    /// Eight steps of a level from a local time on.
    #[inline(always)]
    pub fn stride(
        &self,
        motion: &ModalMotion,
        flight: &ModalFlight,
        level: usize,
        from: f64,
    ) -> Ref<'_, Stride> {
        let is_it = |stride: &Stride| stride.level == level && stride.from == from;
        let strides = self.0.borrow();
        let place = strides.all.iter().position(is_it);
        drop(strides);
        let place = if let Some(place) = place {
            place
        } else {
            let mut strides = self.0.borrow_mut();
            let place = strides.all.len();
            // Filled where it stays: it is large.
            let modes = SmallVec::with_capacity(motion.modes.len());
            strides.all.push(Stride { level, from, modes });
            motion.fill(flight, &mut strides.all[place]);
            place
        };
        Ref::map(self.0.borrow(), |strides| &strides.all[place])
    }
}

impl ModalMotion {
    #[inline(always)]
    fn fill(&self, flight: &ModalFlight, stride: &mut Stride) {
        let (table, from) = (self.table(stride.level), stride.from);
        let there = if from > 0.0 { Some(self.modes_at(flight, from)) } else { None };
        for i in 0..self.modes.len() {
            let oscillator = &self.modes[i].oscillator;
            let (x, v, phase) = match &there {
                None => (flight.modes[i].x, flight.modes[i].v, flight.phases[i]),
                Some((motions, (c1, sin))) => {
                    let phase = Turn::new(flight.phases[i], *c1, *sin).phase;
                    (motions[i].displacement(), motions[i].rate, phase)
                }
            };
            let loads = Loads::of(oscillator);
            let (xs, vs) = table.responses[i].motion(x, v, phase, loads);
            let mut accelerations = Lanes::default();
            for (j, acceleration) in accelerations.iter_mut().enumerate() {
                let Trig { cos, sin } = table.turns[j].phase;
                let cos_psi = phase.cos * cos - phase.sin * sin;
                *acceleration = oscillator.equation.acceleration(xs[j], vs[j], cos_psi);
            }
            stride.modes.push([xs, vs, accelerations]);
        }
    }
}
