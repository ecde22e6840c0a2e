r"""Period n-1 solutions over one or two parameters, with the verdicts on them.

Stable solutions are thick and coloured, unstable ones thin and black. Only admissible solutions
count; the others are grey. With ``criterion``, the name of another criterion and its verdicts, all
algebraic solutions count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ..arguments import naming
from ..single_impact import MotionMap
from .axis_names import axis_name
from .given import expected
from .parameter_units import along_parameter
from .style import ANGLE_TICKS, BLACK, BLUE, VERMILLION, new_axes

_PALE = "0.62"
_NOTHING = "1.0"
_UNSTABLE = "0.72"
# How much larger marks are in a legend.
_LEGEND_SCALE = 1.8
# How much smaller they are in three dimensions, where many lie on one another.
_SPACE_SCALE = 0.8
X10 = "position $x_{10}$ of body 1 at impact"
# A criterion's name, and for each solution whether it calls it stable.
Criterion = tuple[str, NDArray[np.bool_]]


@dataclass(frozen=True)
class _Kind:
    """One kind of solution: how it is marked and named."""

    chosen: NDArray[np.bool_]
    text: str
    marker: dict[str, Any]


def _dot(color: str, size: float) -> dict[str, Any]:
    return {"marker": "o", "color": color, "markersize": size, "markeredgewidth": 0.0}


def _kinds(result: MotionMap, criterion: Criterion | None, scale: float) -> list[_Kind]:
    """Return the kinds in the order in which they are drawn."""
    found = result.solutions
    if criterion is not None:
        name, stable = _checked(criterion, result)
        return [
            _Kind(~stable, f"unstable by {name}", _dot(BLACK, 1.1 * scale)),
            _Kind(stable, f"stable by {name}", _dot(VERMILLION, 2.6 * scale)),
        ]
    admissible, stable = found["admissible"], found["stable"]
    return [
        _Kind(~admissible, "not admissible", _dot(_PALE, 0.9 * scale)),
        _Kind(admissible & ~stable, "unstable motion", _dot(BLACK, 1.1 * scale)),
        _Kind(stable, "stable motion", _dot(BLUE, 2.6 * scale)),
    ]


def _checked(criterion: Criterion, result: MotionMap) -> Criterion:
    """Return a criterion if it has one verdict for each solution."""
    name, stable = criterion
    if np.shape(stable) != np.shape(result.solutions):
        raise ValueError(
            f"criterion {name}: {np.size(stable)} verdicts on {len(result.solutions)} solutions"
        )
    return name, np.asarray(stable, dtype=np.bool_)


@naming
def motion_handles(result: MotionMap, *, criterion: Criterion | None = None) -> list[Artist]:
    """Return one legend entry for each kind of solution.

    Parameters
    ----------
    result : MotionMap
        Result of `vibroimpact.motion_map`.
    criterion : (str, array of bool), optional
        Another criterion, as for `motion_branches`.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> solutions = vi.motion_map(system, drive_frequency=[1.6, 1.8, 2.0])
    >>> [handle.get_label() for handle in vi.plot.motion_handles(solutions)]
    ['stable motion', 'unstable motion', 'not admissible']
    """
    return [
        Line2D([], [], linestyle="none", label=kind.text, **kind.marker)
        for kind in reversed(_kinds(result, criterion, _LEGEND_SCALE))
    ]


@naming
def motion_branches(
    result: MotionMap, *, criterion: Criterion | None = None, ax: Axes | None = None
) -> Axes:
    r"""Draw the angle at the impact of all solutions over the varied parameter.

    Parameters
    ----------
    result : MotionMap
        Over one parameter; `MotionMap.at` fixes the other of two.
    criterion : (str, array of bool), optional
        Name of another criterion of stability, and whether it calls each row of
        ``result.solutions`` stable. All algebraic solutions are drawn then, with its verdicts.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If the result is of another kind.
    ValueError
        If two parameters vary.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> solutions = vi.motion_map(system, drive_frequency=[1.6, 1.8, 2.0])
    >>> vi.plot.motion_branches(solutions).get_xlabel()
    'drive frequency $\\omega$'
    """
    (name,) = _names(result, 1)
    ax = new_axes(ax)
    parameter = result.parameter(name)
    for kind in _kinds(result, criterion, 1.0):
        ax.plot(
            parameter[kind.chosen],
            result.solutions["x1"][kind.chosen],
            linestyle="none",
            label=kind.text,
            **kind.marker,
        )
    along_parameter(ax, result.grid[name], axis_name(name, made=False))
    ax.set_ylabel(X10)
    _angles(ax)
    return ax


def _angles(ax: Any) -> None:
    """Let an axis of angles show a quarter turn to either side."""
    ax.set_yticks(list(ANGLE_TICKS), list(ANGLE_TICKS.values()))
    ax.set_ylim(-1.03 * np.pi / 2, 1.03 * np.pi / 2)


@naming
def motion_space(
    result: MotionMap,
    *,
    criterion: Criterion | None = None,
    every: Sequence[int] = (1, 1),
    ax: Any = None,
) -> Any:
    r"""Draw the angle at the impact over both parameters, in three dimensions.

    Solutions that are no motions are left out, unless another criterion judges them.

    Parameters
    ----------
    result : MotionMap
        Over two parameters.
    criterion : (str, array of bool), optional
        Draw all algebraic solutions with the verdicts of another criterion, as for
        `motion_branches`.
    every : two integers
        Draw every so manyth value of each parameter.
    ax : mpl_toolkits.mplot3d.axes3d.Axes3D, optional
        Where to draw; a new figure if None.

    Returns
    -------
    mpl_toolkits.mplot3d.axes3d.Axes3D

    Raises
    ------
    ParameterError
        If the result is of another kind.
    ValueError
        If only one parameter varies.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> solutions = vi.motion_map(system, drive_frequency=[1.7, 1.8], moment_amplitude=[0.9, 1.0])
    >>> vi.plot.motion_space(solutions).get_xlabel()
    'drive frequency $\\omega$'
    """
    names = _names(result, 2)
    if ax is None:
        from matplotlib import pyplot

        ax = pyplot.figure(layout="constrained").add_subplot(projection="3d")
    places = np.unravel_index(result.solutions["point"], result.shape)
    shown = (places[0] % every[0] == 0) & (places[1] % every[1] == 0)
    x, y = (result.parameter(name) for name in names)
    for kind in _kinds(result, criterion, _SPACE_SCALE):
        if criterion is None and kind.marker.get("color") == _PALE:
            continue
        chosen = kind.chosen & shown
        ax.plot(
            x[chosen],
            y[chosen],
            result.solutions["x1"][chosen],
            linestyle="none",
            label=kind.text,
            rasterized=True,
            **kind.marker,
        )
    ax.set_xlabel(axis_name(names[0], made=False), labelpad=0)
    ax.set_ylabel(axis_name(names[1], made=False), labelpad=0)
    ax.set_zlabel(X10, labelpad=0)
    ax.tick_params(pad=-2)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MaxNLocator(nbins=5, steps=[1, 2, 5, 10]))
    ax.set_box_aspect((1.25, 1.0, 0.85), zoom=1.12)
    ax.set_zticks(list(ANGLE_TICKS)[::2], list(ANGLE_TICKS.values())[::2])
    ax.set_zlim(-np.pi / 2, np.pi / 2)
    ax.view_init(elev=24.0, azim=-62.0)
    return ax


@naming
def stability_map(
    result: MotionMap, *, criterion: Criterion | None = None, ax: Axes | None = None
) -> Axes:
    r"""Draw where in the plane of both parameters there are stable motions, or only unstable ones.

    Parameters
    ----------
    result : MotionMap
        Over two parameters.
    criterion : (str, array of bool), optional
        Count all algebraic solutions with the verdicts of another criterion, as for
        `motion_branches`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If the result is of another kind.
    ValueError
        If only one parameter varies.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> solutions = vi.motion_map(system, drive_frequency=[1.7, 1.8], moment_amplitude=[0.9, 1.0])
    >>> vi.plot.stability_map(solutions).get_xlabel()
    'drive frequency $\\omega$'
    """
    names = _names(result, 2)
    ax = new_axes(ax)
    found = result.solutions
    points = int(np.prod(result.shape))
    counted, stable, color = found["admissible"], found["stable"], BLUE
    if criterion is not None:
        counted, color = np.ones(len(found), dtype=np.bool_), VERMILLION
        _, stable = _checked(criterion, result)
    some, good = (
        np.bincount(found["point"][chosen], minlength=points) > 0 for chosen in (counted, stable)
    )
    level = (some.astype(int) + good).reshape(result.shape)
    colors = ListedColormap([_NOTHING, _UNSTABLE, color])
    x, y = (result.grid[name] for name in names)
    ax.pcolormesh(
        x, y, level.T, cmap=colors, vmin=-0.5, vmax=2.5, shading="nearest", rasterized=True
    )
    ax.set_xlabel(axis_name(names[0], made=False))
    ax.set_ylabel(axis_name(names[1], made=False))
    return ax


@naming
def stability_handles(*, criterion: str = "") -> list[Artist]:
    """Return the legend entries of `stability_map`, of another criterion by its name.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> [handle.get_label() for handle in vi.plot.stability_handles()]
    ['a stable one', 'unstable ones only']
    """
    good, some = ("a stable one", "unstable ones only")
    if criterion:
        good, some = (f"{text} by {criterion}" for text in (good, some))
    edge: dict[str, Any] = {"edgecolor": "0.4", "linewidth": 0.4}
    return [
        Patch(facecolor=VERMILLION if criterion else BLUE, label=good, **edge),
        Patch(facecolor=_UNSTABLE, label=some, **edge),
    ]


def _names(result: MotionMap, wanted: int) -> list[str]:
    names = list(expected("result", result, MotionMap).grid)
    if len(names) != wanted:
        counts = {1: "one varied parameter is", 2: "two varied parameters are"}
        raise ValueError(f"{counts[wanted]} needed, not {', '.join(names)}")
    return names
