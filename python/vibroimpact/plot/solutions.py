r"""Period n-1 solutions over one or two parameters, with either verdict on them.

Stable solutions are thick and coloured, unstable ones thin and black. By the paper's criterion
(``paper=True``) all algebraic solutions count; else only those that are motions, and the others are
left in grey.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from .style import ANGLE_TICKS, BLACK, BLUE, PARAMETER_SYMBOLS, VERMILLION, new_axes

if TYPE_CHECKING:
    from ..single_impact import MotionMap

_PALE = "0.62"
_NOTHING = "1.0"
_UNSTABLE = "0.72"
# How much larger marks are in a legend.
_LEGEND_SCALE = 1.8
X10 = r"$x_{10}$"


@dataclass(frozen=True)
class _Kind:
    """One kind of solution: how it is marked and named."""

    chosen: NDArray[np.bool_]
    text: str
    marker: dict[str, Any]


def _dot(color: str, size: float) -> dict[str, Any]:
    return {"marker": "o", "color": color, "markersize": size, "markeredgewidth": 0.0}


def _kinds(result: MotionMap, paper: bool, scale: float) -> list[_Kind]:
    """Return the kinds in the order in which they are drawn."""
    found = result.solutions
    if paper:
        stable = found["paper_stable"]
        return [
            _Kind(~stable, "unstable by (45)", _dot(BLACK, 1.1 * scale)),
            _Kind(stable, "stable by (45)", _dot(VERMILLION, 2.6 * scale)),
        ]
    admissible, stable = found["admissible"], found["stable"]
    return [
        _Kind(~admissible, "not admissible", _dot(_PALE, 0.9 * scale)),
        _Kind(admissible & ~stable, "unstable motion", _dot(BLACK, 1.1 * scale)),
        _Kind(stable, "stable motion", _dot(BLUE, 2.6 * scale)),
    ]


def motion_handles(result: MotionMap, *, paper: bool = False) -> list[Artist]:
    """Return one legend entry for each kind of solution.

    Parameters
    ----------
    result : MotionMap
        Result of `vibroimpact.motion_map`.
    paper : bool
        The verdicts of the paper's criterion.
    """
    return [
        Line2D([], [], linestyle="none", label=kind.text, **kind.marker)
        for kind in reversed(_kinds(result, paper, _LEGEND_SCALE))
    ]


def motion_branches(result: MotionMap, *, paper: bool = False, ax: Axes | None = None) -> Axes:
    """Draw the angle at the impact of all solutions over the varied parameter.

    Parameters
    ----------
    result : MotionMap
        Over one parameter; `MotionMap.at` fixes the other of two.
    paper : bool
        Draw all algebraic solutions, with the verdict of the paper's criterion.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ValueError
        If two parameters vary.
    """
    (name,) = _names(result, 1)
    ax = new_axes(ax)
    parameter = result.parameter(name)
    for kind in _kinds(result, paper, 1.0):
        ax.plot(
            parameter[kind.chosen],
            result.solutions["x1"][kind.chosen],
            linestyle="none",
            label=kind.text,
            **kind.marker,
        )
    values = result.grid[name]
    ax.set_xlim(float(values.min()), float(values.max()))
    ax.set_xlabel(PARAMETER_SYMBOLS[name])
    ax.set_ylabel(X10)
    _angles(ax)
    return ax


def _angles(ax: Any) -> None:
    """Let an axis of angles show a quarter turn to either side."""
    ax.set_yticks(list(ANGLE_TICKS), list(ANGLE_TICKS.values()))
    ax.set_ylim(-1.03 * np.pi / 2, 1.03 * np.pi / 2)


def motion_space(
    result: MotionMap, *, paper: bool = False, every: Sequence[int] = (1, 1), ax: Any = None
) -> Any:
    """Draw the angle at the impact over both parameters, in three dimensions.

    Solutions that are no motions are left out, but for those of the paper's criterion.

    Parameters
    ----------
    result : MotionMap
        Over two parameters.
    paper : bool
        Draw all algebraic solutions, with the verdict of the paper's criterion.
    every : two integers
        Draw every so manyth value of each parameter.
    ax : mpl_toolkits.mplot3d.axes3d.Axes3D, optional
        Where to draw; a new figure if None.

    Returns
    -------
    mpl_toolkits.mplot3d.axes3d.Axes3D

    Raises
    ------
    ValueError
        If only one parameter varies.
    """
    names = _names(result, 2)
    if ax is None:
        from matplotlib import pyplot

        ax = pyplot.figure(layout="constrained").add_subplot(projection="3d")
    places = np.unravel_index(result.solutions["point"], result.shape)
    shown = (places[0] % every[0] == 0) & (places[1] % every[1] == 0)
    x, y = (result.parameter(name) for name in names)
    for kind in _kinds(result, paper, 0.5):
        if not paper and kind.marker.get("color") == _PALE:
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
    ax.set_xlabel(PARAMETER_SYMBOLS[names[0]], labelpad=-4)
    ax.set_ylabel(PARAMETER_SYMBOLS[names[1]], labelpad=-4)
    ax.set_zlabel(X10, labelpad=-8)
    ax.tick_params(pad=-2)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MaxNLocator(nbins=5, steps=[1, 2, 5, 10]))
    ax.set_box_aspect((1.25, 1.0, 0.85), zoom=1.12)
    ax.set_zticks(list(ANGLE_TICKS)[::2], list(ANGLE_TICKS.values())[::2])
    ax.set_zlim(-np.pi / 2, np.pi / 2)
    ax.view_init(elev=24.0, azim=-62.0)
    return ax


def stability_map(result: MotionMap, *, paper: bool = False, ax: Axes | None = None) -> Axes:
    """Draw where in the plane of both parameters there are stable motions, or only unstable ones.

    Parameters
    ----------
    result : MotionMap
        Over two parameters.
    paper : bool
        Count all algebraic solutions, with the verdict of the paper's criterion.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ValueError
        If only one parameter varies.
    """
    names = _names(result, 2)
    ax = new_axes(ax)
    found = result.solutions
    points = int(np.prod(result.shape))
    counted = np.ones(len(found), dtype=np.bool_) if paper else found["admissible"]
    stable = found["paper_stable"] if paper else found["stable"]
    some, good = (
        np.bincount(found["point"][chosen], minlength=points) > 0 for chosen in (counted, stable)
    )
    level = (some.astype(int) + good).reshape(result.shape)
    colors = ListedColormap([_NOTHING, _UNSTABLE, VERMILLION if paper else BLUE])
    x, y = (result.grid[name] for name in names)
    ax.pcolormesh(
        x, y, level.T, cmap=colors, vmin=-0.5, vmax=2.5, shading="nearest", rasterized=True
    )
    ax.set_xlabel(PARAMETER_SYMBOLS[names[0]])
    ax.set_ylabel(PARAMETER_SYMBOLS[names[1]])
    return ax


def stability_handles(*, paper: bool = False) -> list[Artist]:
    """Return the legend entries of `stability_map`."""
    good, some = ("a stable one", "unstable ones only")
    if paper:
        good, some = (f"{text} by (45)" for text in (good, some))
    edge: dict[str, Any] = {"edgecolor": "0.4", "linewidth": 0.4}
    return [
        Patch(facecolor=VERMILLION if paper else BLUE, label=good, **edge),
        Patch(facecolor=_UNSTABLE, label=some, **edge),
    ]


def _names(result: MotionMap, wanted: int) -> list[str]:
    names = list(result.grid)
    if len(names) != wanted:
        counts = {1: "one varied parameter is", 2: "two varied parameters are"}
        raise ValueError(f"{counts[wanted]} needed, not {', '.join(names)}")
    return names
