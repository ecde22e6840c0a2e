"""Branches of zeros of F(u, p) by pseudo-arclength continuation, with their special points located.

A curve is a set of N equations F(z) = 0 in N + 1 unknowns z = (u, p). From a point z0 with unit
tangent t the next one solves (H. B. Keller, in Applications of Bifurcation Theory, Academic Press
1977, pp. 359-384)

    F(z) = 0,    t . (z - z0)/w = s,

w the sizes of the unknowns, s the pseudo-arclength. The new tangent t' solves J t' = 0, t . t' > 0.
The step s follows the angle between tangents and Newton's convergence.

Special points are sign changes of test functions between accepted points: ``fold`` (saddle-node),
dp/ds; ``branch_point``, the smallest singular value of (J; t'), with the sign of its determinant,
which changes at a simple branch point and not at a fold; and those of the problem. Each is then
bracketed in s, every trial being a solution found by Newton's method, until rounding stops it. A
test that changes sign twice within a step cannot be seen; ``max_angle`` and ``max_step`` make that
rare. All sizes are dimensionless.

Own code, because no kept package fits. PyPI's pycont-lite and bice use Newton-Krylov or
finite-difference Jacobians, know fixed points of differential equations only, follow one parameter
and need SciPy; pacopy has a proprietary licence; MatCont, BifurcationKit and AUTO are not Python.
None takes an exact Jacobian with named test functions, finds bifurcations of maps and follows them
in two parameters.
"""

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..checks import count, positive, reject, vector
from ..errors import Interrupted, ParameterError
from .branching import other_direction, refine_branch_point
from .newton import (
    NOISE,
    SINGULAR,
    Array,
    NewtonReport,
    OutsideDomain,
    Problem,
    balanced,
    evaluate,
    newton,
    parameters_of,
    sizes_of,
    solve,
)

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

Classify = Callable[[str, Array, Array, Array], str]
Limits = list[tuple[int, float, float]]

# Corrector: a step that needs more Newton iterations than this is too long.
MAX_CORRECTIONS = 12
# Steps grow only where Newton's method took at most this many.
EASY_CORRECTIONS = 5
# Width at which the bracketing of a point ends, in units of the sizes: rounding of z.
RESOLUTION = 4.0 * np.finfo(float).eps
# A branch point is bracketed to this part of the step only, since Newton's matrix is singular there;
# refine_branch_point does the rest.
BRANCH_POINT_RESOLUTION = 1e-6
# Events of other tests nearer to a branch point than this part of the step are that branch point.
AT_BRANCH_POINT = 1e-4
# Where the bracket is shorter than this part of the step, a failing trial ends the location, and
# does not make the whole step be taken again.
SMALL_BRACKET = 1e-3
# Two points nearer than this, in units of the sizes, are the same: the curve has closed.
SAME_POINT = 1e-8


@dataclass(frozen=True, kw_only=True, eq=False)
class Point:
    """A point of a branch or curve.

    Attributes
    ----------
    u, p
        Unknowns of shape (n,) and free parameters of shape (k,).
    tangent
        d(u, p)/ds of shape (n + k,), of length 1 in units of the sizes.
    arclength
        Sum of the steps s up to here.
    tests
        Test functions, by name.
    residual, iterations
        max |F_i|, and Newton iterations spent.
    """

    u: Array
    p: Array
    tangent: Array
    arclength: float
    tests: dict[str, float]
    residual: float
    iterations: int

    @property
    def z(self) -> Array:
        """All unknowns (u, p), of shape (n + k,)."""
        return np.concatenate((self.u, self.p))


