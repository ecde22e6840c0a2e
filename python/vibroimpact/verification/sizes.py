"""The units of errors: the size of the motion near the time of a row, not of all of it.

x1, v1, x2, v2 vanish twice in each period, and no digit is lost there. So an error is measured in
units of the largest value over the last period, up to the row. The period is the longest of drive
and bodies, within ten times that of body 2. If the motion was much larger just before, as after an
impact or with a slow drive, the size is limited to what the present state can lead to: a velocity,
times the slowest of the three periods over 2 pi; a position, over the fastest; or the loads. A
position at which a motion begins or turns counts as the velocity there over the fastest. A velocity
next to 0 at a position that hardly changes, as at rest under a constant load, counts as _STEADY of
the position, anything next to 0 as _STILL of the largest of the four. Times count in drive periods,
or in 2 pi if that is less.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from flint import arb
from numpy.typing import NDArray

from ..reference.flight import System as ExactSystem
from .passes import Pass
from .path import LONGEST_WINDOW, window
from .watch import OWN_PERIOD

#: The size of a velocity that stays next to 0, in units of what its position would swing with.
_STEADY = 1e-4
#: The size of a number that stays 0 or next to it, in units of the largest of the four.
_STILL = 1e-8


class Sizes:
    """Sizes of x1, v1, x2, v2 about the rows of an exact motion, and of times."""

    def __init__(self, exact: Pass, system: ExactSystem, section_times: Sequence[float]) -> None:
        self.system = system
        omega, omega0 = float(system.omega), float(system.omega0)
        self.time = min(OWN_PERIOD, OWN_PERIOD / omega) if omega else OWN_PERIOD
        self.window = window(system)
        #: Of each body: own rate, slowest and fastest rate, amplitude of the loads.
        self.bodies = []
        loads = ((omega0, abs(system.f1) + abs(system.c1)), (1.0, abs(system.f2) + abs(system.c2)))
        for own, drive in loads:
            slow = min(rate for rate in (own, omega, 1.0) if rate > 0.0)
            fast = max(own, omega, 1.0)
            self.bodies.append((own, max(slow, 1.0 / LONGEST_WINDOW), fast, float(drive)))
        rows = [np.array(exact.looks).reshape(-1, 5)]
        for entry in exact.entries:
            time, x1, v1, v1_, x2, v2, v2_ = map(float, entry.values)
            rows.append(np.array([[time, x1, v1, x2, v2], [time, x1, v1_, x2, v2_]]))
        for time, state in zip(section_times, exact.samples, strict=False):
            if state is not None:
                rows.append(np.array([[time, *map(float, state)]]))
        every: NDArray[np.float64] = np.concatenate(rows)
        every = every[np.argsort(every[:, 0], kind="stable")]
        self.times, self.values = every[:, 0], np.abs(every[:, 1:])

    def at(self, time: float, *states: Sequence[arb]) -> tuple[float, float, float, float]:
        """Sizes about one instant: states (x1, v1, x2, v2) just before, or after, or both."""
        here = np.array([[abs(float(q)) for q in state] for state in states]).max(axis=0)
        first, end = np.searchsorted(self.times, (time - self.window, time))
        lately = np.maximum(self.values[first:end].max(axis=0, initial=0.0), here)
        sizes = []
        for body, (own, slow, fast, drive) in enumerate(self.bodies):
            x, v = (float(q) for q in here[2 * body : 2 * body + 2])
            reach_x, reach_v = max(x, v / slow, drive), max(v, x * fast, drive)
            sizes.append(max(x, min(float(lately[2 * body]), reach_x), v / fast))
            swing = min(float(lately[2 * body + 1]), reach_v)
            sizes.append(max(v, swing, _STEADY * own * x))
        floor = _STILL * max(sizes)
        x1, v1, x2, v2 = (max(size, floor) for size in sizes)
        return x1, v1, x2, v2

    def of_impact(self, values: Sequence[arb], normal: arb | None) -> tuple[float, ...]:
        """Sizes of MOTION_NUMBERS and FURTHER_NUMBERS at an impact.

        An impulse is measured in units of the impulse that stops both bodies, an energy in units of
        all the terms that make up the loss.
        """
        time, x1, v1, v1_, x2, v2, v2_ = values
        s1, r1, s2, r2 = self.at(float(time), (x1, v1, x2, v2), (x1, v1_, x2, v2_))
        cos = abs(float(self.system.slope(x1)))
        before1, after1, before2, after2 = (abs(float(q)) for q in (v1, v1_, v2, v2_))
        given = 0.0 if normal is None else abs(float(normal))
        mass = float(self.system.mbar) + cos * cos
        impulse = max(given, (before1 * cos + before2) / mass if mass > 0.0 else 0.0)
        tangential = impulse * min(1.0, float(self.system.mu))
        energy = (before1 * before1 + after1 * after1 + given * (before2 + after2)) / 2.0
        further = (2.0 * math.pi, impulse, tangential, energy)
        return (self.time, s1, r1, r1, s2, r2, r2, *further)
