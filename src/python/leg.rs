//! `_core.Leg` and `_core.Condition`: the legs of a motion, and their conditions.

// PyO3 calls methods by reference.
#![allow(clippy::trivially_copy_pass_by_ref)]

use pyo3::prelude::*;
use pyo3::types::PyType;

use super::enums::{LegEnd, LegKind, Member};
use crate::impact::RegimeKind;
use crate::model::error::ParameterError;
use crate::tangent::border::{Border, BorderKind, Condition};
use crate::tangent::itinerary::{Leg, Sign, Signs, StickEnd};

/// One leg of a motion with the event at its end.
#[pyclass(name = "Leg", module = "vibroimpact._core", frozen, eq, hash, from_py_object)]
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct PyLeg(pub Leg);

fn sign(name: &'static str, value: i64) -> Result<Sign, ParameterError> {
    match value {
        1 => Ok(Sign::Positive),
        -1 => Ok(Sign::Negative),
        other => Err(ParameterError::new(name, other, "1 or -1")),
    }
}

fn of_positive(positive: bool) -> Sign {
    if positive { Sign::Positive } else { Sign::Negative }
}

#[pymethods]
impl PyLeg {
    #[classattr]
    const CHATTER: Self = Self(Leg::Chatter);
    #[classattr]
    const CIRCUIT: Self = Self(Leg::Circuit);

    /// A flight to an impact of this regime; with friction the signs of x1' and of sin x1 there.
    #[staticmethod]
    #[pyo3(signature = (regime, direction = 0, side = 0))]
    fn impact(regime: Member<RegimeKind>, direction: i64, side: i64) -> PyResult<Self> {
        let kind = regime.0;
        if kind != RegimeKind::Frictionless {
            let signs =
                Signs { direction: sign("direction", direction)?, side: sign("side", side)? };
            return Ok(Self(Leg::Impact(kind, signs)));
        }
        if (direction, side) != (0, 0) {
            return Err(ParameterError::new("direction", direction, "0 without friction").into());
        }
        Ok(Self(Leg::Impact(kind, Signs::NONE)))
    }

    /// A slide with this sign of x1' to a release or a stop.
    #[staticmethod]
    fn slide(direction: i64, end: Member<LegEnd>) -> PyResult<Self> {
        let positive = sign("direction", direction)? == Sign::Positive;
        match end.0 {
            LegEnd::Release => Ok(Self(Leg::SlideToRelease(positive))),
            LegEnd::Stop => Ok(Self(Leg::SlideToStop(positive))),
            _ => Err(ParameterError::new("end", "a slide", "release or stop").into()),
        }
    }

    /// A stick to a release or to slip.
    #[staticmethod]
    fn stick(end: Member<LegEnd>) -> PyResult<Self> {
        Ok(Self(Leg::Stick(match end.0 {
            LegEnd::Release => StickEnd::Release,
            LegEnd::SlidePositive => StickEnd::SlipPositive,
            LegEnd::SlideNegative => StickEnd::SlipNegative,
            LegEnd::Stop => {
                return Err(ParameterError::new("end", "stop", "release or a slide").into());
            }
        })))
    }

    /// The leg of this text, from a file.
    #[classmethod]
    fn from_text(_class: &Bound<'_, PyType>, text: &str) -> PyResult<Self> {
        Ok(Self(text.parse()?))
    }

    #[getter]
    fn kind(&self) -> Member<LegKind> {
        Member(match self.0 {
            Leg::Impact(..) => LegKind::Impact,
            Leg::Chatter => LegKind::Chatter,
            Leg::SlideToRelease(_) | Leg::SlideToStop(_) => LegKind::Slide,
            Leg::Stick(_) => LegKind::Stick,
            Leg::Circuit => LegKind::Circuit,
        })
    }

    #[getter]
    fn regime(&self) -> Option<Member<RegimeKind>> {
        match self.0 {
            Leg::Impact(kind, _) => Some(Member(kind)),
            _ => None,
        }
    }

    #[getter]
    fn direction(&self) -> i64 {
        let sign = match self.0 {
            Leg::Impact(_, signs) => signs.direction,
            Leg::SlideToRelease(positive) | Leg::SlideToStop(positive) => of_positive(positive),
            _ => Sign::Unknown,
        };
        sign.value() as i64
    }

    #[getter]
    fn side(&self) -> i64 {
        match self.0 {
            Leg::Impact(_, signs) => signs.side.value() as i64,
            _ => 0,
        }
    }

    #[getter]
    fn end(&self) -> Option<Member<LegEnd>> {
        Some(Member(match self.0 {
            Leg::SlideToRelease(_) | Leg::Stick(StickEnd::Release) => LegEnd::Release,
            Leg::SlideToStop(_) => LegEnd::Stop,
            Leg::Stick(StickEnd::SlipPositive) => LegEnd::SlidePositive,
            Leg::Stick(StickEnd::SlipNegative) => LegEnd::SlideNegative,
            _ => return None,
        }))
    }

    fn __str__(&self) -> String {
        self.0.to_string()
    }

    fn __repr__(&self) -> String {
        format!("<Leg {}>", self.0)
    }

    /// Pickles by its text.
    fn __reduce__(slf: &Bound<'_, Self>) -> PyResult<(Py<PyAny>, (String,))> {
        let read = slf.get_type().getattr("from_text")?.unbind();
        Ok((read, (slf.get().0.to_string(),)))
    }
}

/// One condition of a motion: a border of one of its legs.
#[pyclass(name = "Condition", module = "vibroimpact._core", frozen, eq, hash)]
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct PyCondition(pub Condition);

#[pymethods]
impl PyCondition {
    #[new]
    fn new(border: Member<Border>, leg: usize) -> Self {
        Self(Condition { border: border.0, leg })
    }

    fn __getnewargs__(&self) -> (Member<Border>, usize) {
        (Member(self.0.border), self.0.leg)
    }

    #[getter]
    fn border(&self) -> Member<Border> {
        Member(self.0.border)
    }

    #[getter]
    fn kind(&self) -> Member<BorderKind> {
        Member(self.0.border.kind())
    }

    #[getter]
    fn leg(&self) -> usize {
        self.0.leg
    }

    fn __str__(&self) -> String {
        self.0.to_string()
    }

    fn __repr__(&self) -> String {
        format!("<Condition {}>", self.0)
    }
}
