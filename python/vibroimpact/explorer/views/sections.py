"""The two sections of a motion: the state at each impact, and once per drive period.

The impact section is drawn as approach velocity over phase, which says something for every contact:
the angle at impact is constant where body 2 is a wall.
"""

from __future__ import annotations

import math

import numpy as np
from bokeh.models import BasicTicker, ColumnDataSource, FixedTicker

from ...plot.style import REGIME_STYLES
from ..compute import Motion
from ..theme import Palette
from . import parts
from .columns import Sources, impact_columns

_TICKS = {0.0: "0", 0.5 * math.pi: "π/2", math.pi: "π", 1.5 * math.pi: "3π/2", math.tau: "2π"}
# Beyond 0 and 2 pi, so that points there are seen whole.
_EDGE = 0.12


class SectionViews:
    """Both sections of the kept drive periods."""

    def __init__(self, sources: Sources) -> None:
        self.impact = sources.impacts
        self.stroboscopic = ColumnDataSource(data={"x1": [], "v1": []}, name="stroboscopic")
        self._regimes: list[int] = []
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
            x_axis_label="x₁",
            y_axis_label="ẋ₁",
            x_range=(-1.0, 1.0),
            y_range=(-1.0, 1.0),
        )
        self.stroboscopic_figure.xaxis.ticker.desired_num_ticks = 4
        self._dots = self.stroboscopic_figure.scatter(
            "x1", "v1", source=self.stroboscopic, size=5, line_color=None
        )

    def show(self, motion: Motion, palette: Palette) -> None:
        """Draw the sections of a motion."""
        run = motion.run
        impacts = run.impacts
        driven = run.system.drive_frequency > 0.0
        self._axis(driven=driven)
        if not driven:
            end = run.final_state.time
            self.impact_figure.x_range.update(start=run.kept_from, end=end)
        self.impact.data = impact_columns(motion, palette)
        sections = run.stroboscopic
        self.stroboscopic.data = {"x1": sections[:, 0], "v1": sections[:, 1]}
        # The window of the whole motion: that of few equal points would show their rounding.
        x1, v1, _, _ = motion.states.T
        ranges = (self.stroboscopic_figure.x_range, self.stroboscopic_figure.y_range)
        for shown, values, kept in zip(ranges, (x1, v1), sections.T, strict=False):
            every = np.concatenate([values, kept])
            parts.fit(shown, float(every.min()), float(every.max()))
        top = float(self.impact.data["u"].max(initial=0.0))
        parts.fit(self.impact_figure.y_range, 0.0, top or 1.0)
        self._regimes = [int(regime) for regime in np.unique(impacts["regime"])]
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
        key = [(palette.regime(each), REGIME_STYLES[each].text) for each in self._regimes]
        self.impact_heading.text = parts.heading("Impact section", key)
        none = "" if self._driven else '<span class="key">there is no drive</span>'
        self.stroboscopic_heading.text = parts.heading("Stroboscopic section") + none
