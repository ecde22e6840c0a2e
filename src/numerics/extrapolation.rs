//! Extrapolation by polynomials.

use smallvec::SmallVec;

use crate::numerics::dual::Number;

/// Nodes for which no memory is asked for.
const FEW: usize = 10;

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

/// As [`at_zero`] where the values have no slope at u = 0: the polynomials with p'(0) = 0, one degree
/// higher. With P and Q through the points (u_i, y_i/u_i) and (u_i, 1/u_i) they are P(0)/Q(0), and Q(0) =
/// sum of 1/u_i.
pub(crate) fn at_level_zero<T: Number, const N: usize>(
    nodes: &[T],
    mut values: impl AsMut<[[T; N]]>,
) -> [T; N] {
    let one = T::constant(1.0);
    let nearest = values.as_mut()[0];
    let mut per_node = T::constant(0.0);
    for (&node, values) in nodes.iter().zip(values.as_mut()) {
        let each = one / node;
        per_node = per_node + each;
        *values = std::array::from_fn(|c| (values[c] - nearest[c]) * each);
    }
    let above = at_zero(nodes, values);
    std::array::from_fn(|c| nearest[c] + above[c] / per_node)
}

/// Values at some nodes, each so many times, are the value at 0 of the polynomial through them:
/// w_k = product over m of u_m/(u_m - u_k).
pub(crate) struct Weights(SmallVec<[f64; FEW]>);

impl Weights {
    pub fn at_zero(nodes: &[f64]) -> Self {
        let others = |k: usize| (0..nodes.len()).filter(move |&m| m != k);
        let weight = |k| others(k).map(|m: usize| nodes[m] / (nodes[m] - nodes[k])).product();
        Self((0..nodes.len()).map(weight).collect())
    }

    /// What they change by with the nodes.
    pub fn change(&self, nodes: &[f64], changes: &[f64]) -> SmallVec<[f64; FEW]> {
        let one = |k: usize| {
            let others = (0..self.0.len()).filter(|&m| m != k);
            let parts = others.map(|m| {
                let (apart, moved) = (nodes[m] - nodes[k], changes[m] - changes[k]);
                changes[m] / nodes[m] - moved / apart
            });
            self.0[k] * parts.sum::<f64>()
        };
        (0..self.0.len()).map(one).collect()
    }

    /// The value at 0, and its slope.
    pub fn sum(&self, change: &[f64], values: &[f64], slopes: &[f64]) -> (f64, f64) {
        let (mut value, mut slope) = (0.0, 0.0);
        for (k, weight) in self.0.iter().enumerate() {
            value += weight * values[k];
            slope += weight * slopes[k] + change[k] * values[k];
        }
        (value, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::{Weights, at_level_zero, at_zero};

    #[test]
    fn a_cubic_through_four_points_is_extrapolated_exactly() {
        let nodes = [0.5, 1.0, 2.0, 4.0];
        let values = nodes.map(|u: f64| [3.0 - u * (1.0 - u * (2.0 + u)), u]);
        assert_eq!(at_zero(&nodes, values), [3.0, 0.0]);
    }

    #[test]
    fn so_is_a_level_one_through_three() {
        let nodes = [0.5, 1.0, 2.0];
        let values = nodes.map(|u: f64| [3.0 + u * u * (2.0 - u), u * u]);
        assert_eq!(at_level_zero(&nodes, values), [3.0, 0.0]);
        assert_eq!(at_level_zero(&nodes[..1], values), values[0]);
    }

    #[test]
    fn its_derivative_is_that_of_the_cubic_at_moving_nodes() {
        // y = 3 - a u + u^2 + u^3 by a, at nodes that move with it.
        let nodes = [0.5, 1.0, 2.0, 4.0];
        let moves = [1.0, -0.5, 0.25, 2.0];
        let values = nodes.map(|u: f64| 3.0 - u * (1.0 - u * (1.0 + u)));
        let slopes: [f64; 4] = std::array::from_fn(|k| {
            let u = nodes[k];
            1.0 - u + (-1.0 + u * (2.0 + 3.0 * u)) * moves[k]
        });
        let weights = Weights::at_zero(&nodes);
        let (value, slope) = weights.sum(&weights.change(&nodes, &moves), &values, &slopes);
        assert!((value - 3.0).abs() < 1e-14 && (slope - 1.0).abs() < 1e-12, "{value} {slope}");
    }
}
