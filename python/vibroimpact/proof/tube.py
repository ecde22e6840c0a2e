"""A piece of a branch in balls: a tube in which each plane across it holds one solution.

The unknowns are Y = (z, p): the nodes and the parameter. Along a tube one of them, Y_i, goes on
steadily, Y_i = a + b h, and the others are functions of h. About a centre line L(h) = Y_0 + Y_1 h +
Y_2 h^2 + ... a tube is L(h) + [-R, R] where Y_i = L_i(h) for |h| <= 1, whatever the number R_i is.
The theorem of verifier.py holds for each h, with E = (F, Y_i - L_i(h)) and any matrices A(h):

    K(h) = -A E(L(h)) + (I - A DE(L(h) + [-R, R])) [-R, R]   inside [-R, R]

prove one solution in the tube for each h, in L(h) + K, and that they are a smooth curve.

Numbers are power series in h. Of a function f(h) = f_0 + f_1 h + ... + f_n h^n, where f_k is the
coefficient at h = 0 and the last one that at some other h (Lagrange's remainder).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from math import comb
from typing import Any, TypeAlias

from flint import arb, arb_mat, arb_series

from .formulas import Landing, Machine, Number, Undecided, dot
from .near import inverses_of
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
    return product(exponential([x * middle for x in given]), exponential(product(given, rest)))


def exponential(given: Matrices) -> Matrices:
    """The exponential: its coefficients are blocks of that of a matrix of blocks."""
    size, terms = given[0].nrows(), len(given)
    if all(x.is_zero() for matrix in given[1:] for x in matrix.entries()):
        return [given[0].exp(), *given[1:]]
    grids = [[[arb(0)] * size] * size] * (terms - 1) + [x.tolist() for x in given]
    starts = range(terms)[::-1]
    rows = [[x for g in grids[k : k + terms] for x in g[i]] for k in starts for i in range(size)]
    top = arb_mat(rows).exp().tolist()[:size]
    return [arb_mat([row[k * size : (k + 1) * size] for row in top]) for k in range(terms)]


@dataclass(frozen=True)
class Leg:
    """A flight and its impact along a line: w at the start and at the end, and the flow between."""

    family: Family
    line: Sequence[Number]
    orbit: Orbit
    k: int
    terms: int
    first: list[Number]
    flow: list[list[arb_series]]
    last: list[Number]
    end: Number
    landing: Landing  # the state after the impact and the gap at it; conditions but for the time

    def moved(self, by: Sequence[Number], later: int) -> list[Number]:
        """State and gap, had the flight ended at w + h^terms `by`, and its time `later` as much."""
        made, places = list[arb_series](), range(self.terms)
        for x, dx in zip([*self.last[: len(by)], self.end], [*by, arb(later)], strict=True):
            both = [term(x, k) for k in places] + [_LARGE * term(dx, k) for k in places]
            made.append(arb_series(both, 2 * self.terms))
        return self.orbit.after(self.k, made[:-1] + self.orbit.machine.drive(made[-1]), made[-1])[0]

    def slopes(self) -> list[list[Number]]:
        """Derivatives of these by the state and time of the start, and by the time of the end.

        The derivative f' of a function in a direction d is in f(x + h^terms d) = f(x) +
        h^terms f'(x) d + ...; x and d are series, too.
        """
        machine, n, places = self.orbit.machine, 2 * self.orbit.machine.size, range(self.terms)
        rate = [dot(row, self.last) for row in machine.rows[:n]]
        turn = [dot(row, self.first) for row in machine.rows[n:]]
        columns = [[row[j] for row in self.flow] for j in range(n)]
        columns += [[dot(row[n:], turn) - x for row, x in zip(self.flow, rate, strict=True)], rate]
        still, found = self.moved([arb(0)] * n, 0), list[list[Number]]()
        for j, column in enumerate(columns):
            changes = zip(self.moved(column, int(j == n + 1)), still, strict=True)
            rows = [[term(x - y, self.terms + k) / _LARGE for k in places] for x, y in changes]
            found.append([arb_series(row, self.terms) for row in rows])
        return found


def residual(legs: Sequence[Leg]) -> Matrices:
    """The coefficients of F along a line, columns."""
    found = []
    for leg, then in zip(legs, [*legs[1:], legs[0]], strict=True):
        *after, gap = leg.landing[0]
        found += [[x - y] for x, y in zip(then.first, after, strict=False)] + [[gap]]
    return matrices(found, legs[0].terms)


def return_map(legs: Sequence[Leg]) -> list[tuple[arb_mat, arb]]:
    """The coefficients of the derivative of the return map, one of whose eigenvalues is 0.

    It is that of a matrix over that of a number, which is 0 at a graze: of a leg g', as its time is
    that of g = 0, and the derivative of state and time after it by those of its start, times g'.
    """
    n, terms = 2 * legs[0].orbit.machine.size, legs[0].terms
    total, rates = list[arb_mat](), list[arb]()
    for leg in legs:
        *starts, ends = leg.slopes()
        rows = [[x[i] * ends[-1] - ends[i] * x[-1] for x in starts] for i in range(n)]
        one = matrices([*rows, [-x[-1] for x in starts]], terms)
        rate = [term(ends[-1], k) for k in range(terms)]
        total, rates = (product(one, total), product(rate, rates)) if total else (one, rate)
    return list(zip(total, rates, strict=True))


def at(given: Sequence[Any], h: arb) -> Any:
    """The value, Horner's scheme."""
    return reduce(lambda total, one: total * h + one, reversed(given))


