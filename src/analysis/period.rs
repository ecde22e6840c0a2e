//! Period m-n of a motion from its stroboscopic section, and its label.
//!
//! m is the smallest number of drive periods after which the section returns with equal impact
//! counts, if the distance is small or decreases geometrically. A distance that decreases may grow
//! again later (near a saddle, or for a while in chaos): label.rs therefore follows the motion
//! further, and labels one that does not return by the growth of a small perturbation.

mod distances;
mod evidence;
mod report;

pub(crate) use distances::distance;
pub(crate) use evidence::GrowthVerdict;
pub use evidence::{Evidence, EvidenceKind, Growth, WhyUndecided};
pub use report::{ImpactCount, Kind, PeriodReport};

use self::distances::{Approach, Bounds, approach, may_approach};
use crate::analysis::tolerances::{
    COME_BACK, NEAREST_TRIED, REMAINING_PART, RETURN_RTOL, SECTION_NOISE, SHORT_PERIODS,
    SHORTEST_TAIL,
};
use crate::model::Point;
use crate::numerics::cancel::CancelToken;
use crate::simulate::event::EventKind;
use crate::simulate::run::{Recorded, Row, Run};

/// Periods tried between two checks of the cancellation token: a millisecond with ten thousand
/// sections, a tenth of a second with a million.
const PERIODS_PER_LOOK: usize = 64;

/// Impacts in a drive period with complete chatter.
pub const CHATTERING: u32 = u32::MAX;

/// Whether the last section has come back close to one before, so that it is worth while to look for
/// a period of no more than a quarter of the sections.
pub(crate) fn comes_back<P: Point>(sections: &[P]) -> bool {
    let Some((last, before)) = sections.split_last() else { return false };
    let most = COME_BACK * last.zip(last, |x, _| x.abs()).largest().max(1.0);
    before.iter().rev().take(sections.len() / 4).any(|section| section.is_within(last, most))
}

/// Numbers of periods, at most `most`, after which the impacts repeat and the last section comes
/// nearer to where it was than after any fewer such number.
pub(crate) fn nearest_returns<P: Point>(sections: &[P], counts: &[u32], most: usize) -> Vec<usize> {
    let Some((last, before)) = sections.split_last() else { return Vec::new() };
    let matching = matching_counts(counts);
    let mut nearest = f64::INFINITY;
    let mut comes_nearer = |m: usize| {
        let from = distance(last, &before[before.len() - m]);
        let nearer = from < nearest;
        nearest = nearest.min(from);
        nearer
    };
    (1..=most.min(before.len()))
        .filter(|&m| matching[m] == counts.len() - m && comes_nearer(m))
        .collect()
}

/// Looks for a period in consecutive sections; `counts[k]` are the impacts in the drive period
/// that ends at section k, [`CHATTERING`] where they are infinitely many. A motion that still moved
/// early in the window may have settled late in it: if the whole window shows no return, its last
/// half, quarter ... are tried. Nothing is found once `cancel` has ended it.
#[must_use]
pub fn detect_period<P: Point>(
    sections: &[P],
    counts: &[u32],
    cancel: &CancelToken,
) -> PeriodReport {
    detect(sections, counts, Tried::All, cancel)
}

/// As [`detect_period`], but of long periods only those are tried after which the last section comes
/// nearest to where it was: of thousands of sections, all would take longer than the motion.
pub(crate) fn detect_nearest<P: Point>(
    sections: &[P],
    counts: &[u32],
    cancel: &CancelToken,
) -> PeriodReport {
    detect(sections, counts, Tried::Nearest, cancel)
}

/// Which m are tried.
#[derive(Clone, Copy, PartialEq)]
enum Tried {
    All,
    Nearest,
}

fn detect<P: Point>(
    sections: &[P],
    counts: &[u32],
    tried: Tried,
    cancel: &CancelToken,
) -> PeriodReport {
    let whole = detect_in(sections, counts, tried, cancel);
    let kept = sections.len();
    if whole.orbit.is_some() || counts.len() != kept {
        return whole;
    }
    let tails = std::iter::successors(Some(kept / 2), |tail| Some(tail / 2));
    tails
        .take_while(|&tail| tail >= SHORTEST_TAIL)
        .map(|tail| detect_in(&sections[kept - tail..], &counts[kept - tail..], tried, cancel))
        .find(|report| report.orbit.is_some())
        .unwrap_or(whole)
}

