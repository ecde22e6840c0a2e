"""Verify the certificate of a proof: a periodic motion exists, is alone near by, and is stable.

The unknowns z are the nodes: state (q, v) just after each impact, and its time t. Leg k, a flight
phi to an impact R, asks for

    (q, v)_{k+1} - R(phi((q, v)_k, t_k, t_{k+1})) = 0,   g(phi(...)) = 0,   t_n = t_0 + m T.   (F)

1. It exists, and is alone. Zeros of F in a box Z about z0 lie in Krawczyk's
   K(Z) = z0 - A F(z0) + (I - A DF(Z)) (Z - z0), with any matrix A. If K lies inside Z there is
   exactly one (Krawczyk, Computing 4 (1969); Neumaier, Interval Methods for Systems of Equations
   (1990), section 5.1).
2. It is a motion. At the zero: flight times and approach velocities are positive, the inequalities
   of each regime hold strictly (section 4), and no flight meets a stop before its end (section 13).
3. It is stable, or not: multipliers of the return map (section 7), from DF.

A comparison of balls is True only where it holds of all numbers in them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from flint import acb, acb_mat, arb, arb_mat, arb_series, fmpq
from numpy.typing import NDArray

from .formulas import Condition, Machine, Number, Refuted, Undecided, impact, plain, slope_of

Stability = Literal["stable", "unstable", "undecided"]

#: Halvings of a piece of a flight, and pieces of one flight.
_DEEPEST, _MOST_PIECES = 100, 20_000
#: Boxes around the zero, each inside the one before.
_NARROWER = 8


@dataclass(frozen=True)
class Flight:
    """A flight and the impact at its end, over a box: the state `after` it, and the gap at it.

    `slopes`, (2N + 1, 2N + 2): derivatives of `after` by the node of the start and t of the end.
    """

    start: arb_mat
    end: list[arb]
    duration: arb
    after: list[arb]
    slopes: arb_mat
    conditions: list[Condition]


@dataclass(frozen=True)
class Orbit:
    """The equations (F) of a motion: m drive periods; stop and regime at the end of each leg."""

    machine: Machine
    m: int
    legs: tuple[tuple[int, str], ...]

    def times(self, k: int, z: Sequence[Number]) -> tuple[Number, Number, Number]:
        """Start, end and duration of leg k."""
        width, after = 2 * self.machine.size + 1, (k + 1) % len(self.legs)
        begin, end = z[(k + 1) * width - 1], z[(after + 1) * width - 1]
        lasts = end - begin if after != k else arb(0)  # a single leg: m T exactly
        whole = self.machine.period * self.m if after == 0 else arb(0)
        return begin, end + whole, lasts + whole

    def flight(self, k: int, z: Sequence[arb], *, slopes: bool = True) -> Flight:
        """Leg k over a box."""
        machine, n = self.machine, self.machine.size
        width = 2 * n + 1
        begin, end, lasts = self.times(k, z)
        start = arb_mat(width + 2, 1, [*z[k * width : (k + 1) * width - 1], *machine.drive(begin)])
        flow = machine.flow(lasts)
        w = flow * start
        # the drive at the end depends on the time there alone
        ending = [*w.entries()[: 2 * n], *machine.drive(end)]
        number, regime = self.legs[k]
        stop = machine.stops[number]
        velocities, conditions = impact(machine, stop, regime, ending)
        conditions.insert(0, (lasts, "the flight time is negative"))
        found, rows = [*ending[:n], *map(plain, velocities), plain(stop.gap(ending))], []
        if slopes:
            rate, turn = machine.generator * w, (machine.generator * start).entries()[2 * n :]
            by_begin = flow * arb_mat(width + 2, 1, [*[arb(0)] * (2 * n), *turn]) - rate
            columns = [[flow[i, j] for i in range(2 * n)] for j in range(2 * n)]
            columns += [by_begin.entries()[: 2 * n], rate.entries()[: 2 * n]]
            last = arb_series([end, 1], 2)
            for j, column in enumerate(columns):
                pairs = zip(ending, column, strict=False)
                moved = [arb_series([x, dx], 2) for x, dx in pairs]
                moved += machine.drive(last) if j == width else ending[2 * n :]
                changed, _ = impact(machine, stop, regime, moved)
                rows.append([slope_of(x) for x in (*moved[:n], *changed, stop.gap(moved))])
        return Flight(start, ending, lasts, found, arb_mat(rows).transpose(), conditions)

    def flights(self, z: Sequence[arb]) -> list[Flight]:
        """All legs over a box."""
        return [self.flight(k, z) for k in range(len(self.legs))]

    def residual(self, z: Sequence[arb]) -> list[arb]:
        """F over a box."""
        found, width = [], 2 * self.machine.size + 1
        for k in range(len(self.legs)):
            *after, gap = self.flight(k, z, slopes=False).after
            first = (k + 1) % len(self.legs) * width
            found += [z[first + i] - x for i, x in enumerate(after)]
            found.append(gap)
        return found

    def blocks(self, k: int, flight: Flight) -> tuple[arb_mat, arb_mat]:
        """The blocks of DF of leg k: by its start and by its end, (2N + 1, 2N + 1) each."""
        width = flight.slopes.nrows()
        *states, gap = flight.slopes.tolist()
        rows = [*([-x for x in row] for row in states), gap]
        # the next node is a state, and the time of the end
        ends = arb_mat(width, width)
        for i, row in enumerate(rows):
            ends[i, width - 1] = row[width]
            if i < width - 1:
                ends[i, i] = 1
        return arb_mat([row[:width] for row in rows]), ends


def near_inverse(orbit: Orbit, z: Sequence[arb]) -> list[arb_mat]:
    """Any matrix near the inverse of DF, in columns of legs."""
    count, width = len(orbit.legs), len(z) // len(orbit.legs)
    matrix = np.zeros((count, width, count, width))
    try:
        for k, flight in enumerate(orbit.flights(z)):
            for block, place in zip(orbit.blocks(k, flight), (k, (k + 1) % count), strict=True):
                matrix[k, :, place] += _rounded(block)
        inverse = np.linalg.inv(matrix.reshape(len(z), len(z)))
        return [arb_mat(part.tolist()) for part in np.split(inverse, count, axis=1)]
    except (np.linalg.LinAlgError, ValueError, ZeroDivisionError) as error:
        raise Undecided("the equations are singular") from error


def _rounded(matrix: arb_mat) -> NDArray[np.float64]:
    numbers = np.array([float(x.mid()) for x in matrix.entries()])
    return numbers.reshape(matrix.nrows(), matrix.ncols())


def krawczyk(orbit: Orbit, box: Sequence[arb], near: Sequence[arb_mat]) -> list[arb]:
    """K(Z) of a box, whether or not it lies inside, with A = `near`."""
    centre, count, size = [x.mid() for x in box], len(near), len(box)
    width = size // count
    try:
        residual = orbit.residual(centre)
        blocks = [orbit.blocks(k, flight) for k, flight in enumerate(orbit.flights(box))]
    except (ValueError, ZeroDivisionError) as error:
        raise Undecided("a divisor may be 0 in the box") from error
    image = arb_mat(size, 1, centre)
    for k in range(count):
        place = slice(k * width, (k + 1) * width)
        # columns of I - A DF: where leg k starts, and where the one before ends
        left = near[k] * blocks[k][0] + near[k - 1] * blocks[k - 1][1]
        for i in range(width):
            left[k * width + i, i] -= 1
        away = [x - c for x, c in zip(box[place], centre[place], strict=True)]
        image -= left * arb_mat(width, 1, away) + near[k] * arb_mat(width, 1, residual[place])
    return list(image.entries())


def inside(inner: Iterable[arb], outer: Iterable[arb]) -> bool:
    """Whether each ball lies in the interior of another one."""
    return all(abs(x - y.mid()) < y.rad() for x, y in zip(inner, outer, strict=True))


def only_zero(orbit: Orbit, box: Sequence[arb]) -> list[arb]:
    """A small box that holds the only zero in a box; raises Refuted if there is none."""
    near = near_inverse(orbit, [x.mid() for x in box])
    image = krawczyk(orbit, box, near)
    if any(not x.overlaps(y) for x, y in zip(image, box, strict=True)):
        raise Refuted("the box holds no solution")
    if not inside(image, box):
        raise Undecided("Krawczyk's operator does not contract")
    for _ in range(_NARROWER):
        closer = krawczyk(orbit, image, near)
        if not inside(closer, image):
            break
        image = closer
    return image


def show_motion(orbit: Orbit, flights: Sequence[Flight]) -> None:
    """Show that a zero, over whose box these are the flights, is a motion, or raise."""
    for k, flight in enumerate(flights):
        for number, wrong in flight.conditions:
            if number < 0:
                raise Refuted(f"leg {k + 1}: {wrong}")
            if not number > 0:
                raise Undecided(f"leg {k + 1}: it is open whether {wrong}")
    for k, flight in enumerate(flights):
        _Flying(orbit, k, flight).show()


def show_shortest(orbit: Orbit, box: Sequence[arb]) -> None:
    """Show that the motion does not repeat earlier, after a p-th part of its legs and periods."""
    count, width = len(orbit.legs), 2 * orbit.machine.size + 1
    states = [box[k * width : (k + 1) * width - 1] for k in range(count)]
    both = math.gcd(count, orbit.m)
    for part in (count // p for p in range(2, both + 1) if both % p == 0):
        later = [*states[part:], *states[:part]]
        if all(all(map(arb.overlaps, *two)) for two in zip(states, later, strict=True)):
            raise Undecided("it may repeat earlier")


class _Flying:
    """That a flight meets no stop before its end, shown in pieces of time."""

    def __init__(self, orbit: Orbit, k: int, flight: Flight) -> None:
        self.machine, self.flight, self.name = orbit.machine, flight, f"leg {k + 1}"
        self.first, self.last = orbit.legs[k - 1][0], orbit.legs[k][0]
        g, n = self.machine.generator, self.machine.size
        self.first_row = [g[n, j] for j in range(2 * n + 3)]
        # over one of the first pieces a state changes by about half of its size at most
        stiff = max(float(abs(g[n + i, j]).upper()) for i in range(n) for j in range(2 * n))
        speed = max(1.0, stiff, float(self.machine.omega.upper()))
        self.coarse, self.pieces = math.ceil(math.log2(2 * speed)), 0

    def show(self) -> None:
        """Show it, or raise."""
        stops = range(len(self.machine.stops))
        self.clear = [self.flight.duration - arb(2) ** -self._end(j) for j in stops]
        place, w = fmpq(0), self.flight.start
        while todo := [j for j in stops if not arb(place) >= self.clear[j]]:
            self._piece(place, w, self.coarse, todo)
            place += fmpq(1, 2**self.coarse)
            w = self.machine.step(self.coarse) * w

    def _end(self, j: int) -> int:
        """Halvings of a last piece in which stop j is not met before the end."""
        stop, end, n = self.machine.stops[j], self.flight.end, self.machine.size
        for halvings in range(self.coarse, _DEEPEST):
            back = self.machine.step(halvings, -1, up_to=True)
            w = (back * arb_mat(len(end), 1, end)).entries()
            # g = 0 at the end and g' > 0 before it; of another stop g < 0
            if stop.rate(w, n) > 0 if j == self.last else stop.gap(w) < 0:
                return halvings
            if j != self.last and stop.gap(end) > 0:
                raise Refuted(f"{self.name}: stop {j} is met before the end")
        raise Undecided(f"{self.name}: it is open whether stop {j} is met near the end")

    def _piece(self, place: fmpq, w: arb_mat, level: int, todo: Sequence[int]) -> None:
        """Show it over 2^-level from a time on, where the state is w."""
        machine, n = self.machine, self.machine.size
        self.pieces += 1
        if self.pieces > _MOST_PIECES or level > _DEEPEST:
            time = f"{float(arb(place).mid()):.6g}"
            raise Undecided(f"{self.name}: it is open whether a stop is met {time} after its start")
        here, wide = w.entries(), (machine.step(level, up_to=True) * w).entries()
        half, left = arb(2) ** -(level + 1), []
        after = arb(half, half)
        for j in todo:
            stop = machine.stops[j]
            bend = stop.acceleration(wide, n, self.first_row)
            if place == 0 and j == self.first:
                # g = 0, and then g' < 0; or after a plastic impact g' = 0 exactly, and g'' < 0
                falls = stop.rate(wide, n) < 0 or (stop.restitution.is_zero() and bend < 0)
            else:
                falls = stop.gap(here) + after * (stop.rate(here, n) + bend * after / 2) < 0
            if not falls and not arb(place) >= self.clear[j]:
                left.append(j)
        if left:
            middle, then = machine.step(level + 1) * w, place + fmpq(1, 2 ** (level + 1))
            for j in left:
                if machine.stops[j].gap(middle.entries()) > 0 and self.flight.duration > arb(then):
                    raise Refuted(f"{self.name}: stop {j} is met before the end")
            self._piece(place, w, level + 1, left)
            self._piece(then, middle, level + 1, left)


def return_map(flights: Sequence[Flight]) -> arb_mat:
    """The derivative of the return map of the first node, (2N + 1, 2N + 1).

    It maps onto the surface g = 0, so that one of its eigenvalues is 0 and no multiplier.
    """
    total = None
    for flight in flights:
        slopes, width = flight.slopes, flight.slopes.nrows()
        # the time of the end by g = 0
        time = [-slopes[width - 1, j] / slopes[width - 1, width] for j in range(width)]
        rows = [
            [slopes[i, j] + slopes[i, width] * time[j] for j in range(width)]
            for i in range(width - 1)
        ]
        matrix = arb_mat([*rows, time])
        total = matrix if total is None else matrix * total
    assert total is not None
    return total


def settled(matrix: arb_mat) -> acb_mat:
    """A similar matrix, nearly diagonal where that is possible: it has narrower discs."""
    numbers = _rounded(matrix)
    if not np.isfinite(numbers).all():
        raise Undecided("the derivative of the return map is not bounded")
    try:
        vectors = np.linalg.eig(numbers)[1]  # any regular matrix will do
        basis = acb_mat([[acb(x.real, x.imag) for x in row] for row in vectors.tolist()])
        return basis.solve(acb_mat(matrix) * basis)
    except (ZeroDivisionError, np.linalg.LinAlgError):
        return acb_mat(matrix)


def multipliers(matrix: acb_mat) -> list[acb]:
    """Discs of the multipliers of a return map, with multiplicity, by falling modulus."""
    try:
        found: list[acb] = matrix.eig(multiple=True)
    except ValueError as error:
        raise Undecided("multipliers too close to each other to tell apart") from error
    found.sort(key=lambda x: (-round(float(abs(x).upper()), 12), -float(x.imag.mid())))
    zeros = [x for x in found if x.contains(0)]
    if len({(str(x.real), str(x.imag)) for x in zeros}) != 1:
        raise Undecided("a multiplier too close to 0 to tell it apart")
    found.remove(zeros[0])
    return found


def stability(ascending: Sequence[acb]) -> Stability:
    """Where the zeros of a characteristic polynomial lie, by Schur (1917) and Cohn (1922).

    If |p_0| < |p_n| then p has one zero more in the unit circle than q = (p_n p - p_0 p*)/z, and as
    many outside; p* has the coefficients reversed. If |p_0| > |p_n| a zero lies outside.
    """
    p = [x.real for x in ascending]
    while len(p) > 1:
        low, high = abs(p[0]), abs(p[-1])
        if low > high:
            return "unstable"
        if not low < high:
            return "undecided"
        p = [p[-1] * a - p[0] * b for a, b in zip(p, reversed(p), strict=True)][1:]
        p = [a / p[-1].mid() for a in p]
    return "stable"
