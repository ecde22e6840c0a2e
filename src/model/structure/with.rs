//! A structure with some of its numbers changed: its modes, which take most of the time to make one,
//! are those that it has.

use super::stop::of_stop;
use super::{Simultaneous, StopContactRows, Structure, StructureParameter};
use crate::model::error::ParameterError;

impl Structure {
    /// The structure with one number changed: its `drive_frequency` or `phase`; `gap`,
    /// `restitution` or `friction` of all stops, or of one of them, `gap_0`; a number of the restitution
    /// curve of those stops that have it, or of one, `r_1_0`. It is the same, bit by bit, as one built
    /// with that number.
    ///
    /// # Errors
    /// [`ParameterError`] for another name, or a value out of range.
    ///
    /// # Example
    /// ```
    /// use vibroimpact::{Stop, Structure};
    ///
    /// let structure = Structure::builder(vec![vec![1.0]], vec![vec![1.0]])
    ///     .stop(Stop::new([1.0], 0.3, 0.8))
    ///     .build()?;
    /// assert_eq!(structure.with("gap_0", 0.5)?.stops()[0].gap(), 0.5);
    /// assert!(structure.with("gap_1", 0.5).is_err());
    /// # Ok::<(), vibroimpact::ParameterError>(())
    /// ```
    pub fn with(&self, name: &str, value: f64) -> Result<Self, ParameterError> {
        let mut changed = self.clone();
        let parameter = self.parameter(name)?;
        match parameter {
            StructureParameter::DriveFrequency => {
                if !(0.0..=1e50).contains(&value) {
                    let allowed = "a number in [0, 1e50]";
                    return Err(ParameterError::number("drive_frequency", value, allowed));
                }
                changed.drive_frequency = value;
                for (place, stop) in changed.stops.iter().enumerate() {
                    stop.checked(place, self.coordinates(), value > 0.0)?;
                }
            }
            StructureParameter::Phase => {
                if !value.is_finite() {
                    return Err(ParameterError::number("phase", value, "a finite number"));
                }
                changed.phase = value;
            }
            _ => {
                let all = 0..self.stops.len();
                for place in parameter.stop().map_or(all, |place| place..place + 1) {
                    changed.change_stop(place, parameter, value)?;
                }
            }
        }
        Ok(changed)
    }

