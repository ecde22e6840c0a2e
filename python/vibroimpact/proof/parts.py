"""What holds of the motions on a part of a tube, and where that changes.

A special point is a zero of a test function f along the branch: a condition of a motion, or the
determinant of a matrix. With dY/dh along the branch f' is known. If f' is not 0 on a part, and
Newton's step h - f(h)/f' from a point of it leads into it for all f' there, it has one zero of f.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations, repeat
from typing import Any

from flint import acb_mat, arb, arb_mat, arb_series

from .formulas import Number, Refuted, Undecided
from .near import eigenvectors, singular_basis
from .tube import WHOLE, Family, Leg, Tube, at, krawczyk, matrices, residual, return_map, term
from .verifier import Stability, inside, show_motion, stability

#: Test functions along a line: f + f' h, and the kind of special point where f is 0.
Tests = Callable[[Sequence[Number]], list[tuple[Number, str]]]
OPEN = (Undecided, ValueError, ZeroDivisionError)  # raised where nothing is shown
KINDS = ("saddle_node", "period_doubling", "neimark_sacker")
UNDECIDED: Stability = "undecided"
_CLOSER, _STEPS = 3, 6  # how often a point is enclosed anew; of Newton's method


@dataclass(frozen=True)
class Slice:
    """What holds of the solutions on a part of a tube, from h = `lo` to `hi`.

    `first`, `last`: the parameter at its ends; `values`: on all of it. `rises`: 1 or -1 if it rises
    or falls along the part, else 0. `special`: the kind of the special point at its end.
    """

    lo: arb
    hi: arb
    first: arb
    last: arb
    values: arb
    rises: int
    verdict: str
    why: str
    stability: Stability
    special: str = ""

    @property
    def known(self) -> bool:
        """Whether everything is shown; of what is no motion stability is not asked."""
        steady = self.stability != "undecided" or self.verdict == "disproved"
        return self.verdict != "undecided" and self.rises != 0 and steady


@dataclass(frozen=True)
class Arc:
    """The branch in a tube: K, A, A DE, d/dh F(L(h) + K), the return map's derivative."""

    tube: Tube
    away: list[arb]
    near: list[arb_mat]
    both: arb_mat
    rates: list[arb_mat]
    returns: list[Sequence[Any]]
    conditions: list[arb_mat]

    @classmethod
    def of(cls, tube: Tube) -> Arc:
        """The branch in a tube; raises Undecided if none is shown."""
        away, near, both = krawczyk(tube)
        if not inside(away, [arb(0, r) for r in tube.radius]):
            raise Undecided("Krawczyk's operator does not contract in a tube")
        given = away, len(tube.line)
        rates = [x * k for k, x in enumerate(tube.taylor(residual, *given))][1:]
        returns = list[Sequence[Any]]()
        with suppress(*OPEN):
            maps, scales = zip(*tube.taylor(return_map, *given), strict=True)
            basis = eigenvectors(acb_mat(maps[0]))  # any will do
            returns = [[basis.solve(acb_mat(x) * basis) for x in maps], scales]
        must = tube.taylor(lambda x: matrices([[y] for y, _ in conditions(x)], x[0].terms), *given)
        return cls(tube, away, near, both, rates, returns, must)

    def point(self, h: arb) -> list[arb]:
        """The branch at one value of h: it lies in K of short tubes about it, too."""
        box, axis = self.tube.part(h, self.away), self.tube.axis
        for _ in range(_CLOSER):
            centre = [x.mid() for x in box]
            radius = [abs(x - c).upper() for x, c in zip(box, centre, strict=True)]
            short = [r if j == axis else arb(0) for j, r in enumerate(radius)]
            around = Tube(self.tube.family, [centre, short], radius, axis)
            box = around.part(WHOLE, krawczyk(around)[0])
        return box

    def speed(self, h: arb) -> list[arb]:
        """dY/dh = X: DF X = 0, so that DF (X - L') = -d/dh F(L(h) + a), a = Y - L."""
        column = arb_mat([*([-x] for x in at(self.rates, h).entries()), [arb(0)]])
        turn = self.both.solve(at(self.near, h) * column).entries()
        return [x + y for x, y in zip(self.tube.coefficients(h, 1), turn, strict=True)]

    def line(self, h: arb) -> list[Number]:
        """The branch at some values of h, or at one, as series: Y + dY/dh h."""
        box = self.tube.part(h, self.away) if h.rad() > 0 else self.point(h)
        return [arb_series(list(pair), 2) for pair in zip(box, self.speed(h), strict=True)]

    def look(self, lo: arb, hi: arb) -> Slice:
        """What is shown from h = lo to hi."""
        h, rises, steady = lo.union(hi), 0, UNDECIDED
        box, first, last = (self.tube.part(x, self.away) for x in (h, lo, hi))
        verdict, why = motion(self.tube.family, box, at(self.conditions, h).entries())
        with suppress(*OPEN):
            rate = self.speed(h)[-1]
            rises = 1 if rate > 0 else -1 if rate < 0 else 0
            if self.returns and verdict != "disproved":
                steady = steadiness(*(at(x, h) for x in self.returns))
        return Slice(lo, hi, first[-1], last[-1], box[-1], rises, verdict, why, steady)


