//! The rounding level of the gap function that the contact search states, worked out anew from
//! docs/contact-detection.md for use in tests:
//! e(s) = EPS (4 (|tip| + |x2| + |delta|) + 6 V s), V >= |g'|; without the first part after an impact.

use vibroimpact::{Contact, State, System};

const EPS: f64 = f64::EPSILON;
/// The factors 4 and 6 above, and that of e up to which a hump is a graze.
const GAP_NOISE: f64 = 4.0;
const FLIGHT_NOISE: f64 = 6.0;
const GRAZE_NOISE: f64 = 4.0;

/// |tip| + |x2| + |delta|: the terms of the gap function.
pub fn size(system: &System, state: &State) -> f64 {
    let tip = match system.contact() {
        Contact::Direct => state.x1,
        _ => state.x1.sin(),
    };
    tip.abs() + state.x2.abs() + system.gap().abs()
}

/// Bound V of |g'| over a flight of at most `span` that starts in `state` at forcing phase
/// `system.phase()`.
pub fn rate_bound(system: &System, state: &State, span: f64) -> f64 {
    let (omega, phase) = (system.drive_frequency(), system.phase());
    let body = |w: f64, zeta: f64, f: f64, x: f64, v: f64| {
        // Free oscillation about the steady response of amplitude |P|, or the driven energy.
        let (re, im) = ((w - omega) * (w + omega), 2.0 * zeta * w * omega);
        let norm = re * re + im * im;
        let driven = v.hypot(w * x) + f.abs() * span;
        if norm == 0.0 {
            return if f == 0.0 { v.hypot(w * x) } else { driven };
        }
        let (p, q) = (f * re / norm, -f * im / norm);
        let (sin, cos) = phase.sin_cos();
        let (steady, steady_rate) = (p * cos - q * sin, -omega * (p * sin + q * cos));
        let free = (v - steady_rate).hypot(w * (x - steady)) + p.hypot(q) * omega;
        if f == 0.0 { free } else { free.min(driven) }
    };
    body(
        system.frequency_ratio(),
        system.pendulum_damping(),
        system.moment_amplitude(),
        state.x1,
        state.v1,
    ) + body(1.0, system.oscillator_damping(), system.force_amplitude(), state.x2, state.v2)
}

/// Rounding level e(s) of a flight.
#[derive(Debug, Clone, Copy)]
pub struct Level {
    start: f64,
    /// V.
    pub rate_bound: f64,
}

impl Level {
    pub fn new(system: &System, state: &State, touching: bool, span: f64) -> Self {
        let start = if touching { 0.0 } else { GAP_NOISE * EPS * size(system, state) };
        Self { start, rate_bound: rate_bound(system, state, span) }
    }

    /// e(s).
    pub fn at(&self, s: f64) -> f64 {
        self.start + FLIGHT_NOISE * EPS * self.rate_bound * s
    }

    /// A hump of true height within this of zero may be told as a graze, a contact or nothing:
    /// the search decides at GRAZE_NOISE e(s), from a height that is itself wrong by e(s).
    pub fn undecided(&self, s: f64) -> f64 {
        (GRAZE_NOISE + 1.0) * self.at(s)
    }
}
