//! Any linear structure with rigid stops (docs/structures.md): N coordinates q,
//!
//! ```text
//! M q'' + C q' + K q = c + Re(F e^{i psi}) - (impulses and forces of the stops)
//! psi = omega t + phi,   g_j = n_j . q - gap_j - A_j cos(omega t + phi_j) <= 0
//! ```
//!
//! with M positive definite, K and C positive semidefinite.

mod damping;
mod modes;
mod pairs;
mod parameter;
mod simultaneous;
mod state;
mod stop;
mod variation;
mod with;

use std::sync::Arc;

use nalgebra::Complex;

use crate::model::error::ParameterError;
use crate::model::parameters::ImpactLaw;
use crate::numerics::dense::Matrix;
use crate::numerics::double_double::DoubleDouble;
use damping::{Damping, ModalDamping};
use modes::{Modes, modes};
pub use parameter::StructureParameter;
pub use simultaneous::Simultaneous;
pub(crate) use state::largest_number;
pub use state::{Coordinates, StructureState};
pub use stop::Stop;
pub(crate) use stop::StopContactRows;
pub(crate) use variation::ModalVariation;
pub use variation::{StopVariation, Variation};

/// Coordinates at most: the modes of so many take seconds, a time that grows with its cube.
const MOST_COORDINATES: usize = 256;
/// Sizes of masses and of the largest stiffness: squares of w^2, which its modes need, stay in the
/// range of floats.
const SIZES: std::ops::RangeInclusive<f64> = 1e-50..=1e50;
/// A matrix may differ by this part of its largest entry from a symmetric one.
const SYMMETRIC: f64 = 1e-14;

/// A linear structure with rigid stops, validated. Build one with [`Structure::builder`].
///
/// Any consistent units; time is what the frequencies are measured in.
///
/// # Example
/// Two masses on springs, one of which meets a stop:
/// ```
/// use vibroimpact::{Stop, Structure};
///
/// let structure = Structure::builder(
///     vec![vec![1.0, 0.0], vec![0.0, 1.0]],
///     vec![vec![2.0, -1.0], vec![-1.0, 2.0]],
/// )
/// .damping_ratios(vec![0.01, 0.02])
/// .stop(Stop::new([0.0, 1.0], 0.3, 0.8))
/// .build()?;
/// assert!((structure.frequencies()[0] - 1.0).abs() < 1e-15);
/// # Ok::<(), vibroimpact::ParameterError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Structure {
    mass: Vec<Vec<f64>>,
    stiffness: Vec<Vec<f64>>,
    damping: Damping,
    stops: Vec<Stop>,
    drive_frequency: f64,
    phase: f64,
    law: ImpactLaw,
    simultaneous: Simultaneous,
    modes: Vec<Mode>,
    /// As they were found, from which the rows of a stop are made anew.
    found: Arc<Modes>,
    /// Phi^T C Phi, where that couples the modes.
    coupling: Option<Matrix>,
    contacts: Vec<StopContactRows>,
}

/// One mode, p'' + 2 c p' + w^2 p = |f| cos(psi + arg f) + load, where C does not couple it with
/// others.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Mode {
    pub frequency: DoubleDouble,
    /// c.
    pub decay_rate: f64,
    /// phi, (N,).
    pub shape: Vec<f64>,
    /// M phi, (N,): p = (M phi) . q. To 32 digits: p may be small beside its terms.
    pub row: Vec<DoubleDouble>,
    pub drive: Complex<f64>,
    pub load: f64,
}

impl Mode {
    /// p = (M phi) . x, in plain sums.
    pub fn along(&self, x: &[f64]) -> f64 {
        self.row.iter().zip(x).map(|(m, x)| m.hi * x).sum()
    }

    /// The same, in twice the digits.
    pub fn along_exactly(&self, x: &[f64]) -> DoubleDouble {
        self.row.iter().zip(x).fold(DoubleDouble::ZERO, |sum, (m, &x)| sum + m.scale(x))
    }
}

/// Builder of a [`Structure`].
#[derive(Debug, Clone)]
pub struct StructureBuilder {
    mass: Vec<Vec<f64>>,
    stiffness: Vec<Vec<f64>>,
    damping: Damping,
    static_load: Option<Vec<f64>>,
    drive_amplitude: Option<Vec<Complex<f64>>>,
    drive_frequency: f64,
    phase: f64,
    law: ImpactLaw,
    simultaneous: Simultaneous,
    stops: Vec<Stop>,
    known: Option<Box<Structure>>,
}

