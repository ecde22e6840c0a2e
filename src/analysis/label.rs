//! The label of a run: period m-n where it returns, else what the measured growth of a small
//! perturbation says: chaotic if it grows, quasi-periodic if it does not, unresolved if neither is
//! certain.

use crate::analysis::tolerances::{
    AT_SECTION, GROWTH_IMPACTS, GROWTH_PERIODS, NO_GROWTH_PERIODS, RATE_RTOL, SETTLED_RESIDUAL,
};
use std::f64::consts::{FRAC_PI_2, TAU};

use crate::analysis::lyapunov::{GrowthEstimator, exponent_of_orbit};
use crate::analysis::period::{Evidence, Growth, Kind, PeriodReport, WhyUndecided};
use crate::numerics::cancel::CancelToken;
use crate::simulate::Horizon;
use crate::simulate::run::{Run, RunOptions};

impl Run {
    /// Period and label of the motion in the kept window; measures the growth of a perturbation
    /// after its end if it does not repeat. Once `cancel` has ended it, the report
    /// [is interrupted](PeriodReport::is_interrupted).
    #[must_use]
    pub fn period(&self, cancel: &CancelToken) -> PeriodReport {
        self.judged(cancel).0.unless(cancel)
    }

    /// Period and label with the largest Lyapunov exponent per unit time, and its error: of a
    /// periodic motion from its Floquet multipliers, with the change from one orbit to the next as
    /// error, else from the growth that was measured for its label, with its standard error. NaN
    /// where neither could be computed.
    #[must_use]
    pub fn period_and_exponent(&self, cancel: &CancelToken) -> (PeriodReport, [f64; 2]) {
        let (report, later) = self.on_attractor(cancel);
        let settled = later.as_ref().unwrap_or(self);
        let per_time = |growth: Growth| {
            let period = self.system.drive_period();
            [growth.mean / period, growth.error / period]
        };
        let exponent = match (report.orbit, report.evidence.growth()) {
            (Some((m, _)), _) => exponent_of_orbit(settled, m, cancel).or_else(|| {
                // Its end lies among skipped impacts.
                GrowthEstimator::new(settled, cancel).over(GROWTH_PERIODS.0).map(per_time)
            }),
            (None, Some(growth)) => Some(per_time(growth)),
            (None, None) => None,
        };
        (report.unless(cancel), exponent.unwrap_or([f64::NAN; 2]))
    }

    /// The verdict, and where the motion still had to settle for it, the later run that has.
    #[must_use]
    pub fn on_attractor(&self, cancel: &CancelToken) -> (PeriodReport, Option<Run>) {
        let (report, later) = self.judged(cancel);
        let later = self.settled(&report, later, cancel);
        (report.unless(cancel), later)
    }

    /// Follows a motion that still approaches its orbit until it has come close, or for as long as
    /// a growth is measured.
    fn settled(
        &self,
        report: &PeriodReport,
        later: Option<Run>,
        cancel: &CancelToken,
    ) -> Option<Run> {
        let orbit = report.orbit;
        let arrived = |r: &PeriodReport| r.orbit != orbit || r.residual <= SETTLED_RESIDUAL;
        let (found, later) = self.followed(*report, later, arrived, cancel);
        later.filter(|_| found.orbit == orbit)
    }

    /// Follows a motion that repeats or converges by further and further periods until `arrived`,
    /// or for as long as a growth is measured.
    fn followed(
        &self,
        mut report: PeriodReport,
        mut later: Option<Run>,
        arrived: impl Fn(&PeriodReport) -> bool,
        cancel: &CancelToken,
    ) -> (PeriodReport, Option<Run>) {
        let (shortest, longest) = GROWTH_PERIODS;
        // A shorter window might not show a slow spiral that this one shows.
        let mut periods = shortest.max(later.as_ref().unwrap_or(self).kept_periods());
        while report.orbit.is_some() && !arrived(&report) && periods <= longest {
            let run = later.as_ref().unwrap_or(self);
            let Some(next) = run.later(periods, run.options.section_phase, cancel) else { break };
            (report, later) = (next.0, Some(next.1));
            periods *= 2;
        }
        (report, later)
    }

    /// The verdict, and the run on which it stands if that is a later one.
    fn judged(&self, cancel: &CancelToken) -> (PeriodReport, Option<Run>) {
        let (report, later) = self.judged_by_sections(cancel);
        if !self.stop_reason.reached_the_end() {
            let evidence = Evidence::undecided(WhyUndecided::Incomplete);
            return (PeriodReport { evidence, ..report.unresolved() }, None);
        }
        if !report.residual.is_finite() {
            return (report, later);
        }
        self.lasting(report, later, cancel)
            .unwrap_or_else(|| self.judged_by_growth(report.unresolved(), cancel))
    }

    /// The period of a motion whose sections return or draw together, and the run that shows it;
    /// `None` if they only seemed to. They will return if perturbations of the motion shrink as
    /// fast as they draw together, else if they do so when followed further.
    fn lasting(
        &self,
        report: PeriodReport,
        later: Option<Run>,
        cancel: &CancelToken,
    ) -> Option<(PeriodReport, Option<Run>)> {
        let run = later.as_ref().unwrap_or(self);
        let Some(rate) = report.convergence() else {
            return report.orbit.is_some().then_some((report, later));
        };
        if run.contracts_like(&report, rate, cancel) {
            return Some((report, later));
        }
        let (found, last) = self.followed(report, None, |r| r.convergence().is_none(), cancel);
        let run = last.as_ref().unwrap_or(self);
        if found.orbit.is_none()
            || found.convergence().is_some() && run.contraction(&found, cancel).is_none()
        {
            return None;
        }
        if found.orbit == report.orbit {
            return Some((report, last));
        }
        Some((last.as_ref().map_or(found, |last| self.told_by(last, found)), last))
    }

