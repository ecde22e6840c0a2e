"""Following a curve from its start to one of its ends. See ``follow``."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..arguments import count, positive, reject
from ..errors import Interrupted
from .names import OwnTest, PathEnd
from .newton import NOISE, SINGULAR, Array, NewtonReport, Outcome, OutsideDomain, evaluate, newton
from .path import Curve, Limits, Path, Point, SpecialPoint
from .special import SMALL_BRACKET, closing, is_fold, leaving, located
from .step import MAX_CORRECTIONS, RESOLUTION, SAME_POINT, Rejected, Step

# Steps grow only where Newton's method took at most this many iterations. From a good prediction
# it takes three or four. With half as many allowed hardly any step grows, and curves do not reach
# their ends; with twice as many, short curves get fewer points.
_EASY_CORRECTIONS = 5


@dataclass(frozen=True, kw_only=True)
class Steps:
    """The settings of a continuation; meanings as in ``follow``."""

    step: float
    min_step: float
    max_step: float
    max_points: int
    max_angle: float
    stop_at: Callable[[SpecialPoint], bool]
    first: frozenset[str]

    @classmethod
    def checked(
        cls,
        *,
        step: Any,
        min_step: Any,
        max_step: Any,
        max_points: Any,
        max_angle: Any,
        stop_at: Any,
        first: Any,
    ) -> "Steps":
        """Return the settings, or raise ParameterError."""
        values = [positive("min_step", min_step), positive("step", step)]
        values.append(positive("max_step", max_step))
        if not values[0] <= values[1] <= values[2]:
            reject("step", step, f"min_step = {min_step!r} to max_step = {max_step!r}")
        angle = positive("max_angle", max_angle)
        if angle > 1.0:
            reject("max_angle", max_angle, "a number in (0, 1], in radians")
        for name, kinds in (("stop_at", stop_at), ("first", first)):
            if name == "stop_at" and callable(kinds):
                continue
            if isinstance(kinds, str) or not all(isinstance(kind, str) for kind in kinds):
                reject(name, kinds, "a collection of kinds of special points")
        return cls(
            step=values[1],
            min_step=values[0],
            max_step=values[2],
            max_points=count("max_points", max_points, least=1),
            max_angle=angle,
            stop_at=stop_at if callable(stop_at) else _of_kinds(frozenset(stop_at)),
            first=frozenset(first),
        )


def _of_kinds(kinds: frozenset[str]) -> Callable[[SpecialPoint], bool]:
    return lambda point: point.kind in kinds


def start_point(
    curve: Curve, z: Array, tangent: Array | None, direction: int, limits: Limits
) -> Point | Path:
    """Return the solution near z with its oriented tangent, or a path that ends at once.

    Without a tangent a parameter on its bound is kept, else the last one, if the curve can be
    parametrised by it: moved off its bound by rounding, a start could leave through it.
    """
    sizes = curve.scale(z)
    kept = next((i for i, low, high in limits if z[i] in (low, high)), len(z) - 1)

    def failed(report: NewtonReport) -> Path:
        outside = report.outcome == "outside domain"
        end = PathEnd.OUTSIDE_DOMAIN if outside else PathEnd.NO_CONVERGENCE
        detail = f"start: {report.outcome} after {report.iterations} Newton iterations"
        return Path(points=(), special=(), end=end, detail=detail)

    def fixed(v: Array) -> tuple[Array, Array]:
        value, jacobian = curve.residual(np.insert(v, kept, z[kept]))
        return value, np.delete(jacobian, kept, axis=1)

    report = None
    if tangent is None:
        v, _, report = newton(fixed, np.delete(z, kept), np.delete(sizes, kept))
        if report.converged:
            z = np.insert(v, kept, z[kept])
        elif report.outcome != "singular":
            return failed(report)
    if report is None or not report.converged:
        z, report = _nearest(curve, z, sizes)
        if not report.converged:
            return failed(report)
    jacobian = curve.residual(z)[1]
    unit = direction * _first_tangent(
        jacobian * sizes, None if tangent is None else tangent / sizes
    )
    n = len(z) - curve.free
    bare = Point(
        u=z[:n],
        p=z[n:],
        tangent=unit * sizes,
        jacobian=jacobian,
        arclength=0.0,
        tests={},
        residual=report.residual,
        iterations=report.iterations,
    )
    curve.adapt(z, jacobian)
    try:
        return Step(curve, bare).point(z, jacobian, unit, report)
    except Rejected as cause:
        return Path(points=(), special=(), end=cause.reason, detail=f"start: {cause.detail}")


def _first_tangent(scaled: Array, hint: Array | None) -> Array:
    """Return the unit null vector nearest to ``hint``, or along which the last parameter grows."""
    if hint is None:
        null: Array = np.linalg.svd(scaled)[2][-1]
        # At a fold the parameter has no direction: the largest other unknown gives one.
        leading = -1 if abs(null[-1]) > SINGULAR else np.argmax(np.abs(null))
        null *= np.sign(null[leading])
        return null
    tangent: Array = hint - _pseudo_inverse(scaled) @ (scaled @ hint)
    size = np.linalg.norm(tangent)
    if size <= SINGULAR * float(np.linalg.norm(hint)):
        reject("tangent", hint.tolist(), "a direction that is not normal to the branch")
    tangent /= size
    return tangent


def _pseudo_inverse(scaled: Array) -> Array:
    """Return the pseudo-inverse of J; a singular value that vanishes at a branch point is 0."""
    left, values, right = np.linalg.svd(scaled, full_matrices=False)
    # The second term is for a single equation, whose J vanishes there altogether.
    kept = values > SINGULAR * max(float(values[0]), 1e-3)
    inverse: Array = right[kept].T / values[kept] @ left[:, kept].T
    return inverse


def _nearest(curve: Curve, z: Array, sizes: Array) -> tuple[Array, NewtonReport]:
    """Return a solution by the shortest steps (Gauss-Newton), which exist at special points too."""
    steps, residual = list[float](), math.nan
    outcome: Outcome = "no convergence"
    try:
        for _ in range(MAX_CORRECTIONS):
            value, jacobian = evaluate(curve.residual, z)
            residual = float(np.abs(value).max())
            step = -_pseudo_inverse(jacobian * sizes) @ value
            steps.append(float(np.abs(step).max()))
            if steps[-1] <= 1e-14 or (len(steps) > 1 and steps[-2] / 2 <= steps[-1] <= NOISE):
                outcome = "converged"
                break
            z = z + step * sizes
    except OutsideDomain:
        outcome = "outside domain"
    return z, NewtonReport(outcome, len(steps), residual, tuple(steps))


@dataclass
class _End:
    """The result of a step: last point, the reason if the path ends there, special points.

    Special points at the start of the path are separate: they belong to the path only if it closes.
    """

    point: Point
    reason: PathEnd | None = None
    special: list[SpecialPoint] = field(default_factory=list)
    at_start: list[SpecialPoint] = field(default_factory=list)


def _advance(step: Step, length: float, limits: Limits, max_angle: float) -> _End:
    """Return the solution at ``length``, or on the bound of a parameter that comes before."""
    ahead = step.tangent * step.sizes
    bound: tuple[float, int, float] | None = None
    for index, low, high in limits:
        value = high if ahead[index] > 0.0 else low
        if ahead[index] != 0.0 and math.isfinite(value):
            s = (value - step.origin.z[index]) / ahead[index]
            bound = min(bound or (math.inf, 0, 0.0), (s, index, value))
    if bound is not None and bound[0] <= length:
        s, index, value = bound
        if s <= RESOLUTION:
            return _End(step.origin, PathEnd.BOUND)
        # F may not be defined beyond its bound, so that the bound itself is aimed at. If the curve
        # turns back before the bound, the plain step is used.
        try:
            landed = step.where(index, value, step.predict(s))
            step.accept(landed, max_angle)
            return _End(landed, PathEnd.BOUND)
        except Rejected:
            pass
    return _End(step.at(length, step.predict(length)))


def _take(step: Step, length: float, start: Point, limits: Limits, settings: Steps) -> _End:
    """Return the result of a step, with its special points."""
    end = _advance(step, length, limits, settings.max_angle)
    if end.point is step.origin:
        return end
    step.accept(end.point, settings.max_angle)
    if step.origin is not start and (home := closing(step, end.point, start)) is not None:
        end = _End(home, PathEnd.CLOSED)
    found = located(step, end.point, settings.first, settings.stop_at)
    if (edge := leaving(step, [*found, end.point], limits)) is not None:
        end = _End(edge, PathEnd.BOUND)
        found = [event for event in found if event.arclength <= edge.arclength]
    own = 0.0
    # At a branch point the start's own events can only be located so well.
    singular = abs(start.tests[OwnTest.BRANCH_POINT]) < SINGULAR
    beside = max(SMALL_BRACKET * step.s(end.point.z), SAME_POINT) if singular else SAME_POINT
    if step.origin is start:
        own = beside
    if end.reason is PathEnd.CLOSED and singular:
        found = [event for event in found if event.arclength < end.point.arclength - beside]
    for event in found:
        if event.arclength < own:
            # At a pitchfork the extremum of the parameter is no fold beside it.
            if not (singular and is_fold(event.test)):
                end.at_start.append(event)
            continue
        end.special.append(event)
        if settings.stop_at(event):
            end.point, end.reason = event, PathEnd.STOPPED
            break
    return end


def _next_length(length: float, step: Step, end: Point, settings: Steps) -> float:
    """Return the next step length: longer where the curve is straight and Newton's method fast."""
    angle = step.accept(end, math.inf)
    factor = min(2.0, max(0.5, settings.max_angle / 3.0 / max(angle, 1e-12)))
    if end.iterations > _EASY_CORRECTIONS:
        factor = min(factor, 0.7)
    return min(max(factor * length, settings.min_step), settings.max_step)


