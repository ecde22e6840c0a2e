"""Phase portraits and sections of runs of structures: coordinates by number, impacts by stop.

Columns of several numbers are named with a number, as in data frames: ``q_0``, ``v_pre_1``.
Sections as of the pendulum: the theory page, section 6.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ..structure import Structure
from ..structure_run import StructureRun
from ..tables import Table
from .curve import is_driven, orbit_window, sample
from .given import chosen, regime_color, sectioned
from .marks import draw_path, draw_regimes
from .structure_history import (
    Stretch,
    bands_of,
    coordinate_style,
    mark_stops,
    shown_coordinates,
)
from .style import (
    BLACK,
    REGIME_STYLES,
    STATE_SYMBOLS,
    STOPS,
    curve_legend,
    mark_area,
    new_axes,
    phase_axis,
    regime_handles,
    show_around,
)

Array = NDArray[np.float64]

# Coordinates of a portrait that are drawn unasked.
FEW = 2
_NUMBERED = re.compile(r"(q|v|v_pre|v_post)_([0-9]+)")


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
    ax: Axes, stretch: Stretch, shown: tuple[int, ...], *, by_regime: bool = False
) -> None:
    """Draw velocities against some coordinates, with the states before impacts."""
    curve, spans = stretch.curve, bands_of(stretch.spans)
    for place, i in enumerate(shown):
        q, v = curve.state[:, 0, i], curve.state[:, 1, i]
        draw_path(ax, spans, curve.time, q, v, named=place == 0)
        ax.plot(q, v, label=rf"$q_{{{i}}},\ \dot q_{{{i}}}$", **coordinate_style(place))
        struck = stretch.hits_on(i)
        before = (struck["q"][:, i], struck["v_pre"][:, i])
        if by_regime:
            draw_regimes(ax, struck["regime"], *before, named=place == 0)
        else:
            mark_stops(ax, struck["stop"], *before, named=place == 0)
    ax.set_xlabel("$" + r",\ ".join(f"q_{{{i}}}" for i in shown) + "$")
    ax.set_ylabel("$" + r",\ ".join(rf"\dot q_{{{i}}}" for i in shown) + "$")


def structure_stroboscopic(
    run: StructureRun, *, x: str | None, y: str | None, size: float | None, ax: Axes | None
) -> Axes:
    """Draw states of a structure once per drive period; arguments as in `stroboscopic`."""
    sectioned(run)
    known = _numbered(("q", "v"), run.system)
    names = [
        chosen(argument, usual if name is None else name, known)
        for argument, name, usual in (("x", x, "q_0"), ("y", y, "v_0"))
    ]
    rows = run.stroboscopic
    across, up = (rows[:, "qv".index(name[0]), int(name[2:])] for name in names)
    area = mark_area(size, len(rows))
    ax = new_axes(ax)
    ax.scatter(across, up, s=area, color=BLACK, linewidths=0, rasterized=True)
    for axis, name in zip("xy", names, strict=True):
        show_around(ax, axis)
        ax.set(**{f"{axis}label": f"{_symbol(name)} once per drive period"})
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
    across, up = (_column(run, name, argument) for argument, name in (("x", x), ("y", y)))
    area = mark_area(size, len(impacts))
    ax = new_axes(ax)
    of = impacts["regime" if by_regime else "stop"]
    handles = []
    for number in np.unique(of):
        style: tuple[str, str] = STOPS[number % len(STOPS)]
        if by_regime:
            regime = REGIME_STYLES[int(number)]
            style = (regime.color, regime.marker)
        here = of == number
        ax.scatter(
            across[here],
            up[here],
            s=area,
            color=style[0],
            marker=style[1],
            linewidths=0,
            rasterized=True,
        )
        handles.append(
            Line2D([], [], ls="none", marker=style[1], color=style[0], label=f"stop {number}")
        )
    for axis, name in (("x", x), ("y", y)):
        ax.set(**{f"{axis}label": _symbol(name)})
        if name == "phase":
            phase_axis(ax, axis)
        else:
            show_around(ax, axis)
    if y == "approach_velocity":
        # The sizes of the bounces can be compared.
        ax.set_ylim(bottom=0.0)
    curve_legend(ax, legend, regime_handles(of.tolist()) if by_regime else handles)
    return ax


def _numbered(columns: tuple[str, ...], structure: Structure) -> tuple[str, ...]:
    """Return the names of the numbers of such columns."""
    return tuple(f"{column}_{i}" for column in columns for i in range(structure.coordinates))


def _column(run: StructureRun, name: str, argument: str) -> Array:
    """Return a column of numbers of the impact table, or one number of a column of several."""
    impacts: Table = run.impacts
    names = impacts.dtype.names or ()
    single = tuple(each for each in names if impacts.dtype[each].ndim == 0)
    wide = tuple(each for each in names if each not in single)
    parts = {
        part: (column, i)
        for column in wide
        for i, part in enumerate(_numbered((column,), run.system))
    }
    chosen(argument, name, (*single, *parts))
    if name in single:
        return np.asarray(impacts[name])
    column, i = parts[name]
    return np.asarray(impacts[column][:, i])


def _symbol(name: str) -> str:
    """Return the symbol of a column on an axis."""
    numbered = _NUMBERED.fullmatch(name)
    if numbered is None:
        return STATE_SYMBOLS.get(name, name.replace("_", " "))
    column, number = numbered.groups()
    symbol = "q" if column == "q" else r"\dot q"
    when = {"v_pre": " before impact", "v_post": " after impact"}.get(column, "")
    return f"${symbol}_{{{number}}}${when}"
