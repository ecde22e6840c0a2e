"""Bifurcation diagrams of structures: a section of the motion against the varied number."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ..arguments import count, naming, reject
from ..sweeps.structure_diagram_results import StructureDiagram
from .parameter_units import along_parameter, grid_label
from .style import BLACK, STOPS, coordinate_symbol, curve_legend, new_axes

Array = NDArray[np.float64]

# A stop has the colour that it has in time histories.
_STOP_COLORS = tuple(color for color, _ in STOPS)
_IMPACT_VALUES = {
    "approach_velocity": "approach velocity $u$ at impacts",
    "phase": r"drive phase $\psi$ at impacts",
    "impulse_normal": "impulse $P$ of impacts",
    "energy_loss": "energy loss of impacts",
}


@naming
def structure_bifurcation(
    diagram: StructureDiagram,
    *,
    section: Literal["impact", "stroboscopic"] = "impact",
    value: str | None = None,
    coordinate: int = 0,
    size: float = 1.0,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw a section of structures against the varied number.

    Points whose run did not come to its end are marked by a grey rug along the bottom.

    Parameters
    ----------
    diagram : StructureDiagram
        Result of `vibroimpact.bifurcation_diagram` of a structure.
    section : {"impact", "stroboscopic"}
        The impacts, coloured by their stop, or the states once per drive period.
    value : str, optional
        Of impacts "approach_velocity", the default, "phase", "impulse_normal", "energy_loss", "q",
        "v_pre" or "v_post"; of sections "q", the default, or "v".
    coordinate : int
        Of "q" and "v" this coordinate, from 0.
    size : float
        Area of a point in square points.
    legend : bool
        Name the stops, where there are several.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; new ones by default.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind or out of range.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> oscillator = vi.Structure([[1]], [[1]], [vi.Stop([1], 0.3, 0.8)], damping_ratios=[0.05],
    ...                           drive_amplitude=[1], drive_frequency=2.0)
    >>> diagram = vi.bifurcation_diagram(oscillator, initial=[[0], [0]],
    ...                                  drive_frequency=[1.9, 2.0, 2.05], periods=200, keep=50)
    >>> vi.plot.structure_bifurcation(diagram, section="stroboscopic").get_ylabel()
    '$q_0$ once per drive period'
    """
    if not isinstance(diagram, StructureDiagram):
        reject("diagram", diagram, "a StructureDiagram")
    known = {"impact": [*_IMPACT_VALUES, "q", "v_pre", "v_post"], "stroboscopic": ["q", "v"]}
    if section not in known:
        reject("section", section, "'impact' or 'stroboscopic'")
    value = known[section][0] if value is None else value
    if value not in known[section]:
        reject("value", value, f"one of {', '.join(known[section])} for section={section!r}")
    most = diagram.system.coordinates - 1
    coordinate = count("coordinate", coordinate, least=0, most=most)
    axes = new_axes(ax)
    style: dict[str, Any] = {"s": size, "linewidths": 0, "rasterized": True}
    if section == "stroboscopic":
        states = diagram.stroboscopic[:, int(value == "v"), coordinate]
        axes.scatter(diagram.stroboscopic_parameter, states, color=BLACK, **style)
        axes.set_ylabel(value_label(section, value, coordinate))
    else:
        _draw_impacts(axes, diagram, value, coordinate, style, legend)
    ended = np.isin(diagram.status, ("completed", "restarted", "rest"))
    if not ended.all():
        across = axes.get_xaxis_transform()
        missing = diagram.parameter[~ended]
        axes.vlines(missing, 0, 0.03, color="0.45", transform=across, linewidth=0.8)
    along_parameter(axes, diagram.values, grid_label(diagram, diagram.parameter_name))
    return axes


def _draw_impacts(
    axes: Axes,
    diagram: StructureDiagram,
    value: str,
    coordinate: int,
    style: dict[str, Any],
    legend: bool,
) -> None:
    if not diagram.offset[-1]:
        axes.text(0.5, 0.5, "no impact in the kept drive periods", transform=axes.transAxes,
                  ha="center", va="center")  # fmt: skip
        return
    impacts = diagram.impacts
    column = impacts[value]
    column = column[:, coordinate] if column.ndim == 2 else column
    stops = impacts["stop"]
    present = np.unique(stops).tolist()
    # In a fixed random order, so that no stop hides the others.
    order = np.random.default_rng(0).permutation(len(column))
    colors = np.array([_STOP_COLORS[stop % len(_STOP_COLORS)] for stop in stops.tolist()])
    several = len(present) > 1
    axes.scatter(
        diagram.impact_parameter[order],
        column[order],
        c=colors[order] if several else BLACK,
        **style,
    )
    if several:
        entries = {f"stop {stop}": _STOP_COLORS[stop % len(_STOP_COLORS)] for stop in present}
        handles = [
            Line2D([], [], marker="o", linestyle="", color=color, markersize=4, label=name)
            for name, color in entries.items()
        ]
        curve_legend(axes, legend, handles)
    axes.set_ylabel(value_label("impact", value, coordinate))


def value_label(section: str, value: str, coordinate: int) -> str:
    """Return the name on the axis of what of a section is drawn."""
    if section == "stroboscopic":
        return f"${coordinate_symbol(value, coordinate)}$ once per drive period"
    return _IMPACT_VALUES.get(value, f"${coordinate_symbol(value, coordinate)}$ at impacts")
