//! Tables of derivatives. Of a motion that repeats they keep one cycle, and the columns at the start of
//! each: its rows are sums of these, worked out when they are read, to where they are wanted.

use std::fmt;
use std::ops::{Deref, Range};
use std::sync::{Arc, OnceLock};

use pulp::NullaryFnOnce;

use crate::numerics::lanes::narrow;

/// Components of the start that are summed at once.
const TOGETHER: usize = 4;

/// A table of derivatives, row by row: a slice of numbers, as a vector is. Rows of cycles that come again
/// are worked out when the slice is first asked for; [`Self::write`] works them out to elsewhere.
#[derive(Clone, Default)]
pub struct SensitivityTable {
    /// What was followed.
    followed: Vec<f64>,
    /// What comes again, in order.
    repeated: Vec<Repeated>,
    /// All of it, once it has been asked for.
    all: OnceLock<Vec<f64>>,
}

/// The rows of cycles that come again, within a table.
#[derive(Clone)]
struct Repeated {
    /// How many of the numbers that were followed come before them.
    at: usize,
    rows: Cycles,
}

/// Rows of cycles, one cycle after the other.
#[derive(Clone)]
pub(super) struct Cycles {
    one: Arc<Sums>,
    /// The columns at the start of each cycle, one cycle after the other.
    starts: Arc<Vec<f64>>,
    /// Which of their rows.
    pub rows: Range<usize>,
    /// What columns have more in each cycle than in the one before.
    growing: Option<Growing>,
}

/// How much later than the one that was followed cycles come.
#[derive(Clone, Copy)]
pub(super) struct Later {
    /// How many of them come before the first that is told.
    pub early: i64,
    /// Drive periods of each.
    pub periods: i64,
}

impl Later {
    /// In drive periods, of one of those that are told.
    pub fn of(self, cycle: usize) -> i64 {
        (self.early + cycle as i64) * self.periods
    }
}

/// Columns that grow with the drive periods, and how much with each.
#[derive(Clone)]
pub(super) struct Growing {
    pub later: Later,
    /// By column.
    pub rates: Vec<(usize, f64)>,
}

/// A table of a cycle whose rows are sums: of each column the own part, and of those at the start of
/// the cycle this much.
struct Sums {
    /// Components of a column at the start, and columns.
    shape: (usize, usize),
    /// By each component, a number for each row; zeros make up whole parts of those summed at once.
    basis: Vec<Vec<f64>>,
    /// A number for each column in each row.
    own: Vec<f64>,
}

impl SensitivityTable {
    /// With room for so many numbers that are followed.
    pub(super) fn with_capacity(numbers: usize) -> Self {
        Self { followed: Vec::with_capacity(numbers), ..Self::default() }
    }

    /// What was followed.
    pub(super) fn followed(&self) -> &[f64] {
        &self.followed
    }

    /// Adds rows that come again.
    pub(super) fn repeat(&mut self, rows: Cycles) {
        if !rows.rows.is_empty() {
            self.repeated.push(Repeated { at: self.followed.len(), rows });
        }
    }

    /// How many numbers there are.
    #[must_use]
    pub fn len(&self) -> usize {
        let repeated = self.repeated.iter().map(|repeated| repeated.rows.len());
        self.followed.len() + repeated.sum::<usize>()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Writes all of it to a slice of the same length.
    ///
    /// # Panics
    /// If it has another one.
    pub fn write(&self, to: &mut [f64]) {
        assert_eq!(to.len(), self.len(), "numbers of the table");
        let (mut from, mut rest) = (0, to);
        for Repeated { at, rows } in &self.repeated {
            let (before, after) = rest.split_at_mut(at - from);
            before.copy_from_slice(&self.followed[from..*at]);
            let (these, after) = after.split_at_mut(rows.len());
            rows.write(these);
            (from, rest) = (*at, after);
        }
        rest.copy_from_slice(&self.followed[from..]);
    }

    /// Without its first numbers.
    pub(super) fn without_first(self, numbers: usize) -> Self {
        if numbers == 0 {
            return self;
        }
        let mut all = self.into_vec();
        all.drain(..numbers);
        all.into()
    }

    /// All of it.
    #[must_use]
    pub fn into_vec(self) -> Vec<f64> {
        if self.repeated.is_empty() { self.followed } else { self.to_vec() }
    }
}

impl Deref for SensitivityTable {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        if self.repeated.is_empty() {
            return &self.followed;
        }
        self.all.get_or_init(|| {
            let mut all = vec![0.0; self.len()];
            self.write(&mut all);
            all
        })
    }
}

impl AsRef<[f64]> for SensitivityTable {
    fn as_ref(&self) -> &[f64] {
        self
    }
}

impl<T: AsRef<[f64]>> PartialEq<T> for SensitivityTable {
    fn eq(&self, other: &T) -> bool {
        **self == *other.as_ref()
    }
}

impl fmt::Debug for SensitivityTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

impl From<Vec<f64>> for SensitivityTable {
    fn from(followed: Vec<f64>) -> Self {
        Self { followed, ..Self::default() }
    }
}

