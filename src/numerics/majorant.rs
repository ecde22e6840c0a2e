//! First root of a quartic that bounds a function from above: the step that cannot pass a root
//! (docs/contact-detection.md).

/// The search solves its quartic to this relative accuracy; the next evaluation of the gap
/// starts afresh from there. Values from 1e-3 to 1e-9 cost and err alike on average, and every
/// reference is met with each of them: the steps only need to be safe.
const QUARTIC_RTOL: f64 = 1e-4;

/// Steps of the solver of the quartic; it may stop anywhere, every iterate is a safe step.
const QUARTIC_STEPS: usize = 24;

/// A number at or just below (to rounding) the first positive root of
/// c0 + c1 h + c2 h^2 + c3 h^3 + c4 h^4 in (0, limit], or `limit` if there is none; c0 < 0 and
/// c4 >= 0.
///
/// Each step goes to the root of a parabola that bounds the polynomial from above on a window
/// ahead: its second derivative is convex, so largest at an end of the window. The window
/// follows the steps, so that close to the root the parabola is tight and steps are Newton's.
#[inline]
pub(crate) fn first_root(c: &[f64; 5], limit: f64) -> f64 {
    let curvature = |h: f64| 2.0 * c[2] + h * (6.0 * c[3] + h * 12.0 * c[4]);
    let mut h = 0.0;
    let mut window = limit;
    for _ in 0..QUARTIC_STEPS {
        let value = c[0] + h * (c[1] + h * (c[2] + h * (c[3] + h * c[4])));
        if value >= 0.0 {
            return h;
        }
        let rate = c[1] + h * (2.0 * c[2] + h * (3.0 * c[3] + h * 4.0 * c[4]));
        let bend = curvature(h).max(curvature(h + window));
        let discriminant = rate * rate - 2.0 * bend * value;
        let step = if discriminant < 0.0 || (bend <= 0.0 && rate <= 0.0) {
            window
        } else {
            // The smaller positive root; for rate < 0 in a form that does not cancel.
            let root = discriminant.sqrt();
            let step =
                if rate >= 0.0 { -2.0 * value / (rate + root) } else { (root - rate) / bend };
            step.min(window)
        };
        h += step;
        if h >= limit {
            return limit;
        }
        if step <= QUARTIC_RTOL * h {
            return h;
        }
        window = (4.0 * step).min(limit - h);
    }
    h
}

#[cfg(test)]
mod tests {
    use super::first_root;

    fn value(c: &[f64; 5], h: f64) -> f64 {
        c[0] + h * (c[1] + h * (c[2] + h * (c[3] + h * c[4])))
    }

    #[test]
    fn first_root_stays_below_and_comes_close() {
        // (h - 1)(h + 2)(h^2 + 1); (h - 0.1)(h + 1)(h^2 + 1); a narrow hump at 0.3 before a
        // larger root, -(h - 0.3)^2 - 1e-9 + h^4/1000.
        for c in [
            [-2.0, 1.0, -1.0, 1.0, 1.0],
            [-0.1, 0.9, 0.9, 0.9, 1.0],
            [-0.09 - 1e-9, 0.6, -1.0, 0.0, 1e-3],
        ] {
            let h = first_root(&c, 10.0);
            let scanned =
                (1..=1_000_000).map(|i| 1e-5 * f64::from(i)).find(|&h| value(&c, h) >= 0.0);
            let first = scanned.unwrap();
            assert!(h <= first && h >= first - 3e-5, "{h} {first}");
        }
    }

    #[test]
    fn without_a_root_the_limit_is_returned() {
        assert_eq!(first_root(&[-1.0, 0.0, 0.0, 0.0, 0.5], 1.0), 1.0);
        assert_eq!(first_root(&[-1.0, 1.0, -2.0, 0.0, 0.01], 1.0), 1.0);
    }
}
