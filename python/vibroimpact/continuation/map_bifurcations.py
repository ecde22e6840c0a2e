"""Test functions for the smooth bifurcations of a periodic motion, from its monodromy matrix M.

With the multipliers l_i of M (Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, chapter 4;
W. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria, SIAM 2000, section 4.4):

    saddle_node        det(I - M)          one multiplier is 1
    period_doubling    det(M + I)          one is -1
    neimark_sacker     det(I - M (.) M) = product of 1 - l_i l_j over i < j

M (.) M is the bialternate product (second compound matrix), of the 2 x 2 minors of M; its
eigenvalues are l_i l_j, i < j. Each determinant det(I - B) is divided by det(I + B^T B)^(1/2), the
product of (1 + s^2)^(1/2) over the singular values s of B: smooth and never zero, so that the test
is bounded however large the multipliers are, and linear near its zeros. A multiplier may be 0
(sticking). All are positive where every multiplier lies inside the unit circle.
"""

import math
from functools import cache
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .newton import Array


def saddle_node(monodromy: Array) -> float:
    """Return det(I - M), scaled; M of shape (n, n)."""
    return _determinant(np.eye(len(monodromy)) - monodromy, monodromy)


def period_doubling(monodromy: Array) -> float:
    """Return det(M + I), scaled; M of shape (n, n)."""
    return _determinant(np.eye(len(monodromy)) + monodromy, monodromy)


def neimark_sacker(monodromy: Array) -> float:
    """Return det(I - M (.) M), scaled; M of shape (n, n), n >= 2.

    It also vanishes at a neutral saddle, which is no bifurcation: ``neimark_sacker_kind``
    distinguishes them.
    """
    # From the multipliers, since minors of a matrix with large entries lose digits. The product is
    # real, complex factors coming in pairs; the singular values of M (.) M are s_i s_j.
    values = np.linalg.eigvals(monodromy)
    factors = np.array([1.0 - a * b for a, b in combinations(values, 2)])
    if not factors.all():
        return 0.0
    sign = np.prod(np.sign(factors.real[factors.imag == 0.0]))
    sizes = np.linalg.svd(monodromy, compute_uv=False)
    scale = sum(float(np.log(np.hypot(1.0, a * b))) for a, b in combinations(sizes, 2))
    return float(sign) * math.exp(float(np.log(np.abs(factors)).sum()) - scale)


def bialternate(monodromy: Array) -> Array:
    """Return M (.) M of shape (n(n - 1)/2, n(n - 1)/2), whose eigenvalues are l_i l_j, i < j.

    Also of several matrices, of shape (k, n, n).

    Its entries are differences of products: they are good to rounding times max |M_ij|^2.
    """
    m = np.asarray(monodromy, dtype=np.float64)
    i, j = _pairs(m.shape[-1])
    product: Array = m[..., i, i.T] * m[..., j, j.T] - m[..., i, j.T] * m[..., j, i.T]
    return product


@cache
def _pairs(n: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return i and j of all pairs i < j below n, as columns."""
    first, second = np.triu_indices(n, 1)
    return first[:, None], second[:, None]


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


def _determinant(matrix: Array, monodromy: Array) -> float:
    """Return det(matrix) over the product of (1 + s^2)^(1/2), without overflow."""
    sign, logarithm = np.linalg.slogdet(matrix)
    sizes = np.linalg.svd(monodromy, compute_uv=False)
    return float(sign) * math.exp(float(logarithm) - float(np.log(np.hypot(1.0, sizes)).sum()))
