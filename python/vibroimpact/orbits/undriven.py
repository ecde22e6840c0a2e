"""Natural motions of structures without a drive: nonsmooth modes, whose period is the parameter.

Without drive, damping and losses in impacts periodic motions come in families with the period T. In
the equations T is that of a drive of no amplitude. Two things differ from those of a driven motion
(`structure_problem`): a motion that begins later is the same one, so that the time of the first
impact is fixed, at 0; and energy is kept, so that one equation follows from the others. So the
place of that time holds a number d that is 0 in every solution,

    q- + d q - q = 0,    q'+ + d q' - q' = 0

of the first node: a gain of energy. (F. J. Munoz-Almaraz et al., Physica D 181 (2003) 1-38.)
Multipliers come in pairs l, 1/l, two of them 1: their tests tell nothing.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..structure import Structure
from .branch import Piece
from .kinds import Test
from .structure_problem import StructureProblem

Array = NDArray[np.float64]


def is_undriven(system: Structure) -> bool:
    """Whether nothing drives a structure, whatever its drive frequency."""
    moves = any(stop.amplitude for stop in system.stops)
    return not (moves or np.any(system.drive_amplitude))


class UndrivenProblem(StructureProblem):
    """F(u, p) = 0 for a motion of a structure that nothing drives; u has d in place of a time."""

    def rows(self, u: Array) -> Array:
        """Return the nodes, a row for each leg; the first one is at the start of the period."""
        rows = super().rows(u).copy()
        rows[0, -1] = 0.0
        return rows

    def residual(self, u: Array, p: Array) -> tuple[Array, Array]:
        """Return F, shape (n,), and its Jacobian by u and p, shape (n, n + k)."""
        value, jacobian = super().residual(u, p)
        width = len(u) // len(self.itinerary.legs)
        gain, state = u[width - 1], u[: width - 1]
        # The state after the impact that ends the last leg, at the first node.
        end = slice(len(u) - width, len(u) - 1)
        value, jacobian = value.copy(), jacobian.copy()
        jacobian[:, width - 1] = 0.0
        value[end] += gain * state
        jacobian[end, width - 1] = state
        jacobian[end, : width - 1] += gain * np.eye(width - 1)
        return value, jacobian

    @staticmethod
    def multiplier_tests(matrix: Array) -> dict[Test, float]:
        """Return no tests: two multipliers are 1, and the others come in pairs."""
        return {}

    def singular_matrices(self, u: Array, p: Array, jacobian: Array) -> Mapping[Test, Array]:
        """Return none, as `multiplier_tests`."""
        return {}

    def scale(self, u: Array) -> Array:
        """Return the sizes of the unknowns; d is a pure number."""
        sizes = super().scale(u)
        sizes[len(u) // len(self.itinerary.legs) - 1] = 1.0
        return sizes

    def piece(self, values: Array, us: Array, multipliers: NDArray[np.complex128]) -> Piece:
        """Return a piece of a branch, with times in the nodes."""
        nodes = us.copy()
        nodes[:, us.shape[1] // len(self.itinerary.legs) - 1] = 0.0
        return super().piece(values, nodes, multipliers)
