"""The time history: where the tip and body 2 are, over the last drive periods, with the impacts."""

from __future__ import annotations

from bokeh.models import ColumnDataSource, Range1d

from ..compute import Motion
from ..theme import Palette
from . import parts
from .columns import Sources, sample_columns


class HistoryView:
    """Displacements over time; they meet where the bodies touch."""

    def __init__(self, sources: Sources) -> None:
        self.now_1 = ColumnDataSource(data={"x": [0.0], "y": [0.0]})
        self.now_2 = ColumnDataSource(data={"x": [0.0], "y": [0.0]})
        self.heading = parts.text()
        self.figure = parts.plain(
            "history", y_axis_label="displacement", x_range=Range1d(), y_range=Range1d()
        )
        self.figure.xaxis.ticker.desired_num_ticks = 4
        self._tip = self.figure.line("at", "tip", source=sources.film, line_width=1.6)
        self._body = self.figure.line("at", "x2", source=sources.film, line_width=1.6)
        self._hits = self.figure.scatter(
            "at", "x2", source=sources.impacts, size=5, color="color", line_color=None
        )
        self._dots = [
            self.figure.scatter("x", "y", source=dot, size=9, line_width=1.5, level="overlay")
            for dot in (self.now_1, self.now_2)
        ]

    def show(self, motion: Motion, palette: Palette) -> None:
        """Show the samples of a motion."""
        driven = motion.run.system.drive_frequency > 0.0
        self.figure.xaxis.axis_label = "time in drive periods" if driven else "time"
        columns = sample_columns(motion)
        at, tip, x2 = (columns[name] for name in ("at", "tip", "x2"))
        begin, end = float(at[0]), float(at[-1])
        # A run may have ended where it began.
        self.figure.x_range.update(start=begin, end=end if end > begin else begin + 1.0)
        lowest, highest = min(tip.min(), x2.min()), max(tip.max(), x2.max())
        parts.fit(self.figure.y_range, float(lowest), float(highest))
        self.paint(palette)

    def paint(self, palette: Palette) -> None:
        """Use the colours of a palette."""
        self._tip.glyph.line_color = self._dots[0].glyph.fill_color = palette.first
        self._body.glyph.line_color = self._dots[1].glyph.fill_color = palette.second
        for dot in self._dots:
            dot.glyph.line_color = palette.card
        key = [(palette.first, "tip \N{MINUS SIGN} δ"), (palette.second, "x₂")]
        self.heading.text = parts.heading("Time history", key)
