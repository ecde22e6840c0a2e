//! The rows of all points of a sweep in one piece, column by column.

use rayon::prelude::*;

use super::SweepPoint;
use crate::analysis::workers::Workers;

/// Columns of an impact section.
const COLUMNS: usize = 6;

/// The section rows of all points, one point after the other: for arrays and files.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SweepRows {
    /// Impacts of each point.
    pub impact_count: Vec<usize>,
    /// Stroboscopic states of each point.
    pub stroboscopic_count: Vec<usize>,
    /// The columns of [`SweepPoint::impact_section`] one after the other.
    pub impact_section: Vec<f64>,
    /// Regime number of each impact.
    pub regime: Vec<i8>,
    /// Stroboscopic states.
    pub stroboscopic: Vec<[f64; 4]>,
}

/// Some of the points, and the places of their rows.
struct Share<'a> {
    points: &'a [SweepPoint],
    columns: [&'a mut [f64]; COLUMNS],
    regime: &'a mut [i8],
    stroboscopic: &'a mut [[f64; 4]],
}

impl SweepRows {
    /// Copies the rows on the threads, to which the memory is new.
    #[must_use]
    pub fn of(points: &[SweepPoint], workers: &Workers) -> Self {
        let impacts = |points: &[SweepPoint]| points.iter().map(|p| p.impact_section.len()).sum();
        let sections = |points: &[SweepPoint]| points.iter().map(|p| p.stroboscopic.len()).sum();
        let (count, states): (usize, usize) = (impacts(points), sections(points));
        let mut rows = Self {
            impact_count: points.iter().map(|p| p.impact_section.len()).collect(),
            stroboscopic_count: points.iter().map(|p| p.stroboscopic.len()).collect(),
            impact_section: vec![0.0; COLUMNS * count],
            regime: vec![0; count],
            stroboscopic: vec![[0.0; 4]; states],
        };
        workers.install(|| {
            let mut whole = rows.impact_section.as_mut_slice();
            let mut columns: [&mut [f64]; COLUMNS] =
                std::array::from_fn(|_| first(&mut whole, count));
            let mut regime = rows.regime.as_mut_slice();
            let mut stroboscopic = rows.stroboscopic.as_mut_slice();
            let most = points.len().div_ceil(rayon::current_num_threads()).max(1);
            let shares: Vec<_> = points
                .chunks(most)
                .map(|points| Share {
                    points,
                    columns: columns.each_mut().map(|column| first(column, impacts(points))),
                    regime: first(&mut regime, impacts(points)),
                    stroboscopic: first(&mut stroboscopic, sections(points)),
                })
                .collect();
            shares.into_par_iter().for_each(Share::fill);
        });
        rows
    }
}

impl Share<'_> {
    fn fill(mut self) {
        for point in self.points {
            let count = point.impact_section.len();
            for (i, column) in self.columns.iter_mut().enumerate() {
                for (place, row) in first(column, count).iter_mut().zip(&point.impact_section) {
                    *place = row[i];
                }
            }
            for (place, &regime) in first(&mut self.regime, count).iter_mut().zip(&point.regime) {
                *place = regime;
            }
            let states = first(&mut self.stroboscopic, point.stroboscopic.len());
            states.copy_from_slice(&point.stroboscopic);
        }
    }
}

/// Takes the first so many entries off a slice; fewer where it has fewer.
#[allow(clippy::mut_mut)] // the slice itself is shortened
fn first<'a, T>(slice: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    let count = count.min(slice.len());
    slice.split_off_mut(..count).unwrap_or_default()
}
