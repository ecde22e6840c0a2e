//! The motion of a body that swings about its equilibrium and answers the drive with its steady
//! response, from how far it has turned.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use super::{BodyFlight, Motion, Oscillator};
use crate::flight::drive::Turn;

impl Oscillator {
    /// Motion at local time `s` of a body that swings; `turned`: its (cos wd s - 1, sin wd s). Without
    /// damping nothing else is computed for `DAMPED = false`, also in lanes, where both sides of a
    /// condition are.
    #[inline(always)]
    pub fn swung<const DAMPED: bool>(
        &self,
        f: &BodyFlight,
        s: f64,
        turned: (f64, f64),
        turn: &Turn,
    ) -> Motion {
        if DAMPED && self.equation.decayed(s) {
            let (x, v) = self.equation.faded(f, s, turned, turn);
            return self.equation.motion_from(x - f.x, v, [x, 0.0], turn);
        }
        let change = if DAMPED { self.equation.amplitude_change(s) } else { 0.0 };
        let (increment, rate) = self.equation.swung(f, change, turned, turn);
        self.equation.motion_from(increment, rate, [f.x, increment], turn)
    }

    /// Motion at a local time `s` that is not short; of a body that swings from the change of its
    /// amplitude, e^{-c s} - 1, and (cos wd s - 1, sin wd s).
    #[inline(always)]
    pub fn turned_by(
        &self,
        f: &BodyFlight,
        s: f64,
        change: f64,
        turned: (f64, f64),
        turn: &Turn,
    ) -> Motion {
        if !self.swings_or_beats() {
            return self.at(f, s, turn);
        }
        if !self.is_steady() {
            return self.at_basis(f, s, self.equation.swinging_basis(change, turned), turn);
        }
        if self.equation.decayed(s) {
            let (x, v) = self.equation.faded(f, s, turned, turn);
            return self.equation.motion_from(x - f.x, v, [x, 0.0], turn);
        }
        let (increment, rate) = self.equation.swung(f, change, turned, turn);
        self.equation.motion_from(increment, rate, [f.x, increment], turn)
    }
}
