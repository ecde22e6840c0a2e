//! A few numbers treated together, written so that compilers turn loops over them into vector
//! instructions: no branches, no calls. The operations are the same with any of them, and so are
//! the bits.

/// Numbers treated together.
pub(crate) const LANES: usize = 8;

/// Eight values of one quantity.
pub(crate) type Lanes = [f64; LANES];

/// Does a piece of work with the widest vector registers of the machine.
#[inline(always)]
#[allow(clippy::inline_always)]
pub(crate) fn wide<W: pulp::NullaryFnOnce>(work: W) -> W::Output {
    pulp::Arch::new().dispatch(work)
}

/// Does a piece of work with registers of at most 256 bits: where each step waits for the one
/// before, wider ones are no faster, and cost more to start with.
#[inline(always)]
#[allow(clippy::inline_always)]
pub(crate) fn narrow<W: pulp::NullaryFnOnce>(work: W) -> W::Output {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return simd.vectorize(work);
    }
    pulp::Arch::new().dispatch(work)
}

/// Takes over those numbers for which `which` is 1.
#[inline(always)]
#[allow(clippy::inline_always)]
pub(crate) fn take(ours: &mut Lanes, others: &Lanes, which: &[u64; LANES]) {
    let old = *ours;
    *ours = std::array::from_fn(|j| either(which[j], others[j], old[j]));
}

/// The first number if `which` is 1, the second if it is 0: by masks, which compilers surely turn into
/// vector instructions.
#[inline(always)]
#[allow(clippy::inline_always)]
pub(crate) fn either(which: u64, first: f64, second: f64) -> f64 {
    let mask = which.wrapping_neg();
    f64::from_bits((first.to_bits() & mask) | (second.to_bits() & !mask))
}

/// Defines the lanes of a type: each of the named numbers of eight values of it, which are read and
/// written as a whole. None of them lies on two cache lines.
macro_rules! lanes_of {
    ($(#[$meta:meta])* $name:ident of $single:ty { $($lane:ident: $($path:ident).+),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Default)]
        #[repr(align(64))]
        pub(crate) struct $name {
            $(pub $lane: crate::numerics::lanes::Lanes),*
        }

        impl $name {
            #[inline(always)]
            #[allow(clippy::inline_always)]
            pub fn get(&self, j: usize) -> $single {
                let mut one = <$single>::default();
                $(one.$($path).+ = self.$lane[j];)*
                one
            }

            #[inline(always)]
            #[allow(clippy::inline_always)]
            pub fn set(&mut self, j: usize, one: &$single) {
                $(self.$lane[j] = one.$($path).+;)*
            }

            /// Sets lane `j` if `which` is 1, by masks.
            #[inline(always)]
            #[allow(clippy::inline_always, dead_code)]
            pub fn set_if(&mut self, j: usize, which: u64, one: &$single) {
                $(self.$lane[j] =
                    crate::numerics::lanes::either(which, one.$($path).+, self.$lane[j]);)*
            }

            /// Takes over those of other lanes for which `which` is 1.
            #[inline(always)]
            #[allow(clippy::inline_always, dead_code)]
            pub fn take(&mut self, others: &Self, which: &[u64; crate::numerics::lanes::LANES]) {
                $(crate::numerics::lanes::take(&mut self.$lane, &others.$lane, which);)*
            }
        }
    };
}
pub(crate) use lanes_of;