def trace(curve: Curve, start: Point | Path, limits: Limits, settings: Steps) -> Path:
    """Follow a curve from ``start`` along its tangent; see ``follow``."""
    if isinstance(start, Path):
        return start
    points, special = [start], list[SpecialPoint]()
    at_start = list[SpecialPoint]()
    length = settings.step

    def path(end: PathEnd, detail: str = "") -> Path:
        return Path(points=tuple(points), special=tuple(special), end=end, detail=detail)

    try:
        while len(points) < settings.max_points:
            curve.adapt(points[-1].z, points[-1].jacobian)
            step = Step(curve, points[-1])
            try:
                end = _take(step, length, start, limits, settings)
            except Rejected as cause:
                if length <= settings.min_step:
                    return path(cause.reason, cause.detail)
                length = max(length / 2.0, settings.min_step)
                continue
            special += end.special
            at_start += end.at_start
            if end.point is not step.origin:
                points.append(end.point)
            if end.reason is PathEnd.CLOSED:
                at_end = end.point.arclength
                special += [replace(event, arclength=at_end) for event in at_start]
            if end.reason is not None:
                return path(end.reason)
            length = _next_length(length, step, end.point, settings)
    except KeyboardInterrupt:
        raise Interrupted(
            f"interrupted after {len(points)} points",
            path(PathEnd.INTERRUPTED),
            holds="the path so far",
        ) from None
    return path(PathEnd.POINTS)
