"""Points of a branch: with its bifurcations among them, and at any value of its parameter."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
from numpy.typing import NDArray

from ..continuation.newton import solve
from ..errors import SimulationError
from .branch import Branch, Piece
from .machines import motion_of, problem_of
from .mirror import is_mirror_image
from .motion import PeriodicMotion, same_orbit

Array = NDArray[np.float64]

# Into how many steps the way from a point of the branch to the value is cut, one after the other.
_STEPS = (2, 8, 64)
# A solution belongs to the branch if the way over it from one point to the next is at most so many
# times longer than the direct one; a branch that turns makes a longer way than a straight one.
_LONGEST_WAY = 3.0


def motions_at(branch: Branch, value: float) -> tuple[PeriodicMotion, ...]:
    """Return the motions of a branch at a value of its parameter; see ``Branch.at``."""
    found: list[PeriodicMotion] = []
    for piece in with_bifurcations(branch):
        values = piece.values
        between = (values[1:] - value) * (values[:-1] - value) <= 0.0
        for k in np.flatnonzero(between).tolist():
            motion = _between(piece, k, value)
            if motion is None:
                raise SimulationError(
                    f"Newton's method does not find the motion {piece.label} at "
                    f"{piece.parameter} = {value!r}, between {values[k]!r} and {values[k + 1]!r}",
                    tuple(found),
                    holds="the motions before it",
                )
            if not any(same_orbit(motion, other) for other in found):
                found.append(motion)
    return tuple(found)


def is_on(piece: Piece, number: int, known: Piece) -> bool:
    """Whether a motion of a piece, or its mirror image, is one of another piece."""
    value, values = float(piece.values[number]), known.values
    motion = piece.motion(number)
    between = (values[1:] - value) * (values[:-1] - value) <= 0.0
    for k in np.flatnonzero(between).tolist():
        other = _between(known, k, value)
        if other is not None and (same_orbit(other, motion) or is_mirror_image(other, motion)):
            return True
    return False


def _between(piece: Piece, k: int, value: float) -> PeriodicMotion | None:
    """Return the motion at a value between points k and k + 1 of a piece."""
    values, nodes = piece.values[k : k + 2], piece.nodes[k : k + 2]
    for end in (0, 1):
        if values[end] == value:
            return piece.motion(k + end)
    part = float((value - values[0]) / (values[1] - values[0]))
    # Beside a turning point the nodes go with the root of the distance from it.
    for share in (part, math.sqrt(part), 1.0 - math.sqrt(1.0 - part)):
        found = _solved(piece, k, value, nodes[0] + share * (nodes[1] - nodes[0]))
        if found is not None:
            return _motion(piece, value, found)
    for steps, end in itertools.product(_STEPS, (0, 1)):
        found = nodes[end]
        for here in np.linspace(values[end], value, steps + 1)[1:].tolist():
            if (found := _solved(piece, k, here, found)) is None:
                break
        if found is not None:
            return _motion(piece, value, found)
    return None


def _solved(piece: Piece, k: int, value: float, start: Array) -> Array | None:
    """Solve the conditions of periodicity from these nodes; None for a motion elsewhere."""
    problem = problem_of(piece._system_with(value), piece.itinerary)
    found, report = solve(problem, start.ravel(), np.empty(0))
    nodes = found.reshape(start.shape)
    if not report.converged or _way(piece, value, nodes)[k] > _LONGEST_WAY:
        return None
    return nodes


def _motion(piece: Piece, value: float, nodes: Array) -> PeriodicMotion:
    motion: PeriodicMotion = motion_of(piece._system_with(value), piece.itinerary, nodes.copy())
    return motion


def with_bifurcations(branch: Branch) -> list[Piece]:
    """Return the pieces with the located bifurcations among their points, where stability ends."""
    pieces = list(branch.pieces)
    for found in branch.bifurcations:
        nodes = found.motion.nodes
        best: tuple[float, int, int] | None = None
        for number, piece in enumerate(pieces):
            same = tuple(piece.itinerary.legs) == found.motion.legs
            if not same or len(piece.values) < 2:
                continue
            detour, place = _detour(piece, found.value, nodes)
            if best is None or detour < best[0]:
                best = (detour, number, place)
        if best is not None and best[0] > 0.0:
            _, number, place = best
            piece = pieces[number]
            pieces[number] = dataclasses.replace(
                piece,
                values=np.insert(piece.values, place, found.value),
                nodes=np.insert(piece.nodes, place, nodes, axis=0),
                multipliers=np.insert(piece.multipliers, place, found.motion.multipliers, axis=0),
            )
    return pieces


def _detour(piece: Piece, value: float, nodes: Array) -> tuple[float, int]:
    """Return between which points a point lies, and by which part the way through it is longer.

    The part is relative to the distance of the two points; 0 if the point is one of them.
    """
    away = _away(piece, value, nodes)
    if away.min() < 1e-9:
        return 0.0, int(away.argmin())
    way = _way(piece, value, nodes)
    place = int(way.argmin())
    return float(way[place]), place + 1


def _away(piece: Piece, value: float, nodes: Array) -> Array:
    """Return the distances of a point from those of a piece, in units of the piece's extent."""
    points, sizes = _scaled(piece)
    distances: Array = np.linalg.norm(points - np.append(value, nodes.ravel()) / sizes, axis=1)
    return distances


def _way(piece: Piece, value: float, nodes: Array) -> Array:
    """Return how long the way through a point is between each two points, by their distance."""
    points, _ = _scaled(piece)
    away = _away(piece, value, nodes)
    direct = np.linalg.norm(np.diff(points, axis=0), axis=1)
    ways: Array = (away[1:] + away[:-1]) / direct
    return ways


def _scaled(piece: Piece) -> tuple[Array, Array]:
    """Return values and nodes of a piece in units of their extents, and those extents."""
    points = np.column_stack([piece.values, piece.nodes.reshape(len(piece.values), -1)])
    sizes = np.maximum(np.ptp(points, axis=0), 1e-12)
    return points / sizes, sizes
