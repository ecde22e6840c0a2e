"""The stops of a structure, drawn and moving: a row for each coordinate on which stops act.

Rows, blocks and walls are those of the package's animation (`plot.stop_rows`): a block between the
walls that are its stops, in a scale of its own, whose ends stand beside it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, Label, Range1d
from numpy.typing import NDArray

from ...plot.stop_rows import BLOCK, MOST_ROWS, Places, places_of, rows_of, struck_most
from ...plot.style import BLACK, STOPS
from ...run import EventKind
from ...stop import row_words
from ..machine import Machine, Motion
from ..theme import Palette
from . import parts
from .columns import Sources
from .drawing import FADE, Array, Drawing, small

# Columns of the film: of a row its block, of a wall its place, and what is seen at it.
_BLOCK, _PLACE, _STRIKE, _COLOR = "d", "w", "s", "k"
# Width of a wall, beside a row whose scale is 1.
_WALL = 0.05
# Heights of a block and a wall, beside a row of height 1, and the size of text: of more rows than
# these text needs a larger part.
_FEW_ROWS = 4
_FEW, _MANY = (0.5, 0.7, "11px"), (0.36, 0.46, "9px")
_HALF = 0.5 * BLOCK
_LEFT, _RIGHT = -0.45, 1.45
# What a wall shows: nothing, a stretch of contact, or so much of an impact.
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
  const left = [], right = [], alpha = []
  for (let k = 0; k < blocks.tags[0]; k++) {
    const d = f["d" + k][i]
    left.push(d - half)
    right.push(d + half)
    alpha.push(0.3)
  }
  const x = [], face = [], size = [], fade = [], color = []
  for (let k = 0; k < walls.tags.length; k++) {
    const [row, side] = walls.tags[k], s = f["s" + k][i]
    face.push(f["w" + k][i] + side * half)
    x.push(face[k] + side * thick)
    if (s == closed) alpha[row] = 0.9
    const part = s == closed ? 0 : s / full
    size.push(part > 0 ? 8 + 30 * (1 - part) : 0)
    fade.push(part)
    color.push(playing.tags[f["k" + k][i]])
  }
  put(blocks, {left, right, alpha})
  put(walls, {x, face})
  put(rings, {x: face, size, alpha: fade, color})
  const text = f.which[i] < 0 ? "" : `stop ${f.which[i]}: ${words[f.says[i]]}`
  if (says.text != text) says.text = text
"""


