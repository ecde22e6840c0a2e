"""The phase portrait: velocity over displacement of what the machine shows."""

from __future__ import annotations

from collections.abc import Iterable

from bokeh.models import Range1d

from ..machine import Array, Machine, Motion
from ..theme import Palette
from . import parts
from .columns import Sources
from .drawing import Dot


class PortraitView:
    """Velocity over displacement; an impact is a jump, drawn as a straight line."""

    def __init__(self, machine: Machine, shown: str, sources: Sources) -> None:
        self.heading = parts.text()
        self.figure = parts.plain("portrait", x_range=Range1d(), y_range=Range1d())
        self._phases = machine.phases(shown)
        self._lines = [
            self.figure.line(phase.place, phase.speed, source=sources.film, line_width=1.4)
            for phase in self._phases
        ]
        self.dots = [Dot.on(phase.place, phase.speed) for phase in self._phases]
        self._now = [dot.drawn(self.figure) for dot in self.dots]

    def show(self, motion: Motion, palette: Palette) -> None:
        """Show the samples of a motion."""
        columns, machine = motion.samples, motion.machine
        self._phases = machine.phases(motion.shown)
        names = machine.phase_names(motion.shown)
        self.figure.xaxis.axis_label = ", ".join(place for place, _ in names)
        self.figure.yaxis.axis_label = ", ".join(speed for _, speed in names)
        parts.fit(self.figure.x_range, *_range(columns[each.place] for each in self._phases))
        parts.fit(self.figure.y_range, *_range(columns[each.speed] for each in self._phases))
        self.paint(palette)

    def paint(self, palette: Palette) -> None:
        """Use the colours of a palette."""
        colors = (palette.first, palette.second)[: len(self._lines)]
        for line, dot, color in zip(self._lines, self._now, colors, strict=True):
            line.glyph.line_color = dot.glyph.fill_color = color
            dot.glyph.line_color = palette.card
        key = [(color, each.words) for color, each in zip(colors, self._phases, strict=True)]
        self.heading.text = parts.heading("Phase portrait", key)


def _range(columns: Iterable[Array]) -> tuple[float, float]:
    every = [*columns]
    return float(min(each.min() for each in every)), float(max(each.max() for each in every))
