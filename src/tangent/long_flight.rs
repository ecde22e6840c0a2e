//! Flights over many drive periods, differentiated by the drive's frequency in parts.

use crate::model::state::Clock;
use crate::tangent::tolerances::FEW_PERIODS;

/// Where the next part of a flight ends, if it does not end with it: each is half of what is left, for what
/// is lost in the first ones has died away at the end.
pub(crate) fn next_part(from: Clock, to: Clock) -> Option<Clock> {
    let periods = to.period.saturating_sub(from.period);
    (periods > FEW_PERIODS).then(|| Clock::new(to.period - periods / 2, 0.0))
}

#[cfg(test)]
mod tests {
    use super::next_part;
    use crate::model::state::Clock;

    #[test]
    fn parts_halve_what_is_left() {
        let (mut here, end, mut parts) = (Clock::new(3, 0.5), Clock::new(1 << 40, 0.25), 1);
        while let Some(next) = next_part(here, end) {
            assert!(here < next && next < end);
            (here, parts) = (next, parts + 1);
        }
        assert!(end.period - here.period <= 16);
        assert!(parts < 40, "{parts}");
    }
}
