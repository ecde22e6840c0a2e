"""The conditions of periodicity along a curve of bifurcations of one kind: which tests to watch.

On a curve one multiplier, or a pair, or a border's function stays critical. What else may happen is
a point of codimension two:

- another multiplier reaches 1 or -1, or another pair the unit circle;
- two multipliers become 1 (``resonance_1_1``) or -1 (``resonance_1_2``): there curves of
  Neimark-Sacker points begin, on one of saddle-nodes or period doublings. Along the former
  c = cos theta of the pair exp(+-i theta) goes to 1 or -1; beyond it would be a neutral saddle;
- c = -1/2 or 0, the other strong resonances (``resonance_1_3``, ``resonance_1_4``; Yu. A.
  Kuznetsov, Elements of Applied Bifurcation Theory, chapter 9);
- another border.

A bifurcation *bounds stability* where the motion there keeps all its other conditions: the other
multipliers lie inside the unit circle and it is a motion.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..continuation.map_bifurcations import (
    bialternate,
    neimark_sacker_cosine,
    period_doubling,
    saddle_node,
)
from ..system import System
from .problem import Array, OrbitProblem

# cos theta within this of 1 or -1 belongs to a resonance: multipliers within 1e-2 of 1 or -1. Where
# two multipliers meet, rounding of the matrix moves them by its square root.
RESONANT = 1e-4
# A test of a border, or 1 - |l|, above minus this is not below zero: rounding of a point on it.
ROUNDING = 1e-9
# Tests that say where a Neimark-Sacker curve ends.
RESONANCES = ("resonance_1_1", "resonance_1_2")


class CurveProblem(OrbitProblem):
    """Periodicity in two parameters, for a curve on which ``test`` vanishes."""

    def __init__(
        self,
        system: System,
        itinerary: _core.Itinerary,
        parameters: tuple[str, ...],
        kind: str,
        test: str,
    ) -> None:
        super().__init__(system, itinerary, parameters)
        self.kind, self.test = kind, test
        # Where an impact has u = 0 the derivative of the return map is infinite.
        self.multipliers_watched = not test.startswith("grazing: u")

    def tests(self, u: Array, p: Array, jacobian: Array) -> Mapping[str, float]:
        """Return the test functions by name."""
        tests = self.border_tests(u, p)
        if not self.multipliers_watched:
            return tests
        matrix = self.monodromy(u, p)
        if not np.isfinite(matrix).all():
            return tests
        tests |= self.multiplier_tests(matrix)
        if self.kind != "neimark_sacker":
            if self.kind != "saddle_node":
                tests["saddle_node"] = saddle_node(matrix)
            return tests
        c = neimark_sacker_cosine(matrix)
        tests |= {"resonance_1_1": 1.0 - c, "resonance_1_2": 1.0 + c}
        tests |= {"resonance_1_3": 0.5 + c, "resonance_1_4": c}
        # The pair's own factors, (1 -+ l)(1 -+ 1/l) = 2 (1 -+ c), are left out.
        if abs(c) < 1.0:
            tests["saddle_node"] = saddle_node(matrix) / (1.0 - c)
            tests["period_doubling"] = period_doubling(matrix) / (1.0 + c)
        else:
            del tests["period_doubling"]
        return tests

    def singular_matrices(self, u: Array, p: Array, jacobian: Array) -> Mapping[str, Array]:
        """Return the matrix that is singular along the curve, if one is."""
        if self.test == "period_doubling":
            matrix = self.monodromy(u, p)
            return {self.test: matrix + np.eye(len(matrix))}
        if self.test == "neimark_sacker":
            products = bialternate(self.monodromy(u, p))
            return {self.test: np.eye(len(products)) - products}
        return {}

    def classify(self, test: str, u: Array, p: Array, jacobian: Array) -> str:
        """Return the kind of a point of codimension two."""
        if test == "neimark_sacker" and self.kind in ("saddle_node", "period_doubling"):
            c = neimark_sacker_cosine(self.monodromy(u, p))
            if abs(abs(c) - 1.0) < RESONANT:
                return RESONANCES[0] if c > 0.0 else RESONANCES[1]
        return super().classify(test, u, p, jacobian)

    def multipliers(self, u: Array, p: Array) -> NDArray[np.complex128]:
        """Return the multipliers by falling modulus; NaN where they are infinite."""
        matrix = self.monodromy(u, p)
        if not (self.multipliers_watched and np.isfinite(matrix).all()):
            return np.full(len(matrix), complex(np.nan, np.nan))
        values = np.linalg.eigvals(matrix).astype(np.complex128)
        return values[np.lexsort((-values.imag, -np.round(np.abs(values), 13)))]

    def bounds_stability(self, u: Array, p: Array) -> bool:
        """Whether the motion is stable on one side: nothing but ``test`` is critical or beyond."""
        borders = self.border_tests(u, p)
        if any(value < -ROUNDING for name, value in borders.items() if name != self.test):
            return False
        others = self.multipliers(u, p)
        if np.isnan(others).any():
            return False
        critical = {"saddle_node": 1, "period_doubling": 1, "neimark_sacker": 2}.get(self.kind, 0)
        for _ in range(critical):
            aim = {"saddle_node": 1.0, "period_doubling": -1.0}.get(self.kind)
            # Of a pair l, 1/l both are left out, wherever on the circle it is.
            off = np.abs(others - aim) if aim is not None else self._off_circle(others)
            others = np.delete(others, int(np.argmin(off)))
        if self.kind == "neimark_sacker" and abs(self._cosine(u, p)) >= 1.0:
            return False
        return bool((np.abs(others) < 1.0 + ROUNDING).all())

    def _cosine(self, u: Array, p: Array) -> float:
        return neimark_sacker_cosine(self.monodromy(u, p))

    @staticmethod
    def _off_circle(values: NDArray[np.complex128]) -> Array:
        off: Array = np.abs(np.abs(values) - 1.0) + 10.0 * (values.imag == 0.0)
        return off
