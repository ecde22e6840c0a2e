"""Flights and impacts along a line: every number is a power series in h, of a few terms.

Of a function f of h, f(h) = f_0 + f_1 h + ... + f_K h^K for |h| <= H, where f_k is the coefficient
at h = 0 and the last one that at some other h (Taylor's theorem, Lagrange's remainder).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from flint import arb, arb_mat, arb_series

from .formulas import Landing, Machine, Number, dot
from .verifier import Orbit

#: A matrix with power series as entries.
Rows: TypeAlias = Sequence[Sequence[Number]]
#: Coefficients of a matrix: those of 1, h, h^2, ...
Matrices: TypeAlias = list[arb_mat]


@dataclass(frozen=True)
class _Dual:
    """A number with its derivative in one more direction; both may be series."""

    value: Number
    slope: Number

    def __getitem__(self, place: int) -> Number:
        return self.slope if place else self.value

    def __add__(self, other: Number) -> _Dual:
        value, slope = _parts(other)
        return _Dual(self.value + value, self.slope + slope)

    __radd__ = __add__

    def __neg__(self) -> _Dual:
        return _Dual(-self.value, -self.slope)

    def __sub__(self, other: Number) -> _Dual:
        value, slope = _parts(other)
        return _Dual(self.value - value, self.slope - slope)

    def __rsub__(self, other: Number) -> _Dual:
        return (-self).__add__(other)

    def __mul__(self, other: Number) -> _Dual:
        value, slope = _parts(other)
        return _Dual(self.value * value, self.value * slope + self.slope * value)

    __rmul__ = __mul__

    def __truediv__(self, other: Number) -> _Dual:
        value, slope = _parts(other)
        ratio = self.value / value
        return _Dual(ratio, (self.slope - ratio * slope) / value)

    def __rtruediv__(self, other: Number) -> _Dual:
        return _Dual(*_parts(other)) / self

    def sin(self) -> _Dual:
        return _Dual(self.value.sin(), self.value.cos() * self.slope)

    def cos(self) -> _Dual:
        return _Dual(self.value.cos(), -(self.value.sin() * self.slope))

    def sqrt(self) -> _Dual:
        root = self.value.sqrt()
        return _Dual(root, self.slope / (2 * root))


def _parts(x: Number) -> tuple[Number, Number]:
    return (x.value, x.slope) if isinstance(x, _Dual) else (x, arb(0))


def term(x: Number, k: int) -> arb:
    """The coefficient of h^k."""
    return x[k] if isinstance(x, arb_series) else x if k == 0 else arb(0)


def matrices(rows: Rows, terms: int) -> Matrices:
    """The coefficients of a matrix."""
    return [arb_mat([[term(x, k) for x in row] for row in rows]) for k in range(terms)]


def product(left: Matrices, right: Sequence[Any]) -> Matrices:
    """The coefficients of a product with a matrix, or a number."""
    return [
        sum((left[i] * right[k - i] for i in range(1, k + 1)), left[0] * right[k])
        for k in range(len(left))
    ]


def flow(machine: Machine, lasts: Number, terms: int) -> Matrices:
    """exp(tau G), where tau and G depend on h: of the midpoint of tau times that of the rest."""
    middle = term(lasts, 0).mid()
    rest = [term(lasts, k) - (middle if k == 0 else 0) for k in range(terms)]
    g = machine.generator
    if any(isinstance(x, arb_series) for row in machine.rows for x in row):
        moving = matrices(machine.rows, terms)
        return product(_exp([x * middle for x in moving]), _exp(product(moving, rest)))
    found = [(g * middle).exp() * (g * rest[0]).exp()]
    for k in range(1, terms):  # X' = tau' G X
        parts = [found[k - j] * (rest[j] * j / k) for j in range(1, k + 1)]
        found.append(g * sum(parts[1:], parts[0]))
    return found


def _exp(given: Matrices) -> Matrices:
    """The exponential: its coefficients are blocks of that of a matrix of blocks."""
    size, terms = given[0].nrows(), len(given)
    whole = arb_mat(size * terms, size * terms)
    for row in range(terms):
        for k, matrix in enumerate(given[: terms - row]):
            for i in range(size):
                for j in range(size):
                    whole[row * size + i, (row + k) * size + j] = matrix[i, j]
    rows = whole.exp().tolist()[:size]
    return [arb_mat([row[k * size : (k + 1) * size] for row in rows]) for k in range(terms)]


@dataclass(frozen=True)
class Leg:
    """A flight and its impact along a line: w at the start and at the end, and the flow."""

    orbit: Orbit
    k: int
    first: list[Number]
    flow: Rows
    last: list[Number]
    end: Number
    lasts: Number

    @classmethod
    def of(cls, orbit: Orbit, k: int, z: Sequence[Number], terms: int, until: Number = None) -> Leg:
        """Leg k of nodes that are series; or what comes of it `until` some time after its start."""
        machine, n = orbit.machine, 2 * orbit.machine.size
        begin, end, lasts = orbit.times(k, z)
        if until is not None:
            end, lasts = begin + until, until
        first = [*z[k * (n + 1) : (k + 1) * (n + 1) - 1], *machine.drive(begin)]
        grids = [matrix.tolist() for matrix in flow(machine, lasts, terms)]
        passage = [
            [arb_series([grid[i][j] for grid in grids], terms) for j in range(n + 3)]
            for i in range(n)
        ]
        last = [dot(row, first) for row in passage]
        return cls(orbit, k, first, passage, [*last, *machine.drive(end)], end, lasts)

    def after(self) -> Landing:
        """The state after the impact and the gap at it; the conditions, as `Flight` has them."""
        landing, conditions = self.orbit.after(self.k, self.last, self.end)
        return landing, [(self.lasts, "the flight time is negative"), *conditions]

    def passed(self, terms: int) -> Matrices:
        """The derivative of the state and time after the impact by those of the start.

        The time of the impact is that of g = 0.
        """
        machine, n = self.orbit.machine, 2 * self.orbit.machine.size
        rate = [dot(row, self.last) for row in machine.rows[:n]]
        turn = [dot(row, self.first) for row in machine.rows[n:]]
        turned = [dot(row[n:], turn) for row in self.flow]
        columns = [[row[j] for row in self.flow] for j in range(n)]
        columns += [[a - b for a, b in zip(turned, rate, strict=True)], rate]
        slopes = []
        for j, column in enumerate(columns):
            moved: list[Number] = [_Dual(x, dx) for x, dx in zip(self.last, column, strict=False)]
            end = _Dual(self.end, arb(int(j == n + 1)))
            landing, _ = self.orbit.after(self.k, moved + machine.drive(end), end)
            slopes.append([_parts(x)[1] for x in landing])
        *starts, ends = slopes
        times = [-(start[-1] / ends[-1]) for start in starts]
        rows = [
            [start[i] + ends[i] * time for start, time in zip(starts, times, strict=True)]
            for i in range(n)
        ]
        return matrices([*rows, times], terms)


def residual(legs: Sequence[Leg], terms: int) -> Matrices:
    """The coefficients of F along a line, columns."""
    found = []
    for k, leg in enumerate(legs):
        *after, gap = leg.after()[0]
        node = legs[(k + 1) % len(legs)].first
        found += [[x - y] for x, y in zip(node, after, strict=False)] + [[gap]]
    return matrices(found, terms)


def return_map(legs: Sequence[Leg], terms: int) -> Matrices:
    """The coefficients of the derivative of the return map, one of whose eigenvalues is 0."""
    total = legs[0].passed(terms)
    for leg in legs[1:]:
        total = product(leg.passed(terms), total)
    return total


def at(given: Sequence[Any], h: arb) -> Any:
    """The value, Horner's scheme."""
    total = given[-1]
    for one in reversed(given[:-1]):
        total = total * h + one
    return total
