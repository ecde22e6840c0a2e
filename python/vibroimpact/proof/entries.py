"""What the machine of a certificate has, and nothing else: a statement tells all of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from ..errors import ProofError
from ..system import SYMBOLS

_TWO_BODIES: Final = {"kind", "law", "contact", "wall_rests", "numbers"}
_STRUCTURE: Final = {
    *("kind", "law", "mass", "stiffness", "static_load", "drive_amplitude"),
    *("drive_frequency", "phase", "stops"),
}
_STOP: Final = {"normal", "tangent", "gap", "restitution", "friction", "amplitude", "phase"}


def check_entries(machine: Mapping[str, Any]) -> None:
    """Refuse a machine with an entry too many or too few.

    Raises
    ------
    ProofError, KeyError, TypeError : it is damaged
    """
    if machine["kind"] == "two bodies":
        good = set(machine) == _TWO_BODIES and set(machine["numbers"]) == set(SYMBOLS)
    else:
        damping = {"damping"} if "damping" in machine else {"damping_ratios"}
        good = set(machine) == _STRUCTURE | damping
        good = good and all(set(stop) == _STOP for stop in machine["stops"])
    if not good:
        raise ProofError("the machine has other entries")
