"""Period doubling of orbits: where both halves become equal, and how a doubled orbit starts."""

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import Leg
from ..continuation.follow import follow
from ..continuation.newton import OutsideDomain
from ..continuation.path import Path
from .bifurcation import Bifurcation
from .kinds import BifurcationKind
from .motion import PeriodicMotion
from .problem import OrbitProblem
from .special_points import bifurcation_at

Array = NDArray[np.float64]

# Halves of an orbit that are this close, in units of its size, are equal.
_ONE_HALF = 1e-3
# Halves this close differ by rounding only.
_SAME_HALVES = 1e-9
# Parts of the range around their meeting in which the period doubling is looked for.
_DOUBLING_WINDOWS = (1e-5, 1e-4, 1e-3, 1e-2)
# Shortest step, as part of the range and of the motion's size.
MIN_STEP = 1e-9


def doubled(motion: PeriodicMotion) -> tuple[_core.Itinerary, Array, Array]:
    """Return legs and nodes of a motion repeated twice, and the direction that doubles it.

    At a period doubling the multiplier -1 has an eigenvector d: the doubled orbit leaves by +d in
    its first half and by -d in its second.
    """
    legs, clocks = list(motion.legs), list(motion.clocks)
    circuit = legs == [Leg.CIRCUIT]
    if circuit:
        raise OutsideDomain("a motion without impacts does not double")
    twice = _core.Itinerary(
        legs + legs, 2 * motion.m, clocks + [c + motion.m for c in clocks], motion.wall_at_rest
    )
    values, vectors = np.linalg.eig(motion.return_map)
    direction = np.real(vectors[:, np.argmin(np.abs(values + 1.0))])
    shifts = []
    for leg in motion.itinerary.transfer(motion.system._compiled, motion.nodes):
        shifts.append(direction)
        direction = leg @ direction
    shift = np.array(shifts)
    nodes = np.vstack((motion.nodes, motion.nodes))
    return twice, nodes, np.vstack((shift, -shift))


def halving(problem: OrbitProblem, path: Path) -> int | None:
    """Return the first point beyond which both halves of the orbit are equal.

    There the branch meets the branch of the shorter orbit, at its period doubling. Beyond, it would
    return with exchanged halves.
    """
    shorter = _half_of(problem)
    if shorter is None or len(path.points) < 2:
        return None
    sizes = problem.scale(path.points[0].u)
    apart = np.array([_halves_apart(point.u / sizes) for point in path.points])
    distance = np.abs(apart).max(axis=1)
    for k in range(1, len(apart)):
        # A branch that begins at a period doubling leaves it first.
        turned = apart[k] @ apart[k - 1] < 0.0 and distance[k - 1] > _SAME_HALVES
        if turned or distance[k - 1] > distance[k] < _ONE_HALF:
            return k
    return None


def doubling_near(
    problem: OrbitProblem, u: Array, p: Array, bounds: tuple[float, float], max_step: float
) -> Bifurcation | None:
    """Return the period doubling of the halved orbit next to a point."""
    shorter = _half_of(problem)
    if shorter is None:
        return None
    nodes = 0.5 * (u[: len(u) // 2] + u[len(u) // 2 :])
    low, high = bounds
    size = high - low
    for part in _DOUBLING_WINDOWS:
        window = part * size
        start = max(low, float(p[0]) - window)
        path = follow(
            shorter,
            nodes,
            start,
            bounds=(start, min(high, float(p[0]) + window)),
            parameter_size=size,
            step=max(min(0.1 * part, max_step), MIN_STEP),
            min_step=MIN_STEP,
            max_step=max_step,
            max_points=100,
            classify=shorter.classify,
        )
        doublings = path.of_kind(BifurcationKind.PERIOD_DOUBLING)
        if doublings:
            return bifurcation_at(
                shorter, min(doublings, key=lambda point: abs(point.p[0] - float(p[0])))
            )
    return None


def _halves_apart(u: Array) -> Array:
    half = len(u) // 2
    return u[:half] - u[half:]


def _half_of(problem: OrbitProblem) -> OrbitProblem | None:
    """Return the problem of an orbit half as long, if both halves have the same legs."""
    itinerary = problem.itinerary
    legs, clocks, m = itinerary.legs, itinerary.clocks, itinerary.periods
    half = len(legs) // 2
    if len(legs) % 2 or m % 2 or legs[:half] != legs[half:]:
        return None
    if any(late - early != m // 2 for early, late in zip(clocks, clocks[half:], strict=False)):
        return None
    return problem.of(itinerary.with_legs(legs[:half], m // 2, clocks[:half]))
