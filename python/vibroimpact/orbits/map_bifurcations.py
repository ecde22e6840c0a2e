"""Test functions for the smooth bifurcations of a periodic motion, from its monodromy matrix M.

With the multipliers l_i of M (Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, chapter 4;
W. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria, SIAM 2000, section 4.4):

    saddle_node        det(I - M)          one multiplier is 1
    period_doubling    det(M + I)          one is -1
    neimark_sacker     det(I - M (.) M)    l_i l_j = 1 for some i < j

M (.) M is the bialternate product (second compound matrix), of the 2 x 2 minors of M; its
eigenvalues are l_i l_j, i < j. Each determinant det(B - I), say, is divided by the square root of
det(I + B^T B): smooth, without zero, so that the test is bounded however large the multipliers are,
and linear near its zeros. A multiplier 0 (sticking) is a number like others. All are positive
where every multiplier lies inside the unit circle.
"""

import math
from itertools import combinations
from typing import Literal

import numpy as np

from .newton import Array


def saddle_node(monodromy: Array) -> float:
    """Return det(I - M), scaled; M of shape (n, n)."""
    return _scaled_determinant(np.eye(len(monodromy)) - monodromy, monodromy)


def period_doubling(monodromy: Array) -> float:
    """Return det(M + I), scaled; M of shape (n, n)."""
    return _scaled_determinant(monodromy + np.eye(len(monodromy)), monodromy)


def neimark_sacker(monodromy: Array) -> float:
    """Return det(I - M (.) M), scaled; M of shape (n, n), n >= 2.

    It also vanishes at a neutral saddle, which is no bifurcation: ask ``neimark_sacker_kind``.
    """
    products = bialternate(monodromy)
    return _scaled_determinant(np.eye(len(products)) - products, products)


def bialternate(monodromy: Array) -> Array:
    """Return M (.) M of shape (n(n-1)/2, n(n-1)/2), whose eigenvalues are l_i l_j, i < j."""
    first, second = np.array(list(combinations(range(len(monodromy)), 2))).reshape(-1, 2).T
    m = np.asarray(monodromy, dtype=np.float64)
    product: Array = (
        m[np.ix_(first, first)] * m[np.ix_(second, second)]
        - m[np.ix_(first, second)] * m[np.ix_(second, first)]
    )
    return product


def neimark_sacker_cosine(monodromy: Array) -> float:
    """Return (l_i + l_j)/2 of the real or conjugate pair whose product is nearest to 1.

    On a Neimark-Sacker point it is cos(theta), the pair being exp(+-i theta): 1, 0, -1/2 and -1 are
    the strong resonances 1:1, 1:4, 1:3 and 1:2. Above 1 in size it belongs to a neutral saddle.
    NaN if there is no pair.
    """
    values = np.linalg.eigvals(monodromy)
    # eigvals of a real matrix gives conjugate pairs exactly.
    pairs = [
        (a, b)
        for a, b in combinations(values, 2)
        if a == np.conj(b) or (a.imag == 0.0 and b.imag == 0.0)
    ]
    if not pairs:
        return math.nan
    a, b = min(pairs, key=lambda pair: abs(pair[0] * pair[1] - 1.0))
    return float((a + b).real) / 2.0


def neimark_sacker_kind(monodromy: Array) -> Literal["neimark_sacker", "neutral_saddle"]:
    """Return what a zero of ``neimark_sacker`` is: a complex pair on the unit circle, or not."""
    complex_pair = abs(neimark_sacker_cosine(monodromy)) < 1.0
    return "neimark_sacker" if complex_pair else "neutral_saddle"


def _scaled_determinant(matrix: Array, size: Array) -> float:
    """Return det(matrix)/sqrt(det(I + size^T size)), without overflow."""
    sign, logarithm = np.linalg.slogdet(matrix)
    _, scale = np.linalg.slogdet(np.eye(len(size)) + size.T @ size)
    return float(sign) * math.exp(float(logarithm) - float(scale) / 2.0)
