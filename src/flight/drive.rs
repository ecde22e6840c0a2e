//! The forcing cos(omega t + phi) and its clock: periods are counted, phases stay reduced.

use crate::double_double::{DoubleDouble, TWO_PI};
use crate::state::Clock;

/// Cosine and sine of the forcing phase psi.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Trig {
    pub cos: f64,
    pub sin: f64,
}

impl Trig {
    /// psi = 0.
    pub const ONE: Self = Self { cos: 1.0, sin: 0.0 };
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

    fn new(start: Trig, cos_minus_1: f64, sin: f64) -> Self {
        let phase = Trig {
            cos: start.cos + (start.cos * cos_minus_1 - start.sin * sin),
            sin: start.sin + (start.sin * cos_minus_1 + start.cos * sin),
        };
        Self { cos_minus_1, sin, phase, start }
    }
}

/// (cos(w s) - 1, sin(w s)) with the tails of w and of the product w s to first order. A small
/// angle is taken by halves, where the product's rounding is relative and 1 would swallow it.
pub(super) fn turn_exactly(w: DoubleDouble, s: f64) -> (f64, f64) {
    let angle = DoubleDouble::product(w.hi, s);
    if angle.hi < 0.5 {
        let (sin, cos) = (0.5 * angle.hi).sin_cos();
        return (-2.0 * sin * sin, 2.0 * sin * cos);
    }
    let tail = angle.lo + w.lo * s;
    let (sin, cos) = angle.hi.sin_cos();
    ((cos - 1.0) - tail * sin, sin + tail * cos)
}

/// Drive frequency, phase at t = 0, and the exact period.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Drive {
    pub omega: f64,
    phase: f64,
    /// 2 pi/omega to 32 digits; infinite for a constant load.
    pub period: DoubleDouble,
}

impl Drive {
    pub fn new(omega: f64, phase: f64) -> Self {
        let period = if omega > 0.0 {
            TWO_PI.divide(DoubleDouble::new(omega))
        } else {
            DoubleDouble::new(f64::INFINITY)
        };
        // Reduced once, so that a large phase given by the user costs nothing later.
        Self { omega, phase: DoubleDouble::new(phase).reduced_angle(), period }
    }

    pub fn has_period(&self) -> bool {
        self.period.hi.is_finite()
    }

    /// Forcing phase at this clock, rounded once: product and sum are exact, the angle's tail
    /// enters to first order.
    pub fn trig_at(&self, clock: Clock) -> Trig {
        let angle =
            DoubleDouble::product(self.omega, clock.time_in_period) + DoubleDouble::new(self.phase);
        let tail = angle.lo + self.omega * clock.residual;
        let (sin, cos) = angle.hi.sin_cos();
        let cos_psi = cos - tail * sin;
        // A constant load f cos phi is real: a large sin phi would only bring rounding.
        let sin_psi = if self.omega > 0.0 { sin + tail * cos } else { 0.0 };
        Trig { cos: cos_psi, sin: sin_psi }
    }

    /// The forcing phase in [0, 2 pi) at this clock.
    pub fn phase_at(&self, clock: Clock) -> f64 {
        let phase = (self.omega * clock.time_in_period + self.phase).rem_euclid(TWO_PI.hi);
        // rem_euclid of a tiny negative number rounds up to the modulus.
        if phase < TWO_PI.hi { phase } else { 0.0 }
    }

    #[inline]
    pub fn turned(&self, start: Trig, s: f64) -> Turn {
        let (sin, cos) = (0.5 * self.omega * s).sin_cos();
        Turn::new(start, -2.0 * sin * sin, 2.0 * sin * cos)
    }

    /// Like [`Drive::turned`], with the rounding of the angle made good: for the instant of a
    /// contact, once.
    pub fn turned_exactly(&self, start: Trig, s: f64) -> Turn {
        let (cos_minus_1, sin) = turn_exactly(DoubleDouble::new(self.omega), s);
        Turn::new(start, cos_minus_1, sin)
    }

    pub fn turned_far(&self, start: Trig, elapsed: DoubleDouble) -> Turn {
        let angle = elapsed.scale(self.omega).reduced_angle();
        let (sin, cos) = (0.5 * angle).sin_cos();
        Turn::new(start, -2.0 * sin * sin, 2.0 * sin * cos)
    }

    /// The clock `elapsed` after `start`.
    pub fn advance(&self, start: Clock, elapsed: DoubleDouble) -> Clock {
        let mut time = elapsed + DoubleDouble { hi: start.time_in_period, lo: start.residual };
        let mut period = start.period;
        if self.has_period() {
            let whole = (time.hi / self.period.hi).floor();
            if whole != 0.0 {
                time = time - self.period.scale(whole);
                period += whole as i64;
            }
            if time.hi < 0.0 {
                time = time + self.period;
                period -= 1;
            } else if (time - self.period).hi >= 0.0 {
                time = time - self.period;
                period += 1;
            }
        }
        Clock { period, time_in_period: time.hi, residual: time.lo }
    }

    /// Exact time from `start` to `target`.
    pub fn until(&self, start: Clock, target: Clock) -> DoubleDouble {
        let within = DoubleDouble { hi: target.time_in_period, lo: target.residual }
            - DoubleDouble { hi: start.time_in_period, lo: start.residual };
        let whole = target.period - start.period;
        if whole == 0 { within } else { self.period.scale(whole as f64) + within }
    }

    /// Time since t = 0 as one double.
    pub fn time(&self, clock: Clock) -> f64 {
        self.until(Clock::START, clock).value()
    }

    /// The clock at a time given as one double.
    pub fn clock_at(&self, time: f64) -> Clock {
        self.advance(Clock::START, DoubleDouble::new(time))
    }
}