def conditions(legs: Sequence[Leg]) -> list[tuple[Number, str]]:
    """What must be positive along a line, and the kind of special point where it is 0."""
    # of a leg the first one is the approach velocity, or how far away a stop is
    each = (enumerate(leg.landing[1]) for leg in legs)
    return [(x, "regime_border" if k else "grazing") for leg in each for k, (x, _) in leg]


def motion(family: Family, box: Sequence[arb], values: Iterable[arb]) -> tuple[str, str]:
    """The verdict on the solutions in a box, where conditions have these values, and why."""
    try:
        orbit, each = family.at(box[-1]), iter(values)
        flights = [orbit.flight(k, box[:-1], slopes=False) for k in range(len(orbit.legs))]
        if not all(flight.duration > 0 for flight in flights):  # of cuts this refutes nothing
            raise Undecided("a flight may take no time, or is cut outside of it")
        told = ([(next(each), why) for _, why in flight.conditions[1:]] for flight in flights)
        show_motion(orbit, [replace(x, conditions=y) for x, y in zip(flights, told, strict=True)])
    except Refuted as reason:
        return "disproved", str(reason)
    except OPEN as reason:
        return "undecided", str(reason)
    return "proved", ""


def steadiness(matrix: acb_mat, scale: arb) -> Stability:
    """Stability by the derivative of a return map, which is a matrix over a number."""
    if abs(matrix.trace()) > matrix.nrows() * abs(scale):  # the sum of all multipliers
        return "unstable"
    matrix = matrix / scale
    with suppress(ValueError):  # of multipliers that can be told apart
        sizes = [abs(x) for x in matrix.eig(multiple=True)]
        if any(x > 1 for x in sizes) or all(x < 1 for x in sizes):
            return "unstable" if any(x > 1 for x in sizes) else "stable"
    return stability(matrix.charpoly().coeffs())


def only_zero(arc: Arc, tests: Tests, lo: arb, hi: arb) -> tuple[str, arb]:
    """The kind and value of the only zero of all test functions from h = lo to hi."""
    every = tests(arc.line(lo.union(hi)))
    open_ = [k for k, (f, _) in enumerate(every) if not abs(term(f, 0)) > 0]
    if len(open_) != 1:
        raise Undecided("several test functions may be 0, or none")
    (k,), found, kind = open_, None, ""
    for _ in range(_STEPS):
        line, h = arc.line(lo.union(hi)), ((lo + hi) / 2).mid()
        near, (f, kind) = arc.line(h), tests(line)[k]
        place = h - term(tests(near)[k][0], 0) / term(f, 1)
        if lo < place < hi:
            found, lo, hi = near[-1][0] + line[-1][1] * (place - h), place.lower(), place.upper()
    if found is None:
        raise Undecided("a test function may have no zero, or several")
    return kind, found


def border(arc: Arc, lo: arb, hi: arb) -> tuple[str, arb]:
    """Where the only condition of a motion that may be 0 is 0; flights meet no stop up to there."""
    box = arc.tube.part(lo.union(hi), arc.away)
    if motion(arc.tube.family, box, repeat(arb(1))) != ("proved", ""):
        raise Undecided("a flight may meet a stop")
    return only_zero(arc, lambda line: conditions(arc.tube.family.along(line, 2)), lo, hi)


def multiplier(arc: Arc, lo: arb, hi: arb) -> tuple[str, arb]:
    """Where the only multiplier, or pair, that meets the unit circle crosses it.

    Of the derivative J of the return map, J - 1 is singular where a multiplier is 1, J + 1 where
    one is -1, and J_2 - 1 where two have the product 1: J_2 are the minors of J of two rows and
    two columns. If only one of the determinants is 0 on a part, and that once, no multiplier
    crosses the unit circle elsewhere: stability is the same up to there.
    """
    near: list[tuple[arb_mat, arb_mat]] = []

    def determinants(line: Sequence[Number]) -> list[tuple[Number, str]]:
        given = return_map(arc.tube.family.along(line, 2))
        places, found = range(given[0][0].nrows()), list[tuple[Number, str]]()
        rows = [[arb_series([x[i, j] for x, _ in given], 2) for j in places] for i in places]
        scale = arb_series([x for _, x in given], 2)
        pairs = list(combinations(places, 2))
        minors = [
            [rows[i][k] * rows[j][n] - rows[i][n] * rows[j][k] for k, n in pairs] for i, j in pairs
        ]
        grids = (rows, scale), (rows, -scale), (minors, scale * scale)
        for (grid, one), kind in zip(grids, KINDS, strict=True):
            less = [[x - one * (i == j) for j, x in enumerate(row)] for i, row in enumerate(grid)]
            matrix, change = matrices(less, 2)
            if len(near) < len(KINDS):  # any will do, the same for all lines
                near.append(singular_basis(matrix))
            left, right = near[len(found)]
            own, moved = (left * matrix * right).tolist(), (left * change * right).tolist()
            # the derivative of a determinant, row by row
            slopes = [arb_mat([*own[:k], row, *own[k + 1 :]]).det() for k, row in enumerate(moved)]
            found.append((arb_series([arb_mat(own).det(), sum(slopes, arb(0))], 2), kind))
        return found

    return only_zero(arc, determinants, lo, hi)
