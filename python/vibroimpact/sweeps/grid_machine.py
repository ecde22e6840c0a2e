"""What a machine gives to a computation over a grid: an interface, and what goes with it.

A grid varies numbers of a machine and numbers of its start, both by name. Everything else that
depends on the machine is behind this interface: the shape of a state, the columns that keep a
machine that a function made, the rows of a diagram, and the compiled kernel. `machines` has that of
a System, `structure_machine` that of a Structure.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..arguments import in_short
from ..errors import ParameterError
from ..made import in_words
from .fields import Field, RowGroup

Array = NDArray[np.float64]
# Numbers of a machine, or coordinates of a start, by name: one for each cell, shape (cells,).
Values = Mapping[str, Array]
# Names of the columns of what functions made for each cell.
START = "initial_state"
# Rows of each group, as a `ChunkResult` has them.
Rows = dict[str, tuple[NDArray[np.int64], dict[str, NDArray[Any]]]]
# What the compiled kernel gives, the states at the end, and the rows if they are wanted.
Ran = tuple[_core.Sweep | _core.StructureSweep, Array, Rows]


class GridMachine(Protocol):
    """A kind of machine, with the one that a grid varies.

    Attributes
    ----------
    system
        The System or Structure; where a function makes one for each cell, that of the first.
    numbers
        Names of its numbers that an axis can vary, and how a message lists them.
    coordinates
        Names of the numbers of a start, in C order of its shape.
    final_state
        The field of states at the end; a start has its shape.
    exponents
        How many Lyapunov exponents a motion has.
    made_fields
        The columns that keep a machine that a function made.
    row_groups
        The impacts and the sections of a diagram.
    """

    @property
    def system(self) -> Any: ...  # noqa: D102
    @property
    def numbers(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def coordinates(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def final_state(self) -> Field: ...  # noqa: D102
    @property
    def exponents(self) -> int: ...  # noqa: D102
    @property
    def made_fields(self) -> tuple[Field, ...]: ...  # noqa: D102
    @property
    def row_groups(self) -> tuple[RowGroup, ...]: ...  # noqa: D102

    def to_dict(self) -> dict[str, Any]:
        """Return the machine as a dict, fit for JSON."""
        ...

    def starts(self, initial: Any) -> Array:
        """Return checked starts, (k, *shape of a state); of one start k = 1."""
        ...

    def start(self, initial: Any) -> Any:
        """Return one checked start as nested tuples."""
        ...

    def check_starts(self, axes: Values, initial: Any) -> None:
        """Refuse axes of coordinates whose combinations are no starts."""
        ...

    def row(self, system: Any, values: Mapping[str, float]) -> dict[str, Any]:
        """Return the columns of a machine that a function made from some values.

        Raises
        ------
        ParameterError
            If it is another kind of machine than that of the first cell.
        """
        ...

    def at(self, row: Mapping[str, Array]) -> Any:
        """Return the machine of a row of those columns."""
        ...

    def entry_name(self, column: str, place: int) -> str:
        """Return what an entry of one of these columns is, for messages."""
        ...

    def run(self, values: Values, columns: Values, starts: Array, **options: Any) -> Ran:
        """Run cells by the compiled kernel.

        ``values`` holds the numbers that are varied by name, ``columns`` what functions made.
        """
        ...


def unlike(values: Mapping[str, float], what: str, found: Any, allowed: str) -> ParameterError:
    """Return the error of a machine that is not like that of the first cell."""
    return ParameterError(
        f"at {in_words(values)}: {what} {in_short(found)} is not allowed; allowed: {allowed}"
    )


def start_field(machine: GridMachine) -> Field:
    """Return the column of starts that a function made."""
    shape, dims = machine.final_state.shape, machine.final_state.dims
    what = machine.final_state.description.replace("at the end", "at t = 0, from the function")
    return Field(START, "float64", what, shape, dims)


def with_coordinates(machine: GridMachine, starts: Array, values: Values) -> Array:
    """Set those numbers of starts, (cells, *shape), that are varied by name; in place."""
    flat = starts.reshape(len(starts), -1)
    for place, name in enumerate(machine.coordinates):
        if name in values:
            flat[:, place] = values[name]
    return starts
