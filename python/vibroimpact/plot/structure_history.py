"""Time history of a run of a structure: coordinates, the stops that act on them, and impacts.

A stop whose normal is a multiple n = c e of what is drawn, e . q, is a line at which that meets it:

    e . q = (gap + A cos(omega t + phase))/c

Curves and bands are those of the other time histories; what belongs to a stop has its colour and
its mark. Source of the gap function: the page on structures.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Literal, NamedTuple, NoReturn

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from ..arguments import reject
from ..stop import Stop
from ..structure import Structure
from ..structure_run import StructureRun
from .axis_names import STATE_NAMES
from .coordinates import Combination, axis_of, multiple_of, named, single
from .curve import Curve, sample, times_within
from .given import regime_color
from .marks import ContactSpan, draw_bands, draw_regimes
from .style import BODY_COLORS, STOPS, curve_legend, new_axes

Array = NDArray[np.float64]
Mode = Literal["closed", "slide", "stick"]

# Coordinates that are drawn unasked, and the most that their lines tell apart.
_FEW, _MOST = 4, 8
_DASHES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (1, 1.5)), (0, (6, 1.5, 1, 1.5)))
# A stop so many heights of the motion away from it is left out: it would flatten the motion.
_AWAY = 1.0
# A velocity of slip below this part of the velocities in it is a stick.
_STUCK = 1e-9


class ClosedSpan(NamedTuple):
    """A stretch of time in which a stop is closed, in one mode."""

    stop: int
    start: float
    end: float
    mode: Mode


class Stretch(NamedTuple):
    """A stretch of a motion of a structure, as it is drawn.

    Attributes
    ----------
    structure
        The structure.
    curve
        Samples of the motion.
    hits
        Its impacts, a table as that of runs.
    spans
        When which stop is closed.
    """

    structure: Structure
    curve: Curve
    hits: NDArray[np.void]
    spans: list[ClosedSpan]

    @classmethod
    def of_run(cls, run: StructureRun, curve: Curve) -> Stretch:
        """Return that of samples of a run."""
        window = float(curve.time[0]), float(curve.time[-1])
        hits: NDArray[np.void] = run.impacts[curve.impacts]
        return cls(run.system, curve, hits, closed_spans(run, window))

    def hits_on(self, coordinate: Combination) -> NDArray[np.void]:
        """Return the impacts at stops that act on a coordinate."""
        acts = [coordinate.met_by(stop.normal) for stop in self.structure.stops]
        struck: NDArray[np.void] = self.hits[np.array(acts, dtype=bool)[self.hits["stop"]]]
        return struck


def structure_history(
    run: StructureRun,
    *,
    coordinates: Any,
    window: tuple[float, float] | None,
    periods: float | None,
    points_per_period: int | None,
    color: Any,
    legend: bool,
    ax: Axes | None,
) -> Axes:
    """Draw coordinates of a structure against time; the arguments are those of `time_history`."""
    by_regime = regime_color(color)
    shown = shown_coordinates(coordinates, run.system)
    curve = sample(run, window=window, periods=periods, points_per_period=points_per_period)
    ax = new_axes(ax)
    draw_history(ax, Stretch.of_run(run, curve), shown, by_regime=by_regime)
    curve_legend(ax, legend)
    return ax


def draw_history(
    ax: Axes, stretch: Stretch, shown: tuple[Combination, ...], *, by_regime: bool = False
) -> None:
    """Draw some coordinates of a motion against time, with stops and impacts."""
    curve, spans = stretch.curve, stretch.spans
    draw_bands(ax, bands_of(spans))
    for place, i in enumerate(shown):
        style = coordinate_style(place)
        ax.plot(curve.time, i.of(curve.state[:, 0]), label=f"${i.symbol('q')}$", **style)
    moved = np.column_stack([i.of(curve.state[:, 0]) for i in shown])
    for number, stop in enumerate(stretch.structure.stops):
        _draw_line(ax, number, stop, stretch.structure, curve, shown, moved)
        _draw_closed(ax, number, stop, curve, shown, spans)
    struck = [stretch.hits_on(i) for i in shown]
    heights = np.concatenate([i.of(rows["q"]) for rows, i in zip(struck, shown, strict=True)])
    hits = np.concatenate(struck)
    if by_regime:
        draw_regimes(ax, hits["regime"], hits["time"], heights)
    else:
        mark_stops(ax, hits["stop"], hits["time"], heights)
    ax.set_xlim(float(curve.time[0]), float(curve.time[-1]))
    ax.set_xlabel(STATE_NAMES["time"])
    ax.set_ylabel(axis_of(shown, "q"))


def coordinate_style(place: int) -> dict[str, Any]:
    """Return how the coordinate at this place among those shown is drawn."""
    return {
        "color": BODY_COLORS[1 + place % 2],
        "lw": (0.8, 1.5)[place % 2],
        "ls": _DASHES[place // 2],
    }


def shown_coordinates(
    given: Any, structure: Structure, *, few: int = _FEW
) -> tuple[Combination, ...]:
    """Return the coordinates to draw: by default a few, those that meet stops before others.

    A coordinate that meets a stop by itself shows that in a picture, where its wall is; then come
    those that meet one together with others.
    """
    size = structure.coordinates
    if given is None:
        met = np.zeros(size)
        for stop in structure.stops:
            acts = stop.normal != 0.0
            met[acts] = np.maximum(met[acts], 1.0 / np.count_nonzero(acts))
        order = np.argsort(-met, kind="stable")[:few]
        return tuple(single(i) for i in sorted(order.tolist()))
    many = [given] if isinstance(given, int | np.integer | str) else given
    if not isinstance(many, Sequence | np.ndarray) or not 0 < len(many) <= _MOST:
        _refuse(given, size)
    shown: list[Combination] = []
    for each in many:
        if isinstance(each, int | np.integer) and not isinstance(each, bool) and 0 <= each < size:
            shown.append(single(int(each)))
        elif isinstance(each, str) and (found := named(each, ("q",), size)) is not None:
            shown.append(found[1])
        else:
            _refuse(given, size)
    if len({*shown}) < len(shown):
        _refuse(given, size)
    return tuple(shown)


def _refuse(given: Any, size: int) -> NoReturn:
    between = ", a difference as 'q_0-q_1'" if size > 1 else ""
    allowed = f"None, a number from 0 to {size - 1}{between}, or at most {_MOST} different ones"
    reject("coordinates", given, allowed)


def closed_spans(run: StructureRun, window: tuple[float, float]) -> list[ClosedSpan]:
    """Return the stretches of time in a window in which stops are closed, by their beginning."""
    start, end = window
    events = np.concatenate([run.contacts["time"], run.impacts["time"]])
    borders = np.unique([start, *times_within(events, window), end])
    # Between two events the same stops are closed: those in which forces act amid them.
    states, forces = run.trajectory(0.5 * (borders[:-1] + borders[1:]), forces=True)
    spans: list[ClosedSpan] = []
    for number, stop in enumerate(run.system.stops):
        last = -1
        for place in np.flatnonzero(forces[:, number, 0] > 0.0):
            low, high = float(borders[place]), float(borders[place + 1])
            mode = _mode(stop, states[place, 1])
            if place == last + 1 and last >= 0 and spans[-1].mode == mode:
                low = spans.pop().start
            spans.append(ClosedSpan(number, low, high, mode))
            last = int(place)
    return sorted(spans, key=lambda span: (span.start, span.stop))


def _mode(stop: Stop, velocity: Array) -> Mode:
    """Return what a closed stop does at these velocities."""
    if stop.tangent is None or stop.friction == 0.0:
        return "closed"
    # In a stick the velocity of slip is rounding.
    slip, size = stop.tangent @ velocity, np.abs(stop.tangent) @ np.abs(velocity)
    return "slide" if abs(slip) > _STUCK * size else "stick"


def bands_of(spans: list[ClosedSpan]) -> list[ContactSpan]:
    """Return the stretches in which any stop is closed, in the mode of the one with friction."""
    borders = sorted({time for span in spans for time in (span.start, span.end)})
    bands: list[ContactSpan] = []
    for low, high in pairwise(borders):
        modes = {span.mode for span in spans if span.start <= low and high <= span.end}
        for mode in ("stick", "slide", "closed"):
            if mode not in modes:
                continue
            if bands and (bands[-1].end, bands[-1].mode) == (low, mode):
                low = bands.pop().start
            bands.append(ContactSpan(low, high, mode))
            break
    return bands


def _draw_line(
    ax: Axes,
    number: int,
    stop: Stop,
    structure: Structure,
    curve: Curve,
    shown: tuple[Combination, ...],
    moved: Array,
) -> None:
    """Draw where a coordinate meets a stop that acts on it alone."""
    factors = [multiple_of(i.row(structure.coordinates), stop.normal) for i in shown]
    factor = next((factor for factor in factors if factor), 0.0)
    if not factor:
        return
    phase = structure.drive_frequency * curve.time + stop.phase
    level = (stop.gap + stop.amplitude * np.cos(phase)) / factor
    low, high = float(moved.min()), float(moved.max())
    reach = _AWAY * (high - low)
    if reach > 0.0 and (level.min() > high + reach or level.max() < low - reach):
        return
    color, _ = STOPS[number % len(STOPS)]
    (line,) = ax.plot(curve.time, level, color=color, lw=0.9, ls=(0, (4, 1.5)), zorder=1.5)
    line.set_gid(f"stop-{number}")


def _draw_closed(
    ax: Axes,
    number: int,
    stop: Stop,
    curve: Curve,
    shown: tuple[Combination, ...],
    spans: list[ClosedSpan],
) -> None:
    """Draw a broad line under coordinates while a stop that acts on them is closed."""
    color, _ = STOPS[number % len(STOPS)]
    for span in spans:
        if span.stop != number:
            continue
        inside = (curve.time >= span.start) & (curve.time <= span.end)
        for i in shown:
            if i.met_by(stop.normal):
                q = i.of(curve.state[inside, 0])
                ax.plot(curve.time[inside], q, color=color, lw=3.0, alpha=0.6, zorder=1.2)


def mark_stops(
    ax: Axes, stops: NDArray[np.int64], x: Array, y: Array, *, named: bool = True
) -> None:
    """Mark impacts at (x, y) by their stop."""
    for number in np.unique(stops):
        color, marker = STOPS[number % len(STOPS)]
        here = stops == number
        ax.plot(
            x[here],
            y[here],
            linestyle="none",
            marker=marker,
            markersize=4.5,
            markerfacecolor=color,
            markeredgecolor="white",
            markeredgewidth=0.3,
            label=f"stop {number}" if named else "_nolegend_",
            zorder=3,
        )
