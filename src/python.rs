//! Python bindings: thin frozen wrappers around the core (`vibroimpact._core`).
//!
//! Errors cross in `errors.rs`, arrays in `arrays.rs`, nothing else is done here.

// Arguments cross by value.
#![allow(clippy::needless_pass_by_value)]

mod arrays;
mod basin;
mod cancel;
mod elementary;
mod enums;
mod errors;
mod impact;
mod itinerary;
mod leg;
mod lyapunov;
mod one_impact;
mod orbit;
mod period;
mod restitution;
mod run;
mod sensitivity;
mod simulate;
mod structure;
mod structure_itinerary;
mod structure_motion;
mod structure_parts;
mod structure_run;
mod structure_sweep;
mod sweep;
mod system;
mod systems;
mod trace;

use pyo3::prelude::*;

/// The compiled core of vibroimpact.
#[pymodule]
mod _core {
    #[pymodule_export]
    use super::basin::{PyArrivals, arrivals};
    #[pymodule_export]
    use super::cancel::{_heed, _interrupt_at, PyCancellation};
    #[pymodule_export]
    use super::elementary::{decay_minus_1, sin_cos};
    #[pymodule_export]
    use super::impact::impact;
    #[pymodule_export]
    use super::leg::{PyCondition, PyLeg};
    #[pymodule_export]
    use super::lyapunov::{PySpectrum, lyapunov_spectrum};
    #[pymodule_export]
    use super::one_impact::{PyOneImpacts, enclosed_sin_cos};
    #[pymodule_export]
    use super::orbit::PyItinerary;
    #[pymodule_export]
    use super::period::PyPeriodReport;
    #[pymodule_export]
    use super::restitution::PyRestitutionCurve;
    #[pymodule_export]
    use super::run::{PyFinalState, PyRun};
    #[pymodule_export]
    use super::sensitivity::{
        PySensitivity, sensitivity, simulate_with_sensitivity, structure_sensitivity,
    };
    #[pymodule_export]
    use super::simulate::simulate;
    #[pymodule_export]
    use super::structure::{PyStop, PyStructure};
    #[pymodule_export]
    use super::structure_itinerary::{PyStopCondition, PyStopLeg, PyStructureItinerary};
    #[pymodule_export]
    use super::structure_motion::{
        PyStructureOrbit, PyStructureSpectrum, structure_motion, structure_spectrum,
    };
    #[pymodule_export]
    use super::structure_run::PyStructureRun;
    #[pymodule_export]
    use super::structure_sweep::{PyStructureSweep, structure_sweep};
    #[pymodule_export]
    use super::sweep::{PySweep, sweep};
    #[pymodule_export]
    use super::system::{PyParameter, PySystem};
    #[pymodule_export]
    use super::systems::PySystems;

    use super::arrays::Record;
    use super::enums::{Enumerated, LegEnd, LegKind};
    use super::system::parameters;
    use crate::analysis::period::Kind;
    use crate::analysis::sweep::PointStatus;
    use crate::analysis::{EvidenceKind, WhyUndecided};
    use crate::impact::{ImpactOutcome, RegimeKind};
    use crate::model::parameters::{Contact, ImpactLaw};
    use crate::model::restitution::MOST_KNOTS;
    use crate::model::structure::Simultaneous;
    use crate::numerics::elementary::MOST_TURNED;
    use crate::numerics::interval::{ABSOLUTE_ERROR, RELATIVE_ERROR, UNREDUCED};
    use crate::simulate::event::{ContactRecord, EventRecord, GrazeRecord, ImpactRecord};
    use crate::simulate::run::BouncesEnd;
    use crate::simulate::tolerances::DEFAULT_TOLERANCE;
    use crate::tangent::border::{Border, BorderKind};
    use pyo3::prelude::*;
    use pyo3::types::PyTuple;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        let py = module.py();
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        module.add("MOST_KNOTS", MOST_KNOTS)?;
        module.add("STATUS_NAMES", PyTuple::new(py, PointStatus::NAMES)?)?;
        module.add("MOTION_NAMES", PyTuple::new(py, Kind::NAMES)?)?;
        module.add("PARAMETERS", parameters(py)?)?;
        module.add("RELATIVE_ERROR", RELATIVE_ERROR)?;
        module.add("ABSOLUTE_ERROR", ABSOLUTE_ERROR)?;
        module.add("UNREDUCED", UNREDUCED)?;
        module.add("MOST_TURNED", MOST_TURNED)?;
        module.add("CHATTER_TOLERANCE", DEFAULT_TOLERANCE)?;
        module.add("CONTACTS", PyTuple::new(py, Contact::ALL.iter().map(|one| one.name()))?)?;
        module.add("LAWS", PyTuple::new(py, ImpactLaw::ALL.iter().map(|one| one.name()))?)?;
        let coulomb = ImpactLaw::ALL.iter().filter(|law| law.is_coulomb()).map(|law| law.name());
        module.add("COULOMB_LAWS", PyTuple::new(py, coulomb.collect::<Vec<_>>())?)?;
        let simultaneous = Simultaneous::ALL.iter().map(|one| one.name());
        module.add("SIMULTANEOUS", PyTuple::new(py, simultaneous)?)?;
        module.add("IMPACT_DTYPE", ImpactRecord::dtype(py)?)?;
        module.add("OUTCOME_DTYPE", ImpactOutcome::dtype(py)?)?;
        module.add("EVENT_DTYPE", EventRecord::dtype(py)?)?;
        module.add("GRAZE_DTYPE", GrazeRecord::dtype(py)?)?;
        module.add("CONTACT_DTYPE", ContactRecord::dtype(py)?)?;
        add_enum::<RegimeKind>(module)?;
        add_enum::<LegKind>(module)?;
        add_enum::<LegEnd>(module)?;
        add_enum::<Border>(module)?;
        add_enum::<BorderKind>(module)?;
        add_enum::<EvidenceKind>(module)?;
        add_enum::<BouncesEnd>(module)?;
        add_enum::<WhyUndecided>(module)
    }

    fn add_enum<T: Enumerated>(module: &Bound<'_, PyModule>) -> PyResult<()> {
        let first = T::members(module.py())?[0].bind(module.py());
        module.add(T::CLASS, first.get_type())
    }
}