impl StructureBuilder {
    /// Takes over from a structure what is the same here and takes long to work out: the modes of
    /// mass and stiffness, their damping, and the rows of stops in them. What is built is the same,
    /// bit by bit.
    #[must_use]
    pub fn like(self, structure: &Structure) -> Self {
        Self { known: Some(Box::new(structure.clone())), ..self }
    }

    /// Damping ratios of the modes, (N,), in the order of ascending natural frequency; 0 for modes
    /// of frequency 0.
    #[must_use]
    pub fn damping_ratios(self, ratios: impl Into<Vec<f64>>) -> Self {
        Self { damping: Damping::Ratios(ratios.into()), ..self }
    }

    /// Damping matrix C, (N, N), symmetric and positive semidefinite.
    #[must_use]
    pub fn damping(self, matrix: Vec<Vec<f64>>) -> Self {
        Self { damping: Damping::Matrix(matrix), ..self }
    }

    /// Constant load c, (N,).
    #[must_use]
    pub fn static_load(self, load: impl Into<Vec<f64>>) -> Self {
        Self { static_load: Some(load.into()), ..self }
    }

    /// The drive Re(amplitude e^{i (frequency t + phase)}), amplitude (N,).
    #[must_use]
    pub fn drive(
        self,
        amplitude: impl Into<Vec<Complex<f64>>>,
        frequency: f64,
        phase: f64,
    ) -> Self {
        Self { drive_amplitude: Some(amplitude.into()), drive_frequency: frequency, phase, ..self }
    }

    /// Impact law, of those with Coulomb's friction; Poisson's unless told otherwise.
    #[must_use]
    pub fn law(self, law: ImpactLaw) -> Self {
        Self { law, ..self }
    }

    /// What happens when stops that act on each other meet at one instant.
    #[must_use]
    pub fn simultaneous(self, simultaneous: Simultaneous) -> Self {
        Self { simultaneous, ..self }
    }

    /// One more stop.
    #[must_use]
    pub fn stop(mut self, stop: Stop) -> Self {
        self.stops.push(stop);
        self
    }

    /// The validated structure.
    ///
    /// # Errors
    /// [`ParameterError`] names the entry, its value and what is allowed.
    pub fn build(self) -> Result<Structure, ParameterError> {
        let count = self.mass.len();
        if count > MOST_COORDINATES {
            let allowed = format!("at most {MOST_COORDINATES} rows");
            return Err(ParameterError::new("mass", format!("{count} rows"), allowed));
        }
        checked_matrix("mass", &self.mass, count)?;
        checked_matrix("stiffness", &self.stiffness, count)?;
        for (i, row) in self.mass.iter().enumerate() {
            if row[i] > 0.0 && !SIZES.contains(&row[i]) {
                let allowed = "a number in [1e-50, 1e50]";
                return Err(ParameterError::number(format!("mass[{i}, {i}]"), row[i], allowed));
            }
        }
        let largest = largest(&self.stiffness);
        if largest > 0.0 && !SIZES.contains(&largest) {
            let given = format!("a largest entry {largest:?}");
            let allowed = "a largest entry in [1e-50, 1e50], or zeros";
            return Err(ParameterError::new("stiffness", given, allowed));
        }
        let known =
            self.known.filter(|known| known.mass == self.mass && known.stiffness == self.stiffness);
        let found = match &known {
            Some(known) => Arc::clone(&known.found),
            None => Arc::new(modes(&self.mass, &self.stiffness)?),
        };
        let range = (0.0..=1e50).contains(&self.drive_frequency);
        if !range {
            let allowed = "a number in [0, 1e50]";
            return Err(ParameterError::number("drive_frequency", self.drive_frequency, allowed));
        }
        if !self.phase.is_finite() {
            return Err(ParameterError::number("phase", self.phase, "a finite number"));
        }
        let load = self.static_load.unwrap_or_else(|| vec![0.0; count]);
        checked_vector("static_load", &load, count)?;
        let drive = self.drive_amplitude.unwrap_or_else(|| vec![Complex::default(); count]);
        let (re, im): (Vec<f64>, Vec<f64>) = drive.iter().map(|f| (f.re, f.im)).unzip();
        checked_vector("drive_amplitude", &re, count)?;
        checked_vector("drive_amplitude", &im, count)?;
        for (place, stop) in self.stops.iter().enumerate() {
            stop.checked(place, count, self.drive_frequency > 0.0)?;
        }
        if !self.law.is_coulomb() {
            let allowed =
                "poisson, newton or energetic: the paper's formulas are its own machine's";
            return Err(ParameterError::new("law", self.law.name(), allowed));
        }
        if self.simultaneous == Simultaneous::Together
            && self.stops.iter().any(|stop| stop.friction() > 0.0)
        {
            let allowed = "stop or sequence where a stop has friction > 0";
            return Err(ParameterError::new("simultaneous", self.simultaneous.name(), allowed));
        }
        let rows = |(place, stop): (usize, &Stop)| {
            let same = known.as_ref().and_then(|known| known.rows_of(place, stop));
            same.cloned().unwrap_or_else(|| StopContactRows::new(stop, &found))
        };
        let contacts: Vec<_> = self.stops.iter().enumerate().map(rows).collect();
        for (place, (stop, contact)) in self.stops.iter().zip(&contacts).enumerate() {
            contact.checked(stop, place)?;
        }
        let damped = known.as_ref().filter(|known| self.damping == known.damping);
        let ModalDamping { decay_rates, coupling } = match damped {
            Some(known) => known.damping_in_modes(),
            None => self.damping.in_modes(&found, count)?,
        };
        let modes = (0..count).zip(decay_rates).map(|(i, decay_rate)| {
            let on = |vector: &[f64]| {
                let terms = found.shapes[i].iter().zip(vector);
                terms.fold(DoubleDouble::ZERO, |sum, (&s, &x)| sum + s.scale(x))
            };
            Mode {
                frequency: found.frequencies[i],
                decay_rate,
                shape: found.shapes[i].iter().map(|s| s.value()).collect(),
                row: known.as_ref().map_or_else(
                    || self.mass.iter().map(|row| on(row)).collect(),
                    |known| known.modes[i].row.clone(),
                ),
                drive: Complex::new(on(&re).value(), on(&im).value()),
                load: on(&load).value(),
            }
        });
        let modes = modes.collect();
        Ok(Structure {
            mass: self.mass,
            stiffness: self.stiffness,
            damping: self.damping,
            stops: self.stops,
            drive_frequency: self.drive_frequency,
            phase: self.phase,
            law: self.law,
            simultaneous: self.simultaneous,
            modes,
            found,
            coupling,
            contacts,
        })
    }
}

