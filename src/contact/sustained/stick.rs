//! The end of a stick, in closed form.
//!
//! In stick both bodies rest, so cone and contact force are A + B cos psi: the first time at which
//! one of them falls through its limit is an arc cosine.

use super::{ContactMode, Next};
use crate::flight::{Drive, Trig};
use crate::model::angle::Angle;
use crate::model::oblique::SecondBody;
use crate::model::parameters::System;
use crate::model::state::{Clock, State};
use crate::numerics::tolerance::{EPS, FORCE_NOISE};

/// What must stay negative, alpha + beta cos psi, and what follows where it does not.
struct Limit {
    alpha: f64,
    beta: f64,
    /// Size of their terms, whose rounding they have.
    size: f64,
    then: Next,
}

fn limits(system: &System, state: &State) -> Vec<Limit> {
    let Angle { sin, cos } = system.contact.angle(state.x1);
    let (f1, f2) = (system.moment_amplitude, system.force_amplitude);
    // a1 = A1 + f1 cos psi, a2 = -x2 + f2 cos psi.
    let (pull, _) = system.free_accelerations(&State { v1: 0.0, v2: 0.0, ..*state }, 0.0);
    let SecondBody::Free { mass_ratio: m } = system.second_body() else {
        // A wall at rest: p = a1/cos x1.
        let (alpha, beta) = (-pull * cos, -f1 * cos);
        return vec![Limit { alpha, beta, size: alpha.abs() + beta.abs(), then: Next::Release }];
    };
    let slip = |direction: f64| {
        // s (mbar a1 + a2 k) <= 0 holds the tip against slip in direction s.
        let k = cos + system.friction * sin.abs() * direction;
        let then = if system.slip_inertia(sin, cos, direction) == 0.0 {
            system.no_force_fits()
        } else {
            Next::Hold(ContactMode::slide(direction))
        };
        Limit {
            alpha: direction * (m * pull - state.x2 * k),
            beta: direction * (m * f1 + f2 * k),
            size: m * (pull.abs() + f1.abs()) + (state.x2.abs() + f2.abs()) * k.abs(),
            then,
        }
    };
    // p_s = -a2/mbar >= 0.
    let size = state.x2.abs() + f2.abs();
    let force = Limit { alpha: -state.x2, beta: f2, size, then: Next::Release };
    vec![slip(1.0), slip(-1.0), force]
}

/// Time until the stick ends, and what follows; `None` if it never does.
pub(crate) fn next_change(
    system: &System,
    drive: &Drive,
    clock: Clock,
    state: &State,
) -> Option<(f64, Next)> {
    let phase = drive.trig_at(clock);
    limits(system, state)
        .into_iter()
        .filter_map(|limit| Some((limit.crossing(drive.omega, phase)?, limit.then)))
        .min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Whether a contact force of 0 (a wall at rest, or a2 = 0) falls.
pub(super) fn falls(system: &System, phase: Trig, state: &State) -> bool {
    if system.drive_frequency == 0.0 {
        return false;
    }
    limits(system, state).iter().filter(|limit| limit.then == Next::Release).any(|limit| {
        let rate = -limit.beta * phase.sin;
        rate > 0.0 || (rate == 0.0 && -limit.beta * phase.cos > 0.0)
    })
}

impl Limit {
    /// First time at which alpha + beta cos psi rises through zero.
    fn crossing(&self, omega: f64, phase: Trig) -> Option<f64> {
        let now = self.alpha + self.beta * phase.cos;
        let noise = FORCE_NOISE * EPS * self.size;
        // Per unit of phase.
        let rising = -self.beta * phase.sin > 0.0;
        if now > noise || (now >= -noise && rising) {
            return Some(0.0);
        }
        let cosine = -self.alpha / self.beta;
        let crosses = omega > 0.0 && cosine.abs() < 1.0;
        if !crosses {
            return None;
        }
        // There -beta sin psi > 0.
        let target = cosine.acos() * -self.beta.signum();
        let from = phase.sin.atan2(phase.cos);
        let turn = (target - from).rem_euclid(std::f64::consts::TAU);
        Some(turn / omega)
    }
}
