//! The label of a run of a structure.

use super::next_look;
use crate::analysis::period::{Growth, GrowthVerdict, PeriodReport, WhyUndecided};
use crate::analysis::structure_lyapunov::Measurement;
use crate::analysis::structure_orbit::structure_orbit;
use crate::analysis::tolerances::{
    ALIGNING_STEPS, CERTAIN_MULTIPLIER, CONVERGENCE_PERIODS, EXPONENT_PERIODS, FIRST_GROWTH_PERIODS,
};
use crate::model::structure::Structure;
use crate::numerics::cancel::CancelToken;
use crate::simulate::run::Run;

/// Drive periods over which an exponent is measured, with those that align the perturbation.
const MEASURED: u32 = EXPONENT_PERIODS + EXPONENT_PERIODS / (ALIGNING_STEPS - 1) + 1;

/// The label of a run of a structure, with what was found on the way to it.
pub(crate) struct StructureLabelling {
    pub report: PeriodReport,
    /// The later run that has settled on the motion, if it is not the run itself.
    pub later: Option<Run<Structure>>,
    /// The perturbation that has been followed from the end of the run, where the sections do not
    /// repeat.
    growing: Option<Box<Measurement>>,
}

impl Run<Structure> {
    /// Period and label: from the sections of the run and, where they draw together, of its
    /// continuation; of a motion that does not repeat from the growth of a small perturbation after
    /// its end.
    #[must_use]
    pub fn period(&self, cancel: &CancelToken) -> PeriodReport {
        self.labelled(cancel).report.unless(cancel)
    }

    pub(crate) fn labelled(&self, cancel: &CancelToken) -> StructureLabelling {
        let (report, later) = self.judged_by_sections(cancel);
        if !self.stop_reason.reached_the_end() {
            let report = report.undecided(WhyUndecided::Incomplete);
            return StructureLabelling { report, later: None, growing: None };
        }
        let (found, later) = self.followed(report, later, |r| r.convergence().is_none(), cancel);
        let report = match &later {
            Some(later) => self.told_by(later, found),
            None => found,
        };
        let mut labelling = StructureLabelling { report, later, growing: None };
        if report.orbit.is_none() && report.residual.is_finite() {
            labelling.look_at_growth(self, cancel);
        }
        labelling
    }

    /// A perturbation of the motion after the end, not followed yet.
    fn perturbed(&self, cancel: &CancelToken) -> Option<Box<Measurement>> {
        let state = self.final_state.state.clone();
        Measurement::new(&self.system, state, 1, None, cancel).ok().map(Box::new)
    }
}

impl StructureLabelling {
    /// The verdict on a motion that does not repeat. The perturbation goes on from look to look.
    fn look_at_growth(&mut self, run: &Run<Structure>, cancel: &CancelToken) {
        self.report = self.report.undecided(WhyUndecided::NotMeasurable);
        let mut periods = FIRST_GROWTH_PERIODS;
        while run.affords_growth(periods) && !cancel.is_cancelled() {
            if self.growing.is_none() {
                self.growing = run.perturbed(cancel);
            }
            let Some(growing) = &mut self.growing else { return };
            growing.extend_to(periods);
            let Some(growth) = growth_of(growing, run) else { return };
            let (verdict, may_show_more) = run.verdict_on(&growth);
            self.report = self.report.told_by_growth(growth, verdict);
            if verdict == GrowthVerdict::Shrinks {
                self.look_at_later_sections(run, cancel);
            }
            if verdict != GrowthVerdict::Unclear || !may_show_more {
                return;
            }
            periods = next_look(periods);
        }
    }

    /// The orbit that a motion approaches whose perturbations shrink, from the sections after the
    /// run: in those of the run itself it may still have been far away.
    fn look_at_later_sections(&mut self, run: &Run<Structure>, cancel: &CancelToken) {
        let (mut periods, longest) = CONVERGENCE_PERIODS;
        let mut later = None;
        while periods <= longest {
            let from = later.as_ref().unwrap_or(run);
            let next = from.later(periods, from.options.section_phase, cancel);
            let Some((report, next)) = next else { return };
            if report.orbit.is_some() {
                let converged = |r: &PeriodReport| r.convergence().is_none();
                let (found, at) = run.followed(report, Some(next), converged, cancel);
                if let Some(at) = at.filter(|_| found.orbit.is_some()) {
                    self.report = run.told_by(&at, found);
                    self.later = Some(at);
                }
                return;
            }
            later = Some(next);
            periods *= 2;
        }
    }

    /// Largest Lyapunov exponent per unit time of the motion that the run has settled on, and its
    /// error: of an orbit of m drive periods from its multipliers, else from the growth that the
    /// label stands on, followed for longer where that was short. -inf where perturbations vanish at
    /// once, NaN where they cannot be followed.
    pub fn exponent(&mut self, run: &Run<Structure>, cancel: &CancelToken) -> [f64; 2] {
        let period = std::f64::consts::TAU / run.system.drive_frequency();
        let settled = self.later.as_ref().unwrap_or(run);
        if let Some((m, _)) = self.report.orbit
            && let Ok(m) = u32::try_from(m)
            && let Ok(orbit) =
                structure_orbit(&run.system, settled.final_state.state.clone(), m, cancel)
        {
            let size = orbit.multipliers.first().map_or(0.0, |largest| largest.norm());
            // One that is lost in rounding tells nothing.
            if size > CERTAIN_MULTIPLIER * orbit.bound {
                let length = f64::from(m) * period;
                return [size.ln() / length, orbit.bound / size / length];
            }
        }
        if let Some(growth) = self.report.evidence.growth()
            && growth.periods >= EXPONENT_PERIODS as usize
        {
            return [growth.mean / period, growth.error / period];
        }
        let growing = self.growing.take().filter(|growing| !growing.has_ended());
        let growing = growing.or_else(|| settled.perturbed(cancel));
        let Some(mut growing) = growing else { return [f64::NAN; 2] };
        growing.extend_to(MEASURED);
        let found = growing.spectrum();
        if found.error.is_none() { [found.exponents[0], found.errors[0]] } else { [f64::NAN; 2] }
    }
}

/// The growth so far; `None` where it could not be followed.
fn growth_of(growing: &Measurement, run: &Run<Structure>) -> Option<Growth> {
    let spectrum = growing.spectrum();
    let period = std::f64::consts::TAU / run.system.drive_frequency();
    let (mean, error) = (spectrum.exponents[0] * period, spectrum.errors[0] * period);
    if spectrum.error.is_some() || !mean.is_finite() {
        return None;
    }
    #[allow(clippy::cast_sign_loss)] // a time is not negative
    let periods = (spectrum.time / period).round() as usize;
    Some(Growth { mean, error, periods, of_ten: error })
}
