"""The time history: where the tip and body 2 are, over the last drive periods, with the impacts."""

from __future__ import annotations

import numpy as np
from bokeh.models import ColumnDataSource, Range1d

from ..compute import Motion
from ..theme import Palette
from . import parts


class HistoryView:
    """Displacements over time; they meet where the bodies touch."""

    def __init__(self) -> None:
        self.source = ColumnDataSource(data={"at": [], "tip": [], "x2": []}, name="history")
        self.impacts = ColumnDataSource(data={"at": [], "x2": [], "color": []})
        self.now_1 = ColumnDataSource(data={"x": [0.0], "y": [0.0]})
        self.now_2 = ColumnDataSource(data={"x": [0.0], "y": [0.0]})
        self.heading = parts.text()
        self.figure = parts.plain(
            "history", y_axis_label="displacement", x_range=Range1d(), y_range=Range1d()
        )
        self.figure.xaxis.ticker.desired_num_ticks = 4
        self._tip = self.figure.line("at", "tip", source=self.source, line_width=1.6)
        self._body = self.figure.line("at", "x2", source=self.source, line_width=1.6)
        self._hits = self.figure.scatter(
            "at", "x2", source=self.impacts, size=5, color="color", line_color=None
        )
        self._dots = [
            self.figure.scatter("x", "y", source=dot, size=9, line_width=1.5, level="overlay")
            for dot in (self.now_1, self.now_2)
        ]

    def show(self, motion: Motion, palette: Palette) -> None:
        """Draw a motion."""
        run, system = motion.run, motion.run.system
        driven = system.drive_frequency > 0.0
        unit = system.drive_period if driven else 1.0
        self.figure.xaxis.axis_label = "time in drive periods" if driven else "time"
        impacts = run.impacts[run.impacts["time"] >= motion.time[0]]
        tip = np.asarray(system.tip(motion.states[:, 0])) - system.gap
        at, x2 = motion.time / unit, motion.states[:, 2]
        begin, end = float(at[0]), float(at[-1])
        # A run may have ended where it began.
        self.figure.x_range.update(start=begin, end=end if end > begin else begin + 1.0)
        lowest, highest = min(tip.min(), x2.min()), max(tip.max(), x2.max())
        parts.fit(self.figure.y_range, float(lowest), float(highest))
        self.source.data = {"at": at, "tip": tip, "x2": x2}
        self.impacts.data = {
            "at": impacts["time"] / unit,
            "x2": impacts["x2"],
            "color": palette.numbers[impacts["regime"]],
        }
        self.paint(palette)

    def paint(self, palette: Palette) -> None:
        """Use the colours of a palette."""
        self._tip.glyph.line_color = self._dots[0].glyph.fill_color = palette.first
        self._body.glyph.line_color = self._dots[1].glyph.fill_color = palette.second
        for dot in self._dots:
            dot.glyph.line_color = palette.card
        key = [(palette.first, "tip \N{MINUS SIGN} δ"), (palette.second, "x₂")]
        self.heading.text = parts.heading("Time history", key)
