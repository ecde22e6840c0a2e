//! What the bodies do from one event to the next, and which event ends it.

use std::fmt;
use std::str::FromStr;

use crate::impact::{Regime, RegimeKind};
use crate::model::error::ParameterError;
use crate::model::parameters::System;
use crate::model::state::State;
use crate::simulate::event::ImpactEvent;

/// A sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Sign {
    /// -1.
    Negative,
    /// Of an impact without friction, which does not know it.
    Unknown,
    /// +1.
    Positive,
}

impl Sign {
    /// That of a number; of a zero its own.
    #[must_use]
    pub fn of(value: f64) -> Self {
        if value.is_sign_negative() { Self::Negative } else { Self::Positive }
    }

    /// -1, 0 or 1.
    #[must_use]
    pub fn value(self) -> f64 {
        match self {
            Self::Negative => -1.0,
            Self::Unknown => 0.0,
            Self::Positive => 1.0,
        }
    }
}

impl fmt::Display for Sign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Negative => "-",
            Self::Unknown => "0",
            Self::Positive => "+",
        })
    }
}

/// Signs that stay fixed during a leg to an impact with friction: of x1', and of sin x1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Signs {
    /// s = sgn(x1') at the start of the impact.
    pub direction: Sign,
    /// sgn(sin x1).
    pub side: Sign,
}

impl Signs {
    /// Of an impact without friction, which does not know them.
    pub(crate) const NONE: Self = Self { direction: Sign::Unknown, side: Sign::Unknown };

    /// Of an impact in this regime, with slip in this direction at first, at this sin x1.
    #[must_use]
    pub fn of(kind: RegimeKind, direction: f64, sin: f64) -> Self {
        match kind {
            RegimeKind::Frictionless => Self::NONE,
            _ => Self { direction: Sign::of(direction), side: Sign::of(sin) },
        }
    }

    /// Of an impact in this regime from these x1' and sin x1.
    #[must_use]
    pub fn of_regime(regime: Regime, v1: f64, sin: f64) -> Self {
        let direction = if let Regime::Slip { direction } = regime { direction } else { v1 };
        Self::of(regime.kind(), direction, sin)
    }
}

/// What ends a stick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StickEnd {
    /// The tip slips, x1' > 0.
    SlipPositive,
    /// The tip slips, x1' < 0.
    SlipNegative,
    /// The contact force falls to zero.
    Release,
}

/// One leg with the event at its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Leg {
    /// A flight to an impact of this regime.
    Impact(RegimeKind, Signs),
    /// Infinitely many impacts, to their accumulation point.
    Chatter,
    /// A slide until the contact force falls to zero; whether x1' > 0.
    SlideToRelease(bool),
    /// A slide until x1' = 0; whether x1' > 0 before.
    SlideToStop(bool),
    /// A stick.
    Stick(StickEnd),
    /// No event: a free motion, closed after so many drive periods.
    Circuit,
}

const WORDS: &str = "circuit, chatter, slide+:release, slide-:stop, stick:slide+, stick:release, \
    impact:frictionless, impact:slip:+- (signs of x1' and of sin x1), ...";

impl fmt::Display for Leg {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = |positive: bool| if positive { Sign::Positive } else { Sign::Negative };
        match *self {
            Self::Impact(RegimeKind::Frictionless, _) => write!(f, "impact:frictionless"),
            Self::Impact(kind, Signs { direction, side }) => {
                write!(f, "impact:{}:{direction}{side}", kind.name())
            }
            Self::Chatter => write!(f, "chatter"),
            Self::SlideToRelease(positive) => write!(f, "slide{}:release", sign(positive)),
            Self::SlideToStop(positive) => write!(f, "slide{}:stop", sign(positive)),
            Self::Stick(StickEnd::Release) => write!(f, "stick:release"),
            Self::Stick(end) => write!(f, "stick:slide{}", sign(end == StickEnd::SlipPositive)),
            Self::Circuit => write!(f, "circuit"),
        }
    }
}

/// Reads a leg from a file or from what a user has typed.
impl FromStr for Leg {
    type Err = ParameterError;

    fn from_str(text: &str) -> Result<Self, ParameterError> {
        let bad = || ParameterError::new("leg", text, WORDS);
        let sign = |c: char| match c {
            '+' => Ok(Sign::Positive),
            '-' => Ok(Sign::Negative),
            _ => Err(bad()),
        };
        Ok(match text.split(':').collect::<Vec<_>>()[..] {
            ["circuit"] => Self::Circuit,
            ["chatter"] => Self::Chatter,
            ["slide+", "release"] => Self::SlideToRelease(true),
            ["slide-", "release"] => Self::SlideToRelease(false),
            ["slide+", "stop"] => Self::SlideToStop(true),
            ["slide-", "stop"] => Self::SlideToStop(false),
            ["stick", "release"] => Self::Stick(StickEnd::Release),
            ["stick", "slide+"] => Self::Stick(StickEnd::SlipPositive),
            ["stick", "slide-"] => Self::Stick(StickEnd::SlipNegative),
            ["impact", "frictionless"] => Self::Impact(RegimeKind::Frictionless, Signs::NONE),
            ["impact", regime, signs] => {
                let kind = RegimeKind::from_name(regime).ok_or_else(bad)?;
                let mut signs = signs.chars();
                let (Some(direction), Some(side), None) =
                    (signs.next(), signs.next(), signs.next())
                else {
                    return Err(bad());
                };
                if kind == RegimeKind::Frictionless {
                    return Err(bad());
                }
                Self::Impact(kind, Signs { direction: sign(direction)?, side: sign(side)? })
            }
            _ => return Err(bad()),
        })
    }
}

impl Leg {
    /// The leg that an impact ends.
    pub(super) fn to_impact(system: &System, event: &ImpactEvent) -> Self {
        let (kind, signs) = Self::regime_of(system, (event.impact.regime, &event.pre));
        Self::Impact(kind, signs)
    }

    /// The regime of an impact from this state, and its signs.
    pub(crate) fn regime_of(
        system: &System,
        (regime, pre): (Regime, &State),
    ) -> (RegimeKind, Signs) {
        if regime == Regime::Frictionless {
            return (regime.kind(), Signs::NONE);
        }
        // The literal law has no |sin x1|. Up to a half turn the angle has the sign of its sine.
        let x1 = pre.x1;
        let sin = if !system.law.is_coulomb() {
            1.0
        } else if x1.abs() < 3.0 {
            x1
        } else {
            x1.sin()
        };
        (regime.kind(), Signs::of_regime(regime, pre.v1, sin))
    }
}
