//! Modes in fours, as many as a register holds: their coordinates from those of the structure, how
//! far they have turned, and their motions.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets
#![allow(clippy::needless_range_loop)] // loops over lanes read best with their index

use smallvec::SmallVec;

use super::{FEW, ModalFlight, ModalMotion, ModeMotion};
use crate::flight::drive::Turn;
use crate::flight::oscillator::{FewEquations, Motion};
use crate::model::structure::Structure;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::{decay_minus_1, turns};

/// How many.
pub(super) const FOUR: usize = 4;

type Lanes4 = [f64; FOUR];

/// Four modes, or fewer and zeros.
#[derive(Debug, Clone, Default)]
pub(super) struct Four {
    /// Damped frequencies to 32 digits.
    damped: Lanes4,
    damped_rest: Lanes4,
    decay_rate: Lanes4,
    equations: FewEquations<FOUR>,
    /// Longest time for the Taylor series of the slowest, and of the fastest.
    short: [f64; 2],
    /// M phi by coordinate, to 32 digits.
    rows: Vec<[Lanes4; 2]>,
}

/// How far four modes have turned, and decayed.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Turned {
    /// (cos wd s - 1, sin wd s).
    pub turned: [(f64, f64); FOUR],
    /// e^{-c s} - 1.
    pub change: Lanes4,
}

impl Four {
    /// All modes, and after the last one the drive.
    pub fn all(structure: &Structure, modes: &[ModeMotion]) -> Vec<Self> {
        let count = modes.len();
        let none = Self { rows: vec![[[0.0; FOUR]; 2]; count], ..Self::default() };
        let mut fours = vec![none; count / FOUR + 1];
        for (four, modes) in fours.iter_mut().zip(modes.chunks(FOUR)) {
            for (j, mode) in modes.iter().enumerate() {
                let equation = &mode.oscillator.equation;
                (four.damped[j], four.damped_rest[j]) = (equation.damped.hi, equation.damped.lo);
                four.decay_rate[j] = equation.decay_rate;
                four.equations.set(j, equation);
            }
            let short = modes.iter().map(|mode| mode.oscillator.equation.short);
            four.short = [short.clone().fold(0.0, f64::max), short.fold(f64::INFINITY, f64::min)];
        }
        for (i, mode) in structure.modes().iter().enumerate() {
            for ([row, rest], number) in fours[i / FOUR].rows.iter_mut().zip(&mode.row) {
                (row[i % FOUR], rest[i % FOUR]) = (number.hi, number.lo);
            }
        }
        fours[count / FOUR].damped[count % FOUR] = structure.drive_frequency();
        fours
    }

    /// At a local time within the reach of a flight.
    #[inline(always)]
    pub fn turned(&self, s: f64) -> Turned {
        let (mut angles, mut tails, mut change) = ([0.0; FOUR], [0.0; FOUR], [0.0; FOUR]);
        for j in 0..FOUR {
            let angle = DoubleDouble::product(self.damped[j], s);
            (angles[j], tails[j]) = (angle.hi, angle.lo + self.damped_rest[j] * s);
            change[j] = decay_minus_1(-self.decay_rate[j] * s);
        }
        Turned { turned: turns(angles, tails), change }
    }

    /// (M phi) . x, in plain sums.
    #[inline(always)]
    pub fn sums(&self, x: &[f64]) -> Lanes4 {
        let mut sum = [0.0; FOUR];
        for ([row, _], &x) in self.rows.iter().zip(x) {
            for j in 0..FOUR {
                sum[j] += row[j] * x;
            }
        }
        sum
    }

    /// (M phi) . x, rounded as if once (Ogita, Rump & Oishi (2005), Accurate Sum and Dot Product).
    #[inline(always)]
    pub fn coordinates(&self, x: &[f64]) -> Lanes4 {
        let (mut sum, mut rest) = ([0.0; FOUR], [0.0; FOUR]);
        for ([row, lower], &x) in self.rows.iter().zip(x) {
            for j in 0..FOUR {
                let product = DoubleDouble::product(row[j], x);
                let added = DoubleDouble::sum(sum[j], product.hi);
                sum[j] = added.hi;
                rest[j] += added.lo + (product.lo + lower[j] * x);
            }
        }
        for j in 0..FOUR {
            sum[j] += rest[j];
        }
        sum
    }
}

impl ModalMotion {
    /// The motions of all modes at a local time within the reach of a flight; and (cos - 1, sin) of
    /// what the drive has turned.
    #[inline(always)]
    pub(super) fn modes_at(
        &self,
        flight: &ModalFlight,
        s: f64,
    ) -> (SmallVec<[Motion; FEW]>, (f64, f64)) {
        let count = self.modes.len();
        let mut motions = SmallVec::with_capacity(count);
        let last = &self.fours[count / FOUR];
        // The drive's turn is with that of the last modes.
        let with_drive = last.turned(s);
        let (cos_minus_1, sin) = with_drive.turned[count % FOUR];
        for (k, modes) in self.modes.chunks(FOUR).enumerate() {
            let (four, first) = (&self.fours[k], FOUR * k);
            let [slowest, fastest] = four.short;
            let mut series = ([0.0; FOUR], [0.0; FOUR]);
            if s <= slowest {
                let (mut x, mut v, mut cos, mut sin) =
                    ([0.0; FOUR], [0.0; FOUR], [0.0; FOUR], [0.0; FOUR]);
                for j in 0..modes.len() {
                    let (body, phase) = (&flight.modes[first + j], flight.phases[first + j]);
                    (x[j], v[j], cos[j], sin[j]) = (body.x, body.v, phase.cos, phase.sin);
                }
                series = four.equations.series(x, v, (cos, sin), s);
            }
            let turned = if k == count / FOUR {
                with_drive
            } else if s > fastest {
                four.turned(s)
            } else {
                Turned::default()
            };
            for (j, mode) in modes.iter().enumerate() {
                let (oscillator, body) = (&mode.oscillator, &flight.modes[first + j]);
                let turn = Turn::new(flight.phases[first + j], cos_minus_1, sin);
                let (increment, rate) = (series.0[j], series.1[j]);
                let motion = if s <= oscillator.equation.short {
                    if increment.is_finite() && rate.is_finite() {
                        let place = [body.x, increment];
                        oscillator.equation.motion_from(increment, rate, place, &turn)
                    } else {
                        oscillator.at(body, s, &turn)
                    }
                } else {
                    oscillator.turned_by(body, s, turned.change[j], turned.turned[j], &turn)
                };
                motions.push(motion);
            }
        }
        (motions, (cos_minus_1, sin))
    }
}
