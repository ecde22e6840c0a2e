//! Period m-n of a motion from its stroboscopic section, and its label.
//!
//! m is the smallest number of drive periods after which the section returns with equal impact
//! counts, the distance being small or falling geometrically; a motion that does not return is
//! told apart by the measured growth of a small perturbation ([`Growth`]): chaotic if it grows,
//! quasi-periodic if it does not, unresolved if neither is certain.

use crate::event::Event;
use crate::params::System;
use crate::simulate::{Horizon, Observer, Simulation};
use crate::state::State;

/// A distance below this, relative to the motion's size, is a return; the steady state of a
/// damped motion repeats to 1e-13.
const SMALL: f64 = 1e-9;
/// Where a motion still converges, its extent must shrink at least by this factor from quarter to
/// quarter of the window,
const FALL: f64 = 0.97;
/// and must promise to go no further than this part of the motion's size.
const REACH: f64 = 0.25;
/// Fewest sections from which a period is told: too few make a slow drift look like convergence.
const SHORTEST_TAIL: usize = 100;
/// Size of the perturbation whose growth is measured.
const PERTURBATION: f64 = 1e-8;
/// Shortest and longest measurement, in drive periods.
const GROWTH_PERIODS: (usize, usize) = (1600, 6400);

/// Growth of a small perturbation, renormalised after every drive period (Benettin et al. 1980).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Growth {
    /// Mean of the logarithmic growth per drive period.
    pub mean: f64,
    /// Its standard error, from the means of ten blocks.
    pub error: f64,
    /// Drive periods it was measured over.
    pub periods: usize,
}

/// What the stroboscopic section says of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeriodReport {
    /// Drive periods m and impacts n per orbit, if the motion repeats.
    pub orbit: Option<(usize, ImpactCount)>,
    /// Largest |X(k + m) - X(k)| over the last min(K - m, 3 m) sections; for m = 1 if none fits.
    pub residual: f64,
    /// Factor by which the residual falls per drive period; 1 where it does not.
    pub rate: f64,
    /// Growth of a perturbation, where it was needed and could be measured.
    pub growth: Option<Growth>,
    /// From 0 (a guess) to 1.
    pub confidence: f64,
    /// How the verdict was reached.
    pub method: &'static str,
    /// The verdict where the motion does not repeat.
    pub kind: Kind,
}

/// Impacts per orbit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImpactCount {
    /// So many.
    Finite(usize),
    /// Complete chatter.
    Infinite,
}

impl std::fmt::Display for ImpactCount {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Finite(n) => write!(f, "{n}"),
            Self::Infinite => write!(f, "inf"),
        }
    }
}

/// Impacts in a drive period with complete chatter.
pub const CHATTERING: u32 = u32::MAX;

/// Kind of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// Repeats after m drive periods.
    Periodic,
    /// Does not repeat; a perturbation does not grow.
    QuasiPeriodic,
    /// Does not repeat; a perturbation grows.
    Chaotic,
    /// None of these is certain.
    Unresolved,
}

impl PeriodReport {
    /// The label: `3-4`, `1-0`, `2-inf` (chatter), `quasi-periodic`, `chaotic`, `unresolved`.
    #[must_use]
    pub fn label(&self) -> String {
        match (self.kind, self.orbit) {
            (Kind::Periodic, Some((m, n))) => format!("{m}-{n}"),
            (Kind::QuasiPeriodic, _) => "quasi-periodic".into(),
            (Kind::Chaotic, _) => "chaotic".into(),
            _ => "unresolved".into(),
        }
    }
}

fn distance(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    largest(std::array::from_fn(|i| (a[i] - b[i]).abs()))
}

/// Size of the motion on the section: the largest extent or value of a coordinate.
fn size(sections: &[[f64; 4]]) -> f64 {
    largest(bounding_box(sections.iter()).map(|(l, h)| (h - l).max(h.abs()).max(l.abs())))
}

