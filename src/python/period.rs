//! `_core.PeriodReport`.

use pyo3::prelude::*;

use super::cancel::interruptible;
use super::enums::Member;
use crate::analysis::period::{EvidenceKind, ImpactCount, PeriodReport, WhyUndecided};
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
