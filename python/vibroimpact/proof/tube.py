"""A piece of a branch in balls: a tube in which each plane across it holds one solution.

The unknowns are Y = (z, p): the nodes and the parameter. About a centre line
L(h) = Y_0 + Y_1 h + Y_2 h^2 + ..., with Y_1 = S, a tube is L(h) + [-R, R] for |h| <= H; the plane
of h is S . (Y - Y_0) = h. The theorem of verifier.py holds for all h at once: with any matrix A
and the equations E = (F, S . (Y - Y_0) - h),

    K = -A E(L(h)) + (I - A DE(tube)) [-R, R]   inside [-R, R]

proves one solution in the tube for each h, in L(h) + K, and that they are a smooth curve.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import comb

from flint import arb, arb_mat, arb_series

from . import along
from .along import Leg, Matrices
from .formulas import Machine, Number, Undecided
from .near import inverse_of
from .verifier import Orbit

#: Terms of power series along a tube.
TERMS = 5
#: A radius that is added where one may be 0.
_TINY = 1e-40


@dataclass(frozen=True)
class Family:
    """The motions of a branch with one sequence of legs; the machine by the parameter."""

    machine: Callable[[Number], Machine]
    m: int
    legs: tuple[tuple[int, str], ...]

    def at(self, parameter: Number) -> Orbit:
        """The equations with a parameter, a ball or a series."""
        return Orbit(self.machine(parameter), self.m, self.legs)

    def along(self, line: Sequence[Number], terms: int) -> list[Leg]:
        """The legs along a line."""
        orbit = self.at(line[-1])
        return [Leg.of(orbit, k, line[:-1], terms) for k in range(len(self.legs))]


@dataclass(frozen=True)
class Tube:
    """Y_0, Y_1, ... of the centre line, H and R."""

    line: list[list[arb]]
    half: arb
    radius: list[arb]

    def coefficients(self, h: arb, k: int) -> list[arb]:
        """The coefficients of power k of the centre line about h."""
        found = [arb(0)] * len(self.radius)
        for j in range(len(self.line) - 1, k - 1, -1):
            found = [x * h + comb(j, k) * y for x, y in zip(found, self.line[j], strict=True)]
        return found

    def part(self, h: arb, away: Sequence[arb]) -> list[arb]:
        """The part at some values of h."""
        return [x + a for x, a in zip(self.coefficients(h, 0), away, strict=True)]

    def whole(self) -> arb:
        """All values of h."""
        return arb(0, self.half)

    def legs(self, family: Family, away: Sequence[arb]) -> list[list[Leg]]:
        """The legs along the centre line, moved: series about its middle, and about all of it."""
        found = []
        for h in (arb(0), self.whole()):
            rows = [self.part(h, away)] + [self.coefficients(h, k) for k in range(1, TERMS)]
            line = [arb_series(list(x), TERMS) for x in zip(*rows, strict=True)]
            found.append(family.along(line, TERMS))
        return found

    def taylor(
        self, of: Callable[[Sequence[Leg], int], Matrices], legs: Sequence[Sequence[Leg]]
    ) -> Matrices:
        """Coefficients that hold along the tube: of its middle, the last one of all of it."""
        middle, whole = (of(one, TERMS) for one in legs)
        return [*middle[:-1], whole[-1]]

    def planes(self) -> list[arb]:
        """The coefficients of S . (L(h) - Y_0) - h."""
        rows = [zip(self.line[1], y, strict=True) for y in self.line]
        bend = [sum((a * b for a, b in row), arb(0)) for row in rows]
        return [arb(0), bend[1] - 1, *bend[2:]]

    def across(self, point: Sequence[arb]) -> arb:
        """S . (Y - Y_0)."""
        three = zip(self.line[1], point, self.line[0], strict=True)
        return sum((s * (y - y_0) for s, y, y_0 in three), arb(0))

    def place(self, point: Sequence[arb]) -> arb | None:
        """The h of a point inside the tube, else None."""
        h = self.across(point)
        near = zip(point, self.coefficients(h, 0), self.radius, strict=True)
        return h if abs(h) < self.half and all(abs(x - y) < r for x, y, r in near) else None


def derivative(family: Family, direction: Sequence[arb], box: Sequence[arb]) -> arb_mat:
    """DE over a box."""
    orbit = family.at(box[-1])
    width, count = 2 * orbit.machine.size + 1, len(orbit.legs)
    rows = arb_mat(width * count + 1, width * count + 1)
    line: list[Number] = [*box[:-1], arb_series([box[-1], 1], 2)]
    by_parameter = [*along.residual(family.along(line, 2), 2)[1].entries(), direction[-1]]
    for k, flight in enumerate(orbit.flights(box[:-1])):
        for block, node in zip(orbit.blocks(k, flight), (k, (k + 1) % count), strict=True):
            for i in range(width):
                for j in range(width):
                    rows[k * width + i, node * width + j] += block[i, j]
    for j, x in enumerate(direction[:-1]):
        rows[width * count, j] = x
    for i, x in enumerate(by_parameter):
        rows[i, width * count] = x
    return rows


def turn(family: Family, tube: Tube, away: Sequence[arb], moved: Matrices) -> list[arb]:
    """How far dY/dh of the branch is from that of the centre line.

    X = dY/dh solves DE X = (0, 1). With D = d/dh E(L(h) + a), a = Y - L fixed, DE (X - L') = -D;
    `moved` has the coefficients of F(L(h) + a).
    """
    h = tube.whole()
    slopes = derivative(family, tube.line[1], tube.part(h, away))
    rates = [x * k for k, x in enumerate(moved)][1:]
    plane = along.at([x * k for k, x in enumerate(tube.planes())][1:], h)
    near = inverse_of(slopes)
    column = arb_mat([[-x] for x in [*along.at(rates, h).entries(), plane]])
    return list((near * slopes).solve(near * column).entries())


@dataclass(frozen=True)
class Image:
    """K of a tube, and whether it lies inside."""

    away: list[arb]
    inside: bool


def image(family: Family, tube: Tube) -> Image:
    """K of a tube.

    Raises
    ------
    Undecided : there is none
    """
    size, h = len(tube.radius), tube.whole()
    try:
        slopes = derivative(family, tube.line[1], tube.part(h, [arb(0, r) for r in tube.radius]))
        legs = tube.legs(family, [arb(0)] * size)
        rest = along.at(tube.taylor(along.residual, legs), h).entries()
        near = inverse_of(slopes)
    except (ValueError, ZeroDivisionError) as error:
        raise Undecided("a divisor may be 0") from error
    left = -near * slopes
    for i in range(size):
        left[i, i] += 1
    plane = along.at(tube.planes(), h)
    radius = arb_mat(size, 1, [arb(0, r) for r in tube.radius])
    away = (left * radius - near * arb_mat(size, 1, [*rest, plane])).entries()
    return Image(away, all(abs(x) < r for x, r in zip(away, tube.radius, strict=True)))


def point_at(family: Family, tube: Tube, away: Sequence[arb], h: arb) -> list[arb]:
    """The point of the branch in a plane of a tube: it lies in K of a short tube about it, too."""
    box, across = tube.part(h, away), tube.line[1]
    centre = [x.mid() for x in box]
    short = (h - tube.across(centre)).abs_upper()
    near = zip(box, centre, across, strict=True)
    radius = [(abs(x - c) + abs(s) * short).upper() + _TINY for x, c, s in near]
    around = Tube([centre, across], short, radius)
    return around.part(around.whole(), image(family, around).away)
