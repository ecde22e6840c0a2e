//! Where enums cross: each becomes a Python enum, made once from the core's own list of names.

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;

use crate::analysis::{EvidenceKind, WhyUndecided};
use crate::impact::RegimeKind;
use crate::model::error::ParameterError;
use crate::simulate::run::BouncesEnd;
use crate::tangent::border::{Border, BorderKind};

/// An enum of the core that Python has too.
pub(super) trait Enumerated: Copy + PartialEq + Send + Sync + 'static {
    /// Name of the class in Python.
    const CLASS: &'static str;
    /// What it is, for Python's help.
    const DOC: &'static str;
    /// All members, in order.
    const MEMBERS: &'static [Self];

    /// Name of a member; in Python in capitals.
    fn name(self) -> &'static str;

    /// Its value in a `StrEnum`; `None` makes an `IntEnum` of the places.
    fn value(self) -> Option<&'static str> {
        Some(self.name())
    }

    /// The Python members, in order, once they are made.
    fn cell() -> &'static PyOnceLock<Vec<Py<PyAny>>>;

    /// The Python members, in order.
    fn members(py: Python<'_>) -> PyResult<&'static [Py<PyAny>]> {
        let make = || {
            let class = Self::class(py)?;
            class.try_iter()?.map(|member| Ok(member?.unbind())).collect::<PyResult<Vec<_>>>()
        };
        Self::cell().get_or_try_init(py, make).map(Vec::as_slice)
    }

    /// A new Python class; pickled by its name in the compiled core.
    fn class(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        let mut base = "IntEnum";
        let mut pairs = Vec::new();
        for (place, member) in Self::MEMBERS.iter().enumerate() {
            let value = if let Some(text) = member.value() {
                base = "StrEnum";
                text.into_pyobject(py)?.into_any()
            } else {
                place.into_pyobject(py)?.into_any()
            };
            pairs.push((member.name().to_uppercase(), value));
        }
        let options = PyDict::new(py);
        options.set_item("module", "vibroimpact._core")?;
        let class = py.import("enum")?.getattr(base)?.call((Self::CLASS, pairs), Some(&options))?;
        class.setattr("__doc__", Self::DOC)?;
        Ok(class)
    }
}

/// A member of an enum on its way across.
#[derive(Clone, Copy)]
pub(super) struct Member<T>(pub T);

impl<'py, T: Enumerated> IntoPyObject<'py> for Member<T> {
    type Target = PyAny;
    type Output = Bound<'py, PyAny>;
    type Error = PyErr;

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Self::Output> {
        let place = T::MEMBERS.iter().position(|&one| one == self.0).unwrap_or_default();
        Ok(T::members(py)?[place].bind(py).clone())
    }
}

impl<'py, T: Enumerated> FromPyObject<'_, 'py> for Member<T> {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let members = T::members(given.py())?;
        for (member, &one) in members.iter().zip(T::MEMBERS) {
            if given.is(member) {
                return Ok(Self(one));
            }
        }
        let allowed = format!("a member of {}", T::CLASS);
        Err(ParameterError::new("member", given.repr()?, allowed).into())
    }
}

/// What a leg is, without its data.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum LegKind {
    Impact,
    Chatter,
    Slide,
    Stick,
    Circuit,
}

/// What ends a phase of contact.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum LegEnd {
    Release,
    Stop,
    SlidePositive,
    SlideNegative,
}

macro_rules! enumerated {
    ($($kind:ty, $members:expr, $name:expr, $value:expr, $class:literal, $doc:literal;)+) => {$(
        impl Enumerated for $kind {
            const CLASS: &'static str = $class;
            const DOC: &'static str = $doc;
            const MEMBERS: &'static [Self] = $members;

            fn name(self) -> &'static str {
                $name(self)
            }

            fn value(self) -> Option<&'static str> {
                $value(self)
            }

            fn cell() -> &'static PyOnceLock<Vec<Py<PyAny>>> {
                static CELL: PyOnceLock<Vec<Py<PyAny>>> = PyOnceLock::new();
                &CELL
            }
        }
    )+};
}

enumerated! {
    RegimeKind, RegimeKind::ALL, RegimeKind::name, |_| None,
        "Regime", "What the contact point did during an impact (theory page, section 4).

Examples
--------
>>> import vibroimpact as vi
>>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
...                    drive_frequency=1.8, moment_amplitude=1, friction=0.3)
>>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
>>> vi.Regime(run.impacts['regime'][-1])
<Regime.REVERSAL_RESTITUTION: 3>
>>> int((run.impacts['regime'] == vi.Regime.SLIP).sum())
0
";
    Border, Border::ALL, Border::name, |border: Border| Some(border.text()),
        "Border", "The conditions that vanish where a leg changes its kind.";
    BorderKind, BorderKind::ALL, BorderKind::name, |kind: BorderKind| Some(kind.name()),
        "BorderKind", "What changes at a border.";
    EvidenceKind, EvidenceKind::ALL, EvidenceKind::name, |kind: EvidenceKind| Some(kind.name()),
        "EvidenceKind", "The kind of evidence for a label.";
    WhyUndecided, WhyUndecided::ALL, WhyUndecided::name, |why: WhyUndecided| Some(why.name()),
        "WhyUndecided", "Why a motion is not judged.";
    BouncesEnd, BouncesEnd::ALL, BouncesEnd::name, |end: BouncesEnd| Some(end.name()),
        "BouncesEnd", "Why the list of the skipped impacts of one chatter ends.

Examples
--------
>>> import vibroimpact as vi
>>> ball = vi.System(mass_ratio=0, frequency_ratio=0, restitution=0.5, gap=1,
...                  drive_frequency=0, moment_amplitude=9.8, contact='direct')
>>> run = vi.simulate(ball, initial=(0, 0, 0, 0), time=2)
>>> run.bounces(down_to=1e-3).ends
(<BouncesEnd.APPROACH_VELOCITY: 'approach_velocity'>,)
";
    LegKind,
        &[LegKind::Impact, LegKind::Chatter, LegKind::Slide, LegKind::Stick, LegKind::Circuit],
        |kind| ["impact", "chatter", "slide", "stick", "circuit"][kind as usize],
        |kind: LegKind| Some(Enumerated::name(kind)),
        "LegKind", "What the bodies do during a leg.";
    LegEnd, &[LegEnd::Release, LegEnd::Stop, LegEnd::SlidePositive, LegEnd::SlideNegative],
        |end| ["release", "stop", "slide_positive", "slide_negative"][end as usize],
        |end: LegEnd| Some(Enumerated::name(end)),
        "LegEnd", "What ends a phase of contact: release, a stop, or slip in one direction.";
}
