"""Special points and ends of a path of solutions, as users see them."""

from .._core import Leg, StopLeg
from ..continuation.path import Path, SpecialPoint
from .branch import Bifurcation
from .kinds import BifurcationKind, BranchEnd
from .problem import OrbitProblem


def bifurcation_at(
    problem: OrbitProblem,
    special: SpecialPoint,
    goes_on: tuple[Leg, ...] | tuple[StopLeg, ...] = (),
) -> Bifurcation:
    """Return a special point of a path as users see it."""
    return Bifurcation(
        kind=BifurcationKind(special.kind),
        parameter=problem.parameters[0],
        value=float(special.p[0]),
        motion=problem.motion(special.u, special.p),
        test=special.test,
        test_value=special.value,
        goes_on=goes_on,
    )


def end_of(path: Path) -> BranchEnd:
    """Return why a path ends, as users see it."""
    return path.end if path.stop is None else BifurcationKind(path.stop.kind)
