"""One step of the search: damped Gauss-Newton with equality constraints and bounds.

    minimise |r + J d|^2 + damping |D d|^2   subject to   C d = -c,   low <= d <= high

The constraints are the continuity of multiple shooting. They are eliminated by an orthogonal basis
of their null space, so that growth along a chaotic motion does not spoil the condition. Source:
J. Nocedal, S. J. Wright, *Numerical Optimization*, 2nd ed., 2006, sections 10.3 and 16.2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Rounds in which variables that would leave their bounds are held there.
_MOST_ROUNDS = 12


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


def null_space(constraint: Array) -> tuple[Array, Array, Array]:
    """Return an orthogonal basis of the range of C^T, its triangle R, and a basis of the rest."""
    count = len(constraint)
    q, r = np.linalg.qr(constraint.T, mode="complete")
    return q[:, :count], r[:count], q[:, count:]


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
        ranged, triangle, basis = null_space(linear.constraint[:, free])
        wanted = -(linear.defects + linear.constraint[:, held] @ place[held])
        first = ranged @ np.linalg.lstsq(triangle.T, wanted, rcond=None)[0]
    else:
        first, basis = np.zeros(free.sum()), np.eye(free.sum())
    root = np.sqrt(damping) * weight[free]
    matrix = np.vstack([derivative @ basis, root[:, None] * basis])
    target = -np.concatenate([rest + derivative @ first, root * first])
    found[free] = first + basis @ np.linalg.lstsq(matrix, target, rcond=None)[0]
    return found


def correction(linear: Linear, defects: Array) -> Array:
    """Return the shortest change that closes gaps, to first order."""
    ranged, triangle, _ = null_space(linear.constraint)
    found: Array = -ranged @ np.linalg.lstsq(triangle.T, defects, rcond=None)[0]
    return found


def multipliers(linear: Linear, taken: Array) -> Array:
    """Return the Lagrange multipliers of the constraints after a step."""
    if not len(linear.defects):
        return linear.defects
    gradient = linear.derivative.T @ (linear.residuals + linear.derivative @ taken)
    found = np.linalg.lstsq(linear.constraint.T, -gradient, rcond=None)[0]
    return np.asarray(found, dtype=np.float64)
