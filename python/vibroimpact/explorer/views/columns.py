"""What several views draw of a motion: its samples and its impacts, each in one source.

Whatever the server changes is a message to the browser, which costs both of them a few
milliseconds, however short it is: so views share what they can.
"""

from __future__ import annotations

from typing import Any

from bokeh.models import ColumnDataSource

from ..machine import Machine, Motion
from ..theme import Palette


class Sources:
    """Samples and impacts of the motion on the page.

    Attributes
    ----------
    film
        For each sample the time in drive periods, what curves and phases draw, and what the drawing
        of the machine needs.
    impacts
        For each kept impact its time in drive periods, its phase, place on each curve, approach
        velocity, and the colour of its kind.
    """

    def __init__(self, machine: Machine, shown: str) -> None:
        samples = {"at"} | {curve.column for curve in machine.curves(shown)}
        for phase in machine.phases(shown):
            samples |= {phase.place, phase.speed}
        impacts = ("at", "phase", *machine.heights, "u", "color")
        self.film = ColumnDataSource(data={name: [] for name in samples}, name="film")
        self.impacts = ColumnDataSource(data={name: [] for name in impacts}, name="impact")


def impact_columns(motion: Motion, palette: Palette) -> dict[str, Any]:
    """Return the kept impacts; without a drive the time is in the place of the phase."""
    impacts, machine = motion.run.impacts, motion.machine
    return {
        "at": impacts["time"] / motion.unit_of_time,
        "phase": impacts["phase"] if machine.driven else impacts["time"],
        **machine.hits(motion),
        "u": machine.approach(motion.run),
        "color": palette.numbers(stops=machine.by_stop)[machine.kinds(impacts)],
    }
