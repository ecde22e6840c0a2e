//! `_core.System`.

use std::collections::HashMap;

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMappingProxy};

use super::arrays;
use super::restitution::PyRestitutionCurve;
use crate::flight::FreeMotion;
use crate::model::contact_coordinates::PreImpact;
use crate::model::parameters::{Contact, ImpactLaw, Parameter, System};
use crate::model::state::{Clock, State};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary;

/// What a numeric parameter is.
#[pyclass(name = "Parameter", module = "vibroimpact._core", frozen)]
pub(super) struct PyParameter(Parameter);

#[pymethods]
impl PyParameter {
    /// Its symbol in plain text, as reference data name it.
    #[getter]
    fn symbol(&self) -> &'static str {
        self.0.symbol
    }

    /// Its symbol in LaTeX.
    #[getter]
    fn latex(&self) -> &'static str {
        self.0.latex
    }

    /// What it is, in one line.
    #[getter]
    fn meaning(&self) -> &'static str {
        self.0.meaning
    }

    /// The allowed range, in words.
    #[getter]
    fn allowed(&self) -> &'static str {
        self.0.allowed
    }

    /// The value where none is given; None: one must be given.
    #[getter]
    fn default(&self) -> Option<f64> {
        self.0.default
    }
}

/// The numeric parameters by name, read-only.
pub(super) fn parameters(py: Python<'_>) -> PyResult<Bound<'_, PyMappingProxy>> {
    let table = PyDict::new(py);
    for &parameter in System::PARAMETERS {
        table.set_item(parameter.name, PyParameter(parameter).into_pyobject(py)?)?;
    }
    Ok(PyMappingProxy::new(py, table.as_mapping()))
}

/// Validated parameters.
#[pyclass(name = "System", module = "vibroimpact._core", frozen)]
pub(super) struct PySystem(pub System);

#[pymethods]
impl PySystem {
    #[new]
    #[pyo3(signature = (*, contact, law, curve = None, **numbers))]
    fn new(
        contact: &str,
        law: &str,
        curve: Option<&PyRestitutionCurve>,
        numbers: Option<HashMap<String, f64>>,
    ) -> PyResult<Self> {
        let mut builder =
            System::builder().contact(Contact::from_name(contact)?).law(ImpactLaw::from_name(law)?);
        for (name, value) in numbers.into_iter().flatten() {
            builder = builder.with(&name, value)?;
        }
        if let Some(curve) = curve {
            builder = builder.restitution_curve(curve.0);
        }
        Ok(Self(builder.build()?))
    }

    /// 2 pi / drive_frequency; infinite for a drive that stands still.
    #[getter]
    fn drive_period(&self) -> f64 {
        self.0.drive_period()
    }

    /// Whether impacts do not act on body 2.
    #[getter]
    fn is_wall(&self) -> bool {
        self.0.is_wall()
    }

    /// Whether the angle counts modulo a turn.
    #[getter]
    fn is_rotor(&self) -> bool {
        self.0.is_rotor()
    }

    /// Positions of the tip along the normal.
    fn tip<'py>(&self, py: Python<'py>, x1: PyReadonlyArray1<'_, f64>) -> Column<'py> {
        PyArray1::from_iter(py, x1.as_array().iter().map(|&x1| self.0.tip(x1)))
    }

    /// Their derivatives by x1.
    fn slope<'py>(&self, py: Python<'py>, x1: PyReadonlyArray1<'_, f64>) -> Column<'py> {
        PyArray1::from_iter(py, x1.as_array().iter().map(|&x1| self.0.tip_slope(x1)))
    }

    /// Whether friction can hold the tip at this angle.
    fn is_in_friction_cone(&self, x1: f64) -> PyResult<bool> {
        let at_rest = PreImpact::new(self.0.contact(), &State::new(x1, 0.0, 0.0, 0.0)?);
        let contact = at_rest.coordinates(self.0.mass_ratio(), self.0.friction());
        Ok(contact.is_in_friction_cone())
    }

    /// Gap function of states (n, 4).
    fn gap_function<'py>(
        &self,
        py: Python<'py>,
        states: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Column<'py>> {
        let states = to_states(&states)?;
        Ok(PyArray1::from_iter(py, states.iter().map(|state| self.0.gap_function(state))))
    }

    /// g' of states (n, 4).
    fn gap_rate<'py>(
        &self,
        py: Python<'py>,
        states: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Column<'py>> {
        let states = to_states(&states)?;
        Ok(PyArray1::from_iter(py, states.iter().map(|state| self.0.approach_velocity(state))))
    }

    /// g'' without contact of states (n, 4), each at its phase of the drive.
    fn gap_acceleration<'py>(
        &self,
        py: Python<'py>,
        states: PyReadonlyArray2<'_, f64>,
        phase: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Column<'py>> {
        let states = to_states(&states)?;
        let loads = phase.as_array();
        let values = states
            .iter()
            .zip(loads.iter())
            .map(|(state, &phase)| self.0.gap_acceleration(state, elementary::sin_cos(phase).1));
        Ok(PyArray1::from_iter(py, values))
    }

    /// x1'' and x2'' without contact, (n, 2), of states (n, 4), each at its phase of the drive.
    fn accelerations<'py>(
        &self,
        py: Python<'py>,
        states: PyReadonlyArray2<'_, f64>,
        phase: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let states = to_states(&states)?;
        let values: Vec<f64> = states
            .iter()
            .zip(phase.as_array().iter())
            .flat_map(|(state, &phase)| {
                <[f64; 2]>::from(self.0.free_accelerations(state, elementary::sin_cos(phase).1))
            })
            .collect();
        PyArray1::from_vec(py, values).reshape([states.len(), 2])
    }

    /// States (n, 4) at times >= 0 after a state, without contact; `phase` is that at the start.
    fn free_flight<'py>(
        &self,
        py: Python<'py>,
        state: (f64, f64, f64, f64),
        times: PyReadonlyArray1<'_, f64>,
        phase: f64,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (x1, v1, x2, v2) = state;
        let motion = FreeMotion::new(&self.0.with("phase", phase)?);
        let flight = motion.flight(Clock::START, State::new(x1, v1, x2, v2)?);
        let states: Vec<[f64; 4]> = times
            .as_array()
            .iter()
            .map(|&time| motion.state_after(&flight, DoubleDouble::new(time)).to_array())
            .collect();
        arrays::states(py, &states)
    }
}

type Column<'py> = Bound<'py, PyArray1<f64>>;

fn to_states(array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<State>> {
    arrays::to_states(array)?.into_iter().map(to_state).collect()
}

/// A state of four numbers.
pub(super) fn to_state([x1, v1, x2, v2]: [f64; 4]) -> PyResult<State> {
    Ok(State::new(x1, v1, x2, v2)?)
}