@dataclass(frozen=True, kw_only=True, eq=False)
class SpecialPoint(Point):
    """A located zero of a test function.

    Attributes
    ----------
    kind
        What it is: ``fold``, ``branch_point``, or the test's name up to its colon.
    test, value
        The test function and what is left of it here.
    bracket
        The arclengths between which it changes sign.
    continuous
        False where the test jumps across zero.
    """

    kind: str
    test: str
    value: float
    bracket: tuple[float, float]
    continuous: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class Path:
    """A branch or curve, as far as it was followed.

    Attributes
    ----------
    points
        Accepted points in order; empty if no solution was found at the start.
    special
        Special points in order of arclength.
    end
        ``bound``, ``points`` (as many as allowed), ``closed`` (back at the start, which is the last
        point once more), ``stopped: <test>``, ``no convergence``, ``outside domain`` or
        ``interrupted``.
    detail
        What happened in the shortest step, for the ends that are a failure of it.
    """

    points: tuple[Point, ...]
    special: tuple[SpecialPoint, ...]
    end: str
    detail: str = ""

    @property
    def u(self) -> Array:
        """Unknowns of all points, of shape (points, n)."""
        return np.array([point.u for point in self.points])

    @property
    def p(self) -> Array:
        """Parameters of all points, of shape (points, k)."""
        return np.array([point.p for point in self.points])

    @property
    def arclength(self) -> Array:
        """Arclength of all points, of shape (points,)."""
        return np.array([point.arclength for point in self.points])

    def of_kind(self, kind: str) -> list[SpecialPoint]:
        """Return the special points of one kind."""
        return [point for point in self.special if point.kind == kind]


class Curve(Protocol):
    """N equations F(z) = 0 in N + 1 unknowns z, the last ``free`` of which are parameters."""

    @property
    def free(self) -> int:
        """Number k of parameters."""

    def residual(self, z: Array) -> tuple[Array, Array]:
        """Return F of shape (N,) and its Jacobian of shape (N, N + 1)."""

    def tests(self, z: Array, jacobian: Array, tangent: Array) -> Mapping[str, float]:
        """Return the test functions at a solution."""

    def classify(self, name: str, z: Array, jacobian: Array) -> str:
        """Return the kind of a zero of a test."""

    def scale(self, z: Array) -> Array:
        """Return the sizes of z, of shape (N + 1,)."""

    def adapt(self, z: Array, jacobian: Array) -> None:
        """Take note of a new accepted point."""


@dataclass(frozen=True, kw_only=True)
class Steps:
    """The settings of a continuation; meanings as in ``follow``."""

    step: float
    min_step: float
    max_step: float
    max_points: int
    max_angle: float
    stop_at: frozenset[str]

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
    ) -> "Steps":
        """Return the settings, or raise ParameterError."""
        values = [positive("min_step", min_step), positive("step", step)]
        values.append(positive("max_step", max_step))
        if not values[0] <= values[1] <= values[2]:
            reject("step", step, f"min_step = {min_step!r} to max_step = {max_step!r}")
        angle = positive("max_angle", max_angle)
        if angle > 1.0:
            reject("max_angle", max_angle, "a number in (0, 1], in radians")
        if isinstance(stop_at, str) or not all(isinstance(kind, str) for kind in stop_at):
            reject("stop_at", stop_at, "a collection of kinds of special points")
        return cls(
            step=values[1],
            min_step=values[0],
            max_step=values[2],
            max_points=count("max_points", max_points, least=1),
            max_angle=angle,
            stop_at=frozenset(stop_at),
        )


class Rejected(Exception):
    """A step or trial failed; carries the reason to end with if it cannot be made shorter."""

    def __init__(self, reason: Literal["no convergence", "outside domain"], detail: str) -> None:
        super().__init__(detail)
        self.reason = reason
        self.detail = detail


