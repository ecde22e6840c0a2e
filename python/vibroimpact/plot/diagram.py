"""Bifurcation diagrams: a section of the long-term motion against the swept parameter.

`contact_fraction` draws the time in lasting contact beneath (docs/theory.md, section 5). The impact
section is the state just before each impact, the stroboscopic section the state once
per drive period; Han, Jin & Hu (2004), eqs. (48a) and (48b), docs/theory.md section 6.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba_array
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from .style import (
    BLACK,
    CHATTER_COLOR,
    PARAMETER_SYMBOLS,
    REGIME_STYLES,
    SECTION_LABELS,
    SLIDE_STYLE,
    legend_above,
    new_axes,
    regime_handles,
)

if TYPE_CHECKING:
    from ..atlas import Diagram

_RUG_HEIGHT = 0.035
_RUG_GREYS = ("0.45", "0.7", "0.2")
_CHATTER_TEXT = r"complete chatter ($m$-$\infty$)"


def bifurcation(
    diagram: Diagram,
    *,
    section: Literal["impact", "stroboscopic"] = "impact",
    color: Literal["regime"] | None = None,
    size: float = 0.25,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw the pendulum angle on a section against the swept parameter.

    Values whose run did not complete are marked by a grey rug along the bottom axis, one row for
    each status, so that an empty column is never mistaken for a motion without impacts. Values
    whose motion has complete chatter in every orbit (`Diagram.n` = -1) have a strip of their own
    colour along the top, and black points take that colour too: what is drawn there are the
    impacts before the chatter is carried to its end, the infinitely many after them lie at the tip
    of the column.

    Parameters
    ----------
    diagram : Diagram
        Result of `vibroimpact.bifurcation_diagram`.
    section : {"impact", "stroboscopic"}
        Section (48a) or (48b) of the paper.
    color : "regime" or None
        Colour each impact by its regime, or draw all points in black. Only impacts have a regime.
        The points are drawn in a fixed random order: where regimes mix, none hides the others.
    size : float
        Area of a point in square points, as in `matplotlib.axes.Axes.scatter`.
    legend : bool
        Name the regimes, the strip and the rug above the axes.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ValueError
        If `section` or `color` is unknown, or regimes are asked for on the stroboscopic section.
    """
    if section not in SECTION_LABELS:
        raise ValueError(f"section must be 'impact' or 'stroboscopic', not {section!r}")
    if color not in (None, "regime"):
        raise ValueError(f"color must be None or 'regime', not {color!r}")
    if color == "regime" and section == "stroboscopic":
        raise ValueError("color='regime' needs section='impact': only impacts have a regime")

    ax = new_axes(ax)
    handles: list[Artist] = []
    # Of many points as numbers: matplotlib reads colours given as text one by one.
    colors: NDArray[np.float64] | str = BLACK
    if section == "impact":
        parameter, x1 = diagram.impact_parameter, diagram.x1
    else:
        parameter, x1 = diagram.stroboscopic_parameter, diagram.stroboscopic[:, 0]
    if color == "regime":
        order = np.random.default_rng(0).permutation(len(x1))
        regime = np.asarray(diagram.regime)
        colors = to_rgba_array([style.color for style in REGIME_STYLES])[regime[order]]
        parameter, x1 = parameter[order], x1[order]
        handles += regime_handles(np.unique(regime).tolist(), shapes=False)
    elif (chatters := np.asarray(diagram.n) == -1).any():
        offset = diagram.offset if section == "impact" else diagram.stroboscopic_offset
        chattering = np.repeat(chatters, np.diff(offset)).astype(int)
        colors = to_rgba_array([BLACK, CHATTER_COLOR])[chattering]
    ax.scatter(parameter, x1, s=size, c=colors, marker="s", linewidths=0, rasterized=True)

    handles += _chatter_strip(ax, diagram)
    handles += _status_rug(ax, np.asarray(diagram.parameter), list(diagram.status))
    if legend and handles:
        legend_above(ax, handles)
    if len(diagram.parameter) > 1:
        ax.set_xlim(float(np.min(diagram.parameter)), float(np.max(diagram.parameter)))
    name = diagram.parameter_name
    ax.set_xlabel(PARAMETER_SYMBOLS.get(name, name))
    ax.set_ylabel(SECTION_LABELS[section])
    return ax


