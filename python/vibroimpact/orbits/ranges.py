"""Checks of the one or two parameters over which a motion is followed, with their ranges."""

from collections.abc import Mapping
from typing import Any

from .._core import PARAMETERS
from ..arguments import number, pair, reject
from ..errors import ParameterError
from ..system import System

# Largest ends of a range: their products and squares must be finite floats.
_WIDEST = 1e100
# The longest step, as part of the ranges: from there it is halved until it fits.
LONGEST_STEP = 1000.0

Range = tuple[float, float]
Bounds = tuple[Range, Range]


def one_range(system: System, parameters: Mapping[str, Any]) -> tuple[str, Range]:
    """Return the name of the one parameter and its range."""
    if len(parameters) != 1:
        given = ", ".join(parameters) or "none"
        raise ParameterError(f"give exactly one parameter with its range, got {given}")
    ((name, bounds),) = parameters.items()
    return name, range_around(system, name, bounds)


def two_ranges(system: System, parameters: Mapping[str, Any]) -> tuple[tuple[str, str], Bounds]:
    """Return the names of the two parameters and their ranges."""
    if len(parameters) != 2:
        given = ", ".join(parameters) or "none"
        raise ParameterError(f"give exactly two parameters with their ranges, got {given}")
    first, second = parameters
    one, other = (range_around(system, name, parameters[name]) for name in (first, second))
    return (first, second), (one, other)


def range_around(system: System, name: str, bounds: Any) -> Range:
    """Check a range of a parameter that contains its value."""
    if name not in PARAMETERS:
        reject("parameter", name, f"one of {', '.join(PARAMETERS)}")
    value = getattr(system, name)
    allowed = f"a range (low, high) around {value}, within +-{_WIDEST:g}"
    low, high = pair(name, bounds, allowed)
    low, high = number(name, low, allowed), number(name, high, allowed)
    if not -_WIDEST <= low <= value <= high <= _WIDEST or low == high:
        reject(name, (low, high), allowed)
    return low, high
