"""The stops of a structure, drawn and moving: how far each is from its contact.

A row is a stop: a block at its distance -g from a wall. Each row has a scale of its own, since rows
may have other units; the number beside it is the largest distance of the film. Where there are more
stops than rows, those that are struck most are drawn.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, Label, Range1d
from numpy.typing import NDArray

from ...plot.stop_rows import MOST_ROWS, distances, struck_most
from ...plot.style import BLACK, REGIME_STYLES
from ...run import EventKind
from ...stop import row_words
from ..machine import Machine, Motion
from ..theme import Palette
from . import parts
from .columns import Sources
from .drawing import FADE, Array, Drawing, small

# Columns of a row in the film: distance, and what is seen at the wall.
_DISTANCE, _STRIKE, _COLOR = "d", "s", "k"
# Width and height of a block, beside a row of height 1 whose wall is at 1; its track begins at 0.
_WIDE, _TALL, _WALL = 0.16, 0.5, 0.05
_LEFT, _RIGHT = -1.0, 1.0 + 2.5 * _WALL
# What a row shows at the wall: nothing, a stretch of contact, or so much of an impact.
_CLOSED, _FULL = 255, 200
# What is said of a frame: nothing, contact, the regime of an impact.
_FIRST_REGIME = 4
_WORDS = (
    "",
    "closed",
    "closed, slides",
    "closed, sticks",
    "impact",
    "impact, slip",
    "impact, slip reverses in approach",
    "impact, slip reverses in restitution",
    "impact, sticks in approach",
    "impact, sticks in restitution",
)
_CONTACT = {EventKind.SLIDE_POSITIVE: 2, EventKind.SLIDE_NEGATIVE: 2, EventKind.STICK: 3}
_DRAW = """
  const left = [], right = [], alpha = [], y = [], size = [], fade = [], color = []
  for (let k = 0; k < rows.tags.length; k++) {
    const d = f["d" + k][i], s = f["s" + k][i]
    left.push(1 - d - wide)
    right.push(1 - d)
    alpha.push(s == closed ? 0.9 : 0.3)
    const part = s == closed ? 0 : s / full
    size.push(part > 0 ? 8 + 30 * (1 - part) : 0)
    fade.push(part)
    color.push(playing.tags[f["k" + k][i]])
  }
  put(blocks, {left, right, alpha})
  put(rings, {size, alpha: fade, color})
  const text = f.which[i] < 0 ? "" : `stop ${f.which[i]}: ${words[f.says[i]]}`
  if (says.text != text) says.text = text
