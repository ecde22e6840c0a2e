"""Test functions of the bifurcations of a map, from its derivative at a fixed point."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def multiplier_tests(matrix: Array) -> dict[str, float]:
    """Return the test functions of period doubling and Neimark-Sacker bifurcations.

    det(M + I), and the product of (l_i l_j - 1) over all pairs of eigenvalues.
    """
    tests = {"period_doubling": float(np.linalg.det(matrix + np.eye(len(matrix))))}
    eigenvalues = np.linalg.eigvals(matrix)
    product = 1.0 + 0.0j
    for i in range(len(eigenvalues)):
        for j in range(i):
            product *= eigenvalues[i] * eigenvalues[j] - 1.0
    return tests | {"neimark_sacker": float(product.real)}
