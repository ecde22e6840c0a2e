//! Distances and extents of sections, and how sections draw together.

use crate::analysis::tolerances::{EXTENT_DECREASE, REMAINING_PART};
use crate::model::Point;

/// Largest difference of a coordinate.
#[inline]
pub(crate) fn distance<P: Point>(a: &P, b: &P) -> f64 {
    a.zip(b, |a, b| (a - b).abs()).largest()
}

/// Lowest and highest value of each coordinate.
pub(super) struct Bounds<P> {
    low: P,
    high: P,
}

impl<P: Point> Bounds<P> {
    /// Of one section or more.
    pub fn of<'a>(mut sections: impl Iterator<Item = &'a P>) -> Option<Self>
    where
        P: 'a,
    {
        let first = sections.next()?;
        let mut bounds = Self { low: first.clone(), high: first.clone() };
        let Self { low, high } = &mut bounds;
        for section in sections {
            // Not by f64::min, which looks after NaN: vector instructions know comparisons only.
            *low = section.zip(low, |x, low| if x < low { x } else { low });
            *high = section.zip(high, |x, high| if x > high { x } else { high });
        }
        Some(bounds)
    }

    /// The largest of a coordinate.
    pub fn extent(&self) -> f64 {
        self.high.zip(&self.low, |high, low| high - low).largest()
    }

    /// Of the motion: its largest extent or value of a coordinate.
    pub fn size(&self) -> f64 {
        let sizes = self.low.zip(&self.high, |low, high| low.abs().max(high.abs()));
        sizes.largest().max(self.extent())
    }

    fn middle(&self) -> P {
        self.low.zip(&self.high, |low, high| 0.5 * (low + high))
    }
}

/// Whether [`approach`] may succeed, for a motion of this extent and size: not if two neighbours in
/// the last quarter of the window are further apart than convergence allows by then. If a motion
/// does not converge, the first few sections rule out most m.
pub(super) fn may_approach<P: Point>(sections: &[P], m: usize, extent: f64, size: f64) -> bool {
    let quarter = sections.len() / (4 * m) * m;
    if quarter < 2 * m {
        return false;
    }
    let most = (EXTENT_DECREASE * (EXTENT_DECREASE * (EXTENT_DECREASE * extent)))
        .min(2.0 * REMAINING_PART * size);
    let start = sections.len() - quarter;
    let mut pairs = sections[start + m..].iter().zip(&sections[start..]).rev();
    pairs.all(|(a, b)| a.is_within(b, most))
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
pub(super) fn approach<P: Point>(sections: &[P], m: usize) -> Option<Approach> {
    // Whole multiples of m, so that a residue class keeps its place from quarter to quarter.
    let quarter = sections.len() / (4 * m) * m;
    if quarter < 2 * m {
        return None;
    }
    let start = sections.len() - 4 * quarter;
    let boxes = |i: usize| {
        let part = &sections[start + i * quarter..start + (i + 1) * quarter];
        (0..m).filter_map(move |residue| Bounds::of(part.iter().skip(residue).step_by(m)))
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
