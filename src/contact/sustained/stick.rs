//! The end of a stick, in closed form.
//!
//! In stick both bodies rest, so cone and contact force are A + B cos psi: the first time at which
//! one of them falls through its limit is an arc cosine.

use super::{ClosedContact, ContactMode, Next, no_force_fits};
use crate::contact::tolerances::FORCE_NOISE;
use crate::flight::Trig;
use crate::numerics::EPS;

/// Bodies that stick.
pub(crate) struct Stick {
    /// The contact where no load acts, and where nothing but loads of cos psi = 1 act.
    pub unloaded: ClosedContact,
    pub loads: ClosedContact,
    /// Of the loads.
    pub frequency: f64,
}

/// What must stay negative, alpha + beta cos psi, and what follows where it does not.
struct Limit {
    alpha: f64,
    beta: f64,
    /// Size of their terms, whose rounding they have.
    size: f64,
    then: Next,
}

impl Stick {
    fn limits(&self) -> Vec<Limit> {
        let Self { unloaded, loads, .. } = self;
        let at = &unloaded.at;
        if at.is_against_wall() {
            // A wall at rest: p = alpha/(b/h).
            let (alpha, beta) =
                (-unloaded.slip_acceleration * at.coupling, -loads.slip_acceleration * at.coupling);
            return vec![Limit {
                alpha,
                beta,
                size: alpha.abs() + beta.abs(),
                then: Next::Release,
            }];
        }
        let size = |of: fn(&ClosedContact) -> f64| of(unloaded).abs() + of(loads).abs();
        let parting = size(|contact| contact.parting_acceleration);
        let slip = |direction: f64| Limit {
            alpha: direction * unloaded.slip_drive(direction),
            beta: direction * loads.slip_drive(direction),
            size: at.mobility * size(|contact| contact.slip_acceleration)
                + parting * at.slip_rate(direction).abs(),
            then: if at.slip_inertia(direction) == 0.0 {
                no_force_fits(at)
            } else {
                Next::Hold(ContactMode::slide(direction))
            },
        };
        // p_s = -beta/m >= 0.
        let force = Limit {
            alpha: unloaded.parting_acceleration,
            beta: loads.parting_acceleration,
            size: parting,
            then: Next::Release,
        };
        vec![slip(1.0), slip(-1.0), force]
    }

    /// Time until the stick ends, and what follows; `None` if it never does.
    pub fn next_change(&self, phase: Trig) -> Option<(f64, Next)> {
        self.limits()
            .into_iter()
            .filter_map(|limit| Some((limit.crossing(self.frequency, phase)?, limit.then)))
            .min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Whether a contact force of 0 falls.
    pub fn falls(&self, phase: Trig) -> bool {
        if self.frequency == 0.0 {
            return false;
        }
        self.limits().iter().filter(|limit| limit.then == Next::Release).any(|limit| {
            let rate = -limit.beta * phase.sin;
            rate > 0.0 || (rate == 0.0 && -limit.beta * phase.cos > 0.0)
        })
    }
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
