"""The ends of numbers of machines beyond which there is no machine."""

import math
from typing import Any

from ..made import Made
from ..restitution import OF_SPEEDS, OF_VALUES
from ..stop import of_one_stop

_NOT_NEGATIVE = (
    "mass_ratio",
    "frequency_ratio",
    "drive_frequency",
    "pendulum_damping",
    "oscillator_damping",
    "friction",
)
# Numbers of curves of restitution are not 0.
_LEAST_OF_CURVE = 1e-6
_NATURAL = {
    **dict.fromkeys(_NOT_NEGATIVE, (0.0, math.inf)),
    "restitution": (0.0, 1.0),
    **dict.fromkeys(("r_low", "exponent", *OF_VALUES), (_LEAST_OF_CURVE, 1.0)),
    **dict.fromkeys(("least_speed", *OF_SPEEDS), (_LEAST_OF_CURVE, math.inf)),
}
_ANY = (-math.inf, math.inf)


def natural_range(machine: Any, name: str) -> tuple[float, float]:
    """Return the ends of a number of a machine, or of one of its stops.

    Of numbers of a function that makes the machine, and of coordinates, they are infinite.
    """
    if isinstance(machine, Made):
        return _ANY
    one = of_one_stop(name)
    return _NATURAL.get(one.what if one else name, _ANY)
