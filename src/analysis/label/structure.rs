//! The label of a run of a structure.

use super::next_look;
use crate::analysis::period::{Evidence, Growth, GrowthVerdict, Kind, PeriodReport, WhyUndecided};
use crate::analysis::structure_lyapunov::structure_lyapunov;
use crate::analysis::structure_orbit::structure_orbit;
use crate::analysis::tolerances::{
    ALIGNING_STEPS, CERTAIN_MULTIPLIER, EXPONENT_PERIODS, FIRST_GROWTH_PERIODS, GROWTH_IMPACTS,
    GROWTH_PER_RUN, LONG_GROWTH_PERIODS, LONG_PART, LONGEST_GROWTH,
};
use crate::model::structure::Structure;
use crate::numerics::cancel::CancelToken;
use crate::simulate::run::Run;

/// Drive periods over which an exponent is measured, with those that align the perturbation.
const MEASURED: u32 = EXPONENT_PERIODS + EXPONENT_PERIODS / (ALIGNING_STEPS - 1) + 1;

impl Run<Structure> {
    /// Period and label: from the sections of the run and, where they draw together, of its
    /// continuation; of a motion that does not repeat from the growth of a small perturbation after
    /// its end.
    #[must_use]
    pub fn period(&self, cancel: &CancelToken) -> PeriodReport {
        self.settled(cancel).0.unless(cancel)
    }

    /// Period and label, and the later run that has settled on the motion, if it is not this one.
    pub(crate) fn settled(&self, cancel: &CancelToken) -> (PeriodReport, Option<Self>) {
        let (report, later) = self.judged_by_sections(cancel);
        if !self.stop_reason.reached_the_end() {
            return (report.undecided(WhyUndecided::Incomplete), None);
        }
        let (found, last) = self.followed(report, later, |r| r.convergence().is_none(), cancel);
        let told = match &last {
            Some(last) => self.told_by(last, found),
            None => found,
        };
        let measurable = told.orbit.is_none() && told.residual.is_finite();
        let told = if measurable { self.told_by_growth(told, cancel) } else { told };
        (told, last)
    }

    /// Largest Lyapunov exponent per unit time of the motion that this run has settled on, and its
    /// error: of an orbit of m drive periods from its multipliers, else from a growth measured
    /// before, if it was for long enough, or from one measured now. -inf where perturbations vanish
    /// at once, NaN where they cannot be followed.
    pub(crate) fn largest_exponent(&self, report: &PeriodReport, cancel: &CancelToken) -> [f64; 2] {
        let period = std::f64::consts::TAU / self.system.drive_frequency();
        let state = &self.final_state.state;
        if let Some((m, _)) = report.orbit
            && let Ok(m) = u32::try_from(m)
            && let Ok(orbit) = structure_orbit(&self.system, state.clone(), m, cancel)
        {
            let size = orbit.multipliers.first().map_or(0.0, |largest| largest.norm());
            // One that is lost in rounding tells nothing.
            if size > CERTAIN_MULTIPLIER * orbit.bound {
                let length = f64::from(m) * period;
                return [size.ln() / length, orbit.bound / size / length];
            }
        }
        if let Some(growth) = report.evidence.growth()
            && growth.periods >= EXPONENT_PERIODS as usize
        {
            return [growth.mean / period, growth.error / period];
        }
        match structure_lyapunov(&self.system, state.clone(), MEASURED, 1, None, cancel) {
            Ok(found) if found.error.is_none() => [found.exponents[0], found.errors[0]],
            _ => [f64::NAN; 2],
        }
    }

    /// The verdict on a motion that does not repeat.
    fn told_by_growth(&self, report: PeriodReport, cancel: &CancelToken) -> PeriodReport {
        let length = u32::try_from(self.final_state.clock.period).unwrap_or(u32::MAX);
        let (shortest, longest) = LONGEST_GROWTH;
        let most = length.saturating_mul(GROWTH_PER_RUN).clamp(shortest, longest);
        let each = self.impacts.len() as f64 / f64::from(self.kept_periods().max(1));
        let affords = |periods: u32| periods <= most && each * f64::from(periods) <= GROWTH_IMPACTS;
        let mut told = report.undecided(WhyUndecided::NotMeasurable);
        let mut periods = FIRST_GROWTH_PERIODS;
        while affords(periods) && !cancel.is_cancelled() {
            let Some(growth) = self.growth(periods, cancel) else { return told };
            let unclear =
                Evidence::Undecided { why: WhyUndecided::GrowthUnclear, growth: Some(growth) };
            told = told.decided(Kind::Unresolved, unclear);
            match growth.verdict(LONG_GROWTH_PERIODS.max(most / LONG_PART)) {
                GrowthVerdict::Grows => {
                    return told.decided(Kind::Chaotic, Evidence::GrowthExponential(growth));
                }
                GrowthVerdict::Stays => {
                    return told.decided(Kind::QuasiPeriodic, Evidence::GrowthBounded(growth));
                }
                GrowthVerdict::Unclear if growth.may_show_more(most) => {
                    periods = next_look(periods);
                }
                GrowthVerdict::Unclear | GrowthVerdict::Shrinks => return told,
            }
        }
        told
    }

    /// The growth of a small perturbation over so many drive periods after the end of the run.
    fn growth(&self, periods: u32, cancel: &CancelToken) -> Option<Growth> {
        let state = self.final_state.state.clone();
        let spectrum = structure_lyapunov(&self.system, state, periods, 1, None, cancel).ok()?;
        let period = std::f64::consts::TAU / self.system.drive_frequency();
        let (mean, error) = (spectrum.exponents[0] * period, spectrum.errors[0] * period);
        if spectrum.error.is_some() || !mean.is_finite() {
            return None;
        }
        #[allow(clippy::cast_sign_loss)] // a time is not negative
        let periods = (spectrum.time / period).round() as usize;
        Some(Growth { mean, error, periods, of_ten: error })
    }
}