/// Looks for a period in consecutive sections; `counts[k]` are the impacts in the drive period
/// that ends at section k, [`CHATTERING`] where they are infinitely many. A motion that still moved early in the window may have settled late in
/// it: if the whole window shows no return, its last half, quarter ... are tried.
#[must_use]
pub fn detect_period(sections: &[[f64; 4]], counts: &[u32]) -> PeriodReport {
    let whole = detect_in(sections, counts);
    let kept = sections.len();
    if whole.orbit.is_some() || counts.len() != kept {
        return whole;
    }
    let tails = std::iter::successors(Some(kept / 2), |tail| Some(tail / 2));
    tails
        .take_while(|&tail| tail >= SHORTEST_TAIL)
        .map(|tail| detect_in(&sections[kept - tail..], &counts[kept - tail..]))
        .find(|report| report.orbit.is_some())
        .unwrap_or(whole)
}

fn detect_in(sections: &[[f64; 4]], counts: &[u32]) -> PeriodReport {
    let kept = sections.len();
    let mut report = PeriodReport {
        orbit: None,
        residual: f64::NAN,
        rate: 1.0,
        growth: None,
        confidence: 0.0,
        method: "too few sections",
        kind: Kind::Unresolved,
    };
    if kept < 4 || counts.len() != kept {
        return report;
    }
    let size = size(sections).max(f64::MIN_POSITIVE);
    // Values far from zero (a rotor after many turns) must not make a drift look small.
    let extent = largest(bounding_box(sections.iter()).map(|(l, h)| h - l));
    let negligible = (SMALL * extent).max(1e-13 * size);
    report.method = "no return found";
    let equal_counts = |m: usize| counts.windows(m + 1).all(|w| w[0] == w[m]);
    report.residual = residual(sections, 1);
    for m in (1..=kept / 4).filter(|&m| equal_counts(m)) {
        let small = residual(sections, m) <= negligible;
        let approach = approach(sections, m).filter(|a| a.remaining <= REACH * size);
        if !small && approach.is_none() {
            continue;
        }
        // While it converges, an orbit whose points are no further apart than they still move may
        // be one of fewer periods.
        let remaining = approach.as_ref().map_or(0.0, |a| a.remaining);
        let merged = |d: usize| m % d == 0 && residual(sections, d) <= 2.0 * remaining;
        let m = (1..m).filter(|&d| equal_counts(d)).find(|&d| !small && merged(d)).unwrap_or(m);
        let orbit = &counts[kept - m..];
        let n = if orbit.contains(&CHATTERING) {
            ImpactCount::Infinite
        } else {
            ImpactCount::Finite(orbit.iter().map(|&c| c as usize).sum())
        };
        return PeriodReport {
            orbit: Some((m, n)),
            residual: residual(sections, m),
            rate: approach.map_or(1.0, |a| a.rate),
            confidence: if small { 1.0 } else { 0.9 },
            method: if small { "returns" } else { "converges geometrically" },
            kind: Kind::Periodic,
            ..report
        };
    }
    report
}

fn residual(sections: &[[f64; 4]], m: usize) -> f64 {
    let kept = sections.len();
    let last = (kept - m).min(3 * m);
    (kept - m - last..kept - m)
        .map(|k| distance(&sections[k + m], &sections[k]))
        .fold(0.0, f64::max)
}

/// How the sections k, k + m, k + 2m ... draw together.
struct Approach {
    /// Factor per drive period by which their extent shrinks.
    rate: f64,
    /// How far they may still go: half their extent, and the drift of its middle by the geometric
    /// series over quarters of the window.
    remaining: f64,
}

/// Extent of the sections k, k + m, ... in each quarter of the window, if it shrinks through all
/// four. The extent, unlike the distance of neighbours, does not mistake a slow spiral of m = 1 for
/// a larger m whose turn happens to be nearly full.
fn approach(sections: &[[f64; 4]], m: usize) -> Option<Approach> {
    // Whole multiples of m, so that a residue class keeps its place from quarter to quarter.
    let quarter = sections.len() / (4 * m) * m;
    if quarter < 2 * m {
        return None;
    }
    let start = sections.len() - 4 * quarter;
    let boxes = |i: usize| {
        let part = &sections[start + i * quarter..start + (i + 1) * quarter];
        (0..m).map(move |residue| bounding_box(part.iter().skip(residue).step_by(m)))
    };
    let extents: [f64; 4] = std::array::from_fn(|i| {
        boxes(i).map(|b| largest(b.map(|(l, h)| h - l))).fold(0.0, f64::max)
    });
    if extents.windows(2).any(|w| w[1] > FALL * w[0]) {
        return None;
    }
    let middle = |(low, high): (f64, f64)| 0.5 * (low + high);
    let drift = boxes(2)
        .zip(boxes(3))
        .map(|(a, b)| largest(std::array::from_fn(|i| (middle(a[i]) - middle(b[i])).abs())))
        .fold(0.0, f64::max);
    Some(Approach {
        rate: (extents[3] / extents[0]).powf(1.0 / (3 * quarter) as f64),
        remaining: 0.5 * extents[3] + drift / (1.0 - extents[3] / extents[2]),
    })
}

