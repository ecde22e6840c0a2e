//! Regimes of an impact: when slip stops or reverses, relative to approach and restitution.
//!
//! P* is the impulse at which x1' = 0, P_f the one at which u = 0, both with the first slip
//! direction (Han, Jin & Hu (2004), eqs. (9), (10) with |sin x1|).
//!
//! Edges: |cos x1| = mu |sin x1| sticks; P* = P_f counts as restitution; P* = (1 + r) P_f is slip;
//! x1' = 0 at the start sticks, or slips with s = -sgn(cos x1); sin x1 = 0 is frictionless.
//! The outcome is continuous across all of them.

#![allow(clippy::inline_always)] // a flight with its impact is compiled for several instruction sets
#![allow(clippy::needless_bitwise_bool)] // conditions without jumps, for the lanes

use serde::{Deserialize, Serialize};

use super::{ImpactFailure, PreImpact};
use crate::numerics::tolerance::SIMULTANEOUS;

/// Regime of an impact with what the walk needs to know of it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Regime {
    /// mu = 0 or sin x1 = 0.
    Frictionless,
    /// Slip keeps its direction, sign +1 or -1.
    Slip {
        /// s = sgn(x1') during the impact.
        direction: f64,
    },
    /// Slip reverses in approach, at this impulse.
    ReversalInApproach {
        /// P*.
        switch: f64,
    },
    /// Slip reverses in restitution, at this impulse.
    ReversalInRestitution {
        /// P*.
        switch: f64,
    },
    /// The tip sticks in approach, from this impulse.
    StickInApproach {
        /// P*.
        switch: f64,
    },
    /// The tip sticks in restitution, from this impulse.
    StickInRestitution {
        /// P*.
        switch: f64,
    },
}

/// The regime without its data, as stored: 0 ... 5 in the order of the table in docs/theory.md.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[repr(u8)]
#[non_exhaustive]
pub enum RegimeKind {
    /// No friction acts.
    Frictionless = 0,
    /// Slip in one direction.
    Slip = 1,
    /// Reversal in approach.
    ReversalInApproach = 2,
    /// Reversal in restitution.
    ReversalInRestitution = 3,
    /// Stick in approach.
    StickInApproach = 4,
    /// Stick in restitution.
    StickInRestitution = 5,
}

impl RegimeKind {
    /// All, in the order of their numbers.
    pub const ALL: &'static [Self] = &[
        Self::Frictionless,
        Self::Slip,
        Self::ReversalInApproach,
        Self::ReversalInRestitution,
        Self::StickInApproach,
        Self::StickInRestitution,
    ];

    /// The name used in Python and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Frictionless => "frictionless",
            Self::Slip => "slip",
            Self::ReversalInApproach => "reversal_approach",
            Self::ReversalInRestitution => "reversal_restitution",
            Self::StickInApproach => "stick_approach",
            Self::StickInRestitution => "stick_restitution",
        }
    }

    /// The regime of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.name() == name)
    }
}

impl Regime {
    /// The regime without its data.
    #[must_use]
    pub fn kind(&self) -> RegimeKind {
        match self {
            Self::Frictionless => RegimeKind::Frictionless,
            Self::Slip { .. } => RegimeKind::Slip,
            Self::ReversalInApproach { .. } => RegimeKind::ReversalInApproach,
            Self::ReversalInRestitution { .. } => RegimeKind::ReversalInRestitution,
            Self::StickInApproach { .. } => RegimeKind::StickInApproach,
            Self::StickInRestitution { .. } => RegimeKind::StickInRestitution,
        }
    }
}

/// k = cos x1 + mu s |sin x1|, s the sign of `direction`.
#[inline(always)]
pub(super) fn slip_constant(pre: &PreImpact, friction: f64, direction: f64) -> f64 {
    pre.cos + (friction * pre.sin.abs()).copysign(direction)
}

/// Slip in the direction of x1' before the impact.
pub(crate) struct FirstSlip {
    /// k.
    constant: f64,
    /// mbar + k cos x1: how fast the approach slows.
    slows: f64,
    /// P*; infinite for k = 0.
    switch: f64,
    /// P_f.
    end_of_approach: f64,
}

impl FirstSlip {
    #[inline(always)]
    pub fn new(pre: &PreImpact, mass_ratio: f64, friction: f64) -> Self {
        let constant = slip_constant(pre, friction, pre.v1);
        let slows = mass_ratio + constant * pre.cos;
        let end_of_approach = pre.approach_velocity() / slows;
        Self { constant, slows, switch: pre.v1 / constant, end_of_approach }
    }

    /// Whether it lasts through the whole impact.
    #[inline(always)]
    pub fn lasts(&self, pre: &PreImpact, restitution: f64) -> bool {
        // By signs, not by the sign of the quotient, which may underflow to zero.
        let never = (self.constant == 0.0) | ((self.constant > 0.0) != (pre.v1 > 0.0));
        never | (self.switch >= (1.0 + restitution) * self.end_of_approach)
    }

    /// Whether the bodies approach ever faster while it lasts.
    #[inline(always)]
    pub fn drives_on(&self) -> bool {
        self.slows <= 0.0
    }
}

/// The regime of an impact with u > 0 under a walk law.
pub(super) fn classify(
    pre: &PreImpact,
    mass_ratio: f64,
    restitution: f64,
    friction: f64,
) -> Result<Regime, ImpactFailure> {
    if friction == 0.0 || pre.sin == 0.0 {
        return Ok(Regime::Frictionless);
    }
    let sticks = pre.cos.abs() <= friction * pre.sin.abs();
    if pre.v1 == 0.0 {
        return if sticks {
            stick_in_approach(pre, mass_ratio, 0.0)
        } else {
            Ok(Regime::Slip { direction: -pre.cos.signum() })
        };
    }
    let slip = FirstSlip::new(pre, mass_ratio, friction);
    let FirstSlip { switch, end_of_approach, .. } = slip;
    if slip.drives_on() {
        // u grows while the tip slips: it is driven to x1' = 0, where it sticks.
        return if switch.is_finite() {
            stick_in_approach(pre, mass_ratio, switch)
        } else {
            Err(ImpactFailure::Jammed)
        };
    }
    let regime = if slip.lasts(pre, restitution) {
        Regime::Slip { direction: 1f64.copysign(pre.v1) }
    } else if switch >= end_of_approach * (1.0 - SIMULTANEOUS) {
        if sticks {
            Regime::StickInRestitution { switch }
        } else {
            Regime::ReversalInRestitution { switch }
        }
    } else if sticks {
        return stick_in_approach(pre, mass_ratio, switch);
    } else {
        Regime::ReversalInApproach { switch }
    };
    Ok(regime)
}

fn stick_in_approach(
    pre: &PreImpact,
    mass_ratio: f64,
    switch: f64,
) -> Result<Regime, ImpactFailure> {
    // In stick u = -x2' shrinks by mbar dP only: against a moving wall it never ends.
    if mass_ratio == 0.0 && pre.v2 < 0.0 {
        return Err(ImpactFailure::Jammed);
    }
    Ok(Regime::StickInApproach { switch })
}
