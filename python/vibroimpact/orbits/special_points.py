"""Special points and ends of a path of solutions, as users see them.

At a simple branch point two branches cross (H. B. Keller 1977, `continuation.branching`). Where the
parameter has an extremum along one of them it is a pitchfork, else transcritical. A pitchfork is
what is left of a symmetry: in general two branches would miss each other (M. Golubitsky and D. G.
Schaeffer, Singularities and Groups in Bifurcation Theory I, Springer 1985, chapter VI). Of driven
systems with equal stops on both sides that symmetry is q(t + T/2) -> -q(t).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import Leg, StopLeg
from ..continuation.path import Path, SpecialPoint
from .bifurcation import Bifurcation
from .kinds import BifurcationKind, BranchEnd, Branching
from .mirror import own_mirror_image
from .problem import OrbitProblem

# The parameter has an extremum along one of two branches if it changes this much less than along
# the other. Directions come from central differences and are good to about 1e-9.
_FLAT = 1e-6


def bifurcation_at(
    problem: OrbitProblem,
    special: SpecialPoint,
    goes_on: tuple[Leg, ...] | tuple[StopLeg, ...] = (),
) -> Bifurcation:
    """Return a special point of a path as users see it."""
    motion = problem.motion(special.u, special.p)
    other = special.other
    if other is not None:
        other.flags.writeable = False
    return Bifurcation(
        kind=BifurcationKind(special.kind),
        parameter=problem.parameters[0],
        value=float(special.p[0]),
        motion=motion,
        test=special.test,
        test_value=special.value,
        goes_on=goes_on,
        branching=None if other is None else _branching(special.tangent, other, motion),
        other=other,
    )


def _branching(tangent: NDArray[np.float64], other: NDArray[np.float64], motion: Any) -> Branching:
    """Return how two branches with these directions cross."""
    low, high = sorted((abs(float(tangent[-1])), abs(float(other[-1]))))
    if low > _FLAT * high:
        return Branching.TRANSCRITICAL
    return Branching.SYMMETRY_BREAKING if own_mirror_image(motion) else Branching.PITCHFORK


def turns_back(special: SpecialPoint) -> bool:
    """Whether a path has its extremum of the parameter at a pitchfork.

    Beyond it come the images of its points under the symmetry that they have lost.
    """
    if special.other is None:
        return False
    return abs(float(special.tangent[-1])) <= _FLAT * abs(float(special.other[-1]))


def end_of(path: Path) -> BranchEnd:
    """Return why a path ends, as users see it."""
    return path.end if path.stop is None else BifurcationKind(path.stop.kind)
