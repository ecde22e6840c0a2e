"""Curves of codimension-1 points in two parameters: zeros of (F(u, p1, p2), g(u, p1, p2)).

They are followed as in ``follow``, in the unknowns (u, p1, p2). The defining function g is

- for a fold, and for each matrix A that the problem names in ``singular_matrices`` (M + I for a
  period doubling, I - M (.) M for a Neimark-Sacker point), the solution g of the bordered system

      ( A    b ) (v)   (0)
      ( c^T  0 ) (g) = (1),

  which vanishes where A is singular and, other than det A, is well scaled (minimally augmented
  system: W. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria, SIAM 2000,
  chapter 3); b and c are the singular vectors of A at the last point;
- else the test function of the problem, such as that of a grazing.

The gradient of g is taken by central differences. For a fold they are those of F_z along v: with w
from the transposed system dg = -w^T dA v, and the change of F_u v by z is that of F_z along v. The
gradient only enters Newton's matrix and the tangent: the points are zeros of g itself, to rounding.
At a turning point the extreme parameter is good to rounding, the other one, on which it depends
linearly, to about 1e-9.

Codimension-2 points are zeros of the other tests of the problem. On a curve of folds there is also
``cusp``: with w the left null vector of F_u the curve's normal in the parameter plane is w^T F_p,
and its tangent there, dp/ds, turns against it, changing sign. Degenerate period doublings and
Neimark-Sacker points, which take third derivatives, are not looked for.
"""

import math
from collections.abc import Collection, Hashable, Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import positive, reject, vector
from ..errors import ParameterError
from .branching import DIFFERENCE
from .follow import Classify, checked_bounds, checked_direction, checked_tangent
from .names import TURNING_POINTS, OwnTest, PathEnd
from .newton import Array, OutsideDomain, Problem, evaluate, newton, sizes_of
from .path import Path
from .tracing import Steps, start_point, trace


@runtime_checkable
class HasMatrices(Protocol):
    """A problem some of whose special points are those where a square matrix is singular."""

    def singular_matrices(self, u: Array, p: Array, jacobian: Array) -> Mapping[Any, Array]:
        """Return the matrices, by the name of their test."""


@runtime_checkable
class HasSeveralMatrices(Protocol):
    """A problem that gives the matrices of several points at once."""

    def several_matrices(self, test: Hashable, us: Array, ps: Array) -> Array | None:
        """Return the matrices of a test, one for each row of us and ps; None if it has none.

        Raises
        ------
        OutsideDomain
            If there is none at one of the points.
        """


@runtime_checkable
class HasSingleTests(Protocol):
    """A problem that gives one test by itself, and says on which unknowns it depends.

    Its matrices are known without the Jacobian.
    """

    def single_test(self, test: Hashable, u: Array, p: Array) -> float | None:
        """Return the test, NaN if it is missing here, or None if it needs ``tests``."""

    def unknowns_of(self, test: Hashable, count: int) -> Sequence[int]:
        """Return the indices, below ``count``, of the unknowns that it may depend on."""


