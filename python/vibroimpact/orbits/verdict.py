"""The verdict on a solution of the conditions of periodicity: is it a motion, is it stable.

The verdict itself is the core's (src/analysis/shooting/verdict.rs): first every condition of its
legs, then a simulation over one orbit (theory page, section 8). Here a solution is brought into
its first form, and its multipliers are computed.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import Leg, LegKind
from ..system import System
from .motion import PeriodicMotion, all_inside, multipliers_of

Array = NDArray[np.float64]

# An orbit repeats itself if its nodes repeat to this part of their size, which counts as at least
# the second number.
_REPEATS, _LEAST_SIZE = 1e-8, 1e-3
# Events of one orbit after which a simulation that checks it is given up.
MAX_EVENTS = 100_000


def motion_of(
    system: System,
    itinerary: _core.Itinerary,
    nodes: Array,
    *,
    error: float = 0.0,
    whole: bool = False,
) -> PeriodicMotion:
    """Build the motion of a converged solution, with its multipliers and verdict.

    Without ``whole`` an orbit that repeats itself is reduced to one repetition, and begins with its
    first event.
    """
    if whole:
        nodes = nodes.copy()
    else:
        itinerary, nodes = _in_order(system, *primitive(system, itinerary, nodes))
    return_map, reason = itinerary.verdict(system._compiled, nodes, MAX_EVENTS)
    (multipliers,) = multipliers_of(return_map[None], itinerary)
    residual, _ = itinerary.residual(system._compiled, nodes)
    chatters = Leg.CHATTER in itinerary.legs
    impacts = sum(leg.kind is LegKind.IMPACT for leg in itinerary.legs)
    for array in (nodes, multipliers):
        array.flags.writeable = False
    return PeriodicMotion(
        system=system,
        m=itinerary.periods,
        n=math.inf if chatters else impacts,
        legs=tuple(itinerary.legs),
        nodes=nodes,
        clocks=tuple(itinerary.clocks),
        wall_at_rest=itinerary.wall_at_rest,
        multipliers=multipliers,
        residual=float(np.abs(residual).max()),
        error=error,
        stable=not reason and bool(all_inside(multipliers)),
        admissible=not reason,
        why_not=reason,
    )


def primitive(
    system: System, itinerary: _core.Itinerary, nodes: Array
) -> tuple[_core.Itinerary, Array]:
    """Reduce a solution that repeats a shorter orbit to that orbit."""
    legs, count, periods = itinerary.legs, len(itinerary.legs), itinerary.periods
    clocks = itinerary.clocks
    size = np.abs(nodes).max(axis=0) + _LEAST_SIZE
    if legs == [Leg.CIRCUIT]:
        return itinerary, nodes
    for repeats in range(count, 1, -1):
        if count % repeats or periods % repeats:
            continue
        step, shorter = count // repeats, periods // repeats
        times = np.array(clocks) * system.drive_period + nodes[:, 3]
        shifted = np.roll(nodes, -step, axis=0)
        ahead = np.roll(times, -step)
        ahead[count - step :] += periods * system.drive_period
        same = (
            legs == legs[step:] + legs[:step]
            and np.abs((shifted - nodes)[:, :3] / size[:3]).max() < _REPEATS
            and np.abs(ahead - times - shorter * system.drive_period).max() < _REPEATS
        )
        if same:
            cut = _core.Itinerary(legs[:step], shorter, clocks[:step], itinerary.wall_at_rest)
            return cut, nodes[:step].copy()
    return itinerary, nodes


def _in_order(
    system: System, itinerary: _core.Itinerary, nodes: Array
) -> tuple[_core.Itinerary, Array]:
    """Begin with the first event of the first drive period."""
    legs, count, periods = itinerary.legs, len(itinerary.legs), itinerary.periods
    nodes = nodes.copy()
    if legs == [Leg.CIRCUIT]:
        return itinerary, nodes
    # Along a branch a node may have moved into another drive period.
    passed = np.floor(nodes[:, 3] / system.drive_period)
    nodes[:, 3] -= passed * system.drive_period
    counted = np.array(itinerary.clocks) + passed.astype(np.int64)
    clocks = (counted % periods).tolist()
    # The nodes are in order of time already; the orbit may begin with any of them.
    first = min(range(count), key=lambda i: (clocks[i], nodes[i, 3]))
    order = [(first + i) % count for i in range(count)]
    turned = [clocks[i] for i in order]
    itinerary = _core.Itinerary([legs[i] for i in order], periods, turned, itinerary.wall_at_rest)
    return itinerary, nodes[order]
