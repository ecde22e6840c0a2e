"""How a branch of a structure goes on beyond a border of its order of impacts.

As in `resegment`: a flight that touches a stop there has an impact with u = 0 in the other order,
and the other way round; an impact at the edge of its regime is one of the neighbouring regime too.
In symmetric motions several touches come together: they all change. Where a motion meets one that
is more symmetric, or shorter, at its graze, impacts with u = 0 come together with touches, and four
branches meet. From there the branch goes on without these impacts, whichever test was first.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import (
    Border,
    BorderKind,
    LegKind,
    Regime,
    StopCondition,
    StopLeg,
    StructureItinerary,
)
from ..continuation.newton import OutsideDomain
from ..continuation.path import SpecialPoint
from ..structure import Structure
from .resegment import Crossing, beyond_edge, oriented
from .structure_problem import StructureProblem
from .undriven import is_undriven

Array = NDArray[np.float64]

# Touches are together where their gaps are this small; approach velocities where they are.
_SAME_TOUCH = 1e-10
_SAME_SPEED = 1e-7


def beyond(problem: StructureProblem, border: SpecialPoint) -> Crossing | None:
    """Return how a branch goes on beyond a border, None if it ends there."""
    test: StopCondition = border.test
    try:
        if test.kind is BorderKind.GRAZING:
            spared = _spared_with(problem, border, test)
            found = _spared(problem, border, spared) if spared else _struck(problem, border, test)
        else:
            found = _other_regime(problem, border, test)
        return None if found is None else oriented(problem, border.p, *found)
    except OutsideDomain:
        return None


def _tests(problem: StructureProblem, border: SpecialPoint) -> list[tuple[StopCondition, Any, Any]]:
    system: Structure = problem.system_at(border.p)
    itinerary: StructureItinerary = problem.itinerary
    return itinerary.tests(system._compiled, problem.rows(border.u))


def _spared_with(
    problem: StructureProblem, border: SpecialPoint, test: StopCondition
) -> list[StopCondition]:
    """The impacts with u = 0 at a graze, that of the test first."""
    speed = max(1.0, float(np.abs(problem.rows(border.u)[:, :-1]).max()))
    found = [
        other
        for other, value, _ in _tests(problem, border)
        if other.border is Border.APPROACH_VELOCITY
        and (other == test or abs(value) <= _SAME_SPEED * speed)
    ]
    return sorted(found, key=lambda other: other != test)


def _struck(problem: StructureProblem, border: SpecialPoint, test: StopCondition) -> Any:
    """The touching flights end in impacts with u = 0."""
    itinerary, rows = problem.itinerary, problem.rows(border.u)
    system: Structure = problem.system_at(border.p)
    period, compiled = system.drive_period, system._compiled
    circuit = itinerary.legs[0].kind is LegKind.CIRCUIT
    touches = [
        (other.leg, time, other)
        for other, value, time in _tests(problem, border)
        if other.border is Border.FLIGHT and (other == test or abs(value) <= _SAME_TOUCH)
    ]
    touches.sort(key=lambda touch: touch[:2])
    legs: list[StopLeg] = []
    clocks: list[int] = []
    nodes: list[Array] = []
    new_tests = {}
    for leg, end in enumerate(itinerary.legs):
        if not circuit:
            nodes.append(rows[leg])
            clocks.append(itinerary.clocks[leg])
        start = 0.0 if circuit else itinerary.clocks[leg] * period + rows[leg, -1]
        for _, time, other in (touch for touch in touches if touch[0] == leg):
            state = itinerary.state_in_leg(compiled, rows, leg, time)
            clock = math.floor((start + time) / period)
            new_tests[other] = StopCondition(Border.APPROACH_VELOCITY, len(legs), other.stop)
            legs.append(_to_touch(system, other.stop, state))
            nodes.append(np.append(state.ravel(), start + time - clock * period))
            clocks.append(clock)
        if not circuit:
            legs.append(end)
    if test not in new_tests:
        return None
    found = new_tests[test]
    if circuit:
        # The first node is the first touch: the leg to it comes last.
        legs = legs[1:] + legs[:1]
        found = StopCondition(found.border, (found.leg - 1) % len(legs), found.stop)
    new = itinerary.with_legs(legs, itinerary.periods, clocks)
    return new, np.array(nodes), found


def _to_touch(system: Structure, stop: int, state: Array) -> StopLeg:
    at = system.stops[stop]
    if at.friction == 0.0 or at.tangent is None:
        return StopLeg.impact(stop, Regime.FRICTIONLESS)
    slip = float(at.tangent @ system._from_core(state)[1])
    return StopLeg.impact(stop, Regime.SLIP, 1 if slip > 0.0 else -1)


def _spared(problem: StructureProblem, border: SpecialPoint, spared: list[StopCondition]) -> Any:
    """The impacts with u = 0 are left out."""
    itinerary, rows, test = problem.itinerary, problem.rows(border.u), spared[0]
    system: Structure = problem.system_at(border.p)
    legs, count = itinerary.legs, len(itinerary.legs)
    out = {each.leg for each in spared}
    if len(out) == count:
        if is_undriven(system):
            # The linear modes, which have a period of their own.
            return None
        sections = itinerary.sections(system._compiled, rows)
        new = itinerary.with_legs([StopLeg.CIRCUIT], 1, [0])
        return new, sections[0].reshape(1, -1), StopCondition(Border.FLIGHT, 0, test.stop)
    # Node i + 1 follows on leg i; where that one is left out, leg i goes on to the next that stays.
    kept = [i for i in range(count) if (i - 1) % count not in out]
    ends = []
    for i in kept:
        end = i
        while end % count in out:
            end += 1
        ends.append(legs[end % count])
    before = (test.leg - 1) % count
    while before in out:
        before = (before - 1) % count
    place = kept.index((before + 1) % count)
    new = itinerary.with_legs(ends, itinerary.periods, [itinerary.clocks[i] for i in kept])
    return new, rows[kept], StopCondition(Border.FLIGHT, place, test.stop)


def _other_regime(problem: StructureProblem, border: SpecialPoint, test: StopCondition) -> Any:
    """The impact has the neighbouring regime."""
    itinerary, rows = problem.itinerary, problem.rows(border.u)
    system: Structure = problem.system_at(border.p)
    legs = itinerary.legs
    together = {
        other.leg
        for other, value, _ in _tests(problem, border)
        if other.border is test.border and (other == test or abs(value) <= _SAME_TOUCH)
    }
    for leg in together:
        stop = legs[leg].stop
        if stop is None:
            return None
        plastic = system.stops[stop].restitution == 0.0
        sticks = system._compiled.sticks_at(stop)
        found = beyond_edge(legs[leg], test.border, sticks=sticks, plastic=plastic)
        if found is None:
            return None
        legs[leg] = StopLeg.impact(stop, *found)
    new = itinerary.with_legs(legs, itinerary.periods, itinerary.clocks)
    if test.border in (Border.STOP_AT_END_OF_APPROACH, Border.STOP_AT_END_OF_IMPACT):
        plastic = system.stops[test.stop].restitution == 0.0
        if plastic:
            # Here both edges coincide: from slip to approach, and back.
            slips = legs[test.leg].regime is Regime.SLIP
            ends = (Border.STOP_AT_END_OF_APPROACH, Border.STOP_AT_END_OF_IMPACT)
            test = StopCondition(ends[int(slips)], test.leg, test.stop)
    return new, rows, test