/// Lowest and highest value of each coordinate.
fn bounding_box<'a>(sections: impl Iterator<Item = &'a [f64; 4]>) -> [(f64, f64); 4] {
    sections.fold([(f64::MAX, f64::MIN); 4], |mut bounds, section| {
        for ((low, high), &x) in bounds.iter_mut().zip(section) {
            *low = low.min(x);
            *high = high.max(x);
        }
        bounds
    })
}

fn largest(values: [f64; 4]) -> f64 {
    values.into_iter().fold(0.0, f64::max)
}

struct LastSection(Option<State>);

impl Observer for LastSection {
    const SECTIONS: bool = true;
    fn section(&mut self, _: i64, state: &State) {
        self.0 = Some(*state);
    }
}

/// State one drive period after a section, and the impacts on the way.
fn one_period(system: &System, state: State) -> Option<(State, u32)> {
    let mut simulation = Simulation::new(system, state).ok()?.until(Horizon::Periods(1));
    let mut section = LastSection(None);
    let mut impacts = 0;
    while let Some(event) = simulation.advance(&mut section) {
        match event.ok()? {
            Event::Impact(_) => impacts = u32::saturating_add(impacts, 1),
            Event::Chatter(_) => impacts = CHATTERING,
            Event::Stop(stop) if !stop.reason.reached_the_end() => return None,
            _ => {}
        }
    }
    section.0.map(|state| (state, impacts))
}

/// A motion and a nearby one, followed from a section of forcing phase phi.
struct Pair<'a> {
    system: &'a System,
    state: State,
    nearby: State,
    logs: Vec<f64>,
    sections: Vec<[f64; 4]>,
    counts: Vec<u32>,
}

impl<'a> Pair<'a> {
    /// Both bodies are perturbed: without contact, or without friction, they know nothing of each
    /// other.
    fn new(system: &'a System, state: State) -> Self {
        let nearby = State { v1: state.v1 + PERTURBATION, v2: state.v2 + PERTURBATION, ..state };
        Self { system, state, nearby, logs: Vec::new(), sections: Vec::new(), counts: Vec::new() }
    }

    /// Goes on until so many periods are followed; `None` where the motion cannot be.
    fn follow(&mut self, periods: usize) -> Option<()> {
        while self.logs.len() < periods {
            let (next, impacts) = one_period(self.system, self.state)?;
            let (nearby, _) = one_period(self.system, self.nearby)?;
            let (a, b) = (next.to_array(), nearby.to_array());
            let d = distance(&a, &b).max(f64::EPSILON * PERTURBATION);
            self.logs.push((d / PERTURBATION).ln());
            let pull = PERTURBATION / d;
            let nearby = State::from_array(std::array::from_fn(|i| a[i] + (b[i] - a[i]) * pull));
            // Between two states in contact g may be positive, by the square of the distance.
            let overlaps = self.system.gap_function(&nearby) > 0.0;
            self.nearby = if overlaps { self.system.touching(nearby) } else { nearby };
            self.state = next;
            self.sections.push(a);
            self.counts.push(impacts);
        }
        Some(())
    }

