"""A piece of a branch in balls: a tube in which each plane across it holds one solution.

The unknowns are Y = (z, p): the nodes and the parameter. About a centre line
L(h) = Y_0 + Y_1 h + Y_2 h^2 + ..., with Y_1 = S, a tube is L(h) + [-R, R] for |h| <= H; the plane
of h is S . (Y - Y_0) = h. The theorem of verifier.py holds for all h at once: with any matrix A
and the equations E = (F, S . (Y - Y_0) - h),

    K = -A E(L(h)) + (I - A DE(tube)) [-R, R]   inside [-R, R]

proves one solution in the tube for each h, in L(h) + K, and that they are a smooth curve.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import comb

import numpy as np
from flint import acb, acb_mat, arb, arb_mat, arb_series

from . import along
from .along import Matrices
from .formulas import Machine, Number, Refuted, Undecided
from .verifier import Orbit, show_motion, stability

#: Terms of power series along a tube.
TERMS = 5
#: A radius that is added where one may be 0.
_TINY = 1e-40
#: Halvings of a part of a tube, and how many parts are halved.
_HALVINGS, _MOST_OPEN = 24, 16

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


def slopes_of(family: Family, box: Sequence[arb], sign: int = 1) -> list[list[arb]]:
    """The rows of DF by all unknowns; those of the node where the last leg ends times a sign."""
    orbit = family.at(box[-1])
    width, count = 2 * orbit.machine.size + 1, len(orbit.legs)
    rows = arb_mat(width * count, width * count)
    for k, flight in enumerate(orbit.flights(box[:-1])):
        starts, ends = orbit.blocks(k, flight)
        after = (k + 1) % count
        for i in range(width):
            for j in range(width):
                rows[k * width + i, k * width + j] += starts[i, j]
                rows[k * width + i, after * width + j] += ends[i, j] * (1 if after else sign)
    line: list[Number] = [*box[:-1], arb_series([box[-1], 1], 2)]
    by_parameter = family.residual(line, 2)[1].entries()
    return [[*row, x] for row, x in zip(rows.tolist(), by_parameter, strict=True)]


def derivative(family: Family, direction: Sequence[arb], box: Sequence[arb]) -> arb_mat:
    """DE over a box."""
    return arb_mat([*slopes_of(family, box), list(direction)])


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
        part = largest(
            sum((abs(x) * r for x, r in zip(row, tube.radius, strict=True)), arb(0)) / own
            for row, own in zip(left.tolist(), tube.radius, strict=True)
        )
        moved = tube.taylor(family.residual, away)
        rates = along.at([x * k for k, x in enumerate(moved)][1:], h).entries()
        planes = [x * k for k, x in enumerate(tube.planes())][1:]
        bent = (near * arb_mat(size, 1, [*rates, _horner(planes, h)])).entries()
    except (ValueError, ZeroDivisionError) as error:
        raise Undecided("a divisor may be 0") from error
    if not part < 1:
        return Image(away, False, arb(0))
    off = largest(abs(x) / r for x, r in zip(bent, tube.radius, strict=True)) / (1 - part)
    return Image(away, True, arb(0, (off * tube.radius[-1] + _TINY).upper()))


def largest(values: Iterable[arb]) -> arb:
    """A bound of all of some numbers."""
    bounds = [x.upper() for x in values]
    if not all(x.is_finite() for x in bounds):
        raise Undecided("there is no bound")
    return max(bounds)


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

    `box` holds them; `length` of h, `first` and `last`: the parameter at its two ends. `rises`: 1
    or -1 if the parameter rises or falls along it, else 0. `broken`: of no motion, the kind of
    border beyond which it lies.
    """

    box: list[arb]
    length: arb
    first: arb
    last: arb
    rises: int
    verdict: str
    why: str
    broken: str
    spectrum: Spectrum

    @property
    def known(self) -> bool:
        """Whether everything is shown; of what is no motion stability is not asked."""
        steady = self.spectrum.stability != "undecided" or self.verdict == "disproved"
        return self.verdict != "undecided" and self.rises != 0 and steady


