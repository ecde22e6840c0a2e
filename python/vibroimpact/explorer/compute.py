"""What the views of the explorer draw: pure functions from a state to results and arrays.

They use the public functions of the package and nothing else, so that a number on the page is the
number that a reader's own call gives. Every call has a cap on its events.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..orbits import Branch, PeriodicMotion, follow_motion
from ..run import Run
from ..simulation import simulate
from ..sweeps import Basins, Chart, Diagram, bifurcation_diagram, chart, sweep
from ..sweeps.basins import basins
from ..system import System
from .state import Axis, State

Array = NDArray[np.float64]

# Drive periods of the motion on the page, how many are in its sections, and in its history.
PERIODS, KEEP, SHOWN = 600, 100, 8
# Length of a motion without a drive.
TIME = 30.0
# Samples per drive period, and of a motion without a drive.
SAMPLES, SAMPLES_OF_TIME = 120, 1200
# A run on the page ends after so many events: some tenths of a second.
MOST_EVENTS = 200_000


@dataclass(frozen=True)
class Detail:
    """How finely a map is computed: cells, and drive periods per cell."""

    columns: int
    rows: int
    periods: int
    keep: int


# While a slider moves, and when it rests. A column of the fine diagram is as long as the motion on
# the page, which so has its points.
COARSE = {
    "diagram": Detail(140, 0, 160, 32),
    "chart": Detail(24, 16, 160, 60),
    "basins": Detail(32, 24, 300, 60),
}
FINE = {
    "diagram": Detail(600, 0, PERIODS, 60),
    "chart": Detail(72, 48, 300, 100),
    "basins": Detail(120, 90, 600, 100),
}


@dataclass(frozen=True, eq=False)
class Motion:
    """The motion of a state, sampled for the views.

    Attributes
    ----------
    run
        As ``vi.simulate`` gives it.
    time
        Times of the samples, shape (k,).
    states
        x1, v1, x2, v2 at these times, shape (k, 4).
    """

    run: Run
    time: Array
    states: Array


def run_options(system: System) -> dict[str, Any]:
    """Return the length of the motion on the page: drive periods, or a time without a drive."""
    if system.drive_frequency == 0.0:
        return {"time": TIME}
    return {"periods": PERIODS, "keep": KEEP}


def motion(state: State) -> Motion:
    """Simulate the motion of a state, and sample the end of it."""
    run = simulate(
        state.system,
        initial=state.initial,
        max_events=MOST_EVENTS,
        **run_options(state.system),
    )
    end = run.final_state.time
    if state.system.drive_frequency == 0.0:
        time = np.linspace(run.kept_from, end, SAMPLES_OF_TIME)
    else:
        begin = max(run.kept_from, end - SHOWN * state.system.drive_period)
        time = np.linspace(begin, end, SHOWN * SAMPLES + 1)
    time = np.clip(time, run.kept_from, end)
    return Motion(run, time, run.trajectory(time))


@dataclass(frozen=True, eq=False)
class Verdict:
    """What a motion is.

    Attributes
    ----------
    label
        As ``run.label`` gives it.
    evidence
        What the label stands on, in words.
    exponent, error
        Largest Lyapunov exponent and its standard error; NaN where there is none.
    periodic
        The periodic motion that the run has settled on; None if there is none.
    """

    label: str
    evidence: str
    exponent: float
    error: float
    periodic: PeriodicMotion | None


def verdict(state: State, run: Run) -> Verdict:
    """Label a run, measure its largest exponent, and find its periodic motion."""
    system = state.system
    if system.drive_frequency == 0.0:
        return Verdict(run.label, str(run.period.evidence), math.nan, math.nan, None)
    cell = sweep(
        system,
        initial=state.initial,
        periods=PERIODS,
        keep=KEEP,
        exponents=True,
        max_events=MOST_EVENTS,
        drive_frequency=[system.drive_frequency],
    )
    found = run.refine() if run.period.m is not None else None
    return Verdict(
        label=run.label,
        evidence=str(run.period.evidence),
        exponent=float(cell.largest_exponent[0]),
        error=float(cell.exponent_error[0]),
        periodic=found if isinstance(found, PeriodicMotion) else None,
    )


def axis_values(*axes: tuple[Axis, int]) -> dict[str, Any]:
    """Return so many values of each axis by its name, both ends included."""
    return {axis.name: np.linspace(axis.low, axis.high, count) for axis, count in axes}


def has_periods(state: State) -> bool:
    """Whether the motions of the map of a state have drive periods, which it counts."""
    axes = {"diagram": (state.vary,), "chart": (state.across, state.upward)}.get(state.map, ())
    varied = any(axis.name == "drive_frequency" for axis in axes)
    return varied or state.system.drive_frequency > 0.0


def diagram(state: State, detail: Detail) -> Diagram:
    """Compute the bifurcation diagram of a state."""
    return bifurcation_diagram(
        state.system,
        initial=state.diagram_initial,
        periods=detail.periods,
        keep=detail.keep,
        start=state.start,  # checked by State
        labels=False,
        max_events=MOST_EVENTS,
        **axis_values((state.vary, detail.columns)),
    )


def chart_of(state: State, detail: Detail) -> Chart:
    """Compute the chart of a state: a label for each cell."""
    return chart(
        state.system,
        initial=state.initial,
        periods=detail.periods,
        keep=detail.keep,
        exponents=False,
        max_events=MOST_EVENTS,
        **axis_values((state.across, detail.columns), (state.upward, detail.rows)),
    )


# Cells that are searched for attractors beforehand.
SCOUTS = 60


def basins_of(state: State, detail: Detail) -> Basins:
    """Compute the basins of attraction of a state's system."""
    return basins(
        state.system,
        initial=state.initial,
        periods=detail.periods,
        keep=detail.keep,
        scouts=SCOUTS,
        rounds=0,
        max_events=MOST_EVENTS,
        **axis_values((state.right, detail.columns), (state.up, detail.rows)),
    )


# Points of a branch in each direction, at most.
MOST_POINTS = 300


def branch(state: State, periodic: PeriodicMotion) -> Branch:
    """Follow a periodic motion over the range of the diagram."""
    over: dict[str, Any] = {state.vary.name: (state.vary.low, state.vary.high)}
    return follow_motion(periodic, max_points=MOST_POINTS, **over)
