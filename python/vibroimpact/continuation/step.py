"""One step along a curve: the solutions ahead of a point, and where a function of them vanishes.

From z0 with unit tangent t the solution at the pseudo-arclength s solves F(z) = 0 and
t . (z - z0)/w = s, w the sizes of the unknowns; its tangent t' solves J t' = 0, t . t' > 0. See
``follow``.
"""

import math
from collections.abc import Callable, Collection

import numpy as np

from .names import OwnTest, PathEnd
from .newton import Array, NewtonReport, OutsideDomain, balanced, newton
from .path import Curve, Point

# Corrector: a step that needs more Newton iterations than this is too long.
MAX_CORRECTIONS = 12
# Width at which the bracketing of a point ends, in units of the sizes: rounding of z.
RESOLUTION = 4.0 * np.finfo(float).eps
# Cap on the trials of a bracketing: more than bisection from the longest step takes.
_MAX_TRIALS = 200
# The end of a step may differ from the prediction of the tangents by this part of the allowed
# angle.
_MISFIT = 0.1
# A solution between two points is on their curve if it is this near to the interpolated one, as
# part of their distance.
_BESIDE = 0.1
# Two points nearer than this, in units of the sizes, are the same.
SAME_POINT = 1e-8


class Rejected(Exception):
    """A step or trial failed; has the reason for the end if the step cannot be made shorter."""

    def __init__(self, reason: PathEnd, detail: str) -> None:
        super().__init__(detail)
        self.reason = reason
        self.detail = detail


