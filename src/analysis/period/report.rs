//! What the sections of a motion say of it: its orbit, what the verdict stands on, and its label.

use super::CHATTERING;
use super::evidence::{Evidence, Growth, GrowthVerdict, WhyUndecided};
use crate::numerics::cancel::CancelToken;

/// What the stroboscopic section says of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeriodReport {
    /// Drive periods m and impacts n per orbit, if the motion repeats.
    pub orbit: Option<(usize, ImpactCount)>,
    /// Largest |X(k + m) - X(k)| over the last min(K - m, 3 m) sections; for m = 1 if none fits.
    pub residual: f64,
    /// What the verdict stands on.
    pub evidence: Evidence,
    /// The verdict where the motion does not repeat.
    pub kind: Kind,
}

/// Impacts per orbit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImpactCount {
    /// So many.
    Finite(usize),
    /// Complete chatter.
    Infinite,
}

impl ImpactCount {
    /// Of drive periods with so many impacts, [`CHATTERING`] where they are infinitely many.
    pub(crate) fn of(counts: &[u32]) -> Self {
        if counts.contains(&CHATTERING) {
            Self::Infinite
        } else {
            Self::Finite(counts.iter().map(|&count| count as usize).sum())
        }
    }
}

impl std::fmt::Display for ImpactCount {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Finite(n) => write!(f, "{n}"),
            Self::Infinite => write!(f, "inf"),
        }
    }
}

/// Kind of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// None of the others is certain.
    Unresolved = 0,
    /// Repeats after m drive periods.
    Periodic = 1,
    /// Does not repeat; a perturbation does not grow.
    QuasiPeriodic = 2,
    /// Does not repeat; a perturbation grows.
    Chaotic = 3,
}

impl Kind {
    /// Names in the order of the numbers.
    pub const NAMES: &'static [&'static str] =
        &["unresolved", "periodic", "quasi-periodic", "chaotic"];

    /// The name used in Python and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

impl PeriodReport {
    /// Whether the caller has cut it short: it then says nothing of the motion.
    #[must_use]
    pub fn is_interrupted(&self) -> bool {
        self.evidence.why() == Some(WhyUndecided::Interrupted)
    }

    /// The report, or that it was cut short.
    pub(crate) fn unless(self, cancel: &CancelToken) -> Self {
        if !cancel.is_cancelled() {
            return self;
        }
        self.undecided(WhyUndecided::Interrupted)
    }

    /// The report on a motion of so many drive periods, a part of those that were seen to repeat.
    pub(crate) fn with_period(self, periods: u32) -> Self {
        let periods = periods as usize;
        let part = |(m, n)| match n {
            ImpactCount::Finite(n) => (periods, ImpactCount::Finite(n * periods / m)),
            ImpactCount::Infinite => (periods, ImpactCount::Infinite),
        };
        Self { orbit: self.orbit.map(part), ..self }
    }

    /// The report without its verdict.
    pub(crate) fn unresolved(self) -> Self {
        Self { orbit: None, kind: Kind::Unresolved, ..self }
    }

    /// The report without a verdict, for this reason.
    pub(crate) fn undecided(self, why: WhyUndecided) -> Self {
        Self { evidence: Evidence::undecided(why), ..self.unresolved() }
    }

    /// The report with the verdict on a motion that does not repeat.
    pub(crate) fn decided(self, kind: Kind, evidence: Evidence) -> Self {
        Self { evidence, kind, ..self }
    }

    /// The report with what the growth of a perturbation says of a motion that does not repeat.
    pub(crate) fn told_by_growth(self, growth: Growth, verdict: GrowthVerdict) -> Self {
        match verdict {
            GrowthVerdict::Grows => {
                self.decided(Kind::Chaotic, Evidence::GrowthExponential(growth))
            }
            GrowthVerdict::Stays => {
                self.decided(Kind::QuasiPeriodic, Evidence::GrowthBounded(growth))
            }
            GrowthVerdict::Unclear | GrowthVerdict::Shrinks => {
                let why = WhyUndecided::GrowthUnclear;
                self.decided(Kind::Unresolved, Evidence::Undecided { why, growth: Some(growth) })
            }
        }
    }

    /// Factor per drive period by which the distance of the sections from the orbit decreases.
    pub(crate) fn convergence(&self) -> Option<f64> {
        self.orbit.and(self.evidence.rate())
    }

    /// The label: `3-4`, `1-0`, `2-inf` (chatter), `quasi-periodic`, `chaotic`, `unresolved`.
    #[must_use]
    pub fn label(&self) -> String {
        match (self.kind, self.orbit) {
            (Kind::Periodic, Some((m, n))) => format!("{m}-{n}"),
            (Kind::Periodic, None) => Kind::Unresolved.name().into(),
            (kind, _) => kind.name().into(),
        }
    }
}
