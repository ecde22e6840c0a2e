//! `_core.Stop` and `_core.Structure`.

use std::sync::OnceLock;

use nalgebra::Complex;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use super::arrays::to_vec;
use super::restitution::PyRestitutionCurve;
use crate::analysis::structure_shooting::StructureShooting;
use crate::model::contact_coordinates::ContactCoordinates;
use crate::model::parameters::ImpactLaw;
use crate::model::structure::{Simultaneous, Stop, Structure};

/// A stop, with all checked that does not depend on its structure.
#[pyclass(name = "Stop", module = "vibroimpact._core", frozen)]
pub(super) struct PyStop(Stop);

#[pymethods]
impl PyStop {
    #[new]
    #[pyo3(signature = (normal, gap, restitution, *, curve, friction, tangent, amplitude, phase))]
    #[expect(clippy::too_many_arguments, reason = "as Python has them")]
    fn new(
        normal: PyReadonlyArray1<'_, f64>,
        gap: f64,
        restitution: f64,
        curve: Option<&PyRestitutionCurve>,
        friction: f64,
        tangent: Option<PyReadonlyArray1<'_, f64>>,
        amplitude: f64,
        phase: f64,
    ) -> PyResult<Self> {
        let mut stop = Stop::new(to_vec(&normal), gap, restitution).moving(amplitude, phase);
        if let Some(curve) = curve {
            stop = stop.with_restitution_curve(curve.0);
        }
        if let Some(tangent) = tangent {
            stop = stop.with_friction(friction, to_vec(&tangent));
        }
        stop.check()?;
        Ok(Self(stop))
    }
}

/// A validated structure.
#[pyclass(name = "Structure", module = "vibroimpact._core", frozen)]
pub(super) struct PyStructure(pub(super) Structure, OnceLock<StructureShooting>);

impl PyStructure {
    /// As the kernels of shooting take it, worked out when it is needed.
    pub(super) fn shooting(&self) -> &StructureShooting {
        self.1.get_or_init(|| StructureShooting::new(&self.0))
    }
}

#[pymethods]
impl PyStructure {
    #[new]
    #[pyo3(signature = (
        mass, stiffness, stops, *, damping, damping_ratios, static_load, drive_amplitude,
        drive_frequency, phase, law, simultaneous, like,
    ))]
    #[expect(clippy::too_many_arguments, reason = "as Python has them")]
    fn new(
        py: Python<'_>,
        mass: PyReadonlyArray2<'_, f64>,
        stiffness: PyReadonlyArray2<'_, f64>,
        stops: Vec<PyRef<'_, PyStop>>,
        damping: Option<PyReadonlyArray2<'_, f64>>,
        damping_ratios: Option<PyReadonlyArray1<'_, f64>>,
        static_load: PyReadonlyArray1<'_, f64>,
        drive_amplitude: PyReadonlyArray1<'_, Complex<f64>>,
        drive_frequency: f64,
        phase: f64,
        law: &str,
        simultaneous: &str,
        like: Option<&Self>,
    ) -> PyResult<Self> {
        let drive: Vec<_> = drive_amplitude.as_array().iter().copied().collect();
        let mut builder = Structure::builder(rows(&mass), rows(&stiffness))
            .static_load(to_vec(&static_load))
            .drive(drive, drive_frequency, phase)
            .law(ImpactLaw::from_name(law)?)
            .simultaneous(Simultaneous::from_name(simultaneous)?);
        if let Some(matrix) = damping {
            builder = builder.damping(rows(&matrix));
        }
        if let Some(ratios) = damping_ratios {
            builder = builder.damping_ratios(to_vec(&ratios));
        }
        if let Some(like) = like {
            builder = builder.like(&like.0);
        }
        builder = stops.iter().fold(builder, |builder, stop| builder.stop(stop.0.clone()));
        // The modes of many coordinates take a while.
        Ok(Self(py.detach(|| builder.build())?, OnceLock::new()))
    }

    /// Natural frequencies, ascending.
    #[getter]
    fn frequencies<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.0.frequencies())
    }

    /// Mode shapes (N, N), that of mode i in column i.
    #[getter]
    fn shapes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let count = self.0.coordinates();
        let shapes = self.0.shapes();
        let entries = (0..count).flat_map(|k| shapes.iter().map(move |shape| shape[k]));
        PyArray1::from_iter(py, entries).reshape([count, count])
    }

    /// Whether friction can hold the contact point at a stop that has come to rest.
    fn sticks_at(&self, stop: usize) -> bool {
        self.0.stops().get(stop).is_some_and(|at| {
            let rows = self.0.contact(stop);
            ContactCoordinates::new(0.0, 0.0, rows.mobilities, at.friction()).is_in_friction_cone()
        })
    }

    /// 2 pi / drive_frequency; infinite for a drive that stands still.
    #[getter]
    fn drive_period(&self) -> f64 {
        std::f64::consts::TAU / self.0.drive_frequency()
    }
}

pub(super) fn rows(matrix: &PyReadonlyArray2<'_, f64>) -> Vec<Vec<f64>> {
    matrix.as_array().rows().into_iter().map(|row| row.to_vec()).collect()
}
