"""Branches of zeros of F(u, p) by pseudo-arclength continuation, with their special points located.

A curve is a set of N equations F(z) = 0 in N + 1 unknowns z = (u, p). From a point z0 with unit
tangent t the next one solves (H. B. Keller, in Applications of Bifurcation Theory, Academic Press
1977, pp. 359-384)

    F(z) = 0,    t . (z - z0)/w = s,

w the sizes of the unknowns, s the pseudo-arclength. The new tangent t' solves J t' = 0, t . t' > 0.
The step s follows the angle between tangents and Newton's convergence; a point that the tangents at
both ends do not lead to is refused, since it may be on another branch.

Special points are sign changes of test functions between accepted points: ``fold`` (saddle-node),
dp/ds; ``branch_point``, the smallest singular value of (J; t'), with the sign of its determinant,
which changes at a simple branch point and not at a fold; and those of the problem. Each is then
bracketed in s, every trial being a solution found by Newton's method, until rounding stops it. A
test that changes sign twice within a step cannot be seen; ``max_angle`` and ``max_step`` make that
rare. All sizes are dimensionless.

This is own code, because no maintained package fits. PyPI's pycont-lite and bice use Newton-Krylov
or finite-difference Jacobians, know fixed points of differential equations only, follow one
parameter and need SciPy; pacopy has a proprietary licence; MatCont, BifurcationKit and AUTO are not
Python. None of them takes an exact Jacobian and test functions with names, finds bifurcations of
maps, and follows these in two parameters.
"""

from collections.abc import Callable, Collection, Hashable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import positive, reject, vector
from ..errors import ParameterError
from .branching import directions
from .names import OwnTest
from .newton import Array, NewtonReport, OutsideDomain, Problem, parameters_of, sizes_of, solve
from .path import Path, Point, SpecialPoint, StopAt
from .tracing import Steps, start_point, trace

__all__ = [
    "NewtonReport",
    "OutsideDomain",
    "Path",
    "Point",
    "Problem",
    "SpecialPoint",
    "follow",
    "solve",
    "switch",
]

Classify = Callable[[Hashable, Array, Array, Array], str]


@dataclass(frozen=True)
class _Branch:
    """A branch of a problem with one parameter, as a curve."""

    problem: Problem
    parameter_size: float
    named: Classify | None
    free: int = 1

    def residual(self, z: Array) -> tuple[Array, Array]:
        return self.problem.residual(z[:-1], z[-1:])

    def tests(self, z: Array, jacobian: Array, tangent: Array) -> Mapping[Any, float]:
        fold = float(tangent[-1]) / self.parameter_size
        return {**self.problem.tests(z[:-1], z[-1:], jacobian), OwnTest.FOLD: fold}

    def classify(self, test: Hashable, z: Array, jacobian: Array) -> str:
        if self.named is None:
            return str(test)
        return self.named(test, z[:-1], z[-1:], jacobian)

    def scale(self, z: Array) -> Array:
        return np.append(sizes_of(self.problem, z[:-1]), self.parameter_size)

    def adapt(self, z: Array, jacobian: Array) -> None:
        pass


def checked_bounds(name: str, bounds: Any, p: float) -> tuple[float, float]:
    """Return the bounds of a parameter that starts at p."""
    allowed = f"(low, high) with low < high, around the start {p!r}"
    try:
        low, high = (float(bound) for bound in bounds)
    except (TypeError, ValueError):
        reject(name, bounds, allowed)
    if not (low < high and low <= p <= high):
        reject(name, bounds, allowed)
    return low, high


def checked_direction(direction: Any) -> int:
    """Return the direction, 1 or -1."""
    if isinstance(direction, bool) or direction not in (1, -1):
        reject("direction", direction, "1 or -1")
    return int(direction)


def checked_tangent(tangent: ArrayLike | None, size: int) -> Array | None:
    """Return the tangent, a direction of so many components, or None."""
    if tangent is None:
        return None
    along = vector("tangent", tangent)
    if len(along) != size or not along.any():
        reject("tangent", tangent, f"a direction of {size} components")
    return along


def follow(
    problem: Problem,
    u: ArrayLike,
    p: ArrayLike,
    *,
    bounds: tuple[float, float],
    direction: int = 1,
    tangent: ArrayLike | None = None,
    parameter_size: float = 1.0,
    step: float = 0.01,
    min_step: float = 1e-6,
    max_step: float = 0.1,
    max_points: int = 1000,
    max_angle: float = 0.3,
    stop_at: StopAt = (),
    first: Collection[str] = (),
    classify: Classify | None = None,
) -> Path:
    """Follow a branch of solutions of F(u, p) = 0 in its one parameter.

    Parameters
    ----------
    problem
        The equations, with k = 1.
    u, p
        Where to start: u of shape (n,), near a solution, and a number.
    bounds
        Least and largest p; the branch ends exactly there. Infinite ones are allowed.
    direction
        1 to start with p growing, -1 falling; with ``tangent`` along or against it.
    tangent
        Direction of shape (n + 1,) to start in, at special points for which p gives none: the
        tangent of a fold, or the result of ``switch``. The start is then corrected in p as well.
    parameter_size
        Size of p beside ``problem.scale``, for norms and steps.
    step, min_step, max_step
        First, least and largest step in arclength, in units of the sizes.
    max_points
        Cap on the number of points.
    max_angle
        Largest angle between successive tangents, in radians; steps aim at a third of it.
    stop_at
        Kinds of special points at which the branch ends, or a function that tells of one.
    first
        Kinds that come first where several special points lie at one place, within rounding.
    classify
        Gives the kind of a located point from (test, u, p, jacobian), where a test has zeros of
        several kinds; default is the test's name.

    Returns
    -------
    Path
        Points, special points and the reason of the end. A failure is a reason, not an error.

    Raises
    ------
    ParameterError
        If an argument is not finite, of the wrong shape or out of range.
    Interrupted
        After Ctrl-C; ``.result`` is the path so far, with the end ``interrupted``.
    """
    start, parameter = vector("u", u), vector("p", parameters_of(p))
    if len(parameter) != 1:
        raise ParameterError(f"p of shape {parameter.shape} is not allowed; allowed: one number")
    low, high = checked_bounds("bounds", bounds, float(parameter[0]))
    direction = checked_direction(direction)
    along = checked_tangent(tangent, len(start) + 1)
    curve = _Branch(problem, positive("parameter_size", parameter_size), classify)
    settings = Steps.checked(
        step=step,
        min_step=min_step,
        max_step=max_step,
        max_points=max_points,
        max_angle=max_angle,
        stop_at=stop_at,
        first=first,
    )
    limits = [(len(start), low, high)]
    first_point = start_point(curve, np.append(start, parameter), along, direction, limits)
    return trace(curve, first_point, limits, settings)


def switch(problem: Problem, point: Point, *, parameter_size: float = 1.0) -> Array:
    """Return the direction in which another branch leaves a simple branch point.

    Parameters
    ----------
    problem
        The equations, with k = 1.
    point
        A located ``branch_point``.
    parameter_size
        As in ``follow``.

    Returns
    -------
    ndarray
        A tangent of shape (n + 1,), for ``follow(problem, point.u, point.p, tangent=...)`` with
        direction 1 and -1.

    Raises
    ------
    ParameterError
        If it is not a point where exactly two branches cross.
    """
    curve = _Branch(problem, positive("parameter_size", parameter_size), None)
    lines = directions(curve.residual, point.z, point.tangent, curve.scale(point.z))
    if lines is None:
        reject("point", float(point.p[0]), "the parameter of a simple branch point")
    return lines[1]