/// Distance of the last section from the one m periods before, above which a long period is not
/// tried.
fn nearest<P: Point>(sections: &[P], equal_counts: impl Fn(usize) -> bool) -> f64 {
    let kept = sections.len();
    let long = SHORT_PERIODS + 1..=kept / 4;
    let mut distances: Vec<f64> = long
        .filter(|&m| equal_counts(m))
        .map(|m| distance(&sections[kept - 1], &sections[kept - 1 - m]))
        .collect();
    if distances.len() <= NEAREST_TRIED {
        return f64::INFINITY;
    }
    *distances.select_nth_unstable_by(NEAREST_TRIED, f64::total_cmp).1
}

fn detect_in<P: Point>(
    sections: &[P],
    counts: &[u32],
    tried: Tried,
    cancel: &CancelToken,
) -> PeriodReport {
    let kept = sections.len();
    let mut report = PeriodReport {
        orbit: None,
        residual: f64::NAN,
        evidence: Evidence::undecided(WhyUndecided::TooFewSections),
        kind: Kind::Unresolved,
    };
    if kept < 4 || counts.len() != kept {
        return report;
    }
    if !sections.iter().all(Point::all_finite) {
        report.evidence = Evidence::undecided(WhyUndecided::NotFinite);
        return report;
    }
    let Some(whole) = Bounds::of(sections.iter()) else { return report };
    let size = whole.size().max(f64::MIN_POSITIVE);
    // Values far from zero (a rotor after many turns) must not make a drift look small.
    let extent = whole.extent();
    let negligible = (RETURN_RTOL * extent).max(SECTION_NOISE * size);
    report.evidence = Evidence::undecided(WhyUndecided::NoReturn);
    let matching = matching_counts(counts);
    let equal_counts = |m: usize| matching[m] == kept - m;
    report.residual = residual(sections, 1);
    let most = if tried == Tried::All { f64::INFINITY } else { nearest(sections, equal_counts) };
    let is_tried = |m: usize| {
        m <= SHORT_PERIODS || distance(&sections[kept - 1], &sections[kept - 1 - m]) < most
    };
    let wanted = (1..=kept / 4).filter(|&m| equal_counts(m) && is_tried(m));
    for (number, m) in wanted.enumerate() {
        if number % PERIODS_PER_LOOK == PERIODS_PER_LOOK - 1 && cancel.is_cancelled() {
            break;
        }
        let small = returns(sections, m, negligible);
        let approach = if may_approach(sections, m, extent, size) {
            approach(sections, m).filter(|a| a.remaining <= REMAINING_PART * size)
        } else {
            None
        };
        if !small && approach.is_none() {
            continue;
        }
        // An orbit whose points are no further apart than they still move, or than a few times what
        // counts as a return, is one of fewer periods.
        let remaining = approach.as_ref().map_or(0.0, |a| a.remaining);
        let apart = if small { 4.0 * negligible } else { 2.0 * remaining };
        let merged = |&d: &usize| m % d == 0 && equal_counts(d) && returns(sections, d, apart);
        let m = (1..m).find(merged).unwrap_or(m);
        let n = ImpactCount::of(&counts[kept - m..]);
        return PeriodReport {
            orbit: Some((m, n)),
            residual: residual(sections, m),
            evidence: match approach {
                Some(Approach { rate, .. }) if !small => {
                    Evidence::Converging { rate, further: 0, from_orbit: false }
                }
                _ => Evidence::Returned { further: 0 },
            },
            kind: Kind::Periodic,
        };
    }
    report
}

/// For each m the length of the longest common prefix of the counts and of the counts from the m-th
/// on (Main and Lorentz (1984); Gusfield (1997), section 1.4). If the counts repeat after m, it
/// reaches the end. All m together take one pass.
fn matching_counts(counts: &[u32]) -> Vec<usize> {
    let kept = counts.len();
    let mut matching = vec![0; kept];
    // The match known so far that reaches furthest.
    let (mut begin, mut end) = (0, 0);
    for m in 1..kept {
        let mut length = if m < end { matching[m - begin].min(end - m) } else { 0 };
        while m + length < kept && counts[length] == counts[m + length] {
            length += 1;
        }
        matching[m] = length;
        if m + length > end {
            (begin, end) = (m, m + length);
        }
    }
    matching
}

