//! The stops of a structure.

use std::sync::Arc;

use super::modes::Modes;
use super::{StructureParameter, checked_vector};
use crate::model::coefficient::Coefficient;
use crate::model::error::ParameterError;
use crate::model::restitution::RestitutionCurve;
use crate::numerics::double_double::DoubleDouble;

/// A tangent whose ac - b^2 is at most this part of ac is parallel to the normal.
const PARALLEL: f64 = 1e-12;

/// A rigid one-sided stop, g = normal . q - gap - amplitude cos(omega t + phase) <= 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    normal: Vec<f64>,
    gap: f64,
    restitution: f64,
    restitution_curve: Option<Arc<RestitutionCurve>>,
    friction: f64,
    tangent: Option<Vec<f64>>,
    amplitude: f64,
    phase: f64,
}

impl Stop {
    /// A stop at rest. `normal`: (N,), a row of the structure, or a difference of two rows: two
    /// bodies that meet. `gap`: distance along it at q = 0. `restitution`: in [0, 1].
    #[must_use]
    pub fn new(normal: impl Into<Vec<f64>>, gap: f64, restitution: f64) -> Self {
        Self {
            normal: normal.into(),
            gap,
            restitution,
            restitution_curve: None,
            friction: 0.0,
            tangent: None,
            amplitude: 0.0,
            phase: 0.0,
        }
    }

    /// Coulomb's friction along `tangent`, (N,): the velocity of slip is tangent . q', in the same
    /// unit of length as normal . q', or the coefficient means nothing.
    #[must_use]
    pub fn with_friction(self, friction: f64, tangent: impl Into<Vec<f64>>) -> Self {
        Self { friction, tangent: Some(tangent.into()), ..self }
    }

    /// A coefficient of restitution that depends on the approach velocity, in place of the number.
    ///
    /// # Example
    /// ```
    /// use vibroimpact::{RestitutionCurve, Stop};
    ///
    /// let falls = RestitutionCurve::power_law(0.9, 0.01, 0.25)?;
    /// let stop = Stop::new([1.0], 0.3, 0.9).with_restitution_curve(falls);
    /// assert_eq!(stop.restitution(), 0.9);
    /// assert!((stop.restitution_curve().unwrap().at(0.16) - 0.45).abs() < 1e-15);
    /// # Ok::<(), vibroimpact::ParameterError>(())
    /// ```
    #[must_use]
    pub fn with_restitution_curve(self, curve: RestitutionCurve) -> Self {
        Self { restitution: curve.lowest(), restitution_curve: Some(Arc::new(curve)), ..self }
    }

    /// A stop that moves with the drive, by amplitude cos(omega t + phase). The phase is its own.
    #[must_use]
    pub fn moving(self, amplitude: f64, phase: f64) -> Self {
        Self { amplitude, phase, ..self }
    }

    /// n.
    #[must_use]
    pub fn normal(&self) -> &[f64] {
        &self.normal
    }

    /// Distance along the normal at q = 0.
    #[must_use]
    pub fn gap(&self) -> f64 {
        self.gap
    }

    /// Coefficient of restitution; with a curve that of the lowest impacts.
    #[must_use]
    pub fn restitution(&self) -> f64 {
        self.restitution
    }

    /// The coefficient of restitution where it depends on the approach velocity.
    #[must_use]
    pub fn restitution_curve(&self) -> Option<&RestitutionCurve> {
        self.restitution_curve.as_deref()
    }

