"""Verify that a periodic motion exists, is alone near by, and is stable.

The unknowns z are the nodes: state (q, v) just after each impact, and its time t. Leg k, a flight
phi to an impact R, asks for
    (q, v)_{k+1} - R(phi((q, v)_k, t_k, t_{k+1})) = 0,   g(phi(...)) = 0,   t_n = t_0 + m T.   (F)
A motion without impacts is one leg, where R is the identity, and t_0 = 0 in the place of g = 0.
1. It exists, and is alone. Zeros of F in a box Z about z0 lie in Krawczyk's
   K(Z) = z0 - A F(z0) + (I - A DF(Z)) (Z - z0), with any matrix A. If K lies inside Z there is
   exactly one (Neumaier, Interval Methods for Systems of Equations (1990), section 5.1).
2. It is a motion. At the zero flight times and approach velocities are positive, the inequalities
   of each regime hold strictly (section 4), and no flight meets a stop before its end.
3. It is stable, or not: multipliers of the return map (section 7), from DF.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from flint import acb, acb_mat, arb, arb_mat, arb_series, fmpq

from .formulas import Landing, Machine, Number, Refuted, Undecided, impact
from .near import near_inverse

Stability = Literal["stable", "unstable", "undecided"]
CIRCUIT = (-1, "no_impact")  # the leg of a motion without impacts
PASSED = "passed"  # no impact, in branches: a flight is cut where a gap is largest, g' = 0
CUTS = (PASSED, CIRCUIT[1])  # ends of legs that are no impacts
_DEEPEST, _MOST_PIECES, _AFRESH, _NARROWER = 100, 100_000, 32, 8  # of a flight; boxes


@dataclass(frozen=True)
class Flight:
    """A flight over a box from w = `start`, and what comes after it."""

    start: arb_mat
    duration: arb
    after: list[arb]
    slopes: arb_mat  # derivatives of `after` by the node of the start and t of the end
    conditions: list[tuple[arb, str]]


@dataclass(frozen=True)
class Orbit:
    """The equations (F) of a motion: m drive periods; stop and regime at the end of each leg."""

    machine: Machine
    m: int
    legs: tuple[tuple[int, str], ...]

    def times(self, k: int, z: Sequence[Number]) -> tuple[Number, Number, Number]:
        """Start, end (but for m periods) and duration of leg k."""
        width, after = 2 * self.machine.size + 1, (k + 1) % len(self.legs)
        begin, end = z[(k + 1) * width - 1], z[(after + 1) * width - 1]
        lasts = end - begin if after != k else arb(0)  # a single leg: m T exactly
        whole = 2 * arb.pi() * self.m / self.machine.omega
        return begin, end, lasts + whole if after == 0 else lasts

    def after(self, k: int, w: Sequence[Number], time: Number) -> Landing:
        """What (F) has of the end w of leg k: (q, v) after the impact, and g; conditions."""
        n = self.machine.size
        if self.legs[k] == CIRCUIT:
            return [*w[: 2 * n], time], []
        stop, regime = self.machine.stops[self.legs[k][0]], self.legs[k][1]
        if regime == PASSED:
            return [*w[: 2 * n], stop.gap(w, 1)], [(-stop.gap(w), "a stop is met in a flight")]
        velocities, conditions = impact(self.machine, stop, regime, w)
        return [*w[:n], *velocities, stop.gap(w)], conditions

    def flight(self, k: int, z: Sequence[arb], *, slopes: bool = True) -> Flight:
        """Leg k over a box."""
        machine, n, (begin, end, lasts) = self.machine, 2 * self.machine.size, self.times(k, z)
        state = z[k * (n + 1) : (k + 1) * (n + 1) - 1]
        start, flow = arb_mat(n + 3, 1, [*state, *machine.drive(begin)]), machine.flow(lasts)
        # the drive at the end depends on the time there alone
        ending = [*(flow * start).entries()[:n], *machine.drive(end)]
        after, conditions = self.after(k, ending, end)
        conditions, rows = [(lasts, "the flight time is negative"), *conditions], []
        if slopes:
            rate, turn = machine.generator * (flow * start), machine.generator * start
            by_begin = flow * arb_mat(n + 3, 1, [arb(0)] * n + turn.entries()[n:]) - rate
            columns = [*flow.transpose().tolist()[:n], by_begin.entries(), rate.entries()]
            for j, column in enumerate(columns):
                time = arb_series([end, int(j == n + 1)], 2)
                moved = [arb_series([x, y], 2) for x, y in zip(ending, column[:n], strict=False)]
                moved += machine.drive(time) if j == n + 1 else ending[n:]
                rows.append([x[1] for x in self.after(k, moved, time)[0]])
        return Flight(start, lasts, after, arb_mat(rows).transpose(), conditions)

    def flights(self, z: Sequence[arb]) -> list[Flight]:
        """All legs over a box."""
        return [self.flight(k, z) for k in range(len(self.legs))]

    def residual(self, z: Sequence[arb]) -> list[arb]:
        """F over a box."""
        found, count, width = list[arb](), len(self.legs), 2 * self.machine.size + 1
        for k in range(count):
            *state, last = self.flight(k, z, slopes=False).after
            found += [z[(k + 1) % count * width + i] - x for i, x in enumerate(state)] + [last]
        return found

    def blocks(self, k: int, flight: Flight) -> tuple[arb_mat, arb_mat]:
        """The blocks of DF of leg k: by its start and by its end, (2N + 1, 2N + 1) each."""
        n, (*states, last) = 2 * self.machine.size, flight.slopes.tolist()
        rows = [*([-x for x in row] for row in states), last]
        # the next node is a state, and the time of the end
        ends = [[*(arb(int(i == j)) for j in range(n)), row[-1]] for i, row in enumerate(rows)]
        return arb_mat([row[: n + 1] for row in rows]), arb_mat(ends)


def krawczyk(orbit: Orbit, box: Sequence[arb], near: Sequence[arb_mat]) -> list[arb]:
    """K(Z) of a box, whether or not it lies inside; `near`: the columns of A of each leg."""
    centre, count, width = [x.mid() for x in box], len(near), len(box) // len(near)
    residual = orbit.residual(centre)
    blocks = [orbit.blocks(k, flight) for k, flight in enumerate(orbit.flights(box))]
    image = arb_mat(len(box), 1, centre)
    for k in range(count):
        place = slice(k * width, (k + 1) * width)
        # columns of A DF - I: where leg k starts, and where the one before ends
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
        if not sum(x.rad() for x in closer) < sum(x.rad() for x in image) / 2:
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
    hits = [k for k in range(len(flights)) if orbit.legs[k - 1][1] not in CUTS]
    after = [flights[k].start.entries()[:-3] for k in hits] or [[]] * orbit.m
    for p in range(2, math.gcd(count := len(after), orbit.m) + 1):
        if count % p == orbit.m % p == 0 and all(map(arb.overlaps, after[0], after[count // p])):
            raise Undecided("it may repeat earlier")
    for k, flight in enumerate(flights):
        show_clear(orbit, k, flight)


def show_clear(orbit: Orbit, k: int, flight: Flight) -> None:
    """Show that flight k meets no stop before its end, in pieces of time, which are halved."""
    machine, first, last = orbit.machine, orbit.legs[k - 1][0], orbit.legs[k][0]
    coarse = 5 - math.floor(math.log2(float(flight.duration.mid())))
    place, w, levels, pieces, lost = fmpq(0), flight.start, list[int](), 0, False
    while True:
        level, pieces = levels.pop() if levels else coarse, pieces + 1
        if lost or pieces > _MOST_PIECES or level > coarse + _DEEPEST:
            raise Undecided(f"leg {k + 1}: open whether a stop is met at {float(arb(place)):.6g}")
        half, here, left = arb(2) ** -(level + 1), w.entries(), []
        ends = flight.duration < arb(place) + 4 * half
        reach = level - 1 if ends else level  # the last piece is taken twice as long
        after, wide = arb(2) ** -(reach + 1) * arb(1, 1), machine.step(reach, up_to=True) * w
        for j, stop in enumerate(machine.stops):
            rate, bend = stop.gap(wide.entries(), 1), stop.gap(wide.entries(), 2)
            if place == 0 and j == first:  # g = 0, g' <= 0; then g' < 0, or g'' < 0
                clear = rate < 0 or bend < 0
            elif ends and j == last:  # g = 0 in the end, where g' = u > 0; g' > 0 before
                clear = rate > 0 or bend < 0
            else:
                lost |= not stop.gap(here) < 0  # then halving tells no more
                clear = stop.gap(here) + after * (stop.gap(here, 1) + bend * after / 2) < 0
            left += [] if clear else [j]
        if ends and not left:
            return
        if not left:
            place, w = place + fmpq(2) ** -level, machine.step(level) * w
            w = w if pieces % _AFRESH else machine.flow(arb(place)) * flight.start  # balls grow
        else:
            levels += [level + 1, level + 1]
            middle = (machine.step(level + 1) * w).entries()
            for j in left if arb(place) + half < flight.duration else []:
                if machine.stops[j].gap(middle) > 0:
                    raise Refuted(f"leg {k + 1}: stop {j} is met before the end")


def spectrum(orbit: Orbit, flights: Sequence[Flight]) -> tuple[Stability, list[acb], str]:
    """Stability, discs of the multipliers (section 7) by falling modulus; why there are none."""
    matrix: Any = 1
    for k, flight in enumerate(flights):
        starts, ends = orbit.blocks(k, flight)
        matrix = acb_mat(ends.solve(-starts)) * matrix
    steady = stability(matrix.charpoly().coeffs())
    try:
        discs: list[acb] = matrix.eig(multiple=True)
    except ValueError:
        return steady, [], "multipliers too close to each other to tell apart"
    discs.sort(key=lambda x: (-round(float(abs(x).upper()), 12), -float(x.imag.mid())))
    # the return map maps onto g = 0: one of the eigenvalues of its derivative is 0, no multiplier
    zeros = [x for x in discs if x.contains(0)]
    if len({(str(x.real), str(x.imag)) for x in zeros}) != 1:
        return steady, [], "a multiplier too close to 0 to tell it apart"
    discs.remove(zeros[0])
    return steady, discs, ""


def stability(ascending: Sequence[acb]) -> Stability:
    """Where the zeros of a characteristic polynomial lie, by Schur (1917) and Cohn (1922).

    If |p_0| < |p_n| then p has one zero more in the unit circle than q = (p_n p - p_0 p*)/z, and as
    many outside; p* has the coefficients reversed. If |p_0| > |p_n| a zero lies outside.
    """
    p = [x.real for x in ascending]
    while len(p) > 1:
        if abs(p[0]) > abs(p[-1]):
            return "unstable"
        if not abs(p[0]) < abs(p[-1]):
            return "undecided"
        p = [p[-1] * a - p[0] * b for a, b in zip(p, reversed(p), strict=True)][1:]
        p = [a / p[-1].mid() for a in p]
    return "stable"
