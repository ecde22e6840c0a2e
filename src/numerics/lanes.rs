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
    // By masks, which compilers surely turn into vector instructions.
    let old = *ours;
    *ours = std::array::from_fn(|j| {
        let mask = which[j].wrapping_neg();
        f64::from_bits((others[j].to_bits() & mask) | (old[j].to_bits() & !mask))
    });
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
