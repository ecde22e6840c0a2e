"""Special points within a step: zeros of test functions, bounds of parameters, return to the start.

A test that changes sign from one accepted point to the next is bracketed, every trial a solution,
until rounding stops it. See ``follow``.
"""

import math
from collections.abc import Callable, Collection, Hashable
from dataclasses import replace

import numpy as np

from .branching import directions, refine_branch_point
from .names import TURNING_POINTS, OwnTest, PathEnd
from .newton import NewtonReport
from .path import Limits, Point, SpecialPoint
from .step import RESOLUTION, SAME_POINT, Rejected, Step, bracket

# A branch point is bracketed to this part of the step only, since Newton's matrix is singular
# there; refine_branch_point does the rest.
_BRANCH_POINT_RESOLUTION = 1e-6
# A fold nearer to a branch point or cusp than this part of the step is the same point: dp/ds also
# changes sign where a branch meets a symmetric one.
_SAME_EVENT = 1e-4
# Events nearer to each other than this part of the step are at one place.
_SAME_PLACE = 1e-7
# Where the bracket is shorter than this part of the step, a trial that fails ends the location; the
# step is not repeated.
SMALL_BRACKET = 1e-3


def _test(name: Hashable) -> Callable[[Point], float]:
    def value(point: Point) -> float:
        if name not in point.tests:
            raise Rejected(PathEnd.NO_CONVERGENCE, f"the test '{name}' is missing within a step")
        return point.tests[name]

    return value


def _is_fold(test: Hashable) -> bool:
    """Whether a test is a component of the tangent."""
    return isinstance(test, OwnTest) and test in (OwnTest.FOLD, *TURNING_POINTS)


def _locate(step: Step, name: Hashable, end: Point) -> SpecialPoint | None:
    """Return the zero of a test between the origin of a step and ``end``, if it changes sign."""
    value = _test(name)
    length = step.s(end.z)
    before, after = step.origin.tests.get(name, 0.0), end.tests.get(name, math.nan)
    if before == 0.0 or math.isnan(after) or before * np.sign(after) > 0.0:
        return None
    if _is_fold(name) and max(abs(before), abs(after)) < SAME_POINT:
        return None  # along this curve the parameter is constant within rounding
    singular = name is OwnTest.BRANCH_POINT
    if singular and abs(before) < _BRANCH_POINT_RESOLUTION * abs(after):
        # Within rounding this is the origin itself: every trial next to it would fail.
        best = other = step.origin
    else:
        best, other = bracket(
            step,
            value,
            step.origin,
            end,
            resolution=_BRANCH_POINT_RESOLUTION * length if singular else RESOLUTION,
            give_up=SMALL_BRACKET * length,
        )
    jump = abs(best.tests[name] - other.tests[name])
    # An accepted point where the test is exactly zero is the event.
    found = best is end and best.tests[name] == 0.0
    low, high = sorted((best.arclength, best.arclength if found else other.arclength))
    if singular:
        best = _refined(step, best, end)
    return SpecialPoint(
        **vars(best),
        kind=name.kind
        if isinstance(name, OwnTest)
        else step.curve.classify(name, best.z, best.jacobian),
        test=name,
        value=best.tests[name],
        bracket=(low, high),
        # A continuous test has become smaller with its bracket.
        continuous=found or jump < 0.1 * abs(before - after),
    )


def _refined(step: Step, rough: Point, end: Point) -> Point:
    """Return the branch point at ``rough``, or that itself if it cannot be made better."""
    residual, sizes = step.curve.residual, step.sizes
    z = refine_branch_point(residual, rough.z, sizes)
    length = step.s(end.z)
    if z is None or np.linalg.norm((z - rough.z) / sizes) > SMALL_BRACKET * length:
        return rough
    # Newton's matrix gives no tangent here. That of the branch is near those of the step's ends.
    part = step.s(z) / length
    tangent = (1.0 - part) * step.origin.tangent + part * end.tangent
    if (lines := directions(residual, z, tangent, sizes)) is not None:
        tangent = lines[0]
    tangent = tangent / sizes
    value, jacobian = residual(z)
    report = NewtonReport("converged", rough.iterations, float(np.abs(value).max()), ())
    return step.point(z, jacobian, tangent / np.linalg.norm(tangent), report)


def located(step: Step, end: Point, first: Collection[str]) -> list[SpecialPoint]:
    """Return the special points between the origin of a step and ``end``, in order."""
    # Sorted, so that the order does not depend on hashes.
    names = sorted(end.tests.keys() & step.origin.tests.keys(), key=str)
    found = [point for name in names if (point := _locate(step, name, end)) is not None]
    near = _SAME_EVENT * step.s(end.z)
    meetings = (OwnTest.BRANCH_POINT, OwnTest.CUSP)
    turns = [point.arclength for point in found if point.test in meetings]
    tie = _SAME_PLACE * step.s(end.z)
    return sorted(
        (
            point
            for point in found
            if not _is_fold(point.test)
            or all(abs(point.arclength - other) > near for other in turns)
        ),
        key=lambda point: point.arclength - (tie if point.kind in first else 0.0),
    )


def _excess(index: int, bound: float) -> Callable[[Point], float]:
    def value(point: Point) -> float:
        return float(point.z[index] - bound)

    return value


def leaving(step: Step, stations: list[Point], limits: Limits) -> Point | None:
    """Return where a step first crosses a bound, if one of its stations lies beyond it."""
    for before, after in zip([step.origin, *stations], stations, strict=False):
        for index, low, high in limits:
            bound = min(max(after.z[index], low), high)
            if after.z[index] == bound:
                continue
            best, _ = bracket(step, _excess(index, bound), before, after, resolution=RESOLUTION)
            try:
                return step.where(index, bound, best.z)
            except Rejected:  # a fold on the bound
                return best
    return None


def closing(step: Step, end: Point, home: Point) -> Point | None:
    """Return the start of a path again if the step to ``end`` passes through it."""
    sizes = step.sizes
    row = home.tangent / sizes**2

    def ahead(point: Point) -> float:
        return float(row @ (point.z - home.z))

    reach = 2.0 * step.s(end.z)
    near = all(np.linalg.norm((x.z - home.z) / sizes) <= reach for x in (step.origin, end))
    if not near or not ahead(step.origin) < 0.0 <= ahead(end):
        return None
    best, _ = bracket(step, ahead, step.origin, end, resolution=RESOLUTION)
    if np.linalg.norm((best.z - home.z) / sizes) > SAME_POINT:
        return None
    return replace(home, arclength=best.arclength)
