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

#[cfg(test)]
mod tests {
    use super::{at_level_zero, at_zero};

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
}
