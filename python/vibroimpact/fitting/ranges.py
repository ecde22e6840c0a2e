"""The ends of numbers of machines beyond which there is no machine."""

import math
from typing import Any

from ..made import Made

_NOT_NEGATIVE = (
    "mass_ratio",
    "frequency_ratio",
    "drive_frequency",
    "pendulum_damping",
    "oscillator_damping",
    "friction",
)
_NATURAL = {**dict.fromkeys(_NOT_NEGATIVE, (0.0, math.inf)), "restitution": (0.0, 1.0)}
_ANY = (-math.inf, math.inf)


def natural_range(machine: Any, name: str) -> tuple[float, float]:
    """Return the ends of a number of a machine, or of one of its stops.

    Of numbers of a function that makes the machine, and of coordinates, they are infinite.
    """
    if isinstance(machine, Made):
        return _ANY
    what, _, place = name.rpartition("_")
    return _NATURAL.get(what if place.isdigit() else name, _ANY)
