"""The phase portrait: both bodies in the planes of displacement and velocity."""

from __future__ import annotations

from bokeh.models import ColumnDataSource, Range1d

from ..compute import Motion
from ..theme import Palette
from . import parts
from .columns import Sources


class PortraitView:
    """Velocity over displacement; an impact is a jump, drawn as a straight line."""

    def __init__(self, sources: Sources) -> None:
        self.here_1 = ColumnDataSource(data={"x": [0.0], "y": [0.0]})
        self.here_2 = ColumnDataSource(data={"x": [0.0], "y": [0.0]})
        self.heading = parts.text()
        self.figure = parts.plain(
            "portrait",
            x_axis_label="x₁, x₂",
            y_axis_label="ẋ₁, ẋ₂",
            x_range=Range1d(),
            y_range=Range1d(),
        )
        self._lines = [
            self.figure.line(f"x{body}", f"v{body}", source=sources.film, line_width=1.4)
            for body in (1, 2)
        ]
        self._dots = [
            self.figure.scatter("x", "y", source=dot, size=9, line_width=1.5, level="overlay")
            for dot in (self.here_1, self.here_2)
        ]

    def show(self, motion: Motion, palette: Palette) -> None:
        """Show the samples of a motion."""
        places, speeds = motion.states[:, ::2], motion.states[:, 1::2]
        parts.fit(self.figure.x_range, float(places.min()), float(places.max()))
        parts.fit(self.figure.y_range, float(speeds.min()), float(speeds.max()))
        self.paint(palette)

    def paint(self, palette: Palette) -> None:
        """Use the colours of a palette."""
        colors = (palette.first, palette.second)
        for line, dot, color in zip(self._lines, self._dots, colors, strict=True):
            line.glyph.line_color = dot.glyph.fill_color = color
            dot.glyph.line_color = palette.card
        key = [(palette.first, "body 1"), (palette.second, "body 2")]
        self.heading.text = parts.heading("Phase portrait", key)