    fn growth(&self) -> Growth {
        // The first quarter aligns the perturbation.
        let used = &self.logs[self.logs.len() / 4..];
        let mean = used.iter().sum::<f64>() / used.len() as f64;
        let blocks: Vec<f64> = used
            .chunks(used.len().div_ceil(10))
            .map(|block| block.iter().sum::<f64>() / block.len() as f64)
            .collect();
        let n = blocks.len() as f64;
        let variance = blocks.iter().map(|b| (b - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
        Growth { mean, error: (variance / n).sqrt(), periods: self.logs.len() }
    }
}

/// Decides a motion that does not repeat by following it and a nearby one from `state`, the state
/// at a section of forcing phase phi.
#[must_use]
pub fn resolve_by_growth(system: &System, state: State, mut report: PeriodReport) -> PeriodReport {
    let (mut periods, longest) = GROWTH_PERIODS;
    let mut pair = Pair::new(system, state);
    while periods <= longest {
        if pair.follow(periods).is_none() {
            report.method = "no return found, growth not measurable";
            return report;
        }
        let growth = pair.growth();
        report.growth = Some(growth);
        let total = growth.mean * periods as f64;
        // A shear grows like the time itself: ln(periods) is no sign of chaos.
        let shear = (periods as f64).ln();
        if total > shear + 4.0 && growth.mean > 4.0 * growth.error {
            report.kind = Kind::Chaotic;
            report.confidence = 1.0 - (-(total - shear) / 4.0).exp();
            report.method = "a nearby orbit departs exponentially";
            return report;
        }
        if total < -(shear + 4.0) && growth.mean < -4.0 * growth.error {
            // It still settles: it will return.
            let later = detect_period(&pair.sections, &pair.counts);
            if later.orbit.is_some() {
                let method = "a nearby orbit comes closer; returns when followed further";
                let confidence = 0.7 * later.confidence;
                return PeriodReport { growth: report.growth, confidence, method, ..later };
            }
        } else if total + 2.0 * growth.error * (periods as f64) < shear + 1.0 {
            // Even two standard errors more would be no more than a shear.
            report.kind = Kind::QuasiPeriodic;
            report.confidence = 0.8;
            report.method = "no return found, a nearby orbit does not depart";
            return report;
        }
        periods *= 2;
    }
    report.method = "no return found, growth undecided";
    report
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(angle: f64, shrink: f64, count: usize) -> Vec<[f64; 4]> {
        (0..count)
            .map(|k| {
                let (s, c) = (angle * k as f64).sin_cos();
                let r = 1.0 + shrink.powi(k as i32);
                [r * c, r * s, 0.0, 0.0]
            })
            .collect()
    }

    #[test]
    fn a_closed_orbit_is_found_with_its_smallest_period() {
        let angle = std::f64::consts::TAU / 5.0;
        let report = detect_period(&circle(angle, 0.0, 60), &[2; 60]);
        assert_eq!(report.orbit, Some((5, ImpactCount::Finite(10))));
        assert_eq!(report.label(), "5-10");
    }

    #[test]
    fn unequal_impact_counts_rule_a_period_out() {
        let sections = vec![[1.0, 0.0, 0.0, 0.0]; 40];
        let counts: Vec<u32> = (0..40).map(|k| k % 2).collect();
        assert_eq!(detect_period(&sections, &counts).orbit, Some((2, ImpactCount::Finite(1))));
    }

    #[test]
    fn a_slow_spiral_is_not_taken_for_the_period_of_its_turn() {
        // Turns by nearly a third while it shrinks by 1 % a period.
        let angle = std::f64::consts::TAU / 3.0 + 1e-3;
        let spiral: Vec<[f64; 4]> = (0..100)
            .map(|k| {
                let r = 0.1 * 0.99f64.powi(k);
                let (s, c) = (angle * f64::from(k)).sin_cos();
                [1.0 + r * c, r * s, 0.0, 0.0]
            })
            .collect();
        assert_eq!(detect_period(&spiral, &[1; 100]).orbit, Some((1, ImpactCount::Finite(1))));
    }

    #[test]
    fn slow_geometric_convergence_counts_and_a_torus_does_not() {
        let slow: Vec<[f64; 4]> =
            (0..100).map(|k| [1.0 + 0.1 * 0.95f64.powi(k), 0.0, 0.0, 0.0]).collect();
        let report = detect_period(&slow, &[1; 100]);
        assert_eq!(report.orbit, Some((1, ImpactCount::Finite(1))));
        assert!((report.rate - 0.95).abs() < 1e-3);
        assert_eq!(detect_period(&circle(1.0, 0.0, 100), &[1; 100]).orbit, None);
    }
}
