//! Periodic motions of structures, by Newton's method on the stroboscopic map, with the exact
//! derivative along the motion (tangent/structure.rs).

use nalgebra::{Complex, DMatrix, DVector};

use crate::analysis::structure_shooting::numbers;
use crate::analysis::tolerances::{MOST_RETURN_STEPS, MULTIPLIER_NOISE, RESIDUAL_NOISE, SINGULAR};
use crate::model::error::{ParameterError, StateError};
use crate::model::structure::{Structure, StructureState};
use crate::numerics::EPS;
use crate::numerics::cancel::CancelToken;
use crate::simulate::Horizon;
use crate::tangent::structure::{
    StructureDerivative, StructurePassage, StructureTangentError, structure_derivative,
};

/// Why there is no periodic motion.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StructureOrbitError {
    /// An argument is refused, or the structure of a parameter's value is.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The motion ends, or has no derivative.
    #[error(transparent)]
    Motion(#[from] StructureTangentError),
    /// The iteration ends with this residual.
    #[error("Newton's method does not converge: the motion comes back by {0:e}")]
    NotConverged(f64),
    /// A step leads to a motion that passes other events.
    #[error("the motion passes other events than the one at the start of the iteration")]
    EventsChanged,
    /// The multiplier 1: no periodic motion, or no single one.
    #[error("the derivative of the return map has the eigenvalue 1 to rounding")]
    Singular,
}

impl From<StateError> for StructureOrbitError {
    fn from(error: StateError) -> Self {
        Self::Motion(error.into())
    }
}

/// What the multipliers say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum StructureStability {
    /// All lie inside the unit circle,
    Stable,
    /// one lies outside,
    Unstable,
    /// or the largest lies on it, to rounding.
    Undecided,
}

/// A periodic motion.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureOrbit {
    /// The state at the start of a drive period.
    pub state: StructureState,
    /// Its length in drive periods.
    pub periods: u32,
    /// Largest difference of its end from its start.
    pub residual: f64,
    /// Derivative of the return map, (2N, 2N).
    pub matrix: DMatrix<f64>,
    /// Its eigenvalues, by descending modulus.
    pub multipliers: Vec<Complex<f64>>,
    /// Rounding of their moduli: what they change by in Newton's last step, and what the size of
    /// the derivative says.
    pub bound: f64,
    /// What they say.
    pub stability: StructureStability,
    /// What an orbit passes,
    pub passed: Vec<StructurePassage>,
    /// and its impacts at each stop.
    pub impacts: Vec<u64>,
}

/// The periodic motion of so many drive periods near `initial`, a state that a run has settled
/// near, at the start of a period.
///
/// # Errors
/// [`StructureOrbitError`].
///
/// # Example
/// An oscillator that meets a wall once per period:
/// ```
/// use vibroimpact::{
///     CancelToken, RunOptions, Stop, Structure, StructureStability, StructureState, run,
///     structure_orbit,
/// };
///
/// let structure = Structure::builder(vec![vec![1.0]], vec![vec![1.0]])
///     .damping_ratios([0.05])
///     .drive(vec![1.0.into()], 2.0, 0.0)
///     .stop(Stop::new([1.0], 0.0, 0.7))
///     .build()?;
/// let (start, never) = (StructureState::new(&[-1.0], &[0.0]), CancelToken::never());
/// let settled = run(&structure, start, RunOptions::periods(60), &never)?.final_state.state;
/// let orbit = structure_orbit(&structure, settled, 1, &never)?;
/// assert_eq!(orbit.stability, StructureStability::Stable);
/// assert!(orbit.residual < 1e-14);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn structure_orbit(
    structure: &Structure,
    initial: StructureState,
    periods: u32,
    cancel: &CancelToken,
) -> Result<StructureOrbit, StructureOrbitError> {
    if periods == 0 || structure.drive_frequency() == 0.0 {
        let allowed = "a whole number >= 1, of a structure that is driven";
        return Err(ParameterError::new("periods", periods, allowed).into());
    }
    let mut state = initial;
    let mut best: Option<Iterate> = None;
    let mut last: Option<Vec<Complex<f64>>> = None;
    let mut changed = f64::INFINITY;
    for _ in 0..MOST_RETURN_STEPS {
        let next = match Iterate::new(structure, state.clone(), periods, cancel) {
            Ok(next) => next,
            // A step has led into a stop, by rounding where the motion is closed there.
            Err(StructureTangentError::State(_)) if best.is_some() => break,
            Err(error) => return Err(error.into()),
        };
        if let Some(best) = &best
            && next.derivative.passed != best.derivative.passed
        {
            if best.is_closed() {
                break;
            }
            return Err(StructureOrbitError::EventsChanged);
        }
        let multipliers = multipliers_of(&next.derivative.matrix);
        if let Some(last) = &last {
            changed = difference(last, &multipliers);
        }
        last = Some(multipliers);
        state = next.moved(&next.newton_step()?);
        let worse = best.as_ref().is_some_and(|best| next.residual >= best.residual);
        let closed = next.is_closed();
        if !worse {
            best = Some(next);
        }
        if worse && closed {
            break;
        }
    }
    match best {
        Some(best) if best.is_closed() => Ok(best.orbit(periods, changed)),
        best => {
            let residual = best.map_or(f64::NAN, |best| best.residual);
            Err(StructureOrbitError::NotConverged(residual))
        }
    }
}

