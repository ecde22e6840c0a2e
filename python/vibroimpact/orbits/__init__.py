"""Periodic motions: found, judged, and followed over parameters (orbits page).

Residuals, their derivatives and test functions are kernels of the compiled core; this package uses
them for Newton's method from simulations (`shooting`), verdicts (`motion`), branches with their
bifurcations and borders, borders in two parameters, manifolds of saddles.
"""

from .._core import Border, BorderKind, Condition, Leg, LegEnd, LegKind, StopCondition, StopLeg
from ..continuation.names import PathEnd
from .bifurcation import Bifurcation
from .borders import bifurcation_curve
from .branch import Branch, Piece
from .branches import follow_motion, switch_branch
from .curve import BifurcationCurve, CodimensionTwo
from .found import MotionSearch, NotFound
from .kinds import BifurcationKind, Branching
from .manifold import ManifoldSide, UnstableManifold
from .manifolds import unstable_manifold
from .motion import PeriodicMotion
from .nonsmooth import nonsmooth_mode
from .region import StabilityRegion
from .regions import stability_region
from .shooting import periodic_motion, search_motions
from .structure_piece import StructurePiece

__all__ = [
    "Bifurcation",
    "BifurcationCurve",
    "BifurcationKind",
    "Border",
    "BorderKind",
    "Branch",
    "Branching",
    "CodimensionTwo",
    "Condition",
    "Leg",
    "LegEnd",
    "LegKind",
    "ManifoldSide",
    "MotionSearch",
    "NotFound",
    "PathEnd",
    "PeriodicMotion",
    "Piece",
    "StabilityRegion",
    "StopCondition",
    "StopLeg",
    "StructurePiece",
    "UnstableManifold",
    "bifurcation_curve",
    "follow_motion",
    "nonsmooth_mode",
    "periodic_motion",
    "search_motions",
    "stability_region",
    "switch_branch",
    "unstable_manifold",
]
