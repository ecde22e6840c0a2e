"""How chi2 rises two standard errors from a minimum: whether the linear estimate of errors holds.

With one unknown held there and the others fitted anew, chi2 of a linear model rises by 4 (the
profile of the likelihood). Source: D. M. Bates, D. G. Watts, *Nonlinear Regression Analysis*, 1988,
ch. 6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .minimum import Found, Minimiser
from .problem import Point
from .result import Fit
from .search import Search

Array = NDArray[np.float64]

# Standard errors from the minimum, and what chi2 rises by there in a linear model.
_ERRORS, LINEAR = 2.0, 4.0
# The linear estimate of an error holds if the rise is that one to this factor.
_BENT = 2.0
# Another minimum is lower by this cost, half of chi2, at least.
LOWER = 0.05
# A rise on the straight way that is so near to the linear one needs no fit of the others.
_ALIKE = 0.25
# Where it rises less, one goes on to this many times as far, until it does.
_FARTHEST = 64.0
# Steps of each fit of the others.
_MOST_STEPS = 12


@dataclass
class Rises:
    """What is found on the way from a minimum.

    Attributes
    ----------
    profile
        The rises of chi2 below and above each unknown, (k, 2); infinite where there is no machine
        or no such motion.
    wider
        By how many times the errors are larger than the linear ones where chi2 rises too little,
        (k,).
    beyond
        Where the cost is lower, or the linear estimate does not hold: another minimum may be near.
    """

    profile: Array
    wider: Array
    beyond: list[Found]


def rises(search: Search, found: Found, fit: Fit) -> Rises:
    """Return how chi2 rises below and above each unknown, the others fitted anew."""
    result = np.zeros((len(fit.names), 2))
    wider = np.ones(len(fit.names))
    beyond: list[Found] = []
    for k, error in enumerate(fit.standard_errors.tolist()):
        # Along it the others are at their minimum in a linear model.
        way = _ERRORS * fit.covariance[:, k] / error if error > 0.0 else np.zeros(len(fit.names))
        for side, sign in enumerate((-1.0, 1.0)):
            far, before, rise = 1.0, 0.0, 0.0
            there: Found | None = None
            while far <= _FARTHEST:
                rise, there = _rise(search, found, sign * far * way, k)
                if far == 1.0:
                    result[k, side] = rise
                lower = there is not None and there.cost < found.cost - LOWER
                if (
                    lower
                    or not np.isfinite(error)
                    or rise >= (LINEAR / _BENT if far == 1.0 else LINEAR)
                ):
                    break
                far, before = 2.0 * far, rise
            if there is not None and (lower or not is_linear(result[k, side])):
                beyond.append(there)
            if far > 1.0:
                part = (LINEAR - before) / (rise - before) if LINEAR < rise < np.inf else 1.0
                wider[k] = max(wider[k], min(0.5 * far * (1.0 + part), _FARTHEST))
    return Rises(result, wider, beyond)


def is_linear(rise: float) -> bool:
    """Whether chi2 rises as in a linear model."""
    return LINEAR / _BENT <= rise <= LINEAR * _BENT


def bent(names: Sequence[str], profile: Array) -> list[str]:
    """Return what is to be said where the linear estimate of errors does not hold."""
    said = []
    for name, (below, above) in zip(names, profile.tolist(), strict=True):
        rises = [rise for rise in (below, above) if np.isfinite(rise)]
        if not all(map(is_linear, rises)):
            told = (
                f"the error of {name} is no linear one: 2 standard errors below and above chi2 "
                f"rises by {below:.2g} and {above:.2g}, not 4"
            )
            wide = min(rises) < LINEAR / _BENT
            said.append(f"{told}; it is taken from where it does" if wide else told)
    return said


def _rise(search: Search, found: Found, way: Array, place: int) -> tuple[float, Found | None]:
    """Return the rise of chi2 where one unknown is held at the end of a way from the minimum."""
    unknowns = search.problem.unknowns
    value = found.point.values[place] + way[place]
    if not unknowns.low[place] <= value <= unknowns.high[place]:
        return np.inf, None
    values = np.clip(found.point.values + way, unknowns.low, unknowns.high)
    nodes = found.point.nodes + _moved(search, found, values - found.point.values)
    start = Point(values, nodes)
    there = search.problem.evaluate(start, found.window)
    if there is not None and not len(nodes):
        straight = 2.0 * (search.cost(there) - found.cost)
        if abs(straight / LINEAR - 1.0) < _ALIKE:
            return straight, None
    low, high = unknowns.low.copy(), unknowns.high.copy()
    low[place] = high[place] = value
    held = replace(search.problem, unknowns=replace(unknowns, low=low, high=high))
    other = Minimiser(held, search.sigmas, search.loss)
    other.sizes = search.sizes
    best = other.minimise(start, found.window, _MOST_STEPS, found.whole)
    if best is None:
        return np.inf, None
    return 2.0 * (best.cost - found.cost), best


def _moved(search: Search, found: Found, change: Array) -> Array:
    """Return how the starts of segments move with the unknowns, so that the motion stays whole."""
    nodes = found.point.nodes
    if not len(nodes):
        return nodes
    ones = np.ones(len(change) + nodes.size)
    linear = search.linear(found.evaluation, found.window, ones)
    if linear is None:
        return np.zeros_like(nodes)
    known, own = np.split(linear.constraint, [len(change)], axis=1)
    moved = np.linalg.solve(own, -known @ change)
    return np.asarray(moved, dtype=np.float64).reshape(nodes.shape)
