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
from itertools import pairwise
from math import comb

import numpy as np
from flint import acb, acb_mat, arb, arb_mat, arb_series

from . import along
from .along import Matrices
from .formulas import Machine, Number, Refuted, Undecided
from .verifier import Flight, Orbit, show_motion, stability

#: Terms of power series along a tube.
TERMS = 5
#: A radius that is added where one may be 0.
_TINY = 1e-40

#: A machine with its parameter at a ball, or at a series.
MachineAt = Callable[[Number], Machine]


@dataclass(frozen=True)
class Family:
    """The motions of a branch with one sequence of legs."""

    machine: MachineAt
    m: int
    legs: tuple[tuple[int, str], ...]

    def at(self, parameter: Number) -> Orbit:
        """The equations with a parameter."""
        return Orbit(self.machine(parameter), self.m, self.legs)

    def residual(self, line: Sequence[Number], terms: int) -> Matrices:
        """The coefficients of F along a line."""
        return along.residual(self.at(line[-1]), line[:-1], terms)

    def return_map(self, line: Sequence[Number], terms: int) -> Matrices:
        """Those of the derivative of the return map."""
        return along.return_map(self.at(line[-1]), line[:-1], terms)


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

    def series(self, h: arb, away: Sequence[arb]) -> list[Number]:
        """The centre line about h, moved, as series."""
        rows = [self.part(h, away)] + [self.coefficients(h, k) for k in range(1, TERMS)]
        return [arb_series(list(column), TERMS) for column in zip(*rows, strict=True)]

    def whole(self) -> arb:
        """All values of h."""
        return arb(0, self.half)

    def taylor(
        self, of: Callable[[Sequence[Number], int], Matrices], away: Sequence[arb]
    ) -> Matrices:
        """Coefficients that hold along the tube: of its middle, the last one of all of it."""
        middle = of(self.series(arb(0), away), TERMS)
        return [*middle[:-1], of(self.series(self.whole(), away), TERMS)[-1]]

    def planes(self) -> list[arb]:
        """The coefficients of S . (L(h) - Y_0) - h."""
        dots = [
            sum((a * b for a, b in zip(self.line[1], y, strict=True)), arb(0)) for y in self.line
        ]
        return [arb(0), dots[1] - 1, *dots[2:]]

    def place(self, point: Sequence[arb]) -> arb | None:
        """The h of a point inside the tube, else None."""
        away = [x - y for x, y in zip(point, self.line[0], strict=True)]
        h = sum((s * x for s, x in zip(self.line[1], away, strict=True)), arb(0))
        near = zip(point, self.coefficients(h, 0), self.radius, strict=True)
        return h if abs(h) < self.half and all(abs(x - y) < r for x, y, r in near) else None


def jacobian(orbit: Orbit, flights: Sequence[Flight]) -> arb_mat:
    """DF."""
    width, count = flights[0].slopes.nrows(), len(flights)
    matrix = arb_mat(width * count, width * count)
    for k, flight in enumerate(flights):
        for block, place in zip(orbit.blocks(k, flight), (k, (k + 1) % count), strict=True):
            for i, row in enumerate(block.tolist()):
                for j, x in enumerate(row):
                    matrix[k * width + i, place * width + j] += x
    return matrix


def derivative(family: Family, direction: Sequence[arb], box: Sequence[arb]) -> arb_mat:
    """DE over a box."""
    orbit = family.at(box[-1])
    slopes = jacobian(orbit, orbit.flights(box[:-1]))
    line: list[Number] = [*box[:-1], arb_series([box[-1], 1], 2)]
    by_parameter = family.residual(line, 2)[1]
    rows = [[*row, by_parameter[i, 0]] for i, row in enumerate(slopes.tolist())]
    return arb_mat([*rows, list(direction)])


