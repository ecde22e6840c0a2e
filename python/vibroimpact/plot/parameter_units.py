"""Axes of parameters in SI, and the scales of the systems along a diagram or a branch.

A parameter has the unit by which `System.from_physical` has divided it; theory page, section 1.
Ratios, the friction and the phase are pure numbers. The number of a function that makes the system
has the unit that the function gives it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from ..made import made_from
from ..orbits.branch import Piece
from ..scales import COLUMN_UNITS, Scales, needed
from ..sweeps import Diagram
from ..system import System
from .style import axis_name

Array = NDArray[np.float64]

# Symbol in SI, property of `Scales`, sign in print.
_IN_SI: Final[Mapping[str, tuple[str, str, str]]] = {
    "drive_frequency": (r"$\Omega$", "frequency", "rad/s"),
    "gap": (r"$\Delta$", "length", "m"),
    "moment_amplitude": (r"$f_{10}$", "energy", "N m"),
    "force_amplitude": (r"$f_{20}$", "force", "N"),
}


def parameter_axis(name: str, system: System, *, made: bool, is_si: bool) -> tuple[float, str]:
    """Return the factor and the label of the axis of a parameter.

    Raises
    ------
    ParameterError
        In SI, if the system has no scales.
    """
    if not is_si or made or name not in _IN_SI:
        return 1.0, axis_name(name, made=made)
    symbol, unit, sign = _IN_SI[name]
    factor: float = getattr(needed(system.scales), unit)
    # f2 = f20/(K2 l), and K2 l = M2 l omega_2^2: the unit of forces is that of M1.
    if name == "force_amplitude":
        factor /= system.mass_ratio
    return factor, f"{symbol} ({sign})"


def along_parameter(ax: Axes, values: Array, label: str) -> None:
    """Let the first axis be that of the values of a parameter, and end with them."""
    if len(values) > 1:
        ax.set_xlim(float(values.min()), float(values.max()))
    ax.set_xlabel(label)


def point_factors(diagram: Diagram, column: str) -> Array:
    """Return the factor of a column of the sections at each point of a diagram, shape (points,).

    Raises
    ------
    ParameterError
        If a system has no scales.
    """
    count = len(diagram)
    if not diagram.is_made:
        return np.full(count, _factor(diagram.system.scales, column))
    return np.array([_factor(diagram.system_at(i).scales, column) for i in range(count)])


def piece_factors(piece: Piece, column: str) -> Array:
    """Return the factor of a column at each point of a piece of a branch, shape (k,)."""
    if made_from(piece.system, [piece.parameter]) is None:
        return np.full(len(piece.values), _factor(piece.system.scales, column))
    systems = (piece._system_at(k) for k in range(len(piece.values)))
    return np.array([_factor(system.scales, column) for system in systems])


def _factor(scales: Scales | None, column: str) -> float:
    unit = COLUMN_UNITS[column][0]
    factor: float = getattr(needed(scales), unit) if unit else 1.0
    return factor


def with_unit(text: str, column: str, *, is_si: bool) -> str:
    """Return the label of an axis with the sign of the unit of a column, in SI."""
    sign = COLUMN_UNITS[column][1]
    return f"{text} ({sign})" if is_si and sign else text
