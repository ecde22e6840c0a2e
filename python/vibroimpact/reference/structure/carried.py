"""The second enclosure of a structure's state: a parallelotope of (q, q', t) along its motion.

A piece of motion z' = G z takes dz_0 = (dq, dq', 0, -omega sin omega t dt, omega cos omega t dt)
to dz = e^{tau G} dz_0 + G z dtau. From the centre the event is reached to rounding, by Newton's
method. An impact changes velocities by impulses, whose derivatives follow from the law itself
(dual.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

from flint import arb, arb_mat, ctx

from ..contact import Undecided
from ..dual import Dual
from ..parallelotope import LOW, Parallelotope
from .flow import Flow, column, vector
from .hold import Hold
from .impulses import Struck, planar, slip_at, strike
from .model import Structure

#: Steps of Newton's method at most, from an enclosure of the root.
_STEPS = 3


class Carried:
    """The set that holds the state of one run, from its exact start on."""

    def __init__(self, structure: Structure, now: arb, z: arb_mat) -> None:
        self.structure, self.size = structure, structure.size
        self.set = Parallelotope.box(self._numbers(now, z))

    def narrowed(self, now: arb, z: arb_mat) -> tuple[arb, arb_mat]:
        """Time and state: the narrower one of two balls of each number."""
        *state, time = self.set.narrowed(self._numbers(now, z))
        turn = arb(self.structure.omega) * time
        found = [*state, arb(1), turn.cos(), turn.sin()]
        kept = [p if p.rad() < q.rad() else q for p, q in zip(found, z.entries(), strict=True)]
        return time, column(kept)

    def fly(self, flow: Flow, began: arb, row: arb_mat, found: arb, now: arb, z: arb_mat) -> None:
        """Go on to the event of a row at the time `found` of a flow from the time `began`.

        `now` and `z` are the balls there.
        """
        generator, time = flow.generator, found.mid()
        mean = Flow(generator, self._centre())
        for step in range(_STEPS):
            there = mean.state(time)
            missed = (row * there)[0, 0]
            if step + 1 == _STEPS or missed.contains(0):
                break
            slope = (generator.rows(row, 1) * there)[1, 0]
            if not slope > 0:
                break
            time = (time - missed / slope).mid()
        with ctx.workprec(LOW):
            both, start = found.union(time), self._around(began, flow.start)
            there_too = Flow(generator, start).state(both)
            moved = self._rows(Flow(generator, self._lifted(start)).state(both))
            speed = generator.matrix * there_too
            velocity = column([*vector(speed, 0, 2 * self.size), arb(1)])
            line = arb_mat([[*row.entries()[: 2 * self.size], self._over_time(row, there_too)]])
        image = self._numbers(self.set.centre[-1] + time, there)
        self._take(self.set.met(image, moved, velocity, line, missed), now, z)

    def strike(
        self, hold: Hold, struck: Sequence[int], held: Sequence[int], z: arb_mat, done: Struck,
        now: arb,
    ) -> None:  # fmt: skip
        """Go through the impacts that balls `z` have met."""
        try:
            point = strike(hold, struck, held, self._centre())
            if _names(point) != _names(done):
                raise Undecided("impacts at the centre")
            with ctx.workprec(LOW):
                before = self._around(now, z)
                after = _after(hold, struck, before, (done, point), self._lifted(before))
        except (Undecided, ValueError):
            # too wide for one derivative
            self._take(None, now, done.z)
            return
        image, spread = self._numbers(self.set.centre[-1], point.z), self._rows(after)
        self._take(Parallelotope.around(image, spread, self.set.reach), now, done.z)

    def _take(self, found: Parallelotope | None, now: arb, z: arb_mat) -> None:
        """The next set; if there is none, the balls."""
        self.set = found or Parallelotope.box(self._numbers(now, z))

    def _numbers(self, now: arb, z: arb_mat) -> list[arb]:
        return [*vector(z, 0, 2 * self.size), now]

    def _centre(self) -> arb_mat:
        *state, time = self.set.centre
        turn = arb(self.structure.omega) * time
        return column([*state, arb(1), turn.cos(), turn.sin()])

    def _around(self, now: arb, z: arb_mat) -> arb_mat:
        """Balls z that hold the centre as well, and all points in between."""
        centre = self._centre()
        turn = arb(self.structure.omega) * now.union(self.set.centre[-1])
        pairs = zip(z.entries(), centre.entries(), strict=True)
        *state, _, _ = (p.union(q) for p, q in pairs)
        return column([*state, turn.cos(), turn.sin()])

    def _lifted(self, z: arb_mat) -> arb_mat:
        """The axes as changes of z."""
        n, axes, omega = 2 * self.size, self.set.axes, arb(self.structure.omega)
        lifted = arb_mat(n + 3, n + 1)
        for k in range(n + 1):
            for i in range(n):
                lifted[i, k] = axes[i, k]
            lifted[n + 1, k] = -omega * z[n + 2, 0] * axes[n, k]
            lifted[n + 2, k] = omega * z[n + 1, 0] * axes[n, k]
        return lifted

    def _rows(self, changes: arb_mat) -> arb_mat:
        """Changes of z, at one time of the flow, as those of (q, q', t)."""
        n = 2 * self.size
        return arb_mat([*changes.tolist()[:n], self.set.axes.tolist()[n]])

    def _over_time(self, row: arb_mat, z: arb_mat) -> arb:
        """The derivative of a row times z by the t of its cosine and sine."""
        n, omega = 2 * self.size, arb(self.structure.omega)
        return omega * (row[0, n + 2] * z[n + 1, 0] - row[0, n + 1] * z[n + 2, 0])


def _names(done: Struck) -> tuple[object, ...]:
    """What happened, without numbers."""
    stays = [j for j, rate in sorted(done.rates.items()) if rate.is_zero()]
    return [(impact.stop, impact.regime) for impact in done.impacts], stays, done.ending


def _after(
    hold: Hold,
    struck: Sequence[int],
    z: arb_mat,
    both: tuple[Struck, Struck],
    spread: arb_mat,
) -> arb_mat:
    """The derivatives after impacts, from those before them, for all states between two.

    `z` holds both states and `both` has their impacts. The rate of closed stops is 0.
    """
    structure, n, width = hold.structure, hold.structure.size, spread.ncols()
    zero, (done, _) = arb_mat(1, width), both
    rates = {j: hold.rates[j] * spread if j in struck else zero for j in done.rates}
    if done.together:
        stops = [impact.stop for impact in done.impacts]
        changes = []
        for j, *each in zip(stops, *(all_of.impacts for all_of in both), strict=True):
            u = Dual(each[0].approach_velocity.union(each[1].approach_velocity), rates[j])
            # a closed stop that others press gets no velocity back
            r = structure.stops[j].restitution_at(cast("arb", u))
            back = r if j in struck else arb(0)
            changes.append(Dual.of(u + back * u, u).row.entries())
        impulses = arb_mat(hold.pull(stops).inv()) * arb_mat(changes) if stops else arb_mat(0, 0)
        for j, change in zip(stops, impulses.tolist(), strict=True):
            spread = spread - structure.push(structure.stops[j].normal) * arb_mat([change])
        return spread
    for impact, point in zip(*(each.impacts for each in both), strict=True):
        j, stop, before = impact.stop, structure.stops[impact.stop], arb_mat(z)
        for i, values in enumerate(zip(impact.v_pre, point.v_pre, strict=True)):
            before[n + i, 0] = values[0].union(values[1])
        u = Dual(impact.approach_velocity.union(point.approach_velocity), rates[j])
        slip = slip_at(hold, j, before)
        s = slip if slip.is_zero() else Dual(slip, structure.slip_row(j) * spread)
        path, tangential, left = planar(structure, j, cast("arb", u), cast("arb", s))
        if path.regime != impact.regime:
            raise Undecided("an impact between two")
        pushes = [(stop.normal, -Dual.of(path.impulse, u).row)]
        if stop.tangent is not None:
            pushes.append((stop.tangent, Dual.of(tangential, u).row))
        for line, row in pushes:
            spread = spread + structure.push(line) * row
            for i in rates:
                coupling = arb(structure.coupling(structure.stops[i].normal, line))
                rates[i] = rates[i] + row * coupling
        rates[j] = Dual.of(left, u).row
    return spread
