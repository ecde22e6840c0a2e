"""A piece of a branch in balls: a tube in which each plane across it holds one solution.

The unknowns are Y = (z, p): the nodes and the parameter. A tube is Y0 + S h + [-R, R] for
|h| <= H, and the plane of h is S . (Y - Y0) = h. The theorem of verifier.py holds for all h at
once: with any matrix A, centre line L(h) = Y0 + S h and the equations E = (F, S . (Y - Y0) - h),

    K = -A (E(Y0) + E'(L) S h) + (I - A DE(tube)) [-R, R]   inside [-R, R]

proves one solution for each h, in L(h) + K, and that they are a smooth curve.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from flint import arb, arb_mat, arb_series

from .formulas import Machine, Number, Refuted, Undecided, impact, plain, slope_of
from .verifier import Flight, Orbit, return_map, settled, show_motion, stability

#: Boxes around a point, each inside the one before.
_NARROWER, _TINY = 2, 1e-40

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

    def change(self, y: Sequence[arb], dy: Sequence[arb]) -> arb_mat:
        """The derivative of F in a direction of (z, p), over a box of them, a column."""
        orbit = self.at(arb_series([y[-1], dy[-1]], 2))
        machine, n = orbit.machine, orbit.machine.size
        z = [arb_series([a, b], 2) for a, b in zip(y[:-1], dy[:-1], strict=True)]
        width, found = 2 * n + 1, []
        for k, (number, regime) in enumerate(self.legs):
            begin, end, lasts = orbit.times(k, z)
            first = [*z[k * width : (k + 1) * width - 1], *machine.drive(begin)]
            flow = machine.flow(plain(lasts))
            start = arb_mat(width + 2, 1, [plain(x) for x in first])
            w = flow * start
            dw = flow * arb_mat(width + 2, 1, [slope_of(x) for x in first])
            dw += machine.generator * w * slope_of(lasts)
            if machine.moving is not None:
                dw += machine.moved_flow(plain(lasts)) * start
            ending = [arb_series([w[i, 0], dw[i, 0]], 2) for i in range(2 * n)]
            ending += machine.drive(end)
            stop = machine.stops[number]
            velocities, _ = impact(machine, stop, regime, ending)
            after = (k + 1) % len(self.legs) * width
            for i, x in enumerate([*ending[:n], *velocities]):
                found.append(slope_of(z[after + i]) - slope_of(x))
            found.append(slope_of(stop.gap(ending)))
        return arb_mat(len(found), 1, found)


@dataclass(frozen=True)
class Tube:
    """Y0, S, H and R."""

    centre: list[arb]
    direction: list[arb]
    half: arb
    radius: list[arb]

    def along(self, lo: arb, hi: arb, away: Sequence[arb]) -> list[arb]:
        """The part between two values of h."""
        h = lo.union(hi)
        rows = zip(self.centre, self.direction, away, strict=True)
        return [y + s * h + x for y, s, x in rows]


    def place(self, point: Sequence[arb]) -> arb | None:
        """The h of a point inside the tube, else None."""
        away = [x - y for x, y in zip(point, self.centre, strict=True)]
        h = sum((s * x for s, x in zip(self.direction, away, strict=True)), arb(0))
        near = zip(away, self.direction, self.radius, strict=True)
        return h if abs(h) < self.half and all(abs(x - s * h) < r for x, s, r in near) else None


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


def derivative(family: Family, tube: Tube, box: Sequence[arb]) -> arb_mat:
    """DE over a box."""
    orbit, size = family.at(box[-1]), len(box)
    slopes = jacobian(orbit, orbit.flights(box[:-1]))
    by_parameter = family.change(box, [*[arb(0)] * (size - 1), arb(1)])
    rows = [[*row, by_parameter[i, 0]] for i, row in enumerate(slopes.tolist())]
    return arb_mat([*rows, tube.direction])


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
    """K of a tube: whether it lies inside, and then dp/dh."""

    away: list[arb]
    inside: bool
    slope: arb


def image(family: Family, tube: Tube) -> Image:
    """K of a tube.

    Raises
    ------
    Undecided : there is none
    """
    size, h = len(tube.centre), arb(0, tube.half)
    none = [arb(0)] * size
    try:
        line = tube.along(-tube.half, tube.half, none)
        box = [x + arb(0, r) for x, r in zip(line, tube.radius, strict=True)]
        slopes = derivative(family, tube, box)
        drift = family.change(line, tube.direction)
        rest = family.at(tube.centre[-1]).residual(tube.centre[:-1])
    except (ValueError, ZeroDivisionError) as error:
        raise Undecided("a divisor may be 0") from error
    near = near_inverse(slopes)
    square = sum((s * s for s in tube.direction), arb(-1))
    column = arb_mat(size, 1, [*(a + b * h for a, b in zip(rest, drift.entries(), strict=True)), square * h])
    one = arb_mat(size, size, [int(i == j) for i in range(size) for j in range(size)])
    left = one - near * slopes
    away = (left * arb_mat(size, 1, [arb(0, r) for r in tube.radius]) - near * column).entries()
    inside = all(abs(x) < r for x, r in zip(away, tube.radius, strict=True))
    # X = dY/dh solves DE X = e: X - S = A (e - DE S) + (I - A DE)(X - S), a contraction in the
    # norm max |x_i|/R_i, since K lies inside
    radius = [r + _TINY for r in tube.radius]
    part = max(
        sum((abs(left[i, j]) * r for j, r in enumerate(radius)), arb(0)) / radius[i]
        for i in range(size)
    ).upper()
    straight = arb_mat(size, 1, [*none[1:], arb(1)]) - slopes * arb_mat(size, 1, tube.direction)
    bent = (near * straight).entries()
    off = max(abs(x) / r for x, r in zip(bent, radius, strict=True)) / (1 - part)
    slope = tube.direction[-1] + arb(0, (off * radius[-1]).upper())
    return Image(away, inside and bool(part < 1), slope)


def point_at(family: Family, tube: Tube, found: Image, h: arb) -> list[arb]:
    """The point of the branch in a plane of a tube: in K of a short tube about it, too."""
    point = tube.along(h, h, found.away)
    for _ in range(_NARROWER):
        centre = [x.mid() for x in point]
        offset = zip(tube.direction, centre, tube.centre, strict=True)
        short = (h - sum((s * (x - y) for s, x, y in offset), arb(0))).abs_upper()
        radius = [(x - c).abs_upper() for x, c in zip(point, centre, strict=True)]
        near = image(family, Tube(centre, tube.direction, short, radius))
        point = [c + x for c, x in zip(centre, near.away, strict=True)]
    return point


@dataclass(frozen=True)
class Slice:
    """What holds of the solutions on a part of a tube.

    `first` and `last`: the parameter at its two ends; `whole`: all its values. `rises`: 1 or -1 if
    the parameter rises or falls along it, else 0. `at_minus_one`, `at_one`: signs of the
    characteristic polynomial there.
    """

    first: arb
    last: arb
    whole: arb
    rises: int
    verdict: str
    why: str
    stability: str
    at_minus_one: int
    at_one: int


def slices(family: Family, tube: Tube, found: Image, count: int, lo: arb, hi: arb) -> list[Slice]:
    """What is shown of the motions of a tube between two values of h, in so many parts."""
    told = []
    ends = [lo + (hi - lo) * k / count for k in range(count + 1)]
    for here, there in zip(ends, ends[1:], strict=False):
        box = tube.along(here, there, found.away)
        first, last = (tube.along(h, h, found.away)[-1] for h in (here, there))
        orbit, verdict, why = family.at(box[-1]), "proved", ""
        try:
            flights = orbit.flights(box[:-1])
            show_motion(orbit, flights)
        except Refuted as reason:
            verdict, why = "disproved", str(reason)
        except (Undecided, ValueError, ZeroDivisionError) as reason:
            verdict, why = "undecided", str(reason)
        try:
            polynomial = settled(return_map(flights)).charpoly()
            steady = stability(polynomial.coeffs())
            # an odd degree: one eigenvalue is 0
            signs = [_sign(-polynomial(-1).real), _sign(polynomial(1).real)]
        except (Undecided, ValueError, ZeroDivisionError, UnboundLocalError):
            steady, signs = "undecided", [0, 0]
        told.append(Slice(first, last, box[-1], _sign(found.slope), verdict, why, steady, *signs))
    return told


def _sign(x: arb) -> int:
    return 1 if x > 0 else -1 if x < 0 else 0
