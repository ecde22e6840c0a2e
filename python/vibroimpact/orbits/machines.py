"""What following a branch asks of a machine: its equations, its motions, its borders."""

from __future__ import annotations

from typing import Any

from ..continuation.path import SpecialPoint
from ..structure import Structure
from ..system import System
from . import resegment, structure_resegment, verdict
from .doubling import doubled
from .problem import OrbitProblem
from .resegment import Crossing
from .structure_problem import StructureProblem, doubled_structure, structure_motion_of
from .undriven import UndrivenProblem, is_undriven


def problem_of(
    system: System | Structure, itinerary: Any, parameters: tuple[str, ...] = ()
) -> OrbitProblem:
    """Return the equations of motions with these legs."""
    if isinstance(system, Structure):
        kind = UndrivenProblem if is_undriven(system) else StructureProblem
        return kind(system, itinerary, parameters)
    return OrbitProblem(system, itinerary, parameters)


def motion_of(system: System | Structure, itinerary: Any, nodes: Any, **options: Any) -> Any:
    """Return the motion with these legs and nodes, with its verdict; see ``verdict.motion_of``."""
    if isinstance(system, Structure):
        return structure_motion_of(system, itinerary, nodes, **options)
    return verdict.motion_of(system, itinerary, nodes, **options)


def beyond(problem: OrbitProblem, border: SpecialPoint) -> Crossing | None:
    """Return how a branch goes on beyond a border, None if it ends there."""
    if isinstance(problem, StructureProblem):
        return structure_resegment.beyond(problem, border)
    return resegment.beyond(problem, border)


def twice(motion: Any) -> tuple[Any, Any, Any]:
    """Return legs and nodes of a motion repeated twice, and the direction that doubles it."""
    return doubled_structure(motion) if isinstance(motion.system, Structure) else doubled(motion)
