"""The systems and starts that functions make for the cells of a grid.

They are made in the caller, before anything is computed; for a store chunk by chunk, since its grid
may be larger than the memory. The columns ``system_parameters``, ``system_scales`` and
``initial_state`` of the result keep them; a store compares them when it is resumed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
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
    places
        The numbers of the k combinations, ascending; None for all of them.
    parameters, scales, initials
        Of each combination, shapes (k, parameters), (k, 3), (k, 4); None where no function made it.
    """

    axes: Mapping[str, Array]
    places: NDArray[np.intp] | None = None
    parameters: Array | None = None
    scales: Array | None = None
    initials: Array | None = None

    @property
    def fields(self) -> tuple[Field, ...]:
        """The columns in which they are kept."""
        return tuple(entry for entry, rows in self._columns() if rows is not None)

    def within(self, _grid: Grid, _first: int, _last: int) -> MadeCells:
        """Return what some cells need; here everything is made already."""
        return self

    def _columns(self) -> tuple[tuple[Field, Array | None], ...]:
        return (
            (PARAMETER_FIELD, self.parameters),
            (SCALES_FIELD, self.scales),
            (START_FIELD, self.initials),
        )

    def columns(self, grid: Grid, first: int, last: int) -> dict[str, Array]:
        """Return the columns of the cells first ... last - 1."""
        place = combination_of(self.axes, grid, first, last)
        if self.places is not None:
            place = np.searchsorted(self.places, place)
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


class CellsToMake:
    """Functions that make systems, starts or both for the combinations of values along some axes.

    Each combination is made once, when a cell first needs it. Of the systems the numbers alone are
    kept: a grid may have a million of them.

    Parameters
    ----------
    axes
        The axes on which the functions depend.
    system, initial
        The functions; None where a system or a start is given.
    shared
        Whether cells of several chunks have the same combination: then all are remembered.

    Raises
    ------
    ParameterError, StateError
        Names the values for which a function fails, or gives what does not fit.
    """

    def __init__(
        self,
        axes: Mapping[str, Array],
        *,
        system: Callable[..., System] | None,
        initial: Callable[..., Any] | None,
        shared: bool,
    ) -> None:
        """Check the names of the arguments; make the first combination."""
        self.axes = axes
        self._system, self._initial, self._shared = system, initial, shared
        self._first: System | None = None
        if system is not None:
            check_names(system, [*axes])
        if initial is not None:
            check_names(initial, [*axes], "initial")
        self._known = {0: self._make(0)}
        self.initial = self._known[0].get(START_FIELD.name)

    @property
    def first(self) -> System | None:
        """The system of the first combination; None if no function makes systems."""
        return self._first

    @property
    def fields(self) -> tuple[Field, ...]:
        """The columns in which the numbers are kept."""
        scaled = self._first is not None and self._first.scales is not None
        return (
            *((PARAMETER_FIELD,) if self._system is not None else ()),
            *((SCALES_FIELD,) if scaled else ()),
            *((START_FIELD,) if self._initial is not None else ()),
        )

    def all(self) -> MadeCells:
        """Make all combinations."""
        return self._made(None, range(math.prod(map(len, self.axes.values()))))

    def within(self, grid: Grid, first: int, last: int) -> MadeCells:
        """Make what the cells first ... last - 1 need."""
        places = np.unique(combination_of(self.axes, grid, first, last))
        return self._made(places, places.tolist())

    def columns(self, grid: Grid, first: int, last: int) -> dict[str, Array]:
        """Return the columns of the cells first ... last - 1."""
        return self.within(grid, first, last).columns(grid, first, last)

    def values(self, grid: Grid, first: int, last: int) -> dict[str, Array]:
        """Return what is set in each cell: parameters of the system, and coordinates."""
        return self.within(grid, first, last).values(grid, first, last)

    def _made(self, places: NDArray[np.intp] | None, numbers: Sequence[int]) -> MadeCells:
        columns = {
            entry.name: np.full((len(numbers), *entry.shape), math.nan) for entry in self.fields
        }
        for row, place in enumerate(numbers):
            made_here = self._known.pop(place, None) or self._make(place)
            for name, column in columns.items():
                column[row] = made_here[name]
            if self._shared and places is not None:
                self._known[place] = made_here
        return MadeCells(
            axes=self.axes,
            places=places,
            parameters=columns.get(PARAMETER_FIELD.name),
            scales=columns.get(SCALES_FIELD.name),
            initials=columns.get(START_FIELD.name),
        )

    def _make(self, place: int) -> dict[str, Any]:
        """Call the functions for a combination."""
        values = combination(self.axes, place)
        rows: dict[str, Any] = {}
        if self._system is not None:
            system = self._checked(made(self._system, values), values)
            rows[PARAMETER_FIELD.name] = rows_of([system])[0]
            scales = system.scales
            rows[SCALES_FIELD.name] = (
                (math.nan,) * 3 if scales is None else (scales.length, scales.mass, scales.time)
            )
        if self._initial is not None:
            start = called(self._initial, values)
            try:
                rows[START_FIELD.name] = state(start)
            except StateError as error:
                raise StateError(f"at {in_words(values)}: {error}") from error
        return rows

    def _checked(self, system: System, values: Mapping[str, float]) -> System:
        """Return a system that a function made, if it fits.

        Runs are counted in drive periods, and contact and law are the same in all cells.
        """
        if system.drive_frequency == 0.0:
            raise ParameterError(
                f"at {in_words(values)}: drive_frequency = 0.0 is not allowed; allowed: a number "
                "> 0: runs are counted in drive periods"
            )
        first = self._first = self._first or system
        for name in ("contact", "law"):
            found, allowed = getattr(system, name), getattr(first, name)
            if found != allowed:
                raise ParameterError(
                    f"at {in_words(values)}: {name} = {found!r} is not allowed; allowed: "
                    f"{allowed!r}, as for the first values"
                )
        if first.scales is None and system.scales is not None:
            raise ParameterError(
                f"at {in_words(values)}: scales = {system.scales!r} is not allowed; allowed: None, "
                "as for the first values"
            )
        return system


