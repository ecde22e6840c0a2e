//! The label of a run: period m-n where it returns, else what the measured growth of a small
//! perturbation says: chaotic if it grows, quasi-periodic if it does not, unresolved if neither is
//! certain.

mod attraction;
mod following;
mod sections;
mod structure;

pub(crate) use self::following::Following;
use crate::analysis::lyapunov::exponent_of_orbit;
use crate::analysis::period::{
    Evidence, Growth, GrowthVerdict, ImpactCount, Kind, PeriodReport, WhyUndecided,
};
use crate::analysis::return_map::{Beside, Orbit, orbit_beside};
use crate::analysis::tolerances::{
    EXPONENT_PERIODS, FIRST_GROWTH_PERIODS, GROWTH_STEP, RATE_RTOL, SETTLED_RESIDUAL,
};
use crate::flight::Apart;
use crate::numerics::cancel::CancelToken;
use crate::simulate::Job;
use crate::simulate::run::Run;

/// The label of a run in the making: told from its sections, or from the motion after it, which is
/// followed for as long as it takes.
pub(crate) struct Labelling {
    report: PeriodReport,
    /// A later run on which the report stands.
    later: Option<Run>,
    /// The orbit on which the motion settles, if it has been looked for and found.
    orbit: Option<Orbit>,
    /// The growth over all periods it has been followed for.
    growth: Option<Growth>,
    /// Drive periods it is followed for, and fewest before it is told.
    periods: u32,
    fewest: u32,
}

impl Labelling {
    /// The label of `run`, and the motion after it if that has to be followed; a growth is measured
    /// over `least_growth` drive periods at least.
    pub fn begin(
        run: &Run,
        least_growth: u32,
        cancel: &CancelToken,
    ) -> (Self, Option<Box<Following>>) {
        let (report, later) = run.judged_by_sections(cancel);
        let mut labelling = Self {
            report,
            later: None,
            orbit: None,
            growth: None,
            periods: FIRST_GROWTH_PERIODS,
            fewest: least_growth,
        };
        if !run.stop_reason.reached_the_end() {
            labelling.report = report.undecided(WhyUndecided::Incomplete);
        } else if !report.residual.is_finite() {
            labelling.later = later;
        } else if let Some(found) = run.lasting(report, later, cancel) {
            labelling.take(found);
        } else if let Some(apart) = run.stays_apart() {
            labelling.report = run.apart_for_ever(report, apart);
        } else {
            labelling.report = report.undecided(WhyUndecided::NotMeasurable);
            if run.affords_growth(labelling.periods) {
                let following = Following::new(run, labelling.periods, cancel);
                return (labelling, Some(Box::new(following)));
            }
        }
        (labelling, None)
    }

    /// Looks at what has been followed: tells the label, or hands back what is to be followed
    /// further.
    pub fn proceed(
        &mut self,
        run: &Run,
        mut following: Box<Following>,
        cancel: &CancelToken,
    ) -> Option<Box<Following>> {
        let growth = following.growth()?;
        self.growth = Some(growth);
        if self.report.kind == Kind::Chaotic {
            return None;
        }
        if following.has_parted()
            && let Some(later) = following.continued(run)
            && let Some(apart) = later.stays_apart()
        {
            self.report = run.told_by(&later, run.apart_for_ever(self.report, apart));
            self.later = Some(later);
            return None;
        }
        let (verdict, may_show_more) = run.verdict_on(&growth);
        self.report = self.report.told_by_growth(growth, verdict);
        if verdict == GrowthVerdict::Grows {
            // What follows counts for the exponent alone: a chaotic motion may end.
            if self.periods >= self.fewest {
                return None;
            }
            self.periods = self.fewest;
            following.extend_to(self.periods);
            return Some(following);
        }
        let next = next_look(self.periods);
        let goes_on = verdict != GrowthVerdict::Stays && may_show_more && run.affords_growth(next);
        // A motion that still converges, or has only just done so, will return.
        let report = if goes_on && verdict == GrowthVerdict::Unclear {
            following.last_return(cancel)
        } else {
            Some(following.return_report(cancel))
        };
        if let Some(report) = report.filter(|report| report.orbit.is_some())
            && let Some(later) = following.continued(run)
            && let Some(found) = later.lasting(report, None, cancel)
        {
            self.take(found);
            self.report = run.told_by(&later, self.report);
            self.later.get_or_insert(later);
            return None;
        }
        goes_on.then(|| {
            self.periods = next;
            following.extend_to(next);
            following
        })
    }

    /// The label.
    pub fn report(&self, cancel: &CancelToken) -> PeriodReport {
        self.report.unless(cancel)
    }

    /// The later run that has settled on the motion of the label, if `run` has not.
    pub fn settled(&mut self, run: &Run, cancel: &CancelToken) -> Option<Run> {
        let orbit = self.report.orbit?;
        if self.report.residual <= SETTLED_RESIDUAL {
            return self.later.take();
        }
        if let Some(orbit) = self.find_orbit(run, cancel) {
            return Some(orbit.run.clone());
        }
        let arrived = |r: &PeriodReport| r.orbit != Some(orbit) || r.residual <= SETTLED_RESIDUAL;
        let (found, later) = run.followed(self.report, self.later.take(), arrived, cancel);
        later.filter(|_| found.orbit == Some(orbit))
    }

    /// The orbit on which a motion settles that has not yet done so.
    fn find_orbit(&mut self, run: &Run, cancel: &CancelToken) -> Option<&Orbit> {
        if self.orbit.is_none() && self.report.residual > SETTLED_RESIDUAL {
            let run = self.later.as_ref().unwrap_or(run);
            self.orbit = orbit_beside(run, &self.report, cancel).orbit();
        }
        self.orbit.as_ref()
    }

