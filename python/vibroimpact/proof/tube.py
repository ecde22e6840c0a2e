"""A piece of a branch in balls: a tube in which each plane across it holds one solution.

The unknowns are Y = (z, p): the nodes and the parameter. Along a tube one of them, Y_i, goes on
steadily, Y_i = a + b h, and the others are functions of h. About a centre line
L(h) = Y_0 + Y_1 h + Y_2 h^2 + ... a tube is L(h) + [-R, R] for |h| <= 1. The theorem of verifier.py
holds for all h at once: with any matrix A and the equations E = (F, Y_i - L_i(h)),

    K = -A E(L(h)) + (I - A DE(tube)) [-R, R]   inside [-R, R]

proves one solution in the tube for each h, in L(h) + K, and that they are a smooth curve.

Along a line numbers are power series in h. Of a function f(h) = f_0 + f_1 h + ... + f_n h^n, where
f_k is the coefficient at h = 0 and the last one that at some other h (Lagrange's remainder).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from math import comb
from typing import Any, TypeAlias

from flint import arb, arb_mat, arb_series

from .formulas import Landing, Machine, Number, Undecided, dot
from .near import inverse_of
from .verifier import Orbit

Matrices: TypeAlias = list[arb_mat]  # coefficients of 1, h, h^2, ...
_LARGE = arb(2) ** 40  # times a direction, so that the next terms are small beside it


def term(x: Number, k: int) -> arb:
    """The coefficient of h^k."""
    if not isinstance(x, arb_series):
        return x if k == 0 else arb(0)
    if k >= x.prec:
        raise Undecided("a power series is too short")
    return x[k]


def matrices(rows: Sequence[Sequence[Number]], terms: int) -> Matrices:
    """The coefficients of a matrix of power series."""
    return [arb_mat([[term(x, k) for x in row] for row in rows]) for k in range(terms)]


def product(a: Sequence[Any], b: Sequence[Any]) -> list[Any]:
    """The coefficients of a product of matrices, or numbers."""
    return [sum((a[i] * b[k - i] for i in range(1, k + 1)), a[0] * b[k]) for k in range(len(a))]


def flow(machine: Machine, lasts: Number, terms: int) -> Matrices:
    """exp(tau G), where tau and G depend on h: of the midpoint of tau times that of the rest."""
    given, middle = matrices(machine.rows, terms), term(lasts, 0).mid()
    rest = [term(lasts - middle, k) for k in range(terms)]
    if not all(x.is_zero() for matrix in given[1:] for x in matrix.entries()):
        return product(exponential([x * middle for x in given]), exponential(product(given, rest)))
    found = [(given[0] * middle).exp() * (given[0] * rest[0]).exp()]
    for k in range(1, terms):  # X' = tau' G X
        parts = [found[k - j] * (rest[j] * j / k) for j in range(1, k + 1)]
        found.append(given[0] * sum(parts[1:], parts[0]))
    return found


def exponential(given: Matrices) -> Matrices:
    """The exponential: its coefficients are blocks of that of a matrix of blocks."""
    size, terms = given[0].nrows(), len(given)
    grids = [[[arb(0)] * size] * size] * (terms - 1) + [x.tolist() for x in given]
    rows = [
        [x for grid in grids[terms - 1 - place : 2 * terms - 1 - place] for x in grid[i]]
        for place in range(terms)
        for i in range(size)
    ]
    top = arb_mat(rows).exp().tolist()[:size]
    return [arb_mat([row[k * size : (k + 1) * size] for row in top]) for k in range(terms)]


@dataclass(frozen=True)
class Leg:
    """A flight and its impact along a line: w at the start and at the end, and the flow between."""

    orbit: Orbit
    k: int
    terms: int
    first: list[Number]
    flow: list[list[arb_series]]
    last: list[Number]
    end: Number

    @classmethod
    def of(cls, orbit: Orbit, k: int, z: Sequence[Number], terms: int) -> Leg:
        """Leg k of nodes that are series."""
        machine, n, (begin, end, lasts) = orbit.machine, 2 * orbit.machine.size, orbit.times(k, z)
        first = [*z[k * (n + 1) : (k + 1) * (n + 1) - 1], *machine.drive(begin)]
        exp = flow(machine, lasts, terms)
        grid = [[arb_series([x[i, j] for x in exp], terms) for j in range(n + 3)] for i in range(n)]
        last = [*(dot(row, first) for row in grid), *machine.drive(end)]
        return cls(orbit, k, terms, first, grid, last, end)

    def after(self) -> Landing:
        """The state after the impact and the gap at it; conditions but for the time of flight."""
        return self.orbit.after(self.k, self.last, self.end)

    def moved(self, by: Sequence[Number], later: int) -> list[Number]:
        """What `after` has at w + h^terms `by`, with the time of the end as much `later`."""
        made, places = list[arb_series](), range(self.terms)
        for x, dx in zip([*self.last[: len(by)], self.end], [*by, arb(later)], strict=True):
            both = [term(x, k) for k in places] + [_LARGE * term(dx, k) for k in places]
            made.append(arb_series(both, 2 * self.terms))
        return self.orbit.after(self.k, made[:-1] + self.orbit.machine.drive(made[-1]), made[-1])[0]

    def passed(self) -> tuple[Matrices, list[arb]]:
        """The derivative of the state and time after the impact by those of the start, times g'.

        And g' at the impact, whose time is that of g = 0. The derivative f' of a function in a
        direction d is in f(x + h^terms d) = f(x) + h^terms f'(x) d + ...; x and d are series, too.
        """
        machine, n, places = self.orbit.machine, 2 * self.orbit.machine.size, range(self.terms)
        rate = [dot(row, self.last) for row in machine.rows[:n]]
        turn = [dot(row, self.first) for row in machine.rows[n:]]
        columns = [[row[j] for row in self.flow] for j in range(n)]
        columns += [[dot(row[n:], turn) - x for row, x in zip(self.flow, rate, strict=True)], rate]
        still, slopes = self.moved([arb(0)] * n, 0), list[list[Number]]()
        for j, column in enumerate(columns):
            changes = zip(self.moved(column, int(j == n + 1)), still, strict=True)
            rows = [[term(x - y, self.terms + k) / _LARGE for k in places] for x, y in changes]
            slopes.append([arb_series(row, self.terms) for row in rows])
        *starts, ends = slopes
        rows = [[x[i] * ends[-1] - ends[i] * x[-1] for x in starts] for i in range(n)]
        rows.append([-x[-1] for x in starts])
        return matrices(rows, self.terms), [term(ends[-1], k) for k in places]


def residual(legs: Sequence[Leg]) -> Matrices:
    """The coefficients of F along a line, columns."""
    found = []
    for leg, then in zip(legs, [*legs[1:], legs[0]], strict=True):
        *after, gap = leg.after()[0]
        found += [[x - y] for x, y in zip(then.first, after, strict=False)] + [[gap]]
    return matrices(found, legs[0].terms)


def return_map(legs: Sequence[Leg]) -> list[tuple[arb_mat, arb]]:
    """The coefficients of the derivative of the return map, one of whose eigenvalues is 0.

    It is that of a matrix over that of a number, which is 0 at a graze.
    """
    total, rates = legs[0].passed()
    for leg in legs[1:]:
        one, rate = leg.passed()
        total, rates = product(one, total), product(rate, rates)
    return list(zip(total, rates, strict=True))


def at(given: Sequence[Any], h: arb) -> Any:
    """The value, Horner's scheme."""
    return reduce(lambda total, one: total * h + one, reversed(given))


