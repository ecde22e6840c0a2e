"""Periodic motions in files.

Of a System nodes and legs are kept, and the verdict is found again when they are read. Of a
structure all numbers are: where stops stay closed for a while there are no legs.
"""

import json
import math
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core, archive
from ..structure import Structure
from ..structure_motion import StructureOrbit
from ..system import System
from .motion import PeriodicMotion
from .verdict import motion_of

Parts = tuple[dict[str, Any], dict[str, NDArray[Any]]]
# Of the motion of a structure.
_NUMBERS = ("m", "n", "residual", "error", "stability", "admissible", "why_not")
_ARRAYS = ("state", "impacts", "derivative", "multipliers", "nodes")


def write_motion(path: str | os.PathLike[str], motion: PeriodicMotion | StructureOrbit) -> None:
    """Write a motion to ``path`` (.npz); the file appears complete or not at all."""
    if isinstance(motion, StructureOrbit):
        words, arrays = structure_parts(motion)
        fields = json.loads(motion.system.to_json())
        archive.write(path, motion._KIND, {"system": fields, **words}, arrays)
        return
    metadata = {
        "system": motion.system.to_dict(),
        "legs": [str(leg) for leg in motion.legs],
        "m": motion.m,
        "clocks": list(motion.clocks),
        "wall_at_rest": motion.wall_at_rest,
        "error": motion.error,
    }
    archive.write(path, motion._KIND, metadata, {"nodes": motion.nodes})


def read_motion(path: str | os.PathLike[str], kind: str) -> Any:
    """Read what ``write_motion`` has written of a kind of motion.

    Raises
    ------
    ValueError
        If the file is damaged, foreign, or holds something else.
    """
    builders: dict[str, archive.Builder[Any]] = {
        PeriodicMotion._KIND: motion_from_parts,
        StructureOrbit._KIND: structure_motion_from_parts,
    }
    return archive.read(path, {kind: builders[kind]})


def motion_from_parts(
    metadata: dict[str, Any], arrays: dict[str, NDArray[np.float64]]
) -> PeriodicMotion:
    """Build a motion from the content of an archive."""
    legs = [_core.Leg.from_text(leg) for leg in metadata["legs"]]
    itinerary = _core.Itinerary(legs, metadata["m"], metadata["clocks"], metadata["wall_at_rest"])
    return motion_of(
        System.from_dict(metadata["system"]),
        itinerary,
        arrays["nodes"],
        error=float(metadata["error"]),
        whole=True,
    )


def structure_motion_from_parts(
    metadata: dict[str, Any], arrays: dict[str, NDArray[Any]]
) -> StructureOrbit:
    """Build the motion of a structure from the content of an archive."""
    structure = Structure.from_json(json.dumps(metadata["system"]))
    return structure_orbit_of(structure, metadata, arrays)


def structure_parts(motion: StructureOrbit) -> Parts:
    """Return the words and arrays of the motion of a structure, but for the structure."""
    numbers = {name: getattr(motion, name) for name in _NUMBERS}
    # As columns have it: JSON knows no infinity.
    numbers["n"] = -1 if math.isinf(motion.n) else motion.n
    legs = [[str(leg) for leg in motion.legs], list(motion.clocks)]
    arrays = {f"motion_{name}": getattr(motion, name) for name in _ARRAYS}
    return {"of_structure": numbers, "stop_legs": legs}, arrays


def structure_orbit_of(
    structure: Structure, words: dict[str, Any], arrays: dict[str, NDArray[Any]]
) -> StructureOrbit:
    """Build the motion of a structure from what `structure_parts` has returned."""
    own: dict[str, Any] = {name: arrays[f"motion_{name}"] for name in _ARRAYS}
    own |= words["of_structure"]
    if own["n"] == -1:
        own["n"] = math.inf
    legs, clocks = words["stop_legs"]
    return StructureOrbit(
        system=structure,
        legs=tuple(map(_core.StopLeg.from_text, legs)),
        clocks=tuple(clocks),
        **own,
    )
