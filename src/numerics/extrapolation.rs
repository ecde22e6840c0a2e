//! Extrapolation by polynomials.

use crate::numerics::dual::Number;

/// The polynomials through the points (u_i, y_i), nearest to 0 first, at u = 0 (Neville's scheme).
/// `values` has at least as many entries as `nodes`.
pub(crate) fn at_zero<T: Number, const N: usize>(
    nodes: &[T],
    mut values: impl AsMut<[[T; N]]>,
) -> [T; N] {
    let table = values.as_mut();
    for level in 1..nodes.len() {
        for i in 0..nodes.len() - level {
            let (near, far) = (nodes[i], nodes[i + level]);
            let (nearer, farther) = (table[i], table[i + 1]);
            // y + (y - y_far) u_near/(u_far - u_near).
            let weight = near / (far - near);
            table[i] = std::array::from_fn(|c| nearer[c] + (nearer[c] - farther[c]) * weight);
        }
    }
    table[0]
}

/// What each of several values counts at u = 0 where they have no slope there: with the polynomial p, p'(0) =
/// 0, through the points (u_i, y_i), nearest first, p(0) = y_0 + sum of w_i (y_i - y_0). With P and Q through
/// the points (u_i, y_i/u_i) and (u_i, 1/u_i) it is P(0)/Q(0), and Q(0) = sum of 1/u_i.
pub(crate) fn level_weights<T: Number, const N: usize>(nodes: &[T]) -> [T; N] {
    let one = T::constant(1.0);
    let mut weights = [T::constant(0.0); N];
    let sum = nodes.iter().fold(weights[0], |sum, &node| sum + one / node);
    let above = nodes.iter().fold(one, |above, &node| above * node) / sum;
    for (i, (weight, &node)) in weights.iter_mut().zip(nodes).enumerate() {
        let apart =
            |below, (j, &other): (usize, &T)| if j == i { below } else { below * (other - node) };
        *weight = above / nodes.iter().enumerate().fold(node * node, apart);
    }
    weights
}

/// The same without the farthest of the nodes: each is multiplied with u_far - u_i, and their sum is 1.
pub(crate) fn without_farthest<T: Number, const N: usize>(
    nodes: &[T],
    mut weights: [T; N],
) -> [T; N] {
    let Some((&farthest, nearer)) = nodes.split_last() else { return weights };
    let mut sum = T::constant(0.0);
    for (weight, &node) in weights.iter_mut().zip(nearer) {
        *weight = *weight * (farthest - node);
        sum = sum + *weight;
    }
    let per_sum = T::constant(1.0) / sum;
    weights.iter_mut().take(nearer.len()).for_each(|weight| *weight = *weight * per_sum);
    weights
}

#[cfg(test)]
mod tests {
    use super::{at_zero, level_weights, without_farthest};

    #[test]
    fn a_cubic_through_four_points_is_extrapolated_exactly() {
        let nodes = [0.5, 1.0, 2.0, 4.0];
        let values = nodes.map(|u: f64| [3.0 - u * (1.0 - u * (2.0 + u)), u]);
        assert_eq!(at_zero(&nodes, values), [3.0, 0.0]);
    }

    #[test]
    fn so_is_a_level_one_through_three() {
        let nodes = [0.5, 1.0, 2.0];
        let values = nodes.map(|u: f64| 3.0 + u * u * (2.0 - u));
        let weights: [f64; 3] = level_weights(&nodes);
        let above: f64 = (1..3).map(|i| weights[i] * (values[i] - values[0])).sum();
        assert!((values[0] + above - 3.0).abs() < 1e-15, "{above}");
        assert_eq!(level_weights::<f64, 1>(&nodes[..1]), [1.0]);
        let [a, b, _] = without_farthest(&nodes, weights);
        let [nearer, farther] = level_weights(&nodes[..2]);
        assert!((a - nearer).abs() < 1e-15 && (b - farther).abs() < 1e-15, "{a} {b}");
    }
}