def slices(family: Family, tube: Tube, found: Image, lo: arb, hi: arb) -> list[Slice]:
    """What is shown of the motions of a tube between two values of h.

    The parts of which not everything is shown are halved, as long as they are few.
    """
    try:
        # along the tube in one basis: turned as a whole, a short part of it would be wide
        returns = settled([acb_mat(x) for x in tube.taylor(family.return_map, found.away)])
    except (Undecided, ValueError, ZeroDivisionError):
        returns = []

    def look(here: arb, there: arb, known: tuple[str, str, str]) -> Slice:
        h, spectrum = here.union(there), Spectrum()
        first, last = (tube.part(end, found.away)[-1] for end in (here, there))
        box, slope = tube.part(h, found.away), tube.coefficients(h, 1)[-1] + found.turn
        if returns:
            with suppress(Undecided, ValueError, ZeroDivisionError):
                spectrum = spectrum_of(along.at(returns, h))
        if known[0] == "undecided":
            known = _motion(family, box)
        return Slice(box, there - here, first, last, _sign(slope), *known, spectrum)

    open_ = ("undecided", "", "")
    told, ends = [look(lo, hi, open_)], [lo, hi]
    for _ in range(_HALVINGS):
        left = [k for k, one in enumerate(told) if not one.known]
        if len(left) > _MOST_OPEN:
            break
        for k in reversed(left):
            middle, one = (ends[k] + ends[k + 1]) / 2, told[k]
            shown = (one.verdict, one.why, one.broken)
            told[k : k + 1] = [look(ends[k], middle, shown), look(middle, ends[k + 1], shown)]
            ends.insert(k + 1, middle)
    return told


@dataclass(frozen=True)
class Spectrum:
    """What is shown of the multipliers on a part of a tube.

    `at_minus_one`, `at_one`: signs of their characteristic polynomial there; where one is negative
    a multiplier lies beyond. `others_inside`: all but one, which is real, are in the unit circle.
    """

    stability: str = "undecided"
    at_minus_one: int = 0
    at_one: int = 0
    others_inside: bool = False


def settled(given: Sequence[acb_mat]) -> list[acb_mat]:
    """Similar matrices, the first nearly diagonal where that is possible."""
    size = given[0].nrows()
    numbers = [complex(float(x.real.mid()), float(x.imag.mid())) for x in given[0].entries()]
    if not np.isfinite(numbers).all():
        raise Undecided("the derivative of the return map is not bounded")
    vectors = np.linalg.eig(np.array(numbers).reshape(size, size))[1]  # any regular matrix will do
    basis = acb_mat([[acb(x.real, x.imag) for x in row] for row in vectors.tolist()])
    return [basis.solve(x * basis) for x in given]


def spectrum_of(matrix: acb_mat) -> Spectrum:
    """Of the derivative of a return map, one of whose eigenvalues is 0 and no multiplier.

    By Gershgorin's discs (1931): as many eigenvalues as discs lie in a union of discs that meets
    no other one.
    """
    (similar,), size, signs = settled([matrix]), matrix.nrows(), []
    for x in (-1, 1):
        rest = -similar
        for i in range(size):
            rest[i, i] += x
        # the eigenvalue 0 makes the sign at -1 another one
        signs.append(_sign(x * rest.det().real))
    discs = [
        (similar[i, i], sum((abs(similar[i, j]) for j in range(size) if j != i), arb(0)))
        for i in range(size)
    ]
    inner = [(c, r) for c, r in discs if abs(c) + r < 1]
    rest_of = [(c, r) for c, r in discs if not abs(c) + r < 1]
    # a disc about a real number that holds one eigenvalue of a real matrix: it is real
    alone = [(acb(c.real), r + abs(c.imag)) for c, r in rest_of]
    others_inside = len(rest_of) == 1 and _apart(alone, inner)
    stable = not rest_of or (others_inside and signs == [1, 1])
    steady: str = "stable" if stable else "undecided"
    outer = [(c, r) for c, r in rest_of if abs(c) - r > 1]
    if -1 in signs or (outer and _apart(outer, [x for x in discs if not abs(x[0]) - x[1] > 1])):
        steady = "unstable"
    if steady == "undecided":
        steady = stability(similar.charpoly().coeffs())
    return Spectrum(steady, signs[0], signs[1], others_inside)


def _apart(some: Sequence[tuple[acb, arb]], others: Sequence[tuple[acb, arb]]) -> bool:
    return all(abs(a - b) > r + s for a, r in some for b, s in others)


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
