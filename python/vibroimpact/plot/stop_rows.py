"""The stops of a structure in rows: where what they hold is between them.

A row is a coordinate, or another row n of the structure, with all stops whose normals are multiples
of it: a block at s = n . q, and a wall for each stop. Where there are more rows than fit, those are
drawn whose stops are struck most.

    contact with stop j:  s = w_j,  w_j = (gap_j + A_j cos(omega t + phase_j)) / c_j,  n_j = c_j n

Each row has a scale of its own, since rows may have other units: from the least to the largest of s
and w_j that are shown. The numbers beside it are these two.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from .._core import Regime
from ..stop import row_words
from ..structure import Structure
from ..structure_run import StructureRun
from . import parts
from .coordinates import multiple_of
from .structure_history import Mode, closed_spans
from .style import REGIME_STYLES, STOPS

Array = NDArray[np.float64]

MOST_ROWS: Final = 8
"""The largest number of rows."""
BLOCK: Final = 0.16
"""Width of a block, beside a row whose scale is 1."""

# Sizes beside a row of height 1.
_TALL, _WALL, _WALL_TALL = 0.4, 0.05, 0.6
# Heights that are seen at least: a single row is not a poster.
_LEAST = 3.4
_WORDS = {"closed": "closed", "slide": "slides", "stick": "sticks"}


class Said(NamedTuple):
    """What happens in a frame: in words, when if not at the time of the frame, and how."""

    what: str
    when: float | None = None
    how: str = ""

    @property
    def text(self) -> str:
        """All of it in one line."""
        # An event is seen for a while: it keeps its own time.
        at = "" if self.when is None else f" at {self.when:.2f}"
        return f"{self.what}{at}{self.how and ', '}{self.how}"


class Row(NamedTuple):
    """A row of the structure with its stops.

    Attributes
    ----------
    normal
        n, (N,), whose first entry other than 0 is 1.
    stops
        Numbers of the stops.
    factors
        c of each: > 0 where it is met as s grows, at the right.
    """

    normal: Array
    stops: tuple[int, ...]
    factors: tuple[float, ...]


class Places(NamedTuple):
    """Where the block of a row is, and its walls, in the scale of the row, 0 to 1.

    Attributes
    ----------
    row
        The row, with the stops that are shown.
    block
        (k,), at k times.
    walls
        (k, stops); without gaps, block and wall are at one place.
    low, high
        What 0 and 1 are.
    """

    row: Row
    block: Array
    walls: Array
    low: float
    high: float

    @property
    def ends(self) -> tuple[str, str]:
        """Both ends of the scale in words; one of a block that stays at its wall."""
        low, high = (f"{end:.3g}".replace("-", "\N{MINUS SIGN}") for end in (self.low, self.high))
        if self.low < self.high:
            return low, high
        return ("", high) if self.row.factors[0] > 0.0 else (low, "")


def rows_of(structure: Structure) -> list[Row]:
    """Return the rows of a structure on which stops act, in the order of their stops."""
    rows: list[Row] = []
    for number, stop in enumerate(structure.stops):
        factor = float(stop.normal[np.flatnonzero(stop.normal)[0]])
        normal = stop.normal / factor
        for place, row in enumerate(rows):
            if multiple_of(row.normal, stop.normal):
                rows[place] = Row(row.normal, (*row.stops, number), (*row.factors, factor))
                break
        else:
            rows.append(Row(normal, (number,), (factor,)))
    return rows


def struck_most(run: StructureRun) -> list[Row]:
    """Return the rows that are shown, in their order."""
    rows, count = rows_of(run.system), len(run.system.stops)
    struck = np.zeros(count, dtype=np.int64)
    if count and len(run.impacts):
        struck = np.bincount(run.impacts["stop"], minlength=count)
    order = np.argsort([-struck[[*row.stops]].sum() for row in rows], kind="stable")
    return [rows[place] for place in sorted(order[:MOST_ROWS].tolist())]


def places_of(structure: Structure, row: Row, time: Array, places: Array) -> Places:
    """Return what a row shows at times (k,), at which the coordinates are ``places``, (k, N).

    A wall that is so far away that it would hide the motion is left out, but for the nearest one.
    """
    s = places @ row.normal
    levels = []
    for number, factor in zip(row.stops, row.factors, strict=True):
        stop = structure.stops[number]
        phase = structure.drive_frequency * time + stop.phase
        levels.append((stop.gap + stop.amplitude * np.cos(phase)) / factor)
        # Rounding does not let a block into a wall.
        s = np.minimum(s, levels[-1]) if factor > 0.0 else np.maximum(s, levels[-1])
    away = [float(np.abs(level - s).min()) for level in levels]
    nearest = int(np.argmin(away))
    reach = float(np.ptp(np.append(s, levels[nearest])))
    kept = [j for j in range(len(levels)) if j == nearest or away[j] <= reach]
    walls = np.column_stack([levels[j] for j in kept])
    low, high = float(min(s.min(), walls.min())), float(max(s.max(), walls.max()))
    stops, factors = tuple(row.stops[j] for j in kept), tuple(row.factors[j] for j in kept)
    size = high - low or 1.0
    # What does not move at all stays at the end where its wall is.
    first = low - size if low == high and factors[0] > 0.0 else low
    shown = Row(row.normal, stops, factors)
    return Places(shown, (s - first) / size, (walls - first) / size, low, high)


class StopRows:
    """The stops of a run on axes: what stands still is drawn once, the rest for every frame.

    Parameters
    ----------
    ax
        Where to draw.
    run
        The run.
    times
        Times of the frames.
    states
        At these times, (k, 2, N).
    flash
        For so long impacts are seen.
    """

    def __init__(self, ax: Axes, run: StructureRun, times: Array, states: Array, flash: float):
        self._ax, self._run, self._times, self._flash = ax, run, times, flash
        self._all = len(rows_of(run.system))
        q = states[:, 0]
        self._rows = [places_of(run.system, row, times, q) for row in struck_most(run)]
        self._spans = closed_spans(run, (float(times[0]), float(times[-1])))
        self._impacts = run.impacts.view(np.ndarray)
        self.moving: parts.Drawn = []
        self._still()

    def _still(self) -> None:
        """Draw tracks, names and walls that stand still, and set the limits of the picture."""
        ax, count = self._ax, len(self._rows)
        half, outside = 0.5 * BLOCK, 0.5 * BLOCK + _WALL
        ax.set_axis_off()
        for y, shown in enumerate(self._rows):
            track = (-half, 1.0 + half)
            ax.plot(track, (-y, -y), color=parts.BESIDE, lw=0.8, ls=":", zorder=0)
            name = row_words(shown.row.normal)
            ax.text(0.5, 0.32 - y, name, fontsize=8, va="bottom", ha="center")
            small: dict[str, Any] = {"fontsize": 7, "color": "0.4", "va": "center"}
            low, high = shown.ends
            ax.text(-outside - 0.03, -y, low, ha="right", **small)
            ax.text(1.0 + outside + 0.03, -y, high, ha="left", **small)
            for j in range(len(shown.row.stops)):
                if np.ptp(shown.walls[:, j]) == 0.0:
                    self._wall(y, j, 0)
        more = self._all - count
        words = [f"and {more} more, which are struck less"] if more > 0 else []
        words += ["marks on walls: impacts"] if len(self._impacts) else []
        ax.text(-half, 0.3 - count, "; ".join(words), color="0.4", fontsize=8)
        middle, tall = -0.5 * (count - 1), 0.5 * max(count + 0.8, _LEAST)
        ax.set_ylim(middle - tall, middle + tall)
        ax.set_xlim(-0.42, 1.42)

    def _wall(self, y: int, j: int, frame: int) -> parts.Drawn:
        """Draw a wall, hatched on its outside, with the number of its stop."""
        shown = self._rows[y]
        stop, right = shown.row.stops[j], shown.row.factors[j] > 0.0
        color = STOPS[stop % len(STOPS)][0]
        face = float(shown.walls[frame, j]) + (0.5 if right else -0.5) * BLOCK
        bottom = -y - 0.5 * _WALL_TALL
        left = face if right else face - _WALL
        look: dict[str, Any] = {"fc": "none", "ec": parts.FRAME, "hatch": "////", "lw": 0.0}
        wall = self._ax.add_patch(Rectangle((left, bottom), _WALL, _WALL_TALL, **look))
        line = self._ax.plot((face, face), (bottom, bottom + _WALL_TALL), color=color, lw=1.6)
        text = self._ax.text(
            face + (_WALL if right else -_WALL),
            0.32 - y,
            f"stop {stop}",
            color=color,
            fontsize=8,
            va="bottom",
            ha="right" if right else "left",
        )
        return [wall, *line, text]

    def show(self, frame: int) -> Said:
        """Draw a frame in place of the one before; return what happens."""
        for artist in self.moving:
            artist.remove()
        self.moving = []
        time = float(self._times[frame])
        modes = {each.stop: each.mode for each in self._spans if each.start <= time < each.end}
        for y, shown in enumerate(self._rows):
            for j in range(len(shown.row.stops)):
                if np.ptp(shown.walls[:, j]) > 0.0:
                    self.moving += self._wall(y, j, frame)
            closed = [stop for stop in shown.row.stops if stop in modes]
            fill = STOPS[closed[0] % len(STOPS)][0] if closed else parts.BODY
            corner = (float(shown.block[frame]) - 0.5 * BLOCK, -y - 0.5 * _TALL)
            look: dict[str, Any] = {"fc": fill, "ec": parts.FRAME, "lw": 1.2, "zorder": 3}
            self.moving.append(self._ax.add_patch(Rectangle(corner, BLOCK, _TALL, **look)))
        struck = self._struck(frame, modes)
        return struck or Said(_said(modes) or ("apart" if self._rows else "no stops"))

    def _struck(self, frame: int, modes: dict[int, Mode]) -> Said | None:
        """Draw the last impact at each stop while it is seen; say which is the last of all."""
        impacts, said, last = self._impacts, None, -np.inf
        time = float(self._times[frame])
        recent = impacts[(impacts["time"] > time - self._flash) & (impacts["time"] <= time)]
        for y, shown in enumerate(self._rows):
            for j, stop in enumerate(shown.row.stops):
                here = recent[recent["stop"] == stop]
                if not len(here) or stop in modes:
                    continue
                when, regime = float(here["time"][-1]), int(here["regime"][-1])
                style = REGIME_STYLES[regime]
                side = 0.5 if shown.row.factors[j] > 0.0 else -0.5
                self.moving += self._ax.plot(
                    float(shown.walls[frame, j]) + side * BLOCK,
                    -y,
                    marker=style.marker,
                    color=style.color,
                    alpha=1.0 - 0.75 * (time - when) / self._flash,
                    markersize=9.0,
                    markeredgewidth=0.0,
                    zorder=9,
                )
                if when >= last:
                    how = "" if regime == Regime.FRICTIONLESS else style.text
                    said, last = Said(f"impact on stop {stop}", when, how), when
        return said


def _said(modes: dict[int, Mode]) -> str:
    """Return in words which stops are closed."""
    if len(modes) > 1:
        return f"stops {', '.join(map(str, sorted(modes)))} closed"
    return "".join(f"stop {stop} {_WORDS[mode]}" for stop, mode in modes.items())
