//! The three kinds of failure that are errors: bad parameters, bad states, failed computations.
//!
//! Expected outcomes (time reached, event cap, chatter ...) are values of
//! [`StopReason`](crate::StopReason), never errors.

use std::borrow::Cow;
use std::f64::consts::TAU;

/// A parameter outside its allowed range, found before any computation starts.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{name} = {value} is not allowed; allowed: {allowed}")]
pub struct ParameterError {
    /// Name of the parameter, as in [`SystemBuilder`](crate::SystemBuilder).
    pub name: Cow<'static, str>,
    /// The value that was given.
    pub value: String,
    /// The allowed range, in words.
    pub allowed: Cow<'static, str>,
}

impl ParameterError {
    pub(crate) fn new(
        name: impl Into<Cow<'static, str>>,
        value: impl std::fmt::Display,
        allowed: impl Into<Cow<'static, str>>,
    ) -> Self {
        Self { name: name.into(), value: value.to_string(), allowed: allowed.into() }
    }

    /// With a number as Rust and Python write it: 2.0, 1e300.
    pub(crate) fn number(
        name: impl Into<Cow<'static, str>>,
        value: f64,
        allowed: impl Into<Cow<'static, str>>,
    ) -> Self {
        Self::new(name, format!("{value:?}"), allowed)
    }
}

/// A start state that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StateError {
    /// A component is NaN or infinite.
    #[error("{name} = {value} is not allowed; allowed: a finite number")]
    NotFinite {
        /// Component: x1, v1, x2 or v2; `q[i]` or `v[i]` of a structure.
        name: Cow<'static, str>,
        /// The value that was given.
        value: f64,
    },
    /// The bodies do not approach each other: no impact starts here.
    #[error(
        "approach velocity u = {u} at x1 = {x1}, v1 = {v1}, v2 = {v2} is not allowed; allowed: u > 0"
    )]
    NotApproaching {
        /// Approach velocity u = x1' cos x1 - x2'.
        u: f64,
        /// Pendulum angle.
        x1: f64,
        /// Its rate.
        v1: f64,
        /// Velocity of the oscillator.
        v2: f64,
    },
    /// The bodies overlap at the start.
    #[error(
        "the initial state is penetrating: gap function g = {gap} at x1 = {x1}, x2 = {x2}; \
         allowed: g <= 0{hint}",
        hint = word_on_radians(*x1)
    )]
    Penetrating {
        /// Value of the gap function.
        gap: f64,
        /// Pendulum angle.
        x1: f64,
        /// Oscillator displacement.
        x2: f64,
    },
    /// The start of a structure has another number of coordinates or velocities.
    #[error("initial has {given} numbers in {name}; allowed: {expected}")]
    Shape {
        /// q or v.
        name: &'static str,
        /// How many there are,
        given: usize,
        /// and should be.
        expected: usize,
    },
    /// A stop is penetrated at the start.
    #[error(
        "the initial state is penetrating: gap function g = {gap} of stops[{stop}]; allowed: g <= 0"
    )]
    PenetratesStop {
        /// Which stop.
        stop: usize,
        /// Value of its gap function.
        gap: f64,
    },
    /// One of several starts cannot be used.
    #[error("initial[{place}]: {error}")]
    OneOfSeveral {
        /// Its place among them.
        place: usize,
        /// Why.
        error: Box<StateError>,
    },
}

/// A word for callers who may have given degrees: angles beyond a turn are rare.
fn word_on_radians(x1: f64) -> &'static str {
    if x1.abs() > TAU { " (an angle x1 is in radians)" } else { "" }
}

/// A computation that failed, with the place where it did.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// The motion left the range of finite numbers.
    #[error(
        "the motion is not finite after t = {time}, {impacts} impacts, in the flight from {state:?}"
    )]
    NotFinite {
        /// Time at the start of the flight.
        time: f64,
        /// Impacts so far.
        impacts: u64,
        /// State at the start of the flight: (x1, v1, x2, v2), or q and v of a structure.
        state: Vec<f64>,
    },
    /// The contact search used up its step budget, or the steps of search or slide are so short
    /// that it would: the tip turns or decays beyond counting.
    #[error(
        "the contact search stalled after t = {time}, {impacts} impacts, in the flight from {state:?}"
    )]
    SearchStalled {
        /// Time at the start of the flight.
        time: f64,
        /// Impacts so far.
        impacts: u64,
        /// State at the start of the flight: (x1, v1, x2, v2), or q and v of a structure.
        state: Vec<f64>,
    },
}
