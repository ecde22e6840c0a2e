"""Observation of the exact motion: its progress, and whether the run has left it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .stretches import AnyRun, Stretches

if TYPE_CHECKING:
    from flint import arb


#: After so many impacts or sections in a row that are this far off, in drive periods or in the size
#: of the motion, the run has left the exact motion.
_PARTED, _FAR = 40, 0.01
#: The size of the motion is the largest value at so many sections in a row.
_AROUND = 5
#: Sections of a periodic motion agree to this part of their size.
_RETURNED = 1e-6
#: The unit of times where the drive is slower or constant: a period of body 2 alone.
OWN_PERIOD = 2.0 * math.pi


class Watch:
    """Gets every impact and section of the exact motion, and decides when to end it.

    If run and exact motion settle on the same periodic motion the run has right digits again: then
    the comparison goes on, however far apart both are before.
    """

    def __init__(self, parts: Stretches, bar: Any) -> None:
        lead, kept = parts.lead, parts.kept
        self.runs = [run for run in (kept.run, parts.again) if run is not None]
        self.period = kept.run.system.drive_period
        self.bar, self.passes = bar, 0
        self.first_impact = self.first_section = 0
        times, sections = [kept.impacts["time"]], [kept.sections]
        contacts = [kept.contacts["time"]]
        if lead is None:
            self.first_impact, _, self.first_section = kept.before
        else:
            times.insert(0, lead.impacts["time"])
            sections.insert(0, lead.sections)
            contacts.append(lead.contacts["time"])
            if len(lead.impacts) < kept.before[0] or len(lead.sections) < kept.before[2]:
                # the kept window lies beyond what the reference may reach
                times.pop()
                sections.pop()
        # after that the numbers of impacts mean nothing: how many of a chatter are listed depends
        # on tolerances
        touched = np.concatenate(contacts).min(initial=math.inf)
        every: NDArray[np.float64] = np.concatenate(times)
        self.times = every[: int(np.searchsorted(every, touched))]
        self.sections: NDArray[np.float64] = np.concatenate(sections)
        self.far_impacts = self.far_sections = 0

    @cached_property
    def settles(self) -> bool:
        """Whether the run ends on a periodic motion."""
        return any(run.period.m is not None for run in self.runs)

    @cached_property
    def spreads_until(self) -> float:
        """The time from which the run is periodic, so that differences grow no more; or its end."""
        end = float(self.runs[0].final_state.time)
        turn = next((run.period.m for run in self.runs if run.period.m is not None), None)
        if turn is None or not turn < len(self.sections):
            return end
        size = np.abs(self.sections).max(axis=0)
        apart = np.abs(self.sections[turn:] - self.sections[:-turn]) > _RETURNED * size
        last = np.flatnonzero(apart.any(axis=1))[-1:].sum() + turn
        return min(end, float(self.first_section + last + 1) * self.period)

    @cached_property
    def _far(self) -> NDArray[np.float64]:
        """The distance from which a section is far off, by the size of the motion near it."""
        sizes = np.abs(self.sections)
        for shift in range(1, _AROUND):
            np.maximum(sizes[shift:], np.abs(self.sections[:-shift]), out=sizes[shift:])
        far: NDArray[np.float64] = _FAR * np.maximum(sizes, _FAR * sizes.max(axis=1, keepdims=True))
        return far

    def begin(self, bits: int) -> None:
        """Another pass, from t = 0 on."""
        self.far_impacts = self.far_sections = 0
        self.passes += 1
        if self.bar is not None:
            self.bar.reset()
            self.bar.set_description(f"exact motion, pass {self.passes}, {bits} bits")

    def impact(self, number: int, time: arb) -> bool:
        """Compare an impact, counted from 0; return whether the run has left the motion."""
        self._show(time, number + 1)
        row = number - self.first_impact
        if not 0 <= row < len(self.times):
            return False
        unit = min(self.period, OWN_PERIOD)
        near = abs(float(time) - float(self.times[row])) < _FAR * unit
        self.far_impacts = 0 if near else self.far_impacts + 1
        return self.far_impacts >= _PARTED and not self.settles

    def section(self, number: int, time: arb, state: Sequence[arb]) -> bool:
        """Compare the state at a section; return the same."""
        self._show(time, 0)
        row = number - self.first_section
        if not 0 <= row < len(self.sections):
            return False
        off = [abs(float(q) - p) for q, p in zip(state, self.sections[row], strict=True)]
        near = bool((np.array(off) < self._far[row]).all())
        self.far_sections = 0 if near else self.far_sections + 1
        return self.far_sections >= _PARTED and not self.settles

    def _show(self, time: arb, impacts: int) -> None:
        if self.bar is None:
            return
        reached = int(float(time) / self.period) if math.isfinite(self.period) else impacts
        if reached > self.bar.n:
            self.bar.update(reached - self.bar.n)


@contextmanager
def progress_bar(run: AnyRun, most: int, *, shown: bool) -> Iterator[Any]:
    """Give a tqdm bar that counts drive periods, or impacts without a drive; None if not wanted."""
    if not shown:
        yield None
        return
    from tqdm import tqdm  # here, to keep the import of the package light

    driven = run.system.drive_frequency > 0.0
    total = run.final_state.period if driven else run.impact_count
    unit = "period" if driven else "impact"
    with tqdm(total=min(total, most), desc="exact motion", unit=unit) as bar:
        yield bar
