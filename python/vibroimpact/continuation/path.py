"""The types of continuation: curves, their points, special points, paths."""

from collections.abc import Callable, Collection, Hashable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from .names import PathEnd
from .newton import Array

# (index in z, low, high) of every bounded unknown.
Limits = list[tuple[int, float, float]]


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
    jacobian
        Jacobian to u and p, of shape (n, n + k); on a curve a last row has the test's gradient.
    tests
        Values of the test functions, by name.
    residual, iterations
        max |F_i|, and Newton iterations spent.
    """

    u: Array
    p: Array
    tangent: Array
    jacobian: Array
    arclength: float
    tests: dict[Any, float]
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
        What it is: ``fold``, ``branch_point``, ``cusp``, ``turning_point``, or what the problem
        calls it.
    test, value
        The test function and its remaining value here.
    bracket
        The arclengths between which it changes sign.
    continuous
        False where the test jumps across zero, or passes infinity.
    other
        At a simple branch point the direction of the other branch, as ``tangent``; elsewhere None.
    """

    kind: str
    test: Any
    value: float
    bracket: tuple[float, float]
    continuous: bool
    other: Array | None = None


# Where a path ends: at special points of these kinds, or where a function of one says so.
StopAt = Collection[str] | Callable[[SpecialPoint], bool]


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
        Why it ends.
    detail
        If the path ends because the shortest step failed: how it failed.
    """

    points: tuple[Point, ...]
    special: tuple[SpecialPoint, ...]
    end: PathEnd
    detail: str = ""

    @property
    def stop(self) -> SpecialPoint | None:
        """The special point at which it ended because that was asked for."""
        return self.special[-1] if self.end is PathEnd.STOPPED else None

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


def path_so_far(interruption: KeyboardInterrupt) -> Path:
    """Return the path that Ctrl-C has cut short; without points if it came before the first."""
    path = getattr(interruption, "result", None)
    return path if isinstance(path, Path) else Path(points=(), special=(), end=PathEnd.INTERRUPTED)


class Curve(Protocol):
    """N equations F(z) = 0 in N + 1 unknowns z, the last ``free`` of which are parameters."""

    @property
    def free(self) -> int:
        """Number k of parameters."""

    def residual(self, z: Array) -> tuple[Array, Array]:
        """Return F of shape (N,) and its Jacobian of shape (N, N + 1)."""

    def tests(self, z: Array, jacobian: Array, tangent: Array) -> Mapping[Any, float]:
        """Return the test functions at a solution."""

    def classify(self, test: Hashable, z: Array, jacobian: Array) -> str:
        """Return the kind of a zero of one of the problem's own tests."""

    def scale(self, z: Array) -> Array:
        """Return the sizes of z, of shape (N + 1,)."""

    def adapt(self, z: Array, jacobian: Array) -> None:
        """Use a new accepted point, for example to update vectors."""
