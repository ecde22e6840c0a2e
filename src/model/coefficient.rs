//! Which coefficient of restitution an impact has: a number, or that of a curve at the approach
//! velocity u. The one place that knows it.

#![allow(clippy::inline_always)] // a flight with its impact is compiled for several instruction sets

use crate::model::error::ParameterError;
use crate::model::parameters::System;
use crate::model::restitution::{RestitutionAt, RestitutionCurve};

/// A coefficient of restitution: a number, or a curve, of whose lowest impacts it is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Coefficient<'a> {
    pub number: f64,
    pub curve: Option<&'a RestitutionCurve>,
}

impl Coefficient<'_> {
    /// r of an impact at the approach velocity u.
    #[inline(always)]
    pub fn at(&self, u: f64) -> f64 {
        match self.curve {
            None => self.number,
            Some(curve) => curve.at(u),
        }
    }

    /// r of an impact at u and its derivative.
    #[inline(always)]
    pub fn with_slope(&self, u: f64) -> RestitutionAt {
        match self.curve {
            None => RestitutionAt { value: self.number, by_speed: 0.0 },
            Some(curve) => curve.with_slope(u),
        }
    }

    /// The ratio by which bounces shrink that follow one at u, without friction or in slip; NaN where
    /// r changes between them.
    #[inline(always)]
    pub fn below(&self, u: f64) -> f64 {
        match self.curve {
            None => self.number,
            Some(curve) => curve.below(u),
        }
    }

    /// Which of its smooth pieces u is on.
    pub fn piece(&self, u: f64) -> usize {
        self.curve.map_or(0, |curve| curve.piece(u))
    }

    /// Whether dr/du jumps at u, to rounding.
    pub fn is_at_knot(&self, u: f64) -> bool {
        self.curve.is_some_and(|curve| curve.is_at_knot(u))
    }

    /// The derivative of r at u by one of the numbers of its curve.
    pub fn by_number(&self, u: f64, place: usize) -> f64 {
        self.curve.map_or(0.0, |curve| curve.by_number(u, place))
    }

    /// Which of the numbers of its curve has this name.
    pub fn place_of(&self, name: &str) -> Option<usize> {
        self.curve?.place_of(name)
    }
}

impl System {
    /// The coefficient of restitution where it depends on the approach velocity; then
    /// [`System::restitution`] is that of the lowest impacts.
    #[must_use]
    pub fn restitution_curve(&self) -> Option<&RestitutionCurve> {
        self.restitution_curve.as_deref()
    }

    /// Its coefficient of restitution.
    #[inline(always)]
    pub(crate) fn coefficient(&self) -> Coefficient<'_> {
        Coefficient { number: self.restitution, curve: self.restitution_curve.as_deref() }
    }

    /// r of an impact at the approach velocity u.
    #[inline(always)]
    #[must_use]
    pub fn restitution_at(&self, u: f64) -> f64 {
        self.coefficient().at(u)
    }

    /// The names of its numbers: the numeric parameters, those of the restitution curve in place of
    /// `restitution`.
    fn numbers(&self) -> Vec<&'static str> {
        let Some(curve) = self.restitution_curve() else { return Self::NUMERIC.to_vec() };
        let others = Self::NUMERIC.iter().filter(|&&name| name != "restitution");
        others.copied().chain(curve.names()).collect()
    }

    /// The refusal of a name that none of its numbers has.
    pub(crate) fn unknown(&self, name: &str) -> ParameterError {
        ParameterError::new("parameter", name, format!("one of {}", self.numbers().join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use crate::model::parameters::System;

    #[test]
    fn a_system_holds_no_table() {
        assert!(size_of::<System>() <= 128, "{}", size_of::<System>());
    }
}
