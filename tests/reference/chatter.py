"""Completes chatter: the limit of infinitely many impacts, by extrapolation to u = 0.

Complete chatter (docs/theory.md, section 5) is a sequence of impacts of one regime whose approach
velocity u falls to 0 with a ratio q < 1 (q = r in `slip` and `frictionless`). The states with
u = 0 are fixed points of the map from impact to impact, and the sequence runs down a stable fibre
of them, which is an analytic curve as long as the regime, the direction of slip and the sign of
sin x1 stay the same. So t, x1, v1, v2 just before the impacts are analytic functions of u along a
tail, and their values at u = 0 follow by polynomial extrapolation (Neville's scheme): from nodes
u_1 < u_2 < ... < u_n inside the radius R of convergence the error is of order u_1 u_2 ... u_n/R^n.

A tail ends when the last two orders agree to the tolerance. Their difference is the stated error,
an estimate and no enclosure; it is returned as the radius of the balls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flint import arb

#: A node needs at most this share of the approach velocity of the node before it: closer nodes
#: would magnify rounding, at a half the sum of the weights is below 9.
SPACING = 0.5
#: No extrapolation from fewer nodes: two or three may agree by chance.
LEAST_NODES = 6


@dataclass(frozen=True)
class Bounce:
    """An impact of a tail: time and state just before it, regime, and what must not change.

    `signs` are those of v1 and sin x1 where there is friction, which has a kink there.
    """

    time: arb
    x1: arb
    v1: arb
    v2: arb
    u: arb
    regime: str
    signs: tuple[int, int] = (0, 0)

    def values(self) -> tuple[arb, arb, arb, arb]:
        """The functions of u that are extrapolated."""
        return self.time, self.x1, self.v1, self.v2


@dataclass(frozen=True)
class Accumulation:
    """The end of a chatter: time and state, with the stated error as radius.

    `ratio` is the last measured q, `nodes` the number of impacts the limit rests on.
    """

    time: arb
    x1: arb
    v1: arb
    v2: arb
    ratio: float
    regime: str
    nodes: int

    def error(self) -> arb:
        """Largest stated error of time and state."""
        worst = arb(0)
        for value in (self.time, self.x1, self.v1, self.v2):
            worst = worst.max(value.rad())
        return worst


class Tail:
    """Watches the impacts of a run for a tail and completes it.

    Parameters
    ----------
    tolerance : absolute error wanted of time and state at the accumulation point
    """

    def __init__(self, tolerance: arb) -> None:
        self._tolerance = tolerance
        self._nodes: list[Bounce] = []
        self._last: Bounce | None = None

    def forget(self) -> None:
        """Start anew, after a contact phase."""
        self._nodes, self._last = [], None

    def observe(self, bounce: Bounce) -> Accumulation | None:
        """Take the next impact; the accumulation point as soon as it is known well enough."""
        last, self._last = self._last, bounce
        same = last is not None and (last.regime, last.signs) == (bounce.regime, bounce.signs)
        if last is None or not same or not bounce.u < last.u:
            self._nodes = [bounce]
            return None
        if not bounce.u < self._nodes[-1].u * SPACING:
            return None
        self._nodes.append(bounce)
        if len(self._nodes) < LEAST_NODES:
            return None
        found = accumulate(self._nodes, float(bounce.u / last.u))
        return found if found.error() < self._tolerance else None


def accumulate(bounces: Sequence[Bounce], ratio: float) -> Accumulation:
    """Accumulation point of a tail of bounces with falling u, by extrapolation from all of them."""
    nodes = sorted(bounces, key=lambda bounce: float(bounce.u.log()))
    steps = [node.u for node in nodes]
    time, x1, v1, v2 = (
        extrapolate(steps, column) for column in zip(*(b.values() for b in nodes), strict=True)
    )
    return Accumulation(time, x1, v1, v2, ratio, nodes[0].regime, len(nodes))


def extrapolate(steps: Sequence[arb], values: Sequence[arb]) -> arb:
    """Value at 0 of the function with the given values at `steps`, ascending and positive.

    Of the polynomials through the first 2, 3, ... nodes the one is taken that differs least from
    its predecessor, since nodes beyond the radius of convergence spoil the value again. The
    difference is the radius of the result.
    """
    diagonal: list[arb] = []
    best: arb | None = None
    for k, value in enumerate(values):
        # P_{a..k}(0) = (u_a P_{a+1..k} - u_k P_{a..k-1})/(u_a - u_k), a = k - j (Neville)
        following = [value.mid()]
        for j in range(1, k + 1):
            a, b = steps[k - j], steps[k]
            weighted = a * following[j - 1] - b * diagonal[j - 1]
            following.append((weighted / (a - b)).mid())
        if k > 0:
            difference = abs(following[k] - diagonal[k - 1]).abs_upper()
            if best is None or difference < best.rad():
                best = arb(following[k], difference)
        diagonal = following
    if best is None:
        raise ValueError("extrapolation needs two nodes")
    return best
