"""The conditions of periodicity as a problem for Newton's method and for continuation.

Unknowns are the nodes of a motion, flattened; parameters any numeric ones of its system. Residual
and Jacobian come from the compiled core (`_core.Itinerary.residual`); test functions are the
conditions of the legs, and functions of the multipliers.
"""

import math
from collections.abc import Callable, Hashable, Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import Condition, Leg, StopCondition
from ..continuation.map_bifurcations import (
    bialternate,
    neimark_sacker,
    neimark_sacker_kind,
    period_doubling,
)
from ..continuation.newton import OutsideDomain
from ..errors import ParameterError
from ..made import MadeSystem, made_from, rows_of, varied
from .branch import Piece
from .kinds import CONDITIONS, BifurcationKind, Test
from .motion import reduced
from .verdict import motion_of

Array = NDArray[np.float64]


def _plus_identity(monodromy: Array) -> Array:
    matrix: Array = monodromy + np.eye(monodromy.shape[-1])
    return matrix


def _identity_minus_products(monodromy: Array) -> Array:
    products = bialternate(monodromy)
    matrix: Array = np.eye(products.shape[-1]) - products
    return matrix


SINGULAR_MATRICES: Mapping[Hashable, Callable[[Array], Array]] = {
    BifurcationKind.PERIOD_DOUBLING: _plus_identity,
    BifurcationKind.NEIMARK_SACKER: _identity_minus_products,
}
"""The matrix that is singular at a bifurcation, from the monodromy matrix or several of them."""


# By so many parameters the compiled core gives derivatives in one call.
_AT_ONCE = 2