def near_inverse(matrix: arb_mat) -> arb_mat:
    """Any matrix near the inverse."""
    size = matrix.nrows()
    try:
        numbers = np.array([float(x.mid()) for x in matrix.entries()]).reshape(size, size)
        return arb_mat(np.linalg.inv(numbers).tolist())
    except (np.linalg.LinAlgError, ValueError) as error:
        raise Undecided("the equations are singular") from error


@dataclass(frozen=True)
class Image:
    """K of a tube, whether it lies inside, and how far dp/dh is from that of the centre line."""

    away: list[arb]
    inside: bool
    turn: arb


def image(family: Family, tube: Tube) -> Image:
    """K of a tube.

    Raises
    ------
    Undecided : there is none
    """
    size, h = len(tube.radius), tube.whole()
    try:
        box = tube.part(h, [arb(0, r) for r in tube.radius])
        slopes = derivative(family, tube.line[1], box)
        rest = tube.taylor(family.residual, [arb(0)] * size)
        near = near_inverse(slopes)
        left = -near * slopes
        for i in range(size):
            left[i, i] += 1
        column = [*along.at(rest, h).entries(), _horner(tube.planes(), h)]
        radius = arb_mat(size, 1, [arb(0, r) for r in tube.radius])
        away = (left * radius - near * arb_mat(size, 1, column)).entries()
        inside = all(abs(x) < r for x, r in zip(away, tube.radius, strict=True))
        if not inside:
            return Image(away, False, arb(0))
        # X = dY/dh solves DE X = e; with D = d/dh E(L(h) + a) = DE L' - e, a = Y - L fixed, it is
        # X - L' = -A D + (I - A DE)(X - L'), a contraction in the norm max |x_i|/R_i since K lies
        # inside
        part = max(
            sum((abs(left[i, j]) * r for j, r in enumerate(tube.radius)), arb(0)) / tube.radius[i]
            for i in range(size)
        ).upper()
        moved = tube.taylor(family.residual, away)
        rates = along.at([x * k for k, x in enumerate(moved)][1:], h).entries()
        planes = [x * k for k, x in enumerate(tube.planes())][1:]
        bent = (near * arb_mat(size, 1, [*rates, _horner(planes, h)])).entries()
    except (ValueError, ZeroDivisionError) as error:
        raise Undecided("a divisor may be 0") from error
    if not part < 1:
        return Image(away, False, arb(0))
    off = max(abs(x).upper() / r for x, r in zip(bent, tube.radius, strict=True)) / (1 - part)
    return Image(away, True, arb(0, (off * tube.radius[-1] + _TINY).upper()))


def point_at(family: Family, tube: Tube, found: Image, h: arb) -> list[arb]:
    """The point of the branch in a plane of a tube: it lies in K of a short tube about it, too."""
    box, across = tube.part(h, found.away), tube.line[1]
    centre = [x.mid() for x in box]
    offset = zip(across, centre, tube.line[0], strict=True)
    short = (h - sum((s * (x - y) for s, x, y in offset), arb(0))).abs_upper()
    near = zip(box, centre, across, strict=True)
    radius = [(abs(x - c) + abs(s) * short).upper() + _TINY for x, c, s in near]
    around = Tube([centre, across], short, radius)
    return around.part(around.whole(), image(family, around).away)


def _horner(given: Sequence[arb], h: arb) -> arb:
    total = arb(0)
    for x in reversed(given):
        total = total * h + x
    return total


@dataclass(frozen=True)
class Slice:
    """What holds of the solutions on a part of a tube.

    `first` and `last`: the parameter at its two ends; `whole`: all its values. `rises`: 1 or -1 if
    the parameter rises or falls along it, else 0. `broken`: of no motion, the kind of border beyond
    which it lies. `at_minus_one`, `at_one`: signs of the characteristic polynomial there.
    """

    first: arb
    last: arb
    whole: arb
    rises: int
    verdict: str
    why: str
    broken: str
    stability: str
    at_minus_one: int
    at_one: int


