//! What a motion is: periods and labels, Lyapunov exponents, periodic orbits by shooting, basins
//! and sweeps over parameters.

mod approach;
pub mod basin;
mod label;
pub(crate) mod lyapunov;
pub mod one_impact;
pub(crate) mod period;
mod return_map;
pub mod shooting;
mod structure_lyapunov;
mod structure_orbit;
pub mod structure_shooting;
pub(crate) mod structure_sweep;
pub(crate) mod sweep;
pub(crate) mod tolerances;
mod workers;

pub use lyapunov::{
    LyapunovError, Spectrum, largest_lyapunov_exponent, largest_lyapunov_exponents,
    lyapunov_spectrum,
};
pub use period::{
    CHATTERING, Evidence, EvidenceKind, Growth, ImpactCount, Kind, PeriodReport, WhyUndecided,
    detect_period,
};
pub use structure_lyapunov::{StructureLyapunovError, StructureSpectrum, structure_lyapunov};
pub use structure_orbit::{
    StructureOrbit, StructureOrbitError, StructureStability, structure_orbit,
};
pub use structure_sweep::{StructureCells, StructurePoint, structure_sweep};
pub use sweep::{
    Cell, Measure, PointStatus, SweepOptions, SweepPoint, SweepRows, SweepStart, arrive_many,
    run_many, sweep,
};
pub use workers::Workers;
