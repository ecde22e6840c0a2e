//! What a verdict on a motion stands on, with the numbers that belong to it.

use std::fmt;

use crate::analysis::tolerances::{CERTAIN_GROWTH, NO_GROWTH_PERIODS, STEADY_GROWTH};

/// A rate this close to 1 is shown by its distance from it: four decimals would hide it.
const SLOW_RATE: f64 = 1e-3;

/// Growth of a small perturbation along a motion (lyapunov.rs).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Growth {
    /// Mean of the logarithmic growth per drive period.
    pub mean: f64,
    /// Its standard error, from the means of blocks of several lengths (lyapunov/record.rs).
    pub error: f64,
    /// Drive periods it was measured over; 0 where nothing had to be measured, since the bodies
    /// never meet again.
    pub periods: usize,
    /// Its standard error from ten blocks, which the verdict stands on.
    pub(crate) of_ten: f64,
}

/// What a growth shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GrowthVerdict {
    /// Perturbations grow exponentially.
    Grows,
    /// They shrink exponentially.
    Shrinks,
    /// They grow no faster than a shear.
    Stays,
    /// None of these for certain.
    Unclear,
}

impl Growth {
    /// Of undamped bodies that never meet again: known without a measurement.
    pub(crate) const NONE: Self = Self { mean: 0.0, error: 0.0, periods: 0, of_ten: 0.0 };

    /// What it shows. By shear, perturbations grow like the time: growth by ln(periods) is no sign
    /// of chaos. From so many drive periods on, a `long` measurement, what is no more than shear is
    /// bounded: blocks of a torus differ by a beat that does not add up, as their standard error has it.
    pub(crate) fn verdict(&self, long: u32) -> GrowthVerdict {
        let periods = self.periods as f64;
        let (total, error, shear) = (self.mean * periods, self.of_ten * periods, periods.ln());
        // Even with two standard errors less it would be more than shear.
        let certain = total.abs() > shear + CERTAIN_GROWTH && total.abs() - 2.0 * error > shear;
        // Even with two standard errors more it would be no more than shear; and an exponent as
        // large as the error would have shown.
        let small = total + 2.0 * error < shear + 1.0 && 4.0 * error <= shear + 1.0;
        let long = periods >= f64::from(long) && total <= shear;
        // Shear shows in the first block most of all, and nothing on a torus shrinks.
        let steady = total.abs() > STEADY_GROWTH * error;
        let bounded = (small || long) && !steady;
        if certain && total > 0.0 {
            GrowthVerdict::Grows
        } else if certain {
            GrowthVerdict::Shrinks
        } else if self.periods >= NO_GROWTH_PERIODS && bounded {
            GrowthVerdict::Stays
        } else {
            GrowthVerdict::Unclear
        }
    }
}

impl Growth {
    /// Whether a measurement over so many periods may show more than this one: not if the growth
    /// goes on as it does within two standard errors, and is still unclear then.
    pub(crate) fn may_show_more(&self, periods: u32) -> bool {
        if self.periods < NO_GROWTH_PERIODS {
            return true;
        }
        let (so_far, periods) = (self.periods as f64, f64::from(periods));
        let shear = periods.ln();
        let error = self.of_ten * (so_far / periods).sqrt();
        let (low, high) = (self.mean - 2.0 * self.of_ten, self.mean + 2.0 * self.of_ten);
        let clear = |mean: f64| {
            mean * periods > shear + CERTAIN_GROWTH && (mean - 2.0 * error) * periods > shear
        };
        // What is bounded is so from the beginning, and its error decreases like the time.
        let bounded = low * periods < shear + 1.0 && 2.0 * self.of_ten * so_far <= shear + 1.0;
        clear(high) || clear(-low) || bounded
    }
}

/// What a verdict stands on.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Evidence {
    /// The sections return to within rounding.
    Returned {
        /// Drive periods by which the motion was followed beyond the run to see it; 0 in the run.
        further: i64,
    },
    /// The sections draw together geometrically, or the motion comes nearer to an attracting orbit.
    Converging {
        /// Factor by which their extent, or the distance, shrinks per drive period.
        rate: f64,
        /// As in `Returned`.
        further: i64,
        /// Whether it is the distance from an orbit that Newton's method has found.
        from_orbit: bool,
    },
    /// No return, and a small perturbation grows no faster than a shear.
    GrowthBounded(Growth),
    /// No return, and a small perturbation grows exponentially.
    GrowthExponential(Growth),
    /// None of these.
    Undecided {
        /// Why.
        why: WhyUndecided,
        /// A growth that was measured, and is neither bounded nor exponential for certain.
        growth: Option<Growth>,
    },
}

/// The kind of an [`Evidence`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum EvidenceKind {
    /// The sections return to within rounding.
    Returned,
    /// The sections draw together geometrically.
    Converging,
    /// A small perturbation grows no faster than a shear.
    GrowthBounded,
    /// A small perturbation grows exponentially.
    GrowthExponential,
    /// None of these.
    Undecided,
}

/// Why a motion is not judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum WhyUndecided {
    /// A constant load has no drive period, and so no sections.
    NoDrivePeriod,
    /// Fewer than four sections.
    TooFewSections,
    /// A section left the range of numbers.
    NotFinite,
    /// The run ended before its time.
    Incomplete,
    /// No return in the sections, and no growth was measured.
    NoReturn,
    /// No return, and a growth that cannot be measured: the motion ends, or has too many impacts.
    NotMeasurable,
    /// No return, and a growth that is neither bounded nor exponential for certain.
    GrowthUnclear,
    /// The caller wished no more.
    Interrupted,
}