/// Pairs X(k + m), X(k) of the last min(K - m, 3 m) sections, the last ones first, since they decide
/// most often.
fn last_pairs<P>(sections: &[P], m: usize) -> impl Iterator<Item = (&P, &P)> {
    let kept = sections.len();
    let last = (kept - m).min(3 * m);
    (kept - m - last..kept - m).rev().map(move |k| (&sections[k + m], &sections[k]))
}

/// Largest |X(k + m) - X(k)| of these.
pub(crate) fn residual<P: Point>(sections: &[P], m: usize) -> f64 {
    last_pairs(sections, m).map(|(a, b)| distance(a, b)).fold(0.0, f64::max)
}

/// Whether the residual of m is at most `most`; the first larger distance decides.
fn returns<P: Point>(sections: &[P], m: usize, most: f64) -> bool {
    last_pairs(sections, m).all(|(a, b)| a.is_within(b, most))
}

impl<M: Recorded> Run<M> {
    /// The period from the kept sections alone, without following a nearby orbit.
    #[must_use]
    pub fn return_report(&self, cancel: &CancelToken) -> PeriodReport {
        if self.system.own_drive().omega == 0.0 {
            return PeriodReport {
                orbit: None,
                residual: f64::NAN,
                evidence: Evidence::undecided(WhyUndecided::NoDrivePeriod),
                kind: Kind::Unresolved,
            };
        }
        let (sections, counts) = self.counted_sections();
        detect_period(sections, &counts[..sections.len()], cancel)
    }

