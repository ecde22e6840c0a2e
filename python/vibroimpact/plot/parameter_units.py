"""Axes of parameters in SI, and the scales of the systems along a diagram or a branch.

A parameter has the unit by which `System.from_physical` has divided it; theory page, section 1.
Ratios, the friction and the phase are pure numbers. The number of a function that makes the system
has the unit that the function gives it: that of `System.from_physical`, or Hz, where it has the
name of such a quantity and its value in all systems that are looked at.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from ..arguments import reject
from ..machine_kinds import is_structure
from ..made import MadeStructure, made_from, value_of
from ..orbits.branch import Piece
from ..scales import COLUMN_UNITS, Scales, needed
from ..structure import Structure
from ..sweeps import Diagram
from ..sweeps.columns import COORDINATES
from ..sweeps.grid_machine import START
from ..sweeps.results import GridResult
from ..system import System
from .axis_names import PARAMETER_SYMBOLS, axis_name, in_unit, structure_axis_name, worded

Array = NDArray[np.float64]

# Symbol in SI, property of `Scales`, sign in print.
_IN_SI: Final[Mapping[str, tuple[str, str, str]]] = {
    "drive_frequency": (r"$\Omega$", "frequency", "rad/s"),
    "gap": (r"$\Delta$", "length", "m"),
    "moment_amplitude": (r"$f_{10}$", "energy", "N m"),
    "force_amplitude": (r"$f_{20}$", "force", "N"),
    "static_moment": (r"$C_{10}$", "energy", "N m"),
    "static_force": (r"$F_{20}$", "force", "N"),
}

# Of each quantity of a function: symbol and sign in print, and its part of the quantity in SI.
_QUANTITIES: Final[Mapping[str, tuple[tuple[str, str, float], ...]]] = {
    "pendulum_mass": (("$M_1$", "kg", 1.0),),
    "oscillator_mass": (("$M_2$", "kg", 1.0),),
    "length": (("$l$", "m", 1.0),),
    "torsional_stiffness": (("$K_1$", "N m/rad", 1.0),),
    "stiffness": (("$K_2$", "N/m", 1.0),),
    "torsional_damping": (("$C_1$", "N m s/rad", 1.0),),
    "damping": (("$C_2$", "N s/m", 1.0),),
    "moment_amplitude": (("$f_{10}$", "N m", 1.0),),
    "force_amplitude": (("$f_{20}$", "N", 1.0),),
    "static_moment": (("$C_{10}$", "N m", 1.0),),
    "static_force": (("$F_{20}$", "N", 1.0),),
    "drive_frequency": ((r"$\Omega$", "rad/s", 1.0), (r"$\Omega/2\pi$", "Hz", math.tau)),
    "gap": ((r"$\Delta$", "m", 1.0),),
    "restitution": ((PARAMETER_SYMBOLS["restitution"], "", 1.0),),
    "friction": ((PARAMETER_SYMBOLS["friction"], "", 1.0),),
    "phase": ((PARAMETER_SYMBOLS["phase"], "", 1.0),),
}
# A quantity that has gone through its dimensionless number differs by roundings.
_SAME = 1e-9


def quantity_label(name: str, points: Iterable[tuple[float, System]]) -> str:
    """Return the label of the axis of a function's number, with its unit where that is known.

    Parameters
    ----------
    name
        Of the number.
    points
        Some of its values, each with the system that the function makes.
    """
    pairs = [(value, _quantity(name, system)) for value, system in points]
    for symbol, sign, factor in _QUANTITIES.get(name, ()):
        if pairs and all(
            math.isclose(factor * value, own, rel_tol=_SAME, abs_tol=1e-300) for value, own in pairs
        ):
            said = worded(name, symbol)
            return f"{said} ({sign})" if sign else said
    return axis_name(name, made=True)


def _quantity(name: str, system: System) -> float:
    """Return a quantity of a system in SI; NaN where it is not known."""
    if system.scales is None or system.mass_ratio == 0.0 or name not in _QUANTITIES:
        return math.nan
    value: float = system.to_physical()[name]
    return value


def grid_label(result: GridResult, name: str) -> str:
    """Return the label of an axis of a result."""
    if is_structure(result.system):
        return structure_axis_name(name, made=result.is_made, stops=result.system.stops)
    if not result.is_made:
        return axis_name(name, made=False)
    grid = result.columns.grid
    place, values = [*grid.axes].index(name), grid.axes[name]
    cells = [[0] * len(grid.shape) for _ in range(2)]
    cells[1][place] = len(values) - 1
    at = [(float(values[cell[place]]), result.system_at(*cell), tuple(cell)) for cell in cells]
    if name not in COORDINATES:
        return quantity_label(name, [point[:2] for point in at])
    starts = result.columns[START] if START in result.columns else None  # noqa: SIM401
    for value, system, cell in at:
        if starts is None or system.scales is None:
            return axis_name(name, made=True)
        own = system.scales.to_si(starts[cell])[COORDINATES.index(name)]
        if not math.isclose(value, own, rel_tol=_SAME, abs_tol=1e-300):
            return axis_name(name, made=True)
    return with_unit(axis_name(name, made=True), name, is_si=True)


def piece_label(name: str, system: System | Structure) -> str:
    """Return the label of the axis of what is varied along a branch or a curve."""
    if isinstance(system, Structure):
        made = isinstance(system, MadeStructure)
        return structure_axis_name(name, made=made, stops=system.stops)
    if made_from(system, [name]) is None:
        return axis_name(name, made=False)
    return quantity_label(name, [(value_of(system, name), system)])


def piece_axis(name: str, system: System | Structure, *, is_si: bool) -> tuple[float, str]:
    """Return the factor and the label of the axis of what is varied along a branch."""
    if isinstance(system, Structure) or made_from(system, [name]) is not None:
        return 1.0, piece_label(name, system)
    return parameter_axis(name, system, is_si=is_si)


def parameter_axis(name: str, system: System, *, is_si: bool) -> tuple[float, str]:
    """Return the factor and the label of the axis of a parameter.

    Raises
    ------
    ParameterError
        In SI, if the system has no scales, and for a force on a wall, whose mass is not known.
    """
    if not is_si or name not in _IN_SI:
        return 1.0, axis_name(name, made=False)
    symbol, unit, sign = _IN_SI[name]
    factor: float = getattr(needed(system.scales), unit)
    # f2 = f20/(K2 l), c2 = F20/(K2 l), and K2 l = M2 l omega_2^2: the unit of forces is that of M1.
    if name in ("force_amplitude", "static_force"):
        if system.mass_ratio == 0.0:
            reject("mass_ratio", 0.0, f"a number > 0 for {name} in N: a wall has no mass")
        factor /= system.mass_ratio
    return factor, f"{worded(name, symbol)} ({sign})"


# Part of the range of a parameter to either side of it, so that no point lies on the frame.
_ROOM = 0.01


def along_parameter(ax: Axes, values: Array, label: str) -> None:
    """Let the first axis be that of the values of a parameter, and end just beyond them."""
    if len(values) > 1:
        first, last = float(values.min()), float(values.max())
        room = _ROOM * (last - first)
        ax.set_xlim(first - room, last + room)
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
    sign = COLUMN_UNITS[column][1] if is_si else ""
    return in_unit(text, sign)
