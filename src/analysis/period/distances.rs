//! Distances and extents of sections, and how sections draw together.

use crate::analysis::tolerances::{EXTENT_DECREASE, REMAINING_PART};

pub(super) fn distance(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    largest(std::array::from_fn(|i| (a[i] - b[i]).abs()))
}

/// Whether the distance is at most this, told without a jump between the coordinates.
#[inline(always)]
#[allow(clippy::inline_always, clippy::needless_bitwise_bool)] // asked millions of times
pub(super) fn is_within(a: &[f64; 4], b: &[f64; 4], most: f64) -> bool {
    let near = |i: usize| (a[i] - b[i]).abs() <= most;
    (near(0) & near(1)) & (near(2) & near(3))
}

/// Lowest and highest value of each coordinate.
pub(super) struct Bounds {
    low: [f64; 4],
    high: [f64; 4],
}

impl Bounds {
    pub fn of<'a>(sections: impl Iterator<Item = &'a [f64; 4]>) -> Self {
        let mut bounds = Self { low: [f64::MAX; 4], high: [f64::MIN; 4] };
        let Self { low, high } = &mut bounds;
        for section in sections {
            // Not by f64::min, which looks after NaN: vector instructions know comparisons only.
            *low = std::array::from_fn(|i| if section[i] < low[i] { section[i] } else { low[i] });
            *high =
                std::array::from_fn(|i| if section[i] > high[i] { section[i] } else { high[i] });
        }
        bounds
    }

    /// The largest of a coordinate.
    pub fn extent(&self) -> f64 {
        largest(std::array::from_fn(|i| self.high[i] - self.low[i]))
    }

    /// Of the motion: its largest extent or value of a coordinate.
    pub fn size(&self) -> f64 {
        largest(self.low.map(f64::abs)).max(largest(self.high.map(f64::abs))).max(self.extent())
    }

    fn middle(&self) -> [f64; 4] {
        std::array::from_fn(|i| 0.5 * (self.low[i] + self.high[i]))
    }
}

fn largest(values: [f64; 4]) -> f64 {
    values.into_iter().fold(0.0, f64::max)
}

/// Whether [`approach`] may succeed, for a motion of this extent and size: not if two neighbours in
/// the last quarter of the window are further apart than convergence allows by then. If a motion
/// does not converge, the first few sections rule out most m.
pub(super) fn may_approach(sections: &[[f64; 4]], m: usize, extent: f64, size: f64) -> bool {
    let quarter = sections.len() / (4 * m) * m;
    if quarter < 2 * m {
        return false;
    }
    let most = (EXTENT_DECREASE * (EXTENT_DECREASE * (EXTENT_DECREASE * extent)))
        .min(2.0 * REMAINING_PART * size);
    let start = sections.len() - quarter;
    let mut pairs = sections[start + m..].iter().zip(&sections[start..]).rev();
    pairs.all(|(a, b)| is_within(a, b, most))
}

/// How the sections k, k + m, k + 2m ... draw together.
pub(super) struct Approach {
    /// Factor per drive period by which their extent shrinks.
    pub rate: f64,
    /// How far they may still go: half their extent, and the drift of its middle by the geometric
    /// series over quarters of the window.
    pub remaining: f64,
}

/// Extent of the sections k, k + m, ... in each quarter of the window, if it shrinks through all
/// four. The extent, unlike the distance of neighbours, does not mistake a slow spiral of m = 1 for
/// a larger m whose turn happens to be nearly full.
pub(super) fn approach(sections: &[[f64; 4]], m: usize) -> Option<Approach> {
    // Whole multiples of m, so that a residue class keeps its place from quarter to quarter.
    let quarter = sections.len() / (4 * m) * m;
    if quarter < 2 * m {
        return None;
    }
    let start = sections.len() - 4 * quarter;
    let boxes = |i: usize| {
        let part = &sections[start + i * quarter..start + (i + 1) * quarter];
        (0..m).map(move |residue| Bounds::of(part.iter().skip(residue).step_by(m)))
    };
    let mut extents = [0.0; 4];
    for i in 0..4 {
        let most = if i == 0 { f64::INFINITY } else { EXTENT_DECREASE * extents[i - 1] };
        for bounds in boxes(i) {
            let extent = bounds.extent();
            if extent > most {
                return None;
            }
            extents[i] = f64::max(extents[i], extent);
        }
    }
    let drift =
        boxes(2).zip(boxes(3)).map(|(a, b)| distance(&a.middle(), &b.middle())).fold(0.0, f64::max);
    Some(Approach {
        rate: (extents[3] / extents[0]).powf(1.0 / (3 * quarter) as f64),
        remaining: 0.5 * extents[3] + drift / (1.0 - extents[3] / extents[2]),
    })
}
