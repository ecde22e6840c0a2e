//! Reciprocals of whole numbers, for the terms of power series.

/// 1/n at n, and 0 at 0.
pub(crate) const fn reciprocals<const N: usize>() -> [f64; N] {
    let mut all = [0.0; N];
    let mut n = 1;
    while n < N {
        all[n] = 1.0 / n as f64;
        n += 1;
    }
    all
}
