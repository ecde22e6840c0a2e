"""The bifurcation diagram, with the motion of the page marked, and the branch of that motion."""

from __future__ import annotations

import html
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from bokeh.models import (
    BasicTicker,
    ColumnDataSource,
    CustomJS,
    FixedTicker,
    Range1d,
    Span,
)
from numpy.typing import NDArray

from ...orbits import Branch, PeriodicMotion, Piece
from ...plot.style import BIFURCATION_STYLES, REGIME_STYLES
from ..machine import Machine
from ..state import State
from ..theme import Palette
from . import parts

Array = NDArray[np.float64]

# The mark of each kind of bifurcation, as in the package's figures: for Bokeh, and in a text.
_MARKERS = {
    "saddle_node": ("circle", "○"),
    "period_doubling": ("triangle", "△"),
    "neimark_sacker": ("star", "☆"),
    "neutral_saddle": ("y", "Y"),
    "branch_point": ("plus", "✛"),
    "grazing": ("square", "□"),
    "regime_border": ("diamond", "◇"),
    "chatter_onset": ("x", "✕"),
    "contact_border": ("inverted_triangle", "▽"),
}
_PHASES = {0.0: "0", math.pi: "π", math.tau: "2π"}


# Kinds of points: the regimes, and sections, which have none.
_SECTION = len(REGIME_STYLES)
_NOTHING: dict[str, list[float]] = {"at": [], "value": [], "kind": []}
# The browser draws the points of a kind as one line of short dashes. A marker for each point takes
# it ten times as long. What it changes in place is not sent back.
_DASHES = """
const {at, value, kind} = points.data
const length = 2e-4 * (range.end - range.start)
const counts = lines.map(() => 0)
for (const each of kind) counts[each]++
const xs = counts.map((count) => new Float64Array(3 * count))
const ys = counts.map((count) => new Float64Array(3 * count))
const next = lines.map(() => 0)
for (let k = 0; k < kind.length; k++) {
  const x = xs[kind[k]], y = ys[kind[k]], n = next[kind[k]]
  x[n] = at[k]
  x[n + 1] = at[k] + length
  x[n + 2] = y[n + 2] = NaN
  y[n] = y[n + 1] = value[k]
  next[kind[k]] += 3
}
lines.forEach((line, which) => {
  if (counts[which] == 0 && line.data.x.length == 0) return
  line.data.x = xs[which]
  line.data.y = ys[which]
  line.change.emit()
})
"""


