"""What the views of the explorer draw: pure functions from a state to results and arrays.

They use the public functions of the package and nothing else, so that a number on the page is the
number that a reader's own call gives. Every call has a cap on its events.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SimulationError
from ..orbits import Branch, PeriodicMotion, follow_motion
from ..simulation import simulated
from ..sweeps import Basins, Chart, bifurcation_diagram, chart
from ..sweeps.basins import basins
from .axis import Axis
from .machine import Machine, Motion
from .state import State

Array = NDArray[np.float64]

# Drive periods of the motion on the page, how many are in its sections, and in its history.
PERIODS, KEEP, SHOWN = 600, 100, 8
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


def run_options(machine: Machine) -> dict[str, Any]:
    """Return the length of the motion on the page: drive periods, or a time without a drive."""
    return {"periods": PERIODS, "keep": KEEP} if machine.driven else {"time": machine.time}


def detail(state: State, details: Mapping[str, Detail], *, moving: bool = False) -> Detail:
    """Return how finely the map of a state is computed: large machines have fewer cells.

    ``moving``: a slider moves.
    """
    usual, effort = details[state.map], state.machine.effort
    effort *= state.machine.haste if moving else 1
    return dataclasses.replace(
        usual, columns=max(usual.columns // effort, 2), rows=usual.rows // effort
    )


def motion(state: State) -> Motion:
    """Simulate the motion of a state, and sample the end of it."""
    machine, options = state.machine, run_options(state.machine)
    begun: Any = {"initial": machine.begin(state.initial), "max_events": MOST_EVENTS}
    run: Any = simulated(machine.system, **begun, **options)
    if run.kept_from >= run.final_state.time:
        # It has ended before the part to be kept: all of it is.
        run = simulated(machine.system, **begun, **options | {"keep": None})
    end = run.final_state.time
    if machine.driven:
        begin = max(run.kept_from, end - SHOWN * machine.drive_period)
        time = np.linspace(begin, end, SHOWN * SAMPLES + 1)
    else:
        time = np.linspace(run.kept_from, end, SAMPLES_OF_TIME)
    time = np.clip(time, run.kept_from, end)
    states, forces = machine.sampled(run, time)
    return Motion(machine, run, time, states, forces, state.shown)


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
    unknown
        Why there is no exponent, or nothing.
    periodic
        The periodic motion that the run has settled on; None if there is none.
    stability
        What its multipliers say, in a word.
    """

    label: str
    evidence: str
    exponent: float
    error: float
    unknown: str
    periodic: Any
    stability: str


def verdict(state: State, run: Any) -> Verdict:
    """Label a run, measure its largest exponent, and find its periodic motion."""
    machine = state.machine
    exponent, error, unknown = math.nan, math.nan, ""
    evidence = str(run.period.evidence)
    if not machine.driven:
        return Verdict(run.label, evidence, exponent, error, unknown, None, "")
    try:
        exponent, error = machine.exponent(
            state.initial, periods=PERIODS, keep=KEEP, max_events=MOST_EVENTS
        )
    except SimulationError as failure:
        unknown = str(failure)
    found = run.refine() if run.period.m is not None else None
    return Verdict(
        label=run.label,
        evidence=evidence,
        exponent=exponent,
        error=error,
        unknown=unknown,
        # A motion that was not found counts as False.
        periodic=found or None,
        stability=machine.stability(found) if found else "",
    )


def axis_values(*axes: tuple[Axis, int]) -> dict[str, Any]:
    """Return so many values of each axis by its name, both ends included."""
    return {axis.name: np.linspace(axis.low, axis.high, count) for axis, count in axes}


def has_periods(state: State) -> bool:
    """Whether the motions of the map of a state have drive periods, which it counts."""
    axes = {"diagram": (state.vary,), "chart": (state.across, state.upward)}.get(state.map, ())
    varied = any(axis.name == "drive_frequency" for axis in axes)
    return varied or state.machine.driven


def diagram(state: State, detail: Detail) -> Any:
    """Compute the bifurcation diagram of a state."""
    machine = state.machine
    return bifurcation_diagram(
        machine.family(state.vary.name),
        initial=machine.begin(state.diagram_initial),
        periods=detail.periods,
        keep=detail.keep,
        start=state.start,  # checked by State
        labels=False,
        max_events=MOST_EVENTS,
        **axis_values((state.vary, detail.columns)),
    )


def chart_of(state: State, detail: Detail) -> Chart:
    """Compute the chart of a state: a label for each cell."""
    machine = state.machine
    return chart(
        machine.family(state.across.name, state.upward.name),
        initial=machine.begin(state.initial),
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