class _Step:
    """The curve ahead of ``origin``, over the pseudo-arclength s from there."""

    def __init__(self, curve: Curve, origin: Point) -> None:
        self.curve, self.origin = curve, origin
        self.sizes = curve.scale(origin.z)
        self.tangent = origin.tangent / self.sizes
        self.tangent /= np.linalg.norm(self.tangent)

    def s(self, z: Array) -> float:
        """Return the pseudo-arclength of z."""
        return float(self.tangent @ ((z - self.origin.z) / self.sizes))

    def predict(self, s: float) -> Array:
        """Return the point at s on the tangent."""
        return self.origin.z + s * self.tangent * self.sizes

    def at(self, s: float, guess: Array) -> Point:
        """Return the solution at s."""
        return self._correct(self.tangent / self.sizes, self.predict(s), guess)

    def between(self, first: Point, second: Point, s: float) -> Point:
        """Return the solution at s, guessed by cubic Hermite interpolation.

        Near a branch point the other branch is a solution, too: the better the guess, the nearer
        to it the location can go, and a point that is far from it is not taken.
        """
        left, right = self.s(first.z), self.s(second.z)
        width, x = right - left, (s - left) / (right - left)
        slopes = [
            width * point.tangent / float(self.tangent @ (point.tangent / self.sizes))
            for point in (first, second)
        ]
        guess = (
            (1.0 + 2.0 * x) * (1.0 - x) ** 2 * first.z
            + x * (1.0 - x) ** 2 * slopes[0]
            + x**2 * (3.0 - 2.0 * x) * second.z
            + x**2 * (x - 1.0) * slopes[1]
        )
        found = self.at(s, guess)
        away = float(np.linalg.norm((found.z - guess) / self.sizes))
        if away > 0.1 * abs(width) + SAME_POINT:
            raise Rejected("no convergence", f"two solutions at s = {s:.3g}")
        return found

    def where(self, index: int, value: float, guess: Array) -> Point:
        """Return the solution with z[index] = value, exactly."""
        aim = guess.copy()
        aim[index] = value
        row = np.zeros(len(aim))
        row[index] = 1.0 / self.sizes[index]
        return self._correct(row, aim, aim, fixed=index)

    def accept(self, point: Point, max_angle: float) -> float:
        """Return the angle between the tangents; reject a point that is not the next one."""
        tangent = point.tangent / self.sizes
        cosine = float(self.tangent @ tangent) / float(np.linalg.norm(tangent))
        angle = math.acos(min(1.0, max(-1.0, cosine)))
        s = self.s(point.z)
        away = float(np.linalg.norm((point.z - self.predict(s)) / self.sizes))
        if s <= 0.0 or max(angle, away / s) > max_angle:
            raise Rejected(
                "no convergence",
                f"the curve turns by {angle:.2g} rad and leaves its tangent by {away:.2g} "
                f"within s = {s:.2g}",
            )
        return angle

    def point(self, z: Array, jacobian: Array, tangent: Array, report: NewtonReport) -> Point:
        """Return the point at a solution, with its tests; ``tangent`` is in units of the sizes."""
        real = tangent * self.sizes
        try:
            with np.errstate(all="ignore"):
                given = self.curve.tests(z, jacobian, real)
        except OutsideDomain as error:
            raise Rejected("outside domain", str(error)) from error
        tests = {name: float(value) for name, value in given.items() if math.isfinite(value)}
        # Rows are not balanced here: one of them may vanish at a branch point.
        square = np.vstack((jacobian * self.sizes, tangent))
        sign = float(np.linalg.slogdet(square)[0])
        tests["branch_point"] = sign * float(np.linalg.svd(square, compute_uv=False)[-1])
        n = len(z) - self.curve.free
        return Point(
            u=z[:n],
            p=z[n:],
            tangent=real,
            arclength=self.origin.arclength + self.s(z),
            tests=tests,
            residual=report.residual,
            iterations=report.iterations,
        )

    def _correct(self, row: Array, aim: Array, guess: Array, fixed: int | None = None) -> Point:
        """Solve F(z) = 0, row . (z - aim) = 0 from ``guess``."""

        def bordered(z: Array) -> tuple[Array, Array]:
            value, jacobian = self.curve.residual(z)
            return np.append(value, row @ (z - aim)), np.vstack((jacobian, row))

        z, matrix, report = newton(
            bordered, guess, self.sizes, max_iterations=MAX_CORRECTIONS, damped=False
        )
        if not report.converged:
            reason: Any = "outside domain" if report.outcome == "outside domain" else None
            raise Rejected(
                reason or "no convergence",
                f"{report.outcome} after {report.iterations} Newton iterations at s = "
                f"{self.s(guess):.3g}",
            )
        if fixed is not None:
            z[fixed] = aim[fixed]
        scaled = balanced(matrix[:-1], self.sizes)[0]
        try:
            tangent = np.linalg.solve(
                np.vstack((scaled, self.tangent)), np.append(np.zeros(len(scaled)), 1.0)
            )
        except np.linalg.LinAlgError as error:
            raise Rejected("no convergence", "no tangent: a singular point") from error
        return self.point(z, matrix[:-1], tangent / np.linalg.norm(tangent), report)


@dataclass
class _End:
    """Where a step leads: its last point and, if the path ends there, why."""

    point: Point
    reason: str | None = None


def _advance(step: _Step, length: float, limits: Limits, max_angle: float) -> _End:
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
            return _End(step.origin, "bound")
        # F may not be defined beyond its bound, so that the bound itself is aimed at. A curve that
        # turns back before it is what the plain step is for.
        try:
            landed = step.where(index, value, step.predict(s))
            step.accept(landed, max_angle)
            return _End(landed, "bound")
        except Rejected:
            pass
    return _End(step.at(length, step.predict(length)))


