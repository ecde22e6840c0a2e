"""Special points within a step: zeros of test functions, bounds of parameters, return to the start.

A test that changes sign from one accepted point to the next is bracketed, every trial a solution,
until rounding stops it. See ``follow``.
"""

import math
from collections.abc import Callable, Collection, Hashable
from dataclasses import fields, replace
from itertools import pairwise

import numpy as np

from .branching import MISS, directions, refine_branch_point
from .names import TURNING_POINTS, OwnTest, PathEnd
from .newton import SINGULAR, Array, NewtonReport
from .path import Limits, Point, SpecialPoint
from .step import RESOLUTION, SAME_POINT, Rejected, Step, bracket

# A branch point is bracketed to this part of the step only, since Newton's matrix is singular
# there; refine_branch_point does the rest.
_BRANCH_POINT_RESOLUTION = 1e-6
# A fold nearer to a branch point or cusp than this part of the step is the same point: dp/ds also
# changes sign where a branch meets a symmetric one.
_SAME_EVENT = 1e-4
# A path comes back to a branch point at which it began if the interpolated curve passes it at this
# part of the step, and with a tangent whose cosine is at least this: another branch crosses there.
_PASSES = 1e-2
_SAME_WAY = 0.9
# Events nearer to each other than this part of the step are at one place.
_SAME_PLACE = 1e-7
# Tests are compared this part of the way to a point at which a path stops before it. A multiplier
# that passes infinity there, as the inverse of the distance or of its square, is large, but the
# others have digits left beside it.
_BESIDE_STOP = 1e-3
# Where the bracket is shorter than this part of the step, a trial that fails ends the location; the
# step is not repeated.
SMALL_BRACKET = 1e-3


def _test(name: Hashable) -> Callable[[Point], float]:
    def value(point: Point) -> float:
        if name not in point.tests:
            raise Rejected(PathEnd.NO_CONVERGENCE, f"the test '{name}' is missing within a step")
        return point.tests[name]

    return value


def is_fold(test: Hashable) -> bool:
    """Whether a test is a component of the tangent."""
    return isinstance(test, OwnTest) and test in (OwnTest.FOLD, *TURNING_POINTS)


def _locate(
    step: Step, name: Hashable, low: Point, high: Point, crossings: Collection[float]
) -> SpecialPoint | None:
    """Return the zero of a test between two points of a step, if it changes sign."""
    value = _test(name)
    before, after = low.tests.get(name, 0.0), high.tests.get(name, math.nan)
    if not _changes(before, after):
        return None
    if is_fold(name):
        largest = max(abs(before), abs(after))
        if largest < SAME_POINT:
            return None  # along this curve the parameter is constant within rounding
    best, other = bracket(
        step,
        value,
        low,
        high,
        resolution=RESOLUTION,
        give_up=SMALL_BRACKET * (step.s(high.z) - step.s(low.z)),
        crossings=crossings,
    )
    jump = abs(best.tests[name] - other.tests[name])
    # An accepted point where the test is exactly zero is the event.
    found = best is high and best.tests[name] == 0.0
    below, above = sorted((best.arclength, best.arclength if found else other.arclength))
    return SpecialPoint(
        **vars(best),
        kind=name.kind
        if isinstance(name, OwnTest)
        else step.curve.classify(name, best.z, best.jacobian),
        test=name,
        value=best.tests[name],
        bracket=(below, above),
        # A continuous test has become smaller with its bracket.
        continuous=found or jump < 0.1 * abs(before - after),
    )


def _changes(before: float, after: float) -> bool:
    """Whether a test changes its sign; a zero at the first point does not count."""
    return before != 0.0 and not math.isnan(after) and not before * np.sign(after) > 0.0


def _branch_point(step: Step, end: Point) -> SpecialPoint | None:
    """Return the branch point between the origin of a step and ``end``, if there is one.

    Newton's matrix on the curve is singular there, so that solutions beside it cannot be asked for.
    The test is linear about its zero, and from there Moore's system is solved. Only if this fails
    is the zero bracketed first, as far as that goes.

    Raises
    ------
    Rejected
        If two curves miss each other there: the step has jumped from one to the other.
    """
    name = OwnTest.BRANCH_POINT
    origin, length = step.origin, step.s(end.z)
    before, after = origin.tests.get(name, 0.0), end.tests.get(name, math.nan)
    if not _changes(before, after):
        return None
    # Within rounding of an end it is that itself.
    best = other = origin if abs(before) < abs(after) else end
    least, largest = sorted((abs(before), abs(after)))
    if least >= _BRANCH_POINT_RESOLUTION * largest:
        guess = step.interpolated((0.0, length), origin, end, length * before / (before - after))
        z = _refined(step, guess, end)
        if z is not None and 0.0 <= step.s(z) <= length:
            return _crossing(step, z, end, (origin, end))
        best, other = bracket(
            step,
            _test(name),
            origin,
            end,
            resolution=_BRANCH_POINT_RESOLUTION * length,
            give_up=SMALL_BRACKET * length,
            crossings=(0.0,),
        )
    z = _refined(step, best.z, end)
    if z is not None and np.linalg.norm((z - best.z) / step.sizes) <= SMALL_BRACKET * length:
        return _crossing(step, z, end, (best, other))
    return _special(best, (best, other), abs(before - after), None)


def _refined(step: Step, rough: Array, end: Point) -> Array | None:
    """Return the branch point of this curve near ``rough``, None if it is not found."""
    found = refine_branch_point(step.curve.residual, rough, step.sizes)
    if found is None:
        return None
    z, mu = found
    ends = (0.0, step.s(end.z))
    if not step.beside(z, step.interpolated(ends, step.origin, end, step.s(z)), ends):
        return None
    if abs(mu) > MISS:
        raise Rejected(PathEnd.NO_CONVERGENCE, f"two curves miss each other by mu = {mu:.2g}")
    return z


