//! What holds a motion inside its sequence of legs: for each leg the conditions that are positive
//! as long as the leg is what it is. The root of one is a border (docs/orbits.md).

use std::fmt;

/// What vanishes at a border.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Border {
    /// u before an impact.
    ApproachVelocity,
    /// Distance of the bodies at the largest maximum of the gap inside a flight.
    Flight,
    /// sin x1 at an impact: the sign of the friction's lever.
    SideOfImpact,
    /// x1' before an impact.
    SlipBefore,
    /// P* = P_f: slip stops as the approach ends.
    StopAtEndOfApproach,
    /// P* = (1 + r) P_f: slip stops as the impact ends.
    StopAtEndOfImpact,
    /// |cos x1| = mu |sin x1|: whether a tip that has stopped sticks or slips back.
    FrictionCone,
    /// The contact force where contact begins.
    ForceAtStart,
    /// The length of a phase of contact.
    Length,
    /// x1' where a slide starts, or the acceleration where it starts from rest.
    SlipAtStart,
    /// The least contact force inside a slide.
    ForceInSlide,
    /// The least |x1'| inside a slide.
    SpeedInSlide,
    /// The contact force where a slide stops.
    ForceAtStop,
    /// |x1'| where a slide is released.
    SpeedAtRelease,
    /// What holds a stick against slip, x1' > 0.
    HoldPositive,
    /// What holds a stick against slip, x1' < 0.
    HoldNegative,
    /// The contact force in a stick.
    ForceInStick,
}

/// What a border tells apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum BorderKind {
    /// A flight touches g = 0, or an impact becomes a touch.
    Grazing,
    /// An impact changes its regime.
    RegimeBorder,
    /// The contact force is 0 where chatter accumulates: beyond, chatter is incomplete.
    ChatterOnset,
    /// A contact phase ends another way, or vanishes.
    ContactBorder,
}

impl BorderKind {
    /// All, in order.
    pub const ALL: &'static [Self] =
        &[Self::Grazing, Self::RegimeBorder, Self::ChatterOnset, Self::ContactBorder];

    /// The name used in Python.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Grazing => "grazing",
            Self::RegimeBorder => "regime_border",
            Self::ChatterOnset => "chatter_onset",
            Self::ContactBorder => "contact_border",
        }
    }
}

impl Border {
    /// All, in order.
    pub const ALL: &'static [Self] = &[
        Self::ApproachVelocity,
        Self::Flight,
        Self::SideOfImpact,
        Self::SlipBefore,
        Self::StopAtEndOfApproach,
        Self::StopAtEndOfImpact,
        Self::FrictionCone,
        Self::ForceAtStart,
        Self::Length,
        Self::SlipAtStart,
        Self::ForceInSlide,
        Self::SpeedInSlide,
        Self::ForceAtStop,
        Self::SpeedAtRelease,
        Self::HoldPositive,
        Self::HoldNegative,
        Self::ForceInStick,
    ];

    /// What its root means.
    #[must_use]
    pub fn kind(self) -> BorderKind {
        match self {
            Self::ApproachVelocity | Self::Flight => BorderKind::Grazing,
            Self::SideOfImpact
            | Self::SlipBefore
            | Self::StopAtEndOfApproach
            | Self::StopAtEndOfImpact
            | Self::FrictionCone => BorderKind::RegimeBorder,
            Self::ForceAtStart => BorderKind::ChatterOnset,
            Self::Length
            | Self::SlipAtStart
            | Self::ForceInSlide
            | Self::SpeedInSlide
            | Self::ForceAtStop
            | Self::SpeedAtRelease
            | Self::HoldPositive
            | Self::HoldNegative
            | Self::ForceInStick => BorderKind::ContactBorder,
        }
    }

    /// The name used in Python.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ApproachVelocity => "approach_velocity",
            Self::Flight => "flight",
            Self::SideOfImpact => "side_of_impact",
            Self::SlipBefore => "slip_before",
            Self::StopAtEndOfApproach => "stop_at_end_of_approach",
            Self::StopAtEndOfImpact => "stop_at_end_of_impact",
            Self::FrictionCone => "friction_cone",
            Self::ForceAtStart => "force_at_start",
            Self::Length => "length",
            Self::SlipAtStart => "slip_at_start",
            Self::ForceInSlide => "force_in_slide",
            Self::SpeedInSlide => "speed_in_slide",
            Self::ForceAtStop => "force_at_stop",
            Self::SpeedAtRelease => "speed_at_release",
            Self::HoldPositive => "hold_positive",
            Self::HoldNegative => "hold_negative",
            Self::ForceInStick => "force_in_stick",
        }
    }

    /// What vanishes, in symbols or words for people.
    #[must_use]
    pub fn text(self) -> &'static str {
        match self {
            Self::ApproachVelocity => "u",
            Self::Flight => "flight",
            Self::SideOfImpact => "sin x1 = 0",
            Self::SlipBefore => "x1' = 0 before",
            Self::StopAtEndOfApproach => "P* = P_f",
            Self::StopAtEndOfImpact => "P* = (1 + r) P_f",
            Self::FrictionCone => "|cos x1| = mu |sin x1|",
            Self::ForceAtStart => "contact force at the start",
            Self::Length => "length of the phase",
            Self::SlipAtStart => "slip at the start",
            Self::ForceInSlide => "contact force in the slide",
            Self::SpeedInSlide => "x1' in the slide",
            Self::ForceAtStop => "contact force at the stop",
            Self::SpeedAtRelease => "x1' at the release",
            Self::HoldPositive => "hold against slip, x1' > 0",
            Self::HoldNegative => "hold against slip, x1' < 0",
            Self::ForceInStick => "contact force in stick",
        }
    }
}

/// A border with the value that vanishes on it, positive inside.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BorderValue {
    pub border: Border,
    pub value: f64,
}

/// Takes note of a value: of each border the least is kept.
pub(crate) fn note_least(known: &mut Vec<BorderValue>, new: BorderValue) {
    match known.iter_mut().find(|known| known.border == new.border) {
        Some(known) => known.value = known.value.min(new.value),
        None => known.push(new),
    }
}

/// One condition of a motion: a border of one of its legs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Condition {
    /// What vanishes.
    pub border: Border,
    /// Number of the leg.
    pub leg: usize,
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}, leg {}", self.border.kind().name(), self.border.text(), self.leg)
    }
}

/// The test function of a condition, positive as long as its leg is what it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConditionValue {
    /// Which condition.
    pub condition: Condition,
    /// Its value.
    pub value: f64,
    /// Time from the start of the leg at which it is taken.
    pub time: f64,
}
