//! Period m-n of a motion from its stroboscopic section, and its label.
//!
//! m is the smallest number of drive periods after which the section returns with equal impact
//! counts, the distance being small or falling geometrically; a motion that does not return is
//! told apart by the measured growth of a small perturbation ([`Growth`]): chaotic if it grows,
//! quasi-periodic if it does not, unresolved if neither is certain.

use crate::event::{Event, StopReason};
use crate::params::System;
use crate::simulate::{Horizon, Observer, Simulation};
use crate::state::State;

/// A distance below this, relative to the motion's size, is a return; the steady state of a
/// damped motion repeats to 1e-13.
const SMALL: f64 = 1e-9;
/// A falling distance must fall at least by this factor from quarter to quarter of the window,
const FALL: f64 = 0.97;
/// and must promise to end no further away than this part of the motion's size.
const REACH: f64 = 0.1;
/// Size of the perturbation whose growth is measured.
const PERTURBATION: f64 = 1e-8;
/// Shortest and longest measurement, in drive periods.
const GROWTH_PERIODS: (usize, usize) = (200, 1600);

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
    pub orbit: Option<(usize, usize)>,
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
    /// The label: `3-4`, `1-0`, `quasi-periodic`, `chaotic`, `unresolved`.
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
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}

/// Size of the motion on the section: the largest extent of a coordinate, at least its rounding.
fn size(sections: &[[f64; 4]]) -> f64 {
    (0..4)
        .map(|i| {
            let (low, high) =
                sections.iter().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x[i]), h.max(x[i])));
            (high - low).max(high.abs().max(low.abs()))
        })
        .fold(0.0, f64::max)
}

/// Looks for a period in consecutive sections; `counts[k]` are the impacts in the drive period
/// that ends at section k.
#[must_use]
pub fn detect_period(sections: &[[f64; 4]], counts: &[u32]) -> PeriodReport {
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
    report.method = "no return found";
    for m in 1..=kept / 4 {
        let residual = residual(sections, m);
        if m == 1 {
            report.residual = residual;
        }
        let blocks_differ = counts.windows(m + 1).any(|w| w[0] != w[m]);
        if blocks_differ {
            continue;
        }
        let rate = falling(sections, m);
        let small = residual <= SMALL * size;
        let reached =
            rate.is_some_and(|rate| residual <= REACH * size * (1.0 - rate.powi(m as i32)));
        if small || reached {
            let n = counts[kept - m..].iter().map(|&c| c as usize).sum();
            let method = if small { "returns" } else { "converges geometrically" };
            return PeriodReport {
                orbit: Some((m, n)),
                residual,
                rate: rate.unwrap_or(1.0),
                confidence: if small { 1.0 } else { 0.9 },
                method,
                kind: Kind::Periodic,
                ..report
            };
        }
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

/// Fall of |X(k + m) - X(k)| per drive period, if it falls through all four quarters of the window.
fn falling(sections: &[[f64; 4]], m: usize) -> Option<f64> {
    let differences = sections.len() - m;
    let quarter = differences / 4;
    if quarter < m {
        return None;
    }
    let mut peaks = [0f64; 4];
    for (i, peak) in peaks.iter_mut().enumerate() {
        let first = differences - (4 - i) * quarter;
        *peak = (first..first + quarter)
            .map(|k| distance(&sections[k + m], &sections[k]))
            .fold(0.0, f64::max);
    }
    let falls = peaks.windows(2).all(|w| w[1] <= FALL * w[0]);
    falls.then(|| (peaks[3] / peaks[0]).powf(1.0 / (3 * quarter) as f64))
}

struct LastSection(Option<State>);

impl Observer for LastSection {
    const SECTIONS: bool = true;
    fn section(&mut self, _: i64, state: &State) {
        self.0 = Some(*state);
    }
}

/// State one drive period after a section.
fn one_period(system: &System, state: State) -> Option<State> {
    let mut simulation = Simulation::new(system, state).ok()?.until(Horizon::Periods(1));
    let mut section = LastSection(None);
    while let Some(event) = simulation.advance(&mut section) {
        if let Event::Stop(stop) = event.ok()? {
            return (stop.reason == StopReason::Completed).then_some(section.0)?;
        }
    }
    None
}

/// Growth of a perturbation of a motion that passes through `state` at a section of phase phi.
fn measure_growth(system: &System, mut state: State, periods: usize) -> Option<Growth> {
    let mut nearby = State { v1: state.v1 + PERTURBATION, ..state };
    let mut logs = Vec::with_capacity(periods);
    for _ in 0..periods {
        let next = one_period(system, state)?;
        let next_nearby = one_period(system, nearby)?;
        let (a, b) = (next.to_array(), next_nearby.to_array());
        let d = distance(&a, &b).max(f64::EPSILON * PERTURBATION);
        logs.push((d / PERTURBATION).ln());
        let scale = PERTURBATION / d;
        let pulled: [f64; 4] = std::array::from_fn(|i| a[i] + (b[i] - a[i]) * scale);
        nearby = State::from_array(pulled);
        state = next;
    }
    // The first tenth aligns the perturbation.
    let used = &logs[periods / 10..];
    let mean = used.iter().sum::<f64>() / used.len() as f64;
    let blocks: Vec<f64> = used
        .chunks(used.len().div_ceil(10))
        .map(|block| block.iter().sum::<f64>() / block.len() as f64)
        .collect();
    let n = blocks.len() as f64;
    let variance = blocks.iter().map(|b| (b - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    Some(Growth { mean, error: (variance / n).sqrt(), periods })
}

/// Decides a motion that does not repeat by following a nearby one from `state`, the state at a
/// section of forcing phase phi.
#[must_use]
pub fn resolve_by_growth(system: &System, state: State, mut report: PeriodReport) -> PeriodReport {
    let (mut periods, longest) = GROWTH_PERIODS;
    while periods <= longest {
        let Some(growth) = measure_growth(system, state, periods) else {
            report.method = "no return found, growth not measurable";
            return report;
        };
        report.growth = Some(growth);
        let total = growth.mean * periods as f64;
        // A shear grows like the time itself: ln(periods) is no sign of chaos.
        let shear = (periods as f64).ln();
        if total > shear + 4.0 && growth.mean > 3.0 * growth.error {
            report.kind = Kind::Chaotic;
            report.confidence = 1.0 - (-(total - shear) / 4.0).exp();
            report.method = "a nearby orbit departs exponentially";
            return report;
        }
        if total < shear + 1.0 && periods >= 2 * GROWTH_PERIODS.0 {
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
        assert_eq!(report.orbit, Some((5, 10)));
        assert_eq!(report.label(), "5-10");
    }

    #[test]
    fn unequal_impact_counts_rule_a_period_out() {
        let sections = vec![[1.0, 0.0, 0.0, 0.0]; 40];
        let counts: Vec<u32> = (0..40).map(|k| k % 2).collect();
        assert_eq!(detect_period(&sections, &counts).orbit, Some((2, 1)));
    }

    #[test]
    fn slow_geometric_convergence_counts_and_a_torus_does_not() {
        let slow: Vec<[f64; 4]> =
            (0..100).map(|k| [1.0 + 0.1 * 0.95f64.powi(k), 0.0, 0.0, 0.0]).collect();
        let report = detect_period(&slow, &[1; 100]);
        assert_eq!(report.orbit, Some((1, 1)));
        assert!((report.rate - 0.95).abs() < 1e-3);
        assert_eq!(detect_period(&circle(1.0, 0.0, 100), &[1; 100]).orbit, None);
    }
}
