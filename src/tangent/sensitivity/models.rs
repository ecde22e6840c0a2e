//! Systems that carry derivatives along some columns, for contact.

use std::sync::OnceLock;

use crate::model::parameters::System;
use crate::tangent::Model;

/// Columns that legs carry along at once: one alone, or several.
pub(super) const ONE: usize = 1;
pub(super) const FEW: usize = 4;

/// Systems that carry derivatives along some columns each, until all have had theirs; and by time alone.
#[derive(Default)]
pub(super) struct Models {
    pub one: OnceLock<Vec<Model<ONE>>>,
    pub few: OnceLock<Vec<Model<FEW>>>,
    by_time: OnceLock<Model<1>>,
}

impl Models {
    /// None of whose numbers changes.
    pub fn by_time(&self, system: &System) -> &Model<1> {
        self.by_time.get_or_init(|| Model::by(system, |_| None, false))
    }
}

/// All of them, which are made when they are first needed, each with its first column.
pub(super) fn models<'a, const N: usize>(
    made: &'a OnceLock<Vec<Model<N>>>,
    system: &System,
    names: &[String],
) -> impl Iterator<Item = (&'a Model<N>, usize)> {
    let all = made.get_or_init(|| {
        let of = |names: &[String]| {
            Model::by(system, |name| names.iter().position(|other| other == name), false)
        };
        names.chunks(N).map(of).collect()
    });
    all.iter().zip((0..).step_by(N))
}
