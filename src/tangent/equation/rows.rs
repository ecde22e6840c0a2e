//! Sums over rows of numbers, by which displacement and rate grow.

#![allow(clippy::inline_always)] // what calls them is compiled for several instruction sets

use super::Pair;

/// A series without its term of order 0, by Horner's rule. With fused operations: for what is compiled where
/// these are instructions.
#[inline(always)]
pub(super) fn sum<const N: usize>(terms: &[[f64; N]], time: f64) -> [f64; N] {
    let mut sum = [0.0f64; N];
    for term in terms.iter().rev() {
        for i in 0..N {
            sum[i] = sum[i].mul_add(time, term[i]);
        }
    }
    sum.map(|x| x * time)
}

/// Two rows over some numbers.
#[inline(always)]
pub(super) fn over(rows: &[f64], numbers: &[f64]) -> Pair {
    let mut sum = [0.0; 2];
    for (pair, x) in rows.chunks_exact(2).zip(numbers) {
        (sum[0], sum[1]) = (sum[0] + pair[0] * x, sum[1] + pair[1] * x);
    }
    sum
}

/// A column that grows so, and to which this is added.
#[inline(always)]
pub(super) fn grow(column: &mut Pair, growth: &[f64], [x, v]: Pair) {
    let own = over(&growth[..4], &column[..]);
    (column[0], column[1]) = (column[0] + (own[0] + x), column[1] + (own[1] + v));
}