impl Structure {
    /// A builder. `mass`: (N, N), positive definite; `stiffness`: (N, N), positive semidefinite.
    #[must_use]
    pub fn builder(mass: Vec<Vec<f64>>, stiffness: Vec<Vec<f64>>) -> StructureBuilder {
        StructureBuilder {
            mass,
            stiffness,
            damping: Damping::None,
            static_load: None,
            drive_amplitude: None,
            drive_frequency: 0.0,
            phase: 0.0,
            law: ImpactLaw::default(),
            simultaneous: Simultaneous::default(),
            stops: Vec::new(),
            known: None,
        }
    }

    /// Number of coordinates N.
    #[must_use]
    pub fn coordinates(&self) -> usize {
        self.mass.len()
    }

    /// M, (N, N).
    #[must_use]
    pub fn mass(&self) -> &[Vec<f64>] {
        &self.mass
    }

    /// K, (N, N).
    #[must_use]
    pub fn stiffness(&self) -> &[Vec<f64>] {
        &self.stiffness
    }

    /// C, (N, N); that of the damping ratios, where those were given.
    #[must_use]
    pub fn damping(&self) -> Vec<Vec<f64>> {
        let rates = self.modes.iter().map(|mode| mode.decay_rate).collect::<Vec<_>>();
        self.damping.matrix(&self.mass, &self.found, &rates)
    }

    /// The stops.
    #[must_use]
    pub fn stops(&self) -> &[Stop] {
        &self.stops
    }

    /// Natural frequencies, ascending; those of rigid-body modes (w^2 below 1e-12 of the largest)
    /// are 0.
    #[must_use]
    pub fn frequencies(&self) -> Vec<f64> {
        self.modes.iter().map(|mode| mode.frequency.value()).collect()
    }

    /// Mode shapes by mode, each (N,), orthonormal in M.
    #[must_use]
    pub fn shapes(&self) -> Vec<Vec<f64>> {
        self.modes.iter().map(|mode| mode.shape.clone()).collect()
    }

    /// omega.
    #[must_use]
    pub fn drive_frequency(&self) -> f64 {
        self.drive_frequency
    }

    /// Phase of the drive at t = 0, in radians.
    #[must_use]
    pub fn phase(&self) -> f64 {
        self.phase
    }