class DiagramView:
    """The diagram of a state; a click chooses a column, a box a range."""

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self.source = ColumnDataSource(data=dict(_NOTHING), name="diagram")
        empty: dict[str, list[float]] = {"xs": [], "ys": []}
        self.stable = ColumnDataSource(data=empty, name="stable")
        self.unstable = ColumnDataSource(data=empty, name="unstable")
        self.marks = ColumnDataSource(data={"at": [], "value": [], "marker": []}, name="marks")
        # One text for the regimes and one for the branch.
        self.key = parts.text(name="diagram-key", sizing_mode="stretch_width")
        self._keys = {"regimes": "", "branch": ""}
        self.figure = parts.zoomable(
            "diagram", x_range=Range1d(0.0, 1.0), y_range=Range1d(0.0, 1.0), min_height=200
        )
        # Or a line might lose its points while ranges change.
        self.figure.lod_threshold = None
        dashes = [ColumnDataSource(data={"x": [], "y": []}) for _ in range(_SECTION + 1)]
        self._points = [
            self.figure.line("x", "y", source=each, line_width=1.6, line_cap="square")
            for each in dashes
        ]
        own = {"points": self.source, "lines": dashes, "range": self.figure.x_range}
        self.drawing = CustomJS(args=own, code=_DASHES)
        self.source.js_on_change("data", self.drawing)
        # What no glyph draws is sent if a figure has it.
        self.figure.tags = [self.source]
        self._lines = [
            self.figure.multi_line("xs", "ys", source=self.stable, line_width=2.2),
            self.figure.multi_line(
                "xs", "ys", source=self.unstable, line_width=1.6, line_dash=[5, 3]
            ),
        ]
        self._dots = self.figure.scatter(
            "at", "value", source=self.marks, size=9, marker="marker", line_width=1.2
        )
        # On a layer of its own: the points are not drawn again when it moves.
        self.here = Span(
            dimension="height", location=0.0, line_width=1.2, name="here", level="overlay"
        )
        self.figure.add_layout(self.here)
        self.sign = parts.Sign(self.figure, "diagram")

    def frame(self, state: State) -> None:
        """Show the range of a state, with the value of its motion."""
        axis = state.vary
        self.figure.x_range.update(
            start=axis.low, end=axis.high, reset_start=axis.low, reset_end=axis.high
        )
        self.figure.xaxis.axis_label = self._machine.name_of(axis.name)
        self.figure.yaxis.axis_label = self._machine.value_label(state.value, state.shown)
        of_phase = isinstance(self.figure.yaxis[0].ticker, FixedTicker)
        if state.value == "phase" and not of_phase:
            self.figure.yaxis.ticker = FixedTicker(ticks=[*_PHASES])
            self.figure.yaxis.major_label_overrides = dict(_PHASES)
        elif state.value != "phase" and of_phase:
            self.figure.yaxis.ticker = BasicTicker()
            self.figure.yaxis.major_label_overrides = {}
        self.mark(state)

    def mark(self, state: State) -> None:
        """Mark the value of the motion on the page."""
        value = float(state.machine.numbers()[state.vary.name])
        # Of several that differ there is none.
        self.here.update(location=None if math.isnan(value) else value)

    def show(self, diagram: Any, state: State, palette: Palette) -> None:
        """Draw a diagram."""
        at, value, kind = self._machine.points(diagram, state.value, state.shown)
        present: list[int] = []
        if kind is None:
            kind = np.full(len(at), _SECTION, dtype=np.uint8)
        else:
            present = np.unique(kind).tolist()
        self.source.data = {"at": at, "value": value, "kind": kind}
        stopped = int(
            np.count_nonzero(~np.isin(diagram.status, ("completed", "restarted", "rest")))
        )
        colors = palette.kinds(stops=self._machine.by_stop)
        key = [(colors[each], self._machine.kind_words(each)) for each in present]
        more = f'<span class="key">{stopped} of {len(diagram.status)} runs stopped early</span>'
        none = "" if len(at) else '<span class="key">no impacts in the last drive periods</span>'
        self._say("regimes", parts.keys(key) + (more if stopped else "") + none)
        self.paint(palette)

    def fit(self, height: tuple[float, float] | None) -> None:
        """Show a range of values; None: all that are drawn."""
        shown = np.concatenate([np.asarray(self.source.data["value"]), [np.nan]])
        if height is None:
            some = np.isfinite(shown).any()
            low, high = (np.nanmin(shown), np.nanmax(shown)) if some else (0.0, 1.0)
            parts.fit(self.figure.y_range, float(low), float(high))
        else:
            self.figure.y_range.update(start=height[0], end=height[1])

    def clear(self) -> None:
        """Draw no diagram."""
        self.source.data = dict(_NOTHING)
        self._say("regimes", "")

    def expect_branch(self) -> None:
        """Say that a branch is computed, where none is drawn."""
        if not any(len(each) for each in self._branch_columns()):
            self._say("branch", _FOLLOWING)

    def show_branch(self, lines: BranchLines | None, palette: Palette) -> None:
        """Lay a branch over the diagram: stable solid, unstable dashed, bifurcations marked."""
        if lines is None and not any(len(each) for each in self._branch_columns()):
            self._say("branch", "")
            return
        none: dict[str, list[Array]] = {"xs": [], "ys": []}
        self.stable.data = dict(lines.stable) if lines else dict(none)
        self.unstable.data = dict(lines.unstable) if lines else dict(none)
        marks = lines.marks if lines else ()
        self.marks.data = {
            "at": [mark[0] for mark in marks],
            "value": [mark[1] for mark in marks],
            "marker": [_MARKERS[mark[2]][0] for mark in marks],
        }
        self._say("branch", _branch_key(lines) if lines else "")
        self.paint(palette)

    def _say(self, part: str, text: str) -> None:
        """Write a part of the key."""
        self._keys[part] = text
        self.key.text = " ".join(filter(None, self._keys.values()))

    def _branch_columns(self) -> tuple[Any, ...]:
        return self.stable.data["xs"], self.unstable.data["xs"], self.marks.data["at"]

    def paint(self, palette: Palette) -> None:
        """Use the colours of a palette."""
        colors = palette.kinds(stops=self._machine.by_stop)
        for kind, dashes in enumerate(self._points):
            color = palette.ink if kind == _SECTION else colors[kind]
            dashes.glyph.line_color = color
        self.here.line_color = palette.mark
        for line in self._lines:
            line.glyph.line_color = palette.mark
        self._dots.glyph.line_color = palette.ink
        self._dots.glyph.fill_color = palette.card


