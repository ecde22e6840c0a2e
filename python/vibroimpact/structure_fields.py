"""Checks of the fields of a structure: type, shape and finiteness; the core checks the ranges."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arguments import complex_vector, matrix, parameter, reject, vector
from .by_value import fixed
from .errors import warn
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


def drive_of_pairs(given: Any) -> Any:
    """Return a drive amplitude whose complex numbers are pairs, as text can hold them.

    An entry is a number, or a pair of real and imaginary part. What is no list is left as it is.

    Raises
    ------
    ParameterError
        Names an entry that is neither.
    """
    if not isinstance(given, list) or not any(isinstance(entry, list) for entry in given):
        return given
    allowed = "a number, or a pair [real part, imaginary part]"
    amplitude: list[complex] = []
    for place, entry in enumerate(given):
        pair = entry if isinstance(entry, list) else [entry, 0.0]
        if len(pair) != 2 or not all(type(part) in (int, float) for part in pair):
            reject(f"drive_amplitude[{place}]", entry, allowed)
        try:
            amplitude.append(complex(*pair))
        except OverflowError:
            reject(f"drive_amplitude[{place}]", entry, allowed)
    return amplitude


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
        of_modes = "; damping_ratios= takes numbers of the modes"
        fields["damping"] = fixed(
            matrix("damping", damping, rows=count, columns=count, more=of_modes)
        )
    if ratios is not None:
        fields["damping_ratios"] = fixed(
            vector("damping_ratios", ratios, length=modes, spread=True)
        )
    for name, check in (("static_load", vector), ("drive_amplitude", complex_vector)):
        load = np.zeros(count) if fields[name] is None else fields[name]
        fields[name] = fixed(check(name, load, length=count))
    for name in ("drive_frequency", "phase"):
        fields[name] = parameter(name, fields[name])
    for name, known in CHOICES.items():
        choice = fields[name]
        if not isinstance(choice, str) or choice not in known:
            reject(name, choice, ", ".join(f"{one!r} ({what})" for one, what in known.items()))
    fields["stops"] = checked_stops(fields["stops"], count)
    return fields


def warn_of_ratios(ratios: NDArray[np.float64] | None) -> None:
    """Warn of damping ratios at which a mode does not oscillate: per cent are meant, perhaps."""
    over = [] if ratios is None else np.flatnonzero(ratios >= 1.0).tolist()
    if ratios is not None and over:
        ratio = float(ratios[over[0]])
        warn(
            f"damping_ratios[{over[0]}] = {ratio:g}: from 1 on a mode does not oscillate; "
            f"{ratio:g} per cent are {0.01 * ratio:g}"
        )
