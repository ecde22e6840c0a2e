"""The conditions of periodicity of motions of structures, and what their solutions are.

As for a System (`problem`), with the kernels of `_core.StructureItinerary`. Where a function makes
the structure, the derivative by its number is that of the residual at fixed nodes, by differences
of fourth order: no event is looked for there, so that the residual is smooth.
"""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import LegKind
from ..continuation.newton import OutsideDomain
from ..errors import ParameterError
from ..made import MadeStructure, scale_of
from ..run_parts import read_only
from ..structure import Structure
from ..structure_motion import StructureOrbit
from .kinds import CONDITIONS
from .motion import eigenvalues_of
from .problem import OrbitProblem
from .structure_piece import StructurePiece
from .verdict import MAX_EVENTS, in_order, primitive

Array = NDArray[np.float64]

# Steps of the differences by a function's number, as part of its size: their fifth power and the
# rounding of a double over them are about equal.
_STEP = 5e-4
# Weights of a derivative of fourth order at 0, from values at these multiples of the step: in the
# middle, and at an end of what is allowed.
_MIDDLE = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}
_ENDS = {0: -25 / 12, 1: 4.0, 2: -3.0, 3: 4 / 3, 4: -1 / 4}
# Sizes of coordinates and velocities beside the largest ones of the motion are at least this.
_LEAST_SIZE = 1e-3
# Rounding of a multiplier, in units of that of a double, their number and the derivative's size.
_MULTIPLIER_NOISE = 64.0


class StructureProblem(OrbitProblem):
    """F(u, p) = 0 for the nodes u of a motion of a structure with a fixed order of impacts."""

    _PIECE = StructurePiece

    def residual(self, u: Array, p: Array) -> tuple[Array, Array]:
        """Return F, shape (n,), and its Jacobian by u and p, shape (n, n + k)."""
        system: Structure = self.system_at(p)
        rows, names = self.rows(u), list(self.parameters)
        try:
            if isinstance(system, MadeStructure) and names:
                value, jacobian = self.itinerary.residual(system._compiled, rows, [])
                columns = [self._by_number(system, name, rows, value) for name in names]
                return value, np.column_stack([jacobian, *columns])
            found: tuple[Array, Array] = self.itinerary.residual(system._compiled, rows, names)
            return found
        except ParameterError as error:  # drive frequency 0 on the way
            raise OutsideDomain(str(error)) from error

    def _by_number(self, system: MadeStructure, name: str, rows: Array, here: Array) -> Array:
        """Return the derivative of the residual by a number of the function at fixed nodes."""
        number, size = system._numbers[name], system._sizes[name]
        step = _STEP * scale_of(number, size)

        def at(steps: float) -> Array:
            structure = system.at({name: number + steps * step})
            value: Array = self.itinerary.residual(structure._compiled, rows, [])[0]
            return value

        last: ParameterError | None = None
        for weights, sign in ((_MIDDLE, 1.0), (_ENDS, 1.0), (_ENDS, -1.0)):
            try:
                parts = [w * (at(sign * k) if k else here) for k, w in weights.items()]
            except ParameterError as error:
                last = error
                continue
            total: Array = sign * np.sum(parts, axis=0) / step
            return total
        raise OutsideDomain(str(last))

    def unknowns_of(self, test: Hashable, count: int) -> list[int]:
        """Return the unknowns on which a test may depend; see ``OrbitProblem``."""
        if not isinstance(test, CONDITIONS) or self.itinerary.legs[0].kind is LegKind.CIRCUIT:
            return list(range(count))
        width = count // len(self.itinerary.legs)
        first = width * test.leg
        return [*range(first, first + width), (first + 2 * width - 1) % count]

    def monodromy(self, u: Array, p: Array) -> Array:
        """Return the derivative of the return map."""
        matrix: Array = self.itinerary.return_map(self.system_at(p)._compiled, self.rows(u))
        return matrix

    def monodromies(self, us: Array, ps: Array) -> Array:
        """Return the derivatives of the return maps at several points, in rows."""
        return np.array([self.monodromy(u, p) for u, p in zip(us, ps, strict=True)])

    def scale(self, u: Array) -> Array:
        """Return the sizes of the unknowns: a length for each coordinate, and its speed."""
        count = self.system._compiled.shapes.shape[1]
        nodes = self.rows(u)
        omega = max(self.system.drive_frequency, 1e-3)
        places = np.abs(nodes[:, :count]).max(axis=0)
        speeds = np.abs(nodes[:, count : 2 * count]).max(axis=0)
        lengths = np.maximum(places, speeds / omega)
        lengths = np.maximum(lengths, max(_LEAST_SIZE * float(lengths.max()), 1e-12))
        row = [*lengths, *(omega * lengths)]
        if nodes.shape[1] > 2 * count:
            row.append(1.0 / omega)
        return np.tile(row, len(nodes))

    def motion(self, u: Array, p: Array) -> StructureOrbit:
        """Return the motion with these nodes, as it is, with its verdict."""
        system: Structure = self.system_at(p)
        return structure_motion_of(system, self.itinerary, self.rows(u), whole=True)


