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
from .verifier import Flight, Orbit, return_map, show_motion, stability

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


    def holds(self, point: Sequence[arb]) -> bool:
        """Whether a point lies inside the tube."""
        away = [x - y for x, y in zip(point, self.centre, strict=True)]
        h = sum((s * x for s, x in zip(self.direction, away, strict=True)), arb(0))
        near = zip(away, self.direction, self.radius, strict=True)
        return bool(abs(h) < self.half) and all(abs(x - s * h) < r for x, s, r in near)


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
    parts = [sum((abs(left[i, j]) * r for j, r in enumerate(tube.radius)), arb(0)) / tube.radius[i] for i in range(size)]
    part = max(parts).upper()
    straight = arb_mat(size, 1, [*none[1:], arb(1)]) - slopes * arb_mat(size, 1, tube.direction)
    bent = (near * straight).entries()
    off = max(abs(x) / r for x, r in zip(bent, tube.radius, strict=True)) / (1 - part)
    slope = tube.direction[-1] + arb(0, (off * tube.radius[-1]).upper())
    return Image(away, inside and bool(part < 1), slope)


@dataclass(frozen=True)
class Slice:
    """What holds of the solutions between two parameters: `part` of the way along its tube."""

    parameter: arb
    verdict: str
    why: str
    stability: str
    at_minus_one: int
    at_one: int


def slices(family: Family, tube: Tube, away: Sequence[arb], count: int) -> list[Slice]:
    """What is shown of the motions of a tube, in so many parts."""
    found = []
    for i in range(count):
        lo, hi = (tube.half * (2 * k - count) / count for k in (i, i + 1))
        box = tube.along(lo, hi, away)
        orbit = family.at(box[-1])
        verdict, why, signs = "proved", "", [0, 0]
        flights = orbit.flights(box[:-1])
        try:
            show_motion(orbit, flights)
        except Refuted as reason:
            verdict, why = "disproved", str(reason)
        except Undecided as reason:
            verdict, why = "undecided", str(reason)
        matrix = return_map(flights)
        for place, point in enumerate((-1, 1)):
            value = matrix.charpoly()(point)
            # without the eigenvalue 0
            value = value * point
            signs[place] = 1 if value > 0 else -1 if value < 0 else 0
        found.append(Slice(box[-1], verdict, why, stability(matrix), *signs))
    return found
