"""From a piece of a branch to the tubes that cover it: the search, of which nothing is trusted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb, arb_mat
from numpy.typing import NDArray

from .chain import is_known
from .files import text
from .formulas import Undecided
from .tube import (
    TERMS,
    Family,
    Image,
    Slice,
    Tube,
    derivative,
    image,
    near_inverse,
    point_at,
    slices,
)

Array = NDArray[np.float64]

#: Half lengths of tubes, as a part of the length of the piece: the first, the longest, the shortest
#: for a verdict, and the shortest.
_FIRST, _LONGEST, _FINEST, _SHORTEST = 1e-3, 0.1, 1e-5, 1e-9
#: Least radius of a tube as a part of its half length, attempts at its radius, the room that K is
#: given, and the part by which tubes overlap.
_THIN, _WIDENINGS, _ROOM, _OVERLAP = 2.0**-12, 3, 1.5, 1.25
#: Steps of Newton's method, and where they end.
_STEPS, _SMALL = 12, 1e-22
#: Tubes beyond the last point, and how far from it they are, as a part of the length.
_MOST_BEYOND, _NEAR = 8, 0.5
#: Slices of a tube.
_SLICES = (4, 16)


@dataclass(frozen=True)
class Step:
    """A tube, from where to where along it the branch was looked at, and what is shown there."""

    tube: Tube
    until: arb
    told: list[Slice]

    def posed(self) -> dict[str, Any]:
        """As certificates write it."""
        tube = self.tube
        return {
            "line": [[text(x) for x in row] for row in tube.line],
            "half": text(tube.half),
            "radius": [text(x) for x in tube.radius],
            "until": text(self.until),
            "slices": len(self.told),
        }


def exact(values: Sequence[float] | Array) -> list[arb]:
    """Doubles as balls."""
    return [arb(float(x)) for x in values]


def direction_at(family: Family, y: Sequence[arb], before: Array) -> Array:
    """The unit direction of the branch, in the sense of another one."""
    size = len(y)
    matrix = near_inverse(derivative(family, exact(before), y))
    column = np.array([float(matrix[i, size - 1].mid()) for i in range(size)])
    unit: Array = column / np.linalg.norm(column)
    return unit


def corrected(family: Family, y: Sequence[arb], direction: Array) -> list[arb]:
    """The solution in the plane across the branch at y."""
    across, z, near = exact(direction), list(y), None
    for _ in range(_STEPS):
        if near is None:
            near = near_inverse(derivative(family, across, z))
        rest = family.at(z[-1]).residual(z[:-1])
        plane = sum((s * (a - b) for s, a, b in zip(across, z, y, strict=True)), arb(0))
        step = (near * arb_mat(len(z), 1, [*rest, plane])).entries()
        z = [(a - d).mid() for a, d in zip(z, step, strict=True)]
        size = max(abs(float(d.mid())) for d in step)
        if size < _SMALL:
            return z
        if size > 1e-6:
            near = None
    raise Undecided("Newton's method does not converge")


def line_through(family: Family, y: Sequence[arb], direction: Array) -> list[list[arb]]:
    """The power series of the branch about a point of it, order by order."""
    line = [list(y), exact(direction)]
    near = near_inverse(derivative(family, line[1], y))
    for k in range(2, TERMS):
        tube = Tube(line, arb(0), [arb(0)] * len(y))
        rest = family.residual(tube.series(arb(0), tube.radius), TERMS)[k]
        change = (near * arb_mat(len(y), 1, [*rest.entries(), arb(0)])).entries()
        line.append([-x.mid() for x in change])
    return line


def tube_from(
    family: Family, y: Sequence[arb], direction: Array, half: float
) -> tuple[Tube, Image, float]:
    """A tube that begins at a point of the branch, as long as can be shown; K; half its length."""
    while half > _SHORTEST:
        try:
            ahead = [a + s * arb(half) for a, s in zip(y, exact(direction), strict=True)]
            centre = corrected(family, ahead, direction)
            line = line_through(family, centre, direction_at(family, centre, direction))
            thin = arb(half * _THIN)
            radius = [thin] * len(y)
            for _ in range(_WIDENINGS):
                tube = Tube(line, arb(half * _OVERLAP), [r.mid() for r in radius])
                found = image(family, tube)
                if found.inside:
                    return tube, found, half
                radius = [(_ROOM * abs(x)).upper() + thin for x in found.away]
        except (Undecided, ValueError, ZeroDivisionError):
            pass
        half /= 2
    raise Undecided("no tube is shown")


def walk(family: Family, points: Array) -> Iterator[Step]:
    """The tubes along points of a branch, in rows (z, p), from the first to the last.

    Raises
    ------
    Undecided : there is no way on
    """
    ends = points[[0, -1]]
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    direction = points[1] - points[0]
    direction /= np.linalg.norm(direction)
    y = corrected(family, exact(points[0]), direction)
    direction = direction_at(family, y, direction)
    half, before, gone, beyond = _FIRST * length, None, 0.0, 0
    while True:
        tube, found, half = tube_from(family, y, direction, min(half, _LONGEST * length))
        lo = -tube.half if before is None else tube.place(before)
        if lo is None:
            half /= 2
            if half < _SHORTEST:
                raise Undecided("two tubes are not joined")
            continue
        hi = arb(half)
        told: list[Slice] = []
        for count in _SLICES:
            told = slices(family, tube, found, count, lo, hi)
            if all(map(is_known, told)):
                break
        else:
            if half > _FINEST * length:
                half /= 2
                continue
        yield Step(tube, hi, told)
        before = point_at(family, tube, found, hi)
        gone += 2 * half
        direction = np.array([float(x.mid()) for x in tube.coefficients(hi, 1)])
        direction /= np.linalg.norm(direction)
        y = [x.mid() for x in before]
        place = np.array([float(x) for x in y])
        # past the last point, and near it; a border there is shown from both sides
        past = float((place - ends[1]) @ direction) > 0.0
        beyond += past and bool(np.linalg.norm(place - ends[1]) < _NEAR * length)
        if beyond > _MOST_BEYOND or (beyond and is_known(told[-1])):
            return
        if gone > 3 * length:
            raise Undecided("the branch leads elsewhere")
        half *= 1.5