    /// Its coefficient of restitution.
    #[inline(always)]
    #[allow(clippy::inline_always)] // a round of the lanes is compiled for several instruction sets
    pub(crate) fn coefficient(&self) -> Coefficient<'_> {
        Coefficient { number: self.restitution, curve: self.restitution_curve.as_deref() }
    }

    /// Coulomb's coefficient.
    #[must_use]
    pub fn friction(&self) -> f64 {
        self.friction
    }

    /// t, where there is friction.
    #[must_use]
    pub fn tangent(&self) -> Option<&[f64]> {
        self.tangent.as_deref()
    }

    /// Amplitude of its motion.
    #[must_use]
    pub fn amplitude(&self) -> f64 {
        self.amplitude
    }

    /// Phase of its motion at t = 0, in radians.
    #[must_use]
    pub fn phase(&self) -> f64 {
        self.phase
    }

    /// The stop at rest at g = normal . q.
    pub(super) fn homogeneous(&self) -> Self {
        Self { gap: 0.0, amplitude: 0.0, ..self.clone() }
    }

    /// The stop with another number of its own; the rest is not, nor a number of a curve that it has
    /// not.
    pub(super) fn with(
        &self,
        parameter: StructureParameter,
        value: f64,
    ) -> Result<Self, ParameterError> {
        let mut stop = self.clone();
        match parameter {
            StructureParameter::Gap(_) => stop.gap = value,
            StructureParameter::Restitution(_) => stop.restitution = value,
            StructureParameter::Friction(_) => stop.friction = value,
            StructureParameter::OfCurve(name, _) => {
                if let Some(curve) =
                    self.restitution_curve().and_then(|curve| curve.with(name, value))
                {
                    stop = stop.with_restitution_curve(curve?);
                }
            }
            StructureParameter::DriveFrequency | StructureParameter::Phase => {}
        }
        Ok(stop)
    }

    /// The same stop, its phase ahead by this angle.
    pub(super) fn turned(&self, angle: f64) -> Self {
        Self { phase: self.phase + angle, ..self.clone() }
    }

    /// Refuses what no structure could have as a stop.
    pub(crate) fn check(&self) -> Result<(), ParameterError> {
        let count = self.normal.len();
        checked_vector("normal", &self.normal, count)?;
        if let Some(tangent) = &self.tangent {
            checked_vector("tangent", tangent, count)?;
        }
        if !(self.friction.is_finite() && self.friction >= 0.0) {
            let allowed = "a finite number >= 0";
            return Err(ParameterError::number("friction", self.friction, allowed));
        }
        if self.normal.iter().all(|&value| value == 0.0) {
            let allowed = "at least one entry other than 0";
            return Err(ParameterError::new("normal", format!("{count} zeros"), allowed));
        }
        for (what, value) in
            [("gap", self.gap), ("amplitude", self.amplitude), ("phase", self.phase)]
        {
            if !value.is_finite() {
                return Err(ParameterError::number(what, value, "a finite number"));
            }
        }
        if !(0.0..=1.0).contains(&self.restitution) {
            let allowed = "a number in [0, 1]";
            return Err(ParameterError::number("restitution", self.restitution, allowed));
        }
        Ok(())
    }

    /// Whether impacts on it see the same rows as on another one.
    pub(super) fn has_rows_of(&self, other: &Self) -> bool {
        let rubs = self.friction > 0.0;
        self.normal == other.normal
            && rubs == (other.friction > 0.0)
            && (!rubs || self.tangent == other.tangent)
    }

    /// Refuses what the structure cannot have as its stop of this place.
    pub(super) fn checked(
        &self,
        place: usize,
        count: usize,
        driven: bool,
    ) -> Result<(), ParameterError> {
        let named = |what: &str| format!("stops[{place}].{what}");
        self.check().map_err(|error| of_stop(place, error))?;
        checked_vector(&named("normal"), &self.normal, count)?;
        if self.amplitude != 0.0 && !driven {
            let allowed = "0 with drive_frequency = 0: a stop moves with the drive";
            return Err(ParameterError::number(named("amplitude"), self.amplitude, allowed));
        }
        Ok(())
    }
}

/// The refusal of a number of the stop of this place.
pub(super) fn of_stop(place: usize, error: ParameterError) -> ParameterError {
    ParameterError { name: format!("stops[{place}].{}", error.name).into(), ..error }
}

/// A stop as the modes and an impact see it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StopContactRows {
    /// n . phi and t . phi of the modes.
    pub modal_normal: Vec<DoubleDouble>,
    pub modal_tangent: Vec<DoubleDouble>,
    /// M^-1 n and M^-1 t; without friction t = 0.
    pub by_normal: Vec<f64>,
    pub by_tangent: Vec<f64>,
    /// a = n M^-1 n, b = n M^-1 t, c = t M^-1 t.
    pub mobilities: [f64; 3],
}

impl StopContactRows {
    pub fn new(stop: &Stop, found: &Modes) -> Self {
        let none = vec![0.0; stop.normal.len()];
        let rows =
            [&stop.normal, stop.tangent.as_ref().filter(|_| stop.friction > 0.0).unwrap_or(&none)];
        let modal = rows.map(|row| -> Vec<DoubleDouble> {
            found
                .shapes
                .iter()
                .map(|shape| {
                    let terms = shape.iter().zip(row.iter());
                    terms.fold(DoubleDouble::ZERO, |sum, (&s, &x)| sum + s.scale(x))
                })
                .collect()
        });
        // M^-1 = sum phi phi^T.
        let mobility = |parts: &[DoubleDouble]| -> Vec<f64> {
            (0..stop.normal.len())
                .map(|k| {
                    let terms = found.shapes.iter().zip(parts);
                    let sum = |sum, (shape, &part): (&Vec<DoubleDouble>, _)| sum + shape[k] * part;
                    terms.fold(DoubleDouble::ZERO, sum).value()
                })
                .collect()
        };
        let product = |i: usize, j: usize| {
            let terms = modal[i].iter().zip(&modal[j]);
            terms.fold(DoubleDouble::ZERO, |sum, (&a, &b)| sum + a * b).value()
        };
        let (by_normal, by_tangent) = (mobility(&modal[0]), mobility(&modal[1]));
        let mobilities = [product(0, 0), product(0, 1), product(1, 1)];
        let [modal_normal, modal_tangent] = modal;
        Self { modal_normal, modal_tangent, by_normal, by_tangent, mobilities }
    }

    /// Refuses rows beyond the range of floats, and friction along a tangent that is parallel to the
    /// normal.
    pub fn checked(&self, stop: &Stop, place: usize) -> Result<(), ParameterError> {
        let [a, b, c] = self.mobilities;
        for (what, mobility) in [("normal", a), ("tangent", c)] {
            let needed = what == "normal" || stop.friction > 0.0;
            if needed && !(mobility.is_finite() && mobility > 0.0) {
                let name = format!("stops[{place}].{what}");
                let given = format!("a row x with x M^-1 x = {mobility:e}");
                let allowed = "a row for which it is a finite number > 0";
                return Err(ParameterError::new(name, given, allowed));
            }
        }
        if stop.friction > 0.0 && a * c - b * b <= PARALLEL * a * c {
            let name = format!("stops[{place}].tangent");
            let allowed = "a row that is not parallel to the normal";
            return Err(ParameterError::new(name, "one parallel to it", allowed));
        }
        Ok(())
    }
}
