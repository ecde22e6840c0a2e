"""What of a bifurcation diagram of structures is drawn."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ..sweeps.structure_diagram_results import StructureDiagram
from .coordinates import Combination, axis_of, in_section
from .style import STOPS

Array = NDArray[np.float64]

_IMPACT_VALUES = {
    "approach_velocity": "approach velocity $u$ at impacts",
    "phase": r"drive phase $\psi$ at impacts",
    "impulse_normal": "normal impulse $P$ of impacts",
    "energy_loss": "energy loss of impacts",
}
# Columns of single numbers, and of N.
_KNOWN: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "impact": ((*_IMPACT_VALUES,), ("q", "v_pre", "v_post")),
    "stroboscopic": ((), ("q", "v")),
}


def heights_of_structures(
    diagram: StructureDiagram, section: str, value: Any, coordinate: Any
) -> tuple[str, Array, str]:
    """Return what of a section is drawn, its numbers, and their name on the axis."""
    narrow, wide = _KNOWN[section]
    usual = (*narrow, *wide)[0]
    value, part = in_section(
        value, coordinate, diagram.system, wide=wide, narrow=narrow, usual=usual
    )
    text = value_label(section, value, part)
    if section == "stroboscopic":
        column = diagram.stroboscopic[:, int(value == "v")]
    else:
        column = np.asarray(diagram.impacts[value])
    return value, column if part is None else part.of(column), text


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


def value_label(section: str, value: str, part: Combination | None) -> str:
    """Return the name on the axis of what of a section is drawn."""
    if part is None:
        return _IMPACT_VALUES[value]
    when = "once per drive period" if section == "stroboscopic" else "at impacts"
    return f"{axis_of([part], value)} {when}"
