"""Checks of the fields of a structure: type, shape and finiteness; the core checks the ranges."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from .arguments import complex_vector, matrix, number, reject, vector
from .by_value import fixed
from .stop import checked_stops

# What each choice means, for the error about another one.
CHOICES = {
    "law": {
        "poisson": "ratio of impulses",
        "newton": "ratio of velocities",
        "energetic": "ratio of works, Stronge's",
    },
    "simultaneous": {
        "stop": "the run ends",
        "sequence": "one after another",
        "together": "all at once, without friction",
    },
}


def checked_fields(given: Mapping[str, Any], *, count: int, modes: int) -> dict[str, Any]:
    """Return the fields of a structure with ``count`` physical coordinates and ``modes`` modes.

    Raises
    ------
    ParameterError
        Names the field, its value and what is allowed.
    """
    fields = dict(given)
    damping, ratios = fields["damping"], fields["damping_ratios"]
    if damping is not None and ratios is not None:
        reject("damping_ratios", ratios, "None beside damping=")
    if damping is not None:
        fields["damping"] = fixed(matrix("damping", damping, rows=count, columns=count))
    if ratios is not None:
        fields["damping_ratios"] = fixed(vector("damping_ratios", ratios, length=modes))
    for name, check in (("static_load", vector), ("drive_amplitude", complex_vector)):
        load = np.zeros(count) if fields[name] is None else fields[name]
        fields[name] = fixed(check(name, load, length=count))
    for name in ("drive_frequency", "phase"):
        fields[name] = number(name, fields[name])
    for name, known in CHOICES.items():
        choice = fields[name]
        if not isinstance(choice, str) or choice not in known:
            reject(name, choice, ", ".join(f"{one!r} ({what})" for one, what in known.items()))
    fields["stops"] = checked_stops(fields["stops"], count)
    return fields