def _crossing(step: Step, z: Array, end: Point, ends: tuple[Point, Point]) -> SpecialPoint:
    """Return the branch point at z."""
    residual, sizes = step.curve.residual, step.sizes
    # Newton's matrix gives no tangent here. That of the branch is near those of the step's ends.
    part = step.s(z) / step.s(end.z)
    tangent = (1.0 - part) * step.origin.tangent + part * end.tangent
    lines = directions(residual, z, tangent, sizes)
    unit = (tangent if lines is None else lines[0]) / sizes
    value, jacobian = residual(z)
    report = NewtonReport("converged", step.origin.iterations, float(np.abs(value).max()), ())
    point = step.point(z, jacobian, unit / np.linalg.norm(unit), report)
    name = OwnTest.BRANCH_POINT
    change = abs(step.origin.tests[name] - end.tests[name])
    return _special(point, ends, change, None if lines is None else lines[1])


def _special(
    point: Point, ends: tuple[Point, Point], change: float, other: Array | None
) -> SpecialPoint:
    name = OwnTest.BRANCH_POINT
    low, high = sorted(end.arclength for end in ends)
    return SpecialPoint(
        **vars(point),
        kind=name.kind,
        test=name,
        value=point.tests[name],
        bracket=(low, high),
        continuous=abs(point.tests[name]) < 0.1 * change,
        other=other,
    )


def located(
    step: Step, end: Point, first: Collection[str], stop_at: Callable[[SpecialPoint], bool]
) -> list[SpecialPoint]:
    """Return the special points between the origin of a step and ``end``, in order.

    A test may jump where the path stops, or pass infinity: at a graze a multiplier does. It then
    has the same sign at both ends of the step although it vanished before, so that tests are also
    compared just before such a point.
    """
    crossing = _branch_point(step, end)
    found = [] if crossing is None else [crossing]
    length = step.s(end.z)
    # The ends may be branch points, too: a path may begin there, and come back.
    crossings = [0.0, *(step.s(point.z) for point in found)]
    if abs(end.tests[OwnTest.BRANCH_POINT]) < SINGULAR:
        crossings.append(length)
    stations = [step.origin, end]
    if crossing is not None and SAME_POINT < crossings[1] < length - SAME_POINT:
        as_point = {each.name: getattr(crossing, each.name) for each in fields(Point)}
        stations.insert(1, Point(**as_point))
    while True:
        known = {point.test for point in found if point.arclength <= stations[-1].arclength}
        # Sorted, so that the order does not depend on hashes.
        names = sorted(end.tests.keys() & step.origin.tests.keys(), key=str)
        for name in names:
            if name is OwnTest.BRANCH_POINT or name in known:
                continue
            with_test = [point for point in stations if name in point.tests]
            for low, high in pairwise(with_test):
                if (point := _locate(step, name, low, high, crossings)) is not None:
                    found.append(point)
        found = _in_order(step, end, found, first)
        before = _before_stop(step, found, stations[-1], stop_at)
        if before is None:
            return found
        stations = [*(point for point in stations if point.arclength < before.arclength), before]


def _before_stop(
    step: Step,
    found: list[SpecialPoint],
    last: Point,
    stop_at: Callable[[SpecialPoint], bool],
) -> Point | None:
    """Return a point just before that at which a path stops, None if ``last`` is one.

    At a branch point tests do not jump, and a solution beside it may be on the other branch.
    """
    stop = next((point for point in found if stop_at(point)), None)
    if stop is not None and stop.test is OwnTest.BRANCH_POINT:
        return None
    s = 0.0 if stop is None else step.s(stop.z)
    if stop is None or s * _BESIDE_STOP <= SAME_POINT or stop.arclength > last.arclength:
        return None
    try:
        return step.between((0.0, s), step.origin, stop, (1.0 - _BESIDE_STOP) * s)
    except Rejected:
        return None


def _in_order(
    step: Step, end: Point, found: list[SpecialPoint], first: Collection[str]
) -> list[SpecialPoint]:
    """Return special points in order, without folds that are another point of the curve."""
    near = _SAME_EVENT * step.s(end.z)
    meetings = (OwnTest.BRANCH_POINT, OwnTest.CUSP)
    turns = [point.arclength for point in found if point.test in meetings]
    tie = _SAME_PLACE * step.s(end.z)
    return sorted(
        (
            point
            for point in found
            if not is_fold(point.test)
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
    """Return the start of a path again if the step to ``end`` passes through it.

    Beside a branch point no solution can be asked for: there the interpolated curve tells.
    """
    sizes = step.sizes
    row = home.tangent / sizes**2

    def ahead(point: Point) -> float:
        return float(row @ (point.z - home.z))

    reach = 2.0 * step.s(end.z)
    near = all(np.linalg.norm((x.z - home.z) / sizes) <= reach for x in (step.origin, end))
    if not near or not ahead(step.origin) < 0.0 <= ahead(end):
        return None
    if abs(home.tests[OwnTest.BRANCH_POINT]) < SINGULAR:
        s, length = step.s(home.z), step.s(end.z)
        guess = step.interpolated((0.0, length), step.origin, end, s)
        off = float(np.linalg.norm((guess - home.z) / sizes))
        along = float(step.tangent @ (home.tangent / sizes))
        if not 0.0 < s <= length or off > _PASSES * length or along < _SAME_WAY:
            return None
        return replace(home, arclength=step.origin.arclength + s)
    best, _ = bracket(step, ahead, step.origin, end, resolution=RESOLUTION)
    if np.linalg.norm((best.z - home.z) / sizes) > SAME_POINT:
        return None
    return replace(home, arclength=best.arclength)
