"""What a fit looks for: numbers of the machine and of its start, by name, in their ranges."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arguments import in_short, number, pair, reject
from ..errors import ParameterError, StateError
from ..machine import Machine, first_of_each
from ..made import Made, numbers_of, value_of, varied
from .ranges import natural_range

Array = NDArray[np.float64]

START = "start"
"""The word that stands for all coordinates of the start."""


@dataclass(frozen=True)
class Unknowns:
    """Names, ranges and sizes of what is looked for.

    Attributes
    ----------
    names
        Numbers of the machine first, then coordinates of the start.
    machine
        How many of them are numbers of the machine.
    coordinates
        Places in the state of those of the start.
    low, high
        Ends of their ranges, infinite where there are none.
    scales
        What counts as a large change of each: its size, and of a coordinate that of the motion.
    """

    names: tuple[str, ...]
    machine: int
    coordinates: tuple[int, ...]
    low: Array
    high: Array
    scales: Array

    def machine_of(self, machine: Machine, values: Array) -> Any:
        """Return the machine with these values."""
        numbers = values[: self.machine].tolist()
        return varied(machine, dict(zip(self.names[: self.machine], numbers, strict=True)))

    def start_of(self, initial: Array, values: Array) -> Array:
        """Return the start with these values."""
        start = initial.copy()
        start[list(self.coordinates)] = values[self.machine :]
        return start

    def sized(self, values: Array, motion: Array) -> Unknowns:
        """Return them with scales of at least these values, and the sizes of these coordinates."""
        sizes = np.maximum(self.scales, np.abs(values))
        own = slice(self.machine, None)
        sizes[own] = np.maximum(sizes[own], motion[list(self.coordinates)])
        width = self.high - self.low
        return replace(self, scales=np.minimum(sizes, np.where(np.isfinite(width), width, np.inf)))

    def values_of(self, machine: Any, initial: Array) -> Array:
        """Return the values that a machine and its start have."""
        numbers = [value_of(machine, name) for name in self.names[: self.machine]]
        return np.array([*numbers, *initial[list(self.coordinates)]])


def unknowns_of(given: Any, machine: Any, initial: Array) -> Unknowns:
    """Check names, or names with their ranges; ``initial`` is the flat start.

    Raises
    ------
    ParameterError
        For a name that is none, one that stands twice, and a range that is none or leaves out the
        value from which the search starts.
    """
    numbers, coordinates = numbers_of(machine), machine._coordinates_by_name
    known = known_of(machine)
    ranges: dict[str, tuple[float, float]] = {}
    for name, limits in named(given, known):
        many = coordinates if name == START else (name,)
        for each in many:
            if each not in numbers and each not in coordinates:
                reject("unknown", each, known, known=(*numbers, *coordinates, START))
            if each in ranges:
                reject("unknown", each, "each name once")
            low, high = natural_range(machine, each)
            if limits is not None:
                low, high = _range(each, limits, low, high)
            ranges[each] = (low, high)
    if not ranges:
        reject("unknown", given, f"at least one of {known}")
    own = [name for name in ranges if name in numbers]
    start = [name for name in ranges if name in coordinates]
    names = (*own, *start)
    places = tuple(coordinates.index(name) for name in start)
    _need_free(machine, start)
    low, high = np.array([ranges[name] for name in names]).T
    values = np.array([*(value_of(machine, name) for name in own), *initial[list(places)]])
    outside = np.flatnonzero((values < low) | (values > high))
    if len(outside):
        k = int(outside[0])
        if k < len(own):
            # A machine that has no such number at all says so.
            varied(machine, {names[k]: float(np.clip(values[k], low[k], high[k]))})
        scaled = getattr(machine, "scales", None) is not None
        units = ", dimensionless as all numbers of the system" if scaled else ""
        raise ParameterError(
            f"{names[k]} = {values[k].item()!r}, from which the search starts, is not allowed; "
            f"allowed: a number in its range, ({low[k]}, {high[k]}){units}"
        )
    sizes = np.abs(values)
    for k, name in enumerate(names):
        if not isinstance(machine, Made) or name in coordinates:
            sizes[k] = max(sizes[k], machine._least_size(name, initial))
    finite = np.isfinite(high - low)
    width = np.where(finite, high - low, np.inf)
    # Of a number of a function that is 0 nothing but its range tells the size.
    sizes = np.where(sizes > 0.0, np.minimum(sizes, width), width)
    if not np.isfinite(sizes).all():
        k = int(np.flatnonzero(~np.isfinite(sizes))[0])
        reject(f"unknown[{names[k]!r}]", None, "(low, high) for a number whose first guess is 0")
    return Unknowns(names, len(own), places, low, high, sizes)


def _need_free(machine: Any, names: Sequence[str]) -> None:
    """Refuse coordinates of a start that cannot change alone, as of points that few modes move."""
    for name in names:
        alone = np.zeros(len(machine._coordinates_by_name))
        alone[machine._coordinates_by_name.index(name)] = 1.0
        try:
            machine._to_core(alone.reshape(machine._starts_shape))
        except StateError:
            allowed = "a coordinate of the start that can change alone; of a structure with more "
            reject("unknown", name, f"{allowed}points than modes several change together")


def known_of(machine: Machine) -> str:
    """Return in words what can be unknown."""
    if isinstance(machine, Made):
        names, more = (*machine._numbers, *first_of_each(machine._coordinates_by_name)), ""
    else:
        names = (machine._names_in_words,)
        more = f"; any other number by {machine._by_function}"
    return f"{', '.join(names)}, or {START!r} for all of the start{more}"


def named(given: Any, known: str) -> list[tuple[str, Any]]:
    """Return names with their ranges, None where none is given."""
    allowed = f"a list of names, or a mapping from names to (low, high); names: {known}"
    if isinstance(given, str):
        return [(given, None)]
    if isinstance(given, Mapping):
        pairs = list(given.items())
    elif isinstance(given, Sequence):
        pairs = [(name, None) for name in given]
    else:
        reject("unknown", given, allowed)
    for name, _ in pairs:
        if not isinstance(name, str):
            reject("unknown", in_short(name), allowed)
    return pairs


def _range(name: str, limits: Any, least: float, most: float) -> tuple[float, float]:
    """Return a checked range inside of what the machine allows."""
    wanted = f"(low, high), two numbers with low < high, for the unknown {name}"
    low, high = (number(f"unknown[{name!r}]", each, wanted) for each in pair(name, limits, wanted))
    if not low < high:
        reject(f"unknown[{name!r}]", limits, wanted)
    if low < min(least, 0.0) or high > most:
        reject(f"unknown[{name!r}]", limits, f"a range inside [{min(least, 0.0):g}, {most:g}]")
    # Numbers that are not 0 have a least value in its place.
    return max(low, least), high
