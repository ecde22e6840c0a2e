"""Solutions where the linear conditions (31) are singular: x1 is fixed, the drive phase is not yet.

This happens for a wall at rest, for a body without drive that makes half turns, and where
kappa = 0. The unknowns z = (V, W, P, cos psi, sin psi) of `algebraic` then lie on a line
z = base + t along, which the circle cos^2 + sin^2 = 1 cuts twice, or not at all. Intervals enclose
the line over the whole box of x1, and thus every solution in it; that a cut is one solution and no
more is proved by Krawczyk's operator on all six equations (R. E. Moore, R. B. Kearfott, M. J.
Cloud, Introduction to Interval Analysis, SIAM 2009, section 8.2).
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .algebraic import Conditions
from .intervals import EPS, Interval, join, matmul

Array = NDArray[np.float64]
Function = Callable[[Interval], Interval]

# Ratio of extreme singular values below which (31) leaves the phase open, and above which the
# other four conditions count as independent.
_OPEN = 1e-8
_INDEPENDENT = 1e-6
_NEWTON_STEPS = 30
# Zero, rounded outwards a few times.
_TINY = 1e-300
# The number of the first system, as the enclosures take it.
FIRST = np.zeros(1, dtype=np.int64)


def is_finite(equations: Conditions, box: Interval) -> bool:
    """Whether the conditions at all x1 of a box of shape (1,) have floats for numbers."""
    matrix, rhs = _scaled(equations, box, units_of(equations))
    return all(np.isfinite(ends).all() for ends in (matrix.lo, matrix.hi, rhs.lo, rhs.hi))


def is_open(equations: Conditions, x1: float) -> bool:
    """Whether (31) is singular at x1 to rounding."""
    matrix, _ = _scaled(equations, Interval(np.array([x1])), units_of(equations))
    sizes = np.linalg.svd(matrix.middle, compute_uv=False)
    return bool(sizes[4] <= _OPEN * sizes[0])


def cuts(equations: Conditions, box: Interval) -> tuple[list[Array], bool]:
    """Find the solutions in a box of x1 (shape (1,)) of the first system of ``equations``.

    Returns
    -------
    solutions, complete
        (x1, V, W, P, cos psi, sin psi) of each, and whether these are proved to be all.
    """
    units = units_of(equations)
    around, complete = hulls(equations, box)

    def residual(point: Interval) -> Interval:
        return residual_of(equations, point, units)

    def jacobian(point: Interval) -> Interval:
        return jacobian_of(equations, point, units)

    solutions: list[Array] = []
    for hull in around:
        found = one_solution(residual, jacobian, hull)
        if found is None:
            return solutions, False
        solutions.append(found)
    return solutions, complete


def hulls(equations: Conditions, box: Interval) -> tuple[list[Interval], bool]:
    """Enclose the solutions in a box of x1, also for an interval of rho.

    Returns
    -------
    hulls, complete
        Of (x1, V, W, P, cos psi, sin psi), and whether all solutions are proved to be in them.
    """
    units = units_of(equations)
    matrix, rhs = _scaled(equations, box, units)
    if bool(((matrix.largest <= _TINY).all(axis=1) & ~rhs.holds_zero).any()):
        return [], True
    left, sizes, right = np.linalg.svd(matrix.middle)
    if sizes[3] <= _INDEPENDENT * sizes[0]:
        return [], False
    # z = right^T (y, t); rows 0...3 in y and t.
    turned = matmul(matmul(Interval(left.T), matrix), Interval(right.T))[:4]
    target = matmul(Interval(left.T), rhs[:, None])[:4]
    inverse = Interval(np.linalg.inv(turned.middle[:, :4]))
    error = matmul(inverse, turned[:, :4]) - np.eye(4)
    # y + error y = start - slope t
    start, slope = matmul(inverse, target)[:, 0], matmul(inverse, turned[:, 4:])[:, 0]
    spread = float(error.largest.sum(axis=1).max()) * (1.0 + 1e-12)
    plane = right[:, 3:].T  # rows cos psi, sin psi; columns y, t
    along = Interval(plane[:, 4]) - matmul(Interval(plane[:, :4]), slope[:, None])[:, 0]
    base = matmul(Interval(plane[:, :4]), start[:, None])[:, 0]
    reach = float(np.hypot(*along.smallest))
    if spread >= 0.5 or reach < _INDEPENDENT:
        return [], False
    # |t| reach <= 1 + |base| + noise; the noise of y is below spread |y|/(1 - spread).
    most_y, slope_y = float(start.largest.max()), float(slope.largest.max())
    room = reach - 8.0 * spread * slope_y
    if room <= 0.0:
        return [], False
    most_t = (2.0 + float(base.largest.sum()) + 8.0 * spread * most_y) / room * 1.001
    noise = 2.0 * spread * (most_y + slope_y * most_t) * 1.001
    wide = Interval(np.full(4, -noise), np.full(4, noise))
    start = start + wide
    base = matmul(Interval(plane[:, :4]), start[:, None])[:, 0]
    # |base + t along|^2 = 1
    square = along.square()[0] + along.square()[1]
    mixed = along[0] * base[0] + along[1] * base[1]
    rest = mixed.square() - square * (base.square()[0] + base.square()[1] - 1.0)
    if rest.hi < 0.0:
        return [], True
    roots = [-rest.sqrt(), rest.sqrt()]
    if rest.lo <= 0.0:
        # The line may touch the circle: one hull for both cuts.
        roots = [Interval(roots[0].lo, roots[1].hi)]
    found: list[Interval] = []
    for root in roots:
        t = (root - mixed) / square
        y = start - slope * t
        z = matmul(Interval(right.T), join(y, t)[:, None])[:, 0]
        found.append(join(box, z))
    return found, True


def units_of(equations: Conditions) -> Array:
    """Powers of two that bring the rows of (31) near one; the size of what may cancel in them."""
    sizes = []
    for body, kick in (
        (equations.first, 1.0),
        (equations.second, float(equations.parameters.mass_ratio[0])),
    ):
        sizes.append(_largest(body.c11, body.a12, body.gx.re, body.gx.im, body.hx))
        sizes.append(max(kick, _largest(body.c22, body.a21, body.gv.re, body.gv.im, body.hv)))
    return np.asarray(2.0 ** -np.rint(np.log2([*sizes, 1.0])))


def _largest(*columns: Interval) -> float:
    return max(float(column.largest[0]) for column in columns)


def _scaled(equations: Conditions, x1: Interval, units: Array) -> tuple[Interval, Interval]:
    """Matrix and right-hand side of the first system, rows times ``units``."""
    matrix, rhs = (item[0] for item in equations.linear(FIRST, x1))
    return matrix * units[:, None], rhs * units


def residual_of(equations: Conditions, point: Interval, units: Array) -> Interval:
    """The five linear conditions and the circle at (x1, z), shape (6,)."""
    matrix, rhs = _scaled(equations, point[:1], units)
    five = matmul(matrix, point[1:, None])[:, 0] - rhs
    return join(five, point[4].square() + point[5].square() - 1.0)


def jacobian_of(equations: Conditions, point: Interval, units: Array) -> Interval:
    """Derivatives of the residual by (x1, z), shape (6, 6)."""
    matrix, _ = _scaled(equations, point[:1], units)
    first, second = (
        [column[0] for column in (body.c11, body.a21)]
        for body in (equations.first, equations.second)
    )
    _, kappa, bend = (column[0] for column in equations.contact(point[:1]))
    v, p = point[1], point[3]
    by_x1 = join(
        first[0],
        bend * p - first[1],
        second[0] * kappa,
        -(second[1] * kappa),
        bend * v + 2.0 * equations.rho[0] * kappa * bend * p,
    )
    circle = join(Interval(np.zeros(4)), 2.0 * point[4], 2.0 * point[5])
    five = join((by_x1 * units)[:, None], matrix, axis=1)
    return join(five, circle[None, :])


def one_solution(
    residual: Function, jacobian: Function, hull: Interval, *, steps: int = _NEWTON_STEPS
) -> Array | None:
    """Return the only solution in ``hull``, or None if that is not proved."""
    centre = hull.middle
    for _ in range(steps):
        try:
            inverse = np.linalg.inv(jacobian(Interval(centre)).middle)
        except np.linalg.LinAlgError:
            return None
        step = inverse @ residual(Interval(centre)).middle
        centre = centre - step
        if not np.isfinite(centre).all():
            return None
        if np.abs(step).max() <= 4.0 * EPS * max(1.0, np.abs(centre).max()):
            break
    away = np.maximum(np.abs(hull.lo - centre), np.abs(hull.hi - centre))
    radius = 2.0 * away + 64.0 * EPS * max(1.0, float(np.abs(centre).max()))
    around = Interval(centre - radius, centre + radius)
    # K = m - C F(m) + (1 - C J(X)) (X - m) inside X: exactly one zero in X.
    precondition = Interval(inverse)
    at_centre = residual(Interval(centre))
    rest = np.eye(len(centre)) - matmul(precondition, jacobian(around))
    shift = matmul(rest, (around - centre)[:, None]) - matmul(precondition, at_centre[:, None])
    image = centre + shift[:, 0]
    inside = (image.lo > around.lo) & (image.hi < around.hi)
    return centre if bool(inside.all()) and math.isfinite(float(radius.max())) else None
