"""The verdict on a solution of the conditions of periodicity: is it a motion, is it stable.

First every condition of its legs, then a simulation over one orbit (docs/theory.md, section 8).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import Border, BorderKind, Leg, LegEnd, LegKind
from ..simulation import simulate
from ..system import System
from .motion import NEUTRAL, PeriodicMotion, monodromy, reduced

Array = NDArray[np.float64]

# A simulation over one orbit must come back this closely, times the largest growth on the way.
_CLOSES = 1e-7


# A simulation does not begin within this part of a drive period of an event.
_NEAR_EVENT = 1e-9


# An orbit repeats itself if its nodes repeat to this part of their size, which counts as at least
# the second number.
_REPEATS, _LEAST_SIZE = 1e-8, 1e-3
# A test function this close to zero is on its border.
_ON_BORDER = 1e-12


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
    matrix = reduced(monodromy(itinerary, system, nodes), itinerary)
    finite = bool(np.isfinite(matrix).all())
    multipliers = np.linalg.eigvals(matrix) if finite else np.full(len(matrix), np.nan)
    order = np.lexsort((-multipliers.imag, -np.round(np.abs(multipliers), 13)))
    multipliers = multipliers[order].astype(np.complex128)
    residual, _ = itinerary.residual(system._compiled, nodes)
    chatters = Leg.CHATTER in itinerary.legs
    impacts = sum(leg.kind is LegKind.IMPACT for leg in itinerary.legs)
    for array in (nodes, multipliers):
        array.flags.writeable = False
    fields: dict[str, Any] = {
        "system": system,
        "m": itinerary.periods,
        "n": math.inf if chatters else impacts,
        "legs": tuple(itinerary.legs),
        "nodes": nodes,
        "clocks": tuple(itinerary.clocks),
        "wall_at_rest": itinerary.wall_at_rest,
        "multipliers": multipliers,
        "residual": float(np.abs(residual).max()),
        "error": error,
    }
    solution = PeriodicMotion(**fields, stable=False, admissible=False, why_not="")
    reason = why_not(solution)
    stable = not reason and bool(np.abs(multipliers).max() < 1.0 - NEUTRAL)
    return PeriodicMotion(**fields, stable=stable, admissible=not reason, why_not=reason)


def why_not(motion: PeriodicMotion) -> str:
    """Return why a solution is no motion of its system, ``""`` if it is one.

    First every condition of its legs; then a simulation over one orbit, whose contact search has a
    guarantee, must pass the same events and come back.
    """
    if not np.isfinite(motion.multipliers).all():
        return "a leg cannot be followed"
    # Checked first: the maxima of the gap take longer to find.
    for u in motion.impacts["approach_velocity"]:
        if not u > 0.0:
            return f"separating before the impact (u = {u:.3g})"
    tests = motion.itinerary.tests(motion.system._compiled, motion.nodes)
    for test, value, _ in sorted(tests, key=lambda row: row[0].kind is not BorderKind.GRAZING):
        # On a border between regimes the motion belongs to both, also at a graze.
        if value > (0.0 if test.border is Border.APPROACH_VELOCITY else -_ON_BORDER):
            continue
        if test.border is Border.APPROACH_VELOCITY:
            return f"separating before the impact (u = {value:.3g})"
        if test.border is Border.FLIGHT:
            return f"the bodies overlap during the flight (gap {-value:.3g})"
        return f"{test.kind.replace('_', ' ')}: {test.border} ({value:.3g}, leg {test.leg})"
    return _simulated_otherwise(motion)


def _simulated_otherwise(motion: PeriodicMotion) -> str:
    moment = _clear_of_events(motion)
    start = motion.trajectory([moment])[0]
    if not np.isfinite(start).all():
        return "the state at the start of a simulation is not defined"
    system = motion.system
    if moment:
        ahead = math.fmod(moment, system.drive_period)
        system = system.replace(phase=system.phase + system.drive_frequency * ahead)
    found, reason = _core.Itinerary.follow(
        system._compiled, tuple(start.tolist()), motion.m, MAX_EVENTS
    )
    if found is None:
        return f"a simulation of it: {reason}"
    legs, own = (
        _significant([_told_by(leg, system) for leg in passed if _shows(leg, system)])
        for passed in (found[0].legs, motion.legs)
    )
    if not any(legs[i:] + legs[:i] == own for i in range(len(legs))):
        return "a simulation of it passes other events"
    end = simulate(system, initial=start, periods=motion.m, keep=0).final_state
    growth = max(1.0, float(np.abs(motion.return_map).max()))
    scale = max(1.0, float(np.abs(start).max()))
    off = float(np.abs(np.array(end.state) - start).max())
    if off > _CLOSES * scale * growth:
        return f"a simulation of it does not come back (by {off:.1e})"
    return ""


# Two passages of one orbit must agree in this: kinds of legs, and the legs themselves, or at mu = 0
# how they end.
_Told = tuple[LegKind, Leg | LegEnd | None]


def _shows(leg: Leg, system: System) -> bool:
    """Whether a leg counts: at mu = 0 stick and slide are one phase of contact, to its release."""
    return system.friction > 0.0 or leg.end in (None, LegEnd.RELEASE)


def _told_by(leg: Leg, system: System) -> _Told:
    """Return what must agree of a leg: at mu = 0 neither its regime nor its kind of contact."""
    if system.friction > 0.0:
        return leg.kind, leg
    return (LegKind.SLIDE if leg.kind is LegKind.STICK else leg.kind), leg.end


def _clear_of_events(motion: PeriodicMotion) -> float:
    """Time from which to simulate an orbit: 0 unless there is an event.

    A simulation that begins or ends within rounding of an event may count it twice, or not at all.
    """
    period = motion.system.drive_period
    if (
        motion.legs[0] == Leg.CIRCUIT
        or np.abs(np.remainder(motion.nodes[:, 3] + 0.5 * period, period) - 0.5 * period).min()
        > _NEAR_EVENT * period
    ):
        return 0.0
    starts = motion._node_times()
    lengths = np.append(starts[1:], starts[0] + motion.m * period) - starts
    flights = [i for i, leg in enumerate(motion.legs) if leg.kind is LegKind.IMPACT]
    if not flights:
        return 0.0
    longest = max(flights, key=lambda i: float(lengths[i]))
    return float(starts[longest] + 0.5 * lengths[longest])


def _significant(legs: list[_Told]) -> list[_Told]:
    """Leave out the impacts that lead into chatter: how many are listed is a matter of choice."""
    kept: list[_Told] = []
    for leg in legs + legs:
        if leg[0] is LegKind.CHATTER:
            while kept and kept[-1][0] is LegKind.IMPACT:
                kept.pop()
        kept.append(leg)
    # Only the second repetition: the first may begin among such impacts.
    chatters = [i for i, leg in enumerate(kept) if leg[0] is LegKind.CHATTER]
    if not chatters:
        return legs
    return kept[chatters[0] : chatters[len(chatters) // 2]]


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
