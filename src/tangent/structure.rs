//! The derivative of the motion of a structure by where it starts (docs/theory.md, sections 7 and
//! 12), along the events that a simulation passes:
//!
//! ```text
//! flight, contact   D -> Phi D, the motion of the structure without loads, drive and gaps
//! impact            S = R + (F+ - R F- - dR/dt)(grad g)^T/g'-, as below
//! slip ends         t . q' = 0, R = 1
//! release           the force is 0, or friction at its limit where slip begins: F+ = F-, no change
//! bounces end       the contact that the last one closes at once (chatter.rs)
//! ```
//!
//! At an event the perturbations are those of the state at the event's own time, E = D + F- dt with
//! dt = -(dh . D)/h'; they change as the state does, and D = E - F+ dt after it. So several impacts
//! at one instant, a plastic one that ends in contact, and a landing after chatter are no special
//! cases: F+ is that of the leg which follows in the end.

mod changes;
mod chatter;
mod equation;
mod forced;
mod impact;
mod modes;
mod perturbed;
mod rates;
mod samples;
mod varied;

use std::sync::Arc;

use nalgebra::DMatrix;

pub(crate) use impact::{StopInRegime, direction_of};
pub(crate) use perturbed::Perturbed;
pub(crate) use rates::{Linearised, add_moved};

use crate::model::error::{SimulationError, StateError};
use crate::model::structure::{Structure, StructureState};
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::StopReason;
use crate::simulate::structure::{StructureEvent, StructureMode};
use crate::simulate::{Horizon, ModelEvent, Simulation};

/// Why a motion of a structure has no derivative.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StructureTangentError {
    /// The start is refused.
    #[error(transparent)]
    State(#[from] StateError),
    /// The computation of the motion failed.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The motion ends.
    #[error("the motion ends: {}", .0.name())]
    Stopped(StopReason),
    /// Stops that act on each other are met at one instant: nearby motions meet them one after
    /// another, in either order.
    #[error("stops {0} and {1}, which act on each other, are met at one instant, t = {2}")]
    Simultaneous(usize, usize, f64),
    /// The chatter at a stop has no limit whose derivative could be computed: its stop, its end, and
    /// the largest derivative before it.
    #[error(
        "the chatter at stop {0} that ends at t = {1} has no derivative that could be computed: \
         bounces on several stops, as a rule, or derivatives too large before it, as after a chaotic \
         transient; the largest was {2:.1e}"
    )]
    Chatter(usize, f64, f64),
    /// The structure is damped too strongly for derivatives by its equation.
    #[error("damped too strongly for derivatives by its equation, in the leg from t = {0}")]
    Damping(f64),
    /// A stop is reached without velocity and without chatter: nearby motions do not reach it.
    #[error("a stop is reached without velocity at t = {0}")]
    Landing(f64),
}

/// What happened at an event, as far as motions of one kind agree in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum StructurePassage {
    /// An impact at this stop.
    Impact(usize),
    /// Complete chatter at it.
    Chatter(usize),
    /// It closes, or how it is held changes.
    Closed(usize, Option<StructureMode>),
    /// It opens.
    Release(usize),
}

impl StructurePassage {
    pub(crate) fn of(event: &StructureEvent) -> Option<Self> {
        match event {
            StructureEvent::Impact(e) => Some(Self::Impact(e.impact.stop)),
            StructureEvent::Chatter(e) => Some(Self::Chatter(e.stop)),
            StructureEvent::Closed(e) => Some(Self::Closed(e.stop, e.mode)),
            StructureEvent::Release(e) => Some(Self::Release(e.stop)),
            StructureEvent::Graze(_) | StructureEvent::Stop(_) => None,
        }
    }
}

/// A motion of a structure over some time, with its derivative.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureDerivative {
    /// The state at the end.
    pub state: StructureState,
    /// Its derivative by the start, (2N, 2N): rows and columns q, then q'.
    pub matrix: DMatrix<f64>,
    /// Dimension of the states that nearby motions reach: less than 2N where contact, stick or a
    /// plastic impact has taken some away.
    pub rank: usize,
    /// What was passed on the way. The impacts that lead into chatter are not told: how many there
    /// are is a matter of tolerance.
    pub passed: Vec<StructurePassage>,
    /// Impacts at each stop; those left out in chatter are not counted.
    pub impacts: Vec<u64>,
}

/// The motion from `initial` at t = 0 up to a horizon, with the derivative of its end by all 2N
/// numbers of the start. A start on a stop at rest stands for the starts near it that land there.
///
/// # Errors
/// [`StructureTangentError`] if the motion ends before, or passes what has no derivative.
///
/// # Example
/// ```
/// use vibroimpact::tangent::structure::structure_derivative;
/// use vibroimpact::{CancelToken, Horizon, Stop, Structure, StructureState};
///
/// // A ball that is thrown at a wall comes back by -r; hit later, it also comes back later.
/// let ball = Structure::builder(vec![vec![1.0]], vec![vec![0.0]])
///     .stop(Stop::new([1.0], 1.0, 0.5))
///     .build()?;
/// let start = StructureState::new(&[0.0], &[1.0]);
/// let never = CancelToken::never();
/// let found = structure_derivative(&ball, start, Horizon::Time(2.0), &never)?;
/// assert!((found.matrix[(0, 0)] + 0.5).abs() < 1e-15);
/// assert!((found.matrix.determinant() - 0.25).abs() < 1e-15);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn structure_derivative(
    structure: &Structure,
    initial: StructureState,
    horizon: Horizon,
    cancel: &CancelToken,
) -> Result<StructureDerivative, StructureTangentError> {
    let all = 2 * structure.coordinates();
    let mut simulation = Simulation::new(structure, initial)?.until(horizon).cancel_with(cancel);
    let linearised = Arc::new(Linearised::new(structure));
    let start = simulation.checkpoint().anchor.clock;
    let mut perturbed = Perturbed::new(linearised, start, DMatrix::identity(all, all));
    let mut passed = Vec::new();
    let mut impacts = vec![0; structure.stops().len()];
    let state = loop {
        let Some(event) = perturbed.advance(&mut simulation)? else { continue };
        if let StructureEvent::Chatter(e) = &event {
            while passed.last() == Some(&StructurePassage::Impact(e.stop)) {
                passed.pop();
            }
        }
        if let StructureEvent::Impact(e) = &event {
            impacts[e.impact.stop] += 1;
        }
        passed.extend(StructurePassage::of(&event));
        if let Some(stop) = event.as_stop() {
            if !stop.reason.reached_the_end() {
                return Err(StructureTangentError::Stopped(stop.reason));
            }
            break stop.state.clone();
        }
    };
    let skips = simulation.checkpoint().skips();
    let end = if skips { perturbed.within_chatter(&simulation)? } else { perturbed };
    let rank = end.rank();
    Ok(StructureDerivative { state, matrix: end.into_matrix(), rank, passed, impacts })
}
