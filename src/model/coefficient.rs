//! Which coefficient of restitution an impact of a system has: its number, or that of its curve at the
//! approach velocity u. The one place that knows it.

#![allow(clippy::inline_always)] // a flight with its impact is compiled for several instruction sets

use crate::model::error::ParameterError;
use crate::model::parameters::System;
use crate::model::restitution::{RestitutionAt, RestitutionCurve};

impl System {
    /// The coefficient of restitution where it depends on the approach velocity; then
    /// [`System::restitution`] is that of the lowest impacts.
    #[must_use]
    pub fn restitution_curve(&self) -> Option<&RestitutionCurve> {
        self.restitution_curve.as_ref()
    }

    /// The names of its numbers: the numeric parameters, those of the restitution curve in place of
    /// `restitution`.
    fn numbers(&self) -> Vec<&'static str> {
        let Some(curve) = &self.restitution_curve else { return Self::NUMERIC.to_vec() };
        let others = Self::NUMERIC.iter().filter(|&&name| name != "restitution");
        others.chain(curve.names()).copied().collect()
    }

    /// The refusal of a name that none of its numbers has.
    pub(crate) fn unknown(&self, name: &str) -> ParameterError {
        ParameterError::new("parameter", name, format!("one of {}", self.numbers().join(", ")))
    }

    /// r of an impact at the approach velocity u.
    #[inline(always)]
    #[must_use]
    pub fn restitution_at(&self, u: f64) -> f64 {
        match &self.restitution_curve {
            None => self.restitution,
            Some(curve) => curve.at(u),
        }
    }

    /// r of an impact at u and its derivative.
    #[inline(always)]
    pub(crate) fn restitution_with_slope(&self, u: f64) -> RestitutionAt {
        match &self.restitution_curve {
            None => RestitutionAt { value: self.restitution, by_speed: 0.0 },
            Some(curve) => curve.with_slope(u),
        }
    }

    /// The ratio by which bounces shrink that follow one at u, without friction or in slip; NaN where
    /// r changes between them.
    #[inline(always)]
    pub(crate) fn restitution_below(&self, u: f64) -> f64 {
        match &self.restitution_curve {
            Some(curve) if u > curve.constant_to() => f64::NAN,
            _ => self.restitution,
        }
    }
}