class _Critical:
    """The zeros of (F, g) as a curve in z = (u, p1, p2)."""

    free = 2

    def __init__(
        self,
        problem: Problem,
        test: Hashable,
        z: Array,
        parameter_sizes: Array,
        ignored: frozenset[Hashable],
        named: Classify | None,
    ) -> None:
        self.problem, self.test, self.named = problem, test, named
        self.parameter_sizes, self.ignored = parameter_sizes, ignored | {test}
        self.n = len(z) - 2
        # Evaluated once: isinstance is slow for a protocol.
        self.local = problem if isinstance(problem, HasSingleTests) else None
        self.matrices = problem if isinstance(problem, HasMatrices) else None
        self.several = problem if isinstance(problem, HasSeveralMatrices) else None
        self.sizes = self.scale(z)
        self.border: tuple[Array, Array] | None = None
        _, jacobian = evaluate(self._equations, z)
        if self._matrix(z, jacobian) is not None:
            self.adapt(z, jacobian)
            if self.border is None:
                raise OutsideDomain(f"the matrix of {test!r} is not finite")
        elif test not in problem.tests(z[:-2], z[-2:], jacobian):
            reject("test", test, "'fold', or the name of a test that the problem has at the start")

    def _equations(self, z: Array) -> tuple[Array, Array]:
        return self.problem.residual(z[:-2], z[-2:])

    def _matrix(self, z: Array, jacobian: Array) -> Array | None:
        """Return the matrix that is singular on the curve, if it is defined by one."""
        if self.test == OwnTest.FOLD:
            return jacobian[: self.n, : self.n] * self.sizes[: self.n]
        if self.matrices is not None:
            matrices = self.matrices.singular_matrices(z[:-2], z[-2:], jacobian[: self.n])
            return matrices.get(self.test)
        return None

    def _bordered(self, z: Array, jacobian: Array, *, left: bool = False) -> Array:
        """Return (v, g), or from the transposed system (w, g)."""
        matrix = self._matrix(z, jacobian)
        if matrix is None or self.border is None or not np.isfinite(matrix).all():
            raise OutsideDomain(f"there is no matrix of {self.test!r} here")
        b, c = self.border
        n = len(b)
        system, one = np.zeros((n + 1, n + 1)), np.zeros(n + 1)
        system[:n, :n], system[:n, n], system[n, :n], one[n] = matrix, b, c, 1.0
        try:
            return np.asarray(np.linalg.solve(system.T if left else system, one), np.float64)
        except np.linalg.LinAlgError:
            raise OutsideDomain(f"the matrix of {self.test!r} is singular twice") from None

    def defining(self, z: Array) -> float:
        """Return g."""
        alone = self._alone(z)
        if alone is not None:
            return self._checked(alone)
        if self.test != OwnTest.FOLD and self.local is not None:
            return self._defining_at(z, np.empty((self.n, 0)))
        return self._defining_at(z, evaluate(self._equations, z)[1])

    def _alone(self, z: Array) -> float | None:
        """Return the test without the others and without the Jacobian, if the problem can."""
        if self.border is not None or self.local is None:
            return None
        with np.errstate(all="ignore"):
            return self.local.single_test(self.test, z[:-2], z[-2:])

    def _defining_at(self, z: Array, jacobian: Array) -> float:
        if self.border is not None:
            return float(self._bordered(z, jacobian)[-1])
        value = self._alone(z)
        if value is None:
            value = self.problem.tests(z[:-2], z[-2:], jacobian).get(self.test, math.nan)
        return self._checked(value)

    def _checked(self, value: float) -> float:
        if not math.isfinite(value):
            raise OutsideDomain(f"the test {self.test!r} is missing")
        return float(value)

    def residual(self, z: Array) -> tuple[Array, Array]:
        value, jacobian = evaluate(self._equations, z)
        if self.border is not None:
            solved = self._bordered(z, jacobian)
            g, v = float(solved[-1]), solved[:-1]
            fold = self.test == OwnTest.FOLD
            row = self._slopes_of_fold(z, jacobian, v) if fold else self._slopes_of_matrix(z, g)
        else:
            g, row = self._defining_at(z, jacobian), np.zeros(len(z))
            for j in self._unknowns():
                row[j] = self._slope(z, g, j)
        return np.append(value, g), np.vstack((jacobian, row))

    def _slopes_of_matrix(self, z: Array, g: float) -> Array:
        """Return dg/dz: central, or one-sided where one side is outside the domain.

        The change of g is smaller than those of A, which may be large, and so is its error.
        """
        change, width = np.zeros(len(z)), np.zeros(len(z))
        for sign in (1.0, -1.0):
            points = z + np.diag(sign * DIFFERENCE * self.sizes)
            there = self._bordered_values(self._matrices(points))
            known = np.isfinite(there)
            change[known] += sign * (there[known] - g)
            width[known] += np.abs(points.diagonal() - z)[known]
        if not width.all():
            raise OutsideDomain(f"the matrix of {self.test!r} exists at a single point")
        slopes: Array = change / width
        return slopes

    def _bordered_values(self, matrices: Array) -> Array:
        """Return g of several matrices, NaN where one is not finite."""
        assert self.border is not None
        b, c = self.border
        n = len(b)
        values = np.full(len(matrices), math.nan)
        known = np.isfinite(matrices).all(axis=(1, 2))
        if matrices.shape[1:] != (n, n) or not known.any():
            return values
        systems = np.zeros((int(known.sum()), n + 1, n + 1))
        systems[:, :n, :n], systems[:, :n, n], systems[:, n, :n] = matrices[known], b, c
        one = np.zeros((n + 1, 1))
        one[n] = 1.0
        try:
            values[known] = np.linalg.solve(systems, one)[:, n, 0]
        except np.linalg.LinAlgError:
            raise OutsideDomain(f"the matrix of {self.test!r} is singular twice") from None
        return values

    def _slopes_of_fold(self, z: Array, jacobian: Array, v: Array) -> Array:
        """Return dg/dz where A = F_u: the change of F_u v by z is that of F_z along v."""
        w = self._bordered(z, jacobian, left=True)[:-1]
        along = np.append(v * self.sizes[: self.n], np.zeros(2))
        ends = list[tuple[float, Array]]()
        for sign in (1.0, -1.0):
            try:
                there = evaluate(self._equations, z + sign * DIFFERENCE * along)[1]
                ends.append((sign * DIFFERENCE, there))
            except OutsideDomain:
                ends.append((0.0, jacobian))
        (first, ahead), (second, behind) = ends
        if first == second:
            raise OutsideDomain("there is a solution at a single point")
        slopes: Array = -(w @ (ahead - behind)) / (first - second)
        return slopes

    def _matrices(self, points: Array) -> Array:
        """Return the matrices at several points, NaN where there is none."""
        if self.several is not None:
            try:
                found = self.several.several_matrices(self.test, points[:, :-2], points[:, -2:])
            except OutsideDomain:
                found = None  # not at all of them
            if found is not None:
                return found
        matrices = [self._matrix_at(point) for point in points]
        missing = np.full(next((m.shape for m in matrices if m is not None), (1, 1)), math.nan)
        return np.array([missing if matrix is None else matrix for matrix in matrices])

    def _matrix_at(self, z: Array) -> Array | None:
        without = self.local is not None
        try:
            jacobian = np.empty((self.n, 0)) if without else evaluate(self._equations, z)[1]
            return self._matrix(z, jacobian)
        except OutsideDomain:
            return None

    def _unknowns(self) -> Sequence[int]:
        """Return the indices of the unknowns on which g depends."""
        if self.local is None:
            return range(self.n + 2)
        return [*self.local.unknowns_of(self.test, self.n), self.n, self.n + 1]

    def _slope(self, z: Array, g: float, j: int) -> float:
        """Return dg/dz_j: central, or one-sided where one side is outside the domain."""
        ends = []
        for sign in (1.0, -1.0):
            shifted = z.copy()
            shifted[j] += sign * DIFFERENCE * self.sizes[j]
            try:
                ends.append((shifted[j], self.defining(shifted)))
            except OutsideDomain:
                ends.append((z[j], g))
        if ends[0][0] == ends[1][0]:
            raise OutsideDomain(f"the test {self.test!r} exists at a single point")
        return float((ends[0][1] - ends[1][1]) / (ends[0][0] - ends[1][0]))

    def tests(self, z: Array, jacobian: Array, tangent: Array) -> Mapping[Any, float]:
        equations = jacobian[: self.n]
        given = self.problem.tests(z[:-2], z[-2:], equations)
        tests = {name: value for name, value in given.items() if name not in self.ignored}
        turn = tangent[-2:] / self.parameter_sizes
        tests |= dict(zip(TURNING_POINTS, turn.tolist(), strict=True))
        if self.test == OwnTest.FOLD:
            w = self._bordered(z, equations, left=True)[:-1]
            normal = w @ equations[:, -2:] * self.parameter_sizes
            normal /= np.linalg.norm(normal)
            tests[OwnTest.CUSP] = float(normal[0] * turn[1] - normal[1] * turn[0])
        return tests

    def classify(self, test: Hashable, z: Array, jacobian: Array) -> str:
        if self.named is None:
            return str(test)
        return self.named(test, z[:-2], z[-2:], jacobian[: self.n])

    def scale(self, z: Array) -> Array:
        return np.concatenate((sizes_of(self.problem, z[:-2]), self.parameter_sizes))

    def adapt(self, z: Array, jacobian: Array) -> None:
        self.sizes = self.scale(z)
        matrix = self._matrix(z, jacobian)
        if matrix is None or not np.isfinite(matrix).all():
            return
        left, _, right = np.linalg.svd(matrix)
        b, c = left[:, -1], right[-1]
        if self.border is not None:
            # g must not change its sign from one point to the next.
            b, c = (new * np.sign(new @ old) for new, old in zip((b, c), self.border, strict=True))
        self.border = b, c


