"""Coefficients of restitution r(u) in ball arithmetic (theory page, section 4).

A table is linear in the approach velocity u between its knots and constant beyond its ends; a
power law is r_low up to a least speed u0 and r_low (u/u0)^(-p) above. Numbers are exact. Where a
ball of u lies on several pieces, the result encloses all of them: r is continuous.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce
from typing import Any

from flint import arb, arb_mat, fmpq

from .contact import Undecided
from .dual import Dual
from .flight import Curve, Number, exact

#: r and dr/du on a piece.
Piece = tuple[arb, arb]


@dataclass(frozen=True)
class Table:
    """Knots, exact."""

    speeds: tuple[fmpq, ...]
    values: tuple[fmpq, ...]

    @property
    def lowest(self) -> fmpq:
        """R of the lowest impacts."""
        return self.values[0]

    def pieces(self, u: arb) -> list[Piece]:
        """The pieces on which a ball of u lies, perhaps with neighbours it only touches."""
        speeds, values = self.speeds, self.values
        found = []
        if not u > speeds[0]:
            found.append((arb(values[0]), arb(0)))
        for i in range(len(speeds) - 1):
            if not (u < speeds[i] or u > speeds[i + 1]):
                slope = arb((values[i + 1] - values[i]) / (speeds[i + 1] - speeds[i]))
                found.append((values[i] + slope * (u - speeds[i]), slope))
        if not u < speeds[-1]:
            found.append((arb(values[-1]), arb(0)))
        return found


@dataclass(frozen=True)
class PowerLaw:
    """Its numbers, exact."""

    r_low: fmpq
    least_speed: fmpq
    exponent: fmpq

    @property
    def lowest(self) -> fmpq:
        """R of the lowest impacts."""
        return self.r_low

    def pieces(self, u: arb) -> list[Piece]:
        """As `Table.pieces`."""
        found = []
        if not u > self.least_speed:
            found.append((arb(self.r_low), arb(0)))
        if not u < self.least_speed:
            if not u > 0:
                raise Undecided("an approach velocity in the law of restitution")
            r = self.r_low * (-self.exponent * (u / self.least_speed).log()).exp()
            found.append((r, -self.exponent * r / u))
        return found


def curve_of(fields: Mapping[str, Any]) -> Curve:
    """From the fields of a curve by name."""

    def row(name: str) -> tuple[fmpq, ...]:
        numbers: list[Number] = list(fields[name])
        return tuple(exact(number) for number in numbers)

    if "speeds" in fields:
        return Table(row("speeds"), row("values"))
    return PowerLaw(*(exact(fields[name]) for name in ("r_low", "least_speed", "exponent")))


def restitution_at(curve: Curve, u: arb) -> arb:
    """Enclosure of r at u; of a number with a gradient, with that."""
    if isinstance(u, Dual):
        pieces = curve.pieces(u.value)
        value, slope = (reduce(arb.union, part) for part in zip(*pieces, strict=True))
        row: arb_mat = u.row * slope
        return Dual(value, row)
    return reduce(arb.union, (r for r, _ in curve.pieces(u)))