def contact_fraction(diagram: Diagram, *, ax: Axes | None = None) -> Axes:
    """Draw the part of the time that the bodies are in lasting contact against the parameter.

    The time is that of the kept drive periods, so that for a settled motion this is the part of
    the drive period. Values where nothing is kept leave a gap.

    Parameters
    ----------
    diagram : Diagram
        Result of `vibroimpact.bifurcation_diagram`; its values must increase or decrease.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if None.

    Returns
    -------
    matplotlib.axes.Axes
    """
    ax = new_axes(ax)
    fraction = np.asarray(diagram.contact_fraction)
    ax.fill_between(diagram.parameter, 0.0, fraction, color=SLIDE_STYLE.band, lw=0)
    ax.plot(diagram.parameter, fraction, color=BLACK, lw=0.7)
    ax.set_ylim(bottom=0.0)
    if len(diagram.parameter) > 1:
        ax.set_xlim(float(np.min(diagram.parameter)), float(np.max(diagram.parameter)))
    name = diagram.parameter_name
    ax.set_xlabel(PARAMETER_SYMBOLS.get(name, name))
    ax.set_ylabel("part in contact")
    return ax


def chatter_handles(diagram: Diagram) -> list[Artist]:
    """Return the legend entry of complete chatter, if any value of the diagram has it."""
    if not (np.asarray(diagram.n) == -1).any():
        return []
    return [
        Line2D(
            [],
            [],
            linestyle="none",
            marker="s",
            markersize=4.5,
            markeredgewidth=0,
            color=CHATTER_COLOR,
            label=_CHATTER_TEXT,
        )
    ]


def _chatter_strip(ax: Axes, diagram: Diagram) -> list[Artist]:
    """Mark the values with complete chatter along the top axis; return the legend entry."""
    parameter = np.asarray(diagram.parameter)
    strip = PolyCollection(
        _boxes(_cells(parameter, np.asarray(diagram.n) == -1), 1.0 - _RUG_HEIGHT, 1.0),
        facecolors=CHATTER_COLOR,
        edgecolors=CHATTER_COLOR,
        linewidths=0.4,
        transform=ax.get_xaxis_transform(),
    )
    handles = chatter_handles(diagram)
    if handles:
        strip.set_gid("complete-chatter")
        ax.add_collection(strip, autolim=False)
    return handles


def _boxes(
    cells: list[tuple[float, float]], low: float, high: float
) -> list[list[tuple[float, float]]]:
    return [[(left, low), (left, high), (right, high), (right, low)] for left, right in cells]


def _status_rug(
    ax: Axes, parameter: NDArray[np.float64], status: list[str]
) -> list[PolyCollection]:
    """Mark every value whose run ended early; return the legend entries."""
    kinds = np.asarray(status, dtype=object)
    entries = []
    for row, kind in enumerate(sorted(set(status) - {"completed", "rest"})):
        stopped = kinds == kind
        boxes = _boxes(_cells(parameter, stopped), row * _RUG_HEIGHT, (row + 1) * _RUG_HEIGHT)
        grey = _RUG_GREYS[row % len(_RUG_GREYS)]
        # The outline keeps a single value visible where its cell is narrower than a dot.
        rug = PolyCollection(
            boxes,
            facecolors=grey,
            edgecolors=grey,
            linewidths=0.4,
            transform=ax.get_xaxis_transform(),
            label=f"{kind}: {int(stopped.sum())} of {len(parameter)} values",
        )
        rug.set_gid(f"status-{kind}")
        ax.add_collection(rug, autolim=False)
        entries.append(rug)
    return entries


def _cells(parameter: NDArray[np.float64], chosen: NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Return the intervals of the chosen values, each reaching half way to its neighbours."""
    order = np.argsort(parameter, kind="stable")
    values, mask = parameter[order], chosen[order]
    middle = 0.5 * (values[1:] + values[:-1])
    left = np.concatenate([values[:1], middle])
    right = np.concatenate([middle, values[-1:]])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [
        (float(left[start]), float(right[stop - 1]))
        for start, stop in zip(edges[::2], edges[1::2], strict=True)
    ]
