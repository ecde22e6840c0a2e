//! What becomes of impacts on several stops at one instant: a choice of the model, never of rounding.

use crate::model::choices::chosen;
use crate::model::error::ParameterError;

/// What happens when stops that act on each other meet at one instant, or one of them while another
/// is closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Simultaneous {
    /// The run ends, with a stop reason of its own.
    #[default]
    Stop,
    /// One impact after another, that of the lowest index first, until no stop approaches.
    Sequence,
    /// All at once, by one linear complementarity problem; without friction only.
    Together,
}

impl Simultaneous {
    /// All choices, the default first.
    pub const ALL: &'static [Self] = &[Self::Stop, Self::Sequence, Self::Together];

    /// The name used in Python and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Stop => "stop",
            Self::Sequence => "sequence",
            Self::Together => "together",
        }
    }

    /// The choice of this name.
    ///
    /// # Errors
    /// [`ParameterError`] for an unknown name.
    pub fn from_name(name: &str) -> Result<Self, ParameterError> {
        chosen("simultaneous", name, Self::ALL, Self::name)
    }
}
