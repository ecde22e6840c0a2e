//! What the sections of a run, and of its continuation, tell of its motion.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::analysis::period::{Growth, GrowthVerdict, PeriodReport};
use crate::analysis::tolerances::{
    AT_SECTION, CONVERGENCE_PERIODS, GROWTH_IMPACTS, GROWTH_PER_RUN, LONG_GROWTH_PERIODS,
    LONG_PART, LONGEST_GROWTH,
};
use crate::numerics::cancel::CancelToken;
use crate::simulate::Horizon;
use crate::simulate::run::{Recorded, Row, Run, RunOptions};

impl<M: Recorded> Run<M> {
    /// The period from the sections alone. Where an impact falls on the section, rounding puts it
    /// before or after, and the sections of a further stretch elsewhere tell more.
    #[must_use]
    pub fn section_report(&self, cancel: &CancelToken) -> PeriodReport {
        self.judged_by_sections(cancel).0.unless(cancel)
    }

    pub(super) fn judged_by_sections(
        &self,
        cancel: &CancelToken,
    ) -> (PeriodReport, Option<Run<M>>) {
        let report = self.return_report(cancel);
        let simple = report.orbit.is_some_and(|(m, _)| m == 1);
        let section = self.options.section_phase / self.system.own_drive().omega;
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
        let period = self.system.own_drive().period.hi;
        self.impacts.iter().any(|impact| {
            let after = (impact.time_in_period() - time).rem_euclid(period);
            after.min(period - after) < AT_SECTION * period
        })
    }

    /// Follows a motion that repeats or converges by further and further periods until `arrived`,
    /// or for as long as a growth is measured.
    pub(super) fn followed(
        &self,
        mut report: PeriodReport,
        mut later: Option<Run<M>>,
        arrived: impl Fn(&PeriodReport) -> bool,
        cancel: &CancelToken,
    ) -> (PeriodReport, Option<Run<M>>) {
        let (shortest, longest) = CONVERGENCE_PERIODS;
        // A shorter window might not show a slow spiral that this one shows.
        let mut periods = shortest.max(later.as_ref().unwrap_or(self).kept_periods());
        let longest = longest.max(periods);
        while report.orbit.is_some() && !arrived(&report) && periods <= longest {
            let run = later.as_ref().unwrap_or(self);
            let Some(next) = run.later(periods, run.options.section_phase, cancel) else { break };
            (report, later) = (next.0, Some(next.1));
            periods *= 2;
        }
        (report, later)
    }

    /// The report of a later run, as evidence for this one.
    pub(super) fn told_by(&self, later: &Run<M>, report: PeriodReport) -> PeriodReport {
        let by = later.final_state.clock.period - self.final_state.clock.period;
        PeriodReport { evidence: report.evidence.later(by), ..report }
    }

    /// Most drive periods over which a growth is measured.
    fn longest_growth(&self) -> u32 {
        let length = u32::try_from(self.final_state.clock.period).unwrap_or(u32::MAX);
        let (shortest, longest) = LONGEST_GROWTH;
        length.saturating_mul(GROWTH_PER_RUN).clamp(shortest, longest)
    }

    /// Whether a growth may be measured over so many periods: they have few enough impacts.
    pub(super) fn affords_growth(&self, periods: u32) -> bool {
        let each = self.impacts.len() as f64 / f64::from(self.kept_periods().max(1));
        periods <= self.longest_growth() && each * f64::from(periods) <= GROWTH_IMPACTS
    }

    /// What a growth says, and whether a longer one may say more.
    pub(super) fn verdict_on(&self, growth: &Growth) -> (GrowthVerdict, bool) {
        let most = self.longest_growth();
        let verdict = growth.verdict(LONG_GROWTH_PERIODS.max(most / LONG_PART));
        (verdict, growth.may_show_more(most))
    }

    pub(super) fn kept_periods(&self) -> u32 {
        u32::try_from(self.stroboscopic.len()).unwrap_or(u32::MAX)
    }

    /// The report of the sections of so many further drive periods.
    pub(super) fn later(
        &self,
        periods: u32,
        section_phase: f64,
        cancel: &CancelToken,
    ) -> Option<(PeriodReport, Run<M>)> {
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
