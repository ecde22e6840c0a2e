"""Flights and impacts along a line: every number is a power series in h, of a few terms.

Of a function f of h, f(h) = f_0 + f_1 h + ... + f_K h^K for |h| <= H, where f_k is the coefficient
at h = 0 and the last one that at some other h (Taylor's theorem, Lagrange's remainder).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from flint import arb, arb_mat, arb_series

from .formulas import Landing, Machine, Number, dot, impact
from .verifier import Orbit

#: A matrix with power series as entries.
Rows: TypeAlias = Sequence[Sequence[Number]]
#: Coefficients of a matrix: those of 1, h, h^2, ...
Matrices: TypeAlias = list[arb_mat]


@dataclass(frozen=True)
class Dual:
    """A number with its derivative in one more direction; both may be series."""

    value: Number
    slope: Number

    def __getitem__(self, place: int) -> Number:
        """The value, or the slope."""
        return self.slope if place else self.value

    def __add__(self, other: Number) -> Dual:
        """The sum."""
        value, slope = _parts(other)
        return Dual(self.value + value, self.slope + slope)

    __radd__ = __add__

    def __neg__(self) -> Dual:
        """The opposite."""
        return Dual(-self.value, -self.slope)

    def __sub__(self, other: Number) -> Dual:
        """The difference."""
        value, slope = _parts(other)
        return Dual(self.value - value, self.slope - slope)

    def __rsub__(self, other: Number) -> Dual:
        """The difference."""
        value, slope = _parts(other)
        return Dual(value - self.value, slope - self.slope)

    def __mul__(self, other: Number) -> Dual:
        """The product."""
        value, slope = _parts(other)
        return Dual(self.value * value, self.value * slope + self.slope * value)

    __rmul__ = __mul__

    def __truediv__(self, other: Number) -> Dual:
        """The ratio."""
        value, slope = _parts(other)
        ratio = self.value / value
        return Dual(ratio, (self.slope - ratio * slope) / value)

    def __rtruediv__(self, other: Number) -> Dual:
        """The ratio."""
        return Dual(*_parts(other)) / self

    def sin(self) -> Dual:
        """The sine."""
        return Dual(self.value.sin(), self.value.cos() * self.slope)

    def cos(self) -> Dual:
        """The cosine."""
        return Dual(self.value.cos(), -(self.value.sin() * self.slope))

    def sqrt(self) -> Dual:
        """The root."""
        root = self.value.sqrt()
        return Dual(root, self.slope / (2 * root))


def _parts(x: Number) -> tuple[Number, Number]:
    return (x.value, x.slope) if isinstance(x, Dual) else (x, arb(0))


def term(x: Number, k: int) -> arb:
    """The coefficient of h^k."""
    return x[k] if isinstance(x, arb_series) else x if k == 0 else arb(0)


def matrices(rows: Rows, terms: int) -> Matrices:
    """The coefficients of a matrix."""
    return [arb_mat([[term(x, k) for x in row] for row in rows]) for k in range(terms)]


def product(left: Matrices, right: Matrices) -> Matrices:
    """The coefficients of a product."""
    found = []
    for k in range(len(left)):
        total = left[0] * right[k]
        for i in range(1, k + 1):
            total += left[i] * right[k - i]
        found.append(total)
    return found


def scaled(given: Matrices, by: Sequence[arb]) -> Matrices:
    """The coefficients of a matrix times a series."""
    found = []
    for k in range(len(given)):
        total = given[k] * by[0]
        for j in range(1, k + 1):
            total += given[k - j] * by[j]
        found.append(total)
    return found


def flow(machine: Machine, lasts: Number, terms: int) -> Matrices:
    """exp(tau G), where tau and G depend on h: of the midpoint of tau times that of the rest."""
    middle = term(lasts, 0).mid()
    rest = [term(lasts, k) - (middle if k == 0 else 0) for k in range(terms)]
    if not any(isinstance(x, arb_series) for row in machine.rows for x in row):
        g = machine.generator
        found = [(g * middle).exp() * (g * rest[0]).exp()]
        for k in range(1, terms):  # X' = tau' G X
            parts = [found[k - j] * (rest[j] * j / k) for j in range(1, k + 1)]
            found.append(g * sum(parts[1:], parts[0]))
        return found
    moving = matrices(machine.rows, terms)
    short = scaled(moving, rest)
    return product(_exp([x * middle for x in moving]), _exp(short))


def _exp(given: Matrices) -> Matrices:
    """The exponential: its coefficients are blocks of that of a matrix of blocks."""
    size, terms = given[0].nrows(), len(given)
    whole = arb_mat(size * terms, size * terms)
    for k, matrix in enumerate(given):
        for row in range(terms - k):
            for i in range(size):
                for j in range(size):
                    whole[row * size + i, (row + k) * size + j] = matrix[i, j]
    found = whole.exp()
    return [
        arb_mat([[found[i, k * size + j] for j in range(size)] for i in range(size)])
        for k in range(terms)
    ]


def _entries(given: Matrices) -> Rows:
    terms, (rows, columns) = len(given), (given[0].nrows(), given[0].ncols())
    return [
        [arb_series([one[i, j] for one in given], terms) for j in range(columns)]
        for i in range(rows)
    ]


@dataclass(frozen=True)
class Leg:
    """A flight and its impact along a line."""

    orbit: Orbit
    k: int
    first: list[Number]
    flow: Rows
    last: list[Number]
    end: Number
    lasts: Number

    @classmethod
    def of(
        cls,
        orbit: Orbit,
        k: int,
        z: Sequence[Number],
        terms: int,
        *,
        later: Number = None,
        until: Number = None,
    ) -> Leg:
        """Leg k of nodes that are series; it ends so much `later`, or lasts `until` some time."""
        machine, n = orbit.machine, orbit.machine.size
        width = 2 * n + 1
        begin, end, lasts = orbit.times(k, z)
        if later is not None:
            end, lasts = end + later, lasts + later
        if until is not None:
            end, lasts = begin + until, until
        first = [*z[k * width : (k + 1) * width - 1], *machine.drive(begin)]
        passage = _entries(flow(machine, lasts, terms))
        last = [dot(row, first) for row in passage[: 2 * n]]
        return cls(orbit, k, first, passage, [*last, *machine.drive(end)], end, lasts)

    def after(self) -> Landing:
        """The state after the impact and the gap at it; the conditions, as `Flight` has them."""
        machine, (number, regime) = self.orbit.machine, self.orbit.legs[self.k]
        stop = machine.stops[number]
        velocities, conditions = impact(machine, stop, regime, self.last)
        conditions.insert(0, (self.lasts, "the flight time is negative"))
        return [*self.last[: machine.size], *velocities, stop.gap(self.last)], conditions

    def passed(self, terms: int) -> Matrices:
        """The derivative of the state and time after the impact by those of the start.

        The time of the impact is that of g = 0.
        """
        machine, (number, regime) = self.orbit.machine, self.orbit.legs[self.k]
        stop, n = machine.stops[number], machine.size
        g = machine.rows
        rate = [dot(row, self.last) for row in g[: 2 * n]]
        turn = [dot(row, self.first) for row in g[2 * n :]]
        columns = [[self.flow[i][j] for i in range(2 * n)] for j in range(2 * n)]
        turned = [dot(row[2 * n :], turn) for row in self.flow[: 2 * n]]
        columns += [[a - b for a, b in zip(turned, rate, strict=True)], rate]
        slopes = []
        for j, column in enumerate(columns):
            moved: list[Number] = [Dual(x, dx) for x, dx in zip(self.last, column, strict=False)]
            moved += machine.drive(Dual(self.end, arb(int(j == 2 * n + 1))))
            changed, _ = impact(machine, stop, regime, moved)
            slopes.append([_parts(x)[1] for x in (*moved[:n], *changed, stop.gap(moved))])
        *starts, ends = slopes
        times = [-(start[-1] / ends[-1]) for start in starts]
        rows = [
            [start[i] + ends[i] * time for start, time in zip(starts, times, strict=True)]
            for i in range(2 * n)
        ]
        return matrices([*rows, times], terms)


def residual(
    orbit: Orbit, z: Sequence[Number], terms: int, turned: Sequence[Number] | None = None
) -> Matrices:
    """The coefficients of F along a line, columns; with `turned` added to the node at the end."""
    found, width = [], 2 * orbit.machine.size + 1
    for k in range(len(orbit.legs)):
        place = (k + 1) % len(orbit.legs) * width
        node, later = z[place : place + width - 1], None
        if turned is not None and place == 0:
            node, later = [x + y for x, y in zip(node, turned, strict=False)], turned[-1]
        (*after, gap), _ = Leg.of(orbit, k, z, terms, later=later).after()
        found += [[x - y] for x, y in zip(node, after, strict=True)]
        found.append([gap])
    return matrices(found, terms)


def return_map(orbit: Orbit, z: Sequence[Number], terms: int) -> Matrices:
    """The coefficients of the derivative of the return map, as `verifier.return_map` has it."""
    total = Leg.of(orbit, 0, z, terms).passed(terms)
    for k in range(1, len(orbit.legs)):
        total = product(Leg.of(orbit, k, z, terms).passed(terms), total)
    return total


def at(given: Sequence[Any], h: arb) -> Any:
    """The value, Horner's scheme."""
    total = given[-1]
    for one in reversed(given[:-1]):
        total = total * h + one
    return total