    fn change_stop(
        &mut self,
        place: usize,
        parameter: StructureParameter,
        value: f64,
    ) -> Result<(), ParameterError> {
        let stop =
            self.stops[place].with(parameter, value).map_err(|error| of_stop(place, error))?;
        stop.checked(place, self.coordinates(), self.drive_frequency > 0.0)?;
        if let StructureParameter::Friction(_) = parameter {
            if stop.tangent().is_none() && value > 0.0 {
                let name = format!("stops[{place}].friction");
                let allowed = "0 for a stop without tangent";
                return Err(ParameterError::number(name, value, allowed));
            }
            if self.simultaneous == Simultaneous::Together && value > 0.0 {
                let allowed = "stop or sequence where a stop has friction > 0";
                let given = self.simultaneous.name();
                return Err(ParameterError::new("simultaneous", given, allowed));
            }
            // Without friction a stop has no tangent.
            if (value > 0.0) != (self.stops[place].friction() > 0.0) {
                let contact = StopContactRows::new(&stop, &self.found);
                contact.checked(&stop, place)?;
                self.contacts[place] = contact;
            }
        }
        self.stops[place] = stop;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::structure::{Stop, StructureBuilder};

    const NUMBERS: [(&str, f64); 6] = [
        ("drive_frequency", 1.7),
        ("phase", 0.3),
        ("gap", 0.25),
        ("gap_1", 0.75),
        ("restitution_0", 0.5),
        ("friction_0", 0.2),
    ];

    fn built(changes: &[(&str, f64)]) -> Structure {
        builder(changes).build().unwrap()
    }

    fn builder(changes: &[(&str, f64)]) -> StructureBuilder {
        let value = |name: &str, own: f64| {
            changes.iter().find(|(changed, _)| *changed == name).map_or(own, |&(_, value)| value)
        };
        let stop = |place: usize, normal: [f64; 2], gap, restitution| {
            let own = |name: &str, number| value(&format!("{name}_{place}"), value(name, number));
            Stop::new(normal, own("gap", gap), own("restitution", restitution))
                .with_friction(own("friction", 0.0), [normal[1] + 0.5, 1.0])
                .moving(0.1, 0.2)
        };
        Structure::builder(
            vec![vec![1.0, 0.1], vec![0.1, 2.0]],
            vec![vec![2.0, -1.0], vec![-1.0, 3.0]],
        )
        .damping(vec![vec![0.1, 0.0], vec![0.0, 0.4]])
        .drive(vec![1.0.into(), 0.5.into()], value("drive_frequency", 1.1), value("phase", 0.0))
        .stop(stop(0, [1.0, -1.0], 0.3, 0.8))
        .stop(stop(1, [0.0, 1.0], 0.4, 0.7))
    }

    #[test]
    fn what_is_built_like_another_is_the_same() {
        let other = built(&[]);
        for change in NUMBERS {
            let alike = builder(&[change]).like(&other).build();
            assert_eq!(alike, builder(&[change]).build(), "{change:?}");
        }
        let weak = vec![vec![0.1, 0.05], vec![0.05, 0.4]];
        for make in [
            |it: StructureBuilder, _: &[Vec<f64>]| it.damping_ratios([0.1, 0.2]),
            |it: StructureBuilder, weak: &[Vec<f64>]| it.damping(weak.to_vec()),
            |it: StructureBuilder, _: &[Vec<f64>]| it.stop(Stop::new([1.0, 1.0], 0.5, 0.5)),
            |it: StructureBuilder, _: &[Vec<f64>]| it.static_load([0.1, 0.2]),
        ] {
            let made = || make(builder(&[]), &weak);
            let alone = made().build().unwrap();
            assert_eq!(made().like(&other).build().unwrap(), alone);
            assert_eq!(made().like(&alone).build().unwrap(), alone);
            assert_eq!(builder(&[]).like(&alone).build().unwrap(), other);
        }
        // Of other matrices nothing is taken over.
        let heavy = || Structure::builder(vec![vec![2.0]], vec![vec![1.0]]);
        assert_eq!(heavy().like(&other).build(), heavy().build());
        let ratios = |given: [f64; 2]| builder(&[]).damping_ratios(given);
        let damped = ratios([0.1, 0.1]).build().unwrap();
        assert_eq!(ratios([0.1, 0.1]).like(&damped).build(), Ok(damped.clone()));
        assert_eq!(ratios([0.1, 0.2]).like(&damped).build(), ratios([0.1, 0.2]).build());
        // The matrix of these ratios, given as one, is another damping.
        let matrix = || builder(&[]).damping(damped.damping());
        assert_eq!(matrix().like(&damped).build(), matrix().build());
    }

    #[test]
    fn a_changed_structure_is_the_one_that_is_built_with_the_number() {
        for change in NUMBERS {
            assert_eq!(built(&[]).with(change.0, change.1), Ok(built(&[change])), "{change:?}");
        }
        let rubbing = built(&[("friction_0", 0.2)]);
        assert_eq!(rubbing.with("friction_0", 0.0), Ok(built(&[])));
        assert_eq!(rubbing.with("friction", 0.0), Ok(built(&[])));
    }

    #[test]
    fn bad_names_and_values_are_refused_by_name() {
        let structure = built(&[]);
        let refused = |name: &str, value: f64| structure.with(name, value).unwrap_err().to_string();
        assert!(refused("mass", 1.0).contains("drive_frequency, phase"));
        assert!(refused("gap_x", 1.0).contains("gap_0"));
        assert!(refused("gap_2", 1.0).contains("one of 2 stops"));
        assert!(refused("gap_0", f64::NAN).contains("stops[0].gap"));
        assert!(refused("restitution", 1.5).contains("stops[0].restitution"));
        assert!(refused("drive_frequency", -1.0).contains("drive_frequency"));
        // A stop moves with the drive.
        assert!(refused("drive_frequency", 0.0).contains("stops[0].amplitude"));
        assert!(refused("phase", f64::INFINITY).contains("phase"));
    }
}
