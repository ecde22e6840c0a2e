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

#[cfg(test)]
mod tests {
    use super::at_zero;

    #[test]
    fn a_cubic_through_four_points_is_extrapolated_exactly() {
        let nodes = [0.5, 1.0, 2.0, 4.0];
        let values = nodes.map(|u: f64| [3.0 - u * (1.0 - u * (2.0 + u)), u]);
        assert_eq!(at_zero(&nodes, values), [3.0, 0.0]);
    }
}