TERMS = 5  # of power series along a tube, at most
WHOLE = arb(0, 1)  # all values of h


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
        """The legs along a line; numbers of the machine have twice as many terms."""
        orbit = self.at(arb_series([term(line[-1], k) for k in range(terms)], 2 * terms))
        return [Leg.of(orbit, k, line[:-1], terms) for k in range(len(self.legs))]


@dataclass(frozen=True)
class Tube:
    """Y_0, Y_1, ... of the centre line, R and i."""

    line: list[list[arb]]
    radius: list[arb]
    axis: int

    def coefficients(self, h: arb, k: int) -> list[arb]:
        """The coefficients of power k of the centre line about h."""
        found = [arb(0)] * len(self.radius)
        for j in range(len(self.line) - 1, k - 1, -1):
            found = [x * h + comb(j, k) * y for x, y in zip(found, self.line[j], strict=True)]
        return found

    def part(self, h: arb, away: Sequence[arb]) -> list[arb]:
        """The part at some values of h."""
        return [x + a for x, a in zip(self.coefficients(h, 0), away, strict=True)]

    def taylor(
        self, of: Callable[[Sequence[Leg]], list[Any]], family: Family, away: Sequence[arb]
    ) -> list[Any]:
        """Coefficients along L(h) + `away`: about its middle, but the last one about all of it."""
        found, terms = [], len(self.line)
        for h in (arb(0), WHOLE):
            rows = [self.part(h, away)] + [self.coefficients(h, k) for k in range(1, terms)]
            line = [arb_series(list(x), terms) for x in zip(*rows, strict=True)]
            found.append(of(family.along(line, terms)))
        return [*found[0][:-1], found[1][-1]]

    def place(self, point: Sequence[arb]) -> arb | None:
        """The h of a point inside the tube, else None."""
        h = (point[self.axis] - self.line[0][self.axis]) / self.line[1][self.axis]
        near = zip(point, self.coefficients(h, 0), self.radius, strict=True)
        return h if abs(h) < 1 and all(abs(x - y) < r for x, y, r in near) else None


def derivative(family: Family, axis: int, box: Sequence[arb]) -> arb_mat:
    """DE over a box."""
    orbit = family.at(box[-1])
    width, count = 2 * orbit.machine.size + 1, len(orbit.legs)
    rows = arb_mat(width * count + 1, width * count + 1)
    for k, flight in enumerate(orbit.flights(box[:-1])):
        for block, node in zip(orbit.blocks(k, flight), (k, (k + 1) % count), strict=True):
            for i, x in enumerate(block.entries()):
                rows[k * width + i // width, node * width + i % width] += x
    legs = family.along([*box[:-1], arb_series([box[-1], 1], 2)], 2)
    for i, x in enumerate(residual(legs)[1].entries()):
        rows[i, width * count] = x
    rows[width * count, axis] = 1
    return rows


def image(family: Family, tube: Tube) -> list[arb]:
    """K of a tube."""
    size, radius = len(tube.radius), [arb(0, r) for r in tube.radius]
    slopes = derivative(family, tube.axis, tube.part(WHOLE, radius))
    rest = at(tube.taylor(residual, family, [arb(0)] * size), WHOLE)
    near = inverse_of(slopes)
    left = arb_mat(size, size, 1) - near * slopes
    away = left * arb_mat(size, 1, radius) - near * arb_mat(size, 1, [*rest.entries(), arb(0)])
    away[tube.axis, 0] = 0  # Y_i = L_i(h), exactly
    return list(away.entries())