def slices(family: Family, tube: Tube, found: Image, count: int, lo: arb, hi: arb) -> list[Slice]:
    """What is shown of the motions of a tube between two values of h, in so many parts."""
    told, nothing = [], ("undecided", (0, 0))
    try:
        returns = tube.taylor(family.return_map, found.away)
    except (Undecided, ValueError, ZeroDivisionError):
        returns = []
    ends = [lo + (hi - lo) * k / count for k in range(count + 1)]
    for here, there in pairwise(ends):
        h = here.union(there)
        first, last = (tube.part(end, found.away)[-1] for end in (here, there))
        box, slope = tube.part(h, found.away), tube.coefficients(h, 1)[-1] + found.turn
        try:
            steady, signs = _spectrum(along.at(returns, h)) if returns else nothing
        except (Undecided, ValueError, ZeroDivisionError):
            steady, signs = nothing
        verdict = _motion(family, box)
        told.append(Slice(first, last, box[-1], _sign(slope), *verdict, steady, *signs))
    return told


def _spectrum(matrix: arb_mat) -> tuple[str, tuple[int, int]]:
    """Stability, and signs of the characteristic polynomial at -1 and 1."""
    similar, size = _nearly_diagonal(matrix), matrix.nrows()
    signs = []
    for x in (-1, 1):
        rest = -similar
        for i in range(size):
            rest[i, i] += x
        try:
            # one eigenvalue is 0: without it the sign at -1 is another one
            signs.append(_sign(x * rest.det().real))
        except ZeroDivisionError:
            signs.append(0)
    steady = _by_discs(similar)
    if steady == "undecided":
        steady = stability(similar.charpoly().coeffs())
    return steady, (signs[0], signs[1])


def _nearly_diagonal(matrix: arb_mat) -> acb_mat:
    """A similar matrix, nearly diagonal where that is possible."""
    size = matrix.nrows()
    numbers = np.array([float(x.mid()) for x in matrix.entries()]).reshape(size, size)
    if not np.isfinite(numbers).all():
        raise Undecided("the derivative of the return map is not bounded")
    vectors = np.linalg.eig(numbers)[1]  # any regular matrix will do
    basis = acb_mat([[acb(x.real, x.imag) for x in row] for row in vectors.tolist()])
    try:
        return basis.inv() * (acb_mat(matrix) * basis)
    except ZeroDivisionError:
        return acb_mat(matrix)


def _by_discs(matrix: acb_mat) -> str:
    """Stability by Gershgorin's discs (1931): as many zeros as discs lie in a union of them."""
    size = matrix.nrows()
    discs = [
        (matrix[i, i], sum((abs(matrix[i, j]) for j in range(size) if j != i), arb(0)))
        for i in range(size)
    ]
    if all(abs(centre) + radius < 1 for centre, radius in discs):
        return "stable"
    outside = [disc for disc in discs if abs(disc[0]) - disc[1] > 1]
    others = [disc for disc in discs if not abs(disc[0]) - disc[1] > 1]
    if outside and all(abs(a - b) > r + s for a, r in outside for b, s in others):
        return "unstable"
    return "undecided"


def _motion(family: Family, box: Sequence[arb]) -> tuple[str, str, str]:
    """The verdict on the solutions in a box, why, and the border that is passed."""
    broken = "grazing"
    try:
        orbit = family.at(box[-1])
        flights = orbit.flights(box[:-1])
        for flight in flights:
            # the first two are of the time of flight and of the approach
            if any(number < 0 for number, _ in flight.conditions[2:]):
                broken = "regime_border"
        show_motion(orbit, flights)
    except Refuted as reason:
        return "disproved", str(reason), broken
    except (Undecided, ValueError, ZeroDivisionError) as reason:
        return "undecided", str(reason), ""
    return "proved", "", ""


def _sign(x: arb) -> int:
    return 1 if x > 0 else -1 if x < 0 else 0
