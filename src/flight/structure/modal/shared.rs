//! What the gaps of many stops along one flight have in common: the motions of the modes.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use std::cell::{OnceCell, Ref, RefCell};

use crate::flight::oscillator::Motion;
use crate::numerics::lanes::Lanes;

/// Fewer stops than this compute the motions each for itself, without a memory for them.
pub(super) const SHARED_BY: usize = 3;

/// The motions of all modes along a flight, as far as they have been asked for.
#[derive(Default)]
pub(super) struct Shared {
    start: OnceCell<Vec<(Motion, [f64; 3])>>,
    bounds: OnceCell<Vec<[f64; 6]>>,
    strides: RefCell<Vec<Stride>>,
}

/// Displacements, rates and accelerations of each mode at eight steps of a level.
pub(super) struct Stride {
    level: usize,
    from: f64,
    pub modes: Vec<[Lanes; 3]>,
}

impl Shared {
    /// Motions at the start, and their higher derivatives.
    #[inline(always)]
    pub fn start(&self, make: impl FnOnce() -> Vec<(Motion, [f64; 3])>) -> &[(Motion, [f64; 3])] {
        self.start.get_or_init(make)
    }

    /// Bounds of the derivatives 1 to 6.
    #[inline(always)]
    pub fn bounds(&self, make: impl FnOnce() -> Vec<[f64; 6]>) -> &[[f64; 6]] {
        self.bounds.get_or_init(make)
    }

    /// Eight steps of a level from a local time on.
    #[inline(always)]
    pub fn stride(
        &self,
        level: usize,
        from: f64,
        make: impl FnOnce() -> Vec<[Lanes; 3]>,
    ) -> Ref<'_, Stride> {
        let known = |strides: &[Stride]| {
            strides.iter().position(|stride| stride.level == level && stride.from == from)
        };
        let place = known(&self.strides.borrow());
        let place = place.unwrap_or_else(|| {
            let stride = Stride { level, from, modes: make() };
            let mut strides = self.strides.borrow_mut();
            strides.push(stride);
            strides.len() - 1
        });
        Ref::map(self.strides.borrow(), |strides| &strides[place])
    }
}
