"""What of a structure is drawn: a coordinate, or a sum or difference of coordinates, by name.

Columns of several numbers are named with a number, as in data frames: ``q_1``, ``v_pre_0``. Such
names may be added and subtracted: ``q_0-q_1`` is how far one body is from another.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from ..arguments import count, reject
from ..hints import close_to
from ..structure import Structure
from .axis_names import coordinate_symbol, of_coordinates

Array = NDArray[np.float64]

_TERM = re.compile(r"([+-]?)([a-z_]+)_(0|[1-9][0-9]*)")
# Of more coordinates an error names the first and the last.
_LISTED = 4
# Rows that differ by so much of their size are multiples of each other.
_SAME = 1e-12


class Combination(NamedTuple):
    """A sum of coordinates with signs: 1 or -1, and the place of each."""

    terms: tuple[tuple[int, int], ...]

    def of(self, values: NDArray[Any]) -> Array:
        """Return it for coordinates along the last axis; of a single one without rounding."""
        parts = [sign * values[..., place] for sign, place in self.terms]
        total: Array = parts[0]
        for part in parts[1:]:
            total = total + part
        return total

    def row(self, size: int) -> Array:
        """Return it as a row of a structure of so many coordinates."""
        row = np.zeros(size)
        for sign, place in self.terms:
            row[place] += sign
        return row

    def symbol(self, what: str) -> str:
        """Return its symbol, without the signs of mathematics around it."""
        text = ""
        for sign, place in self.terms:
            text += (" - " if sign < 0 else " + ") if text else ("-" if sign < 0 else "")
            text += coordinate_symbol(what, place)
        return text

    def name(self, column: str) -> str:
        """Return the name by which it is asked for."""
        text = ""
        for sign, place in self.terms:
            text += f"{'-' if sign < 0 else '+' if text else ''}{column}_{place}"
        return text

    def met_by(self, normal: Array) -> bool:
        """Whether a stop with this normal acts on one of its coordinates."""
        return any(normal[place] != 0.0 for _, place in self.terms)


def axis_of(shown: Sequence[Combination], what: str) -> str:
    """Return the label of an axis of coordinates "q", or of velocities "v", "v_pre" ..."""
    several = any(len(each.terms) > 1 for each in shown)
    return of_coordinates(what, [each.symbol(what) for each in shown], several=several)


def single(place: int) -> Combination:
    """Return a coordinate alone."""
    return Combination(((1, place),))


def named(name: str, columns: Sequence[str], size: int) -> tuple[str, Combination] | None:
    """Return the column and the coordinates of a name, None if it is none of these columns."""
    text = name.replace(" ", "")
    found = [*_TERM.finditer(text)]
    if not found or "".join(match[0] for match in found) != text:
        return None
    if any(match[1] == "" for match in found[1:]):
        return None
    used = {match[2] for match in found}
    places = [int(match[3]) for match in found]
    if len(used) != 1 or not used <= {*columns} or max(places) >= size:
        return None
    if len({*places}) < len(places):
        return None
    signs = [-1 if match[1] == "-" else 1 for match in found]
    return used.pop(), Combination(tuple(zip(signs, places, strict=True)))


def asked(
    argument: str, name: Any, size: int, *, wide: Sequence[str], narrow: Sequence[str] = ()
) -> tuple[str, Combination | None]:
    """Return what a name means: a column of single numbers, or one of N and which coordinates.

    Raises
    ------
    ParameterError
        If it means nothing.
    """
    if isinstance(name, str):
        if name in narrow:
            return name, None
        if (found := named(name, wide, size)) is not None:
            return found
    _refuse(argument, name, size, wide, narrow)


def _refuse(
    argument: str, name: Any, size: int, wide: Sequence[str], narrow: Sequence[str]
) -> NoReturn:
    known, words = [*narrow], [*narrow]
    for column in wide:
        names = [f"{column}_{place}" for place in range(size)]
        known += names
        words += names if size <= _LISTED else [f"{names[0]} ... {names[-1]}"]
    hint = close_to(name, known) if isinstance(name, str) else ""
    also = f", or a difference, as {wide[0]}_0-{wide[0]}_1" if size > 1 else ""
    reject(argument, name, f"one of {', '.join(words)}{also}{hint}")


def in_section(
    value: Any,
    coordinate: Any,
    structure: Structure,
    *,
    wide: Sequence[str],
    narrow: Sequence[str],
    usual: str,
) -> tuple[str, Combination | None]:
    """Return what of a section is drawn: its column, and of one of N numbers which coordinates.

    It is named in full, as ``q_0-q_1``, or by its column and the number of a coordinate.

    Raises
    ------
    ParameterError
        For another name, and for a coordinate that there is not.
    """
    size = structure.coordinates
    place = 0 if coordinate is None else count("coordinate", coordinate, least=0, most=size - 1)
    value = usual if value is None else value
    if isinstance(value, str) and value in wide:
        return value, single(place)
    return asked("value", value, size, wide=wide, narrow=(*narrow, *wide))


def multiple_of(row: Array, normal: Array) -> float:
    """Return c where the normal of a stop is c times a row, 0 where it is no multiple."""
    first = int(np.flatnonzero(row)[0])
    factor = float(normal[first] / row[first])
    away = float(np.abs(normal - factor * row).max())
    return factor if away <= _SAME * float(np.abs(normal).max()) else 0.0
