"""The second enclosure of a structure's state: a parallelotope of (q, q', t) along its motion.

A piece of motion z' = G z from c to the event row . z = 0 changes
    dz = e^{tau G} dz_0 + G z dtau,   dtau = -(row e^{tau G} dz_0)/(row G z),
with dz_0 = (dq, dq', 0, -omega sin omega t dt, omega cos omega t dt). From the point c the event
is reached to rounding, by Newton's method, and what is missing of it is shared out likewise. An
impact changes velocities by impulses, whose derivatives follow from the law itself (dual.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

from flint import arb, arb_mat, ctx, fmpq

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
        *state, time = self.set.hull()
        turn = arb(self.structure.omega) * time
        found = [*state, arb(1), turn.cos(), turn.sin()]
        kept = [
            p if p.rad() < q.rad() else q for p, q in zip(found, z.entries(), strict=True)
        ]
        return (time if time.rad() < now.rad() else now), column(kept)

    def fly(self, flow: Flow, row: arb_mat, found: arb, now: arb, z: arb_mat) -> None:
        """Go on to the event of a row at the time `found` of a flow, to the balls `now`, `z`."""
        generator, time = flow.generator, found.mid()
        *_, began = self.set.centre
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
            both, start = found.union(time), _hull(flow.start, self._centre())
            moved = Flow(generator, self._lifted(start)).state(both)
            speed = generator.matrix * Flow(generator, start).state(both)
            slope = (row * speed)[0, 0]
            if not slope > 0:
                self.set = Parallelotope.box(self._numbers(now, z))
                return
            turn = row * moved * (-1 / slope)
            spread = self._rows(moved + speed * turn, self.set.axes, turn)
            late = -missed / slope
            shifts = speed * late
        image = self._numbers(began + time + late, there + shifts)
        self._take(image, spread, now, z)

    def strike(
        self, hold: Hold, struck: Sequence[int], held: Sequence[int], z: arb_mat, done: Struck,
        now: arb,
    ) -> None:  # fmt: skip
        """Go through the impacts that balls `z` have met."""
        *_, time = self.set.centre
        centre = self._centre()
        try:
            point = strike(hold, struck, held, centre)
            if _names(point) != _names(done):
                raise Undecided("impacts at the centre")
            with ctx.workprec(LOW):
                after = _after(hold, struck, (z, centre), (done, point), self._lifted(z))
        except (Undecided, ValueError):
            # too wide for one derivative
            self.set = Parallelotope.box(self._numbers(now, done.z))
            return
        still = arb_mat(1, 2 * self.size + 1)
        spread = self._rows(after, self.set.axes, still)
        self._take(self._numbers(time, point.z), spread, now, done.z)

    def _take(self, image: list[arb], spread: arb_mat, now: arb, z: arb_mat) -> None:
        found = Parallelotope.around(image, spread, self.set.reach)
        self.set = found or Parallelotope.box(self._numbers(now, z))

    def _numbers(self, now: arb, z: arb_mat) -> list[arb]:
        return [*vector(z, 0, 2 * self.size), now]

    def _centre(self) -> arb_mat:
        *state, time = self.set.centre
        turn = arb(self.structure.omega) * time
        return column([*state, arb(1), turn.cos(), turn.sin()])

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

    def _rows(self, changes: arb_mat, axes: arb_mat, turn: arb_mat) -> arb_mat:
        """Changes of z as those of (q, q', t)."""
        n = 2 * self.size
        rows = [[changes[i, k] for k in range(n + 1)] for i in range(n)]
        rows.append([axes[n, k] + turn[0, k] for k in range(n + 1)])
        return arb_mat(rows)


def _names(done: Struck) -> tuple[object, ...]:
    """What happened, without numbers."""
    stays = [j for j, rate in sorted(done.rates.items()) if rate.is_zero()]
    return [(impact.stop, impact.regime) for impact in done.impacts], stays, done.ending


def _after(
    hold: Hold,
    struck: Sequence[int],
    states: tuple[arb_mat, arb_mat],
    both: tuple[Struck, Struck],
    spread: arb_mat,
) -> arb_mat:
    """The derivatives after impacts, from those before them, wherever two states lie.

    The rate of closed stops is 0.
    """
    structure, n, width = hold.structure, hold.structure.size, spread.ncols()
    zero, (done, _) = arb_mat(1, width), both
    rates = {j: hold.rates[j] * spread if j in struck else zero for j in done.rates}
    if done.together:
        stops = [impact.stop for impact in done.impacts]
        # a closed stop that others press gets no velocity back
        back = {j: structure.stops[j].restitution if j in struck else fmpq(0) for j in stops}
        changes = [(rates[j] * (1 + arb(back[j]))).entries() for j in stops]
        impulses = arb_mat(hold.pull(stops).inv()) * arb_mat(changes) if stops else arb_mat(0, 0)
        for j, row in zip(stops, impulses.tolist(), strict=True):
            spread = spread - structure.push(structure.stops[j].normal) * arb_mat([row])
        return spread
    for impact, point in zip(*(each.impacts for each in both), strict=True):
        j, stop, before = impact.stop, structure.stops[impact.stop], _hull(*states)
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


def _hull(one: arb_mat, two: arb_mat) -> arb_mat:
    """Balls that hold both columns."""
    pairs = zip(one.entries(), two.entries(), strict=True)
    return column([p.union(q) for p, q in pairs])
