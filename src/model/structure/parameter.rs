//! The numbers of a structure that are varied by name.

use super::{Stop, Structure};
use crate::model::error::ParameterError;
use crate::model::restitution::RestitutionCurve;

const KNOWN: &str = "one of drive_frequency, phase; gap, restitution, friction of all stops, or of \
                     one of them, gap_0 ...; where the restitution is a curve, its numbers, r_1, \
                     r_low ... of all stops that have it, or of one, r_1_0, r_low_0 ...";

/// A number that a structure is varied by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StructureParameter {
    /// omega.
    DriveFrequency,
    /// Phase of the drive at t = 0.
    Phase,
    /// Gap of one stop, or of all.
    Gap(Option<usize>),
    /// Coefficient of restitution.
    Restitution(Option<usize>),
    /// Coefficient of friction.
    Friction(Option<usize>),
    /// A number of the restitution curve, by its name.
    OfCurve(&'static str, Option<usize>),
}

/// Why a name is that of no number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Misnamed {
    /// There is no such number.
    Unknown,
    /// There is no such stop.
    Stop,
    /// The stops have another restitution; what they have.
    Restitution(String),
}

impl Misnamed {
    /// The error of a parameter that holds the name; `known`: the names that there are.
    pub fn error(
        self,
        parameter: &'static str,
        name: &str,
        (known, stops): (&'static str, usize),
    ) -> ParameterError {
        let allowed = match self {
            Self::Unknown => known.to_owned(),
            Self::Stop => format!("that of one of {stops} stops"),
            Self::Restitution(allowed) => allowed,
        };
        ParameterError::new(parameter, name, allowed)
    }
}

impl StructureParameter {
    /// The parameter of this name, of a structure with so many stops.
    ///
    /// # Errors
    /// [`ParameterError`] if there is none.
    ///
    /// # Example
    /// ```
    /// use vibroimpact::StructureParameter;
    ///
    /// assert_eq!(StructureParameter::from_name("gap_1", 2)?, StructureParameter::Gap(Some(1)));
    /// assert!(StructureParameter::from_name("gap_2", 2).is_err());
    /// # Ok::<(), vibroimpact::ParameterError>(())
    /// ```
    pub fn from_name(name: &str, stops: usize) -> Result<Self, ParameterError> {
        Self::named(name, stops).map_err(|why| why.error("name", name, (KNOWN, stops)))
    }

    /// The same; why there is none.
    pub(super) fn named(name: &str, stops: usize) -> Result<Self, Misnamed> {
        match name {
            "drive_frequency" => return Ok(Self::DriveFrequency),
            "phase" => return Ok(Self::Phase),
            _ => {}
        }
        if let Some(number) = RestitutionCurve::known(name) {
            return Ok(Self::OfCurve(number, None));
        }
        let (number, place) = match name.rsplit_once('_') {
            Some((number, digits)) if digits.bytes().all(|byte| byte.is_ascii_digit()) => {
                (number, Some(digits.parse::<usize>().map_err(|_| Misnamed::Unknown)?))
            }
            _ => (name, None),
        };
        let found = match number {
            "gap" => Self::Gap(place),
            "restitution" => Self::Restitution(place),
            "friction" => Self::Friction(place),
            _ => {
                let number = RestitutionCurve::known(number).filter(|_| place.is_some());
                Self::OfCurve(number.ok_or(Misnamed::Unknown)?, place)
            }
        };
        if place.is_some_and(|place| place >= stops) {
            return Err(Misnamed::Stop);
        }
        Ok(found)
    }

    /// The stop whose number it is; none: of all, or of no stop.
    #[must_use]
    pub fn stop(&self) -> Option<usize> {
        match *self {
            Self::DriveFrequency | Self::Phase => None,
            Self::Gap(stop)
            | Self::Restitution(stop)
            | Self::Friction(stop)
            | Self::OfCurve(_, stop) => stop,
        }
    }
}

impl Structure {
    /// Its number of this name.
    ///
    /// # Errors
    /// [`ParameterError`] if it has none: `restitution` is one of stops where it is a number, the
    /// numbers of a curve of stops where it is that curve.
    pub fn parameter(&self, name: &str) -> Result<StructureParameter, ParameterError> {
        let stops = self.stops().len();
        self.named(name).map_err(|why| why.error("name", name, (KNOWN, stops)))
    }

    /// The same; why it has none.
    pub(super) fn named(&self, name: &str) -> Result<StructureParameter, Misnamed> {
        let stops = self.stops();
        let parameter = StructureParameter::named(name, stops.len())?;
        let mut of = match parameter.stop() {
            Some(stop) => stops[stop..=stop].iter(),
            None => stops.iter(),
        };
        match parameter {
            StructureParameter::Restitution(_) => {
                let Some(curve) = of.find_map(Stop::restitution_curve) else {
                    return Ok(parameter);
                };
                let names = curve.names().join(", ");
                let allowed = format!("the numbers of the restitution curve of a stop: {names}");
                Err(Misnamed::Restitution(allowed))
            }
            StructureParameter::OfCurve(number, _) => {
                if of.any(|stop| stop.coefficient().place_of(number).is_some()) {
                    return Ok(parameter);
                }
                let allowed = "that of a stop whose restitution is a curve with this number";
                Err(Misnamed::Restitution(allowed.to_owned()))
            }
            _ => Ok(parameter),
        }
    }
}