# What functions made for cells, or will make.
Made = MadeCells | CellsToMake


def combination_of(
    axes: Mapping[str, Array], grid: Grid, first: int, last: int
) -> NDArray[np.intp]:
    """Return which combination of the values along some axes each of the cells has."""
    places = np.unravel_index(np.arange(first, last), grid.shape or (1,))
    names = [*grid.axes]
    own = tuple(places[names.index(name)] for name in axes)
    if not own:
        return np.zeros(last - first, np.intp)
    return np.ravel_multi_index(own, tuple(map(len, axes.values())))


def combination(axes: Mapping[str, Array], place: int) -> dict[str, float]:
    """Return the numbers of a combination, as keywords."""
    places = np.unravel_index(place, tuple(map(len, axes.values()))) if axes else ()
    return {
        name: float(values[at]) for (name, values), at in zip(axes.items(), places, strict=True)
    }


def made_cells(
    system: Any, initial: Any, axes: Mapping[str, Array], *, stored: bool = False
) -> tuple[System, Any, Made | None]:
    """Return a system, a start and what functions make for a grid; None if no function is given.

    The system and the start are those of the first combination where a function makes them.

    Parameters
    ----------
    system, initial
        As the user gave them.
    axes
        All axes of the grid.
    stored
        Whether the results go to a store: then the functions are called chunk by chunk.

    Raises
    ------
    ParameterError, StateError
        Names the values for which a function fails, or gives what does not fit.
    """
    own = {
        name: values
        for name, values in axes.items()
        if name not in COORDINATES or (is_maker(system) and takes(system, name))
    }
    # A number of the function may have the name of a coordinate. The axis alone does not say that
    # the start stays the same, so the starts are kept.
    keeps_start = not own.keys().isdisjoint(COORDINATES) and not is_maker(initial)
    if not (is_maker(system) or is_maker(initial) or keeps_start):
        return system, initial, None
    starts: Callable[..., Any] | None = initial if is_maker(initial) else None
    if keeps_start and states(initial).ndim < 2:
        start = state(initial)
        starts = partial(_the_same, start)
    making = CellsToMake(
        own,
        system=system if is_maker(system) else None,
        initial=starts,
        shared=len(own) < len(axes),
    )
    first = system if making.first is None else making.first
    return first, making.initial or initial, making if stored else making.all()


def _the_same(start: tuple[float, float, float, float], **_: float) -> tuple[float, ...]:
    return start


def scales_at(row: Sequence[float]) -> Scales | None:
    """Return the scales that a row of the column ``system_scales`` holds."""
    length, mass, time = map(float, row)
    return None if math.isnan(length) else Scales(length=length, mass=mass, time=time)


def entry_name(column: str, place: int) -> str:
    """Return what an entry of one of the columns is, for messages."""
    names = {PARAMETER_FIELD.name: [*PARAMETERS], START_FIELD.name: [*COORDINATES]}
    return names.get(column, ["length", "mass", "time"])[place]
