//! `_core.System`.

use pyo3::prelude::*;

use crate::model::parameters::{Contact, ImpactLaw, System};

/// Validated parameters.
#[pyclass(name = "System", module = "vibroimpact._core", frozen)]
pub(super) struct PySystem(pub System);

#[pymethods]
impl PySystem {
    #[new]
    #[pyo3(signature = (
        *, mass_ratio, frequency_ratio, restitution, gap, drive_frequency,
        pendulum_damping = 0.0, oscillator_damping = 0.0, moment_amplitude = 0.0,
        force_amplitude = 0.0, friction = 0.0, phase = 0.0,
        contact = "oblique", law = "poisson",
    ))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        mass_ratio: f64,
        frequency_ratio: f64,
        restitution: f64,
        gap: f64,
        drive_frequency: f64,
        pendulum_damping: f64,
        oscillator_damping: f64,
        moment_amplitude: f64,
        force_amplitude: f64,
        friction: f64,
        phase: f64,
        contact: &str,
        law: &str,
    ) -> PyResult<Self> {
        let system = System::builder()
            .mass_ratio(mass_ratio)
            .frequency_ratio(frequency_ratio)
            .restitution(restitution)
            .gap(gap)
            .drive_frequency(drive_frequency)
            .pendulum_damping(pendulum_damping)
            .oscillator_damping(oscillator_damping)
            .moment_amplitude(moment_amplitude)
            .force_amplitude(force_amplitude)
            .friction(friction)
            .phase(phase)
            .contact(Contact::from_name(contact)?)
            .law(ImpactLaw::from_name(law)?)
            .build()?;
        Ok(Self(system))
    }

    /// 2 pi / drive_frequency; infinite for a constant load.
    #[getter]
    fn drive_period(&self) -> f64 {
        self.0.drive_period()
    }
}
