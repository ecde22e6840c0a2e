//! Long flights, differentiated in parts.
//!
//! Where the drive's frequency is a variable each part is at most half of what is left: what is lost in the
//! first ones has died away at the end. Derivatives that need steps lose digits with their number: no part
//! has more than some. Parts are whole powers of two of drive periods, or equally long, so that flights to
//! instants near each other have most of them in common.

use std::ops::Range;

use crate::flight::Drive;
use crate::model::state::Clock;
use crate::numerics::double_double::DoubleDouble;
use crate::tangent::tolerances::{FEW_PERIODS, LONGEST_STEP, PART_STEPS};

/// Drive periods of the longest parts.
const MOST_PERIODS: f64 = (1u64 << 60) as f64;

/// Later than every instant.
const NEVER: Clock = Clock::new(i64::MAX, 0.0);

/// The longest time over which steps keep their digits, where something turns or decays as fast as that and
/// the undamped motion at this rate. Strong damping, with which it would turn by less than `least`, is not
/// followed in parts: there would be no end of them.
pub(crate) fn longest_part((fastest, undamped): (f64, f64), least: f64) -> f64 {
    let time = PART_STEPS * LONGEST_STEP / fastest;
    if time * undamped >= least { time } else { f64::INFINITY }
}

/// How a flight is divided.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Parts {
    halves: bool,
    /// The most drive periods of a part; none where parts have this length, shorter than a period.
    periods: i64,
    time: f64,
}

/// A part of a flight.
#[derive(Debug, Clone)]
pub(crate) struct Part {
    pub end: Clock,
    /// Instants on the way to which a flight from where it begins takes it.
    pub leads_to: Range<Clock>,
}

impl Parts {
    /// Not longer than this time; `halves`: nor than half of what is left, in whole drive periods.
    pub fn new(drive: &Drive, time: f64, halves: bool) -> Self {
        let whole =
            if drive.has_period() { (time / drive.period.hi).min(MOST_PERIODS) } else { 0.0 };
        #[allow(clippy::cast_possible_truncation)] // not too large
        let periods = (whole as i64).checked_ilog2().map_or(0, |power| 1 << power);
        Self { halves, periods, time }
    }

    /// What comes first on the way from one instant to another, if that is not all of it.
    pub fn first(&self, drive: &Drive, from: Clock, to: Clock) -> Option<Part> {
        if self.periods == 0 {
            if self.time.is_infinite() {
                return None;
            }
            let end = drive.advance(from, DoubleDouble::new(self.time));
            return (end < to).then_some(Part { end, leads_to: end..NEVER });
        }
        let left = to.period.saturating_sub(from.period);
        let longest = self.periods;
        // To which numbers of periods from here on this one leads.
        let (part, least, most) = if self.halves && left > FEW_PERIODS {
            let half = 1 << (left / 2).ilog2();
            if half < longest {
                (half, (2 * half).max(FEW_PERIODS + 1), 4 * half)
            } else {
                (longest, (2 * longest).max(FEW_PERIODS + 1), i64::MAX)
            }
        } else if left > longest {
            (longest, longest + 1, if self.halves { FEW_PERIODS + 1 } else { i64::MAX })
        } else {
            return None;
        };
        let after = |periods: i64| Clock::new(from.period.saturating_add(periods), 0.0);
        Some(Part { end: after(part), leads_to: after(least)..after(most) })
    }
}

#[cfg(test)]
mod tests {
    use super::{FEW_PERIODS, Parts};
    use crate::flight::Drive;
    use crate::model::state::Clock;

    /// Where the parts of a flight end.
    fn ends(drive: &Drive, parts: &Parts, mut here: Clock, end: Clock) -> Vec<Clock> {
        let mut all = Vec::new();
        while let Some(part) = parts.first(drive, here, end) {
            assert!(here < part.end && part.end < end && part.leads_to.contains(&end));
            here = part.end;
            all.push(here);
        }
        all
    }

    #[test]
    fn parts_are_at_most_half_of_what_is_left() {
        let drive = Drive::new(1.3, 0.0);
        let parts = Parts::new(&drive, f64::INFINITY, true);
        let end = Clock::new(1 << 40, 0.25);
        let all = ends(&drive, &parts, Clock::new(3, 0.5), end);
        assert!(end.period - all[all.len() - 1].period <= FEW_PERIODS);
        assert!(all.len() < 80, "{}", all.len());
    }

    #[test]
    fn parts_are_not_longer_than_some_time() {
        let (drive, still) = (Drive::new(1.3, 0.0), Drive::new(0.0, 0.0));
        for (halves, few) in [(false, 1_000_000 / 512), (true, 1_000_000 / 512 + 20)] {
            let parts = Parts::new(&drive, 600.0 * drive.period.hi, halves);
            let all = ends(&drive, &parts, Clock::new(3, 0.5), Clock::new(1_000_000, 0.25));
            assert!(all.windows(2).all(|ends| ends[1].period - ends[0].period <= 512));
            assert!(all.len() <= few, "{}", all.len());
        }
        let parts = Parts::new(&still, 600.0, false);
        assert_eq!(ends(&still, &parts, Clock::START, Clock::new(0, 6e5 + 1.0)).len(), 1_000);
        let short = 0.25 * drive.period.hi;
        let parts = Parts::new(&drive, short, true);
        let all = ends(&drive, &parts, Clock::START, Clock::new(100, 0.1 * short));
        assert!(all.windows(2).all(|ends| drive.until(ends[0], ends[1]).value() <= short));
        assert_eq!(all.len(), 400);
    }

    #[test]
    fn a_part_is_the_first_to_all_instants_to_which_it_leads() {
        let drive = Drive::new(1.3, 0.0);
        let all = [(f64::INFINITY, true), (4.0, true), (70.0, true), (40.0, false), (0.3, true)];
        for (longest, halves) in all {
            let parts = Parts::new(&drive, longest * drive.period.hi, halves);
            let from = Clock::new(5, 1.0);
            for period in 5..600 {
                let to = Clock::new(period, 0.5);
                let Some(part) = parts.first(&drive, from, to) else { continue };
                for other in 5..600 {
                    let to = Clock::new(other, 0.5);
                    let same =
                        parts.first(&drive, from, to).is_some_and(|other| other.end == part.end);
                    assert!(same || !part.leads_to.contains(&to), "{longest} {period} {other}");
                }
            }
        }
    }
}