def structure_motion_of(
    system: Structure,
    itinerary: _core.StructureItinerary,
    nodes: Array,
    *,
    whole: bool = False,
) -> StructureOrbit:
    """Build the motion of a converged solution, with its multipliers and verdict.

    Without ``whole`` an orbit that repeats itself is reduced to one repetition, and begins with its
    first impact.
    """
    nodes = nodes.copy()
    if not whole:
        period = system.drive_period
        itinerary, nodes = in_order(period, *primitive(period, itinerary, nodes))
    compiled = system._compiled
    matrix = itinerary.return_map(compiled, nodes)
    why_not = itinerary.verdict(compiled, nodes, MAX_EVENTS)
    (multipliers,) = eigenvalues_of(matrix[None])
    residual, _ = itinerary.residual(compiled, nodes)
    hits = [leg.stop for leg in itinerary.legs if leg.stop is not None]
    impacts = np.bincount(np.array(hits, np.int64), minlength=len(system.stops))
    sections = system._from_core(itinerary.sections(compiled, nodes))
    size = max(1.0, float(np.linalg.norm(matrix)))
    error = _MULTIPLIER_NOISE * np.finfo(float).eps * len(matrix) * size
    return StructureOrbit(
        system=system,
        state=read_only(sections[0].copy()),
        m=itinerary.periods,
        n=len(hits),
        impacts=read_only(impacts.astype(np.int64)),
        residual=float(np.abs(residual).max()),
        derivative=read_only(matrix),
        multipliers=read_only(multipliers),
        error=error,
        stability=_stability(float(np.abs(multipliers[0])), error),
        legs=tuple(itinerary.legs),
        nodes=read_only(nodes),
        clocks=tuple(itinerary.clocks),
        admissible=not why_not,
        why_not=why_not,
    )


def _stability(largest: float, error: float) -> str:
    if largest < 1.0 - error:
        return "stable"
    return "unstable" if largest > 1.0 + error else "undecided"


def doubled_structure(
    motion: StructureOrbit,
) -> tuple[_core.StructureItinerary, Array, Array]:
    """Return legs and nodes of a motion repeated twice, and the direction that doubles it.

    At a period doubling the conditions of the motion repeated twice are singular: along the
    direction in which its halves part.
    """
    legs, clocks = list(motion.legs), list(motion.clocks)
    if legs[0].kind is LegKind.CIRCUIT:
        raise OutsideDomain("a motion without impacts does not double")
    twice = motion.itinerary.with_legs(
        legs + legs, 2 * motion.m, clocks + [clock + motion.m for clock in clocks]
    )
    nodes = np.vstack((motion.nodes, motion.nodes))
    problem = StructureProblem(motion.system, twice)
    sizes = problem.scale(nodes.ravel())
    _, jacobian = problem.residual(nodes.ravel(), np.empty(0))
    _, _, right = np.linalg.svd(jacobian * sizes)
    shift = (right[-1] * sizes).reshape(nodes.shape)
    half = 0.5 * (shift[: len(legs)] - shift[len(legs) :])
    return twice, nodes, np.vstack((half, -half))
