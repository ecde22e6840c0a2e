//! Modes in fours, as many as a register holds: their coordinates from those of the structure, and
//! how far they have turned.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets
#![allow(clippy::needless_range_loop)] // loops over lanes read best with their index

use super::ModeMotion;
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
    /// M phi by coordinate.
    rows: Vec<Lanes4>,
}

/// How far four modes have turned, and decayed.
#[derive(Debug, Clone, Copy)]
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
        let none = Self { rows: vec![[0.0; FOUR]; count], ..Self::default() };
        let mut fours = vec![none; count / FOUR + 1];
        for (i, (mode, motion)) in structure.modes().iter().zip(modes).enumerate() {
            let (four, j) = (&mut fours[i / FOUR], i % FOUR);
            let equation = &motion.oscillator.equation;
            (four.damped[j], four.damped_rest[j]) = (equation.damped.hi, equation.damped.lo);
            four.decay_rate[j] = equation.decay_rate;
            for (row, &number) in four.rows.iter_mut().zip(&mode.row) {
                row[j] = number;
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

    /// (M phi) . x, rounded as if once (Ogita, Rump & Oishi (2005), Accurate Sum and Dot Product).
    #[inline(always)]
    pub fn coordinates(&self, x: &[f64]) -> Lanes4 {
        let (mut sum, mut rest) = ([0.0; FOUR], [0.0; FOUR]);
        for (row, &x) in self.rows.iter().zip(x) {
            for j in 0..FOUR {
                let product = DoubleDouble::product(row[j], x);
                let added = DoubleDouble::sum(sum[j], product.hi);
                sum[j] = added.hi;
                rest[j] += added.lo + product.lo;
            }
        }
        for j in 0..FOUR {
            sum[j] += rest[j];
        }
        sum
    }
}
