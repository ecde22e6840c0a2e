//! The laws of restitution: how far the impulse path goes on after the approach has ended.
//!
//! ```text
//! poisson     P_II = r P_I                       impulses
//! newton      u = -r u0                          velocities
//! energetic   W_II = r^2 W_I                     works -+ int u dP of the normal impulse
//! ```
//!
//! A law gives one of these three conditions, with its ratio. The path solves for the impulse at
//! which the condition holds ([`Restitution`]); the incremental integrator checks it after each
//! step. While slip keeps its direction, u(P) is one straight line of slope -a1, and all three end
//! at (1 + r) u0/a1: the regime does not depend on the law, nor does the outcome of `frictionless`
//! and `slip`. A new law must have this property too. The laws differ only where slip ends at some
//! P*: there the slope changes to -a2.
//!
//! Where a2 = 0 (a contact that stick leaves no mobility: the pendulum at a wall) u changes no
//! more. A ratio of velocities is then never reached, nor one of works with u = 0: the path ends at
//! P*, since no further impulse changes a velocity.
//!
//! Source: docs/theory.md, section 4; W. J. Stronge, Impact Mechanics (2000), and Beghin and
//! Boulanger as quoted by Han, Jin & Hu (2004), section 2.

#![allow(clippy::inline_always)] // a flight with its impact is compiled for several instruction sets

use crate::model::parameters::ImpactLaw;
use crate::numerics::dual::Number;

/// What a law depends on: the phase of approach, u > 0.
#[derive(Debug, Clone, Copy)]
#[allow(dead_code)] // the present laws need no more than r
pub(crate) struct Approach<T> {
    /// r.
    pub restitution: T,
    /// u0, its velocity at the start.
    pub velocity: T,
    /// P_I, the normal impulse at its end.
    pub impulse: T,
    /// W_I = int u dP over it.
    pub work: T,
}

/// Where restitution ends.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Restitution<T> {
    /// P_II is this part of P_I.
    Impulse(T),
    /// -u is this part of u0.
    Velocity(T),
    /// W_II is the square of this part of W_I.
    Work(T),
}

/// A law of restitution.
pub(crate) trait Law {
    /// Where restitution ends.
    fn restitution<T: Number>(&self, approach: &Approach<T>) -> Restitution<T>;

    /// Whether an impact under this law may gain energy.
    fn may_gain_energy(&self) -> bool;
}

impl Law for ImpactLaw {
    #[inline(always)]
    fn restitution<T: Number>(&self, approach: &Approach<T>) -> Restitution<T> {
        let r = approach.restitution;
        match self {
            Self::Poisson | Self::Paper => Restitution::Impulse(r),
            Self::Newton => Restitution::Velocity(r),
            Self::Energetic => Restitution::Work(r),
        }
    }

    fn may_gain_energy(&self) -> bool {
        matches!(self, Self::Newton | Self::Paper)
    }
}

/// An impact whose slip ends at P*, seen from there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Switch<T> {
    /// P*.
    pub impulse: T,
    /// u at P*: not negative in approach, not positive in restitution, but for rounding.
    pub velocity: T,
    /// u0.
    pub approach_velocity: T,
    /// P_I.
    pub impulse_approach: T,
    /// v before the impact.
    pub parting: T,
    /// a1 = -du/dP before P*.
    pub slows_before: T,
    /// a2 = -du/dP after P*: not negative.
    pub slows_after: T,
    /// Whether P* < P_I.
    pub in_approach: bool,
    /// Whether the contact sticks after P*, and has mobility left.
    pub sticks_mobile: bool,
}

/// How the path goes on after P*.
#[derive(Debug, Clone, Copy)]
pub(super) struct End<T> {
    /// Impulse after P*, not negative but for rounding.
    pub impulse: T,
    /// u after the impact where it is known better than as the difference of the velocities.
    pub separation: Option<T>,
}

impl<T: Number> End<T> {
    /// The end at -`speed` after so much impulse, or at P* if no finite impulse gets there.
    #[inline(always)]
    fn at(speed: T, impulse: T) -> Self {
        let zero = T::constant(0.0);
        if impulse.value().is_finite() {
            Self { impulse: impulse.at_least(zero), separation: Some(-speed) }
        } else {
            Self { impulse: zero, separation: None }
        }
    }
}

impl<T: Number> Restitution<T> {
    /// The end of an impact whose slip ends at P*.
    #[inline(always)]
    pub(super) fn end(self, at: &Switch<T>) -> End<T> {
        let (one, zero) = (T::constant(1.0), T::constant(0.0));
        match self {
            Self::Impulse(ratio) => {
                let impulse = (one + ratio) * at.impulse_approach - at.impulse;
                End {
                    impulse: if at.in_approach { impulse } else { impulse.at_least(zero) },
                    // u = -v = -mobility (P - P_I) in stick: exactly -r of what it was without
                    // slip.
                    separation: (at.in_approach && at.sticks_mobile).then(|| ratio * at.parting),
                }
            }
            Self::Velocity(ratio) => {
                let speed = ratio * at.approach_velocity;
                End::at(speed, (speed + at.velocity) / at.slows_after)
            }
            Self::Work(ratio) if at.in_approach => {
                // Approach: P* (u0 + u)/2 before P*, u^2/(2 a2) after; restitution: u_post^2/(2
                // a2).
                let sum = (at.approach_velocity + at.velocity).at_least(zero);
                let speed = ratio * root(at.velocity, at.slows_after * at.impulse, sum);
                End::at(speed, (speed + at.velocity) / at.slows_after)
            }
            Self::Work(ratio) => {
                // Approach: u0^2/(2 a1); restitution: u^2/(2 a1) before P*, the rest after.
                let reached = (-at.velocity).at_least(zero);
                let whole = ratio * at.approach_velocity;
                let lacking = (whole - reached).at_least(zero);
                let speed =
                    root(reached, at.slows_after / at.slows_before * lacking, whole + reached);
                End::at(speed, lacking * ((whole + reached) / (speed + reached)) / at.slows_before)
            }
        }
    }
}

/// sqrt(a^2 + x y), whose squares could leave the range of numbers.
fn root<T: Number>(a: T, x: T, y: T) -> T {
    let root = (a * a + x * y).sqrt();
    let (a, x, y) = (a.value(), x.value(), y.value());
    // Beyond the end of the regime x is negative: derivatives are asked for there too.
    if x < 0.0 { root } else { root.with_value(a.hypot(x.sqrt() * y.sqrt())) }
}
