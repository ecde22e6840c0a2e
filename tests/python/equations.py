"""Equations with solutions, folds and bifurcations in closed form, for tests of continuation."""

import numpy as np

from vibroimpact.continuation.map_bifurcations import neimark_sacker, period_doubling

# A located parameter: rounding of p, u and the test, of order 1 each.
LOCATED = 1e-13


class Equations:
    """F(u, p) = 0 from a function that gives F and its Jacobian, and one that gives the tests."""

    def __init__(self, residual, tests=None, size=1.0):
        self._residual, self._tests, self.size = residual, tests, size
        self.calls = 0

    def residual(self, u, p):
        self.calls += 1
        value, jacobian = self._residual(u, *p)
        return np.array(value, dtype=float), np.array(jacobian, dtype=float)

    def tests(self, u, p, jacobian):
        return {} if self._tests is None else self._tests(u, p, jacobian)

    def scale(self, u):
        return np.broadcast_to(self.size, len(u)).astype(float)


def ellipse(tests=None, size=1.0):
    """(u/size)^2/4 + p^2 = 1."""
    return Equations(
        lambda u, p: ([(u[0] / size) ** 2 / 4 + p**2 - 1], [[u[0] / size**2 / 2, 2 * p]]),
        tests,
        size,
    )


def straight(tests):
    """The line u = p/2."""
    return Equations(lambda u, p: ([u[0] - p / 2], [[1.0, -0.5]]), tests)


def logistic_cycle(period):
    """Return the cycles of x -> r x (1 - x), the unknowns being the points of the cycle."""

    def residual(x, r):
        jacobian = np.zeros((period, period + 1))
        jacobian[:, -1] = x * (1 - x)
        jacobian[range(period), range(period)] = r * (1 - 2 * x)
        jacobian[range(period), (np.arange(period) + 1) % period] -= 1
        return r * x * (1 - x) - np.roll(x, -1), jacobian

    def tests(x, r, jacobian):
        multiplier = np.prod(r[0] * (1 - 2 * x))
        return {"period_doubling": period_doubling(np.array([[multiplier]]))}

    return Equations(residual, tests)


def settle(r, steps=100_000, period=1):
    """Return a cycle that iteration of the logistic map converges to."""
    x = 0.3
    for _ in range(steps):
        x = r * x * (1 - x)
    cycle = [x]
    for _ in range(period - 1):
        cycle.append(r * cycle[-1] * (1 - cycle[-1]))
    return cycle


def henon_cycle(period, b):
    """Return the cycles of (x, y) -> (1 - a x^2 + y, b x)."""

    def matrices(u, a):
        x = u.reshape(period, 2)[:, 0]
        return [np.array([[-2 * a * xi, 1.0], [b, 0.0]]) for xi in x]

    def residual(u, a):
        x, y = u.reshape(period, 2).T
        image = np.column_stack((1 - a * x**2 + y, b * x))
        jacobian = np.zeros((2 * period, 2 * period + 1))
        for i, matrix in enumerate(matrices(u, a)):
            j = (i + 1) % period
            jacobian[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] += matrix
            jacobian[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] -= np.eye(2)
            jacobian[2 * i, -1] = -(x[i] ** 2)
        return (image - np.roll(np.column_stack((x, y)), -1, axis=0)).ravel(), jacobian

    def tests(u, a, jacobian):
        monodromy = np.eye(2)
        for matrix in matrices(u, a[0]):
            monodromy = matrix @ monodromy
        return {
            "period_doubling": period_doubling(monodromy),
            "neimark_sacker": neimark_sacker(monodromy),
        }

    return Equations(residual, tests)


def kinds(path):
    return [point.kind for point in path.special]