impl EvidenceKind {
    /// All, in order.
    pub const ALL: &'static [Self] = &[
        Self::Returned,
        Self::Converging,
        Self::GrowthBounded,
        Self::GrowthExponential,
        Self::Undecided,
    ];

    /// The name used in Python.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Returned => "returned",
            Self::Converging => "converging",
            Self::GrowthBounded => "growth_bounded",
            Self::GrowthExponential => "growth_exponential",
            Self::Undecided => "undecided",
        }
    }
}

impl WhyUndecided {
    /// All, in order.
    pub const ALL: &'static [Self] = &[
        Self::NoDrivePeriod,
        Self::TooFewSections,
        Self::NotFinite,
        Self::Incomplete,
        Self::NoReturn,
        Self::NotMeasurable,
        Self::GrowthUnclear,
        Self::Interrupted,
    ];

    /// The name used in Python.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::NoDrivePeriod => "no_drive_period",
            Self::TooFewSections => "too_few_sections",
            Self::NotFinite => "not_finite",
            Self::Incomplete => "incomplete",
            Self::NoReturn => "no_return",
            Self::NotMeasurable => "not_measurable",
            Self::GrowthUnclear => "growth_unclear",
            Self::Interrupted => "interrupted",
        }
    }
}

impl Evidence {
    /// Of a motion that is not judged, for this reason.
    pub(crate) fn undecided(why: WhyUndecided) -> Self {
        Self::Undecided { why, growth: None }
    }

    /// What it is, without its numbers.
    #[must_use]
    pub fn kind(&self) -> EvidenceKind {
        match self {
            Self::Returned { .. } => EvidenceKind::Returned,
            Self::Converging { .. } => EvidenceKind::Converging,
            Self::GrowthBounded(_) => EvidenceKind::GrowthBounded,
            Self::GrowthExponential(_) => EvidenceKind::GrowthExponential,
            Self::Undecided { .. } => EvidenceKind::Undecided,
        }
    }

    /// Why a motion is not judged.
    #[must_use]
    pub fn why(&self) -> Option<WhyUndecided> {
        match *self {
            Self::Undecided { why, .. } => Some(why),
            _ => None,
        }
    }

    /// The growth that was measured.
    #[must_use]
    pub fn growth(&self) -> Option<Growth> {
        match *self {
            Self::GrowthBounded(growth) | Self::GrowthExponential(growth) => Some(growth),
            Self::Undecided { growth, .. } => growth,
            _ => None,
        }
    }

    /// Factor by which the sections draw together per drive period, where they do.
    #[must_use]
    pub fn rate(&self) -> Option<f64> {
        match *self {
            Self::Converging { rate, .. } => Some(rate),
            _ => None,
        }
    }

    /// Drive periods by which the motion was followed beyond the run to see it repeat.
    #[must_use]
    pub fn further(&self) -> i64 {
        match *self {
            Self::Returned { further } | Self::Converging { further, .. } => further,
            _ => 0,
        }
    }

    /// What was seen so many drive periods later.
    pub(crate) fn later(self, by: i64) -> Self {
        match self {
            Self::Returned { further } => Self::Returned { further: further + by },
            Self::Converging { rate, further, from_orbit } => {
                Self::Converging { rate, further: further + by, from_orbit }
            }
            other => other,
        }
    }
}

impl fmt::Display for Growth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { mean, error, periods, .. } = self;
        if *periods == 0 {
            return f.write_str("the bodies never meet again");
        }
        write!(f, "{mean:.2e} +- {error:.0e} per drive period over {periods}")
    }
}

impl fmt::Display for Evidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Returned { .. } => write!(f, "the sections return")?,
            Self::Converging { rate, from_orbit, .. } => {
                f.write_str(if *from_orbit {
                    "the motion comes nearer to the orbit beside it by "
                } else {
                    "the sections draw together by "
                })?;
                // A slow one must not look as if there were none.
                if 1.0 - rate < SLOW_RATE {
                    write!(f, "1 - {:.1e}", 1.0 - rate)?;
                } else {
                    write!(f, "{rate:.4}")?;
                }
                f.write_str(" per drive period")?;
            }
            Self::GrowthBounded(growth) => {
                write!(f, "no return; perturbations do not grow: {growth}")?;
            }
            Self::GrowthExponential(growth) => {
                write!(f, "no return; perturbations grow exponentially: {growth}")?;
            }
            Self::Undecided { why, growth: None } => write!(f, "{why}")?,
            Self::Undecided { why, growth: Some(growth) } => write!(f, "{why}: {growth}")?,
        }
        match self.further() {
            0 => Ok(()),
            further => write!(f, ", seen {further} drive periods beyond the run"),
        }
    }
}

impl fmt::Display for WhyUndecided {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoDrivePeriod => "no drive period: a period m-n counts drive periods",
            Self::TooFewSections => {
                "too few sections: a label needs at least four kept drive periods"
            }
            Self::NotFinite => "the sections are not finite",
            Self::Incomplete => "the run did not complete",
            Self::NoReturn => "no return",
            Self::NotMeasurable => "no return; the growth cannot be measured",
            Self::GrowthUnclear => {
                "no return; growth unclear (a longer run is followed for longer)"
            }
            Self::Interrupted => "interrupted",
        })
    }
}
