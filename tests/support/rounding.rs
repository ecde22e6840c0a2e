//! The rounding level of the gap function that the contact search states, worked out anew from
//! docs/contact-detection.md for use in tests: e(s) = EPS (4 (|tip| + |x2| + |delta|) + 6 V s), V
//! >= |g'|; without the first part after an impact.

use super::judge::Level;
use vibroimpact::{Contact, State, System};

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
    let motion = |w: f64, zeta: f64, f: f64, x: f64, v: f64| {
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
    // About the equilibrium under a constant load; where the spring is too weak for that, with the
    // load's work.
    let body = |w: f64, zeta: f64, f: f64, load: f64, x: f64, v: f64| {
        if w * span >= 2.0 * zeta && w * span >= 1.0 {
            motion(w, zeta, f, x - load / (w * w), v)
        } else {
            motion(w, zeta, f, x, v) + load.abs() * span
        }
    };
    let (f1, f2) = (system.moment_amplitude(), system.force_amplitude());
    let (c1, c2) = (system.static_moment(), system.static_force());
    body(system.frequency_ratio(), system.pendulum_damping(), f1, c1, state.x1, state.v1)
        + body(1.0, system.oscillator_damping(), f2, c2, state.x2, state.v2)
}

/// Rounding level of a flight of at most `span`.
pub fn level(system: &System, state: &State, touching: bool, span: f64) -> Level {
    Level::new(size(system, state), rate_bound(system, state, span), touching)
}