class Step:
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

    def interpolated(
        self, ends: tuple[float, float], first: Point, second: Point, s: float
    ) -> Array:
        """Return about where the curve between two of its points at ``ends`` is at s.

        It is the cubic in s with both points and their tangents (Hermite).
        """
        width = ends[1] - ends[0]
        x = (s - ends[0]) / width
        slopes = [
            width * point.tangent / float(self.tangent @ (point.tangent / self.sizes))
            for point in (first, second)
        ]
        guess: Array = (
            (1.0 + 2.0 * x) * (1.0 - x) ** 2 * first.z
            + x * (1.0 - x) ** 2 * slopes[0]
            + x**2 * (3.0 - 2.0 * x) * second.z
            + x**2 * (x - 1.0) * slopes[1]
        )
        return guess

    def between(self, ends: tuple[float, float], first: Point, second: Point, s: float) -> Point:
        """Return the solution at s between two at ``ends``.

        Near a branch point the other branch is a solution, too: the better the guess, the nearer
        to it the location can go, and a point that is far from it is not taken.
        """
        guess = self.interpolated(ends, first, second, s)
        found = self.at(s, guess)
        if not self.beside(found.z, guess, ends):
            raise Rejected(PathEnd.NO_CONVERGENCE, f"two solutions at s = {s:.3g}")
        return found

    def beside(self, z: Array, guess: Array, ends: tuple[float, float]) -> bool:
        """Whether z is near a guess from two points at ``ends``, for their distance."""
        away = float(np.linalg.norm((z - guess) / self.sizes))
        return away <= _BESIDE * abs(ends[1] - ends[0]) + SAME_POINT

    def where(self, index: int, value: float, guess: Array) -> Point:
        """Return the solution with z[index] = value, exactly."""
        aim = guess.copy()
        aim[index] = value
        row = np.zeros(len(aim))
        row[index] = 1.0 / self.sizes[index]
        return self._correct(row, aim, aim, fixed=index)

    def accept(self, point: Point, max_angle: float) -> float:
        """Return the angle between the tangents; reject a point that is not the next one.

        On a smooth curve the trapezoidal rule predicts the end of a step from the tangents at both
        ends. If a point is far from the prediction, it is on another curve, or the step is too
        long.
        """
        tangent = point.tangent / self.sizes
        cosine = float(self.tangent @ tangent) / float(np.linalg.norm(tangent))
        angle = math.acos(min(1.0, max(-1.0, cosine)))
        s = self.s(point.z)
        slope = tangent / float(self.tangent @ tangent)
        mean = (self.tangent + slope) / 2.0
        off = float(np.linalg.norm((point.z - self.origin.z) / self.sizes - s * mean))
        if s <= 0.0 or angle > max_angle or off > _MISFIT * max_angle * s + SAME_POINT:
            raise Rejected(
                PathEnd.NO_CONVERGENCE,
                f"the curve turns by {angle:.2g} rad and leaves its tangents by {off:.2g} "
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
            raise Rejected(PathEnd.OUTSIDE_DOMAIN, str(error)) from error
        tests = {name: float(value) for name, value in given.items() if math.isfinite(value)}
        # Rows are not balanced here: one of them may vanish at a branch point.
        square = np.vstack((jacobian * self.sizes, tangent))
        sign = float(np.linalg.slogdet(square)[0])
        tests[OwnTest.BRANCH_POINT] = sign * float(np.linalg.svd(square, compute_uv=False)[-1])
        n = len(z) - self.curve.free
        return Point(
            u=z[:n],
            p=z[n:],
            tangent=real,
            jacobian=jacobian,
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
            outside = report.outcome == "outside domain"
            raise Rejected(
                PathEnd.OUTSIDE_DOMAIN if outside else PathEnd.NO_CONVERGENCE,
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
            raise Rejected(PathEnd.NO_CONVERGENCE, "no tangent: a singular point") from error
        return self.point(z, matrix[:-1], tangent / np.linalg.norm(tangent), report)


def bracket(
    step: Step,
    value: Callable[[Point], float],
    low: Point,
    high: Point,
    *,
    resolution: float,
    give_up: float = 0.0,
    crossings: Collection[float] = (),
) -> tuple[Point, Point]:
    """Return two solutions around a sign change of ``value``, the first nearer to it.

    T. R. Chandrupatla, Advances in Engineering Software 28 (1997) 145-149: inverse quadratic
    interpolation where the three last points allow it, else bisection. A trial that fails in a
    bracket shorter than ``give_up``, or at such a distance from one of ``crossings``, ends the
    search: these are the arclengths of branch points, near which the solution is not unique.
    """
    # (s, value, point): b is the newest, a the other side of it, c the one before
    a, b = ((step.s(x.z), value(x), x) for x in (low, high))
    # A zero counts as negative, so that the search goes on to its other side.
    if a[1] == 0.0 or (a[1] < 0.0 and b[1] == 0.0):
        return (low, high) if a[1] == 0.0 else (high, low)
    c = a
    fraction = b[1] / (b[1] - a[1])
    for _ in range(_MAX_TRIALS):
        width = abs(a[0] - b[0])
        if width <= 2.0 * resolution:
            break
        least = resolution / width
        fraction = min(max(fraction, least), 1.0 - least)
        s = b[0] + fraction * (a[0] - b[0])
        try:
            trial = step.between((b[0], a[0]), b[2], a[2], s)
            new = (s, value(trial), trial)
        except Rejected:
            if min([width, *(abs(s - crossing) for crossing in crossings)]) <= give_up:
                break
            raise
        if (new[1] > 0.0) == (b[1] > 0.0):
            c = b
        else:
            c, a = a, b
        b = new
        # Next to a zero, unless it goes on: a test may be zero all along one side of its border.
        fraction = 0.0 if b[1] == 0.0 != c[1] else 0.5
        if b[1] != 0.0 and c[1] not in (a[1], b[1]):
            xi = (b[0] - a[0]) / (c[0] - a[0])
            phi = (b[1] - a[1]) / (c[1] - a[1])
            if phi**2 < xi and (1.0 - phi) ** 2 < 1.0 - xi:
                along = (c[0] - b[0]) / (a[0] - b[0])
                fraction = b[1] / (b[1] - a[1]) * c[1] / (c[1] - a[1])
                fraction -= along * b[1] / (c[1] - b[1]) * a[1] / (a[1] - c[1])
    best, other = sorted((a, b), key=lambda end: abs(end[1]))
    return best[2], other[2]