    /// Impact law.
    #[must_use]
    pub fn law(&self) -> ImpactLaw {
        self.law
    }

    /// What happens when stops that act on each other meet at one instant.
    #[must_use]
    pub fn simultaneous(&self) -> Simultaneous {
        self.simultaneous
    }

    /// The structure without loads, drive and gaps, whose stops rest: small perturbations of a motion
    /// move like it between events.
    pub(crate) fn homogeneous(&self) -> Self {
        let mut still = self.clone();
        still.drive_frequency = 0.0;
        for mode in &mut still.modes {
            (mode.drive, mode.load) = (Complex::default(), 0.0);
        }
        still.stops = self.stops.iter().map(Stop::homogeneous).collect();
        still
    }

    /// The same structure at a later time: t = 0 is where the drive has gone on by this angle.
    pub(crate) fn turned(&self, angle: f64) -> Self {
        let mut turned = self.clone();
        turned.phase += angle;
        turned.stops = self.stops.iter().map(|stop| stop.turned(angle)).collect();
        turned
    }

    /// The rows in the modes of a stop of this place, if the one that is there has the same.
    fn rows_of(&self, place: usize, stop: &Stop) -> Option<&StopContactRows> {
        let same = self.stops.get(place).is_some_and(|own| own.has_rows_of(stop));
        same.then(|| &self.contacts[place])
    }

    fn damping_in_modes(&self) -> ModalDamping {
        let decay_rates = self.modes.iter().map(|mode| mode.decay_rate).collect();
        ModalDamping { decay_rates, coupling: self.coupling.clone() }
    }

    pub(crate) fn contact(&self, stop: usize) -> &StopContactRows {
        &self.contacts[stop]
    }

    pub(crate) fn modes(&self) -> &[Mode] {
        &self.modes
    }

    /// Whether C couples the modes: they are then no oscillators of their own.
    pub(crate) fn couples_modes(&self) -> bool {
        self.coupling.is_some()
    }

    /// Phi^T C Phi.
    pub(crate) fn modal_damping(&self) -> Matrix {
        let diagonal = || {
            let of = |mode: &Mode| DoubleDouble::new(2.0 * mode.decay_rate);
            Matrix::diagonal(&self.modes.iter().map(of).collect::<Vec<_>>())
        };
        self.coupling.clone().unwrap_or_else(diagonal)
    }
}

fn checked_vector(name: &str, vector: &[f64], count: usize) -> Result<(), ParameterError> {
    if vector.len() != count {
        let given = format!("{} numbers", vector.len());
        return Err(ParameterError::new(name.to_owned(), given, format!("{count} numbers")));
    }
    for (i, &value) in vector.iter().enumerate() {
        if !value.is_finite() {
            return Err(ParameterError::number(format!("{name}[{i}]"), value, "a finite number"));
        }
    }
    Ok(())
}

fn checked_matrix(name: &str, matrix: &[Vec<f64>], count: usize) -> Result<(), ParameterError> {
    if count == 0 {
        return Err(ParameterError::new(name.to_owned(), "no rows", "at least one row"));
    }
    if matrix.len() != count {
        let given = format!("{} rows", matrix.len());
        return Err(ParameterError::new(name.to_owned(), given, format!("{count} rows")));
    }
    for (i, row) in matrix.iter().enumerate() {
        if row.len() != count {
            let given = format!("{} numbers", row.len());
            let allowed = format!("{count} numbers");
            return Err(ParameterError::new(format!("{name}[{i}]"), given, allowed));
        }
        for (j, &entry) in row.iter().enumerate() {
            if !entry.is_finite() {
                let place = format!("{name}[{i}, {j}]");
                return Err(ParameterError::number(place, entry, "a finite number"));
            }
        }
    }
    let largest = largest(matrix);
    for (i, row) in matrix.iter().enumerate() {
        for (j, &entry) in row.iter().enumerate().take(i) {
            let mirror = matrix[j][i];
            if (entry - mirror).abs() > SYMMETRIC * largest {
                let allowed = format!("{name}[{j}, {i}] = {mirror:?}: the matrix is symmetric");
                return Err(ParameterError::number(format!("{name}[{i}, {j}]"), entry, allowed));
            }
        }
    }
    Ok(())
}

fn largest(matrix: &[Vec<f64>]) -> f64 {
    matrix.iter().flatten().fold(0.0, |most: f64, entry| most.max(entry.abs()))
}
