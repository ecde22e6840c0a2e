//! How a body moves without drive and load: on a spring, on a damper, or on nothing.

use crate::flight::tolerances::LEAST_DAMPING;
use crate::numerics::double_double::DoubleDouble;

/// How a free oscillation decays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Decay {
    /// zeta = 0, w > 0.
    Undamped { wd: f64 },
    /// 0 < zeta < 1.
    Underdamped { wd: f64 },
    /// zeta = 1, or the free rotor w = 0.
    Critical,
    /// zeta > 1: rates -slow and -slow - 2 kappa.
    Overdamped { kappa: f64, slow: f64 },
}

/// How a body moves without any load.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FreeBody {
    pub(super) natural: f64,
    pub(super) decay_rate: f64,
    pub(super) damped: DoubleDouble,
    pub(super) decay: Decay,
    /// |x^(n+1)| is at most this times the bound of |x^(n)|, n >= 1.
    pub(super) growth: f64,
}

impl FreeBody {
    /// On a spring, of this natural frequency and damping ratio; 0: nothing holds the body.
    pub fn on_spring(natural: DoubleDouble, damping: f64) -> Self {
        // Squares of less underflow; no run is long enough to see the difference.
        let damping = if damping < LEAST_DAMPING { 0.0 } else { damping };
        let one = DoubleDouble::new(1.0);
        let zeta = DoubleDouble::new(damping);
        let radicand = (one - zeta) * (one + zeta);
        let damped = natural * if radicand.hi < 0.0 { (-radicand).sqrt() } else { radicand.sqrt() };
        let natural = natural.value();
        let decay_rate = damping * natural;
        let wd = damped.value();
        let decay = if wd == 0.0 {
            Decay::Critical
        } else if damping == 0.0 {
            Decay::Undamped { wd }
        } else if damping < 1.0 {
            Decay::Underdamped { wd }
        } else {
            Decay::Overdamped { kappa: wd, slow: natural * (natural / (decay_rate + wd)) }
        };
        let growth = natural * (damping + damping.hypot(1.0));
        Self { natural, decay_rate, damped, decay, growth }
    }

    /// On a damper alone: x'' + 2 c x' = 0.
    pub fn on_damper(decay_rate: f64) -> Self {
        Self {
            natural: 0.0,
            decay_rate,
            damped: DoubleDouble::new(decay_rate),
            decay: Decay::Overdamped { kappa: decay_rate, slow: 0.0 },
            growth: 2.0 * decay_rate,
        }
    }
}