TERMS, _SLOPES = 5, 2  # of power series along a tube, at most; of derivatives
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
        machine, n, legs = orbit.machine, 2 * orbit.machine.size, list[Leg]()
        for k in range(len(self.legs)):
            begin, end, lasts = orbit.times(k, line[:-1])
            first = [*line[k * (n + 1) : (k + 1) * (n + 1) - 1], *machine.drive(begin)]
            exp = flow(machine, lasts, terms)
            grid = [
                [arb_series([x[i, j] for x in exp], terms) for j in range(n + 3)] for i in range(n)
            ]
            last = [*(dot(row, first) for row in grid), *machine.drive(end)]
            landing = orbit.after(k, last, end)
            legs.append(Leg(self, line, orbit, k, terms, first, grid, last, end, landing))
        return legs


def derivative(legs: Sequence[Leg], axis: int) -> Matrices:
    """The coefficients of DE along a line, but for the column of p if Y_i is p."""
    family, line, terms = legs[0].family, legs[0].line, legs[0].terms
    last = len(line) - 1
    width, rows = last // len(legs), [list[Number]([arb(0)] * (last + 1)) for _ in line]
    rows[last][axis] = arb(1)
    for k, leg in enumerate(legs):
        then = (k + 1) * width % last
        places = [*range(k * width, (k + 1) * width), then + width - 1]
        for place, column in zip(places, leg.slopes(), strict=True):
            for i, x in enumerate(column, k * width):
                rows[i][place] += x if i == (k + 1) * width - 1 else -x
        for i in range(width - 1):
            rows[k * width + i][then + i] += 1
    if axis != last:
        *z, p = (arb_series([term(x, k) for k in range(terms)], 2 * terms) for x in line)
        more = p + arb_series([arb(0)] * terms + [_LARGE], 2 * terms)
        here, there = (residual(family.along([*z, x], 2 * terms))[terms:] for x in (p, more))
        column = [(y - x).entries() for x, y in zip(here, there, strict=True)]
        for i, x in enumerate(zip(*column, strict=True)):
            rows[i][last] = arb_series(list(x), terms) / _LARGE
    return matrices(rows, terms)


@dataclass(frozen=True)
class Tube:
    """Y_0, Y_1, ... of the centre line, R and i."""

    family: Family
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

    def taylor(self, of: Callable[[Any], list[Any]], away: Sequence[arb], terms: int) -> list[Any]:
        """Coefficients along L(h) + `away`: about its middle, but the last one about all of it."""
        found = list[Any]()
        for h, count in [(arb(0), terms - 1)] * (terms > 1) + [(WHOLE, terms)]:
            rows = [self.part(h, away)] + [self.coefficients(h, k) for k in range(1, count)]
            line = [arb_series(list(x), count) for x in zip(*rows, strict=True)]
            found += of(self.family.along(line, count))[len(found) :]
        return found

    def place(self, point: Sequence[arb]) -> arb | None:
        """The h of a point inside the tube, else None."""
        h = (point[self.axis] - self.line[0][self.axis]) / self.line[1][self.axis]
        near = zip(point, self.coefficients(h, 0), self.radius, strict=True)
        return h if abs(h) < 1 and all(abs(x - y) < r for x, y, r in near) else None


def krawczyk(tube: Tube) -> tuple[list[arb], Matrices, arb_mat]:
    """K of a tube, A along it, and A DE in all of it."""
    size, axis, terms = len(tube.radius), tube.axis, min(_SLOPES, len(tube.line) - 1)
    sides = [arb(0, r) if j != axis else arb(0) for j, r in enumerate(tube.radius)]
    slopes = tube.taylor(lambda legs: derivative(legs, axis), sides, terms)
    rest = at(tube.taylor(residual, [arb(0)] * size, len(tube.line)), WHOLE).entries()
    near, zeros = inverses_of(slopes), [arb_mat(size, size)] * (terms - 1)
    both = at(product([*near, *zeros], [*slopes, *zeros]), WHOLE)
    away = (arb_mat(size, size, 1) - both) * arb_mat(size, 1, sides)
    found = (away - at(near, WHOLE) * arb_mat(size, 1, [*rest, arb(0)])).entries()
    found[axis] = arb(0)  # Y_i = L_i(h), exactly
    return found, near, both
