//! Directions in which a structure and a start are varied: the derivatives of their fields by one
//! number.

use nalgebra::{Complex, DMatrix};

use super::damping::Damping;
use super::{Stop, Structure, StructureParameter, StructureState, checked_matrix, checked_vector};
use crate::model::error::ParameterError;
use crate::model::restitution::{MOST_NUMBERS, RestitutionCurve};

/// How the numbers of a stop vary.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StopVariation {
    /// Derivative of its gap.
    pub gap: f64,
    /// Derivative of its restitution.
    pub restitution: f64,
    /// Derivative of its friction.
    pub friction: f64,
    /// of the amplitude of its motion,
    pub amplitude: f64,
    /// Derivative of its phase.
    pub phase: f64,
    /// Derivatives of the numbers of its restitution curve, in their order.
    pub of_curve: [f64; MOST_NUMBERS],
}

/// The derivatives of the fields of a structure, and of a start, by one number; what is left out
/// does not depend on it.
///
/// # Example
/// The spring between two masses, and the one of the second mass to ground:
/// ```
/// use vibroimpact::Variation;
///
/// let between = Variation {
///     stiffness: Some(vec![vec![1.0, -1.0], vec![-1.0, 1.0]]),
///     ..Variation::default()
/// };
/// let second = Variation {
///     stiffness: Some(vec![vec![0.0, 0.0], vec![0.0, 1.0]]),
///     ..Variation::default()
/// };
/// assert_ne!(between, second);
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Variation {
    /// Of M, (N, N), symmetric.
    pub mass: Option<Vec<Vec<f64>>>,
    /// Of K, (N, N), symmetric.
    pub stiffness: Option<Vec<Vec<f64>>>,
    /// Of C, (N, N), symmetric, beside that of damping ratios.
    pub damping: Option<Vec<Vec<f64>>>,
    /// Of the damping ratios, (N,), of a structure that has such; C then varies with M and K, too.
    pub damping_ratios: Option<Vec<f64>>,
    /// Of c, (N,).
    pub static_load: Option<Vec<f64>>,
    /// Of F, (N,).
    pub drive_amplitude: Option<Vec<Complex<f64>>>,
    /// Of omega.
    pub drive_frequency: f64,
    /// Of the phase of the drive.
    pub phase: f64,
    /// Of the stops; none, or one each.
    pub stops: Vec<StopVariation>,
    /// Of the start.
    pub start: Option<StructureState>,
}

/// A variation of M, C, K and loads in the modes, which stay as they are.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct ModalVariation {
    pub mass: Option<DMatrix<f64>>,
    pub damping: Option<DMatrix<f64>>,
    pub stiffness: Option<DMatrix<f64>>,
    /// Of the constant load, and of the complex drive.
    pub load: Option<Vec<f64>>,
    pub drive: Option<Vec<Complex<f64>>>,
}

const KNOWN: &str = "drive_frequency, phase; gap, restitution, friction of all stops, or of one of \
                     them, gap_0 ...; numbers of their restitution curves, r_1, r_1_0 ...; an entry \
                     and its mirror image of a matrix, stiffness[0, 1] ...; a component of the start, \
                     q_0, v_0 ...";

impl Variation {
    /// The variation of this name: a number of [`StructureParameter`]; `"stiffness[0, 1]"`,
    /// `"mass[1, 1]"`, `"damping[0, 0]"`, an entry with its mirror image; `"q_0"` or `"v_1"`, a
    /// component of the start.
    ///
    /// # Errors
    /// [`ParameterError`] for another name.
    pub fn named(name: &str, structure: &Structure) -> Result<Self, ParameterError> {
        let count = structure.coordinates();
        if let Some((matrix, place)) = entry(name) {
            let [i, j] =
                place.filter(|place| place.iter().all(|&i| i < count)).ok_or_else(|| {
                    let allowed = format!("two numbers of {count} coordinates in brackets");
                    ParameterError::new("names", name, allowed)
                })?;
            let mut one = vec![vec![0.0; count]; count];
            (one[i][j], one[j][i]) = (1.0, 1.0);
            let one = Some(one);
            return Ok(match matrix {
                "mass" => Self { mass: one, ..Self::default() },
                "damping" => Self { damping: one, ..Self::default() },
                _ => Self { stiffness: one, ..Self::default() },
            });
        }
        if let Some((of_rate, place)) = component(name) {
            let place = place.filter(|&place| place < count).ok_or_else(|| {
                ParameterError::new("names", name, format!("that of one of {count} coordinates"))
            })?;
            let mut start = StructureState::new(&vec![0.0; count], &vec![0.0; count]);
            (if of_rate { &mut start.v } else { &mut start.q })[place] = 1.0;
            return Ok(Self { start: Some(start), ..Self::default() });
        }
        structure.named(name).map(|parameter| Self::of(parameter, structure)).map_err(|why| {
            let stops = structure.stops().len();
            why.error("names", name, (KNOWN, stops))
        })
    }