@dataclass(frozen=True, eq=False)
class BranchLines:
    """What is drawn of a branch: lines over the parameter, and bifurcations.

    Attributes
    ----------
    stable, unstable
        Columns ``xs`` and ``ys``: a pair of arrays for each line, NaN where it has a gap.
    marks
        Value of the parameter, what is drawn there, and the kind of each bifurcation.
    """

    stable: dict[str, list[Array]]
    unstable: dict[str, list[Array]]
    marks: tuple[tuple[float, float, str], ...]


def branch_lines(branch: Branch, value: str) -> BranchLines:
    """Return what is drawn of a branch in a diagram of a value."""
    lines: dict[bool, dict[str, list[Array]]] = {
        True: {"xs": [], "ys": []},
        False: {"xs": [], "ys": []},
    }
    for piece in branch.pieces:
        for column in heights(piece, value).T:
            for stable in (True, False):
                chosen = _with_neighbours(piece.stable == stable)
                if chosen.any():
                    lines[stable]["xs"].append(piece.values)
                    lines[stable]["ys"].append(np.where(chosen, column, np.nan))
    marks = tuple(
        (found.value, float(height), found.kind)
        for found in branch.bifurcations
        if found.kind in _MARKERS
        for height in _motion_heights(found.motion, value)
    )
    return BranchLines(lines[True], lines[False], marks)


_FOLLOWING = '<span class="key">following the motion …</span>'


def _branch_key(lines: BranchLines) -> str:
    """Return what the lines of a branch and its marks mean; a colour would be that of a regime.

    The colours are variables of the page, which it may change without a new key.
    """
    style = "color:var(--mark);font-weight:700"
    drawn = [("━", "stable", lines.stable), ("╍", "unstable", lines.unstable)]
    signs = [(style, sign, words) for sign, words, columns in drawn if columns["xs"]]
    kinds = {mark[2] for mark in lines.marks}
    signs += [
        ("color:var(--ink)", _MARKERS[kind][1], style.text)
        for kind, style in BIFURCATION_STYLES.items()
        if kind in kinds
    ]
    return "".join(
        f'<span class="key"><span style="{css}">{sign}</span> {html.escape(words)}</span>'
        for css, sign, words in signs
    )


def heights(piece: Piece, value: str) -> Array:
    """Return what the diagram draws of each motion of a piece, shape (motions, points)."""
    if value == "x1":
        return piece.impacts
    if value == "stroboscopic":
        return piece.sections
    rows = [_motion_heights(piece.motion(k), value) for k in range(len(piece.values))]
    width = min((len(row) for row in rows), default=0)
    return np.array([row[:width] for row in rows]).reshape(len(rows), width)


def _motion_heights(motion: PeriodicMotion, value: str) -> Array:
    if value == "stroboscopic":
        return motion.sections[:, 0]
    return np.asarray(motion.impacts[value])


def _with_neighbours(chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Add the point after each stretch, so that lines of both kinds meet."""
    wider = chosen.copy()
    wider[1:] |= chosen[:-1]
    return wider
