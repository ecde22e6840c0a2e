//! Systems that carry derivatives along some columns, for contact.

use std::sync::OnceLock;

use crate::model::parameters::System;
use crate::tangent::{DIRECTIONS, Model};

/// Directions of one column, or of three: that of the time at the end comes first. And those of a leg
/// that is chatter.
const OF_ONE: usize = 2;
const OF_FEW: usize = 4;
const OF_CHATTER: usize = DIRECTIONS;

/// Direction of the end time.
pub(super) const END: usize = 0;

/// Systems that carry derivatives along some columns each, until all have had theirs.
#[derive(Default)]
pub(super) struct Models {
    pub one: OnceLock<Vec<Model<OF_ONE>>>,
    pub few: OnceLock<Vec<Model<OF_FEW>>>,
    pub chatter: OnceLock<Vec<Model<OF_CHATTER>>>,
}

/// All of them, which are made when they are first needed, each with its first column.
pub(super) fn models<'a, const N: usize>(
    made: &'a OnceLock<Vec<Model<N>>>,
    system: &System,
    names: &[String],
) -> impl Iterator<Item = (&'a Model<N>, usize)> {
    let all = made.get_or_init(|| {
        let of = |names: &[String]| {
            let place = |name: &str| names.iter().position(|other| other == name);
            Model::by(system, |name| place(name).map(|i| END + 1 + i), false)
        };
        names.chunks(N - 1).map(of).collect()
    });
    all.iter().zip((0..).step_by(N - 1))
}
