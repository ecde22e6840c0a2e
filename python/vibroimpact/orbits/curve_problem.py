"""The conditions of periodicity along a curve of bifurcations, and the tests to watch there.

On a curve one multiplier, a pair of multipliers, or the function of a border stays critical. At a
point of codimension two something else happens as well:

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

from collections.abc import Hashable, Mapping

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import Border, Condition
from ..continuation.map_bifurcations import (
    neimark_sacker_cosine,
    period_doubling,
    saddle_node,
)
from ..system import System
from .kinds import BifurcationKind, Test
from .problem import SINGULAR_MATRICES, Array, OrbitProblem

# cos theta within this of 1 or -1 belongs to a resonance: multipliers within 1e-2 of 1 or -1. Where
# two multipliers meet, rounding of the matrix moves them by its square root.
_RESONANT = 1e-4
# A test of a border, or 1 - |l|, counts as negative only below minus this: rounding.
ROUNDING = 1e-9
# How many multipliers are critical on a curve, and where on the unit circle a single one is.
_CRITICAL = {
    BifurcationKind.SADDLE_NODE: 1,
    BifurcationKind.PERIOD_DOUBLING: 1,
    BifurcationKind.NEIMARK_SACKER: 2,
}
_AIM = {BifurcationKind.SADDLE_NODE: 1.0, BifurcationKind.PERIOD_DOUBLING: -1.0}
# Tests that say where a Neimark-Sacker curve ends.
RESONANCES = (BifurcationKind.RESONANCE_1_1, BifurcationKind.RESONANCE_1_2)


class CurveProblem(OrbitProblem):
    """Periodicity in two parameters, for a curve on which ``test`` vanishes."""

    def __init__(
        self,
        system: System,
        itinerary: _core.Itinerary,
        parameters: tuple[str, ...],
        kind: BifurcationKind,
        test: Test,
    ) -> None:
        super().__init__(system, itinerary, parameters)
        self.kind, self.test = kind, test
        # Where an impact has u = 0 the derivative of the return map is infinite.
        self.multipliers_watched = not (
            isinstance(test, Condition) and test.border is Border.APPROACH_VELOCITY
        )

    def tests(self, u: Array, p: Array, jacobian: Array) -> Mapping[Test, float]:
        """Return the test functions."""
        tests = dict[Test, float](self.border_tests(u, p).items())
        if not self.multipliers_watched:
            return tests
        matrix = self.monodromy(u, p)
        if not np.isfinite(matrix).all():
            return tests
        tests |= self.multiplier_tests(matrix)
        if self.kind is not BifurcationKind.NEIMARK_SACKER:
            if self.kind is not BifurcationKind.SADDLE_NODE:
                tests[BifurcationKind.SADDLE_NODE] = saddle_node(matrix)
            return tests
        c = neimark_sacker_cosine(matrix)
        tests[BifurcationKind.RESONANCE_1_1] = 1.0 - c
        tests[BifurcationKind.RESONANCE_1_2] = 1.0 + c
        tests[BifurcationKind.RESONANCE_1_3] = 0.5 + c
        tests[BifurcationKind.RESONANCE_1_4] = c
        # The pair's own factors, (1 -+ l)(1 -+ 1/l) = 2 (1 -+ c), are left out.
        if abs(c) < 1.0:
            tests[BifurcationKind.SADDLE_NODE] = saddle_node(matrix) / (1.0 - c)
            tests[BifurcationKind.PERIOD_DOUBLING] = period_doubling(matrix) / (1.0 + c)
        else:
            del tests[BifurcationKind.PERIOD_DOUBLING]
        return tests

    def singular_matrices(self, u: Array, p: Array, jacobian: Array) -> Mapping[Test, Array]:
        """Return the matrix that is singular along the curve, if one is."""
        if self.test in SINGULAR_MATRICES:
            return {self.test: SINGULAR_MATRICES[self.test](self.monodromy(u, p))}
        return {}

    def several_matrices(self, test: Hashable, us: Array, ps: Array) -> Array | None:
        """Return the matrices of one test at several points, in rows; None if it has none."""
        if test != self.test or self.test not in SINGULAR_MATRICES:
            return None
        return SINGULAR_MATRICES[self.test](self.monodromies(us, ps))

    def classify(self, test: Hashable, u: Array, p: Array, jacobian: Array) -> BifurcationKind:
        """Return the kind of a point of codimension two."""
        single = (BifurcationKind.SADDLE_NODE, BifurcationKind.PERIOD_DOUBLING)
        if test is BifurcationKind.NEIMARK_SACKER and self.kind in single:
            c = neimark_sacker_cosine(self.monodromy(u, p))
            if abs(abs(c) - 1.0) < _RESONANT:
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
        critical = _CRITICAL.get(self.kind, 0)
        for _ in range(critical):
            aim = _AIM.get(self.kind)
            # Of a pair l, 1/l both are left out, wherever on the circle it is.
            off = np.abs(others - aim) if aim is not None else self._off_circle(others)
            others = np.delete(others, int(np.argmin(off)))
        if self.kind is BifurcationKind.NEIMARK_SACKER and abs(self._cosine(u, p)) >= 1.0:
            return False
        return bool((np.abs(others) < 1.0 + ROUNDING).all())

    def _cosine(self, u: Array, p: Array) -> float:
        return neimark_sacker_cosine(self.monodromy(u, p))

    @staticmethod
    def _off_circle(values: NDArray[np.complex128]) -> Array:
        off: Array = np.abs(np.abs(values) - 1.0) + 10.0 * (values.imag == 0.0)
        return off
