"""The conditions of periodicity as a problem for Newton's method and for continuation.

Unknowns are the nodes of a motion, flattened; parameters any numeric ones of its system. Residual
and Jacobian come from the compiled core (`_core.Itinerary.residual`); test functions are what holds
the motion inside its sequence of legs, and those of its multipliers.
"""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..continuation.map_bifurcations import (
    bialternate,
    neimark_sacker,
    neimark_sacker_kind,
    period_doubling,
)
from ..continuation.newton import OutsideDomain
from ..errors import ParameterError
from ..system import System
from .motion import monodromy, reduced

Array = NDArray[np.float64]


class OrbitProblem:
    """F(u, p) = 0 for the nodes u of a periodic motion with a fixed sequence of legs."""

    def __init__(
        self, system: System, itinerary: _core.Itinerary, parameters: tuple[str, ...] = ()
    ) -> None:
        self.system = system
        self.itinerary = itinerary
        self.parameters = parameters
        self._latest: tuple[bytes, System] | None = None

    def system_at(self, p: Array) -> System:
        """Return the system with the free parameters at p; OutsideDomain beyond their range."""
        if not self.parameters:
            return self.system
        key = p.tobytes()
        if self._latest is not None and self._latest[0] == key:
            return self._latest[1]
        try:
            system = self.system.replace(**dict(zip(self.parameters, p.tolist(), strict=True)))
        except ParameterError as error:
            raise OutsideDomain(str(error)) from error
        self._latest = key, system
        return system

    def residual(self, u: Array, p: Array) -> tuple[Array, Array]:
        """Return F, shape (n,), and its Jacobian by u and p, shape (n, n + k)."""
        system = self.system_at(p)
        try:
            return self.itinerary.residual(
                system._compiled, u.reshape(-1, 4), list(self.parameters)
            )
        except ParameterError as error:  # drive frequency 0 on the way
            raise OutsideDomain(str(error)) from error

    def tests(self, u: Array, p: Array, jacobian: Array) -> Mapping[str, float]:
        """Return the test functions by name, ``kind: what, leg``."""
        tests = self.border_tests(u, p)
        matrix = self.monodromy(u, p)
        if np.isfinite(matrix).all():
            tests |= self.multiplier_tests(matrix)
        return tests

    def border_tests(self, u: Array, p: Array) -> dict[str, float]:
        """Return what holds the motion inside its sequence of legs."""
        found = self.itinerary.tests(self.system_at(p)._compiled, u.reshape(-1, 4))
        return {f"{kind}: {name}, leg {leg}": value for kind, leg, name, value, _ in found}

    @staticmethod
    def multiplier_tests(matrix: Array) -> dict[str, float]:
        """Return the tests of a monodromy matrix but that of a saddle-node."""
        return {
            "period_doubling": period_doubling(matrix),
            "neimark_sacker": neimark_sacker(matrix),
        }

    def single_test(self, name: str, u: Array, p: Array) -> float | None:
        """Return one test of a border without the others; None if it is none, NaN if missing."""
        return self.border_tests(u, p).get(name, math.nan) if ": " in name else None

    def unknowns_of(self, name: str, count: int) -> list[int]:
        """Return the unknowns on which a test may depend.

        The condition of a leg is known from the node at which it starts and the time at which it
        ends, which the next node has.
        """
        if ": " not in name:
            return list(range(count))
        leg = int(name.rsplit(" ", 1)[1])
        return [*range(4 * leg, 4 * leg + 4), (4 * leg + 7) % count]

    def singular_matrices(self, u: Array, p: Array, jacobian: Array) -> Mapping[str, Array]:
        """Return the matrices that are singular at bifurcations, by the name of their test."""
        matrix = self.monodromy(u, p)
        products = bialternate(matrix)
        return {
            "period_doubling": matrix + np.eye(len(matrix)),
            "neimark_sacker": np.eye(len(products)) - products,
        }

    def classify(self, test: str, u: Array, p: Array, jacobian: Array) -> str:
        """Return the kind of a zero of a test."""
        if test == "neimark_sacker":
            return neimark_sacker_kind(self.monodromy(u, p))
        return test.split(":")[0]

    def monodromy(self, u: Array, p: Array) -> Array:
        """Return the derivative of the return map, a wall at rest left out."""
        matrix = monodromy(self.itinerary, self.system_at(p), u.reshape(-1, 4))
        return reduced(matrix, self.itinerary)

    def scale(self, u: Array) -> Array:
        """Return the sizes of the unknowns: one length of the motion, and its speed.

        None of them vanishes where a single coordinate passes zero, or steps would shrink there.
        """
        nodes = u.reshape(-1, 4)
        omega = max(self.system.drive_frequency, 1e-3)
        circuit = self.itinerary.legs == ["circuit"]
        positions, speeds = nodes[:, [0, 3]] if circuit else nodes[:, :1], nodes[:, 1:3]
        length = max(float(np.abs(positions).max()), float(np.abs(speeds).max()) / omega, 1e-3)
        last = length if circuit else 1.0 / omega
        return np.tile([length, omega * length, omega * length, last], len(nodes))
