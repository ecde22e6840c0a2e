"""The legs with friction of a motion without friction: there a branch over friction starts.

At mu = 0 the leg of an impact has no direction of slip. In the limit mu -> 0 each impact has a
regime, slip or reversal, and its outcome tends to that without friction (theory page, section
4). With these regimes the motion at mu = 0 is the end of a branch over mu. Legs of sustained
contact are taken from a simulation at a small friction.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import Leg, LegKind, Regime
from ..arguments import reject
from ..continuation.newton import solve
from ..impacts import impact
from ..made import made_from
from ..system import System
from .problem import OrbitProblem
from .verdict import MAX_EVENTS, motion_of

Array = NDArray[np.float64]

# Friction at which the regimes for mu -> 0 are computed, and at which a motion with sustained
# contact is solved again.
_SMALL = 1e-9


def need_friction(system: System, names: Sequence[str]) -> None:
    """Refuse a start without friction where a function varies it: its legs have no directions.

    Raises
    ------
    ParameterError
        If the function's numbers change the friction, which is zero.
    """
    maker = made_from(system, names)
    if maker is not None and system.friction == 0.0:
        friction = system._numbers_by_name.index("friction")
        if maker.derivatives(names)[friction].any():
            reject("friction", 0.0, "> 0 at the start, where a function varies it")


def with_friction(
    system: System, itinerary: _core.Itinerary, nodes: Array
) -> tuple[_core.Itinerary, Array, float]:
    """Return legs with friction, nodes, and the friction at which they are a motion.

    If the system has friction they are unchanged. ParameterError if there are no such legs.
    """
    if system.contact == "direct":
        reject("friction", "a range", "no parameter to vary in direct contact, which has none")
    if system.friction > 0.0 or itinerary.legs == [Leg.CIRCUIT]:
        return itinerary, nodes, system.friction
    rough = system.replace(friction=_SMALL)
    periods, wall = itinerary.periods, itinerary.wall_at_rest
    if all(leg.kind is LegKind.IMPACT for leg in itinerary.legs):
        x1, v1, _, v2 = itinerary.before_events(system._compiled, nodes).T
        regimes = impact(rough, x1=x1, v1=v1, v2=v2)["regime"]
        sides = np.ones(len(x1)) if system.law == "paper" else system.tip(x1)
        legs = [
            Leg.impact(Regime(int(regime)), *(int(math.copysign(1.0, x)) for x in signs))
            for regime, *signs in zip(regimes, v1, sides, strict=True)
        ]
        return _core.Itinerary(legs, periods, itinerary.clocks, wall), nodes, 0.0
    start = motion_of(system, itinerary, nodes, whole=True).initial
    found, reason = _core.Itinerary.follow(rough._compiled, start, periods, MAX_EVENTS)
    if found is not None:
        u, report = solve(OrbitProblem(rough, found[0]), found[1].ravel(), np.empty(0))
        if report.converged:
            return found[0], u.reshape(-1, 4), _SMALL
        reason = f"Newton's method: {report.outcome}"
    given = [str(leg) for leg in itinerary.legs]
    reject("motion", given, f"one that goes on at a friction of {_SMALL}; here {reason}")
