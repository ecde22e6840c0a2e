"""Special points of a branch: where it turns, doubles its period, grazes, or leaves a regime.

Each is a zero of the equations F and of one test function, or of two with one more unknown. If
Krawczyk's K of a box lies inside it, the box holds exactly one.

A turn (saddle-node), or a period doubling, is a point at which DF is singular; for the latter the
columns of DF by the node where the last leg ends have the other sign. With any b and c such that

    [DF b; c 0] (v, g) = (0, 1),    (w, g) [DF b; c 0] = (0, 1)

have solutions, DF is singular just where g = 0, and dg = -w d(DF) v (Govaerts, Numerical Methods
for Bifurcations of Dynamical Equilibria (2000), chapter 3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from flint import arb, arb_mat, arb_series

from . import along
from .along import Leg
from .formulas import Number, Undecided, plain
from .tube import Family, near_inverse, slopes_of
from .verifier import inside

#: Signs of the multipliers.
SINGULAR = {"saddle_node": 1, "period_doubling": -1}
BORDERS = ("grazing", "regime_border")
#: Boxes around the point, each inside the one before.
_NARROWER = 4


@dataclass(frozen=True)
class Special:
    """A kind of point; of a border its leg, and a condition of it or, inside a flight, a stop."""

    kind: str
    leg: int = 0
    condition: int | None = None
    stop: int | None = None

    def equations(self, family: Family, box: Sequence[arb]) -> tuple[list[arb], arb_mat]:
        """F and the test functions over a box, and their derivative."""
        size = len(box) - (self.stop is not None)
        values, rows = [], slopes_of(family, box[:size])
        for row in rows:
            row += [arb(0)] * (len(box) - size)
        if self.kind in SINGULAR:
            value, gradient = _singular(family, box, SINGULAR[self.kind])
            values.append(value)
            rows.append(gradient)
        else:
            tests = [self.tests(family, moved(box, _unit(j, len(box)))) for j in range(len(box))]
            values += [plain(x) for x in tests[0]]
            rows += [[along.term(x, 1) for x in row] for row in zip(*tests, strict=True)]
        rest = family.at(box[size - 1]).residual(box[: size - 1])
        return [*rest, *values], arb_mat(rows)

    def tests(self, family: Family, x: Sequence[Number]) -> list[Number]:
        """The condition; or the gap and its rate, both 0 some time after the start of a leg."""
        if self.stop is None:
            assert self.condition is not None
            leg = Leg.of(family.at(x[-1]), self.leg, x[:-1], 2)
            return [leg.after()[1][self.condition][0]]
        orbit = family.at(x[-2])
        leg = Leg.of(orbit, self.leg, x[:-2], 2, until=x[-1])
        stop = orbit.machine.stops[self.stop]
        return [stop.gap(leg.last), stop.gap(leg.last, 1)]


def _unit(j: int, size: int) -> list[arb]:
    return [arb(int(i == j)) for i in range(size)]


def moved(box: Sequence[arb], by: Sequence[arb], terms: int = 2) -> list[Number]:
    """Numbers that move with h; those that do not are no series."""
    pairs = zip(box, by, strict=True)
    return [x if dx.is_zero() else arb_series([x, dx], terms) for x, dx in pairs]


def _singular(family: Family, box: Sequence[arb], sign: int) -> tuple[arb, list[arb]]:
    """G over a box, and its gradient."""
    size = len(box)
    last = arb_mat(size, 1, _unit(size - 1, size))
    matrix = _bordered(family, box, sign)
    v = matrix.solve(last).entries()
    w = matrix.transpose().solve(last).entries()
    across = [*v[:-1], arb(0)]

    def bend(by: Sequence[arb], turns: Sequence[arb] | None) -> arb_mat:
        """Half of the second derivative of F; `turns`: of the node at the end another one."""
        line, zero = moved(box, by, 3), arb(0)
        node = None
        if turns is not None:
            node = [arb_series([zero, x], 3) for x in turns]
        return along.residual(family.at(line[-1]), line[:-1], 3, node)[2]

    width = 2 * family.at(box[-1]).machine.size + 1
    turns = [-2 * x for x in v[:width]] if sign < 0 else None
    own, gradient = bend(across, turns), []
    for j in range(size):
        unit = _unit(j, size)
        both = [x + y for x, y in zip(across, unit, strict=True)]
        change = (bend(both, turns) - own - bend(unit, None)).entries()
        gradient.append(-sum((x * y for x, y in zip(w, change, strict=False)), arb(0)))
    return v[-1], gradient


def _bordered(family: Family, box: Sequence[arb], sign: int) -> arb_mat:
    """DF over a box, with b and c near its zero vectors in the middle."""
    middle = slopes_of(family, [x.mid() for x in box], sign)
    numbers = np.array([[float(x.mid()) for x in row[:-1]] for row in middle])
    if not np.isfinite(numbers).all():
        raise Undecided("the derivative of the equations is not bounded")
    left, _, right = np.linalg.svd(numbers)
    rows = [row[:-1] for row in slopes_of(family, box, sign)]
    bordered = [[*row, arb(x)] for row, x in zip(rows, left[:, -1].tolist(), strict=True)]
    return arb_mat([*bordered, [*map(arb, right[-1].tolist()), arb(0)]])


def only_special(family: Family, special: Special, box: Sequence[arb]) -> list[arb]:
    """A small box that holds the only special point of a kind in a box.

    Raises
    ------
    Undecided : this is not shown
    """
    found = _krawczyk(family, special, box)
    if not inside(found, box):
        raise Undecided("Krawczyk's operator does not contract")
    for _ in range(_NARROWER):
        closer = _krawczyk(family, special, found)
        if not inside(closer, found):
            break
        found = closer
    return found


def _krawczyk(family: Family, special: Special, box: Sequence[arb]) -> list[arb]:
    """K of a box, whether or not it lies inside."""
    size, centre = len(box), [x.mid() for x in box]
    try:
        value, _ = special.equations(family, centre)
        _, slopes = special.equations(family, box)
        near = near_inverse(slopes)
    except (ValueError, ZeroDivisionError) as error:
        raise Undecided("a divisor may be 0") from error
    left = near * slopes
    for i in range(size):
        left[i, i] -= 1
    away = arb_mat(size, 1, [x - c for x, c in zip(box, centre, strict=True)])
    image = arb_mat(size, 1, centre) - near * arb_mat(size, 1, value) - left * away
    return list(image.entries())