/// A state, and where it comes back to.
struct Iterate {
    start: StructureState,
    derivative: StructureDerivative,
    residual: f64,
}

impl Iterate {
    fn new(
        structure: &Structure,
        start: StructureState,
        periods: u32,
        cancel: &CancelToken,
    ) -> Result<Self, StructureTangentError> {
        let horizon = Horizon::Periods(i64::from(periods));
        let derivative = structure_derivative(structure, start.clone(), horizon, cancel)?;
        let residual = (numbers(&derivative.state) - numbers(&start)).amax();
        Ok(Self { start, derivative, residual })
    }

    /// To rounding, which the derivative enlarges.
    fn is_closed(&self) -> bool {
        let size = numbers(&self.start).amax();
        self.residual <= RESIDUAL_NOISE * EPS * (1.0 + self.derivative.matrix.norm()) * size
    }

    fn newton_step(&self) -> Result<DVector<f64>, StructureOrbitError> {
        let residual = numbers(&self.derivative.state) - numbers(&self.start);
        solve(&self.derivative.matrix, &residual)
    }

    fn moved(&self, step: &DVector<f64>) -> StructureState {
        StructureState::of_numbers((numbers(&self.start) + step).as_slice())
    }

    fn orbit(self, periods: u32, changed: f64) -> StructureOrbit {
        let StructureDerivative { matrix, passed, impacts, .. } = self.derivative;
        let multipliers = multipliers_of(&matrix);
        let rounding = MULTIPLIER_NOISE * EPS * matrix.nrows() as f64 * matrix.norm().max(1.0);
        let bound = if changed.is_finite() { changed + rounding } else { f64::INFINITY };
        let largest = multipliers.first().map_or(0.0, |largest| largest.norm());
        let stability = if largest < 1.0 - bound {
            StructureStability::Stable
        } else if largest > 1.0 + bound {
            StructureStability::Unstable
        } else {
            StructureStability::Undecided
        };
        StructureOrbit {
            state: self.start,
            periods,
            residual: self.residual,
            matrix,
            multipliers,
            bound,
            stability,
            passed,
            impacts,
        }
    }
}

/// x with (I - D) x = right.
fn solve(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Result<DVector<f64>, StructureOrbitError> {
    let count = matrix.nrows();
    let parts = (DMatrix::identity(count, count) - matrix).svd(true, true);
    let least = parts.singular_values.min();
    if least.is_nan() || least <= SINGULAR * parts.singular_values.max() {
        return Err(StructureOrbitError::Singular);
    }
    parts.solve(right, 0.0).map_err(|_| StructureOrbitError::Singular)
}

fn multipliers_of(matrix: &DMatrix<f64>) -> Vec<Complex<f64>> {
    let mut found: Vec<_> = matrix.complex_eigenvalues().iter().copied().collect();
    found.sort_by(|a, b| b.norm().total_cmp(&a.norm()).then(b.im.total_cmp(&a.im)));
    found
}

/// Largest difference of the moduli.
fn difference(a: &[Complex<f64>], b: &[Complex<f64>]) -> f64 {
    a.iter().zip(b).fold(0.0, |most, (a, b)| most.max((a.norm() - b.norm()).abs()))
}