class OrbitProblem:
    """F(u, p) = 0 for the nodes u of a periodic motion with a fixed sequence of legs."""

    _PIECE: type[Piece] = Piece

    def __init__(self, system: Any, itinerary: Any, parameters: tuple[str, ...] = ()) -> None:
        self.system = system
        self.itinerary = itinerary
        self.parameters = parameters
        self._latest: tuple[bytes, Any] | None = None

    def of(self, itinerary: Any) -> Self:
        """Return the problem of other legs of the same system."""
        return type(self)(self.system, itinerary, self.parameters)

    def rows(self, u: Array) -> Array:
        """Return the nodes, a row for each leg."""
        return u.reshape(len(self.itinerary.legs), -1)

    def motion(self, u: Array, p: Array) -> Any:
        """Return the motion with these nodes, as it is, with its verdict."""
        return motion_of(self.system_at(p), self.itinerary, self.rows(u), whole=True)

    def piece(self, values: Array, us: Array, multipliers: NDArray[np.complex128]) -> Piece:
        """Return a piece of a branch over the one parameter, from its points in rows."""
        return self._PIECE(
            system=self.system,
            parameter=self.parameters[0],
            itinerary=self.itinerary,
            values=values,
            nodes=us.reshape(len(us), len(self.itinerary.legs), -1),
            multipliers=multipliers,
        )

    def system_at(self, p: Array) -> Any:
        """Return the system with the free parameters at p; OutsideDomain beyond their range."""
        if not self.parameters:
            return self.system
        key = p.tobytes()
        if self._latest is not None and self._latest[0] == key:
            return self._latest[1]
        try:
            system = varied(self.system, dict(zip(self.parameters, p.tolist(), strict=True)))
        except ParameterError as error:
            raise OutsideDomain(str(error)) from error
        self._latest = key, system
        return system

    def residual(self, u: Array, p: Array) -> tuple[Array, Array]:
        """Return F, shape (n,), and its Jacobian by u and p, shape (n, n + k)."""
        system = self.system_at(p)
        try:
            if (maker := made_from(system, self.parameters)) is not None and self.parameters:
                return self._residual_by_numbers(maker, self.rows(u))
            names = list(self.parameters)
            found: tuple[Array, Array]
            found = self.itinerary.residual(system._compiled, self.rows(u), names)
            return found
        except ParameterError as error:  # drive frequency 0 on the way
            raise OutsideDomain(str(error)) from error

    def _residual_by_numbers(self, system: MadeSystem, nodes: Array) -> tuple[Array, Array]:
        """Return `residual` where a function makes the system: by the chain rule."""
        by_number = system.derivatives(self.parameters)
        moving = np.flatnonzero(by_number.any(axis=1))
        names = [system._numbers_by_name[k] for k in moving]
        residual, jacobian = self.itinerary.residual(system._compiled, nodes, [])
        own = []
        for first in range(0, len(names), _AT_ONCE):
            part = names[first : first + _AT_ONCE]
            own.append(self.itinerary.residual(system._compiled, nodes, part)[1][:, nodes.size :])
        by_own = np.column_stack([np.empty((nodes.size, 0)), *own])
        return residual, np.column_stack([jacobian, by_own @ by_number[moving]])

    def tests(self, u: Array, p: Array, jacobian: Array) -> Mapping[Test, float]:
        """Return the test functions: those of the borders, and of the multipliers."""
        tests = dict[Test, float](self.border_tests(u, p).items())
        matrix = self.monodromy(u, p)
        if np.isfinite(matrix).all():
            tests |= self.multiplier_tests(matrix)
        return tests

    def border_tests(self, u: Array, p: Array) -> dict[Condition | StopCondition, float]:
        """Return the conditions under which the motion has this sequence of legs."""
        found = self.itinerary.tests(self.system_at(p)._compiled, self.rows(u))
        return {condition: value for condition, value, _ in found}

    @staticmethod
    def multiplier_tests(matrix: Array) -> dict[Test, float]:
        """Return the tests of a monodromy matrix, without that of a saddle-node."""
        return {
            BifurcationKind.PERIOD_DOUBLING: period_doubling(matrix),
            BifurcationKind.NEIMARK_SACKER: neimark_sacker(matrix),
        }

    def single_test(self, test: Hashable, u: Array, p: Array) -> float | None:
        """Return one test of a border without the others; None for other tests, NaN if missing."""
        if not isinstance(test, CONDITIONS):
            return None
        return self.border_tests(u, p).get(test, math.nan)

    def unknowns_of(self, test: Hashable, count: int) -> list[int]:
        """Return the unknowns on which a test may depend.

        The condition of a leg is known from the node at which it starts and the time at which it
        ends, which the next node has.
        """
        if not isinstance(test, CONDITIONS):
            return list(range(count))
        leg = test.leg
        return [*range(4 * leg, 4 * leg + 4), (4 * leg + 7) % count]

    def singular_matrices(self, u: Array, p: Array, jacobian: Array) -> Mapping[Test, Array]:
        """Return the matrices that are singular at bifurcations, by their test."""
        matrix = self.monodromy(u, p)
        return {
            kind: SINGULAR_MATRICES[kind](matrix)
            for kind in (BifurcationKind.PERIOD_DOUBLING, BifurcationKind.NEIMARK_SACKER)
        }

    def classify(self, test: Hashable, u: Array, p: Array, jacobian: Array) -> BifurcationKind:
        """Return the kind of a zero of a test."""
        if isinstance(test, CONDITIONS):
            return BifurcationKind(test.kind)
        if test is BifurcationKind.NEIMARK_SACKER:
            return BifurcationKind(neimark_sacker_kind(self.monodromy(u, p)))
        return BifurcationKind(str(test))

    def monodromy(self, u: Array, p: Array) -> Array:
        """Return the derivative of the return map, without the states of a wall at rest."""
        matrix = self.itinerary.return_map(self.system_at(p)._compiled, self.rows(u))
        return reduced(matrix, self.itinerary)

    def monodromies(self, us: Array, ps: Array) -> Array:
        """Return the derivatives of the return maps at several points, in rows."""
        try:
            if self.parameters and made_from(self.system, self.parameters) is not None:
                rows = rows_of([self.system_at(p) for p in ps])
                systems = _core.Systems(
                    self.system._compiled, [*self.system._numbers_by_name], rows
                )
            else:
                systems = _core.Systems(self.system._compiled, list(self.parameters), ps)
        except ParameterError as error:
            raise OutsideDomain(str(error)) from error
        matrices = self.itinerary.return_maps(systems, us.reshape(-1, 4))
        return reduced(matrices, self.itinerary)

    def scale(self, u: Array) -> Array:
        """Return the sizes of the unknowns: one length of the motion, and its speed.

        None of them vanishes where a single coordinate passes zero, because steps would shrink
        there.
        """
        nodes = u.reshape(-1, 4)
        omega = max(self.system.drive_frequency, 1e-3)
        circuit = self.itinerary.legs == [Leg.CIRCUIT]
        positions, speeds = nodes[:, [0, 3]] if circuit else nodes[:, :1], nodes[:, 1:3]
        length = max(float(np.abs(positions).max()), float(np.abs(speeds).max()) / omega, 1e-3)
        last = length if circuit else 1.0 / omega
        return np.tile([length, omega * length, omega * length, last], len(nodes))