def follow_curve(
    problem: Problem,
    u: ArrayLike,
    p: ArrayLike,
    test: Hashable,
    *,
    bounds: tuple[tuple[float, float], tuple[float, float]],
    direction: int = 1,
    tangent: ArrayLike | None = None,
    parameter_sizes: tuple[float, float] = (1.0, 1.0),
    step: float = 0.01,
    min_step: float = 1e-6,
    max_step: float = 0.1,
    max_points: int = 1000,
    max_angle: float = 0.3,
    stop_at: Collection[str] = (),
    first: Collection[str] = (),
    ignore: Collection[Hashable] = (),
    classify: Classify | None = None,
) -> Path:
    """Follow a curve of special points of F(u, p) = 0 in two parameters.

    Parameters
    ----------
    problem
        The equations, with k = 2. Its tests are called near solutions as well as at them.
    u, p
        Where to start, near a special point: u of shape (n,), p of shape (2,).
    test
        The test that vanishes along the curve, ``fold`` for a saddle-node.
    bounds
        Least and largest value of each parameter; the curve ends exactly there.
    direction
        1 to start with p[1] growing, -1 falling; with ``tangent`` along or against it.
    tangent
        Direction of shape (n + 2,) to start in.
    parameter_sizes
        Sizes of the parameters beside ``problem.scale``, for norms, steps and differences.
    step, min_step, max_step, max_points, max_angle, stop_at, first, classify
        As in ``follow``.
    ignore
        Names of other tests that vanish along the whole curve, such as det(I - M) on one of folds.

    Returns
    -------
    Path
        Points with p of shape (2,), codimension-2 points and the reason of the end. Where a
        parameter has an extremum there is a ``turning_point``.

    Raises
    ------
    ParameterError
        If an argument is not finite, of the wrong shape or out of range, or the test is unknown.
    Interrupted
        After Ctrl-C; ``.result`` is the path so far, with the end ``interrupted``.
    """
    start, parameters = vector("u", u), vector("p", p)
    if len(parameters) != 2:
        raise ParameterError(f"p of shape {parameters.shape} is not allowed; allowed: two numbers")
    if np.shape(bounds) != (2, 2):
        reject("bounds", bounds, "((low, high), (low, high))")
    limits = [
        (len(start) + i, *checked_bounds(f"bounds[{i}]", bounds[i], float(parameters[i])))
        for i in range(2)
    ]
    direction = checked_direction(direction)
    along = checked_tangent(tangent, len(start) + 2)
    settings = Steps.checked(
        step=step,
        min_step=min_step,
        max_step=max_step,
        max_points=max_points,
        max_angle=max_angle,
        stop_at=stop_at,
        first=first,
    )
    if isinstance(ignore, str):
        reject("ignore", ignore, "a collection of names of tests")
    sizes = np.array([positive("parameter_sizes", size) for size in parameter_sizes])
    z = np.concatenate((start, parameters))
    try:
        curve = _Critical(problem, test, z, sizes, frozenset(ignore), classify)
    except OutsideDomain as error:
        return Path(points=(), special=(), end=PathEnd.OUTSIDE_DOMAIN, detail=f"start: {error}")
    return trace(curve, start_point(curve, z, along, direction, limits), limits, settings)


def curve_point(
    problem: Problem, u: Array, p: Array, test: Hashable, index: int
) -> tuple[Array, Array, float] | None:
    """Return the point of a curve near (u, p) at which p[index] is what it is there.

    The second value is the remaining value of the defining function. None if Newton's method does
    not find the point.
    """
    z, kept = np.concatenate((u, p)), len(u) + index
    try:
        curve = _Critical(problem, test, z, np.ones(2), frozenset(), None)
    except OutsideDomain:
        return None

    def fixed(v: Array) -> tuple[Array, Array]:
        value, jacobian = curve.residual(np.insert(v, kept, z[kept]))
        return value, np.delete(jacobian, kept, axis=1)

    v, _, report = newton(fixed, np.delete(z, kept), np.delete(curve.sizes, kept))
    if not report.converged:
        return None
    z = np.insert(v, kept, z[kept])
    return z[:-2], z[-2:], curve.defining(z)
