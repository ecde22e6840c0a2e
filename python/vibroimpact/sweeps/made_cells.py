"""The systems and starts that functions made for the cells of a grid, before anything is computed.

The columns ``system_parameters``, ``system_scales`` and ``initial_state`` of the result keep them;
a store compares them when it is resumed.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import PARAMETERS
from ..arguments import state, states
from ..errors import ParameterError, StateError
from ..made import called, check_names, in_words, is_maker, made, rows_of, takes
from ..scales import Scales
from ..system import System
from .columns import COORDINATES
from .fields import Field
from .grid import Grid

Array = NDArray[np.float64]

PARAMETER_FIELD = Field(
    "system_parameters",
    "float64",
    f"parameters of the system that the function made: {', '.join(PARAMETERS)}",
    (len(PARAMETERS),),
    ("system_parameter",),
)
SCALES_FIELD = Field(
    "system_scales", "float64", "its scales: length, mass, time in SI", (3,), ("scale",)
)
START_FIELD = Field(
    "initial_state", "float64", "x1, v1, x2, v2 at t = 0, from the function", (4,), ("coordinate",)
)


@dataclass(frozen=True, kw_only=True, eq=False)
class MadeCells:
    """What functions of the values along some axes made: k combinations, in C order.

    Attributes
    ----------
    axes
        The axes on which the functions depend.
    parameters, scales, initials
        Of each combination, shapes (k, parameters), (k, 3), (k, 4); None where no function made it.
    """

    axes: Mapping[str, Array]
    parameters: Array | None = None
    scales: Array | None = None
    initials: Array | None = None

    @property
    def fields(self) -> tuple[Field, ...]:
        """The columns in which they are kept."""
        return tuple(entry for entry, rows in self._columns() if rows is not None)

    def _columns(self) -> tuple[tuple[Field, Array | None], ...]:
        return (
            (PARAMETER_FIELD, self.parameters),
            (SCALES_FIELD, self.scales),
            (START_FIELD, self.initials),
        )

    def columns(self, grid: Grid, first: int, last: int) -> dict[str, Array]:
        """Return the columns of the cells first ... last - 1."""
        place = self._places(grid, first, last)
        columns = {entry.name: rows[place] for entry, rows in self._columns() if rows is not None}
        if self.initials is not None:
            # What is varied beside the functions takes the place of what they gave.
            for name, values in grid.values(first, last).items():
                if name in COORDINATES and name not in self.axes:
                    columns[START_FIELD.name][:, COORDINATES.index(name)] = values
        return columns

    def values(self, grid: Grid, first: int, last: int) -> dict[str, Array]:
        """Return what is set in each cell: parameters of the system, and coordinates."""
        values = grid.values(first, last)
        columns = self.columns(grid, first, last)
        if self.parameters is not None:
            coordinates = [name for name in values if name in COORDINATES and name not in self.axes]
            rows = columns[PARAMETER_FIELD.name].T
            values = dict(zip(PARAMETERS, rows, strict=True)) | {
                name: values[name] for name in coordinates
            }
        if self.initials is not None:
            values |= dict(zip(COORDINATES, columns[START_FIELD.name].T, strict=True))
        return values

    def _places(self, grid: Grid, first: int, last: int) -> NDArray[np.intp]:
        """Return the combination that each cell has."""
        places = np.unravel_index(np.arange(first, last), grid.shape or (1,))
        names = [*grid.axes]
        own = tuple(places[names.index(name)] for name in self.axes)
        shape = tuple(len(values) for values in self.axes.values())
        if not own:
            return np.zeros(last - first, np.intp)
        return np.ravel_multi_index(own, shape)


def combinations(axes: Mapping[str, Array]) -> Iterator[dict[str, float]]:
    """Yield the numbers of each combination, as keywords."""
    for numbers in itertools.product(*axes.values()):
        yield dict(zip(axes, map(float, numbers), strict=True))


def systems_of(
    function: Callable[..., System], axes: Mapping[str, Array]
) -> tuple[System, Array, Array | None]:
    """Make the systems of all combinations; return the first, all parameters and all scales.

    Of the others the numbers alone are kept: a grid may have a million of them.

    Raises
    ------
    ParameterError
        Names the values for which the function fails, or makes a system that does not fit: runs are
        counted in drive periods, and contact and law are the same in all cells.
    """
    check_names(function, [*axes])
    count = math.prod(map(len, axes.values()))
    parameters, scales = np.empty((count, len(PARAMETERS))), np.full((count, 3), math.nan)
    first: System | None = None
    for place, values in enumerate(combinations(axes)):
        system = made(function, values)
        if system.drive_frequency == 0.0:
            raise ParameterError(
                f"at {in_words(values)}: drive_frequency = 0.0 is not allowed; allowed: a number "
                "> 0: runs are counted in drive periods"
            )
        first = first or system
        for name in ("contact", "law"):
            found, allowed = getattr(system, name), getattr(first, name)
            if found != allowed:
                raise ParameterError(
                    f"at {in_words(values)}: {name} = {found!r} is not allowed; allowed: "
                    f"{allowed!r}, as for the first values"
                )
        parameters[place] = rows_of([system])
        if (known := system.scales) is not None:
            scales[place] = known.length, known.mass, known.time
    assert first is not None  # every axis has values
    return first, parameters, None if np.isnan(scales).all() else scales


def starts_of(function: Callable[..., Any], axes: Mapping[str, Array]) -> Array:
    """Return the starts of all combinations, shape (k, 4).

    Raises
    ------
    ParameterError, StateError
        Names the values for which the function fails, or gives what is no start.
    """
    check_names(function, [*axes], "initial")
    rows = []
    for values in combinations(axes):
        start = called(function, values)
        try:
            rows.append(state(start))
        except StateError as error:
            raise StateError(f"at {in_words(values)}: {error}") from error
    return np.array(rows)


def made_cells(system: Any, initial: Any, axes: Mapping[str, Array]) -> tuple[System, Any, Any]:
    """Return a system, a start and the `MadeCells` of a grid; None if no function is given.

    The system and the start are those of the first combination where a function makes them.
    """
    own = {
        name: values
        for name, values in axes.items()
        if name not in COORDINATES or (is_maker(system) and takes(system, name))
    }
    parts: dict[str, Array | None] = {}
    if is_maker(system):
        system, parts["parameters"], parts["scales"] = systems_of(system, own)
    if is_maker(initial):
        starts = parts["initials"] = starts_of(initial, own)
        initial = tuple(starts[0].tolist())
    elif not own.keys().isdisjoint(COORDINATES) and states(initial).ndim < 2:
        # A number of the function has the name of a coordinate. The axis alone does not say that
        # the start stays the same, so the starts are kept.
        count = math.prod(map(len, own.values()))
        parts["initials"] = np.tile(np.array(state(initial)), (count, 1))
    return system, initial, MadeCells(axes=own, **parts) if parts else None


def scales_at(row: Sequence[float]) -> Scales | None:
    """Return the scales that a row of the column ``system_scales`` holds."""
    length, mass, time = map(float, row)
    return None if math.isnan(length) else Scales(length=length, mass=mass, time=time)


def entry_name(column: str, place: int) -> str:
    """Return what an entry of one of the columns is, for messages."""
    names = {PARAMETER_FIELD.name: [*PARAMETERS], START_FIELD.name: [*COORDINATES]}
    return names.get(column, ["length", "mass", "time"])[place]
