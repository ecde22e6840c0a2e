"""Samples of a run for drawing, with the states before and after every impact.

A curve holds the state before and after every impact at the same instant, so that a drawn velocity
jumps exactly there. Window and samples follow the motion: so much of it that it can be read, and so
many samples that each flight and each oscillation is smooth. Marks for impacts and sustained
contact: `marks`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import count, number, pair, positive, reject
from ..run import EventKind, Run
from ..structure import Structure
from ..structure_run import StructureRun
from ..system import System
from .given import run_hits_wall_at_rest

Array = NDArray[np.float64]

# The default window has at most so many drive periods, oscillations and impacts, but one drive
# period at least.
_PERIODS, _OSCILLATIONS, _IMPACTS = 8.0, 40.0, 60
# Orbits of more drive periods are not drawn as a closed curve.
_LONGEST_ORBIT = 40
# Of the length of an orbit, in drive periods.
_ROUNDING = 1e-6
# Samples in a drive period, an oscillation, a flight between two events, a complete chatter, and
# in all.
_IN_PERIOD, _IN_OSCILLATION, _IN_FLIGHT, _IN_CHATTER, _MOST = 200, 60, 16, 1200, 200_000
# The bounces of a chatter become shorter by powers; they are sampled down to this part of it.
_CHATTER_END = 1e-4
# The part of the motion that follows the last event of a run that came to rest.
_REST_PART = 0.1


class Curve(NamedTuple):
    """A sampled piece of a run: times (k,), states (k, 4), and which kept impacts it contains.

    States of a structure are (k, 2, N), rows q and v.
    """

    time: Array
    state: Array
    impacts: NDArray[np.bool_]


def sample(
    run: Run | StructureRun,
    *,
    window: tuple[float, float] | None = None,
    periods: float | None = None,
    points_per_period: int | None = None,
) -> Curve:
    """Sample a run over a time window, with both sides of every impact.

    The instants at which sustained contact begins, changes or ends are among the samples.

    Parameters
    ----------
    run : Run or StructureRun
        Result of `vibroimpact.simulate`.
    window : (float, float), optional
        Times, within the kept part of the run. By default what can be read: the last eight drive
        periods, or fewer where these have many oscillations or impacts; without a drive the
        beginning of the kept part, down to rest.
    periods : float, optional
        Length of the window in drive periods, in place of `window`: the last ones, or what is kept
        of them.
    points_per_period : int, optional
        Samples in a drive period; without one, in the window. By default so many that
        every flight and every oscillation is smooth.

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind or out of range, the window lies outside the kept part
        of the run, or `periods` is given for a system without drive period.
    """
    start, end = span = shown_window(run, window, periods)
    first, last = float(run.kept_from), float(run.final_state.time)
    if not first <= start < end <= last:
        reject("window", span, f"times in the kept window, {first!r} to {last!r}")
    grid = _grid(run, span, points_per_period)
    grid = np.union1d(grid, times_within(run.contacts["time"], span))
    impacts = run.impacts
    inside = (impacts["time"] > start) & (impacts["time"] <= end)
    hits = impacts[inside]
    grid = grid[~np.isin(grid, hits["time"])]
    return Curve(*with_impacts(grid, run.trajectory(grid), hits), inside)


def with_impacts(time: Array, state: Array, hits: NDArray[np.void]) -> tuple[Array, Array]:
    """Return samples in the order of time, with the states on both sides of each impact."""
    before, after = (_states(hits, side) for side in ("pre", "post"))
    time = np.concatenate([time, hits["time"], hits["time"]])
    state = np.concatenate([state, before, after])
    order = np.argsort(time, kind="stable")
    return time[order], state[order]


def _states(hits: NDArray[np.void], side: str) -> Array:
    """Return the states at impacts, on one side of each."""
    if "q" in (hits.dtype.names or ()):
        return np.stack([hits["q"], hits[f"v_{side}"]], axis=1)
    return np.column_stack([hits["x1"], hits[f"v1_{side}"], hits["x2"], hits[f"v2_{side}"]])


def shown_window(
    run: Run | StructureRun, window: Any = None, periods: Any = None
) -> tuple[float, float]:
    """Return the times between which a run is drawn: as asked for, or what can be read."""
    first, last = float(run.kept_from), float(run.final_state.time)
    if not first < last:
        reject("run", run, "a run of which some time is kept: there is nothing to draw")
    if window is not None:
        allowed = "a pair (start, end) of times, start < end, or None"
        low, high = (number("window", each, allowed) for each in pair("window", window, allowed))
        if not low < high:
            reject("window", window, allowed)
        return low, high
    if periods is not None:
        length = positive("periods", periods) * run.system.drive_period
        if not np.isfinite(length):
            allowed = "None: drive_frequency = 0 has no drive period: give window=(start, end)"
            reject("periods", periods, allowed)
        return max(first, last - length), last
    return _readable(run, first, last)


def is_driven(system: System | Structure) -> bool:
    """Return whether a drive acts that changes with time, that of a stop among them."""
    if isinstance(system, Structure):
        moving = any(stop.amplitude != 0.0 for stop in system.stops)
        loads = moving or bool(system.drive_amplitude.any())
    else:
        loads = system.moment_amplitude != 0.0 or system.force_amplitude != 0.0
    return loads and system.drive_frequency > 0.0


def orbit_window(run: Run | StructureRun) -> tuple[float, float]:
    """Return the window of a portrait: one orbit of a periodic motion, of others many periods."""
    if not is_driven(run.system):
        return shown_window(run)
    m = run.period.m
    return shown_window(run, periods=m if m and m <= _LONGEST_ORBIT else _LONGEST_ORBIT)


def is_one_orbit(run: Run, length: float) -> bool:
    """Return whether a time of this length is at most one orbit, which leaves room for dashes."""
    if not is_driven(run.system):
        return False
    m = run.period.m
    return m is not None and length <= (m + _ROUNDING) * run.system.drive_period


def _readable(run: Run | StructureRun, first: float, last: float) -> tuple[float, float]:
    system, times = run.system, run.impacts["time"]
    longest = _OSCILLATIONS * _oscillations(run)[1]
    if is_driven(system):
        period = system.drive_period
        start = max(first, last - min(_PERIODS * period, max(period, longest)))
        if np.count_nonzero(times > start) > _IMPACTS:
            start = max(start, min(float(times[-_IMPACTS]), last - period))
        return start, last
    if run.stop_reason == "rest":
        settled = float(max(times.max(initial=first), run.contacts["time"].max(initial=first)))
        return first, min(last, settled + max(_REST_PART * (settled - first), 1e-3 * last))
    end = min(last, first + longest)
    if np.count_nonzero(times < end) > _IMPACTS:
        end = float(times[_IMPACTS])
    return first, end


def _oscillations(run: Run | StructureRun) -> tuple[float, float]:
    """Return the periods of the fastest free oscillation, and of the slowest that is to be seen."""
    if isinstance(run, StructureRun):
        # High modes of a beam would leave a window in which the low ones do not move.
        frequencies = run.system.frequencies[run.system.frequencies > 0.0].tolist() or [0.0]
    else:
        others = 0.0 if run_hits_wall_at_rest(run) else 1.0
        frequencies = [max(run.system.frequency_ratio, others)]
    fastest, slowest = max(frequencies), min(frequencies)
    if fastest == 0.0:
        return np.inf, np.inf
    return 2.0 * np.pi / fastest, 2.0 * np.pi / slowest


def _grid(run: Run | StructureRun, span: tuple[float, float], points_per_period: Any) -> Array:
    start, end = span
    length, period = end - start, run.system.drive_period
    if points_per_period is not None:
        points = count("points_per_period", points_per_period, least=1, most=1_000_000)
        parts = length / period if np.isfinite(period) else 1.0
        return np.linspace(start, end, max(int(np.ceil(parts * points)), 1) + 1)
    # Not by the shortest of three steps: in a run of the shortest time that would be 0.
    oscillation, _ = _oscillations(run)
    parts = max(length / (period / _IN_PERIOD), length / (oscillation / _IN_OSCILLATION), 400.0)
    grids = [np.linspace(start, end, int(min(np.ceil(parts), _MOST)) + 1)]
    # Every flight, however short, has some samples of its own.
    events = np.unique([start, *times_within(run.impacts["time"], span), end])
    if (len(events) - 1) * _IN_FLIGHT <= _MOST:
        inner = np.arange(1, _IN_FLIGHT) / _IN_FLIGHT
        grids.append((events[:-1, None] + np.diff(events)[:, None] * inner).ravel())
    # So has the end of a complete chatter, whose bounces no impact of the table marks.
    kinds = run.contacts["kind"] == EventKind.CHATTER
    ends = run.contacts[kinds]
    each = min(_IN_CHATTER, _MOST // max(len(ends), 1))
    for row in ends:
        before = row["time"] - row["time_jump"] * np.geomspace(1.0, _CHATTER_END, each)
        grids.append(times_within(before, span))
    return np.unique(np.concatenate(grids))


def tip_symbol(system: System) -> str:
    """Return the symbol of the tip's position along the normal, without dollar signs."""
    return r"\sin x_1" if system.contact == "oblique" else "x_1"


def times_within(times: Array, window: tuple[float, float]) -> Array:
    """Return the times inside a window, its ends included."""
    return times[(times >= window[0]) & (times <= window[1])]
