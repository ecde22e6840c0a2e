"""The second enclosure of a system's state: a parallelotope of (x1, v1, x2, v2, t).

A flight is linear in its start and in the cosine and sine of the forcing phase, so that its
derivatives are differences of flights. From the centre the contact is reached to rounding, by
Newton's method. The derivatives of an impact follow from the law itself (dual.py).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import cast

from flint import arb, arb_mat, ctx

from .contact import Undecided
from .dual import Dual
from .flight import Flight, State, System, Value
from .impact import Impact, Jammed
from .parallelotope import LOW, Parallelotope

#: Steps of Newton's method at most, from an enclosure of the root.
_STEPS = 3
#: Body coordinates; the time is one more.
_SIZE = 4

Law = Callable[[System, arb, arb, arb], Impact]


class Carried:
    """The set that holds the state of one run, from its exact start on."""

    def __init__(self, system: System, phase: arb, now: arb, state: State) -> None:
        self.system, self.phase = system, phase
        self.set = Parallelotope.box([*state, now])

    def narrowed(self, now: arb, state: State) -> tuple[arb, State]:
        """Time and state: the narrower one of two balls of each number."""
        x1, v1, x2, v2, time = self.set.narrowed([*state, now])
        return time, (x1, v1, x2, v2)

    def fly(self, flight: Flight, began: arb, found: arb, now: arb, state: State) -> None:
        """Go on to the contact at the time `found` of a flight from the time `began`.

        `now` and `state` are the balls there.
        """
        x1, v1, x2, v2, start = self.set.centre
        omega, time = arb(self.system.omega), found.mid()
        mean = self._flight((x1, v1, x2, v2), self.phase + omega * start, flight)
        for step in range(_STEPS):
            there, missed, slope = mean.state(time), mean.gap(time), mean.velocity(time)
            if step + 1 == _STEPS or missed.contains(0) or not slope > 0:
                break
            time = (time - missed / slope).mid()
        with ctx.workprec(LOW):
            both = found.union(time)
            here = [p.union(q) for p, q in zip(flight.start(), self.set.centre[:4], strict=True)]
            psi = self.phase + omega * began.union(start)
            all_there = self._flight(tuple(here), psi, flight).state(both)
            spread = self._derivative(both, psi, flight) * self.set.axes
            bends = self._bends(all_there, psi + omega * both)
            speed = arb_mat([[v] for v in (all_there[1], bends[0], all_there[3], bends[1], arb(1))])
            row = arb_mat([[self.system.slope(all_there[0]), arb(0), arb(-1), arb(0), arb(0)]])
        self._take(self.set.met([*there, start + time], spread, speed, row, missed), now, state)

    def strike(self, law: Law, before: State, regime: str, now: arb, state: State) -> None:
        """Go through an impact with a regime from the balls `before` to `now`, `state`."""
        x1, v1, x2, v2, time = self.set.centre
        try:
            point = law(self.system, x1, v1, v2)
            if point.regime != regime:
                raise Undecided("the impact at the centre")
            with ctx.workprec(LOW):
                values = [p.union(q) for p, q in zip(before, (x1, v1, x2, v2), strict=True)]
                rows = [arb_mat([row]) for row in self.set.axes.tolist()]
                duals = [Dual(value, rows[i]) for i, value in enumerate(values)]
                given = (cast("arb", duals[i]) for i in (0, 1, 3))
                image = law(self.system, *given)
                if image.regime != regime:
                    raise Undecided("an impact between two")
                for place, number in ((1, image.v1), (3, image.v2)):
                    rows[place] = Dual.of(number, duals[0]).row
                spread = arb_mat([row.entries() for row in rows])
        except (Undecided, Jammed, ValueError):
            # too wide for one derivative
            self._take(None, now, state)
            return
        after = [x1, point.v1, x2, point.v2, time]
        self._take(Parallelotope.around(after, spread, self.set.reach), now, state)

    def _take(self, found: Parallelotope | None, now: arb, state: State) -> None:
        """The next set; if there is none, the balls."""
        self.set = found or Parallelotope.box([*state, now])

    def _flight(self, start: tuple[Value, ...], psi: arb, like: Flight) -> Flight:
        x1, v1, x2, v2 = start
        return Flight(self.system, (x1, v1, x2, v2), psi, quick=like.quick)

    def _derivative(self, time: arb, psi: arb, like: Flight) -> arb_mat:
        """Derivatives of the state at one time of a flight by its start and when it starts."""
        zero, one = arb(0), arb(1)

        def state(x: arb, v: arb, phase: arb) -> arb_mat:
            return arb_mat([list(self._flight((x, v, x, v), phase, like).state(time))])

        rest, quarter = state(zero, zero, psi), arb.pi() / 2
        of_x, of_v = state(one, zero, psi) - rest, state(zero, one, psi) - rest
        # what the loads do is the same at psi and psi + pi
        loads = (rest + state(zero, zero, psi + 2 * quarter)) * (one / 2)
        of_t = (state(zero, zero, psi + quarter) - loads) * arb(self.system.omega)
        found = arb_mat(_SIZE + 1, _SIZE + 1)
        for i in range(_SIZE):
            found[i, 2 * (i // 2)], found[i, 2 * (i // 2) + 1] = of_x[0, i], of_v[0, i]
            found[i, _SIZE] = of_t[0, i]
        found[_SIZE, _SIZE] = one
        return found

    def _bends(self, state: State, psi: arb) -> tuple[arb, arb]:
        """Accelerations of both bodies."""
        first, second = self.system.bodies()
        x1, v1, x2, v2 = state
        return 2 * first.taylor(x1, v1, psi, 2)[2], 2 * second.taylor(x2, v2, psi, 2)[2]
