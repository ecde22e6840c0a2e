//! The label of a run of a structure.

use super::attraction::{Attraction, attraction, orbit_beside};
use super::next_look;
use crate::analysis::period::{
    Growth, GrowthVerdict, PeriodReport, WhyUndecided, comes_back, detect_nearest,
};
use crate::analysis::structure_lyapunov::{Measurement, Sections};
use crate::analysis::structure_orbit::{StructureOrbit, structure_orbit};
use crate::analysis::tolerances::{
    ALIGNING_STEPS, CERTAIN_MULTIPLIER, CONVERGENCE_PERIODS, EXPONENT_PERIODS,
    FIRST_GROWTH_PERIODS, RETURN_WINDOW,
};
use crate::model::structure::{Structure, StructureState};
use crate::numerics::cancel::CancelToken;
use crate::simulate::run::Run;

/// Drive periods over which an exponent is measured, with those that align the perturbation.
const MEASURED: u32 = EXPONENT_PERIODS + EXPONENT_PERIODS / (ALIGNING_STEPS - 1) + 1;

/// The label of a run of a structure, with what was found on the way to it.
pub(crate) struct StructureLabelling {
    pub report: PeriodReport,
    /// The state at the start of a drive period in which the motion has settled, as far as is known.
    pub settled: StructureState,
    /// The perturbation that has been followed from the end of the run, where the sections do not
    /// repeat.
    growing: Option<Box<Measurement>>,
}

/// A motion that repeats for good, and a state of it at the start of a drive period.
struct Lasting {
    report: PeriodReport,
    settled: StructureState,
}

impl Lasting {
    /// The motion settles on this orbit, which may have a part of the periods of the report.
    fn on(orbit: StructureOrbit, report: PeriodReport) -> Self {
        Self { report: report.with_period(orbit.periods), settled: orbit.state }
    }
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
        let settled = self.final_state.state.clone();
        let mut labelling = StructureLabelling { report, settled, growing: None };
        if !self.stop_reason.reached_the_end() {
            labelling.report = report.undecided(WhyUndecided::Incomplete);
            return labelling;
        }
        if let Some(settled) = self.at_drive_period(cancel) {
            labelling.settled = settled;
        }
        if let Some(found) = self.lasting(report, later, cancel) {
            labelling.take(found);
        } else if report.residual.is_finite() {
            labelling.look_at_growth(self, cancel);
        }
        labelling
    }

    /// The motion whose sections return or draw together; `None` if they only seemed to. They will
    /// return if Newton's method finds the orbit beside the motion; else they must do so when
    /// followed further. Beside an orbit that is about to exist, or along a torus on which the motion
    /// drifts slowly, sections draw together too, for as long as a long run lasts.
    fn lasting(
        &self,
        report: PeriodReport,
        later: Option<Run<Structure>>,
        cancel: &CancelToken,
    ) -> Option<Lasting> {
        report.orbit?;
        let run = later.as_ref().unwrap_or(self);
        let settled = run.at_drive_period(cancel)?;
        if report.convergence().is_none() {
            return Some(Lasting { report, settled });
        }
        let sections = run.comparable_sections();
        if let Some(orbit) = orbit_beside(&self.system, &settled, sections, &report, cancel) {
            return Some(Lasting::on(orbit, report));
        }
        let (found, last) = self.followed(report, later, |r| r.convergence().is_none(), cancel);
        let last = last?;
        found.orbit?;
        let (report, settled) = (self.told_by(&last, found), last.final_state.state.clone());
        if found.convergence().is_none() {
            return Some(Lasting { report, settled });
        }
        let sections = last.comparable_sections();
        let orbit = orbit_beside(&self.system, &settled, sections, &found, cancel)?;
        Some(Lasting::on(orbit, report))
    }

    /// The first state at the start of a drive period, from the end of the run on.
    fn at_drive_period(&self, cancel: &CancelToken) -> Option<StructureState> {
        if self.final_state.clock.time_in_period == 0.0 {
            return Some(self.final_state.state.clone());
        }
        let (_, run) = self.later(1, self.options.section_phase, cancel)?;
        Some(run.final_state.state)
    }

    /// Its sections, if they lie at the starts of drive periods, the last one at its end.
    fn comparable_sections(&self) -> &[StructureState] {
        let same = self.options.section_phase == 0.0;
        if same && self.final_state.clock.time_in_period == 0.0 { &self.stroboscopic } else { &[] }
    }

    /// A perturbation of the motion after the end, not followed yet, with the sections so far.
    fn perturbed(&self, cancel: &CancelToken) -> Option<Box<Measurement>> {
        let from = self.at_drive_period(cancel)?;
        let measurement = Measurement::new(&self.system, from, 1, None, cancel).ok()?;
        let sections = if self.comparable_sections().is_empty() {
            Sections::default()
        } else {
            let (states, counts) = self.counted_sections();
            Sections { states: states.to_vec(), counts }
        };
        Some(Box::new(measurement.keeping(sections)))
    }
}

