"""What several views draw of a motion: its samples and its impacts, each in one source.

Whatever the server changes is a message to the browser, which costs both of them a few
milliseconds, however short it is: so views share what they can.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource

from ...run import Run
from ..compute import Motion
from ..theme import Palette

_SAMPLES = ("at", "tip", "x1", "v1", "x2", "v2")
_IMPACTS = ("at", "phase", "x2", "u", "color")


class Sources:
    """Samples and impacts of the motion on the page.

    Attributes
    ----------
    film
        For each sample the time in drive periods, the displacement of the tip, the state, and what
        the drawing of the machine needs.
    impacts
        For each kept impact its time in drive periods, its phase, place, approach velocity, and the
        colour of its regime.
    """

    def __init__(self) -> None:
        self.film = ColumnDataSource(data={name: [] for name in _SAMPLES}, name="film")
        self.impacts = ColumnDataSource(data={name: [] for name in _IMPACTS}, name="impact")


def unit_of_time(motion: Motion) -> float:
    """Return the time that counts as one: the drive period, if there is a drive."""
    system = motion.run.system
    return system.drive_period if system.drive_frequency > 0.0 else 1.0


def sample_columns(motion: Motion) -> dict[str, Any]:
    """Return times in drive periods, displacements of the tip, and states."""
    x1, v1, x2, v2 = motion.states.T
    system = motion.run.system
    tip = np.asarray(system.tip(x1)) - system.gap
    at = motion.time / unit_of_time(motion)
    return {"at": at, "tip": tip, "x1": x1, "v1": v1, "x2": x2, "v2": v2}


def impact_columns(motion: Motion, palette: Palette) -> dict[str, Any]:
    """Return the kept impacts; without a drive the time is in the place of the phase."""
    impacts = motion.run.impacts
    driven = motion.run.system.drive_frequency > 0.0
    return {
        "at": impacts["time"] / unit_of_time(motion),
        "phase": impacts["phase"] if driven else impacts["time"],
        "x2": impacts["x2"],
        "u": approach_velocity(motion.run),
        "color": palette.numbers[impacts["regime"]],
    }


def approach_velocity(run: Run) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return the approach velocity u of each kept impact: the rate of the gap just before it."""
    before = [run.impacts[name] for name in ("x1", "v1_pre", "x2", "v2_pre")]
    rates = run.system.gap_rate(np.column_stack(before))
    return np.asarray(rates, dtype=np.float64).reshape(-1)
