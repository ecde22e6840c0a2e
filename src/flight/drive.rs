//! The forcing cos(omega t + phi) and its clock: periods are counted, phases stay reduced.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets
#![allow(clippy::needless_bitwise_bool)] // conditions without jumps, for the lanes

use crate::model::parameters::System;
use crate::model::state::Clock;
use crate::numerics::double_double::{DoubleDouble, TWO_PI};
use crate::numerics::elementary;
use crate::numerics::lanes::lanes_of;

/// Cosine and sine of the forcing phase psi.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Trig {
    pub cos: f64,
    pub sin: f64,
}

impl Trig {
    /// psi = 0.
    pub const ONE: Self = Self { cos: 1.0, sin: 0.0 };

    /// This angle and another together.
    #[inline(always)]
    pub fn turned_by(self, other: Self) -> Self {
        Self {
            cos: self.cos * other.cos - self.sin * other.sin,
            sin: self.sin * other.cos + self.cos * other.sin,
        }
    }
}

/// The forcing phase after some time: the turn made since the start, and where it led.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turn {
    /// cos(omega s) - 1, without cancellation.
    pub cos_minus_1: f64,
    /// sin(omega s).
    pub sin: f64,
    /// cos psi and sin psi at that time.
    pub phase: Trig,
    /// cos psi and sin psi at the start.
    pub start: Trig,
}

impl Turn {
    /// For unforced bodies, which do not look at it.
    pub const STILL: Self = Self { cos_minus_1: 0.0, sin: 0.0, phase: Trig::ONE, start: Trig::ONE };

    #[inline(always)]
    pub fn new(start: Trig, cos_minus_1: f64, sin: f64) -> Self {
        let phase = Trig {
            cos: start.cos + (start.cos * cos_minus_1 - start.sin * sin),
            sin: start.sin + (start.sin * cos_minus_1 + start.cos * sin),
        };
        Self { cos_minus_1, sin, phase, start }
    }
}

/// (cos(w s) - 1, sin(w s)) of at most [`elementary::MOST_TURNED`], with the tails of w and of w s.
#[inline(always)]
pub(crate) fn turn_within(w: DoubleDouble, s: f64) -> (f64, f64) {
    let angle = DoubleDouble::product(w.hi, s);
    elementary::turn_within(angle.hi, angle.lo + w.lo * s)
}

/// (cos(w s) - 1, sin(w s)) of any angle, with the tails of w and of w s.
#[inline(always)]
pub(super) fn turn(w: DoubleDouble, s: f64) -> (f64, f64) {
    let angle = DoubleDouble::product(w.hi, s);
    elementary::turn(angle.hi, angle.lo + w.lo * s)
}

/// The tick of the clock at impacts is the power of two at or below this part of the drive period.
const TICK: f64 = 1.0 / (1u64 << 55) as f64;

/// Drive periods within which rounding a time moves no phase by more than some roundings.
const SHORT_FLIGHT: i64 = 4;

/// The exponent's bits of a number.
const EXPONENT: u64 = 0x7ff0_0000_0000_0000;

/// Drive frequency, phase at t = 0, and the exact period.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Drive {
    pub omega: f64,
    phase: f64,
    /// 2 pi/omega to 32 digits; infinite for a drive that stands still.
    pub period: DoubleDouble,
    /// 1.5 * 2^52 ticks of the clock (see [`Drive::ticked`]).
    ticks: f64,
}

lanes_of! {
    /// Several drives.
    Drives of Drive {
        omega: omega, phase: phase, period: period.hi, period_rest: period.lo, ticks: ticks
    }
}

lanes_of! {
    /// Several forcing phases.
    Trigs of Trig { cos: cos, sin: sin }
}

impl Drive {
    /// The drive of `system`.
    pub fn of(system: &System) -> Self {
        Self::new(system.drive_frequency, system.phase)
    }

    pub fn new(omega: f64, phase: f64) -> Self {
        let period = if omega > 0.0 {
            TWO_PI.divide(DoubleDouble::new(omega))
        } else {
            DoubleDouble::new(f64::INFINITY)
        };
        // Reduced once, so that a large phase given by the user costs nothing later; one beyond all
        // digits has the sine and cosine that the library gives it.
        let reduced = DoubleDouble::new(phase).reduced_angle();
        let phase = if reduced.abs() <= 4.0 { reduced } else { phase.sin().atan2(phase.cos()) };
        let ticks = if period.hi.is_finite() {
            let tick = f64::from_bits((period.hi * TICK).to_bits() & EXPONENT);
            1.5 * 2f64.powi(52) * tick
        } else {
            0.0
        };
        Self { omega, phase, period, ticks }
    }

    /// What rounding an impact's time in the period to one number left out, in whole ticks: three
    /// binary digits more, and no others, so that what follows depends on few numbers
    /// (src/simulate/recurrence.rs).
    #[inline(always)]
    pub fn ticked(&self, rest: f64) -> f64 {
        (rest + self.ticks) - self.ticks
    }

    #[inline(always)]
    pub fn has_period(&self) -> bool {
        self.period.hi.is_finite()
    }

