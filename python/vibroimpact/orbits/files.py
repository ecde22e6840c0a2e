"""A periodic motion in a file: its nodes and legs; the verdict is found again when it is read."""

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core, archive
from ..system import System
from .motion import PeriodicMotion
from .verdict import motion_of


def write_motion(path: str | os.PathLike[str], motion: PeriodicMotion) -> None:
    """Write a motion to ``path`` (.npz); the file appears complete or not at all."""
    metadata = {
        "system": motion.system.to_dict(),
        "legs": [str(leg) for leg in motion.legs],
        "m": motion.m,
        "clocks": list(motion.clocks),
        "wall_at_rest": motion.wall_at_rest,
        "error": motion.error,
    }
    archive.write(path, "motion", metadata, {"nodes": motion.nodes})


def read_motion(path: str | os.PathLike[str]) -> PeriodicMotion:
    """Read what ``write_motion`` has written.

    Raises
    ------
    ValueError
        If the file is damaged, foreign, or holds something else.
    """
    return archive.read(path, {"motion": motion_from_parts})


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
