"""Samples of a run for drawing, with the states before and after every impact.

A curve holds the state before and after every impact at the same instant, so that a drawn velocity
jumps exactly there. Marks for impacts and sustained contact: `marks`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ..run import Run
    from ..system import System

Array = NDArray[np.float64]


class Curve(NamedTuple):
    """A sampled piece of a run: times (k,), states (k, 4), and which kept impacts it contains."""

    time: Array
    state: Array
    impacts: NDArray[np.bool_]


def sample(
    run: Run,
    *,
    window: tuple[float, float] | None = None,
    periods: float = 8,
    points_per_period: int = 200,
) -> Curve:
    """Sample a run over a time window, with both sides of every impact.

    The instants at which sustained contact begins, changes or ends are among the samples.

    Parameters
    ----------
    run : Run
        Result of `vibroimpact.simulate`.
    window : (float, float), optional
        Times; by default the last `periods` drive periods, or what is kept of them. Needed for a
        constant load, which has no period.
    periods : float
        Length of the default window in drive periods.
    points_per_period : int
        Samples in a drive period; with a constant load, samples in the window.

    Raises
    ------
    ValueError
        If the window lies outside the kept part of the run, or is needed and missing.
    """
    length = 2 * np.pi / run.system.drive_frequency if run.system.drive_frequency else np.inf
    if window is None:
        if not np.isfinite(length):
            raise ValueError("a constant load has no drive period: give window=(start, end)")
        end = float(run.final_state.time)
        window = (max(float(run.kept_from), end - periods * length), end)
    start, end = window = (float(window[0]), float(window[1]))
    spans = (end - start) / length if np.isfinite(length) else 1.0
    grid = np.linspace(start, end, max(int(np.ceil(spans * points_per_period)), 1) + 1)
    grid = np.union1d(grid, times_within(run.contacts["time"], window))
    impacts = run.impacts
    inside = (impacts["time"] > start) & (impacts["time"] <= end)
    hits = impacts[inside]
    before = np.column_stack([hits["x1"], hits["v1_pre"], hits["x2"], hits["v2_pre"]])
    after = np.column_stack([hits["x1"], hits["v1_post"], hits["x2"], hits["v2_post"]])
    grid = grid[~np.isin(grid, hits["time"])]
    time = np.concatenate([grid, hits["time"], hits["time"]])
    state = np.concatenate([run.trajectory(grid), before, after])
    order = np.argsort(time, kind="stable")
    return Curve(time[order], state[order], inside)


def tip_symbol(system: System) -> str:
    """Return the symbol of the tip's position along the normal, without dollar signs."""
    return r"\sin x_1" if system.contact == "oblique" else "x_1"


def times_within(times: Array, window: tuple[float, float]) -> Array:
    """Return the times inside a window, its ends included."""
    return times[(times >= window[0]) & (times <= window[1])]
