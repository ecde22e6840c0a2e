"""What of a bifurcation diagram of structures is drawn."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ..arguments import count, reject
from ..sweeps.structure_diagram_results import StructureDiagram
from .style import STOPS, coordinate_symbol

Array = NDArray[np.float64]

_IMPACT_VALUES = {
    "approach_velocity": "approach velocity $u$ at impacts",
    "phase": r"drive phase $\psi$ at impacts",
    "impulse_normal": "impulse $P$ of impacts",
    "energy_loss": "energy loss of impacts",
}
_KNOWN = {"impact": [*_IMPACT_VALUES, "q", "v_pre", "v_post"], "stroboscopic": ["q", "v"]}


def heights_of_structures(
    diagram: StructureDiagram, section: str, value: Any, coordinate: Any
) -> tuple[str, Array, str]:
    """Return what of a section is drawn, its numbers, and their name on the axis."""
    known = _KNOWN[section]
    value = known[0] if value is None else value
    if not isinstance(value, str) or value not in known:
        reject("value", value, f"one of {', '.join(known)} for section={section!r}")
    most = diagram.system.coordinates - 1
    place = 0 if coordinate is None else count("coordinate", coordinate, least=0, most=most)
    text = value_label(section, value, place)
    if section == "stroboscopic":
        return value, diagram.stroboscopic[:, int(value == "v"), place], text
    column = np.asarray(diagram.impacts[value])
    return value, column[:, place] if column.ndim == 2 else column, text


def stop_colors(diagram: StructureDiagram) -> tuple[list[str], NDArray[np.int64], list[Artist]]:
    """Return the colours of stops, which of them each impact has, and the legend entries."""
    palette = [color for color, _ in STOPS]
    stops = np.asarray(diagram.impacts["stop"])
    handles: list[Artist] = [
        Line2D(
            [],
            [],
            marker="o",
            linestyle="",
            color=palette[stop % len(palette)],
            markersize=4,
            label=f"stop {stop}",
        )
        for stop in np.unique(stops).tolist()
    ]
    return palette, stops % len(palette), handles


def value_label(section: str, value: str, coordinate: int) -> str:
    """Return the name on the axis of what of a section is drawn."""
    if section == "stroboscopic":
        return f"${coordinate_symbol(value, coordinate)}$ once per drive period"
    return _IMPACT_VALUES.get(value, f"${coordinate_symbol(value, coordinate)}$ at impacts")
