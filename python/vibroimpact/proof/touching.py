"""Points of a branch whose motions nearly touch a stop inside a flight, which is cut there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from flint import arb, arb_mat
from numpy.typing import NDArray

from .formulas import Undecided
from .tube import Family
from .verifier import PASSED, Flight, Orbit

Array = NDArray[np.float64]

#: Times of a flight at which a touch is looked for, steps of Newton's method, and how small a gap
#: at a touch is, as a part of the motion's size.
_TIMES, _STEPS, _NEAR = 400, 8, 1e-6
#: Largest change of a touch's time from point to point, as a part of the flight.
_JUMP = 0.1


def cut_flights(family: Family, points: Array) -> tuple[list[list[Any]], Array] | None:
    """The legs with a flight cut where it touches a stop at the last point, and these points.

    The points are the last ones at which the flight has a maximum of the gap there; None if no
    flight touches a stop.
    """
    orbit, flights = _flights(family, points[-1])
    found = _touch(orbit, flights, float(np.abs(points[-1, : orbit.machine.size]).max()))
    if found is None:
        return None
    leg, stop, time = found
    rows: list[list[float]] = []
    for point in points[::-1]:
        orbit, flights = _flights(family, point)
        flight, width = flights[leg], 2 * orbit.machine.size + 1
        top = _maximum(orbit, flight, stop, time)
        if top is None or (rows and abs(top - time) > _JUMP * float(flight.duration)):
            break
        time, w = top, (orbit.machine.flow(arb(top)) * flight.start).entries()
        node = [*(float(x) for x in w[: width - 1]), float(point[(leg + 1) * width - 1]) + top]
        place = (leg + 1) * width
        rows.append([*point[:place].tolist(), *node, *point[place:].tolist()])
    if len(rows) < 2:
        return None
    legs: list[list[Any]] = [list(one) for one in family.legs]
    return [*legs[:leg], [stop, PASSED], *legs[leg:]], np.array(rows[::-1])


def _flights(family: Family, point: Sequence[float] | Array) -> tuple[Orbit, list[Flight]]:
    y = [arb(float(x)) for x in point]
    orbit = family.at(y[-1])
    return orbit, orbit.flights(y[:-1])


def _touch(orbit: Orbit, flights: list[Flight], size: float) -> tuple[int, int, float] | None:
    """The leg, the stop and the time since its start of the touch, if there is one."""
    near = []
    for leg, flight in enumerate(flights):
        step = (flight.duration / _TIMES).mid()
        pass_on, w, gaps = orbit.machine.flow(step), flight.start, []
        for _ in range(_TIMES - 1):
            w = arb_mat(w.nrows(), 1, [x.mid() for x in (pass_on * w).entries()])
            gaps.append([float(stop.gap(w.entries()).mid()) for stop in orbit.machine.stops])
        for stop, values in enumerate(np.array(gaps).T):
            inner = (values[1:-1] > values[:-2]) & (values[1:-1] >= values[2:])
            for k in np.flatnonzero(inner):
                top = _maximum(orbit, flight, stop, float(step) * (int(k) + 2))
                if top is not None:
                    w = orbit.machine.flow(arb(top)) * flight.start
                    height = abs(float(orbit.machine.stops[stop].gap(w.entries()).mid()))
                    near.append((height, leg, stop, top))
    height, leg, stop, top = min(near, default=(np.inf, 0, 0, 0.0))
    return (leg, stop, top) if height < _NEAR * size else None


def _maximum(orbit: Orbit, flight: Flight, stop: int, time: float) -> float | None:
    """The time of the maximum of a gap near another one, if it lies inside the flight."""
    top, limit = arb(time), orbit.machine.stops[stop]
    try:
        for _ in range(_STEPS):
            there = (orbit.machine.flow(top) * flight.start).entries()
            top = (top - limit.gap(there, 1) / limit.gap(there, 2)).mid()
            if not 0 < top < flight.duration.mid():
                return None
        there = (orbit.machine.flow(top) * flight.start).entries()
    except (Undecided, ValueError, ZeroDivisionError):
        return None
    return float(top) if limit.gap(there, 2) < 0 else None
