"""Integrals over time of what varies smoothly between events, with derivatives."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .duals import Dual, constant

Array = NDArray[np.float64]

# Nodes of Gauss and Legendre in each panel, and how many are computed at once.
_NODES, _AT_ONCE = 10, 20_000
# The last coefficients of a panel in Legendre polynomials, relative to what is integrated: they
# fall by the same factor again up to those that the rule does not see.
_TAIL = 1e-7
# Panels are halved so often at most, as where the rate itself has a kink.
_HALVINGS = 24


def integral(rate: Callable[[Array], Dual], edges: Array, longest: float, count: int) -> Dual:
    """Return the integral over all edges of a rate that is smooth between them.

    By Gauss and Legendre's rule in panels no longer than this, which are halved until it sees all
    that the rate and its ``count`` derivatives do in each.
    """
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    orders = np.arange(_NODES - 2, _NODES)
    polynomials = np.polynomial.legendre.legvander(nodes, _NODES - 1)[:, orders]
    last = (polynomials * (weights[:, None] * (orders + 0.5))).T
    begins, widths = _panels(edges, longest)
    total, sizes = constant(0.0, count), np.zeros(1 + count)
    for halvings in range(_HALVINGS + 1):
        coarse = np.zeros(len(begins), dtype=bool)
        for first in range(0, len(begins), _AT_ONCE // _NODES):
            here = slice(first, first + _AT_ONCE // _NODES)
            half = 0.5 * widths[here, None]
            times = np.clip(begins[here, None] + half * (1.0 + nodes), edges[0], edges[-1])
            found = rate(times.ravel())
            numbers = np.column_stack([found.value, found.slope]).reshape(*times.shape, 1 + count)
            sizes = np.maximum(sizes, np.abs(numbers).max(axis=(0, 1), initial=0.0))
            tails = np.abs(last @ numbers).max(axis=1)
            coarse[here] = (tails > _TAIL * sizes).any(axis=1) & (halvings < _HALVINGS)
            fine = ~coarse[here]
            sums = np.einsum("pnk,n,p->k", numbers[fine], weights, half[fine, 0])
            total = total + Dual(sums[0], sums[1:])
        if not coarse.any():
            break
        widths = np.repeat(0.5 * widths[coarse], 2)
        begins = np.repeat(begins[coarse], 2)
        begins[1::2] += widths[1::2]
    return total


def _panels(edges: Array, longest: float) -> tuple[Array, Array]:
    """Return where panels between edges begin, and how long they are."""
    lengths = np.diff(edges)
    counts = np.maximum(np.ceil(lengths / longest), 1.0).astype(np.int64)
    widths = np.repeat(lengths / counts, counts)
    place = np.arange(len(widths)) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.repeat(edges[:-1], counts) + place * widths, widths
