//! `_core.Itinerary`: the kernels of shooting.

use numpy::{PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use super::arrays;
use super::itinerary::{Matrix, checked_leg, followed, judged, matrix, residual, words};
use super::leg::{PyCondition, PyLeg};
use super::system::PySystem;
use super::system::to_state;
use super::systems::PySystems;
use crate::analysis::shooting::{Orbit, Verdict};
use crate::model::state::State;
use crate::tangent::itinerary::{Itinerary, Node};

/// The legs of a periodic motion.
#[pyclass(name = "Itinerary", module = "vibroimpact._core", frozen)]
pub(super) struct PyItinerary(Itinerary);

fn to_nodes(nodes: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<Node>> {
    Ok(arrays::to_states(nodes)?.into_iter().map(Node::from_array).collect())
}

/// A condition, its value, time in the leg.
type TestRow = (PyCondition, f64, f64);

/// Return maps, and which orbits are motions.
type Judged<'py> = (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray1<bool>>);

#[pymethods]
impl PyItinerary {
    #[new]
    #[pyo3(signature = (legs, periods, clocks = None, wall_at_rest = false))]
    fn new(
        legs: Vec<PyLeg>,
        periods: i64,
        clocks: Option<Vec<i64>>,
        wall_at_rest: bool,
    ) -> PyResult<Self> {
        let legs = legs.into_iter().map(|leg| leg.0).collect();
        Ok(Self(Itinerary::new(legs, periods, clocks, wall_at_rest)?))
    }

    /// Other legs of the same machine.
    fn with_legs(&self, legs: Vec<PyLeg>, periods: i64, clocks: Vec<i64>) -> PyResult<Self> {
        Self::new(legs, periods, Some(clocks), self.0.wall_at_rest)
    }

    /// The itinerary of a motion that repeats after `periods`, with its nodes; or why none exists.
    #[staticmethod]
    fn follow<'py>(
        py: Python<'py>,
        system: &PySystem,
        initial: [f64; 4],
        periods: i64,
        max_events: u64,
    ) -> PyResult<(Option<(Self, Matrix<'py>)>, String)> {
        let initial = to_state(initial)?;
        let system = &system.0;
        match followed(py, |cancel| {
            Itinerary::follow(system, initial, periods, max_events, cancel)
        })? {
            Ok((itinerary, nodes)) => {
                let rows: Vec<[f64; 4]> = nodes.into_iter().map(Node::to_array).collect();
                Ok((Some((Self(itinerary), arrays::states(py, &rows)?)), String::new()))
            }
            Err(why) => Ok((None, why)),
        }
    }

    /// Pickles by what `__new__` takes.
    fn __getnewargs__(&self) -> (Vec<PyLeg>, i64, Vec<i64>, bool) {
        (self.legs(), self.periods(), self.clocks(), self.wall_at_rest())
    }

    #[getter]
    fn legs(&self) -> Vec<PyLeg> {
        self.0.legs.iter().copied().map(PyLeg).collect()
    }

    #[getter]
    fn periods(&self) -> i64 {
        self.0.periods
    }

    #[getter]
    fn clocks(&self) -> Vec<i64> {
        self.0.clocks.clone()
    }

    #[getter]
    fn wall_at_rest(&self) -> bool {
        self.0.wall_at_rest
    }

    /// Residual and Jacobian.
    #[pyo3(signature = (system, nodes, parameters = None))]
    fn residual<'py>(
        &self,
        py: Python<'py>,
        system: &PySystem,
        nodes: PyReadonlyArray2<'_, f64>,
        parameters: Option<Vec<String>>,
    ) -> PyResult<(Bound<'py, PyArray1<f64>>, Matrix<'py>)> {
        let nodes = to_nodes(&nodes)?;
        let found =
            Orbit::new(&system.0, &self.0, &nodes)?.residual(&parameters.unwrap_or_default())?;
        residual(py, (found.values, found.jacobian, found.columns))
    }

    /// The conditions with their values, positive inside, and their times in the leg.
    fn tests(&self, system: &PySystem, nodes: PyReadonlyArray2<'_, f64>) -> PyResult<Vec<TestRow>> {
        let nodes = to_nodes(&nodes)?;
        let tests = Orbit::new(&system.0, &self.0, &nodes)?.tests();
        Ok(tests.into_iter().map(|t| (PyCondition(t.condition), t.value, t.time)).collect())
    }

    /// Derivatives of the legs' maps, shape (legs, 4, 4).
    fn transfer<'py>(
        &self,
        py: Python<'py>,
        system: &PySystem,
        nodes: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let nodes = to_nodes(&nodes)?;
        let matrices = Orbit::new(&system.0, &self.0, &nodes)?.transfer();
        let flat: Vec<f64> = matrices
            .iter()
            .flat_map(|m| m.transpose().iter().copied().collect::<Vec<_>>())
            .collect();
        PyArray1::from_vec(py, flat).reshape([matrices.len(), 4, 4])
    }

    /// Derivative of the return map, shape (4, 4).
    fn return_map<'py>(
        &self,
        py: Python<'py>,
        system: &PySystem,
        nodes: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Matrix<'py>> {
        let nodes = to_nodes(&nodes)?;
        let return_map = Orbit::new(&system.0, &self.0, &nodes)?.return_map();
        matrix(py, &return_map)
    }

    /// Derivatives of the return maps of several orbits, shape (k, 4, 4): orbit i has its nodes in
    /// as many rows as there are legs, after those of the orbits before, and is one of system i.
    fn return_maps<'py>(
        &self,
        py: Python<'py>,
        systems: &PySystems,
        nodes: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let nodes = to_nodes(&nodes)?;
        let mut maps = Vec::with_capacity(16 * systems.count());
        for (number, nodes) in nodes.chunks(self.0.legs.len()).enumerate() {
            let orbit = Orbit::new(systems.get(number)?, &self.0, nodes)?;
            maps.extend_from_slice(orbit.return_map().transpose().as_slice());
        }
        let count = maps.len() / 16;
        PyArray1::from_vec(py, maps).reshape([count, 4, 4])
    }

    /// The derivative of the return map, shape (4, 4), and why a solution is no motion of its
    /// system, in words; empty if it is one.
    fn verdict<'py>(
        &self,
        py: Python<'py>,
        system: &PySystem,
        nodes: PyReadonlyArray2<'_, f64>,
        max_events: u64,
    ) -> PyResult<(Matrix<'py>, String)> {
        let nodes = to_nodes(&nodes)?;
        let orbit = Orbit::new(&system.0, &self.0, &nodes)?;
        let Verdict { return_map, rejection } =
            judged(py, |cancel| orbit.verdict(max_events, cancel))?;
        Ok((matrix(py, &return_map)?, words(rejection)))
    }

    /// The return maps (k, 4, 4) of orbits of one leg, orbit i with the node in row i and of the
    /// system of that number; and which are motions.
    fn judge_all<'py>(
        &self,
        py: Python<'py>,
        systems: &PySystems,
        numbers: Vec<usize>,
        nodes: PyReadonlyArray2<'_, f64>,
        max_events: u64,
    ) -> PyResult<Judged<'py>> {
        let nodes = to_nodes(&nodes)?;
        let mut orbits = Vec::with_capacity(nodes.len());
        for (&number, node) in numbers.iter().zip(nodes.chunks(1)) {
            let system = systems.get(number)?;
            orbits.push(Orbit::new(system, &self.0, node)?);
        }
        let judged = judged(py, |cancel| Orbit::verdicts(&orbits, max_events, cancel))?;
        let maps: Vec<f64> = judged
            .iter()
            .flat_map(|verdict| verdict.return_map.transpose().as_slice().to_vec())
            .collect();
        let admissible = judged.iter().map(|verdict| verdict.rejection.is_none()).collect();
        let maps = PyArray1::from_vec(py, maps).reshape([judged.len(), 4, 4])?;
        Ok((maps, PyArray1::from_vec(py, admissible)))
    }

    /// States x1, v1, x2, v2 at any times, shape (k, 4).
    fn trajectory<'py>(
        &self,
        py: Python<'py>,
        system: &PySystem,
        nodes: PyReadonlyArray2<'_, f64>,
        times: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Matrix<'py>> {
        let nodes = to_nodes(&nodes)?;
        let orbit = Orbit::new(&system.0, &self.0, &nodes)?;
        let states: Vec<[f64; 4]> =
            times.as_array().iter().map(|&time| orbit.state_at(time).to_array()).collect();
        arrays::states(py, &states)
    }

    /// States x1, v1, x2, v2 just before the event of each leg, shape (legs, 4).
    fn before_events<'py>(
        &self,
        py: Python<'py>,
        system: &PySystem,
        nodes: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Matrix<'py>> {
        let nodes = to_nodes(&nodes)?;
        let states = Orbit::new(&system.0, &self.0, &nodes)?.before_events();
        let rows: Vec<[f64; 4]> = states.into_iter().map(State::to_array).collect();
        arrays::states(py, &rows)
    }

    /// Largest local maximum of the gap in each leg: (time, gap), or None.
    fn humps(
        &self,
        system: &PySystem,
        nodes: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Vec<Option<(f64, f64)>>> {
        let nodes = to_nodes(&nodes)?;
        Ok(Orbit::new(&system.0, &self.0, &nodes)?.humps())
    }

    /// State x1, v1, x2, v2 at a time after the start of a leg; None where it cannot be followed.
    fn state_in_leg(
        &self,
        system: &PySystem,
        nodes: PyReadonlyArray2<'_, f64>,
        leg: usize,
        time: f64,
    ) -> PyResult<Option<[f64; 4]>> {
        checked_leg(leg, self.0.legs.len())?;
        let nodes = to_nodes(&nodes)?;
        let state = Orbit::new(&system.0, &self.0, &nodes)?.state_in_leg(leg, time);
        Ok(state.map(State::to_array))
    }
}
