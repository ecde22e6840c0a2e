"""The units of errors of a structure's run: the size of its motion near the time of a row.

A coordinate or a velocity is measured in units of its largest value over the last window, a period
of the drive or else ten of the slowest mode; where it is small beside the motion of the whole, in
units of _SMALL of what that motion could give it. The measure of the whole are
Q^2 = q M q and V^2 = v M v, and coordinate i may have up to (M^-1)_ii^(1/2) of Q: so units of
coordinates do not matter. At rest the loads count, as the motion that they start. What begins or
turns counts as its velocity over the fastest frequency.
Times count in drive periods, or periods of the slowest mode if that is less.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import cast

import numpy as np
from flint import arb
from numpy.typing import NDArray

from ..reference.structure import Structure as ExactStructure
from .passes import Pass
from .structure_motion import StructureEntry

#: Rounding in one coordinate reaches those that it is coupled with: the part of the whole motion
#: that a smaller number counts as.
_SMALL = 1e-4
#: Periods of the slowest mode in a window.
_PERIODS = 10


def window(frequencies: NDArray[np.float64], omega: float) -> float:
    """The time over which the size of the motion is measured; infinite without any period."""
    periods = [2.0 * math.pi / omega] if omega else []
    slowest = frequencies[frequencies > 0.0].min(initial=math.inf)
    if math.isfinite(slowest):
        periods.append(_PERIODS * 2.0 * math.pi / float(slowest))
    return min(periods, default=math.inf)


class StructureSizes:
    """Sizes of q and v about the rows of an exact motion, of impacts, and of times."""

    def __init__(
        self,
        structure: ExactStructure,
        frequencies: NDArray[np.float64],
        exact: Pass,
        section_times: Sequence[float],
        end: float,
    ) -> None:
        self.structure = structure
        n, omega = structure.size, float(structure.omega)
        self.window = window(frequencies, omega)
        own = [float(w) for w in frequencies if w > 0.0] + ([omega] if omega else [])
        self.fast = max(own, default=1.0 / max(end, 1e-300))
        self.slow = min(own, default=self.fast)
        periods = [2.0 * math.pi / rate for rate in (omega, self.slow) if rate > 0.0]
        self.time = min(periods) if own else end
        self.mass = np.array([[float(structure.mass[i, j]) for j in range(n)] for i in range(n)])
        inverse = structure.compliance()
        self.share = np.sqrt([float(inverse[i, i]) for i in range(n)])
        loads = [[complex(float(a), float(b)) for a, b in structure.drive]]
        loads.append([complex(float(load)) for load in structure.load])
        pushed = np.array([[float(inverse[i, j]) for j in range(n)] for i in range(n)])
        #: Acceleration by the loads, as a V.
        self.pushed = sum(float(np.sqrt((np.conj(f) @ pushed @ f).real)) for f in np.array(loads))
        rows = [np.array(exact.looks).reshape(-1, 1 + 2 * n)]
        for entry in cast("Sequence[StructureEntry]", exact.entries):
            time = float(entry.values[0])
            for v in entry.velocities():
                rows.append(np.array([[time, *map(float, entry.q()), *map(float, v)]]))
        for time, state in zip(section_times, exact.samples, strict=False):
            if state is not None:
                rows.append(np.array([[time, *map(float, state)]]))
        every: NDArray[np.float64] = np.concatenate(rows)
        every = every[np.argsort(every[:, 0], kind="stable")]
        self.times, states = every[:, 0], every[:, 1:]
        self.values, self.wholes = np.abs(states), self._whole(states)

    def at(self, time: float, *states: Sequence[arb]) -> list[float]:
        """Sizes of q and v about one instant: states just before, or after, or both."""
        n = self.structure.size
        numbers = np.array([[float(value) for value in state] for state in states])
        here = np.abs(numbers).max(axis=0)
        first, end = np.searchsorted(self.times, (time - self.window, time))
        lately = np.maximum(self.values[first:end].max(axis=0, initial=0.0), here)
        wholes = np.concatenate([self.wholes[first:end], self._whole(numbers)]).max(axis=0)
        q = np.maximum(lately[:n], here[n:] / self.fast)
        largest, fastest = map(float, wholes)
        swing = self.pushed / self.fast
        least = max(largest, fastest / self.fast, swing / self.fast)
        q = np.maximum(q, _SMALL * self.share * least)
        least = max(fastest, largest * self.slow, swing)
        v = np.maximum(lately[n:], _SMALL * self.share * least)
        return [*map(float, q), *map(float, v)]

    def of_impact(self, entry: StructureEntry) -> list[float]:
        """Sizes of the numbers of an impact: time, q, v_pre, v_post, and those of `more`.

        An approach velocity is measured in units of its terms, an impulse in that which stops them,
        an energy in the terms of the loss.
        """
        n, stop = self.structure.size, self.structure.stops[entry.stop]
        before, after = entry.velocities()
        state = (*entry.q(), *before)
        sizes = self.at(float(entry.values[0]), state, entry.after())
        moving = abs(float(stop.amplitude)) * float(self.structure.omega)
        approach = moving + sum(
            abs(float(stop.normal[0, i])) * size for i, size in enumerate(sizes[n:])
        )
        impulse = approach / float(self.structure.coupling(stop.normal, stop.normal))
        _, _, normal, _, _ = (float(cast("arb", value)) for value in entry.more)
        impulse = max(impulse, abs(normal))
        kinetic = [float(v @ self.mass @ v) for v in _numbers(before, after)]
        energy = sum(kinetic) / 2.0 + abs(normal) * moving
        more = (approach, 2.0 * math.pi, impulse, impulse * min(1.0, float(stop.friction)), energy)
        return [self.time, *sizes, *sizes[n:], *more]

    def _whole(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Q and V of each state."""
        halves = states.reshape(len(states), 2, self.structure.size)
        squares = np.einsum("kia,ab,kib->ki", halves, self.mass, halves)
        result: NDArray[np.float64] = np.sqrt(np.maximum(squares, 0.0))
        return result


def _numbers(*rows: Sequence[arb]) -> list[NDArray[np.float64]]:
    return [np.array([float(value) for value in row]) for row in rows]
