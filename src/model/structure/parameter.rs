//! The numbers of a structure that are varied by name.

use crate::model::error::ParameterError;

const KNOWN: &str = "one of drive_frequency, phase; gap, restitution, friction of all stops, or of \
                     one of them, gap_0 ...";

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
        match name {
            "drive_frequency" => return Ok(Self::DriveFrequency),
            "phase" => return Ok(Self::Phase),
            _ => {}
        }
        let unknown = || ParameterError::new("name", name.to_owned(), KNOWN);
        let (number, place) = match name.split_once('_') {
            Some((number, digits)) if digits.bytes().all(|byte| byte.is_ascii_digit()) => {
                (number, Some(digits.parse::<usize>().map_err(|_| unknown())?))
            }
            _ => (name, None),
        };
        let found = match number {
            "gap" => Self::Gap(place),
            "restitution" => Self::Restitution(place),
            "friction" => Self::Friction(place),
            _ => return Err(unknown()),
        };
        if place.is_some_and(|place| place >= stops) {
            let allowed = format!("that of one of {stops} stops");
            return Err(ParameterError::new("name", name.to_owned(), allowed));
        }
        Ok(found)
    }
}
