//! A few numbers treated together, written so that compilers turn loops over them into vector
//! instructions: no branches, no calls. The operations are the same with any of them, and so are the bits.

/// Numbers treated together.
pub(crate) const LANES: usize = 8;

/// Eight values of one quantity.
pub(crate) type Lanes = [f64; LANES];

/// Defines the lanes of a type: each of the named numbers of eight values of it, which are read and
/// written as a whole.
macro_rules! lanes_of {
    ($(#[$meta:meta])* $name:ident of $single:ty { $($lane:ident: $($path:ident).+),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Default)]
        pub(crate) struct $name {
            $(pub $lane: crate::lanes::Lanes),*
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
        }
    };
}
pub(crate) use lanes_of;
