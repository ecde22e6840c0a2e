"""The two sections of a motion: the state at each impact, and once per drive period.

The impact section is drawn as approach velocity over phase, which says something for every contact:
the angle at impact is constant where body 2 is a wall.
"""

from __future__ import annotations

import math

import numpy as np
from bokeh.models import BasicTicker, ColumnDataSource, FixedTicker

from ..machine import Machine, Motion
from ..theme import Palette
from . import parts
from .columns import Sources, impact_columns

_TICKS = {0.0: "0", 0.5 * math.pi: "π/2", math.pi: "π", 1.5 * math.pi: "3π/2", math.tau: "2π"}
# Beyond 0 and 2 pi, so that points there are seen whole.
_EDGE = 0.12


class SectionViews:
    """Both sections of the kept drive periods."""

    def __init__(self, machine: Machine, sources: Sources) -> None:
        self.impact = sources.impacts
        self.stroboscopic = ColumnDataSource(data={"place": [], "speed": []}, name="stroboscopic")
        self._machine, self._kinds = machine, list[int]()
        self._driven: bool | None = None
        self.impact_heading, self.stroboscopic_heading = parts.text(), parts.text()
        self.impact_figure = parts.plain(
            "impact",
            x_axis_label="phase ψ",
            y_axis_label="approach velocity u",
            x_range=(-_EDGE, math.tau + _EDGE),
            y_range=(0.0, 1.0),
        )
        self.impact_figure.scatter(
            "phase", "u", source=self.impact, size=5, color="color", line_color=None
        )
        self.stroboscopic_figure = parts.plain(
            "stroboscopic",
            x_range=(-1.0, 1.0),
            y_range=(-1.0, 1.0),
        )
        self.stroboscopic_figure.xaxis.ticker.desired_num_ticks = 4
        self._dots = self.stroboscopic_figure.scatter(
            "place", "speed", source=self.stroboscopic, size=5, line_color=None
        )

    def show(self, motion: Motion, palette: Palette) -> None:
        """Draw the sections of a motion."""
        run, machine = motion.run, motion.machine
        self._axis(driven=machine.driven)
        if not machine.driven:
            end = run.final_state.time
            self.impact_figure.x_range.update(start=run.kept_from, end=end)
        self.impact.data = impact_columns(motion, palette)
        place, speed = machine.phase_names(motion.shown)[0]
        self.stroboscopic_figure.xaxis.axis_label = place
        self.stroboscopic_figure.yaxis.axis_label = speed
        sections = machine.sections(run, motion.shown)
        self.stroboscopic.data = {"place": sections[:, 0], "speed": sections[:, 1]}
        # The window of the whole motion: that of few equal points would show their rounding.
        phase = machine.phases(motion.shown)[0]
        moved = (motion.samples[phase.place], motion.samples[phase.speed])
        ranges = (self.stroboscopic_figure.x_range, self.stroboscopic_figure.y_range)
        for shown, values, kept in zip(ranges, moved, sections.T, strict=True):
            every = np.concatenate([values, kept])
            parts.fit(shown, float(every.min()), float(every.max()))
        top = float(self.impact.data["u"].max(initial=0.0))
        parts.fit(self.impact_figure.y_range, 0.0, top or 1.0)
        self._machine = machine
        self._kinds = np.unique(machine.kinds(run.impacts)).tolist()
        self.paint(palette)

    def _axis(self, *, driven: bool) -> None:
        """Let the impact section have the phase along its axis; without a drive, the time.

        Only when that changes: a new ticker costs as much as all else.
        """
        if driven == self._driven:
            return
        self._driven = driven
        axis = self.impact_figure.xaxis
        axis.axis_label = "phase ψ" if driven else "time"
        axis.major_label_overrides = dict(_TICKS) if driven else {}
        if driven:
            axis.ticker = FixedTicker(ticks=[*_TICKS])
            self.impact_figure.x_range.update(start=-_EDGE, end=math.tau + _EDGE)
        else:
            axis.ticker = BasicTicker(desired_num_ticks=4)

    def paint(self, palette: Palette) -> None:
        """Use the colours of a palette."""
        self._dots.glyph.fill_color = palette.first
        colors = palette.kinds(stops=self._machine.by_stop)
        key = [(colors[each], self._machine.kind_words(each)) for each in self._kinds]
        self.impact_heading.text = parts.heading("Impact section", key)
        none = "" if self._driven else '<span class="key">there is no drive</span>'
        self.stroboscopic_heading.text = parts.heading("Stroboscopic section") + none
