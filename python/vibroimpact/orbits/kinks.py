"""Where the restitution passes a knot of its curve: a branch goes on there, with a kink.

On both sides the equations are smooth, with other derivatives. A step of the continuation that
leads over a knot is none of a smooth curve, however short it is, if they differ much.
"""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..continuation.newton import solve
from ..continuation.path import Path
from ..restitution import knots_of
from .problem import OrbitProblem
from .resegment import Crossing

Array = NDArray[np.float64]

# How far beyond the kink a motion is looked for, as parts of the sizes.
_BEYOND = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4)
# From how far on both of its sides Newton's method begins, in such parts.
_REACHES = (1.0, -1.0, 10.0, -10.0, 100.0, -100.0)
# It is on the branch if it is no farther than so many times that.
_NEAR = 1e3


def beyond_kink(problem: OrbitProblem, path: Path, size: float) -> Crossing | None:
    """Return where a branch goes on beyond a kink at the end of a path; None if there is none.

    ``size`` is that of the parameter. Where the branch turns back at the kink, the other side is at
    the values from which the path came.
    """
    last = path.points[-1]
    if not any(map(len, knots_of(problem.system_at(last.p)))):
        return None
    pieces = _pieces(problem, last.u, last.p)
    sizes = problem.scale(last.u)
    ahead = 1.0 if last.tangent[-1] >= 0.0 else -1.0
    slope = last.tangent[:-1] / float(np.linalg.norm(last.tangent[:-1] / sizes))
    for part, reach, way in product(_BEYOND, _REACHES, (ahead, -ahead)):
        p = last.p + way * part * size
        # From beside the kink, or Newton's method may stay on the side of the path.
        u, report = solve(problem, last.u + reach * part * slope, p)
        if not report.converged or (np.abs(u - last.u) > _NEAR * part * sizes).any():
            continue
        if not np.array_equal(_pieces(problem, u, p), pieces):
            tangent = np.append(u - last.u, p - last.p)
            return Crossing(itinerary=problem.itinerary, u=u, p=float(p[0]), tangent=tangent)
    return None


def _pieces(problem: OrbitProblem, u: Array, p: Array) -> NDArray[np.int64]:
    """Return how many knots are below the approach velocity of each impact of a motion."""
    alone = problem.piece(p, u[None], np.zeros((1, 1), np.complex128))
    speeds = alone.at_impacts("approach_velocity")[0]
    stops = getattr(alone, "stops", np.zeros(len(speeds), np.int64))
    knots = knots_of(problem.system_at(p))
    found = [np.searchsorted(knots[stop], u) for stop, u in zip(stops, speeds, strict=True)]
    return np.array(found, np.int64)
