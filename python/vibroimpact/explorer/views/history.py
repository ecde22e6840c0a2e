"""The time history: the curves of the machine over the last drive periods, with the impacts."""

from __future__ import annotations

from bokeh.models import Range1d

from ..machine import Machine, Motion
from ..theme import Palette
from . import parts
from .columns import Sources
from .drawing import Dot

# The lines of a colour: solid, dashed.
_DASHES: tuple[list[int], ...] = ([], [7, 3])


class HistoryView:
    """Curves over time."""

    def __init__(self, machine: Machine, shown: str, sources: Sources) -> None:
        self.heading = parts.text()
        self.figure = parts.plain("history", x_range=Range1d(), y_range=Range1d())
        self.figure.xaxis.ticker.desired_num_ticks = 4
        self._curves = machine.curves(shown)
        self._lines = [
            self.figure.line(
                *("at", curve.column),
                source=sources.film,
                line_width=1.6,
                line_dash=_DASHES[place // 2],
            )
            for place, curve in enumerate(self._curves)
        ]
        for column in machine.heights:
            self.figure.scatter(
                "at", column, source=sources.impacts, size=5, color="color", line_color=None
            )
        self.dots = [Dot.on("at", curve.column) for curve in self._curves]
        self._now = [dot.drawn(self.figure) for dot in self.dots]

    def show(self, motion: Motion, palette: Palette) -> None:
        """Show the samples of a motion."""
        machine = motion.machine
        self._curves = machine.curves(motion.shown)
        self.figure.xaxis.axis_label = "time in drive periods" if machine.driven else "time"
        self.figure.yaxis.axis_label = machine.history_label(motion.shown)
        columns = motion.samples
        begin, end = float(columns["at"][0]), float(columns["at"][-1])
        # A run may have ended where it began.
        self.figure.x_range.update(start=begin, end=end if end > begin else begin + 1.0)
        drawn = [columns[curve.column] for curve in self._curves]
        lowest, highest = min(each.min() for each in drawn), max(each.max() for each in drawn)
        parts.fit(self.figure.y_range, float(lowest), float(highest))
        self.paint(palette)

    def paint(self, palette: Palette) -> None:
        """Use the colours of a palette."""
        key = []
        for place, (line, dot) in enumerate(zip(self._lines, self._now, strict=True)):
            color = (palette.first, palette.second)[place % 2]
            line.glyph.line_color = dot.glyph.fill_color = color
            dot.glyph.line_color = palette.card
            dashed = " (dashed)" if place // 2 else ""
            key.append((color, self._curves[place].words + dashed))
        self.heading.text = parts.heading("Time history", key)
