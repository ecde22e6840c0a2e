//! Regimes of an impact: when slip stops or reverses, relative to approach and restitution.
//!
//! P* is the impulse at which w = 0, P_f the one at which u = 0, both with the first slip
//! direction (Han, Jin & Hu (2004), eqs. (9), (10) with |sin x1|).
//!
//! Edges: |b| = mu c sticks (the pendulum: |cos x1| = mu |sin x1|); P* = P_f counts as restitution;
//! P* = (1 + r) P_f is slip; w = 0 at the start sticks, or slips with s = -sgn b; c = 0 is
//! frictionless. The outcome is continuous across all of them.

#![allow(clippy::inline_always)] // a flight with its impact is compiled for several instruction sets
#![allow(clippy::needless_bitwise_bool)] // conditions without jumps, for the lanes

use serde::{Deserialize, Serialize};

use super::ImpactFailure;
use crate::impact::tolerances::SIMULTANEOUS;
use crate::model::contact_coordinates::ContactCoordinates;

/// Regime of an impact with what the impulse path needs to know of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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

    /// Whether slip ends or reverses, at an impulse P*.
    pub(crate) fn has_switch(self) -> bool {
        !matches!(self, Self::Frictionless | Self::Slip)
    }

    /// Whether slip ends in stick.
    #[must_use]
    pub(crate) fn sticks(self) -> bool {
        matches!(self, Self::StickInApproach | Self::StickInRestitution)
    }

    /// Whether slip reverses.
    #[must_use]
    pub(crate) fn reverses(self) -> bool {
        matches!(self, Self::ReversalInApproach | Self::ReversalInRestitution)
    }

    /// Whether slip ends or reverses while the bodies approach.
    #[must_use]
    pub(crate) fn switches_in_approach(self) -> bool {
        matches!(self, Self::StickInApproach | Self::ReversalInApproach)
    }

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
    /// Direction of slip at first, from w before, and P*; 0 where there is none.
    pub(super) fn start(&self, slip: f64) -> (f64, f64) {
        match *self {
            Self::Frictionless => (1.0, 0.0),
            Self::Slip { direction } => (direction, 0.0),
            Self::ReversalInApproach { switch }
            | Self::ReversalInRestitution { switch }
            | Self::StickInApproach { switch }
            | Self::StickInRestitution { switch } => (1f64.copysign(slip), switch),
        }
    }

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

/// Slip in the direction it has before the impact.
pub(crate) struct FirstSlip {
    /// k.
    constant: f64,
    /// a1 = mobility + k b/h: how fast the approach slows.
    slows: f64,
    /// P*; infinite for k = 0.
    switch: f64,
    /// P_f.
    end_of_approach: f64,
}

impl FirstSlip {
    #[inline(always)]
    pub fn new(contact: &ContactCoordinates<f64>) -> Self {
        let constant = contact.slip_rate(1f64.copysign(contact.slip));
        let slows = contact.mobility + constant * contact.coupling;
        let end_of_approach = contact.approach_velocity() / slows;
        Self { constant, slows, switch: contact.slip / constant, end_of_approach }
    }

    /// Whether it keeps its direction through the whole impact, unless the approach grows.
    #[inline(always)]
    pub fn continues(&self, contact: &ContactCoordinates<f64>, restitution: f64) -> bool {
        // By signs, not by the sign of the quotient, which may underflow to zero.
        let never = (self.constant == 0.0) | ((self.constant > 0.0) != (contact.slip > 0.0));
        never | (self.switch >= (1.0 + restitution) * self.end_of_approach)
    }

    /// Whether the bodies approach ever faster while it lasts.
    #[inline(always)]
    pub fn approach_grows(&self) -> bool {
        self.slows <= 0.0
    }
}

/// The regime of an impact with u > 0 along the impulse path.
pub(super) fn classify(
    contact: &ContactCoordinates<f64>,
    restitution: f64,
) -> Result<Regime, ImpactFailure> {
    if contact.friction == 0.0 || contact.scale == 0.0 {
        return Ok(Regime::Frictionless);
    }
    let sticks = contact.is_in_friction_cone();
    if contact.slip == 0.0 {
        return if sticks {
            stick_in_approach(contact, 0.0)
        } else {
            Ok(Regime::Slip { direction: -contact.coupling.signum() })
        };
    }
    let slip = FirstSlip::new(contact);
    let FirstSlip { switch, end_of_approach, .. } = slip;
    if slip.approach_grows() {
        // Slip is driven to w = 0, where it sticks.
        return if switch.is_finite() {
            stick_in_approach(contact, switch)
        } else {
            Err(ImpactFailure::Jammed)
        };
    }
    let regime = if slip.continues(contact, restitution) {
        Regime::Slip { direction: 1f64.copysign(contact.slip) }
    } else if switch >= end_of_approach * (1.0 - SIMULTANEOUS) {
        if sticks {
            Regime::StickInRestitution { switch }
        } else {
            Regime::ReversalInRestitution { switch }
        }
    } else if sticks {
        return stick_in_approach(contact, switch);
    } else {
        Regime::ReversalInApproach { switch }
    };
    Ok(regime)
}

fn stick_in_approach(
    contact: &ContactCoordinates<f64>,
    switch: f64,
) -> Result<Regime, ImpactFailure> {
    // In stick u = -v shrinks by the mobility dP only: against a moving wall it never ends.
    if contact.mobility == 0.0 && contact.parting < 0.0 {
        return Err(ImpactFailure::Jammed);
    }
    Ok(Regime::StickInApproach { switch })
}
