//! What a run is differentiated by.

use smallvec::SmallVec;

use crate::model::error::ParameterError;
use crate::model::parameters::{Contact, System};
use crate::model::state::Clock;
use crate::tangent::equation::{ByEquation, Coefficient};

/// What a flight adds to the derivatives of both bodies.
pub(super) type Added = [ByEquation; 2];

/// A number that a run depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum By {
    MassRatio,
    FrequencyRatio,
    Restitution,
    Gap,
    DriveFrequency,
    PendulumDamping,
    OscillatorDamping,
    MomentAmplitude,
    ForceAmplitude,
    StaticMoment,
    StaticForce,
    Friction,
    Phase,
    /// A number of the restitution curve.
    OfCurve(usize),
    /// A component of the start: x1, x1', x2' or x2.
    Start(usize),
}

/// Names of the components of a start, in the order of [`By::Start`].
const STARTS: [&str; 4] = ["x1", "v1", "v2", "x2"];

impl By {
    /// The numbers of these names.
    ///
    /// # Errors
    /// [`ParameterError`] names the first that is none, or none that this system can change.
    pub fn all(names: &[String], system: &System) -> Result<Vec<Self>, ParameterError> {
        names.iter().map(|name| Self::of(name, system)).collect()
    }

    fn of(name: &str, system: &System) -> Result<Self, ParameterError> {
        let by = match name {
            "mass_ratio" => Self::MassRatio,
            "frequency_ratio" => Self::FrequencyRatio,
            "restitution" => Self::Restitution,
            "gap" => Self::Gap,
            "drive_frequency" => Self::DriveFrequency,
            "pendulum_damping" => Self::PendulumDamping,
            "oscillator_damping" => Self::OscillatorDamping,
            "moment_amplitude" => Self::MomentAmplitude,
            "force_amplitude" => Self::ForceAmplitude,
            "static_moment" => Self::StaticMoment,
            "static_force" => Self::StaticForce,
            "friction" => Self::Friction,
            "phase" => Self::Phase,
            _ => {
                if let Some(place) = system.coefficient().place_of(name) {
                    return Ok(Self::OfCurve(place));
                }
                let place = STARTS.iter().position(|start| *start == name);
                let allowed = || format!("one of {}, x1, v1, x2, v2", System::NUMERIC.join(", "));
                Self::Start(place.ok_or_else(|| ParameterError::new("names", name, allowed()))?)
            }
        };
        if let (Self::Restitution, Some(curve)) = (by, system.restitution_curve()) {
            let allowed =
                format!("the numbers of the restitution curve: {}", curve.names().join(", "));
            return Err(ParameterError::new("names", name, allowed));
        }
        if by == Self::Friction && system.contact == Contact::Direct {
            return Err(ParameterError::new("names", name, "friction only of oblique contact"));
        }
        Ok(by)
    }

    /// What a flight between two instants adds to the derivatives by one number, at a fixed time after its
    /// start.
    #[inline(always)]
    #[allow(clippy::inline_always)] // compiled for several instruction sets
    pub fn own(self, [pendulum, oscillator]: &Added, from: Clock) -> [f64; 4] {
        let first = |of: Coefficient| {
            let [x, v] = pendulum.of(of);
            [x, v, 0.0, 0.0]
        };
        let second = |of: Coefficient| {
            let [x, v] = oscillator.of(of);
            [0.0, 0.0, v, x]
        };
        let both = |of: Coefficient| {
            let ([x1, v1], [x2, v2]) = (pendulum.of(of), oscillator.of(of));
            [x1, v1, v2, x2]
        };
        match self {
            Self::FrequencyRatio => first(Coefficient::Natural),
            Self::PendulumDamping => first(Coefficient::Damping),
            Self::OscillatorDamping => second(Coefficient::Damping),
            Self::MomentAmplitude => first(Coefficient::Amplitude),
            Self::ForceAmplitude => second(Coefficient::Amplitude),
            Self::StaticMoment => first(Coefficient::Constant),
            Self::StaticForce => second(Coefficient::Constant),
            Self::Phase => both(Coefficient::Phase),
            Self::DriveFrequency => {
                // The phase of a time within a period, and the drive in the flight.
                let (ahead, turned) = (both(Coefficient::Phase), both(Coefficient::Omega));
                std::array::from_fn(|i| from.time_in_period * ahead[i] + turned[i])
            }
            Self::MassRatio
            | Self::Restitution
            | Self::OfCurve(_)
            | Self::Gap
            | Self::Friction
            | Self::Start(_) => [0.0; 4],
        }
    }
}

/// By which coefficients of the equations of pendulum and oscillator flights must be differentiated.
pub(super) fn coefficients(all: &[By], system: &System) -> [SmallVec<[Coefficient; 6]>; 2] {
    let has = |by: By| all.contains(&by);
    let turned = has(By::DriveFrequency);
    let (moment, force) = (system.moment_amplitude != 0.0, system.force_amplitude != 0.0);
    let pendulum = [
        (Coefficient::Natural, has(By::FrequencyRatio)),
        (Coefficient::Damping, has(By::PendulumDamping)),
        (Coefficient::Omega, turned && moment),
        (Coefficient::Phase, (turned || has(By::Phase)) && moment),
        (Coefficient::Amplitude, has(By::MomentAmplitude)),
        (Coefficient::Constant, has(By::StaticMoment)),
    ];
    let oscillator = [
        (Coefficient::Damping, has(By::OscillatorDamping)),
        (Coefficient::Omega, turned && force),
        (Coefficient::Phase, (turned || has(By::Phase)) && force),
        (Coefficient::Amplitude, has(By::ForceAmplitude)),
        (Coefficient::Constant, has(By::StaticForce)),
    ];
    let wanted = |of: &[(Coefficient, bool)]| {
        of.iter().filter_map(|&(coefficient, wanted)| wanted.then_some(coefficient)).collect()
    };
    [wanted(&pendulum), wanted(&oscillator)]
}
