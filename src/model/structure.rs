//! Any linear structure with rigid stops (docs/structures.md): N coordinates q,
//!
//! ```text
//! M q'' + C q' + K q = c + Re(F e^{i psi}) - (impulses and forces of the stops),  psi = omega t + phi
//! g_j = n_j . q - gap_j - A_j cos(omega t + phi_j) <= 0
//! ```
//!
//! with M positive definite, K and C positive semidefinite, and C diagonal in the modes.

mod modes;
mod simultaneous;
mod stop;

use nalgebra::Complex;

use crate::model::error::ParameterError;
use crate::model::parameters::ImpactLaw;
use crate::numerics::double_double::DoubleDouble;
use modes::{Modes, NoModes, RIGID, modes};
pub use simultaneous::Simultaneous;
pub use stop::Stop;
pub(crate) use stop::StopContactRows;

/// Coordinates at most: the modes of so many take seconds, a time that grows with its cube.
const MOST_COORDINATES: usize = 256;
/// What the modes couple by a damping matrix at most, as a part of its largest entry there.
const COUPLED: f64 = 1e-12;
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
#[derive(Debug, Clone)]
pub struct Structure {
    mass: Vec<Vec<f64>>,
    stops: Vec<Stop>,
    drive_frequency: f64,
    phase: f64,
    law: ImpactLaw,
    simultaneous: Simultaneous,
    modes: Vec<Mode>,
    contacts: Vec<StopContactRows>,
}

/// One mode, p'' + 2 c p' + w^2 p = |f| cos(psi + arg f) + load.
#[derive(Debug, Clone)]
pub(crate) struct Mode {
    pub frequency: DoubleDouble,
    /// c.
    pub decay_rate: f64,
    /// phi, (N,).
    pub shape: Vec<f64>,
    /// M phi, (N,): p = (M phi) . q.
    pub row: Vec<f64>,
    pub drive: Complex<f64>,
    pub load: f64,
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
}

#[derive(Debug, Clone)]
enum Damping {
    None,
    Ratios(Vec<f64>),
    Matrix(Vec<Vec<f64>>),
}

impl StructureBuilder {
    /// Damping ratios of the modes, (N,), in the order of ascending natural frequency; 0 for modes
    /// of frequency 0.
    #[must_use]
    pub fn damping_ratios(self, ratios: impl Into<Vec<f64>>) -> Self {
        Self { damping: Damping::Ratios(ratios.into()), ..self }
    }

    /// Damping matrix C, (N, N), which the modes make diagonal.
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
        let found = modes(&self.mass, &self.stiffness).map_err(|why| match why {
            NoModes::MassNotDefinite(order) => ParameterError::new(
                "mass",
                format!("a matrix whose leading minor of order {order} is not positive"),
                "a positive definite matrix",
            ),
            NoModes::StiffnessNegative(square) => ParameterError::new(
                "stiffness",
                format!("a matrix with w^2 = {square:e} for a mode"),
                "a positive semidefinite matrix",
            ),
        })?;
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
        let contacts: Vec<_> =
            self.stops.iter().map(|stop| StopContactRows::new(stop, &found)).collect();
        for (place, (stop, contact)) in self.stops.iter().zip(&contacts).enumerate() {
            contact.checked(stop, place)?;
        }
        let decay_rates = decay_rates(&self.damping, &found, count)?;
        let modes = found
            .frequencies
            .iter()
            .zip(&found.shapes)
            .zip(decay_rates)
            .map(|((&frequency, shape), decay_rate)| {
                let on = |vector: &[f64]| {
                    let terms = shape.iter().zip(vector);
                    terms.fold(DoubleDouble::ZERO, |sum, (&s, &x)| sum + s.scale(x)).value()
                };
                Mode {
                    frequency,
                    decay_rate,
                    shape: shape.iter().map(|s| s.value()).collect(),
                    row: self.mass.iter().map(|row| on(row)).collect(),
                    drive: Complex::new(on(&re), on(&im)),
                    load: on(&load),
                }
            })
            .collect();
        Ok(Structure {
            mass: self.mass,
            stops: self.stops,
            drive_frequency: self.drive_frequency,
            phase: self.phase,
            law: self.law,
            simultaneous: self.simultaneous,
            modes,
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
        }
    }

    /// Number of coordinates N.
    #[must_use]
    pub fn coordinates(&self) -> usize {
        self.mass.len()
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

    pub(crate) fn contact(&self, stop: usize) -> &StopContactRows {
        &self.contacts[stop]
    }

    pub(crate) fn modes(&self) -> &[Mode] {
        &self.modes
    }
}

/// Decay rates of the modes, or why there are none.
fn decay_rates(damping: &Damping, found: &Modes, count: usize) -> Result<Vec<f64>, ParameterError> {
    match damping {
        Damping::None => Ok(vec![0.0; count]),
        Damping::Ratios(ratios) => {
            checked_vector("damping_ratios", ratios, count)?;
            let highest = found.frequencies.last().map_or(0.0, |w| w.hi);
            let mut rates = Vec::with_capacity(count);
            for (i, (&ratio, w)) in ratios.iter().zip(&found.frequencies).enumerate() {
                let name = || format!("damping_ratios[{i}]");
                if ratio < 0.0 {
                    return Err(ParameterError::number(name(), ratio, "a finite number >= 0"));
                }
                if ratio > 0.0 && w.hi == 0.0 {
                    let allowed = "0 for a mode of frequency 0 (damping= takes a matrix)";
                    return Err(ParameterError::number(name(), ratio, allowed));
                }
                // Equal frequencies have no modes of their own, which unequal ratios would need.
                if i > 0 && ratio != ratios[i - 1] {
                    let before = found.frequencies[i - 1];
                    if (*w * *w - before * before).hi <= RIGID * highest * highest {
                        let allowed = "the ratio of the mode before, whose frequency is the same";
                        return Err(ParameterError::number(name(), ratio, allowed));
                    }
                }
                let rate = w.scale(ratio).value();
                if !rate.is_finite() {
                    let allowed = "a number whose product with the frequency is finite";
                    return Err(ParameterError::number(name(), ratio, allowed));
                }
                rates.push(rate);
            }
            Ok(rates)
        }
        Damping::Matrix(matrix) => {
            checked_matrix("damping", matrix, count)?;
            let on = |i: usize, j: usize| {
                let mut sum = DoubleDouble::ZERO;
                for (row, &left) in matrix.iter().zip(&found.shapes[i]) {
                    for (&entry, &right) in row.iter().zip(&found.shapes[j]) {
                        sum = sum + left * right.scale(entry);
                    }
                }
                sum.value()
            };
            let mut rates: Vec<f64> = (0..count).map(|i| 0.5 * on(i, i)).collect();
            let largest = rates.iter().fold(0.0, |most: f64, rate| most.max(rate.abs()));
            for (i, rate) in rates.iter_mut().enumerate() {
                for j in i + 1..count {
                    let coupled = on(i, j);
                    if coupled.abs() > COUPLED * largest {
                        return Err(ParameterError::new(
                            "damping",
                            format!("a matrix that couples the modes {i} and {j} by {coupled:e}"),
                            "a matrix that the modes make diagonal, in this version",
                        ));
                    }
                }
                if *rate < -COUPLED * largest {
                    return Err(ParameterError::new(
                        "damping",
                        format!("a matrix with {:e} on mode {i}", 2.0 * *rate),
                        "a positive semidefinite matrix",
                    ));
                }
                *rate = if *rate <= COUPLED * largest { 0.0 } else { *rate };
            }
            Ok(rates)
        }
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
