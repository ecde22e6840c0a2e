"""A set that holds the exact state and turns with the motion, against the wrapping of balls.

Balls of the coordinates are a box. A step of the motion slants it, the next box goes around the
slanted body, and so on: the radii grow from step to step, by two to five bits, on a motion that
contracts as well (the wrapping effect). So the state x is enclosed a second time, as in Lohner's
method, by
    x in c + Q r,   c a point, Q an almost orthogonal matrix, r a small box about 0.
The mean value theorem takes it through a step F:
    F(x) in F(c) + D Q r,   D >= all DF about c and x (balls),
and the next Q are the axes of D Q, longest first (a QR factorisation). F(c) is as narrow as the
precision allows, and the box grows along each axis by what the motion does there: by its Lyapunov
exponents. D needs few bits, since r is small.

R. J. Lohner, Computation of guaranteed enclosures for the solutions of ordinary initial and
boundary value problems, 1992; N. S. Nedialkov & K. R. Jackson, A new perspective on the wrapping
effect in interval methods for initial value problems for ODEs, 2001.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import mul

from flint import arb, arb_mat, ctx

#: Bits of derivatives and axes.
LOW = 128
#: What is left of a unit vector that depends on others.
_DEPENDENT = 1e-8


@dataclass(frozen=True)
class Parallelotope:
    """The points `centre` + `axes` r, r in the box `reach` about 0: columns (m,), axes (m, m)."""

    centre: tuple[arb, ...]
    axes: arb_mat
    reach: arb_mat

    @classmethod
    def box(cls, values: Sequence[arb]) -> Parallelotope:
        """That of balls."""
        size = len(values)
        axes = arb_mat(size, size, [int(i == j) for i in range(size) for j in range(size)])
        reach = arb_mat(size, 1, [arb(0, value.rad()) for value in values])
        return cls(tuple(value.mid() for value in values), axes, reach)

    @classmethod
    def around(cls, image: Sequence[arb], spread: arb_mat, reach: arb_mat) -> Parallelotope | None:
        """A set that holds the points `image` + `spread` r; None if its axes are not found.

        `image` and `spread` are balls: a point and a derivative times the axes before.
        """
        size = len(image)
        centre = tuple(value.mid() for value in image)
        rest = arb_mat(
            size, 1, [value - middle for value, middle in zip(image, centre, strict=True)]
        )
        found = _axes(spread, reach)
        if found is None:
            return None
        with ctx.workprec(LOW):
            axes = arb_mat(found).transpose()
            try:
                inverse = axes.inv()
            except ZeroDivisionError:
                return None
            box = inverse * spread * reach + inverse * rest
            return cls(centre, axes, arb_mat(size, 1, [arb(0, abs(q).upper()) for q in box]))

    def met(
        self, image: Sequence[arb], spread: arb_mat, speed: arb_mat, row: arb_mat, missed: arb
    ) -> Parallelotope | None:
        """The set at the event h = 0 of a motion; None if it is not found.

        `image`: where the centre is at some time near its event, and `missed` = h there. Balls for
        all points and all times in between: `spread`, derivatives of the state by the start times
        the axes; `speed`, its velocity; `row`, the gradient of h, which grows with time. Then
        d tau = -row . spread r/(row . speed), and the centre's own time is `missed` wrong likewise.
        """
        with ctx.workprec(LOW):
            slope = (row * speed)[0, 0]
            if not slope > 0:
                return None
            spread = spread - speed * (row * spread * (1 / slope))
            shift = speed * (-missed / slope)
        moved = [p + q for p, q in zip(image, shift.entries(), strict=True)]
        return self.around(moved, spread, self.reach)

    def narrowed(self, values: Sequence[arb]) -> list[arb]:
        """The narrower one of two balls of each number, those given or those that hold the set."""
        pairs = zip(self.hull(), values, strict=True)
        return [p if p.rad() < q.rad() else q for p, q in pairs]

    def hull(self) -> list[arb]:
        """The balls that hold it."""
        return [c + q for c, q in zip(self.centre, (self.axes * self.reach).entries(), strict=True)]


def _axes(spread: arb_mat, reach: arb_mat) -> list[list[float]] | None:
    """Orthogonal axes of the columns of `spread`, that of the longest edge first, as floats."""
    size = spread.nrows()
    columns = [[float(q) for q in row] for row in spread.mid().transpose().tolist()]
    lengths = [math.hypot(*column) for column in columns]
    if not all(map(math.isfinite, lengths)):
        return None
    axes: list[list[float]] = []
    for k in sorted(range(size), key=lambda k: -_exponent(reach[k, 0], lengths[k])):
        if lengths[k] > 0.0:
            _add(axes, [value / lengths[k] for value in columns[k]])
    while len(axes) < size:
        # the motion has lost a direction: that of the coordinate that is least in the others
        squares = [sum(axis[i] ** 2 for axis in axes) for i in range(size)]
        least = squares.index(min(squares))
        _add(axes, [float(i == least) for i in range(size)])
    return axes


def _add(axes: list[list[float]], unit: list[float]) -> None:
    """Another axis, orthogonal to those there are; none if it depends on them (Gram, Schmidt)."""
    left, length, before = unit, 1.0, math.inf
    while length > _DEPENDENT and length < before / 2:
        # again where much is lost, and with it the right angle
        before = length
        for axis in axes:
            part = sum(map(mul, axis, left))
            left = [q - part * p for p, q in zip(axis, left, strict=True)]
        length = math.hypot(*left)
    if length > _DEPENDENT:
        axes.append([value / length for value in left])


def _exponent(reach: arb, length: float) -> float:
    """Logarithm of a length, which may leave the range of doubles."""
    mantissa, exponent = reach.rad().man_exp()
    if mantissa == 0 or length == 0.0:
        return -math.inf
    return math.log2(int(mantissa)) + int(exponent) + math.log2(length)
