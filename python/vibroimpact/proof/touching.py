"""Search for the time at which a flight touches a stop; special.py judges it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby

import numpy as np
from flint import arb, arb_mat

from .parts import OPEN, Arc, Slice
from .special import Touch, border

#: Times of a flight at which a touch is looked for, steps of Newton's method, gaps that are tried.
_TIMES, _STEPS, _TRIED = 400, 6, 2
#: Half widths of the time that is given for it, as parts of the flight.
_WIDTHS = (1e-2, 1e-3, 1e-4)


def touches_in(arc: Arc, told: Sequence[Slice]) -> list[Touch]:
    """Touches on the parts of a tube between those of different verdicts."""
    found: list[Touch] = []
    groups = [list(run) for _, run in groupby(told, lambda one: one.verdict != "undecided")]
    for k in range(1, len(groups) - 1):
        one, between, other = groups[k - 1][-1], groups[k], groups[k + 1][0]
        if between[0].verdict != "undecided" or one.verdict == other.verdict:
            continue
        lo, hi = between[0].lo, between[-1].hi
        for touch in _candidates(arc, (lo + hi) / 2):
            try:
                border(arc, lo, hi, [touch])
            except OPEN:
                continue
            found.append(touch)
            break
    return found


def _candidates(arc: Arc, h: arb) -> Iterator[Touch]:
    """Touches that may lie in a plane, the nearest first."""
    y = [x.mid() for x in arc.tube.part(h, arc.away)]
    orbit = arc.family.at(y[-1])
    near = []
    for leg, flight in enumerate(orbit.flights(y[:-1])):
        step = (flight.duration / _TIMES).mid()
        pass_on, w, gaps = orbit.machine.flow(step), flight.start, []
        for _ in range(_TIMES - 1):
            w = arb_mat(w.nrows(), 1, [x.mid() for x in (pass_on * w).entries()])
            gaps.append([float(stop.gap(w.entries()).mid()) for stop in orbit.machine.stops])
        for stop, values in enumerate(np.array(gaps).T):
            inner = (values[1:-1] > values[:-2]) & (values[1:-1] >= values[2:])
            for k in np.flatnonzero(inner):
                time = float(step) * (int(k) + 2)
                near.append((abs(float(values[k + 1])), leg, stop, time))
    for _, leg, stop, time in sorted(near)[:_TRIED]:
        flight = orbit.flight(leg, y[:-1])
        top, limit = arb(time), orbit.machine.stops[stop]
        for _ in range(_STEPS):
            there = (orbit.machine.flow(top) * flight.start).entries()
            top = (top - limit.gap(there, 1) / limit.gap(there, 2)).mid()
        for width in _WIDTHS:
            yield leg, stop, arb(float(top), float(flight.duration) * width)
