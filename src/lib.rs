//! Simulation and analysis of a two-degree-of-freedom oblique-impact vibrating system: a
//! spring-pendulum strikes a mass-spring oscillator at an angle, with Coulomb friction in the
//! contact.
//!
//! # Model
//! After Han, Jin & Hu (2004), with pendulum angle x1, oscillator displacement x2, all quantities
//! dimensionless ([`System`] gives every parameter's meaning and range):
//!
//! ```text
//! x1'' + 2 zeta1 omega0 x1' + omega0^2 x1 = f1 cos(omega t + phi)
//! x2'' + 2 zeta2        x2' +          x2 = f2 cos(omega t + phi)    while g < 0
//! g = sin x1 - x2 - delta      (oblique contact)
//! g =     x1 - x2 - delta      (direct contact)
//! ```
//!
//! At g = 0 with g' > 0 the bodies strike: an instantaneous planar impact with friction, resolved
//! along its normal impulse ([`impact`]).
//!
//! # Numerics
//! * Flights are exact: closed forms for every damping, resonance and zero frequency, finite in all
//!   neighbourhoods; drive periods are counted, so the millionth is as accurate as the first.
//! * The first contact is found with a guarantee ([`next_contact`]): no double crossing is missed.
//! * Complete chatter is carried to its accumulation point with a stated error, and runs go on
//!   through sustained contact ([`ContactMode`]): slide, stick, release.
//! * Expected outcomes are values ([`StopReason`]); bad input and failed computations are typed
//!   errors.
//! * The same input gives the same bits for any number of threads.
//!
//! # Example
//! ```
//! use vibroimpact::{CancelToken, Run, RunOptions, State, System, run};
//!
//! let system = System::builder()
//!     .mass_ratio(0.6).frequency_ratio(2.0).restitution(0.8).gap(0.5)
//!     .drive_frequency(1.8).moment_amplitude(1.0)
//!     .build()?;
//! let start = State::new(0.0, 0.5, 0.0, 0.0)?;
//! let never = CancelToken::never();
//! let result: Run = run(&system, start, RunOptions::periods(600).keep(100), &never)?;
//! assert_eq!(result.period(&never).label(), "1-1");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Simulation`] gives the events one by one; [`sweep`] runs over a parameter in parallel.

#![warn(clippy::pedantic)]
#![allow(
    clippy::cast_possible_truncation, // counts of periods and rows stay far below 2^52
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::doc_markdown, // formulas
    clippy::float_cmp, // exact zeros and edges are meant exactly
    clippy::many_single_char_names, // the paper's letters
    clippy::similar_names
)]

pub mod analysis;
mod contact;
mod flight;
pub mod impact;
mod model;
mod numerics;
mod search;
mod simulate;
pub mod tangent;

pub use analysis::{
    CHATTERING, Cell, Evidence, EvidenceKind, Growth, ImpactCount, Kind, LyapunovError, Measure,
    PeriodReport, PointStatus, Spectrum, StructureCells, StructureLyapunovError, StructureOrbit,
    StructureOrbitError, StructurePoint, StructureSpectrum, StructureStability, SweepOptions,
    SweepPoint, SweepRows, SweepStart, WhyUndecided, Workers, arrive_many, detect_period,
    largest_lyapunov_exponent, largest_lyapunov_exponents, lyapunov_spectrum, run_many,
    structure_lyapunov, structure_orbit, structure_sweep, sweep,
};
pub use contact::{ContactForce, ContactMode};
pub use flight::{
    ContactReport, Flight, Found, FreeMotion, StopContact, StructureFlight, StructureMotion, Touch,
    next_contact,
};
pub use model::{
    Clock, Contact, ImpactLaw, MOST_KNOTS, MOST_NUMBERS, Parameter, ParameterError,
    RestitutionCurve, SimulationError, Simultaneous, State, StateError, Stop, StopVariation,
    Structure, StructureBuilder, StructureParameter, StructureState, System, SystemBuilder,
    Variation,
};
pub use numerics::cancel::CancelToken;
pub use search::{GapPoint, Start};
pub use simulate::event::{
    ChatterEvent, ContactEvent, ContactRecord, Event, EventKind, EventRecord, GrazeEvent,
    GrazeRecord, ImpactEvent, ImpactRecord, StopEvent, StopReason,
};
pub use simulate::run::{
    Bounces, BouncesEnd, EnergyAudit, FinalState, Run, RunError, RunOptions, StopContactRecord,
    StopGrazeRecord, StopImpactRecord, StructureAudit, run,
};
pub use simulate::structure::{
    ClosedStops, StopChatterEvent, StopContactEvent, StopGrazeEvent, StopImpactEvent,
    StructureEvent, StructureMode,
};
pub use simulate::{Horizon, Observer, Simulation};

#[cfg(feature = "python")]
mod python;

/// The code blocks of the README run as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct ReadmeDoctests;
