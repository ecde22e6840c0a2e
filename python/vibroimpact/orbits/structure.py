"""Periodic motions of structures, refined from their runs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .. import _core
from ..arguments import reject
from ..errors import Interrupted
from ..made import MadeStructure
from ..run_parts import read_only
from ..stop import numbered
from ..structure_motion import StructureOrbit
from ..structure_run import StructureRun
from .found import NotFound, not_periodic
from .verdict import MAX_EVENTS

# Periods by which a run is continued where Newton's method finds no motion at its end.
_FURTHER = (0, 64, 512)


def refine_structure(run: StructureRun) -> StructureOrbit | NotFound:
    """Find the periodic motion that a run has settled on; see ``StructureRun.refine``."""
    system = run.system
    if system.drive_frequency == 0.0:
        reject("drive_frequency", 0.0, "a number > 0: a motion repeats after drive periods")
    period = run.period
    if period.m is None:
        return not_periodic(run)
    if run.final_state.time_in_period > 0.0:
        # Continue to the start of the next drive period.
        run = run.resume(time=system.drive_period - run.final_state.time_in_period)
    why = ""
    for further in _FURTHER:
        if further:
            run = run.resume(periods=further, keep=0)
        core, reason = _core.structure_motion(run._core, period.m)
        if core is None:
            why = str(reason)
            if why == "interrupted":
                raise Interrupted("interrupted while a motion was refined", run)
            continue
        found = _motion(run, core, period.m)
        if found.n == period.n:
            return found
        why = f"Newton's method does not find the run's {run.label} motion"
    return NotFound(reason=why)


def _motion(run: StructureRun, core: _core.StructureOrbit, m: int) -> StructureOrbit:
    impacts = np.array(core.impacts, np.int64)
    followed, _ = _core.StructureItinerary.follow(run.system._compiled, core.state, m, MAX_EVENTS)
    legs: dict[str, Any] = {}
    if followed is not None:
        itinerary, nodes = followed
        legs = {
            "legs": tuple(itinerary.legs),
            "nodes": read_only(nodes),
            "clocks": tuple(itinerary.clocks),
        }
    return StructureOrbit(
        system=run.system,
        state=read_only(run.system._from_core(core.state)),
        m=m,
        n=math.inf if core.chatters else int(impacts.sum()),
        impacts=read_only(impacts),
        residual=core.residual,
        derivative=read_only(core.derivative),
        multipliers=read_only(np.array([complex(*pair) for pair in core.multipliers])),
        error=core.bound,
        stability=core.stability,
        **legs,
    )


def need_impacts(motion: StructureOrbit, name: str) -> None:
    """Refuse to follow what has no legs, and friction from a motion without friction.

    Raises
    ------
    ParameterError
        Says what the motion has beside impacts, or which stop has no friction.
    """
    system = motion.system
    if not motion.legs:
        compiled = system._compiled
        start = system._to_core(motion.state)
        _, why = _core.StructureItinerary.follow(compiled, start, motion.m, MAX_EVENTS)
        reject("motion", motion, f"one whose only events are impacts: {why}")
    one = numbered(name)
    if (one.what if one else name) == "friction" and not isinstance(system, MadeStructure):
        struck = {leg.stop for leg in motion.legs if leg.stop is not None}
        for stop in struck & ({one.place} if one else struck):
            if system.stops[stop].friction == 0.0:
                reject(name, 0.0, "> 0 at the start: without it impacts have no direction of slip")
