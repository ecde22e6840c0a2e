"""The stops of a structure in rows: how far each is from its contact.

A row is a stop: a block at its distance -g from a wall. Each row has a scale of its own, since rows
of stops may have other units; the number beside it is the largest distance that is shown. Where
there are more stops than rows, those that are struck most are drawn.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from .._core import Regime
from ..stop import row_words
from ..structure import Structure
from ..structure_run import StructureRun
from . import parts
from .structure_history import Mode, closed_spans
from .style import REGIME_STYLES, STOPS

Array = NDArray[np.float64]

MOST_ROWS: Final = 8
"""The largest number of rows."""

# Sizes beside a row of height 1, whose wall is at 1; a track begins at 0.
_WIDE, _TALL, _WALL, _WALL_TALL = 0.16, 0.4, 0.05, 0.6
# Heights that are seen at least: a single row is not a poster.
_LEAST = 3.4
_WORDS = {"closed": "closed", "slide": "slides", "stick": "sticks"}


def distances(structure: Structure, time: Array, places: Array) -> Array:
    """Return the distance -g of each stop from its contact, (k, stops), at least 0.

    At times (k,) the coordinates are ``places``, (k, N).
    """
    columns = [
        stop.gap
        + stop.amplitude * np.cos(structure.drive_frequency * time + stop.phase)
        - places @ stop.normal
        for stop in structure.stops
    ]
    gaps: Array = np.array(columns).reshape(-1, len(time)).T
    return np.maximum(gaps, 0.0)


def struck_most(run: StructureRun) -> list[int]:
    """Return the stops that have a row, in their order."""
    count = len(run.system.stops)
    struck = np.zeros(count, dtype=np.int64)
    if count and len(run.impacts):
        struck = np.bincount(run.impacts["stop"], minlength=count)
    return sorted(np.argsort(-struck, kind="stable")[:MOST_ROWS].tolist())


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
        self._stops = struck_most(run)
        gaps = distances(run.system, times, states[:, 0])[:, self._stops]
        self._largest = gaps.max(axis=0, initial=0.0)
        self._gaps = gaps / np.where(self._largest > 0.0, self._largest, 1.0)
        self._spans = closed_spans(run, (float(times[0]), float(times[-1])))
        self._impacts = run.impacts.view(np.ndarray)
        self.moving: parts.Drawn = []
        self._still()

    def _still(self) -> None:
        """Draw walls, tracks and names, and set the limits of the picture."""
        ax, count = self._ax, len(self._stops)
        ax.set_axis_off()
        for row, stop in enumerate(self._stops):
            ax.plot((-_WIDE, 1.0), (-row, -row), color=parts.BESIDE, lw=0.8, ls=":", zorder=0)
            corner = (1.0, -row - 0.5 * _WALL_TALL)
            look: dict[str, Any] = {"fc": "none", "ec": parts.FRAME, "hatch": "////", "lw": 0.0}
            ax.add_patch(Rectangle(corner, _WALL, _WALL_TALL, **look))
            ends = (corner[1], corner[1] + _WALL_TALL)
            ax.plot((1.0, 1.0), ends, color=parts.FRAME, lw=1.1)
            name = f"stop {stop}:  {row_words(self._run.system.stops[stop].normal)}"
            ax.text(-_WIDE, 0.27 - row, name, fontsize=8, va="bottom")
            reach = f"{self._largest[row]:.3g}"
            ax.text(-_WIDE - 0.02, -row, reach, color="0.4", fontsize=7, ha="right", va="center")
        more = len(self._run.system.stops) - count
        if more > 0:
            words = f"and {more} more, which are struck less"
            ax.text(-_WIDE, 0.3 - count, words, color="0.4", fontsize=8)
        middle, half = -0.5 * (count - 1), 0.5 * max(count + 0.8, _LEAST)
        ax.set_ylim(middle - half, middle + half)
        ax.set_xlim(-0.4, 1.1)

    def show(self, frame: int) -> str:
        """Draw a frame in place of the one before; return what happens in words."""
        for artist in self.moving:
            artist.remove()
        self.moving = []
        time = float(self._times[frame])
        modes = {each.stop: each.mode for each in self._spans if each.start <= time < each.end}
        for row, stop in enumerate(self._stops):
            color = STOPS[stop % len(STOPS)][0]
            left = 1.0 - float(self._gaps[frame, row]) - _WIDE
            fill = color if stop in modes else parts.BODY
            block = Rectangle(
                (left, -row - 0.5 * _TALL), _WIDE, _TALL, fc=fill, ec=color, lw=1.2, zorder=3
            )
            self.moving.append(self._ax.add_patch(block))
        return self._struck(time, modes) or _said(modes) or ("apart" if self._stops else "no stops")

    def _struck(self, time: float, modes: dict[int, Mode]) -> str:
        """Draw the last impact at each stop while it is seen; say which is the last of all."""
        impacts, said, last = self._impacts, "", -np.inf
        recent = impacts[(impacts["time"] > time - self._flash) & (impacts["time"] <= time)]
        for row, stop in enumerate(self._stops):
            here = recent[recent["stop"] == stop]
            if not len(here) or stop in modes:
                continue
            when, regime = float(here["time"][-1]), int(here["regime"][-1])
            style = REGIME_STYLES[regime]
            self.moving += self._ax.plot(
                1.0,
                -row,
                marker=style.marker,
                color=style.color,
                alpha=1.0 - 0.75 * (time - when) / self._flash,
                markersize=9.0,
                markeredgewidth=0.0,
                zorder=9,
            )
            if when >= last:
                how = "" if regime == Regime.FRICTIONLESS else f", {style.text}"
                said, last = f"impact on stop {stop}{how}", when
        return said


def _said(modes: dict[int, Mode]) -> str:
    """Return in words which stops are closed."""
    if len(modes) > 1:
        return f"stops {', '.join(map(str, sorted(modes)))} closed"
    return "".join(f"stop {stop} {_WORDS[mode]}" for stop, mode in modes.items())
