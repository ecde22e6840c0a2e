"""Integrals over time of what varies smoothly between events, with derivatives."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from .duals import Dual, constant

Array = NDArray[np.float64]

# Nodes of Lobatto's rule in each panel, and how many are computed at once.
_NODES, _AT_ONCE = 11, 20_000
# The last coefficients of a panel in Legendre polynomials, relative to what is integrated: they
# fall by the same factor again up to those that the rule does not see.
_TAIL = 1e-7
# Panels are halved so often at most, as where the rate itself has a kink.
_HALVINGS = 24


def integral(rate: Callable[[Array], Dual], edges: Array, longest: float, count: int) -> Dual:
    """Return the integral over all edges of a rate that is smooth between them.

    By Lobatto's rule in panels no longer than this, which are halved until it sees all that the
    rate and its ``count`` derivatives do in each. The ends of a panel are nodes, or a kink near one
    would lie between the nodes of both panels beside it, and neither see it.
    """
    nodes, weights, last = _lobatto()
    begins, widths, within = _panels(edges, longest)
    total, sizes = constant(0.0, count), np.zeros(1 + count)
    for halvings in range(_HALVINGS + 1):
        coarse = np.zeros(len(begins), dtype=bool)
        for first in range(0, len(begins), _AT_ONCE // _NODES):
            here = slice(first, first + _AT_ONCE // _NODES)
            half = 0.5 * widths[here, None]
            times = begins[here, None] + half * (1.0 + nodes)
            times = np.clip(times, within[here, :1], within[here, 1:])
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
        within = np.repeat(within[coarse], 2, axis=0)
        widths = np.repeat(0.5 * widths[coarse], 2)
        begins = np.repeat(begins[coarse], 2)
        begins[1::2] += widths[1::2]
    return total


def _lobatto() -> tuple[Array, Array, Array]:
    """Return nodes, weights, and what gives the last two coefficients in Legendre polynomials.

    Source: F. B. Hildebrand, *Introduction to Numerical Analysis*, 2nd ed., 1974, section 8.12.
    """
    degree = _NODES - 1
    highest = np.zeros(_NODES)
    highest[degree] = 1.0
    nodes = np.concatenate([[-1.0], legendre.legroots(legendre.legder(highest)), [1.0]])
    polynomials = legendre.legvander(nodes, degree)
    weights = 2.0 / (degree * _NODES * polynomials[:, degree] ** 2)
    # The rule takes the square of the highest polynomial for larger than it is.
    sizes = np.array([degree - 0.5, 0.5 * degree])
    return nodes, weights, (polynomials[:, degree - 1 :] * weights[:, None] * sizes).T


def _panels(edges: Array, longest: float) -> tuple[Array, Array, Array]:
    """Return where panels between edges begin, how long they are, and within which times.

    At an edge an event may be, with another state before than after: the times are between edges.
    """
    lengths = np.diff(edges)
    counts = np.maximum(np.ceil(lengths / longest), 1.0).astype(np.int64)
    widths = np.repeat(lengths / counts, counts)
    place = np.arange(len(widths)) - np.repeat(np.cumsum(counts) - counts, counts)
    ends = np.nextafter(edges[:-1], np.inf), np.nextafter(edges[1:], -np.inf)
    within = np.column_stack([np.minimum(*ends), np.maximum(*ends)])
    begins = np.repeat(edges[:-1], counts) + place * widths
    return begins, widths, np.repeat(within, counts, axis=0)
