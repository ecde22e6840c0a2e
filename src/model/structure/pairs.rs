//! How the stops of a structure act on one another, and the sizes that their rounding has.

use super::{Stop, Structure};

/// Mobilities below this part of those of the two stops are rounding.
const UNSEEN: f64 = 1e-13;

impl Structure {
    /// n_i M^-1 n_j.
    pub(crate) fn mobility(&self, i: usize, j: usize) -> f64 {
        product(self.stops[i].normal(), &self.contacts[j].by_normal)
    }

    /// Whether a velocity at the one changes by an impulse at the other.
    pub(crate) fn sees(&self, i: usize, j: usize) -> bool {
        let (mine, other) = (&self.contacts[i], &self.contacts[j]);
        let none = Vec::new();
        let rubs = |k: usize| self.stops[k].friction() > 0.0;
        let tangent = |k: usize| self.stops[k].tangent().filter(|_| rubs(k)).unwrap_or(&none);
        let acts = |row: &[f64], by: &[f64], of: f64, and: f64| {
            product(row, by).abs() > UNSEEN * (of * and).sqrt()
        };
        let ([a, _, c], [a2, _, c2]) = (mine.mobilities, other.mobilities);
        acts(self.stops[i].normal(), &other.by_normal, a, a2)
            || acts(tangent(i), &other.by_normal, c, a2)
            || (rubs(j) && acts(self.stops[i].normal(), &other.by_tangent, a, c2))
            || (rubs(j) && acts(tangent(i), &other.by_tangent, c, c2))
    }

    /// Whether an impulse at stop i presses stop j, which is closed, or rubs it: it opens otherwise, or
    /// is not touched.
    pub(crate) fn presses(&self, i: usize, j: usize) -> bool {
        let rubs = |k: usize| self.stops[k].friction() > 0.0;
        if rubs(i) || rubs(j) {
            return self.sees(i, j);
        }
        self.sees(i, j) && self.mobility(i, j) < 0.0
    }

    /// Whether a stop has friction.
    pub(crate) fn rubs(&self, stop: u32) -> bool {
        self.stops[stop as usize].friction() > 0.0
    }

    /// Whether one of these stops has.
    pub(crate) fn any_rubs(&self, stops: &[u32]) -> bool {
        stops.iter().any(|&stop| self.rubs(stop))
    }

    /// t . q' at a stop; 0 without friction.
    pub(crate) fn slip(&self, stop: usize, v: &[f64]) -> f64 {
        match self.stops[stop].tangent() {
            Some(tangent) if self.stops[stop].friction() > 0.0 => product(tangent, v),
            _ => 0.0,
        }
    }
}

impl Stop {
    /// Sum of the sizes of the terms of the gap function.
    pub(crate) fn gap_size(&self, q: &[f64]) -> f64 {
        sizes(self.normal(), q) + self.gap().abs() + self.amplitude().abs()
    }

    /// Size that its rate has where a structure moves at these velocities.
    pub(crate) fn rate_size(&self, speed: f64, omega: f64) -> f64 {
        let normal: f64 = self.normal().iter().map(|n| n.abs()).sum();
        normal * speed + (self.amplitude() * omega).abs()
    }
}

fn product(row: &[f64], by: &[f64]) -> f64 {
    row.iter().zip(by).map(|(a, b)| a * b).sum()
}

fn sizes(row: &[f64], by: &[f64]) -> f64 {
    row.iter().zip(by).map(|(a, b)| (a * b).abs()).sum()
}