impl StructureLabelling {
    fn take(&mut self, found: Lasting) {
        (self.report, self.settled) = (found.report, found.settled);
    }

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
            if verdict == GrowthVerdict::Grows {
                return;
            }
            let next = next_look(periods);
            let affordable = may_show_more && run.affords_growth(next);
            let goes_on = affordable && verdict == GrowthVerdict::Unclear;
            if let Some(found) = returned(growing, run, goes_on, cancel) {
                return self.take(found);
            }
            if verdict == GrowthVerdict::Shrinks {
                self.look_at_later_sections(run, cancel);
                return;
            }
            if !goes_on {
                let (sections, counts) = growing.sections();
                match attraction(&run.system, sections, counts, cancel) {
                    Attraction::Attracted(report, settled) => {
                        let report = PeriodReport {
                            evidence: report.evidence.later(i64::from(periods)),
                            ..report
                        };
                        return self.take(Lasting { report, settled });
                    }
                    Attraction::Free => return,
                    Attraction::Unclear => {
                        self.report = self.report.told_by_growth(growth, GrowthVerdict::Unclear);
                        if !affordable {
                            return;
                        }
                    }
                }
            }
            periods = next;
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
            if let Some(found) = next.lasting(report, None, cancel) {
                let report = run.told_by(&next, found.report);
                return self.take(Lasting { report, ..found });
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
        if let Some((m, _)) = self.report.orbit
            && let Ok(m) = u32::try_from(m)
            && let Ok(orbit) = structure_orbit(&run.system, self.settled.clone(), m, cancel)
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
        let begin = || Measurement::new(&run.system, self.settled.clone(), 1, None, cancel).ok();
        let growing = growing.or_else(|| begin().map(Box::new));
        let Some(mut growing) = growing else { return [f64::NAN; 2] };
        growing.extend_to(MEASURED);
        let found = growing.spectrum();
        if found.error.is_none() { [found.exponents[0], found.errors[0]] } else { [f64::NAN; 2] }
    }
}

/// The motion on which one settles that has been followed so far, from its sections: from the last
/// ones alone, if they have come back, while it goes on.
fn returned(
    growing: &Measurement,
    run: &Run<Structure>,
    goes_on: bool,
    cancel: &CancelToken,
) -> Option<Lasting> {
    let (sections, counts) = growing.sections();
    let from = if goes_on { sections.len().saturating_sub(RETURN_WINDOW) } else { 0 };
    let (sections, counts) = (&sections[from..], &counts[from..]);
    if goes_on && !comes_back(sections) {
        return None;
    }
    let report = detect_nearest(sections, counts, cancel);
    report.orbit?;
    let (_, later) = run.later(growing.followed(), run.options.section_phase, cancel)?;
    let found = later.lasting(report, None, cancel)?;
    let report = run.told_by(&later, found.report);
    Some(Lasting { report, ..found })
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
