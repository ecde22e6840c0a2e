//! How a flight leaves the contact after a release: g = g' = g'' = 0 (docs/theory.md, section 3).

use super::{Sample, Search};
use crate::search::gap::{Gap, GapPoint};
use crate::search::tolerances::{GRAZE_NOISE, RELEASE_PROBE};

impl<G: Gap> Search<'_, G> {
    /// Whether g''' < 0 alone takes the bodies apart, by more than rounding, before the bound of
    /// g'''' allows them back.
    pub(super) fn leaves(&self, point: &GapPoint) -> bool {
        let step = (-4.0 * point.third / self.gap.bounds.fourth).clamp(0.0, self.span);
        -point.third * step.powi(3) > GRAZE_NOISE * self.gap.noise(step)
    }

    /// A release so flat that g''' = 0 to rounding: the first of a few short times at which the
    /// bodies are apart beyond doubt, or the last up to which the gap is at rounding level.
    pub(super) fn after_flat_release(&mut self, start: Sample<G::Instant>) -> Sample<G::Instant> {
        let (mut s, longest) = RELEASE_PROBE;
        let mut last = start;
        while s <= longest {
            let sample = self.evaluate(s * self.span);
            let level = 2.0 * GRAZE_NOISE * self.gap.noise(sample.time);
            if sample.gap.value > level {
                return last;
            }
            last = sample;
            if sample.gap.value < -level {
                return last;
            }
            s *= 2.0;
        }
        last
    }
}
