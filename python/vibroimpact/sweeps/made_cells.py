"""The systems and starts that functions make for the cells of a grid.

They are made in the caller, before anything is computed; for a store chunk by chunk, since its grid
may be larger than the memory. The columns ``system_parameters`` and ``system_scales``, of
structures ``system_numbers``, and ``initial_state`` of the result keep them; a store compares them
when it is resumed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ParameterError, StateError
from ..machine_kinds import is_maker
from ..made import called, check_names, in_words, made, takes
from ..structure import Structure
from ..system import System
from .columns import COORDINATES
from .fields import Field
from .grid import Grid
from .grid_machine import START, GridMachine, start_field, with_coordinates
from .machines import machine_of

Array = NDArray[np.float64]

# What a function may make.
_KINDS = (System, Structure)


@dataclass(frozen=True, kw_only=True, eq=False)
class MadeCells:
    """What functions of the values along some axes made: k combinations, in C order.

    Attributes
    ----------
    machine
        The machine of the first combination.
    axes
        The axes on which the functions depend.
    fields
        The columns in which it is kept.
    made
        Of each column the rows of the combinations, shape (k, ...).
    places
        The numbers of the k combinations, ascending; None for all of them.
    """

    machine: GridMachine
    axes: Mapping[str, Array]
    fields: tuple[Field, ...]
    made: Mapping[str, Array]
    places: NDArray[np.intp] | None = None

    def within(self, _grid: Grid, _first: int, _last: int) -> MadeCells:
        """Return what some cells need; here everything is made already."""
        return self

    def columns(self, grid: Grid, first: int, last: int) -> dict[str, Array]:
        """Return the columns of the cells first ... last - 1."""
        place = combination_of(self.axes, grid, first, last)
        if self.places is not None:
            place = np.searchsorted(self.places, place)
        columns = {name: rows[place] for name, rows in self.made.items()}
        if START in columns:
            # What is varied beside the functions takes the place of what they gave.
            values = grid.values(first, last)
            beside = {name: values[name] for name in values if name not in self.axes}
            with_coordinates(self.machine, columns[START], beside)
        return columns


class CellsToMake:
    """Functions that make machines, starts or both for the combinations of values along some axes.

    Each combination is made once, when a cell first needs it. Of the machines the numbers alone are
    kept: a grid may have a million of them.

    Parameters
    ----------
    axes
        The axes on which the functions depend.
    system, initial
        The machine and the start, or the functions that make them.
    shared
        Whether cells of several chunks have the same combination: then all are remembered.
    keeps
        Whether one start that is given is kept for each combination.

    Raises
    ------
    ParameterError, StateError
        Names the values for which a function fails, or gives what does not fit.
    """

    def __init__(
        self, axes: Mapping[str, Array], *, system: Any, initial: Any, shared: bool, keeps: bool
    ) -> None:
        """Check the names of the arguments; make the first combination."""
        self.axes = axes
        self._system, self._initial, self._shared = system, initial, shared
        for what, given in (("system", system), ("initial", initial)):
            if is_maker(given):
                check_names(given, [*axes], what)
        values = combination(axes, 0)
        first = made(system, values, *_KINDS) if is_maker(system) else system
        self.machine = machine_of(first)
        if keeps and first._starts(initial).ndim == len(self.machine.final_state.shape):
            self._initial = partial(_the_same, initial)
        self._known = {0: self._rows(first, values)}
        self.initial = self._known[0].get(START)

    @property
    def fields(self) -> tuple[Field, ...]:
        """The columns in which the numbers are kept."""
        return (
            *(self.machine.made_fields if is_maker(self._system) else ()),
            *((start_field(self.machine),) if is_maker(self._initial) else ()),
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

    def _made(self, places: NDArray[np.intp] | None, numbers: Sequence[int]) -> MadeCells:
        fields = self.fields
        columns = {entry.name: np.full((len(numbers), *entry.shape), math.nan) for entry in fields}
        for row, place in enumerate(numbers):
            made_here = self._known.pop(place, None) or self._make(place)
            for name, column in columns.items():
                column[row] = made_here[name]
            if self._shared and places is not None:
                self._known[place] = made_here
        return MadeCells(
            machine=self.machine, axes=self.axes, fields=fields, made=columns, places=places
        )

    def _make(self, place: int) -> dict[str, Any]:
        """Call the functions for a combination."""
        values = combination(self.axes, place)
        makes = is_maker(self._system)
        system = made(self._system, values, *_KINDS) if makes else self._system
        return self._rows(system, values)

    def _rows(self, system: Any, values: Mapping[str, float]) -> dict[str, Any]:
        """Return what is kept of a machine, and the start that a function makes for it."""
        rows: dict[str, Any] = {}
        if is_maker(self._system):
            if system.drive_frequency == 0.0:
                raise ParameterError(
                    f"at {in_words(values)}: drive_frequency = 0.0 is not allowed; allowed: a "
                    "number > 0: runs are counted in drive periods"
                )
            rows |= self.machine.row(system, values)
        makes = is_maker(self._initial)
        start = called(self._initial, values) if makes else self._initial
        # A start must fit the machine of its cell.
        own = machine_of(system)
        try:
            checked = own.start(start) if makes else own.starts(start)
        except StateError as error:
            if not makes and system is self.machine.system:
                raise
            raise StateError(f"at {in_words(values)}: {error}") from error
        if makes:
            rows[START] = checked
        return rows


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


# What may be a number of a start; which of them are is known once there is a machine.
_COORDINATE = re.compile(r"[qv]_(0|[1-9]\d*)")


def _may_move_start(name: str) -> bool:
    return name in COORDINATES or _COORDINATE.fullmatch(name) is not None


def made_cells(
    system: Any, initial: Any, axes: Mapping[str, Array], *, stored: bool = False
) -> tuple[GridMachine, Any, Made | None]:
    """Return a machine, a start and what functions make for a grid; None if no function is given.

    The machine and the start are those of the first combination where a function makes them.

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
    makes = is_maker(system)
    known = None if makes else machine_of(system)

    def is_own(name: str) -> bool:
        """Whether an axis is one of the functions, not a number of the start."""
        if known is not None:
            return name not in known.coordinates
        return not _may_move_start(name) or takes(system, name)

    own = {name: values for name, values in axes.items() if is_own(name)}
    # A number of the function may have the name of a coordinate. The axis alone does not say that
    # the start stays the same, so the starts are kept.
    keeps_start = not is_maker(initial) and any(map(_may_move_start, own))
    if known is not None and not is_maker(initial):
        known.check_starts(axes, initial)
        return known, initial, None
    making = CellsToMake(
        own, system=system, initial=initial, shared=len(own) < len(axes), keeps=keeps_start
    )
    for name in axes:
        if makes and name not in own and name not in making.machine.coordinates:
            check_names(system, [name])
    first = initial if making.initial is None else making.initial
    return making.machine, first, making if stored else making.all()


def _the_same(start: Any, **_: float) -> Any:
    return start
