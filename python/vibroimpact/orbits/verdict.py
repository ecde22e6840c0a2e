"""The verdict on a solution of the conditions of periodicity: is it a motion, is it stable.

The verdict itself is the core's (src/analysis/shooting/verdict.rs): first every condition of its
legs, then a simulation over one orbit (orbits page). Here a solution is brought into
its first form, and its multipliers are computed.
"""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import Leg, LegKind
from ..system import System
from .motion import PeriodicMotion, all_inside, multipliers_of

Array = NDArray[np.float64]
# Both have `with_legs`, and the time in the drive period as the last number of a node.
Legs = TypeVar("Legs", _core.Itinerary, _core.StructureItinerary)

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
        period = system.drive_period
        itinerary, nodes = in_order(period, *primitive(period, itinerary, nodes))
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


def primitive(period: float, itinerary: Legs, nodes: Array) -> tuple[Legs, Array]:
    """Reduce a solution that repeats a shorter orbit to that orbit; ``period`` is the drive's."""
    legs, count, periods = itinerary.legs, len(itinerary.legs), itinerary.periods
    clocks = itinerary.clocks
    size = np.abs(nodes).max(axis=0) + _LEAST_SIZE
    if legs[0].kind is LegKind.CIRCUIT:
        return itinerary, nodes
    for repeats in range(count, 1, -1):
        if count % repeats or periods % repeats:
            continue
        step, shorter = count // repeats, periods // repeats
        times = np.array(clocks) * period + nodes[:, -1]
        shifted = np.roll(nodes, -step, axis=0)
        ahead = np.roll(times, -step)
        ahead[count - step :] += periods * period
        same = (
            legs == legs[step:] + legs[:step]
            and np.abs((shifted - nodes)[:, :-1] / size[:-1]).max() < _REPEATS
            and np.abs(ahead - times - shorter * period).max() < _REPEATS
        )
        if same:
            return itinerary.with_legs(legs[:step], shorter, clocks[:step]), nodes[:step].copy()
    return itinerary, nodes


def in_order(period: float, itinerary: Legs, nodes: Array) -> tuple[Legs, Array]:
    """Begin with the first event of the first drive period."""
    legs, count, periods = itinerary.legs, len(itinerary.legs), itinerary.periods
    nodes = nodes.copy()
    if legs[0].kind is LegKind.CIRCUIT:
        return itinerary, nodes
    # Along a branch a node may have moved into another drive period.
    passed = np.floor(nodes[:, -1] / period)
    nodes[:, -1] -= passed * period
    counted = np.array(itinerary.clocks) + passed.astype(np.int64)
    clocks = (counted % periods).tolist()
    # The nodes are in order of time already; the orbit may begin with any of them.
    first = min(range(count), key=lambda i: (clocks[i], nodes[i, -1]))
    order = [(first + i) % count for i in range(count)]
    turned = [clocks[i] for i in order]
    return itinerary.with_legs([legs[i] for i in order], periods, turned), nodes[order]
