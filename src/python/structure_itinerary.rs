//! `_core.StructureItinerary`, `_core.StopLeg` and `_core.StopCondition`: the kernels of shooting for
//! structures, with the methods that `_core.Itinerary` has.

// PyO3 calls methods by reference.
#![allow(clippy::trivially_copy_pass_by_ref)]

use numpy::{PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyType;

use super::enums::{LegKind, Member};
use super::itinerary::{Matrix, checked_leg, followed, judged, matrix, residual, words};
use super::structure::PyStructure;
use crate::analysis::structure_shooting::{
    StopCondition, StopLeg, StructureCycle, StructureItinerary,
};
use crate::impact::RegimeKind;
use crate::model::error::ParameterError;
use crate::model::structure::StructureState;
use crate::tangent::border::{Border, BorderKind};

/// One leg of a motion of a structure.
#[pyclass(name = "StopLeg", module = "vibroimpact._core", frozen, eq, hash, from_py_object)]
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct PyStopLeg(StopLeg);

#[pymethods]
impl PyStopLeg {
    #[classattr]
    const CIRCUIT: Self = Self(StopLeg::Circuit);

    /// A flight to an impact on this stop; with friction the sign of the slip before it.
    #[staticmethod]
    #[pyo3(signature = (stop, regime, direction = 0))]
    fn impact(stop: usize, regime: Member<RegimeKind>, direction: i8) -> PyResult<Self> {
        let regime = regime.0;
        let allowed = if regime == RegimeKind::Frictionless { "0" } else { "1 or -1" };
        if (direction == 0) != (regime == RegimeKind::Frictionless) || direction.abs() > 1 {
            return Err(ParameterError::new("direction", direction, allowed).into());
        }
        Ok(Self(StopLeg::Impact { stop, regime, direction }))
    }

    /// The leg of this text, from a file.
    #[classmethod]
    fn from_text(_class: &Bound<'_, PyType>, text: &str) -> PyResult<Self> {
        Ok(Self(text.parse()?))
    }

    #[getter]
    fn kind(&self) -> Member<LegKind> {
        Member(match self.0 {
            StopLeg::Impact { .. } => LegKind::Impact,
            StopLeg::Circuit => LegKind::Circuit,
        })
    }

    /// The stop; None of a circuit.
    #[getter]
    fn stop(&self) -> Option<usize> {
        match self.0 {
            StopLeg::Impact { stop, .. } => Some(stop),
            StopLeg::Circuit => None,
        }
    }

    #[getter]
    fn regime(&self) -> Option<Member<RegimeKind>> {
        match self.0 {
            StopLeg::Impact { regime, .. } => Some(Member(regime)),
            StopLeg::Circuit => None,
        }
    }

    #[getter]
    fn direction(&self) -> i8 {
        match self.0 {
            StopLeg::Impact { direction, .. } => direction,
            StopLeg::Circuit => 0,
        }
    }

    fn __str__(&self) -> String {
        self.0.to_string()
    }

    fn __repr__(&self) -> String {
        format!("<StopLeg {}>", self.0)
    }

    /// Pickles as its text.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        let made = py.get_type::<Self>().getattr("from_text")?;
        Ok((made, (self.0.to_string(),)))
    }
}

/// One condition of a motion of a structure.
#[pyclass(name = "StopCondition", module = "vibroimpact._core", frozen, eq, hash, from_py_object)]
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct PyStopCondition(StopCondition);

#[pymethods]
impl PyStopCondition {
    #[new]
    fn new(border: Member<Border>, leg: usize, stop: usize) -> Self {
        Self(StopCondition { border: border.0, leg, stop })
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

    #[getter]
    fn stop(&self) -> usize {
        self.0.stop
    }

    fn __repr__(&self) -> String {
        let StopCondition { border, leg, stop } = self.0;
        format!(
            "<StopCondition {}: {}, leg {leg}, stop {stop}>",
            border.kind().name(),
            border.text()
        )
    }

    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> (Bound<'py, PyType>, (Member<Border>, usize, usize)) {
        (py.get_type::<Self>(), (self.border(), self.leg(), self.stop()))
    }
}

/// The impacts of a motion of a structure.
#[pyclass(name = "StructureItinerary", module = "vibroimpact._core", frozen)]
pub(super) struct PyStructureItinerary(StructureItinerary);

/// A condition, its value, time in the leg.
type TestRow = (PyStopCondition, f64, f64);

fn stacked<'py>(py: Python<'py>, states: &[StructureState], count: usize) -> Stacked<'py> {
    let flat: Vec<f64> = states.iter().flat_map(StructureState::numbers).collect();
    PyArray1::from_vec(py, flat).reshape([states.len(), 2, count])
}

type Stacked<'py> = PyResult<Bound<'py, PyArray3<f64>>>;

impl PyStructureItinerary {
    fn cycle<'a>(
        &'a self,
        system: &'a PyStructure,
        nodes: &PyReadonlyArray2<'_, f64>,
    ) -> PyResult<StructureCycle<'a>> {
        let flat: Vec<f64> = nodes.as_array().iter().copied().collect();
        Ok(system.shooting().cycle(&self.0, &flat)?)
    }
}

#[pymethods]
impl PyStructureItinerary {
    #[new]
    fn new(legs: Vec<PyStopLeg>, periods: i64, clocks: Vec<i64>) -> PyResult<Self> {
        let legs = legs.into_iter().map(|leg| leg.0).collect();
        Ok(Self(StructureItinerary::new(legs, periods, clocks)?))
    }

    /// Other legs of the same machine.
    #[expect(clippy::unused_self, reason = "as an Itinerary has it")]
    fn with_legs(&self, legs: Vec<PyStopLeg>, periods: i64, clocks: Vec<i64>) -> PyResult<Self> {
        Self::new(legs, periods, clocks)
    }

