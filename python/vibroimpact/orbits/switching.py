"""Where another branch leaves a bifurcation, and in which direction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..arguments import reject
from ..continuation.branching import directions
from ..made import value_of
from .bifurcation import Bifurcation
from .machines import problem_of, twice
from .resegment import Crossing

Array = NDArray[np.float64]


def doubled_start(doubling: Bifurcation, name: str) -> Crossing:
    """Return where the branch of doubled motions begins."""
    itinerary, nodes, shift = twice(doubling.motion)
    return Crossing(
        itinerary=itinerary,
        u=nodes.ravel(),
        p=value_of(doubling.motion.system, name),
        tangent=np.append(shift.ravel(), 0.0),
    )


def crossing_start(point: Bifurcation, name: str, size: float) -> tuple[Crossing, Bifurcation]:
    """Return where the other branch crosses at a branch point, and that point as one of its own.

    Its direction is found anew, over the parameter that varies now, of that size.
    """
    motion = point.motion
    if point.other is None:
        reject("bifurcation", point, "a branch point at which two branches cross")
    problem = problem_of(motion.system, motion.itinerary, (name,))
    z = np.append(motion.nodes.ravel(), value_of(motion.system, name))
    sizes = np.append(problem.scale(z[:-1]), size)

    def residual(at: Array) -> tuple[Array, Array]:
        return problem.residual(at[:-1], at[-1:])

    lines = directions(residual, z, point.other, sizes)
    if lines is None:
        reject("bifurcation", point, f"a point where two branches over {name} cross")
    along, other = lines
    start = Crossing(itinerary=motion.itinerary, u=z[:-1], p=float(z[-1]), tangent=along)
    return start, replace(point, parameter=name, value=float(z[-1]), other=other)
