"""Newton's method for zeros of F(u, p), with a typed outcome and a record of its steps.

A step d solves J d = -F. It is measured as max |d_i / size_i|, with sizes that the problem gives,
so that the outcome depends on the units neither of unknowns nor of equations. Far from a zero a
step is shortened until the next simplified step is smaller (the natural monotonicity test:
P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2004, section 3.3). Near a zero steps
shrink until rounding stops them; that is where the iteration ends.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import count, positive, vector
from ..errors import ParameterError

Array = NDArray[np.float64]
Outcome = Literal["converged", "singular", "no convergence", "outside domain"]

# Steps below this that no longer shrink are rounding. A zero so ill-conditioned that rounding alone
# moves it by more is reported as not found.
NOISE = 1e-9
# A matrix whose smallest singular value is below this, where rows have entries of order 1, makes
# Newton's steps halve at best.
SINGULAR = 1e-6
# The shortest fraction of a step that is tried.
_LEAST_DAMPING = 2.0**-12


class OutsideDomain(ArithmeticError):
    """F is not defined at the point asked for; raised by ``Problem.residual`` and ``tests``."""


class Problem(Protocol):
    """n equations F(u, p) = 0 in n unknowns u and k free parameters p."""

    def residual(self, u: Array, p: Array) -> tuple[Array, Array]:
        """Return F of shape (n,) and its exact Jacobian to u and p, of shape (n, n + k).

        In units of ``scale`` the Jacobian has entries of order 1, by which a branch point is known.
        """

    def tests(self, u: Array, p: Array, jacobian: Array) -> Mapping[Any, float]:
        """Return smooth test functions by name: anything hashable that tells them apart.

        Their zeros are the special points, positive values the admissible side where there is one.
        A test that is missing or not finite at a point is not compared there.
        """

    def scale(self, u: Array) -> Array:
        """Return the sizes of the unknowns at u, of shape (n,), all > 0."""


@dataclass(frozen=True)
class NewtonReport:
    """How an iteration ended.

    Attributes
    ----------
    outcome
        ``converged``; ``singular``: the Jacobian is; ``no convergence``; ``outside domain``: F is
        not defined at the start, or along the steps however short.
    iterations
        Evaluations of F that led on.
    residual
        max |F_i| before the last step.
    steps
        Sizes of Newton's steps before damping, in units of the scale; the last one is rounding,
        and estimates the error of the result.
    """

    outcome: Outcome
    iterations: int
    residual: float
    steps: tuple[float, ...]

    @property
    def converged(self) -> bool:
        """Whether the result is a zero of F to rounding."""
        return self.outcome == "converged"

    @property
    def error(self) -> float:
        """Estimated error of the result, in units of the scale."""
        return self.steps[-1] if self.steps else math.inf

    @property
    def order(self) -> float:
        """Observed order of convergence over the last three steps above rounding.

        About 2 with an exact Jacobian at a simple zero, 1 otherwise; NaN with too few steps.
        """
        sizes = [size for size in self.steps if 1e-13 < size < 0.1]
        if len(sizes) < 3 or not sizes[-3] > sizes[-2] > sizes[-1]:
            return math.nan
        return math.log(sizes[-1] / sizes[-2]) / math.log(sizes[-2] / sizes[-3])


def evaluate(function: Callable[[Array], tuple[Array, Array]], z: Array) -> tuple[Array, Array]:
    """Return F and J at z; raise OutsideDomain if they are not finite."""
    with np.errstate(all="ignore"):
        value, matrix = function(z)
    if not (np.isfinite(value).all() and np.isfinite(matrix).all()):
        raise OutsideDomain("the residual or its Jacobian is not finite")
    return value, matrix


def balanced(jacobian: Array, sizes: Array) -> tuple[Array, Array]:
    """Return J in units of ``sizes`` with rows of largest entry 1, and the factors of the rows."""
    scaled = jacobian * sizes
    largest = np.abs(scaled).max(axis=1)
    rows = 1.0 / np.where(largest > 0.0, largest, 1.0)
    return scaled * rows[:, None], rows


def newton(
    function: Callable[[Array], tuple[Array, Array]],
    start: Array,
    sizes: Array,
    *,
    rtol: float = 1e-14,
    max_iterations: int = 50,
    damped: bool = True,
) -> tuple[Array, Array, NewtonReport]:
    """Find a zero of F: R^N -> R^N from ``start``.

    Parameters
    ----------
    function
        Gives F of shape (N,) and its Jacobian of shape (N, N).
    sizes
        Sizes of the unknowns, of shape (N,).
    rtol, max_iterations, damped
        Size of a step at which to stop, cap on the iterations, and whether to shorten steps.

    Returns
    -------
    z, jacobian, report
        The last point, the Jacobian there or a rounding away (NaN if F is not defined at the
        start), the report.
    """
    z, steps = start, list[float]()
    try:
        value, matrix = evaluate(function, z)
    except OutsideDomain:
        nothing = np.full((len(z), len(z)), np.nan)
        return z, nothing, NewtonReport("outside domain", 0, math.nan, ())

    def result(outcome: Outcome) -> tuple[Array, Array, NewtonReport]:
        # At a multiple root steps shrink by a constant factor, until by luck F is exactly zero.
        last = steps[-4:-1]
        slow = len(last) == 3 and last[2] > 0.1 * last[1] > 0.01 * last[0]
        if (slow or outcome != "converged") and np.linalg.svd(scaled)[1][-1] < SINGULAR:
            outcome = "singular"
        report = NewtonReport(outcome, len(steps), float(np.abs(value).max()), tuple(steps))
        return z, matrix, report

    # The rows stay balanced as at the start, so that a matrix that vanishes is seen.
    rows = balanced(matrix, sizes)[1]
    for _ in range(max_iterations):
        scaled = matrix * sizes * rows[:, None]
        try:
            step = np.linalg.solve(scaled, -value * rows)
        except np.linalg.LinAlgError:
            return result("singular")
        size = float(np.abs(step).max())
        if not math.isfinite(size):
            return result("singular")
        stalled = bool(steps) and steps[-1] / 2.0 <= size <= NOISE and steps[-1] <= NOISE
        steps.append(size)
        if size <= rtol or stalled:
            z = z + step * sizes
            return result("converged")
        factor = 1.0
        while True:
            outside = False
            try:
                trial = z + factor * step * sizes
                next_value, next_matrix = evaluate(function, trial)
                if not damped or size <= NOISE:
                    break
                simplified = np.linalg.solve(scaled, -next_value * rows)
                if np.abs(simplified).max() <= (1.0 - factor / 2.0) * size:
                    break
            except OutsideDomain:
                outside = True
            factor /= 2.0
            if not damped or factor < _LEAST_DAMPING:
                return result("outside domain" if outside else "no convergence")
        z, value, matrix = trial, next_value, next_matrix
    return result("no convergence")


def sizes_of(problem: Problem, u: Array) -> Array:
    """Return ``problem.scale(u)``, checked."""
    sizes = np.asarray(problem.scale(u), dtype=np.float64)
    if sizes.shape != u.shape or not (np.isfinite(sizes).all() and (sizes > 0.0).all()):
        raise ParameterError(f"scale = {sizes} is not allowed; allowed: {len(u)} numbers > 0")
    return sizes


def solve(
    problem: Problem, u: ArrayLike, p: ArrayLike, *, rtol: float = 1e-14, max_iterations: int = 50
) -> tuple[Array, NewtonReport]:
    """Solve F(u, p) = 0 for u at fixed p by damped Newton iteration.

    Parameters
    ----------
    problem
        The equations.
    u
        Where to start, of shape (n,).
    p
        The parameters, a number or of shape (k,).
    rtol
        The iteration ends at a step of this size in units of ``problem.scale``, or earlier where
        steps below 1e-9 stop shrinking, which is rounding.
    max_iterations
        Cap on the iterations.

    Returns
    -------
    u, report
        The last point, of shape (n,), and a NewtonReport; only ``report.converged`` says that it is
        a solution. At a multiple root the outcome is ``singular``.

    Raises
    ------
    ParameterError
        If an argument is not finite, of the wrong shape or out of range.
    """
    start, fixed = vector("u", u), vector("p", parameters_of(p))
    rtol = positive("rtol", rtol)
    max_iterations = count("max_iterations", max_iterations, least=1)
    n = len(start)

    def function(v: Array) -> tuple[Array, Array]:
        value, jacobian = problem.residual(v, fixed)
        return value, jacobian[:, :n]

    found, _, report = newton(
        function, start, sizes_of(problem, start), rtol=rtol, max_iterations=max_iterations
    )
    return found, report


def parameters_of(p: Any) -> Any:
    """Return one parameter as a sequence of one."""
    return [p] if np.ndim(p) == 0 else p
