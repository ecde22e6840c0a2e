//! Maps that are applied again and again.

/// So many applications of a map are done before the caller is asked again whether to go on.
const UNASKED: u64 = 1 << 12;

/// What a map leads to that is applied so many times, in place; nothing if `goes_on` ends it. It is applied
/// one by one until something comes again to the last bit: where a contraction has come to its end, what is
/// left is known. (Powers of the map would be quicker still, but of a map that is far from normal they lose
/// the digits that single steps keep.)
pub(crate) fn applied<X: Clone + PartialEq>(
    mut here: X,
    times: u64,
    mut apply: impl FnMut(&mut X),
    goes_on: impl Fn() -> bool,
) -> Option<X> {
    // R. P. Brent (1980): each power of two, what has been reached is compared with all that follows.
    let (mut seen, mut since, mut until) = (here.clone(), 0, 1);
    let mut left = times;
    while left > 0 {
        if left.is_multiple_of(UNASKED) && !goes_on() {
            return None;
        }
        apply(&mut here);
        (left, since) = (left - 1, since + 1);
        if here == seen {
            left %= since;
        } else if is_lost(&here) {
            break;
        } else if since == until {
            seen.clone_from(&here);
            (since, until) = (0, 2 * until);
        }
    }
    Some(here)
}

/// Whether something is not a number, which all that it leads to is then not either.
#[allow(clippy::eq_op)]
fn is_lost<X: PartialEq>(here: &X) -> bool {
    here != here
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::applied;

    #[test]
    fn a_map_is_applied_so_many_times() {
        // Three steps lead to a cycle of five.
        let apply = |x: &mut u64| *x = if *x == 7 { 3 } else { *x + 1 };
        let mut each = 0;
        for times in 0..50 {
            assert_eq!(applied(0, times, apply, || true), Some(each));
            apply(&mut each);
        }
    }

    #[test]
    fn what_comes_again_is_not_worked_out_again() {
        let count = Cell::new(0);
        let apply = |x: &mut f64| {
            count.set(count.get() + 1);
            *x = 0.9 * *x + 1.0;
        };
        let end = applied(0.0, u64::MAX, apply, || true).unwrap();
        assert!((end - 10.0).abs() < 1e-13);
        assert!(count.get() < 2000, "{}", count.get());
    }

    #[test]
    fn what_is_no_number_stays_so() {
        let end = applied(1.0, u64::MAX, |x: &mut f64| *x = 2.0 * *x - *x, || true).unwrap();
        assert_eq!(end, 1.0);
        let end = applied(2.0, u64::MAX, |x: &mut f64| *x = *x * *x - *x, || true).unwrap();
        assert_eq!(end, 2.0);
        let end = applied(3.0, u64::MAX, |x: &mut f64| *x = *x * *x - *x, || true).unwrap();
        assert!(end.is_nan());
    }

    #[test]
    fn the_caller_ends_what_goes_on() {
        let asked = Cell::new(0);
        let goes_on = || asked.replace(asked.get() + 1) < 3;
        assert_eq!(applied(0_u64, u64::MAX, |x| *x += 1, goes_on), None);
    }
}
