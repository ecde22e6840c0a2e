"""Sections of one run: its impacts, its states once per drive period, and the count of impacts.

The impact section is the state just before each impact, the stroboscopic section the state once per
drive period; Han, Jin & Hu (2004), eqs. (48a) and (48b), theory page, section 6.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator, ScalarFormatter

from ..arguments import naming
from ..run import Run
from ..scales import Units
from ..structure_run import StructureRun
from ..sweeps.columns import COORDINATES
from .axis_names import STATE_NAMES
from .curve import is_driven
from .given import (
    chosen,
    expected,
    impact_column,
    of_system,
    regime_color,
    run_hits_wall_at_rest,
    sectioned,
)
from .marks import REGIME_MARKS, draw_section, name_section
from .structure_portrait import structure_impact_section, structure_stroboscopic
from .style import BLACK, curve_legend, mark_area, new_axes, regimes_found, show_around
from .units import AxisUnits

# Counts that span at least this factor are drawn over logarithmic axes.
_DECADES = 30.0


@naming
def impact_section(
    run: Run | StructureRun,
    *,
    x: str | None = None,
    y: str | None = None,
    color: Literal["regime"] | None = None,
    size: float | None = None,
    legend: bool = True,
    units: Units | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw two columns of `Run.impacts` against each other, one point for each kept impact.

    Parameters
    ----------
    run : Run or StructureRun
        Result of `vibroimpact.simulate`.
    x : str, optional
        Column of the impact table on the horizontal axis. By default the pendulum's angle. Where
        body 2 is a wall at rest that is always the same; there, and of a structure, the default is
        the drive phase, without a drive the time. One of several numbers is named with its place:
        ``"q_0"``, ``"v_pre_1"``, or a difference of them, ``"q_0-q_1"``.
    y : str, optional
        Column on the vertical axis. By default the pendulum's velocity before impact; where body 2
        is a wall at rest, and of a structure, the approach velocity.
    color : "regime" or None
        Colour and shape by regime; or black dots, of a structure colour and shape by stop.
    size : float, optional
        Area of a marker in square points; by default smaller the more impacts there are.
    legend : bool
        Name the regimes above the axes, if they have colours.
    units : "SI", optional
        Draw in SI; the system needs scales.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind, or names no column.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> vi.plot.impact_section(run, y="approach_velocity").get_ylabel()
    'approach velocity $u$'
    """
    if isinstance(run, StructureRun):
        of_system(units=units)
        return structure_impact_section(run, x=x, y=y, color=color, size=size, legend=legend, ax=ax)
    run = expected("run", run, Run)
    by_regime = regime_color(color)
    usual = ("x1", "v1_pre")
    if run_hits_wall_at_rest(run):
        usual = ("phase" if is_driven(run.system) else "time", "approach_velocity")
    x, y = usual[0] if x is None else x, usual[1] if y is None else y
    across, up = impact_column(run, x, "x"), impact_column(run, y, "y")
    drawn = AxisUnits.of(units, run.system)
    across, up = across * drawn.factor(x), up * drawn.factor(y)
    area = mark_area(size, len(run.impacts))
    ax = new_axes(ax)
    regimes = run.impacts["regime"]
    if by_regime:
        draw_section(ax, across, up, regimes, REGIME_MARKS, area)
    else:
        ax.scatter(across, up, s=area, color=BLACK, linewidths=0, rasterized=True)
    texts = [STATE_NAMES.get(name, name.replace("_", " ")) for name in (x, y)]
    name_section(ax, (x, y), [drawn.label(*named) for named in zip((x, y), texts, strict=True)])
    # Those of the legend can be seen, however small the points are.
    curve_legend(ax, legend, regimes_found(regimes.tolist()) if by_regime else [])
    return ax


@naming
def stroboscopic(
    run: Run | StructureRun,
    *,
    x: str | None = None,
    y: str | None = None,
    size: float | None = None,
    units: Units | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the stroboscopic section of a run: its state once per drive period, a Poincare map.

    A motion m-n has m points, a quasi-periodic motion fills closed curves.

    Parameters
    ----------
    run : Run or StructureRun
        Result of `vibroimpact.simulate`; all its kept drive periods are drawn.
    x : {"x1", "v1", "x2", "v2"}, optional
        What to draw on the horizontal axis, by default x1; of a structure ``"q_0"``, ``"v_0"``,
        ``"q_1"`` ..., or a difference, ``"q_0-q_1"``, by default q_0.
    y : {"x1", "v1", "x2", "v2"}, optional
        What to draw on the vertical axis, by default v1, of a structure v_0.
    size : float, optional
        Area of a marker in square points; by default smaller the more points there are.
    units : "SI", optional
        Draw in rad, rad/s, m, m/s; the system needs scales.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind, or the load is constant, which has no period.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> vi.plot.stroboscopic(run, x="x2", y="v2").get_xlabel()
    'position $x_2$ of body 2 once per drive period'
    """
    if isinstance(run, StructureRun):
        of_system(units=units)
        return structure_stroboscopic(run, x=x, y=y, size=size, ax=ax)
    run = expected("run", run, Run)
    sectioned(run)
    drawn = AxisUnits.of(units, run.system)
    names = [
        chosen(name, usual if given is None else given, COORDINATES)
        for name, given, usual in (("x", x, "x1"), ("y", y, "v1"))
    ]
    rows = run.stroboscopic
    area = mark_area(size, len(rows))
    ax = new_axes(ax)
    across, up = (rows[:, COORDINATES.index(name)] * drawn.factor(name) for name in names)
    ax.scatter(
        across,
        up,
        s=area,
        color=BLACK,
        linewidths=0,
        rasterized=True,
    )
    show_around(ax, "x")
    show_around(ax, "y")
    said = [drawn.label(name, f"{STATE_NAMES[name]} once per drive period") for name in names]
    ax.set_xlabel(said[0])
    ax.set_ylabel(said[1])
    return ax


@naming
def impact_count(run: Run, *, ax: Axes | None = None) -> Axes:
    """Draw the number of impacts since t = 0 against drive periods, for the kept part of a run.

    Both axes are logarithmic where the count grows by a factor of thirty: impacts that stop after a
    finite number end in a level line. A run without a drive is drawn against time.

    Parameters
    ----------
    run : Run
        Result of `vibroimpact.simulate`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If `run` is something else.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> vi.plot.impact_count(run).get_xlabel()
    'drive periods'
    """
    run = expected("run", run, Run)
    ax = new_axes(ax)
    timed = run.system.drive_frequency == 0.0
    at = run.impacts["time"] if timed else run.impacts["period"] + 1
    end = run.final_state.time / (1.0 if timed else run.system.drive_period)
    count = np.arange(1, len(at) + 1) + run.impact_count - len(at)
    ax.step(
        np.append(at, end),
        np.append(count, run.impact_count),
        where="post",
        color=BLACK,
        lw=0.9,
    )
    if len(count) and not timed and run.impact_count >= _DECADES * float(count[0]):
        ax.set_xscale("log")
        ax.set_yscale("log")
    elif ax.get_yscale() == "linear":
        # Powers of ten would leave the axes of a late part with ticks such as 5 x 10^2.
        ax.yaxis.set_major_locator(MaxNLocator(nbins="auto", integer=True))
        ax.xaxis.set_major_locator(MaxNLocator(nbins="auto", integer=not timed))
        for one in (ax.xaxis, ax.yaxis):
            one.set_major_formatter(ScalarFormatter(useOffset=False))
    ax.set_xlabel(STATE_NAMES["time"] if timed else "drive periods")
    ax.set_ylabel("impacts so far")
    return ax