    /// ln|lambda| per drive period of the last orbit, if perturbations shrink along it.
    fn contraction(&self, report: &PeriodReport, cancel: &CancelToken) -> Option<f64> {
        let [exponent, _] = exponent_of_orbit(self, report.orbit?.0, cancel)?;
        Some(exponent * self.system.drive_period()).filter(|&log| log < 0.0)
    }

    /// Whether perturbations shrink as fast as the sections draw together.
    fn contracts_like(&self, report: &PeriodReport, rate: f64, cancel: &CancelToken) -> bool {
        self.contraction(report, cancel)
            .is_some_and(|log| log.is_finite() && (rate.ln() - log).abs() <= RATE_RTOL * log.abs())
    }

    /// The period from the sections alone. Where an impact falls on the section, rounding puts it
    /// before or after, and the sections of a further stretch elsewhere tell more.
    #[must_use]
    pub fn section_report(&self, cancel: &CancelToken) -> PeriodReport {
        self.judged_by_sections(cancel).0.unless(cancel)
    }

    fn judged_by_sections(&self, cancel: &CancelToken) -> (PeriodReport, Option<Run>) {
        let report = self.return_report(cancel);
        let simple = report.orbit.is_some_and(|(m, _)| m == 1);
        let section = self.options.section_phase / self.system.drive_frequency();
        if simple || !self.stop_reason.reached_the_end() || !self.strikes_at(section) {
            return (report, None);
        }
        let elsewhere = (self.options.section_phase + FRAC_PI_2).rem_euclid(TAU);
        match self.later(self.kept_periods(), elsewhere, cancel) {
            Some((moved, later)) if moved.orbit.is_some() => {
                (self.told_by(&later, moved), Some(later))
            }
            _ => (report, None),
        }
    }

    /// Whether a kept impact falls on this time in the drive period, to rounding.
    pub(crate) fn strikes_at(&self, time: f64) -> bool {
        let period = self.system.drive_period();
        self.impacts.iter().any(|impact| {
            let after = (impact.time_in_period - time).rem_euclid(period);
            after.min(period - after) < AT_SECTION * period
        })
    }

    /// Decides a motion that does not repeat by the growth of a perturbation of it.
    fn judged_by_growth(
        &self,
        mut report: PeriodReport,
        cancel: &CancelToken,
    ) -> (PeriodReport, Option<Run>) {
        report.evidence = Evidence::undecided(WhyUndecided::NotMeasurable);
        let (mut periods, longest) = GROWTH_PERIODS;
        let mut meter = GrowthEstimator::new(self, cancel);
        let each = self.impacts.len() as f64 / f64::from(self.kept_periods().max(1));
        while periods <= longest && each * f64::from(periods) <= GROWTH_IMPACTS {
            let Some(growth) = meter.over(periods) else { break };
            report.evidence =
                Evidence::Undecided { why: WhyUndecided::GrowthUnclear, growth: Some(growth) };
            let total = growth.mean * f64::from(periods);
            // By shear, perturbations grow like the time: growth by ln(periods) is no sign of
            // chaos.
            let shear = f64::from(periods).ln();
            if total > shear + 4.0 && growth.mean > 4.0 * growth.error {
                report.kind = Kind::Chaotic;
                report.evidence = Evidence::GrowthExponential(growth);
                return (report, None);
            }
            let shrinks = total < -(shear + 4.0) && growth.mean < -4.0 * growth.error;
            // Even with two standard errors more it would be no more than shear.
            let stays = periods >= NO_GROWTH_PERIODS
                && total + 2.0 * growth.error * f64::from(periods) < shear + 1.0;
            if shrinks || stays {
                // The motion still converges, or has only just done so: it will return.
                let later = self.later(periods, self.options.section_phase, cancel);
                if let Some((found, later)) = later.and_then(|(r, later)| {
                    later
                        .lasting(r, None, cancel)
                        .map(|(found, last)| (self.told_by(&later, found), last.unwrap_or(later)))
                }) {
                    return (found, Some(later));
                }
            }
            if stays && !shrinks {
                report.kind = Kind::QuasiPeriodic;
                report.evidence = Evidence::GrowthBounded(growth);
                return (report, None);
            }
            periods *= 2;
        }
        (report, None)
    }

    /// The report of a later run, as evidence for this one.
    fn told_by(&self, later: &Run, report: PeriodReport) -> PeriodReport {
        let by = later.final_state.clock.period - self.final_state.clock.period;
        PeriodReport { evidence: report.evidence.later(by), ..report }
    }

    fn kept_periods(&self) -> u32 {
        u32::try_from(self.stroboscopic.len()).unwrap_or(u32::MAX)
    }

    /// The report of the sections of so many further drive periods.
    fn later(
        &self,
        periods: u32,
        section_phase: f64,
        cancel: &CancelToken,
    ) -> Option<(PeriodReport, Run)> {
        let end = self.final_state.clock.period + i64::from(periods);
        let options = RunOptions {
            horizon: Horizon::Periods(end),
            keep: Some(i64::from(periods)),
            max_events: self.options.max_events.saturating_mul(2),
            section_phase,
            ..self.options
        };
        let run = self.resume(options, cancel).ok()?;
        run.stop_reason.reached_the_end().then(|| (run.return_report(cancel), run))
    }
}
