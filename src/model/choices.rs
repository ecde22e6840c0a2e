//! Choices of a system that are no numbers: the geometry of the contact and the law of the impact.

use serde::{Deserialize, Serialize};

use crate::model::error::ParameterError;

/// Geometry of the contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Contact {
    /// g = sin x1 - x2 - gap: the pendulum's tip strikes at an angle.
    #[default]
    Oblique,
    /// g = x1 - x2 - gap: the classical head-on impact; friction plays no part.
    Direct,
}

impl Contact {
    /// All geometries, the default first.
    pub const ALL: &'static [Self] = &[Self::Oblique, Self::Direct];

    /// The name used in Python and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Oblique => "oblique",
            Self::Direct => "direct",
        }
    }

    /// The contact of this name.
    ///
    /// # Errors
    /// [`ParameterError`] for an unknown name.
    pub fn from_name(name: &str) -> Result<Self, ParameterError> {
        chosen("contact", name, Self::ALL, Self::name)
    }
}

/// Law of the impact (docs/theory.md, section 4).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum ImpactLaw {
    /// Coulomb friction along the impulse, Poisson's restitution P_II = r P_I; never creates
    /// energy.
    #[default]
    Poisson,
    /// Coulomb friction, Newton's restitution u_post = -r u. **It can create energy** where slip
    /// ends during the impact: a few per cent at mbar = 0.6, without bound as mbar -> 0 and the tip
    /// sticks. With mbar = 0 and the tip sticking no impulse gets to -r u: the impact ends there.
    Newton,
    /// Coulomb friction, work of the normal impulse in restitution r^2 times that in approach
    /// (Stronge; Beghin and Boulanger); never creates energy.
    Energetic,
    /// The formulas (14), (16), (18) as Han, Jin & Hu (2004) print them: friction with the signed
    /// sine, no sticking, no guard for P* < 0. It can create energy; for comparison only.
    Paper,
}

impl ImpactLaw {
    /// All laws, the default first.
    pub const ALL: &'static [Self] = &[Self::Poisson, Self::Newton, Self::Energetic, Self::Paper];

    /// The name used in Python and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Poisson => "poisson",
            Self::Newton => "newton",
            Self::Energetic => "energetic",
            Self::Paper => "paper",
        }
    }

    /// Whether slip follows Coulomb's law along the impulse; the formulas of the paper are used as
    /// they are printed, whatever they imply.
    #[must_use]
    pub fn is_coulomb(self) -> bool {
        self != Self::Paper
    }

    /// The law of this name.
    ///
    /// # Errors
    /// [`ParameterError`] for an unknown name.
    pub fn from_name(name: &str) -> Result<Self, ParameterError> {
        chosen("law", name, Self::ALL, Self::name)
    }
}

/// The choice that has a name, or an error with the names of all choices.
pub(super) fn chosen<T: Copy>(
    parameter: &'static str,
    given: &str,
    all: &[T],
    name: fn(T) -> &'static str,
) -> Result<T, ParameterError> {
    all.iter().copied().find(|&one| name(one) == given).ok_or_else(|| {
        let names: Vec<_> = all.iter().map(|&one| name(one)).collect();
        ParameterError::new(parameter, given, format!("one of {}", names.join(", ")))
    })
}