"""


class StopsView(Drawing):
    """The drawing of the stops."""

    script = _DRAW

    def __init__(self, machine: Machine, sources: Sources) -> None:
        super().__init__(machine, sources)
        count = min(len(machine.system.stops), MOST_ROWS)
        middles = [-float(row) for row in range(count)]
        self._rows = ColumnDataSource(
            data={
                "y": middles,
                "name": [""] * count,
                "reach": [""] * count,
                "x": [1.0 + 0.5 * _WALL] * count,
            },
            name="rows",
        )
        self._blocks = ColumnDataSource(
            data={
                "left": [0.0] * count,
                "right": [_WIDE] * count,
                "bottom": [y - 0.5 * _TALL for y in middles],
                "top": [y + 0.5 * _TALL for y in middles],
                "alpha": [0.3] * count,
            },
            name="blocks",
        )
        self._rings = ColumnDataSource(
            data={
                "x": [1.0] * count,
                "y": middles,
                "size": [0.0] * count,
                "alpha": [0.0] * count,
                "color": [BLACK] * count,
            }
        )
        self._draw(machine, count)

    def _draw(self, machine: Machine, count: int) -> None:
        rows = max(count, 1)
        self.figure = parts.plain(
            "machine",
            x_range=Range1d(_LEFT, _RIGHT),
            y_range=Range1d(-rows - 0.1, max(0.75, 0.5 * (5.5 - rows))),
        )
        self.figure.axis.visible = False
        self.figure.grid.visible = False
        self._tracks = self.figure.segment(
            -_WIDE, "y", 1.0, "y", source=self._rows, line_width=1.0, line_dash=[2, 3]
        )
        self._walls = self.figure.rect(
            "x",
            "y",
            width=_WALL,
            height=0.8,
            source=self._rows,
            hatch_pattern="right_diagonal_line",
            line_color=None,
        )
        self._block = self.figure.quad(
            "left",
            "right",
            "top",
            "bottom",
            source=self._blocks,
            fill_alpha="alpha",
            line_width=1.5,
        )
        self._wave = self.figure.scatter(
            *("x", "y"),
            size="size",
            source=self._rings,
            line_color="color",
            line_width=3,
            fill_color=None,
        )
        self._wave.glyph.line_alpha = "alpha"
        self._names = self.figure.text(
            x=_LEFT, y="y", text="name", source=self._rows, text_baseline="middle"
        )
        self._names.glyph.text_font_size = "12px"
        self._reach = self.figure.text(
            *(-_WIDE - 0.03, "y"),
            text="reach",
            source=self._rows,
            text_align="right",
            text_baseline="middle",
        )
        self._reach.glyph.text_font_size = "11px"
        self.says = Label(x=8, y=4, x_units="screen", y_units="screen", text="", name="says")
        self.says.text_font_size = "13px"
        self.figure.add_layout(self.says)
        self._all = len(machine.system.stops)

    def models(self) -> dict[str, Any]:
        """Return what moves, and what is said."""
        return {
            "rows": self._rows,
            "blocks": self._blocks,
            "rings": self._rings,
            "says": self.says,
            "words": _WORDS,
            "wide": _WIDE,
            "closed": _CLOSED,
            "full": _FULL,
        }

    def show(self, motion: Motion, palette: Palette) -> None:
        """Draw the stops of a motion, and give the page its film."""
        stops = motion.machine.system.stops
        drawn = struck_most(motion.run)
        film: dict[str, Any] = {}
        reach = []
        gaps = distances(motion.machine.system, motion.time, motion.states[:, 0])
        strikes = _Strikes(motion)
        for row, stop in enumerate(drawn):
            largest = float(gaps[:, stop].max()) or 1.0
            reach.append(f"{largest:.3g}")
            film |= small({f"{_DISTANCE}{row}": gaps[:, stop] / largest})
            film |= {
                f"{_STRIKE}{row}": strikes.seen[:, stop],
                f"{_COLOR}{row}": strikes.kinds[:, stop],
            }
        names = [f"stop {stop}:  {row_words(stops[stop].normal)}" for stop in drawn]
        self._rows.data = {**self._rows.data, "name": names, "reach": reach}
        # The player asks for the number of rows.
        self._rows.tags = drawn
        self.paint(palette)
        self.film.data = motion.samples | film | {"which": strikes.which, "says": strikes.says}

    def paint(self, palette: Palette) -> None:
        """Use the colours of a palette."""
        self._tracks.glyph.line_color = palette.muted
        self._walls.glyph.fill_color = palette.line
        self._walls.glyph.hatch_color = palette.muted
        self._block.glyph.line_color = self._block.glyph.fill_color = palette.first
        self._names.glyph.text_color = palette.ink
        self._reach.glyph.text_color = palette.muted
        self.playing.tags = [palette.regime(each) for each in REGIME_STYLES]
        few = (
            f": the {MOST_ROWS} of {self._all} that are struck most"
            if self._all > MOST_ROWS
            else ""
        )
        words = f"Distance from the stops{few}"
        hint = '<span class="key">number: the largest</span>' if self._all else ""
        self.heading.text = parts.heading(words) + hint


class _Strikes:
    """What is seen at each stop in each frame: columns (frames, stops), and what is said.

    Attributes
    ----------
    seen
        0, how much of an impact is left, or that the stop is closed.
    kinds
        The colour of the last impact.
    which, says
        The stop of the last event that is seen, or -1, and its words.
    """

    def __init__(self, motion: Motion) -> None:
        time, stops = motion.time, motion.machine.system.stops
        shape = (len(time), len(stops))
        self.seen = np.zeros(shape, dtype=np.uint8)
        self.kinds = np.zeros(shape, dtype=np.uint8)
        self.which = np.full(len(time), -1, dtype=np.int16)
        self.says = np.zeros(len(time), dtype=np.uint8)
        last = np.full(len(time), -np.inf)
        for stop in range(len(stops)):
            self._contacts(motion, stop, last)
        for stop in range(len(stops)):
            self._impacts(motion, stop, last)

    def _contacts(self, motion: Motion, stop: int, last: Array) -> None:
        assert motion.forces is not None
        closed = motion.forces[:, stop, 0] > 0.0
        if not closed.any():
            return
        self.seen[closed, stop] = _CLOSED
        events = motion.run.contacts
        own = events["stop"] == stop
        begun, codes = events["time"][own], [_CONTACT.get(kind, 1) for kind in events["kind"][own]]
        place = np.searchsorted(begun, motion.time, side="right")
        self._say(closed, stop, np.append(-np.inf, begun)[place], np.append(1, codes)[place], last)

    def _impacts(self, motion: Motion, stop: int, last: Array) -> None:
        time = motion.time
        step = float(time[-1] - time[0]) / max(len(time) - 1, 1)
        impacts = motion.run.impacts.view(np.ndarray)
        impacts = impacts[(impacts["stop"] == stop) & (impacts["time"] >= time[0])]
        if not len(impacts) or step <= 0.0:
            return
        which = np.searchsorted(impacts["time"], time, side="right") - 1
        age = (time - impacts["time"][which]) / step
        seen = (which >= 0) & (age < FADE) & (self.seen[:, stop] != _CLOSED)
        left = _FULL * (1.0 - age[seen] / FADE)
        self.seen[seen, stop] = np.maximum(left, 1.0).astype(np.uint8)
        self.kinds[seen, stop] = motion.machine.kinds(impacts)[which[seen]]
        codes = _FIRST_REGIME + impacts["regime"][which].astype(np.int64)
        self._say(seen, stop, impacts["time"][which], codes, last)

    def _say(
        self, seen: NDArray[np.bool_], stop: int, begun: Array, codes: Any, last: Array
    ) -> None:
        """Say what has begun last."""
        newer = seen & (begun >= last)
        self.which[newer] = stop
        self.says[newer] = np.asarray(codes)[newer]
        last[newer] = begun[newer]
