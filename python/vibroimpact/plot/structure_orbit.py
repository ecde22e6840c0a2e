"""One periodic motion of a structure: its phase portrait, and its time history.

As that of a System it is drawn from the solution itself, so that it can be unstable, or not
admissible. Where stops stay closed for a while a solution has no legs: there it is a run of one
orbit.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from ..simulation import simulated
from ..structure_motion import StructureOrbit
from .curve import Curve, sample, with_impacts
from .structure_history import Stretch, draw_history, shown_coordinates
from .structure_portrait import FEW, draw_portrait
from .style import curve_legend, several_axes

Array = NDArray[np.float64]

# A sample so near to an impact, as part of the orbit, would be on a side of it that rounding
# chooses.
_NEAR = 1e-9
# Letters of a line above the portrait.
_LINE = 40


def structure_orbit(
    motion: StructureOrbit,
    *,
    coordinates: Any,
    points_per_period: int,
    legend: bool,
    axes: Sequence[Axes] | None,
) -> list[Axes]:
    """Draw a periodic motion of a structure; arguments as in `orbit`, but two axes."""
    shown = shown_coordinates(coordinates, motion.system, few=FEW)
    stretch = orbit_stretch(motion, points_per_period)
    axes = several_axes(axes, 2, (7.1, 2.8))
    draw_portrait(axes[0], stretch, shown)
    draw_history(axes[1], stretch, shown)
    curve_legend(axes[1], legend)
    if not motion.admissible:
        words = textwrap.fill(f"no motion: {motion.why_not}", _LINE)
        axes[0].set_title(words, loc="left", pad=3)
    return axes


def orbit_stretch(motion: StructureOrbit, points: int) -> Stretch:
    """Return one orbit from t = 0, with so many samples in a drive period."""
    end = motion.period
    if not motion.legs:
        run = simulated(motion.system, initial=motion.state, periods=motion.m)
        curve = sample(run, window=(0.0, run.final_state.time), points_per_period=points)
        return Stretch.of_run(run, curve)
    hits = _impacts(motion)
    grid = np.linspace(0.0, end, motion.m * points + 1)
    if len(hits):
        grid = grid[np.abs(grid[:, None] - hits["time"]).min(axis=1) > _NEAR * end]
    time, state = with_impacts(grid, motion.trajectory(grid), hits)
    return Stretch(motion.system, Curve(time, state, np.ones(len(hits), bool)), hits, [])


def _impacts(motion: StructureOrbit) -> NDArray[np.void]:
    """Return the impacts of an orbit in the order of time, as the table of a run has them."""
    system, count = motion.system, motion.system.coordinates
    wide = ("f8", (count,))
    hits = np.zeros(
        sum(leg.stop is not None for leg in motion.legs),
        [
            *(("time", "f8"), ("stop", "i8"), ("regime", "i8")),
            *(("q", *wide), ("v_pre", *wide), ("v_post", *wide)),
        ],
    )
    if not len(hits):
        return hits
    nodes, modes = motion.nodes, motion.nodes.shape[1] // 2
    before = system._from_core(motion.itinerary.before_events(system._compiled, nodes))
    # A node is the state after the event of the leg before it.
    after = system._from_core(np.roll(nodes[:, :-1], -1, axis=0).reshape(-1, 2, modes))
    # Along a branch an impact may leave the drive period in which it is counted.
    time = np.array(motion.clocks) * system.drive_period + nodes[:, -1]
    hits["time"] = np.roll(time % motion.period, -1)
    hits["stop"] = [leg.stop for leg in motion.legs]
    hits["regime"] = [int(leg.regime) for leg in motion.legs if leg.regime is not None]
    hits["q"], hits["v_pre"], hits["v_post"] = before[:, 0], before[:, 1], after[:, 1]
    return hits[np.argsort(hits["time"], kind="stable")]