    /// By one of the numbers that a structure is varied by.
    fn of(parameter: StructureParameter, structure: &Structure) -> Self {
        let varied = |stop: &Stop| {
            let mut own = StopVariation::default();
            match parameter {
                StructureParameter::Gap(_) => own.gap = 1.0,
                StructureParameter::Restitution(_) => own.restitution = 1.0,
                StructureParameter::Friction(_) => own.friction = 1.0,
                StructureParameter::OfCurve(number, _) => {
                    if let Some(place) = stop.coefficient().place_of(number) {
                        own.of_curve[place] = 1.0;
                    }
                }
                StructureParameter::DriveFrequency | StructureParameter::Phase => {}
            }
            own
        };
        match parameter {
            StructureParameter::DriveFrequency => Self { drive_frequency: 1.0, ..Self::default() },
            StructureParameter::Phase => Self { phase: 1.0, ..Self::default() },
            _ => {
                let which = parameter.stop();
                let stops = structure.stops().iter().enumerate();
                let at = |(place, stop)| {
                    let is_of = which.is_none_or(|which| which == place);
                    if is_of { varied(stop) } else { StopVariation::default() }
                };
                Self { stops: stops.map(at).collect(), ..Self::default() }
            }
        }
    }

    /// Refuses what a structure cannot be varied by; `name` is that of the number.
    ///
    /// # Errors
    /// [`ParameterError`] names the field, its value and what is allowed.
    pub fn check(&self, name: &str, structure: &Structure) -> Result<(), ParameterError> {
        let count = structure.coordinates();
        let of = |field: &str| format!("{name}: {field}");
        let matrices =
            [("mass", &self.mass), ("stiffness", &self.stiffness), ("damping", &self.damping)];
        for (field, matrix) in matrices {
            if let Some(matrix) = matrix {
                checked_matrix(&of(field), matrix, count)?;
            }
        }
        for (field, row) in
            [("damping_ratios", &self.damping_ratios), ("static_load", &self.static_load)]
        {
            if let Some(row) = row {
                checked_vector(&of(field), row, count)?;
            }
        }
        if let Some(drive) = &self.drive_amplitude {
            let (re, im): (Vec<f64>, Vec<f64>) = drive.iter().map(|f| (f.re, f.im)).unzip();
            checked_vector(&of("drive_amplitude"), &re, count)?;
            checked_vector(&of("drive_amplitude"), &im, count)?;
        }
        if let Some(start) = &self.start {
            checked_vector(&of("q"), &start.q, count)?;
            checked_vector(&of("v"), &start.v, count)?;
        }
        if self.damping_ratios.is_some() && matches!(structure.damping, Damping::Matrix(_)) {
            let allowed = "nothing: the damping of this structure is a matrix";
            return Err(ParameterError::new(of("damping_ratios"), "numbers", allowed));
        }
        let driven = structure.drive_frequency() > 0.0;
        for (field, rate) in [("drive_frequency", self.drive_frequency), ("phase", self.phase)] {
            self.finite(&of(field), rate, driven)?;
        }
        if self.drive_amplitude.is_some() && !driven {
            let allowed = "nothing with drive_frequency = 0: the drive stands still";
            return Err(ParameterError::new(of("drive_amplitude"), "numbers", allowed));
        }
        if !(self.stops.is_empty() || self.stops.len() == structure.stops().len()) {
            let allowed = format!("{} of them", structure.stops().len());
            let given = format!("{} stops", self.stops.len());
            return Err(ParameterError::new(of("stops"), given, allowed));
        }
        for (place, (stop, at)) in self.stops.iter().zip(structure.stops()).enumerate() {
            let of = |field: &str| of(&format!("{field}_{place}"));
            let StopVariation { gap, restitution, friction, amplitude, phase, of_curve } = *stop;
            for (field, rate) in
                [("gap", gap), ("restitution", restitution), ("friction", friction)]
            {
                self.finite(&of(field), rate, true)?;
            }
            for (field, rate) in [("amplitude", amplitude), ("phase", phase)] {
                self.finite(&of(field), rate, driven)?;
            }
            let names = at.restitution_curve().map_or_else(Vec::new, RestitutionCurve::names);
            for (i, rate) in of_curve.into_iter().enumerate() {
                let Some(name) = names.get(i) else {
                    if rate != 0.0 {
                        let allowed = format!("numbers of its restitution curve: {}", names.len());
                        return Err(ParameterError::number(of("of_curve"), rate, allowed));
                    }
                    continue;
                };
                self.finite(&of(name), rate, true)?;
            }
            if restitution != 0.0 && !names.is_empty() {
                let allowed = format!("the numbers of its restitution curve: {}", names.join(", "));
                return Err(ParameterError::number(of("restitution"), restitution, allowed));
            }
            if friction != 0.0 && at.friction() == 0.0 {
                let allowed = "a stop with friction > 0, however small: without any it has no slip";
                return Err(ParameterError::number(of("friction"), at.friction(), allowed));
            }
        }
        Ok(())
    }

