"""One attractor in the plane of two coordinates, and the motions that a search has found.

`vibroimpact.basins` and `vibroimpact.search_motions`; theory page, sections 6 and 7.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import PercentFormatter

from ..arguments import naming
from ..orbits import MotionSearch, PeriodicMotion
from ..sweeps import Attractor
from ..sweeps.columns import COORDINATES
from .axis_names import state_name
from .basins import BASIN_COLORS
from .given import chosen, expected
from .structure_orbit import orbit_stretch
from .style import BLACK, GREY, curve_legend, label_text, mark_area, new_axes

# Samples of an orbit in a drive period.
_SAMPLES = 400
_OTHERS = "0.75"
# Room for so many bars.
_LEAST_ROWS = 4


@naming
def attractor(
    result: Attractor,
    *,
    x: str | None = None,
    y: str | None = None,
    size: float | None = None,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw the sections of an attractor, and the orbit of a periodic one between them.

    Parameters
    ----------
    result : Attractor
        One of the attractors that `vibroimpact.basins` has found.
    x : str, optional
        What to draw on the horizontal axis: "x1", the default, "v1", "x2" or "v2"; of a structure
        "q_0", the default, or another coordinate or velocity, such as "v_1".
    y : str, optional
        What to draw on the vertical axis, by default "v1" or "v_0".
    size : float, optional
        Area of a marker in square points; by default smaller the more sections there are.
    legend : bool
        Name sections and orbit above the axes.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> grid = [-0.5, 0.0, 0.2]
    >>> basins = vi.basins(system, x1=grid, v1=grid, scouts=20, periods=300)
    >>> vi.plot.attractor(basins.attractors[0], x="x2", y="v2").get_xlabel()
    'position $x_2$ of body 2'
    """
    result = expected("result", result, Attractor)
    sections = result.sections.reshape(len(result.sections), -1)
    known: tuple[str, ...] = COORDINATES
    usual = ("x1", "v1")
    if result.sections.ndim == 3:
        places = range(result.sections.shape[2])
        known, usual = tuple(f"{part}_{k}" for part in "qv" for k in places), ("q_0", "v_0")
    asked = (("x", x, usual[0]), ("y", y, usual[1]))
    names = [chosen(name, own if given is None else given, known) for name, given, own in asked]
    first, second = (known.index(name) for name in names)
    area = mark_area(size, len(result.sections))
    ax = new_axes(ax)
    motion = result.motion
    if isinstance(motion, PeriodicMotion):
        # An impact changes velocities at once: the states on both sides of it belong to the curve.
        hits = np.asarray(motion.impacts["time"])
        times = np.linspace(0.0, motion.period, _SAMPLES * motion.m + 1)
        before = np.nextafter(hits, -math.inf)
        times = np.unique(np.clip(np.concatenate([times, hits, before]), 0.0, motion.period))
        states = motion.trajectory(times)
    elif motion is not None:
        samples = orbit_stretch(motion, _SAMPLES).curve.state
        states = samples.reshape(len(samples), -1)
    if motion is not None:
        ax.plot(states[:, first], states[:, second], color=GREY, lw=0.8, label="orbit")
    ax.scatter(
        sections[:, first],
        sections[:, second],
        s=area,
        color=BLACK,
        linewidths=0,
        zorder=3,
        label=f"sections of {label_text(result.label)}",
        rasterized=True,
    )
    said = [state_name(name) for name in names]
    ax.set_xlabel(said[0])
    ax.set_ylabel(said[1])
    curve_legend(ax, legend)
    return ax


@naming
def motion_search(result: MotionSearch[Any], *, ax: Axes | None = None) -> Axes:
    """Draw the part of the starts that ends on each motion, and grey the parts that end elsewhere.

    Parameters
    ----------
    result : MotionSearch
        Result of `vibroimpact.search_motions`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If `result` is something else.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> search = vi.search_motions(system, starts=16, periods=200)
    >>> vi.plot.motion_search(search).get_xlabel()
    'part of the starts'
    """
    result = expected("result", result, MotionSearch)
    ax = new_axes(ax)
    rows = [
        (f"{label_text(name)}, {motion.stability}", float(share), color)
        for name, motion, share, color in zip(
            result._names,
            result.motions,
            result.shares,
            np.resize(np.array(BASIN_COLORS), len(result.motions)),
            strict=True,
        )
    ]
    rows += [(label_text(name), share, _OTHERS) for name, share in result.others.items()]
    places = np.arange(len(rows))
    shares = [share for _, share, _ in rows]
    bars = ax.barh(places, shares, height=0.6, color=[str(color) for _, _, color in rows])
    ax.bar_label(bars, [f"{share:.1%}" for share in shares], padding=3)
    ax.set_yticks(places, [name for name, _, _ in rows])
    # The largest stands above; one bar alone does not fill the axes.
    ax.set_ylim(max(len(rows), _LEAST_ROWS) - 0.5, -0.5)
    ax.set_xlim(0.0, 1.15 * max(shares, default=1.0))
    ax.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    ax.set_xlabel("part of the starts")
    return ax