def _bracket(
    step: _Step,
    value: Callable[[Point], float],
    low: Point,
    high: Point,
    *,
    resolution: float,
    give_up: float = 0.0,
) -> tuple[Point, Point]:
    """Return two solutions around a sign change of ``value``, the first nearer to it.

    T. R. Chandrupatla, Advances in Engineering Software 28 (1997) 145-149: inverse quadratic
    interpolation where the three last points allow it, else bisection. A trial that fails in a
    bracket shorter than ``give_up`` ends the search.
    """
    # (s, value, point): b is the newest, a the other side of it, c the one before
    a, b = ((step.s(x.z), value(x), x) for x in (low, high))
    c = a
    fraction = b[1] / (b[1] - a[1]) if b[1] != 0.0 else 0.0
    for _ in range(200):
        width = abs(a[0] - b[0])
        best, other = (b, a) if abs(b[1]) <= abs(a[1]) else (a, b)
        if best[1] == 0.0 or width <= 2.0 * resolution:
            break
        least = resolution / width
        fraction = min(max(fraction, least), 1.0 - least)
        s = b[0] + fraction * (a[0] - b[0])
        try:
            trial = step.between(b[2], a[2], s)
            new = (s, value(trial), trial)
        except Rejected:
            if width <= give_up:
                break
            raise
        if (new[1] > 0.0) == (b[1] > 0.0):
            c = b
        else:
            c, a = a, b
        b = new
        fraction = 0.5
        if c[1] not in (a[1], b[1]):
            xi = (b[0] - a[0]) / (c[0] - a[0])
            phi = (b[1] - a[1]) / (c[1] - a[1])
            if phi**2 < xi and (1.0 - phi) ** 2 < 1.0 - xi:
                along = (c[0] - b[0]) / (a[0] - b[0])
                fraction = b[1] / (b[1] - a[1]) * c[1] / (c[1] - a[1])
                fraction -= along * b[1] / (c[1] - b[1]) * a[1] / (a[1] - c[1])
    return best[2], other[2]


def _test(name: str) -> Callable[[Point], float]:
    def value(point: Point) -> float:
        if name not in point.tests:
            raise Rejected("no convergence", f"the test {name!r} is missing within a step")
        return point.tests[name]

    return value


def _locate(step: _Step, name: str, end: Point) -> SpecialPoint | None:
    """Return the zero of a test between the origin of a step and ``end``, if it changes sign."""
    value = _test(name)
    length = step.s(end.z)
    before, after = step.origin.tests.get(name, 0.0), end.tests.get(name, math.nan)
    if before == 0.0 or math.isnan(after) or before * np.sign(after) > 0.0:
        return None
    singular = name == "branch_point"
    best, other = _bracket(
        step,
        value,
        step.origin,
        end,
        resolution=BRANCH_POINT_RESOLUTION * length if singular else RESOLUTION,
        give_up=SMALL_BRACKET * length,
    )
    jump = abs(best.tests[name] - other.tests[name])
    exact = best if best.tests[name] == 0.0 else other
    low, high = sorted((best.arclength, exact.arclength))
    if singular:
        best = _refined(step, best, near=SMALL_BRACKET * length)
    _, jacobian = step.curve.residual(best.z)
    return SpecialPoint(
        **vars(best),
        kind=step.curve.classify(name, best.z, jacobian),
        test=name,
        value=best.tests[name],
        bracket=(low, high),
        # A continuous test has become as much smaller as its bracket.
        continuous=best.tests[name] == 0.0 or jump < 0.1 * abs(before - after),
    )


def _refined(step: _Step, rough: Point, *, near: float) -> Point:
    """Return the branch point at ``rough``, or that itself if it cannot be made better."""
    refined = refine_branch_point(step.curve.residual, rough.z, step.sizes)
    if refined is None or np.linalg.norm((refined - rough.z) / step.sizes) > near:
        return rough
    value, jacobian = step.curve.residual(refined)
    report = NewtonReport("converged", rough.iterations, float(np.abs(value).max()), ())
    return step.point(refined, jacobian, rough.tangent / step.sizes, report)