    #[allow(clippy::unused_self)] // beside its caller
    fn finite(&self, name: &str, rate: f64, driven: bool) -> Result<(), ParameterError> {
        if !rate.is_finite() {
            return Err(ParameterError::number(name.to_owned(), rate, "a finite number"));
        }
        if rate != 0.0 && !driven {
            let allowed = "0 with drive_frequency = 0: the drive stands still";
            return Err(ParameterError::number(name.to_owned(), rate, allowed));
        }
        Ok(())
    }

    /// How a stop varies.
    pub(crate) fn stop(&self, stop: usize) -> StopVariation {
        self.stops.get(stop).copied().unwrap_or_default()
    }

    /// In the modes of a structure, which stay as they are.
    pub(crate) fn in_modes(&self, structure: &Structure) -> ModalVariation {
        let modes = structure.modes();
        let count = modes.len();
        let shapes = DMatrix::from_fn(count, count, |k, i| modes[i].shape[k]);
        let congruent = |given: &Vec<Vec<f64>>| {
            let matrix = DMatrix::from_fn(count, count, |i, j| given[i][j]);
            shapes.transpose() * matrix * &shapes
        };
        let mass = self.mass.as_ref().map(congruent);
        let stiffness = self.stiffness.as_ref().map(congruent);
        let along = |row: &[f64]| -> Vec<f64> {
            modes.iter().map(|m| m.shape.iter().zip(row).map(|(s, x)| s * x).sum()).collect()
        };
        let drive = self.drive_amplitude.as_ref().map(|drive| {
            let of = |mode: &super::Mode| mode.shape.iter().zip(drive).map(|(s, f)| f * *s).sum();
            modes.iter().map(of).collect()
        });
        let mut damping = self.damping.as_ref().map(congruent);
        if !matches!(structure.damping, Damping::Matrix(_)) {
            let moved = self.by_ratios(structure, mass.as_ref(), stiffness.as_ref());
            damping = match (damping, moved) {
                (Some(own), Some(moved)) => Some(own + moved),
                (own, moved) => own.or(moved),
            };
        }
        ModalVariation {
            mass,
            damping,
            stiffness,
            load: self.static_load.as_deref().map(along),
            drive,
        }
    }

    /// How C = M Phi diag(2 zeta w) Phi^T M varies with the ratios, and at fixed ones with M and K: as a
    /// function of the matrix M^-1 K, by divided differences of 2 zeta w over w^2.
    fn by_ratios(
        &self,
        structure: &Structure,
        mass: Option<&DMatrix<f64>>,
        stiffness: Option<&DMatrix<f64>>,
    ) -> Option<DMatrix<f64>> {
        let modes = structure.modes();
        let damped = modes.iter().any(|mode| mode.decay_rate != 0.0);
        let moves = damped && (mass.is_some() || stiffness.is_some());
        if !moves && self.damping_ratios.is_none() {
            return None;
        }
        let frequency = |i: usize| modes[i].frequency.value();
        let ratio = |i: usize| {
            if frequency(i) > 0.0 { modes[i].decay_rate / frequency(i) } else { 0.0 }
        };
        let entry = |of: Option<&DMatrix<f64>>, i, j| of.map_or(0.0, |of| of[(i, j)]);
        Some(DMatrix::from_fn(modes.len(), modes.len(), |i, j| {
            let (k, m) = (entry(stiffness, i, j), entry(mass, i, j));
            let (v, w) = (frequency(i), frequency(j));
            let (own, other) = (ratio(i), ratio(j));
            if i == j {
                let by_ratio = self.damping_ratios.as_ref().map_or(0.0, |ratios| ratios[i]);
                let turned = if w > 0.0 { own * k / w } else { 0.0 };
                return turned + own * w * m + 2.0 * w * by_ratio;
            }
            // Equal frequencies have equal ratios.
            let alike = own == other || v == w;
            if alike {
                let sum = v + w;
                return if sum > 0.0 { 2.0 * own * (k + m * v * w) / sum } else { 0.0 };
            }
            let apart = (v - w) * (v + w);
            2.0 * (k * (own * v - other * w) + m * v * w * (other * v - own * w)) / apart
        }))
    }
}

/// Matrix and place of a name as `stiffness[0, 1]`; no place if there is none.
fn entry(name: &str) -> Option<(&str, Option<[usize; 2]>)> {
    let (matrix, rest) = name.split_once('[')?;
    if !["mass", "stiffness", "damping"].contains(&matrix) {
        return None;
    }
    let digits = |text: &str| {
        let text = text.trim();
        let plain = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        plain.then(|| text.parse::<usize>().ok()).flatten()
    };
    let place = || {
        let (i, j) = rest.strip_suffix(']')?.split_once(',')?;
        Some([digits(i)?, digits(j)?])
    };
    Some((matrix, place()))
}

/// Whether a name as `q_0` is that of a rate, and its place; no place if there is none.
fn component(name: &str) -> Option<(bool, Option<usize>)> {
    let (of, digits) = name.split_once('_')?;
    let of_rate = match of {
        "q" => false,
        "v" => true,
        _ => return None,
    };
    let plain = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    Some((of_rate, plain.then(|| digits.parse().ok()).flatten()))
}