    fn take(&mut self, found: Lasting) {
        (self.report, self.later, self.orbit) = (found.report, found.later, found.orbit);
    }

    /// Largest Lyapunov exponent per unit time, and its error: of a periodic motion from its
    /// Floquet multipliers, with the change from one orbit to the next as error, else from the
    /// growth that was measured, with its standard error. NaN where neither could be computed.
    pub fn exponent(&mut self, run: &Run, cancel: &CancelToken) -> [f64; 2] {
        let growth = self.growth.or(self.report.evidence.growth());
        let exponent = match (self.report.orbit, growth) {
            (Some((m, _)), _) => {
                if let Some(orbit) = self.find_orbit(run, cancel) {
                    Some(orbit.exponent)
                } else {
                    let later = self.settled(run, cancel);
                    exponent_of_orbit(later.as_ref().unwrap_or(run), m, cancel)
                }
            }
            (None, Some(growth)) => {
                let period = run.system.drive_period();
                Some([growth.mean / period, growth.error / period])
            }
            (None, None) => None,
        };
        exponent.unwrap_or([f64::NAN; 2])
    }
}

/// A motion that repeats for good.
struct Lasting {
    report: PeriodReport,
    /// The later run that shows it, if there is one.
    later: Option<Run>,
    orbit: Option<Orbit>,
}

/// The next number of drive periods after which a growth is looked at: half as many more, a whole
/// number of the steps in which it is measured.
fn next_look(periods: u32) -> u32 {
    (periods.saturating_mul(3) / 2).next_multiple_of(GROWTH_STEP)
}

impl Run {
    /// Period and label of the motion in the kept window; measures the growth of a perturbation
    /// after its end if it does not repeat. Once `cancel` has ended it, the report
    /// [is interrupted](PeriodReport::is_interrupted).
    #[must_use]
    pub fn period(&self, cancel: &CancelToken) -> PeriodReport {
        self.labelled(0, cancel).report(cancel)
    }

    /// Period and label with the largest Lyapunov exponent per unit time, and its error: of a
    /// periodic motion from its Floquet multipliers, with the change from one orbit to the next as
    /// error, else from the growth that was measured for its label, with its standard error. NaN
    /// where neither could be computed.
    #[must_use]
    pub fn period_and_exponent(&self, cancel: &CancelToken) -> (PeriodReport, [f64; 2]) {
        let mut labelling = self.labelled(EXPONENT_PERIODS, cancel);
        let exponent = labelling.exponent(self, cancel);
        (labelling.report(cancel), exponent)
    }

    /// The verdict, and where the motion still had to settle for it, the later run that has.
    #[must_use]
    pub fn on_attractor(&self, cancel: &CancelToken) -> (PeriodReport, Option<Run>) {
        let mut labelling = self.labelled(0, cancel);
        let later = labelling.settled(self, cancel);
        (labelling.report(cancel), later)
    }

    pub(crate) fn labelled(&self, least_growth: u32, cancel: &CancelToken) -> Labelling {
        let (mut labelling, mut following) = Labelling::begin(self, least_growth, cancel);
        while let Some(mut further) = following {
            further.finish();
            following = labelling.proceed(self, further, cancel);
        }
        labelling
    }

    /// The period of a motion whose sections return or draw together, and the run that shows it;
    /// `None` if they only seemed to. They will return if Newton's method finds the orbit beside the
    /// motion. Where it has no start, perturbations of the motion must shrink as fast as the sections
    /// draw together. Where it leads elsewhere, that is not enough: beside an orbit that is about to
    /// exist, or does no more, sections draw together too, and a motion passes by. Such sections
    /// must return when followed further.
    fn lasting(
        &self,
        report: PeriodReport,
        later: Option<Run>,
        cancel: &CancelToken,
    ) -> Option<Lasting> {
        let run = later.as_ref().unwrap_or(self);
        let Some(rate) = report.convergence() else {
            return report.orbit.is_some().then_some(Lasting { report, later, orbit: None });
        };
        match orbit_beside(run, &report, cancel) {
            Beside::Orbit(orbit) => {
                let report = report.with_period(orbit.periods);
                return Some(Lasting { report, later, orbit: Some(*orbit) });
            }
            Beside::NoStart if run.contracts_like(&report, rate, cancel) => {
                return Some(Lasting { report, later, orbit: None });
            }
            Beside::NoStart | Beside::Nothing => {}
        }
        let (found, last) = self.followed(report, None, |r| r.convergence().is_none(), cancel);
        let run = last.as_ref().unwrap_or(self);
        found.orbit?;
        if found.convergence().is_some_and(|rate| !run.contracts_like(&found, rate, cancel)) {
            return None;
        }
        let report = match &last {
            Some(last) if found.orbit != report.orbit => self.told_by(last, found),
            _ => report,
        };
        Some(Lasting { report, later: last, orbit: None })
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

    /// The report on bodies that never meet again.
    fn apart_for_ever(&self, report: PeriodReport, apart: Apart) -> PeriodReport {
        match apart {
            Apart::Swings => report
                .unresolved()
                .decided(Kind::QuasiPeriodic, Evidence::GrowthBounded(Growth::NONE)),
            Apart::Settles(decay) => {
                let rate = (-decay * self.system.drive_period()).exp();
                PeriodReport { orbit: Some((1, ImpactCount::Finite(0))), ..report }.decided(
                    Kind::Periodic,
                    Evidence::Converging { rate, further: 0, from_orbit: false },
                )
            }
        }
    }
}
