"""Simple branch points of F(z) = 0, N equations in N + 1 unknowns: location and other direction.

At a simple branch point J has rank N - 1, so that Newton's method on the curve fails there. The
system (G. Moore, Numer. Funct. Anal. Optim. 2 (1980) 441-472)

    F(z) + mu psi = 0,    J(z)^T psi = 0,    psi . psi = 1

in (z, psi, mu) is regular, and mu = 0 at a branch point. If mu is not 0 there is none: the two
curves miss each other, by a distance that grows with mu (an imperfect bifurcation). The derivative
takes second derivatives of F, from central differences of J; they only serve Newton's matrix, the
solution is exact. With
phi_1, phi_2 the null vectors of J, the directions alpha phi_1 + beta phi_2 of the two branches
solve (H. B. Keller 1977)

    a_11 alpha^2 + 2 a_12 alpha beta + a_22 beta^2 = 0,    a_ij = psi . (D J phi_i) phi_j.
"""

from collections.abc import Callable

import numpy as np

from .newton import Array, OutsideDomain, evaluate, newton

Residual = Callable[[Array], tuple[Array, Array]]

# Step of the central differences, in units of the sizes. The errors, of second order in the step
# and of rounding over the step, are then equal, about eps^(2/3) = 4e-11. Newton's method works with
# a thousand times larger errors, so that a test may have noise well above rounding.
DIFFERENCE = np.finfo(float).eps ** (1.0 / 3.0)
# |mu| above this means that the branches miss each other: rounding of F makes less.
MISS = 1e-10
# Singular values of J in units of the sizes below which they are zero; rows are not balanced, since
# one of them may vanish.
_ZERO = 1e-6
# A component of a direction below this is taken as none: the directions are good to about 1e-9.
_FLAT = 1e-6


def refine_branch_point(residual: Residual, z: Array, sizes: Array) -> tuple[Array, float] | None:
    """Return the zero near z of Moore's system, to rounding, and mu; None if none is found.

    It is a branch point only if abs(mu) is at most ``MISS``.
    """
    count = len(z) - 1

    def scaled(y: Array) -> tuple[Array, Array]:
        value, jacobian = evaluate(residual, y * sizes)
        return value, jacobian * sizes

    def system(x: Array) -> tuple[Array, Array]:
        y, psi, mu = x[: count + 1], x[count + 1 : -1], x[-1]
        value, jacobian = scaled(y)
        hessian = np.empty((count + 1, count + 1))
        for j in range(count + 1):
            shift = np.zeros(count + 1)
            shift[j] = DIFFERENCE
            difference = scaled(y + shift)[1] - scaled(y - shift)[1]
            hessian[:, j] = psi @ difference / (2.0 * DIFFERENCE)
        matrix = np.zeros((2 * count + 2, 2 * count + 2))
        matrix[:count] = np.hstack((jacobian, mu * np.eye(count), psi[:, None]))
        matrix[count:-1, :-1] = np.hstack((hessian, jacobian.T))
        matrix[-1, count + 1 : -1] = 2.0 * psi
        return np.concatenate((value + mu * psi, psi @ jacobian, [psi @ psi - 1.0])), matrix

    y = z / sizes
    try:
        psi = np.linalg.svd(scaled(y)[1])[0][:, -1]
    except OutsideDomain:
        return None
    start = np.concatenate((y, psi, [0.0]))
    solution, _, report = newton(
        system, start, np.ones(len(start)), max_iterations=20, damped=False
    )
    if not report.converged:
        return None
    return solution[: count + 1] * sizes, float(solution[-1])


def directions(
    residual: Residual, z: Array, known: Array, sizes: Array
) -> tuple[Array, Array] | None:
    """Return the tangents of the two branches at the branch point z, that nearer ``known`` first.

    They have length 1 in units of ``sizes``. The first goes the way of ``known``, the second the
    one on which the last unknown grows, or if that stays the first of the large ones. None means
    that z is not a simple branch point where two branches cross.
    """
    left, values, right = np.linalg.svd(residual(z)[1] * sizes)
    if values[-1] > _ZERO or (len(values) > 1 and values[-2] < _ZERO):
        return None
    psi, null = left[:, -1], right[-2:]

    def derivative(direction: Array) -> Array:
        shift = DIFFERENCE * direction * sizes
        try:
            difference = residual(z + shift)[1] - residual(z - shift)[1]
        except OutsideDomain:
            return np.full(2, np.nan)
        result: Array = psi @ (difference * sizes) @ null.T / (2.0 * DIFFERENCE)
        return result

    (a11, a12), (a21, a22) = (derivative(direction) for direction in null)
    form = np.array([[a11, (a12 + a21) / 2.0], [(a12 + a21) / 2.0, a22]])
    if not np.isfinite(form).all():
        return None
    (low, high), axes = np.linalg.eigh(form)
    if not min(-low, high) > _ZERO * max(-low, high):
        return None
    # In the axes of the form its zeros are low x^2 + high y^2 = 0.
    lines = [
        (np.sqrt(high) * axes[:, 0] + sign * np.sqrt(-low) * axes[:, 1]) @ null for sign in (1, -1)
    ]
    cosines = [float(line @ (known / sizes)) for line in lines]
    nearer = int(abs(cosines[1]) > abs(cosines[0]))
    first, second = lines[nearer], lines[1 - nearer]
    first, second = (line / np.sqrt(high - low) for line in (first, second))
    parts = np.abs(second)
    leading = -1 if parts[-1] > _FLAT else int(np.argmax(parts > 0.5 * parts.max()))
    first, second = first * np.copysign(1.0, cosines[nearer]), second * np.sign(second[leading])
    return first * sizes, second * sizes
