"""Special points and ends of a path of solutions, as users see them."""

import numpy as np
from numpy.typing import NDArray

from .._core import Leg
from ..continuation.path import Path, SpecialPoint
from .branch import Bifurcation
from .kinds import BifurcationKind, BranchEnd
from .problem import OrbitProblem
from .verdict import motion_of

Array = NDArray[np.float64]


def bifurcation_at(
    problem: OrbitProblem, special: SpecialPoint, goes_on: tuple[Leg, ...] = ()
) -> Bifurcation:
    """Return a special point of a path as users see it."""
    nodes = special.u.reshape(-1, 4)
    return Bifurcation(
        kind=BifurcationKind(special.kind),
        parameter=problem.parameters[0],
        value=float(special.p[0]),
        motion=motion_of(problem.system_at(special.p), problem.itinerary, nodes, whole=True),
        test=special.test,
        test_value=special.value,
        goes_on=goes_on,
    )


def end_of(path: Path) -> BranchEnd:
    """Return why a path ends, as users see it."""
    return path.end if path.stop is None else BifurcationKind(path.stop.kind)