class StopsView(Drawing):
    """The drawing of the stops."""

    script = _DRAW

    def __init__(self, machine: Machine, sources: Sources) -> None:
        super().__init__(machine, sources)
        self._all = len(rows_of(machine.system))
        count = min(self._all, MOST_ROWS)
        middles = [-float(row) for row in range(count)]
        self._tall, self._wall_tall, self._size = _FEW if count <= _FEW_ROWS else _MANY
        empty = {name: [""] * count for name in ("name", "low", "high")}
        tops = [y + 0.5 * self._tall for y in middles]
        self._rows = ColumnDataSource(data={"y": middles, "top": tops, **empty}, name="rows")
        self._blocks = ColumnDataSource(
            data={
                "left": [-_HALF] * count,
                "right": [_HALF] * count,
                "bottom": [y - 0.5 * self._tall for y in middles],
                "top": tops,
                "alpha": [0.3] * count,
            },
            name="blocks",
            tags=[0],
        )
        columns = ("x", "face", "y", "low", "high", "name", "color")
        self._walls = ColumnDataSource(data={name: [] for name in columns}, name="walls")
        rings = ("x", "y", "size", "alpha", "color")
        self._rings = ColumnDataSource(data={name: [] for name in rings})
        self._by_stop = machine.by_stop
        self._draw(count)

    def _draw(self, count: int) -> None:
        rows = max(count, 1)
        self.figure = parts.plain(
            "machine",
            x_range=Range1d(_LEFT, _RIGHT),
            y_range=Range1d(-rows - 0.1, max(0.75, 0.5 * (5.5 - rows))),
        )
        self.figure.axis.visible = False
        self.figure.grid.visible = False
        self._tracks = self.figure.segment(
            -_HALF, "y", 1.0 + _HALF, "y", source=self._rows, line_width=1.0, line_dash=[2, 3]
        )
        self._hatched = self.figure.rect(
            "x",
            "y",
            width=_WALL,
            height=self._wall_tall,
            source=self._walls,
            hatch_pattern="right_diagonal_line",
            line_color=None,
        )
        self.figure.segment(
            "face", "low", "face", "high", source=self._walls, line_color="color", line_width=2.5
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
        middle = {"text_baseline": "middle", "source": self._rows}
        self._ends = [
            self.figure.text(x, "y", text=name, text_align=align, **middle)
            for x, name, align in (
                (-_HALF - _WALL - 0.03, "low", "right"),
                (1.0 + _HALF + _WALL + 0.03, "high", "left"),
            )
        ]
        above: dict[str, Any] = {"text_baseline": "bottom", "text_align": "center", "y_offset": -1}
        self._names = [
            self.figure.text(0.5, "top", text="name", source=self._rows, **above),
            self.figure.text("x", "high", text="name", source=self._walls, **above),
        ]
        for text in (*self._ends, *self._names):
            text.glyph.text_font_size = self._size
        self.says = Label(x=8, y=4, x_units="screen", y_units="screen", text="", name="says")
        self.says.text_font_size = "13px"
        self.figure.add_layout(self.says)

    def models(self) -> dict[str, Any]:
        """Return what moves, and what is said."""
        return {
            "blocks": self._blocks,
            "walls": self._walls,
            "rings": self._rings,
            "says": self.says,
            "words": _WORDS,
            "half": _HALF,
            "thick": 0.5 * _WALL,
            "closed": _CLOSED,
            "full": _FULL,
        }

    def show(self, motion: Motion, palette: Palette) -> None:
        """Draw the stops of a motion, and give the page its film."""
        structure, q = motion.machine.system, motion.states[:, 0]
        rows = [places_of(structure, row, motion.time, q) for row in struck_most(motion.run)]
        strikes = _Strikes(motion)
        film: dict[str, Any] = small({f"{_BLOCK}{y}": row.block for y, row in enumerate(rows)})
        walls = _walls_of(rows)
        for k, (y, j, stop, _) in enumerate(walls):
            film |= small({f"{_PLACE}{k}": rows[y].walls[:, j]})
            film[f"{_STRIKE}{k}"] = strikes.seen[:, stop]
            film[f"{_COLOR}{k}"] = strikes.kinds[:, stop]
        ends = [row.ends for row in rows]
        self._rows.data = {
            **self._rows.data,
            "name": [row_words(row.row.normal) for row in rows],
            "low": [low for low, _ in ends],
            "high": [high for _, high in ends],
        }
        faces = [float(rows[y].walls[0, j]) + side * _HALF for y, j, _, side in walls]
        heights = [-float(y) for y, _, _, _ in walls]
        self._walls.data = {
            "x": [face + 0.5 * side * _WALL for face, (*_, side) in zip(faces, walls, strict=True)],
            "face": faces,
            "y": heights,
            "low": [y - 0.5 * self._wall_tall for y in heights],
            "high": [y + 0.5 * self._wall_tall for y in heights],
            "name": [f"stop {stop}" for _, _, stop, _ in walls],
            "color": [STOPS[stop % len(STOPS)][0] for _, _, stop, _ in walls],
        }
        if len(self._rings.data["x"]) != len(walls):
            size = len(walls)
            none = {"size": [0.0] * size, "alpha": [0.0] * size, "color": [BLACK] * size}
            self._rings.data = {"x": faces, "y": heights, **none}
        # The player asks for the rows, and for row and side of each wall.
        self._blocks.tags = [len(rows)]
        self._walls.tags = [[y, side] for y, _, _, side in walls]
        self.paint(palette)
        self.film.data = motion.samples | film | {"which": strikes.which, "says": strikes.says}

    def paint(self, palette: Palette) -> None:
        """Use the colours of a palette."""
        self._tracks.glyph.line_color = palette.muted
        self._hatched.glyph.fill_color = palette.line
        self._hatched.glyph.hatch_color = palette.muted
        self._block.glyph.line_color = self._block.glyph.fill_color = palette.first
        for text in self._names:
            text.glyph.text_color = palette.ink
        for text in self._ends:
            text.glyph.text_color = palette.muted
        self.playing.tags = palette.kinds(stops=self._by_stop)
        few = (
            f": the {MOST_ROWS} of {self._all} that are struck most"
            if self._all > MOST_ROWS
            else ""
        )
        hint = '<span class="key">numbers: the ends of each scale</span>' if self._all else ""
        self.heading.text = parts.heading(f"Between the stops{few}") + hint


def _walls_of(rows: list[Places]) -> list[tuple[int, int, int, int]]:
    """Return row, place in it, stop and side, 1 at the right or -1, of each wall."""
    return [
        (y, j, stop, 1 if shown.row.factors[j] > 0.0 else -1)
        for y, shown in enumerate(rows)
        for j, stop in enumerate(shown.row.stops)
    ]


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
