"""From a piece of a branch to the tubes that cover it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from flint import arb, arb_mat
from numpy.typing import NDArray

from .formulas import Undecided
from .tube import Family, Image, Tube, derivative, image, near_inverse

Array = NDArray[np.float64]

#: Half lengths of tubes, as a part of the size of Y: the first one, the longest, the shortest.
_FIRST, _LONGEST, _SHORTEST = 1e-3, 0.05, 1e-9
#: Least radius of a tube as a part of its half length, attempts at its radius, the room that K is
#: given, and the part by which tubes overlap.
_THIN, _WIDENINGS, _ROOM, _OVERLAP = 2.0**-12, 3, 1.5, 1.2


def exact(values: Sequence[float] | Array) -> list[arb]:
    """Doubles as balls."""
    return [arb(float(x)) for x in values]


def direction_at(family: Family, y: Sequence[arb], before: Array) -> Array:
    """The unit direction of the branch, in the sense of another one."""
    size = len(y)
    none = Tube(list(y), exact(before), arb(0), [arb(0)] * size)
    matrix = near_inverse(derivative(family, none, y))
    column = np.array([float(matrix[i, size - 1].mid()) for i in range(size)])
    return column / np.linalg.norm(column)


def corrected(family: Family, y: Sequence[arb], direction: Array) -> list[arb]:
    """The solution in the plane across the branch at y."""
    tube = Tube(list(y), exact(direction), arb(0), [arb(0)] * len(y))
    z, near = list(y), None
    for _ in range(12):
        if near is None:
            near = near_inverse(derivative(family, tube, z))
        rest = [*family.at(z[-1]).residual(z[:-1])]
        plane = sum((s * (a - b) for s, a, b in zip(tube.direction, z, y, strict=True)), arb(0))
        step = (near * arb_mat(len(z), 1, [*rest, plane])).entries()
        z = [(a - d).mid() for a, d in zip(z, step, strict=True)]
        if max(abs(float(d.mid())) for d in step) < 1e-22:
            return z
    raise Undecided("Newton's method does not converge")


def tube_from(
    family: Family, y: Sequence[arb], direction: Array, half: float
) -> tuple[Tube, Image]:
    """A tube that begins at a point of the branch, as long as can be shown, and its K."""
    while half > _SHORTEST:
        try:
            ahead = [a + s * arb(half) for a, s in zip(y, exact(direction), strict=True)]
            centre = corrected(family, ahead, direction)
            turned = exact(direction_at(family, centre, direction))
            radius = [arb(half * _THIN)] * len(y)
            for _ in range(_WIDENINGS):
                tube = Tube(centre, turned, arb(half * _OVERLAP), radius)
                found = image(family, tube)
                if found.inside:
                    return tube, found
                radius = [(_ROOM * abs(x)).upper() + r for x, r in zip(found.away, thin(half, y), strict=True)]
        except Undecided:
            pass
        half /= 2
    raise Undecided("no tube is shown")


def thin(half: float, y: Sequence[arb]) -> list[arb]:
    """The least radii."""
    return [arb(half * _THIN)] * len(y)