    /// Pickles by what `__new__` takes.
    fn __getnewargs__(&self) -> (Vec<PyStopLeg>, i64, Vec<i64>) {
        (self.legs(), self.periods(), self.clocks())
    }

    /// The itinerary of a motion that repeats after `periods`, with its nodes; or why none exists.
    #[staticmethod]
    fn follow<'py>(
        py: Python<'py>,
        system: &PyStructure,
        initial: PyReadonlyArray2<'_, f64>,
        periods: i64,
        max_events: u64,
    ) -> PyResult<(Option<(Self, Matrix<'py>)>, String)> {
        let rows = initial.as_array();
        if rows.nrows() != 2 {
            return Err(ParameterError::new("initial", rows.nrows(), "two rows, q and v").into());
        }
        let initial = StructureState::new(&rows.row(0).to_vec(), &rows.row(1).to_vec());
        match followed(py, |cancel| {
            StructureItinerary::follow(&system.0, &initial, periods, max_events, cancel)
        })? {
            Ok((itinerary, nodes)) => {
                let rows = itinerary.legs.len();
                let width = nodes.len() / rows;
                let nodes = PyArray1::from_vec(py, nodes).reshape([rows, width])?;
                Ok((Some((Self(itinerary), nodes)), String::new()))
            }
            Err(why) => Ok((None, why)),
        }
    }

    #[getter]
    fn legs(&self) -> Vec<PyStopLeg> {
        self.0.legs.iter().copied().map(PyStopLeg).collect()
    }

    #[getter]
    fn periods(&self) -> i64 {
        self.0.periods
    }

    #[getter]
    fn clocks(&self) -> Vec<i64> {
        self.0.clocks.clone()
    }

    /// Residual and Jacobian.
    #[pyo3(signature = (system, nodes, parameters = None))]
    fn residual<'py>(
        &self,
        py: Python<'py>,
        system: &PyStructure,
        nodes: PyReadonlyArray2<'_, f64>,
        parameters: Option<Vec<String>>,
    ) -> PyResult<(Bound<'py, PyArray1<f64>>, Matrix<'py>)> {
        let named: Vec<_> = parameters
            .unwrap_or_default()
            .iter()
            .map(|name| system.0.parameter(name))
            .collect::<Result<_, _>>()?;
        let found = self.cycle(system, &nodes)?.residual(&named);
        residual(py, (found.values, found.jacobian, found.columns))
    }

    /// The conditions with their values, positive inside, and their times in the leg.
    fn tests(
        &self,
        system: &PyStructure,
        nodes: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Vec<TestRow>> {
        let tests = self.cycle(system, &nodes)?.tests();
        Ok(tests.into_iter().map(|t| (PyStopCondition(t.condition), t.value, t.time)).collect())
    }

    /// Derivative of the return map from the start of a drive period, shape (2N, 2N).
    fn return_map<'py>(
        &self,
        py: Python<'py>,
        system: &PyStructure,
        nodes: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Matrix<'py>> {
        matrix(py, &self.cycle(system, &nodes)?.return_map())
    }

    /// Why a solution is no motion of its structure, in words; empty if it is one.
    fn verdict(
        &self,
        py: Python<'_>,
        system: &PyStructure,
        nodes: PyReadonlyArray2<'_, f64>,
        max_events: u64,
    ) -> PyResult<String> {
        let cycle = self.cycle(system, &nodes)?;
        Ok(words(judged(py, |cancel| cycle.rejection(max_events, cancel))?))
    }

    /// States (k, 2, N) at the starts of the drive periods.
    fn sections<'py>(
        &self,
        py: Python<'py>,
        system: &PyStructure,
        nodes: PyReadonlyArray2<'_, f64>,
    ) -> Stacked<'py> {
        let states = self.cycle(system, &nodes)?.sections();
        stacked(py, &states, system.0.coordinates())
    }

    /// States (k, 2, N) at any times.
    fn trajectory<'py>(
        &self,
        py: Python<'py>,
        system: &PyStructure,
        nodes: PyReadonlyArray2<'_, f64>,
        times: PyReadonlyArray1<'_, f64>,
    ) -> Stacked<'py> {
        let cycle = self.cycle(system, &nodes)?;
        let states: Vec<_> = times.as_array().iter().map(|&time| cycle.state_at(time)).collect();
        stacked(py, &states, system.0.coordinates())
    }

    /// States (legs, 2, N) just before the event of each leg; NaN where it cannot be followed.
    fn before_events<'py>(
        &self,
        py: Python<'py>,
        system: &PyStructure,
        nodes: PyReadonlyArray2<'_, f64>,
    ) -> Stacked<'py> {
        let count = system.0.coordinates();
        let nowhere = StructureState::new(&vec![f64::NAN; count], &vec![f64::NAN; count]);
        let states: Vec<_> = self
            .cycle(system, &nodes)?
            .before_events()
            .into_iter()
            .map(|state| state.unwrap_or_else(|| nowhere.clone()))
            .collect();
        stacked(py, &states, count)
    }

    /// State (2, N) at a time after the start of a leg, whether or not a stop is penetrated.
    fn state_in_leg<'py>(
        &self,
        py: Python<'py>,
        system: &PyStructure,
        nodes: PyReadonlyArray2<'_, f64>,
        leg: usize,
        time: f64,
    ) -> PyResult<Matrix<'py>> {
        checked_leg(leg, self.0.legs.len())?;
        let state = self.cycle(system, &nodes)?.state_in_leg(leg, time);
        let flat: Vec<f64> = state.numbers().collect();
        PyArray1::from_vec(py, flat).reshape([2, system.0.coordinates()])
    }
}