def _located(step: _Step, end: Point) -> list[SpecialPoint]:
    """Return the special points between the origin of a step and ``end``, in order."""
    names = sorted(end.tests.keys() & step.origin.tests.keys())
    found = [point for name in names if (point := _locate(step, name, end)) is not None]
    near = AT_BRANCH_POINT * step.s(end.z)
    branching = [point.arclength for point in found if point.test == "branch_point"]
    # dp/ds also changes sign where a branch meets its symmetric one: that is no fold.
    folds = {"fold", *(name for name in names if name.startswith("turning_point"))}
    return sorted(
        (
            point
            for point in found
            if point.test not in folds
            or all(abs(point.arclength - other) > near for other in branching)
        ),
        key=lambda point: point.arclength,
    )


def _leaving(step: _Step, stations: list[Point], limits: Limits) -> Point | None:
    """Return where a step first crosses a bound, if one of its stations lies beyond it."""
    for before, after in zip([step.origin, *stations], stations, strict=False):
        for index, low, high in limits:
            bound = min(max(after.z[index], low), high)
            if after.z[index] == bound:
                continue
            best, _ = _bracket(
                step,
                lambda point, i=index, b=bound: float(point.z[i] - b),  # type: ignore[misc]
                before,
                after,
                resolution=RESOLUTION,
            )
            try:
                return step.where(index, bound, best.z)
            except Rejected:  # a fold on the bound
                return best
    return None


def _closing(step: _Step, end: Point, home: Point) -> Point | None:
    """Return the start of a path again if the step to ``end`` passes through it."""
    sizes = step.sizes
    row = home.tangent / sizes**2

    def ahead(point: Point) -> float:
        return float(row @ (point.z - home.z))

    reach = 2.0 * step.s(end.z)
    near = all(np.linalg.norm((x.z - home.z) / sizes) <= reach for x in (step.origin, end))
    if not near or not ahead(step.origin) < 0.0 <= ahead(end):
        return None
    best, _ = _bracket(step, ahead, step.origin, end, resolution=RESOLUTION)
    if np.linalg.norm((best.z - home.z) / sizes) > SAME_POINT:
        return None
    return replace(home, arclength=best.arclength)


def trace(curve: Curve, start: Point | Path, limits: Limits, settings: Steps) -> Path:
    """Follow a curve from ``start`` along its tangent; see ``follow``."""
    if isinstance(start, Path):
        return start
    points, special = [start], list[SpecialPoint]()
    length = settings.step

    def path(end: str, detail: str = "") -> Path:
        return Path(points=tuple(points), special=tuple(special), end=end, detail=detail)

    try:
        while len(points) < settings.max_points:
            curve.adapt(points[-1].z, curve.residual(points[-1].z)[1])
            step = _Step(curve, points[-1])
            try:
                end = _advance(step, length, limits, settings.max_angle)
                if end.point is step.origin:
                    return path("bound")
                angle = step.accept(end.point, settings.max_angle)
                if len(points) > 1 and (home := _closing(step, end.point, start)) is not None:
                    end = _End(home, "closed")
                found = _located(step, end.point)
                if (edge := _leaving(step, [*found, end.point], limits)) is not None:
                    end = _End(edge, "bound")
                    found = [point for point in found if point.arclength <= edge.arclength]
            except Rejected as cause:
                if length <= settings.min_step:
                    return path(cause.reason, cause.detail)
                length = max(length / 2.0, settings.min_step)
                continue
            for event in found:
                special.append(event)
                if event.kind in settings.stop_at:
                    end = _End(event, f"stopped: {event.test}")
                    break
            points.append(end.point)
            if end.reason is not None:
                return path(end.reason)
            growth = min(2.0, settings.max_angle / 3.0 / max(angle, 1e-12))
            if end.point.iterations > EASY_CORRECTIONS:
                growth = min(growth, 0.7)
            length = min(max(max(growth, 0.5) * length, settings.min_step), settings.max_step)
    except KeyboardInterrupt:
        raise Interrupted(
            f"interrupted after {len(points)} points; .result holds the path so far",
            path("interrupted"),
        ) from None
    return path("points")