    /// The kept sections that end a whole interval, and the impacts in each, with those in the
    /// interval that has begun.
    pub(crate) fn counted_sections(&self) -> (&[M::Section], Vec<u32>) {
        let shift = self.options.section_phase / self.system.own_drive().omega;
        let mut counts = vec![0u32; self.stroboscopic.len() + 1];
        // Section k lies at k T, or at (k - 1) T + shift; what happens at a section belongs to the
        // interval that ends there.
        let row = |period: i64, time_in_period: f64| {
            let k = period + i64::from(shift > 0.0) + i64::from(time_in_period > shift);
            usize::try_from(k - self.first_section).ok()
        };
        for event in &self.events {
            let Ok(index) = usize::try_from(event.index) else { continue };
            let impact = event.kind == EventKind::Impact as i64;
            let chatter = event.kind == EventKind::Chatter as i64;
            let time_in_period = if impact {
                self.impacts.get(index).map(Row::time_in_period)
            } else if chatter {
                self.contacts.get(index).map(Row::time_in_period)
            } else {
                None
            };
            let row = time_in_period.and_then(|time| row(event.period, time));
            if let Some(count) = row.and_then(|row| counts.get_mut(row)) {
                *count = if chatter { CHATTERING } else { count.saturating_add(1) };
            }
        }
        // A first interval that begins before the window: its count is not known.
        let cut = shift > 0.0 || self.window.time_in_period > 0.0;
        let known = usize::from(cut).min(self.stroboscopic.len());
        (&self.stroboscopic[known..], counts.split_off(known))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    use super::*;

    /// Orbits m and whether they return, as the definition says them: every m with all its
    /// sections.
    fn by_definition(sections: &[[f64; 4]], counts: &[u32]) -> Option<usize> {
        let whole = Bounds::of(sections.iter())?;
        let (size, extent) = (whole.size().max(f64::MIN_POSITIVE), whole.extent());
        let negligible = (RETURN_RTOL * extent).max(SECTION_NOISE * size);
        let equal_counts = |m: usize| counts.windows(m + 1).all(|w| w[0] == w[m]);
        (1..=sections.len() / 4).filter(|&m| equal_counts(m)).find_map(|m| {
            let small = residual(sections, m) <= negligible;
            let approach = approach(sections, m).filter(|a| a.remaining <= REMAINING_PART * size);
            let remaining = approach.map(|a| a.remaining);
            if !small && remaining.is_none() {
                return None;
            }
            let apart = if small { 4.0 * negligible } else { 2.0 * remaining? };
            let merged =
                |&d: &usize| m % d == 0 && equal_counts(d) && residual(sections, d) <= apart;
            Some((1..m).find(merged).unwrap_or(m))
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            cases: 2000,
            rng_seed: RngSeed::Fixed(2004),
            failure_persistence: None,
            ..ProptestConfig::default()
        })]

        /// Cycles that are exact, drawn near to, left, or disturbed in one place; tori; noise.
        #[test]
        fn what_is_ruled_out_early_is_what_the_definition_rules_out(
            cycle in prop::collection::vec((prop::array::uniform4(-1.0..1.0f64), 0u32..2), 1..9),
            kept in 4usize..160,
            rate in prop::sample::select(vec![0.0f64, 0.6, 0.9, 0.97, 0.99, 1.0, 1.01]),
            away in prop::array::uniform4(-0.3..0.3f64),
            turn in prop::sample::select(vec![0.0f64, 0.0, 0.7, 2.0943, 2.4]),
            offset in prop::sample::select(vec![0.0f64, 0.0, 30.0]),
            odd in prop::option::of((0usize..160, -2.0..2.0f64)),
            noise in prop::sample::select(vec![0.0f64, 0.0, 1e-10, 1.0]),
        ) {
            let mut sections = Vec::new();
            for k in 0..kept {
                let (point, _) = cycle[k % cycle.len()];
                let shrunk = rate.powi(k as i32);
                let (s, c) = (turn * k as f64).sin_cos();
                let rough = (k as f64 * 12.9898).sin() * 43_758.545;
                let moved = [c * away[0] - s * away[1], s * away[0] + c * away[1], away[2], away[3]];
                sections.push(std::array::from_fn(|i| {
                    offset + point[i] + shrunk * moved[i] + noise * (rough * (i + 1) as f64).fract()
                }));
            }
            if let Some((place, value)) = odd {
                sections[place % kept][1] = value;
            }
            let counts: Vec<u32> = (0..kept).map(|k| cycle[k % cycle.len()].1).collect();
            let found = detect_in(&sections, &counts, Tried::All, &CancelToken::never());
            prop_assert_eq!(found.orbit.map(|(m, _)| m), by_definition(&sections, &counts));
        }

        #[test]
        fn counts_match_where_they_repeat(counts in prop::collection::vec(0u32..2, 1..60)) {
            let matching = matching_counts(&counts);
            for m in 1..counts.len() {
                let repeats = counts.windows(m + 1).all(|w| w[0] == w[m]);
                prop_assert_eq!(matching[m] == counts.len() - m, repeats);
            }
        }
    }

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
        let report = detect_period(&circle(angle, 0.0, 60), &[2; 60], &CancelToken::never());
        assert_eq!(report.orbit, Some((5, ImpactCount::Finite(10))));
        assert_eq!(report.label(), "5-10");
    }

    #[test]
    fn unequal_impact_counts_rule_a_period_out() {
        let sections = vec![[1.0, 0.0, 0.0, 0.0]; 40];
        let counts: Vec<u32> = (0..40).map(|k| k % 2).collect();
        assert_eq!(
            detect_period(&sections, &counts, &CancelToken::never()).orbit,
            Some((2, ImpactCount::Finite(1)))
        );
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
        assert_eq!(
            detect_period(&spiral, &[1; 100], &CancelToken::never()).orbit,
            Some((1, ImpactCount::Finite(1)))
        );
    }

    #[test]
    fn slow_geometric_convergence_counts_and_a_torus_does_not() {
        let slow: Vec<[f64; 4]> =
            (0..100).map(|k| [1.0 + 0.1 * 0.95f64.powi(k), 0.0, 0.0, 0.0]).collect();
        let report = detect_period(&slow, &[1; 100], &CancelToken::never());
        assert_eq!(report.orbit, Some((1, ImpactCount::Finite(1))));
        assert!((report.evidence.rate().unwrap() - 0.95).abs() < 1e-3);
        let torus = detect_period(&circle(1.0, 0.0, 100), &[1; 100], &CancelToken::never());
        assert_eq!(torus.orbit, None);
    }
}