    /// Forcing phase at this clock, rounded once: product and sum are exact, the angle's tail
    /// enters to first order.
    #[inline(always)]
    pub fn trig_at(&self, clock: Clock) -> Trig {
        // Both terms are reduced, if the clock is.
        let angle =
            DoubleDouble::product(self.omega, clock.time_in_period) + DoubleDouble::new(self.phase);
        let tail = angle.lo + self.omega * clock.residual;
        let (sin, cos) = elementary::sin_cos_within(angle.hi, tail);
        // A drive f cos phi that stands still is real: a large sin phi would only bring rounding.
        Trig { cos, sin: if self.omega > 0.0 { sin } else { 0.0 } }
    }

    /// The forcing phase in [0, 2 pi) at this clock.
    #[inline(always)]
    pub fn phase_at(&self, clock: Clock) -> f64 {
        let full = TWO_PI.hi;
        let angle = self.omega * clock.time_in_period + self.phase;
        // Both are reduced: a turn more or less is all there can be.
        let phase = if angle < 0.0 {
            angle + full
        } else if angle >= full {
            angle - full
        } else {
            angle
        };
        // A tiny negative number rounds up to the full turn.
        if phase < full { phase } else { 0.0 }
    }

    #[inline(always)]
    pub fn turned(&self, start: Trig, s: f64) -> Turn {
        let (cos_minus_1, sin) = turn(DoubleDouble::new(self.omega), s);
        Turn::new(start, cos_minus_1, sin)
    }

    #[inline(always)]
    pub fn turned_far(&self, start: Trig, elapsed: DoubleDouble) -> Turn {
        let (cos_minus_1, sin) = elementary::turn(elapsed.scale(self.omega).reduced_angle(), 0.0);
        Turn::new(start, cos_minus_1, sin)
    }

    /// The clock `elapsed` after `start`.
    #[inline(always)]
    pub fn advance(&self, start: Clock, elapsed: DoubleDouble) -> Clock {
        let time = elapsed + DoubleDouble { hi: start.time_in_period, lo: start.residual };
        let (time, periods) =
            if self.has_period() && !self.holds(time) { self.wrapped(time) } else { (time, 0.0) };
        let period = start.period + periods as i64;
        Clock { period, time_in_period: time.hi, residual: time.lo }
    }

    /// Whether a time lies in the first period.
    #[inline(always)]
    pub fn holds(&self, time: DoubleDouble) -> bool {
        (time.hi >= 0.0) & (time.hi < self.period.hi)
    }

    /// A time of a drive with a period: the rest within the period, and the periods taken from it.
    #[inline(always)]
    pub fn wrapped(&self, time: DoubleDouble) -> (DoubleDouble, f64) {
        let whole = (time.hi / self.period.hi).floor();
        let time = time - self.period.scale(whole);
        // The quotient is rounded: one more or less.
        let (later, earlier) = (time + self.period, time - self.period);
        if time.hi < 0.0 {
            (later, whole - 1.0)
        } else if earlier.hi >= 0.0 {
            (earlier, whole + 1.0)
        } else {
            (time, whole)
        }
    }

    /// Exact time from `start` to `target`.
    #[inline(always)]
    pub fn until(&self, start: Clock, target: Clock) -> DoubleDouble {
        let within = DoubleDouble { hi: target.time_in_period, lo: target.residual }
            - DoubleDouble { hi: start.time_in_period, lo: start.residual };
        let whole = target.period - start.period;
        if whole == 0 { within } else { self.period.scale(whole as f64) + within }
    }

    /// Time from `start` to `target`, to rounding of the times within their periods.
    #[inline(always)]
    pub fn roughly_until(&self, start: Clock, target: Clock) -> f64 {
        let within =
            (target.time_in_period - start.time_in_period) + (target.residual - start.residual);
        let whole = target.period - start.period;
        // Without a drive the period is infinite.
        if whole == 0 { within } else { whole as f64 * self.period.hi + within }
    }

    /// Time from `start` to `target`: after some drive periods with all digits, which the phase of a free
    /// oscillation then needs, before them roughly.
    #[inline(always)]
    pub fn along_flight(&self, start: Clock, target: Clock) -> DoubleDouble {
        if target.period - start.period > SHORT_FLIGHT {
            self.until(start, target)
        } else {
            DoubleDouble::new(self.roughly_until(start, target))
        }
    }

    /// Time since t = 0 as one double.
    #[inline(always)]
    pub fn time(&self, clock: Clock) -> f64 {
        let within = DoubleDouble { hi: clock.time_in_period, lo: clock.residual };
        if clock.period == 0 {
            return within.value();
        }
        (self.period.scale(clock.period as f64) + within).value()
    }

    /// The clock at a time given as one double.
    pub fn clock_at(&self, time: f64) -> Clock {
        self.advance(Clock::START, DoubleDouble::new(time))
    }
}

#[cfg(test)]
mod tests {
    use super::Drive;
    use crate::model::state::Clock;

    #[test]
    fn any_phase_is_reduced() {
        for phase in [0.0, -7.5, 1e9, -1e22, 1e31, 1e40, -1e300, f64::MAX] {
            let trig = Drive::new(1.3, phase).trig_at(Clock::START);
            assert!((trig.cos - phase.cos()).abs() < 1e-15, "{phase:e}");
            assert!((trig.sin - phase.sin()).abs() < 1e-15, "{phase:e}");
        }
    }
}
