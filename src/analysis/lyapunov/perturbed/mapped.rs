//! Directions mapped through flights and impacts: compiled for fused multiplications where there are
//! any.

use super::{Directions, LyapunovError};
use crate::flight::Flight;
use crate::impact::RegimeKind;
use crate::model::state::Clock;
use crate::simulate::event::ImpactEvent;
use crate::tangent::itinerary::Signs;
use crate::tangent::{Departure, Model, Strike};

/// Directions to be mapped through a flight and the impact at its end.
pub(super) struct Struck<'a, const N: usize> {
    pub model: &'a Model,
    /// Where the flight begins, then where the next one does.
    pub departure: &'a mut Departure,
    pub impact: &'a ImpactEvent,
    pub after: &'a Flight,
    pub regime: (RegimeKind, Signs),
    pub directions: &'a mut Directions<N>,
    pub orthonormal: bool,
}

impl<const N: usize> pulp::NullaryFnOnce for Struck<'_, N> {
    type Output = Result<(), LyapunovError>;

    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn call(self) -> Self::Output {
        let Self { model, departure, impact, after, regime, directions, orthonormal } = self;
        let strike = Strike::new(model, departure, impact, after, regime);
        let finite = directions.map(&strike);
        *departure = strike.departure();
        settle(directions, finite, orthonormal)
    }
}

/// Directions to be mapped through a flight to an instant before its end.
pub(super) struct Flown<'a, const N: usize> {
    pub model: &'a Model,
    pub from: Departure,
    pub clock: Clock,
    pub directions: &'a mut Directions<N>,
}

impl<const N: usize> pulp::NullaryFnOnce for Flown<'_, N> {
    /// Whether the images are finite.
    type Output = bool;

    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn call(self) -> bool {
        self.directions.map(&self.from.flight(self.model, self.clock))
    }
}

/// Takes over the images of directions, if they are finite.
#[inline(always)]
#[allow(clippy::inline_always)] // one of them for each impact of a motion that is followed
pub(super) fn settle<const N: usize>(
    directions: &mut Directions<N>,
    finite: bool,
    orthonormal: bool,
) -> Result<(), LyapunovError> {
    if !finite {
        return Err(LyapunovError::NoDerivative);
    }
    if orthonormal {
        directions.orthonormalise();
    }
    Ok(())
}