def start_point(curve: Curve, z: Array, tangent: Array | None, direction: int) -> Point | Path:
    """Return the solution near z with its oriented tangent, or a path that ends at once.

    Without a tangent the last parameter is kept, if the curve can be parametrised by it.
    """
    sizes = curve.scale(z)

    def failed(report: NewtonReport) -> Path:
        end = "outside domain" if report.outcome == "outside domain" else "no convergence"
        detail = f"start: {report.outcome} after {report.iterations} Newton iterations"
        return Path(points=(), special=(), end=end, detail=detail)

    def fixed(v: Array) -> tuple[Array, Array]:
        value, jacobian = curve.residual(np.append(v, z[-1]))
        return value, jacobian[:, :-1]

    report = None
    if tangent is None:
        v, _, report = newton(fixed, z[:-1], sizes[:-1])
        if report.converged:
            z = np.append(v, z[-1])
        elif report.outcome != "singular":
            return failed(report)
    if report is None or not report.converged:
        z, report = _nearest(curve, z, sizes)
        if not report.converged:
            return failed(report)
    _, jacobian = curve.residual(z)
    if tangent is None:
        tangent = np.linalg.svd(jacobian * sizes)[2][-1] * sizes
        # At a fold the parameter has no direction: the largest other unknown gives one.
        scaled = tangent / sizes
        leading = scaled[-1] if abs(scaled[-1]) > 1e-6 else scaled[np.argmax(np.abs(scaled))]
        tangent *= np.sign(leading)
    scaled = direction * tangent / sizes
    scaled /= np.linalg.norm(scaled)
    n = len(z) - curve.free
    bare = Point(
        u=z[:n],
        p=z[n:],
        tangent=scaled * sizes,
        arclength=0.0,
        tests={},
        residual=report.residual,
        iterations=report.iterations,
    )
    curve.adapt(z, jacobian)
    try:
        return _Step(curve, bare).point(z, jacobian, scaled, report)
    except Rejected as cause:
        return Path(points=(), special=(), end=cause.reason, detail=f"start: {cause.detail}")


def _nearest(curve: Curve, z: Array, sizes: Array) -> tuple[Array, NewtonReport]:
    """Return a solution by the shortest steps (Gauss-Newton), which exist at special points too."""
    steps = list[float]()
    value = np.array([math.nan])
    try:
        for _ in range(MAX_CORRECTIONS):
            value, jacobian = evaluate(curve.residual, z)
            # At a branch point the smallest singular value is rounding, and no direction to go.
            step = -np.linalg.pinv(jacobian * sizes, rcond=SINGULAR) @ value
            steps.append(float(np.abs(step).max()))
            if steps[-1] <= 1e-14 or (len(steps) > 1 and steps[-2] / 2 <= steps[-1] <= NOISE):
                return z, NewtonReport("converged", len(steps), float(np.abs(value).max()), ())
            z = z + step * sizes
    except OutsideDomain:
        return z, NewtonReport("outside domain", len(steps), math.nan, ())
    return z, NewtonReport("no convergence", len(steps), float(np.abs(value).max()), tuple(steps))


@dataclass(frozen=True)
class _Branch:
    """A branch of a problem with one parameter, as a curve."""

    problem: Problem
    parameter_size: float
    named: Classify | None
    free: int = 1

    def residual(self, z: Array) -> tuple[Array, Array]:
        return self.problem.residual(z[:-1], z[-1:])

    def tests(self, z: Array, jacobian: Array, tangent: Array) -> Mapping[str, float]:
        fold = float(tangent[-1]) / self.parameter_size
        return {**self.problem.tests(z[:-1], z[-1:], jacobian), "fold": fold}

    def classify(self, name: str, z: Array, jacobian: Array) -> str:
        if self.named is None:
            return name.split(":")[0]
        return self.named(name, z[:-1], z[-1:], jacobian)

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
    stop_at: Collection[str] = (),
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
        Kinds of special points at which the branch ends.
    classify
        Gives the kind of a located point from (test, u, p, jacobian), where a test has zeros of
        several kinds; default is the test's name up to its colon.

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
    along = None if tangent is None else vector("tangent", tangent)
    if along is not None and (len(along) != len(start) + 1 or not along.any()):
        reject("tangent", tangent, f"a direction of {len(start) + 1} components")
    curve = _Branch(problem, positive("parameter_size", parameter_size), classify)
    settings = Steps.checked(
        step=step,
        min_step=min_step,
        max_step=max_step,
        max_points=max_points,
        max_angle=max_angle,
        stop_at=stop_at,
    )
    return trace(
        curve,
        start_point(curve, np.append(start, parameter), along, direction),
        [(len(start), low, high)],
        settings,
    )


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
    other = other_direction(curve.residual, point.z, point.tangent, curve.scale(point.z))
    if other is None:
        reject("point", float(point.p[0]), "the parameter of a simple branch point")
    return other
