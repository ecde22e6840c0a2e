"""What holds of the motions on a part of a tube."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

from flint import acb, acb_mat, arb, arb_series

from . import along
from .formulas import Number, Refuted, Undecided
from .near import eigenvectors
from .tube import Family, Image, Tube, point_at, turn
from .verifier import show_motion, stability

#: What is raised where nothing is shown.
OPEN = (Undecided, ValueError, ZeroDivisionError)


@dataclass(frozen=True)
class Special:
    """The only special point of its kind on a part of a tube: its value of the parameter.

    `clear`: on the part nothing else changes: all other multipliers lie inside the unit circle, or
    all other conditions hold.
    """

    kind: str
    value: arb
    clear: bool


@dataclass(frozen=True)
class Slice:
    """What holds of the solutions on a part of a tube, from h = `lo` to `hi`.

    `first`, `last`: the parameter at its ends; `values`: on all of it. `rises`: 1 or -1 if it rises
    or falls along the part, else 0. `broken`: of no motion, the kind of border that it is beyond.
    `special`: a point that lies on it, or at its end.
    """

    lo: arb
    hi: arb
    first: arb
    last: arb
    values: arb
    rises: int
    verdict: str
    why: str
    broken: str
    stability: str
    special: Special | None = None

    @property
    def known(self) -> bool:
        """Whether everything is shown; of what is no motion stability is not asked."""
        steady = self.stability != "undecided" or self.verdict == "disproved"
        return self.verdict != "undecided" and self.rises != 0 and steady


@dataclass(frozen=True)
class Arc:
    """The branch in a tube: K, `turn`, the derivative of the return map in some basis."""

    family: Family
    tube: Tube
    away: list[arb]
    turn: list[arb]
    returns: list[acb_mat]

    @classmethod
    def of(cls, family: Family, tube: Tube, found: Image) -> Arc:
        """The branch in a tube; raises Undecided if none is shown."""
        if not found.inside:
            raise Undecided("Krawczyk's operator does not contract in a tube")
        legs, returns = tube.legs(family, found.away), list[acb_mat]()
        turns = turn(family, tube, found.away, tube.taylor(along.residual, legs))
        with suppress(*OPEN):
            given = [acb_mat(x) for x in tube.taylor(along.return_map, legs)]
            basis = eigenvectors(given[0])  # any will do
            returns = [basis.solve(x * basis) for x in given]
        return cls(family, tube, found.away, turns, returns)

    def look(self, lo: arb, hi: arb) -> Slice:
        """What is shown from h = lo to hi."""
        h, steady = lo.union(hi), "undecided"
        box = self.tube.part(h, self.away)
        first, last = (self.tube.part(end, self.away)[-1] for end in (lo, hi))
        with suppress(*OPEN):
            steady = steadiness(along.at(self.returns, h)) if self.returns else steady
        rises = sign(self.speed(h)[-1])
        return Slice(lo, hi, first, last, box[-1], rises, *motion(self.family, box), steady)

    def speed(self, h: arb) -> list[arb]:
        """dY/dh."""
        return [x + a for x, a in zip(self.tube.coefficients(h, 1), self.turn, strict=True)]

    def line(self, lo: arb, hi: arb) -> list[Number]:
        """The branch from h = lo to hi as series, Y + dY/dh h; a point of it if lo is hi."""
        h, point = lo.union(hi), lo is hi
        box = self.point(lo) if point else self.tube.part(h, self.away)
        return [arb_series([y, x], 2) for y, x in zip(box, self.speed(h), strict=True)]

    def point(self, h: arb) -> list[arb]:
        """The point in a plane."""
        return point_at(self.family, self.tube, self.away, h)


def sign(x: arb) -> int:
    """1, -1, or 0 if it is not known."""
    return 1 if x > 0 else -1 if x < 0 else 0


def steadiness(matrix: acb_mat) -> str:
    """Stability by the derivative of a return map."""
    size = matrix.nrows()
    if abs(sum((matrix[i, i] for i in range(size)), acb(0))) > size:  # of all multipliers the sum
        return "unstable"
    with suppress(ValueError):
        sizes = [abs(x) for x in matrix.eig(multiple=True)]
        if any(x > 1 for x in sizes) or all(x < 1 for x in sizes):
            return "stable" if all(x < 1 for x in sizes) else "unstable"
    return stability(matrix.charpoly().coeffs())


def conditions(family: Family, line: Sequence[Number]) -> list[tuple[Number, str, str]]:
    """What must be positive along a line, what is wrong elsewhere, and the border between."""
    found = []
    for leg in family.along(line, 2):
        for i, (number, why) in enumerate(leg.after()[1]):
            # the first two are the time of flight and the approach velocity
            found.append((number, why, "grazing" if i < 2 else "regime_border"))
    return found


def motion(family: Family, box: Sequence[arb]) -> tuple[str, str, str]:
    """The verdict on the solutions in a box, why, and the border that is passed."""
    broken = "grazing"
    try:
        orbit = family.at(box[-1])
        flights = orbit.flights(box[:-1])
        if any(number < 0 for flight in flights for number, _ in flight.conditions[2:]):
            broken = "regime_border"
        show_motion(orbit, flights)
    except Refuted as reason:
        return "disproved", str(reason), broken
    except OPEN as reason:
        return "undecided", str(reason), ""
    return "proved", "", ""
