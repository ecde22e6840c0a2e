"""Periodic motions: found, judged, and followed over parameters (docs/orbits.md).

Residuals, their derivatives and test functions are kernels of the compiled core; what is done with
them stands here, in this order: newton, path, branching, step, special, tracing, continuation,
curves (continuation of any equations); motion, map_bifurcations, problem (periodicity), friction,
shooting (motions from simulations); ranges, branch, doubling, resegment, following, branches,
curve_problem, borders (bifurcations in one and two parameters), border_walk, regions (borders of
stability), saddle, manifold_growth, manifolds; intervals, enclosed_flight, algebraic, open_phase,
fixed_flight, solutions, single_impact, motion_map (all motions with one impact and no friction).
"""

from .borders import BifurcationCurve, CodimensionTwo, bifurcation_curve
from .branch import Bifurcation, Branch, Piece
from .branches import follow_motion, switch_branch
from .manifolds import ManifoldSide, UnstableManifold, unstable_manifold
from .motion import PeriodicMotion
from .motion_map import MotionMap, motion_map
from .regions import StabilityRegion, stability_region
from .shooting import MotionSearch, NotFound, periodic_motion, search_motions
from .single_impact import PeriodicMotions, Undecided, periodic_motions

__all__ = [
    "Bifurcation",
    "BifurcationCurve",
    "Branch",
    "CodimensionTwo",
    "ManifoldSide",
    "MotionMap",
    "MotionSearch",
    "NotFound",
    "PeriodicMotion",
    "PeriodicMotions",
    "Piece",
    "StabilityRegion",
    "Undecided",
    "UnstableManifold",
    "bifurcation_curve",
    "follow_motion",
    "motion_map",
    "periodic_motion",
    "periodic_motions",
    "search_motions",
    "stability_region",
    "switch_branch",
    "unstable_manifold",
]
