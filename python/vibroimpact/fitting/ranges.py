"""The ends of numbers of machines beyond which there is no machine."""

import math
from typing import Any

from ..made import Made
from ..restitution import OF_SPEEDS, OF_VALUES
from ..stop import of_one_stop
from ..structure import Structure

_NOT_NEGATIVE = (
    "mass_ratio",
    "frequency_ratio",
    "drive_frequency",
    "pendulum_damping",
    "oscillator_damping",
    "friction",
)
# Numbers of curves of restitution are not 0; neither is the friction of a stop of a structure, in
# whose motion slip plays no part without any.
_LEAST = 1e-6
_NATURAL = {
    **dict.fromkeys(_NOT_NEGATIVE, (0.0, math.inf)),
    "restitution": (0.0, 1.0),
    **dict.fromkeys(("r_low", "exponent", *OF_VALUES), (_LEAST, 1.0)),
    **dict.fromkeys(("least_speed", *OF_SPEEDS), (_LEAST, math.inf)),
}
_ANY = (-math.inf, math.inf)


def natural_range(machine: Any, name: str) -> tuple[float, float]:
    """Return the ends of a number of a machine, or of one of its stops.

    Of numbers of a function that makes the machine, and of coordinates, they are infinite.
    """
    if isinstance(machine, Made):
        return _ANY
    one = of_one_stop(name)
    what = one.what if one else name
    if what == "friction" and isinstance(machine, Structure):
        return (_LEAST, math.inf)
    return _NATURAL.get(what, _ANY)