impl Extend<f64> for SensitivityTable {
    fn extend<I: IntoIterator<Item = f64>>(&mut self, numbers: I) {
        self.followed.extend(numbers);
    }
}

impl Cycles {
    /// All rows of cycles with these columns at their starts, from the table of one of them, which has columns
    /// by the components of its start before the others.
    pub fn new(
        table: &[f64],
        shape @ (components, width): (usize, usize),
        starts: &Arc<Vec<f64>>,
    ) -> Self {
        let (one, starts) = (Arc::new(Sums::new(table, shape)), Arc::clone(starts));
        let rows = 0..one.rows() * (starts.len() / (components * width));
        Self { one, starts, rows, growing: None }
    }

    /// Some of these rows.
    pub fn among(self, rows: Range<usize>) -> Self {
        Self { rows, ..self }
    }

    /// With columns that grow.
    pub fn growing(self, growing: Option<Growing>) -> Self {
        Self { growing, ..self }
    }

    /// How many numbers there are.
    fn len(&self) -> usize {
        self.rows.len() * self.one.shape.1
    }

    fn write(&self, to: &mut [f64]) {
        self.write_rows(self.rows.clone(), to);
    }

    /// Writes some of the rows.
    pub fn write_rows(&self, rows: Range<usize>, to: &mut [f64]) {
        let Self { one, starts, growing, .. } = self;
        let (count, (components, width)) = (one.rows(), one.shape);
        let (mut row, mut rest) = (rows.start, to);
        while row < rows.end {
            let (cycle, first) = (row / count, row % count);
            let last = count.min(first + rows.end - row);
            let (these, after) = rest.split_at_mut((last - first) * width);
            let start = &starts[cycle * components * width..][..components * width];
            narrow(Write { sums: one, start, rows: first..last, to: &mut *these });
            if let Some(Growing { later, rates }) = growing {
                for &(column, rate) in rates {
                    let more = later.of(cycle) as f64 * rate;
                    these.iter_mut().skip(column).step_by(width).for_each(|number| *number += more);
                }
            }
            (row, rest) = (row + last - first, after);
        }
    }
}

impl Sums {
    /// Of a table with columns by the components of the start before the others.
    fn new(table: &[f64], shape @ (components, width): (usize, usize)) -> Self {
        let rows = || table.chunks_exact(components + width);
        let by = |j: usize| rows().map(|row| if j < components { row[j] } else { 0.0 }).collect();
        Self {
            shape,
            basis: (0..components.next_multiple_of(TOGETHER)).map(by).collect(),
            own: rows().flat_map(|row| &row[components..]).copied().collect(),
        }
    }

    fn rows(&self) -> usize {
        self.basis.first().map_or(0, Vec::len)
    }
}

/// The first place in a range of which something does not hold, where it holds of all before it, and of none
/// after.
pub(super) fn first_not(range: Range<usize>, holds: impl Fn(usize) -> bool) -> usize {
    let Range { mut start, mut end } = range;
    while start < end {
        let middle = start + (end - start) / 2;
        if holds(middle) {
            start = middle + 1;
        } else {
            end = middle;
        }
    }
    start
}

/// Writes some rows of sums.
struct Write<'a> {
    sums: &'a Sums,
    start: &'a [f64],
    rows: Range<usize>,
    to: &'a mut [f64],
}

impl NullaryFnOnce for Write<'_> {
    type Output = ();

    #[inline(always)]
    #[allow(clippy::inline_always)] // compiled for several instruction sets
    fn call(self) {
        let Self { sums: Sums { shape: (components, width), basis, own }, start, rows, to } = self;
        let (components, width) = (*components, *width);
        to.copy_from_slice(&own[rows.start * width..rows.end * width]);
        for (place, basis) in basis.chunks_exact(TOGETHER).enumerate() {
            let of_start = |column: usize, i: usize| {
                let component = TOGETHER * place + i;
                if component < components { start[column * components + component] } else { 0.0 }
            };
            let [a, b, c, d] = [0, 1, 2, 3].map(|i| &basis[i][rows.clone()]);
            let parts = a.iter().zip(b).zip(c).zip(d);
            if width == 1 {
                // Along the rows.
                let [p, q, r, s] = [0, 1, 2, 3].map(|i| of_start(0, i));
                for ((((a, b), c), d), to) in parts.zip(&mut *to) {
                    *to += a * p + b * q + (c * r + d * s);
                }
                continue;
            }
            // Along the columns, a component of all of them after the other.
            let components = [0, 1, 2, 3]
                .map(|i| (0..width).map(|column| of_start(column, i)).collect::<Vec<f64>>());
            let [p, q, r, s] = &components;
            for ((((a, b), c), d), to) in parts.zip(to.chunks_exact_mut(width)) {
                let starts = p.iter().zip(q).zip(r).zip(s);
                for ((((p, q), r), s), to) in starts.zip(to) {
                    *to += a * p + b * q + (c * r + d * s);
                }
            }
        }
    }
}
