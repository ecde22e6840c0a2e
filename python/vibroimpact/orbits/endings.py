"""Why a branch does not go on, in a sentence for people, and what leads on."""

from ..continuation.names import PathEnd
from .kinds import BifurcationKind, BranchEnd

# What is done at the end of a branch whose next motion is not known.
_SIMULATE = "a run from its last motion, at the next value, shows what follows"

_ENDS: dict[BranchEnd, str] = {
    PathEnd.POINTS: "there are as many points as max_points allows: a larger one leads on",
    PathEnd.REFUSED: f"the next solution is no motion: {{detail}}; {_SIMULATE}",
    PathEnd.NO_CONVERGENCE: "Newton's method finds no next motion, however short the step "
    f"({{detail}}); another max_step may pass, and {_SIMULATE}",
    PathEnd.OUTSIDE_DOMAIN: f"the equations of the motion do not exist beyond ({{detail}}); "
    f"{_SIMULATE}",
    PathEnd.MIRRORED: "it closes onto its mirror image: beyond this pitchfork come the images of "
    "the motions before it, with the same bifurcations; switch_branch there leads on to the "
    "motions that have the symmetry",
    PathEnd.INTERRUPTED: "Ctrl-C came first: the last motion can be followed on",
    BifurcationKind.PERIOD_DOUBLING: "the two halves of the motion have become the same, a motion "
    "of half the period: following that one leads on",
    BifurcationKind.GRAZING: "a flight grazes a stop, and neither with this touch nor without it "
    f"the motion goes on; {_SIMULATE}",
    BifurcationKind.REGIME_BORDER: "an impact is at the edge of its regime, and in the next regime "
    f"the motion does not go on; {_SIMULATE}",
    BifurcationKind.CHATTER_ONSET: "beyond, chatter is incomplete, and infinitely many sequences "
    f"of impacts follow one another; {_SIMULATE}",
    BifurcationKind.CONTACT_BORDER: "a lasting contact changes here, and no sequence of legs with "
    f"which the motion goes on was found; {_SIMULATE}",
}
# Ends that need no reason: all that was asked for is done.
_DONE = (PathEnd.BOUND, PathEnd.CLOSED, PathEnd.START)


def why_ended(end: BranchEnd, detail: str) -> str:
    """Return why a branch ends and what leads on; ``""`` where nothing is missing."""
    return "" if end in _DONE else _ENDS[end].format(detail=detail or "no further reason")
