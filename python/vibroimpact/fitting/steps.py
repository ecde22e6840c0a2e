"""One step of the search: damped Gauss-Newton with equality constraints and bounds.

    minimise |r + J d|^2 + damping |D d|^2   subject to   C d = -c,   low <= d <= high

The constraints are the continuity of multiple shooting. They are eliminated by an orthogonal basis
of their null space, so that growth along a chaotic motion does not spoil the condition. Source:
J. Nocedal, S. J. Wright, *Numerical Optimization*, 2nd ed., 2006, sections 10.3 and 16.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Rounds in which variables that would leave their bounds are held there.
_MOST_ROUNDS = 12
# A solution so much larger than what it solves comes from equations that are singular to rounding.
_SINGULAR = 1e12
# Rows of a triangle that are solved together.
_BLOCK = 32


@dataclass(frozen=True)
class Linear:
    """The equations of one step: weighted residuals and defects with their derivatives.

    Attributes
    ----------
    residuals, derivative
        r of shape (n,) and J of shape (n, k).
    defects, constraint
        c of shape (m,) and C of shape (m, k), of full rank.
    """

    residuals: Array
    derivative: Array
    defects: Array
    constraint: Array

    @cached_property
    def spaces(self) -> tuple[Array, Array, Array]:
        """`null_space` of C, for all steps by these equations."""
        return null_space(self.constraint)


def null_space(constraint: Array) -> tuple[Array, Array, Array]:
    """Return an orthogonal basis of the range of C^T, its triangle R, and a basis of the rest."""
    count = len(constraint)
    q, r = np.linalg.qr(constraint.T, mode="complete")
    return q[:, :count], r[:count], q[:, count:]


def _solved(triangle: Array, right: Array, transposed: bool = False) -> Array:
    """Return the solution of R x = b, or R^T x = b; the least one where R is singular to rounding.

    By substitution, a block of rows at a time: NumPy solves triangular equations as any others.
    """
    matrix = triangle.T if transposed else triangle
    count = len(right)
    found = np.zeros(count)
    starts = range(0, count, _BLOCK)
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # too large, and then not taken
            for first in starts if transposed else reversed(starts):
                rows = slice(first, first + _BLOCK)
                rest = right[rows] - matrix[rows] @ found  # what is not known yet is 0
                found[rows] = np.linalg.solve(matrix[rows, rows], rest)
    except np.linalg.LinAlgError:
        found[:] = np.inf
    if np.abs(found).max() <= _SINGULAR * np.abs(right).max():
        return found
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0], dtype=np.float64)


def step(linear: Linear, damping: float, weight: Array, low: Array, high: Array) -> Array:
    """Return the step d; variables whose bounds stop them are held at these.

    ``weight`` is the diagonal of D. It goes towards the minimum up to the first bound, holds the
    variable there, and goes on: so it lowers what is minimised, wherever it has to end.
    """
    held = low >= high
    place = np.where(held, low, 0.0)
    for _ in range(_MOST_ROUNDS):
        move = _free_step(linear, damping, weight, held, place) - place
        ends = np.where(move > 0.0, high, low)
        beyond = ~held & (np.abs(move) > np.abs(ends - place))
        if not beyond.any():
            return place + move
        parts = np.abs((ends - place)[beyond] / move[beyond])
        place = place + float(parts.min()) * move
        stopped = np.flatnonzero(beyond)[parts <= parts.min()]
        place[stopped] = ends[stopped]
        held[stopped] = True
        if held.sum() >= len(held) - len(linear.defects):
            break
    return np.clip(place, low, high)


def _free_step(
    linear: Linear, damping: float, weight: Array, held: NDArray[np.bool_], place: Array
) -> Array:
    """Return the step in which some variables have given values."""
    free = ~held
    derivative = linear.derivative[:, free]
    rest = linear.residuals + linear.derivative[:, held] @ place[held]
    found = place.copy()
    found[free] = 0.0
    if len(linear.defects):
        every = bool(free.all())
        spaces = linear.spaces if every else null_space(linear.constraint[:, free])
        ranged, triangle, basis = spaces
        wanted = -(linear.defects + linear.constraint[:, held] @ place[held])
        first = ranged @ _solved(triangle, wanted, transposed=True)
    else:
        first, basis = np.zeros(free.sum()), np.eye(free.sum())
    root = np.sqrt(damping) * weight[free]
    matrix = np.vstack([derivative @ basis, root[:, None] * basis])
    target = -np.concatenate([rest + derivative @ first, root * first])
    found[free] = first + basis @ np.linalg.lstsq(matrix, target, rcond=None)[0]
    return found


def correction(linear: Linear, defects: Array) -> Array:
    """Return the shortest change that closes gaps, to first order."""
    ranged, triangle, _ = linear.spaces
    found: Array = -ranged @ _solved(triangle, defects, transposed=True)
    return found


def multipliers(linear: Linear, taken: Array) -> Array:
    """Return the Lagrange multipliers of the constraints after a step."""
    if not len(linear.defects):
        return linear.defects
    gradient = linear.derivative.T @ (linear.residuals + linear.derivative @ taken)
    ranged, triangle, _ = linear.spaces
    return _solved(triangle, -ranged.T @ gradient)
