"""Completes chatter: the limit of infinitely many impacts, by extrapolation to u = 0.

Complete chatter (theory page, section 5) is a sequence of impacts of one regime whose approach
velocity u falls to 0 with a ratio q < 1 (q = r in `slip` and `frictionless`). The states with
u = 0 are fixed points of the map from impact to impact, and the sequence runs down a stable fibre
of them, which is an analytic curve as long as the regime, the direction of slip and the sign of
sin x1 stay the same. So t, x1, v1, v2 just before the impacts are analytic functions of u along a
tail, and their values at u = 0 follow by polynomial extrapolation (Neville's scheme): from nodes
u_1 < u_2 < ... < u_n inside the radius R of convergence the error is of order u_1 u_2 ... u_n/R^n.

For impacts that stick or reverse this does not hold: v1 goes to 0 with u, and where they reverse
the quotient v1/u tends to its limit at a rate of its own, so that nothing is analytic in u alone.
Such tails, of whatever regimes, are followed until the last step of a linear extrapolation is
itself below the tolerance.

A tail ends when its stated error is below the tolerance: the differences of the last three orders,
or the last step. It is an estimate and no enclosure, and is returned as the radius of the balls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flint import arb, ctx

#: A node needs at most this share of the approach velocity of the node before it: closer nodes
#: would magnify rounding, at a half the sum of the weights is below 9.
_SPACING = 0.5
#: No extrapolation from fewer nodes: two or three may agree by chance.
_LEAST_NODES = 6
#: Regimes of tails that are analytic in u.
ANALYTIC = ("slip", "frictionless")


@dataclass(frozen=True)
class Bounce:
    """An impact of a tail: regime, what must not change, and what is extrapolated.

    `values`: time and state just before it, which are functions of u. `signs`: for the pendulum
    those of v1 and sin x1 where there is friction, which has a kink there.
    """

    values: tuple[arb, ...]
    u: arb
    regime: str
    signs: tuple[int, ...] = ()


@dataclass(frozen=True)
class Accumulation:
    """The end of a chatter: `values` with the stated error as radius.

    `ratio` is the last measured q, `regime` that of the last impact.
    """

    values: tuple[arb, ...]
    ratio: float
    regime: str

    def error(self) -> arb:
        """Largest stated error of time and state."""
        worst = arb(0)
        for value in self.values:
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
        #: Impacts in a row whose approach velocity falls.
        self.falling = 0

    def forget(self) -> None:
        """Forget the tail, after a contact phase."""
        self._nodes, self._last, self.falling = [], None, 0

    def observe(self, bounce: Bounce) -> Accumulation | None:
        """Add the next impact; return the accumulation point when it is known well enough."""
        last, self._last = self._last, bounce
        if last is None or not bounce.u < last.u:
            self._nodes, self.falling = [bounce], 1
            return None
        self.falling += 1
        found = None
        if bounce.regime not in ANALYTIC:
            self._nodes = []
            # linear extrapolation: do not try before u is that small
            if self.falling >= _LEAST_NODES and bounce.u < self._tolerance:
                found = step_to_limit(last, bounce)
        elif (last.regime, last.signs) != (bounce.regime, bounce.signs):
            self._nodes = [bounce]
        elif bounce.u < self._nodes[-1].u * _SPACING:
            self._nodes.append(bounce)
            if len(self._nodes) >= _LEAST_NODES:
                found = accumulate(self._nodes, float(bounce.u / last.u))
        return found if found is not None and found.error() < self._tolerance else None


def accumulate(bounces: Sequence[Bounce], ratio: float) -> Accumulation:
    """Accumulation point of an analytic tail, u falling, by extrapolation from all its bounces."""
    nodes = bounces[::-1]
    steps = [node.u for node in nodes]
    columns = zip(*(node.values for node in nodes), strict=True)
    values = tuple(extrapolate(steps, column) for column in columns)
    return Accumulation(values, ratio, nodes[0].regime)


def step_to_limit(before: Bounce, last: Bounce) -> Accumulation:
    """Accumulation point of any tail, if all further steps shrink by the last ratio of u."""
    ratio = (last.u / before.u).mid()
    values = tuple(
        arb((q + (q - p) * ratio / (1 - ratio)).mid(), abs((q - p) / (1 - ratio)).abs_upper())
        for p, q in zip(before.values, last.values, strict=True)
    )
    return Accumulation(values, float(ratio), last.regime)


def extrapolate(steps: Sequence[arb], values: Sequence[arb]) -> arb:
    """Value at 0 of the function with the given values at `steps`, ascending and positive.

    Of the polynomials through the first 2, 3, ... nodes the one is taken that differs least from
    its two predecessors, since nodes beyond the radius of convergence spoil the value again. The
    larger one of the last two differences, and a bound of rounding, is the radius of the result:
    the last alone may be small by chance.
    """
    diagonal: list[arb] = []
    best: arb | None = None
    before: arb | None = None
    for k, value in enumerate(values):
        # P_{a..k}(0) = (u_a P_{a+1..k} - u_k P_{a..k-1})/(u_a - u_k), a = k - j (Neville)
        following = [value.mid()]
        for j in range(1, k + 1):
            a, b = steps[k - j], steps[k]
            weighted = a * following[j - 1] - b * diagonal[j - 1]
            following.append((weighted / (a - b)).mid())
        if k > 0:
            last = abs(following[k] - diagonal[k - 1])
            if before is not None:
                rounding = abs(following[k]) * arb(2) ** (16 - ctx.prec)
                error = (last.max(before) + rounding).abs_upper()
                if best is None or error < best.rad():
                    best = arb(following[k], error)
            before = last
        diagonal = following
    if best is None:
        raise ValueError("extrapolation needs three nodes")
    return best
