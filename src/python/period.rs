//! `_core.PeriodReport`.

use pyo3::prelude::*;

use super::cancel::interruptible;
use super::enums::Member;
use crate::analysis::period::{EvidenceKind, ImpactCount, Kind, PeriodReport, WhyUndecided};
use crate::model::error::ParameterError;
use crate::numerics::cancel::CancelToken;

/// The label of a motion from its kept stroboscopic states, with the evidence.
#[pyclass(name = "PeriodReport", module = "vibroimpact._core", frozen)]
pub(super) struct PyPeriodReport(pub(super) PeriodReport);

impl PyPeriodReport {
    /// As it is found, until Ctrl-C.
    pub(super) fn of(
        py: Python<'_>,
        found: impl FnOnce(&CancelToken) -> PeriodReport + Send,
    ) -> PyResult<Self> {
        let (report, _) = interruptible::<_, ParameterError>(py, None, |cancel| Ok(found(cancel)))?;
        Ok(Self(report))
    }
}

/// m and n of a label as tables of integers have them: m = 0 where there is no period, n = -1 with
/// complete chatter.
pub(super) fn orbit_numbers(period: Option<PeriodReport>) -> [i64; 2] {
    match period.and_then(|report| report.orbit) {
        Some((m, ImpactCount::Finite(n))) => [m as i64, n as i64],
        Some((m, ImpactCount::Infinite)) => [m as i64, -1],
        None => [0, 0],
    }
}

/// The place of a kind of motion in `MOTION_NAMES`.
pub(super) fn motion_number(period: Option<PeriodReport>) -> i8 {
    period.map_or(Kind::Unresolved, |report| report.kind) as i8
}

/// The largest difference of sections m periods apart.
pub(super) fn residual(period: Option<PeriodReport>) -> f64 {
    period.map_or(f64::NAN, |report| report.residual)
}

#[pymethods]
impl PyPeriodReport {
    #[getter]
    fn m(&self) -> Option<usize> {
        self.0.orbit.map(|(m, _)| m)
    }
    #[getter]
    fn n(&self) -> Option<f64> {
        self.0.orbit.map(|(_, n)| match n {
            ImpactCount::Finite(n) => n as f64,
            ImpactCount::Infinite => f64::INFINITY,
        })
    }
    #[getter]
    fn residual(&self) -> f64 {
        self.0.residual
    }
    #[getter]
    fn kind(&self) -> Member<EvidenceKind> {
        Member(self.0.evidence.kind())
    }
    #[getter]
    fn further(&self) -> i64 {
        self.0.evidence.further()
    }
    #[getter]
    fn rate(&self) -> Option<f64> {
        self.0.evidence.rate()
    }
    #[getter]
    fn growth(&self) -> Option<f64> {
        self.0.evidence.growth().map(|growth| growth.mean)
    }
    #[getter]
    fn growth_error(&self) -> Option<f64> {
        self.0.evidence.growth().map(|growth| growth.error)
    }
    #[getter]
    fn growth_periods(&self) -> Option<usize> {
        self.0.evidence.growth().map(|growth| growth.periods)
    }
    #[getter]
    fn why(&self) -> Option<Member<WhyUndecided>> {
        self.0.evidence.why().map(Member)
    }
    /// The evidence in words.
    #[getter]
    fn text(&self) -> String {
        self.0.evidence.to_string()
    }
    /// Whether Ctrl-C ended it.
    #[getter]
    fn interrupted(&self) -> bool {
        self.0.is_interrupted()
    }
    #[getter]
    fn label(&self) -> String {
        self.0.label()
    }
    fn __repr__(&self) -> String {
        format!("PeriodReport(label={:?}, residual={:e})", self.0.label(), self.0.residual)
    }
}
