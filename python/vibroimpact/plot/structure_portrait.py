"""Phase portraits and sections of runs of structures: coordinates by number, impacts by stop.

Columns of several numbers are named with a number, as in data frames: ``q_0``, ``v_pre_1``.
Sections as of the pendulum: the theory page, section 6.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ..structure_run import StructureRun
from ..tables import Table
from .axis_names import STATE_NAMES
from .coordinates import Combination, asked, axis_of
from .curve import is_driven, orbit_window, sample
from .given import regime_color, sectioned
from .marks import REGIME_MARKS, Mark, draw_path, draw_regimes, draw_section, name_section
from .structure_history import (
    Stretch,
    bands_of,
    coordinate_style,
    mark_stops,
    shown_coordinates,
)
from .style import BLACK, STOPS, curve_legend, mark_area, new_axes, regimes_found, show_around

Array = NDArray[np.float64]

# Coordinates of a portrait that are drawn unasked.
FEW = 2


def structure_portrait(
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
    """Draw velocities of a structure against coordinates; arguments as in `phase_portrait`."""
    by_regime = regime_color(color)
    shown = shown_coordinates(coordinates, run.system, few=FEW)
    if window is None and periods is None:
        window = orbit_window(run)
    curve = sample(run, window=window, periods=periods, points_per_period=points_per_period)
    ax = new_axes(ax)
    draw_portrait(ax, Stretch.of_run(run, curve), shown, by_regime=by_regime)
    curve_legend(ax, legend)
    return ax


def draw_portrait(
    ax: Axes, stretch: Stretch, shown: tuple[Combination, ...], *, by_regime: bool = False
) -> None:
    """Draw velocities against some coordinates, with the states before impacts."""
    curve, spans = stretch.curve, bands_of(stretch.spans)
    for place, i in enumerate(shown):
        q, v = i.of(curve.state[:, 0]), i.of(curve.state[:, 1])
        draw_path(ax, spans, curve.time, q, v, named=place == 0)
        label = rf"${i.symbol('q')},\ {i.symbol('v')}$"
        ax.plot(q, v, label=label, **coordinate_style(place))
        struck = stretch.hits_on(i)
        before = (i.of(struck["q"]), i.of(struck["v_pre"]))
        if by_regime:
            draw_regimes(ax, struck["regime"], *before, named=place == 0)
        else:
            mark_stops(ax, struck["stop"], *before, named=place == 0)
    ax.set_xlabel(axis_of(shown, "q"))
    ax.set_ylabel(axis_of(shown, "v"))


def structure_stroboscopic(
    run: StructureRun, *, x: str | None, y: str | None, size: float | None, ax: Axes | None
) -> Axes:
    """Draw states of a structure once per drive period; arguments as in `stroboscopic`."""
    sectioned(run)
    size_of = run.system.coordinates
    drawn = [
        asked(argument, usual if name is None else name, size_of, wide=("q", "v"))
        for argument, name, usual in (("x", x, "q_0"), ("y", y, "v_0"))
    ]
    rows = run.stroboscopic
    across, up = (_of(rows[:, "qv".index(column)], part) for column, part in drawn)
    area = mark_area(size, len(rows))
    ax = new_axes(ax)
    ax.scatter(across, up, s=area, color=BLACK, linewidths=0, rasterized=True)
    for axis, (column, part) in zip("xy", drawn, strict=True):
        show_around(ax, axis)
        ax.set(**{f"{axis}label": f"{_name(column, part)} once per drive period"})
    return ax


def structure_impact_section(
    run: StructureRun,
    *,
    x: str | None,
    y: str | None,
    color: Any,
    size: float | None,
    legend: bool,
    ax: Axes | None,
) -> Axes:
    """Draw columns of the impacts of a structure; arguments as in `impact_section`."""
    by_regime = regime_color(color)
    x = ("phase" if is_driven(run.system) else "time") if x is None else x
    y = "approach_velocity" if y is None else y
    impacts = run.impacts
    columns = [_asked_of_impacts(run, argument, name) for argument, name in (("x", x), ("y", y))]
    across, up = (_of(np.asarray(impacts[column]), part) for column, part in columns)
    area = mark_area(size, len(impacts))
    ax = new_axes(ax)
    of = impacts["regime" if by_regime else "stop"]
    found = [int(number) for number in np.unique(of)]
    stops = {number: Mark(*STOPS[number % len(STOPS)], f"stop {number}") for number in found}
    draw_section(ax, across, up, of, REGIME_MARKS if by_regime else stops, area)
    name_section(ax, [name for name, _ in columns], [_name(*column) for column in columns])
    handles = [
        Line2D([], [], ls="none", color=color, marker=marker, label=text)
        for color, marker, text in stops.values()
    ]
    curve_legend(ax, legend, regimes_found(of.tolist()) if by_regime else handles)
    return ax


def _asked_of_impacts(
    run: StructureRun, argument: str, name: Any
) -> tuple[str, Combination | None]:
    """Return which column of the impact table a name means, and of one of N numbers which."""
    impacts: Table = run.impacts
    names = impacts.dtype.names or ()
    narrow = tuple(each for each in names if impacts.dtype[each].ndim == 0)
    wide = tuple(each for each in names if each not in narrow)
    return asked(argument, name, run.system.coordinates, wide=wide, narrow=narrow)


def _of(values: NDArray[Any], part: Combination | None) -> Array:
    """Return a column, or what is drawn of its coordinates."""
    return values if part is None else part.of(values)


def _name(column: str, part: Combination | None) -> str:
    """Return the name of a column on an axis."""
    if part is None:
        return STATE_NAMES.get(column, column.replace("_", " "))
    when = {"v_pre": " before impact", "v_post": " after impact"}.get(column, "")
    return f"{axis_of([part], 'q' if column == 'q' else 'v')}{when}"
