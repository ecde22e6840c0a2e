"""Why a path ends, and the test functions that every path has."""

from enum import StrEnum


class PathEnd(StrEnum):
    """Why a path ends."""

    BOUND = "bound"  # on a bound of a parameter
    POINTS = "points"  # as many as allowed
    CLOSED = "closed"  # back at the start, which is the last point once more
    STOPPED = "stopped"  # at a special point of a kind asked for: ``path.stop``
    MIRRORED = "mirror image"  # at a pitchfork: the images of its points would follow
    START = "start"  # where it began: it goes on the other way only
    REFUSED = "refused"  # the next point is none that was asked for
    NO_CONVERGENCE = "no convergence"
    OUTSIDE_DOMAIN = "outside domain"
    INTERRUPTED = "interrupted"


class OwnTest(StrEnum):
    """A test function that a path has of itself, beside those of its problem."""

    FOLD = "fold"
    BRANCH_POINT = "branch_point"
    # On curves in two parameters: an extremum of either.
    TURNING_POINT_1 = "turning_point: 1"
    TURNING_POINT_2 = "turning_point: 2"
    CUSP = "cusp"

    @property
    def kind(self) -> str:
        """The kind of its zeros."""
        return "turning_point" if self in TURNING_POINTS else self.value


TURNING_POINTS = (OwnTest.TURNING_POINT_1, OwnTest.TURNING_POINT_2)
