//! Sine and cosine of the pendulum's angle, which the contact geometry, the impact and the forces
//! in contact all look at: worked out once and handed on.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use crate::model::parameters::Contact;
use crate::numerics::dual::Number;
use crate::numerics::lanes::lanes_of;

/// Sine and cosine of the pendulum's angle, as far as the geometry looks at it: of 0 in direct
/// contact.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Angle<T = f64> {
    pub sin: T,
    pub cos: T,
}

lanes_of! {
    /// Several angles.
    Angles of Angle { sin: sin, cos: cos }
}

impl Contact {
    /// Sine and cosine of x1 in oblique contact, of 0 in direct contact.
    #[inline(always)]
    pub(crate) fn angle<T: Number>(self, x1: T) -> Angle<T> {
        let (sin, cos) = match self {
            Self::Oblique => x1.sin_cos(),
            Self::Direct => (T::constant(0.0), T::constant(1.0)),
        };
        Angle { sin, cos }
    }

    /// Position of the tip along the normal: sin x1, or x1.
    #[inline(always)]
    pub(crate) fn tip<T: Number>(self, x1: T, angle: Angle<T>) -> T {
        match self {
            Self::Oblique => angle.sin,
            Self::Direct => x1,
        }
    }
}
