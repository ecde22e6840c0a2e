"""The interface of a computation over a grid: its fields, and chunks of results."""

import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..arguments import reject
from ..interruption import interruptible
from .grid import Grid

# Attributes of every data set.
FORMAT = "vibroimpact atlas"
# 2: the metadata have a checksum, and a finished cell has all its chunks. Stores of version 1 are
# refused.
FORMAT_VERSION = 2

# The code of a cell's status is its index here. Every status other than pending means done.
STATUS_NAMES = _core.STATUS_NAMES


@interruptible
@dataclass(frozen=True)
class Field:
    """One number, or one small array of them, per cell or per row.

    Attributes
    ----------
    name
        Name of the column.
    dtype
        Name of a NumPy type: a bool, an integer or a float.
    description
        What it is, in one line.
    shape, dims
        Shape of the values of one cell, and the names of its dimensions.
    fill
        Value of a cell that is not computed: by default NaN, for integers 0.
    flags
        Where the values are codes 0, 1, ...: what each of them means, words without spaces.
    """

    name: str
    dtype: str
    description: str
    shape: tuple[int, ...] = ()
    dims: tuple[str, ...] = ()
    fill: float | int | None = None
    flags: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Set the default fill; refuse what no store could hold."""
        dtype = np.dtype(self.dtype)
        if dtype.kind not in "biuf" or len(self.shape) != len(self.dims):
            raise ValueError(f"not a field: {self}")
        fill = self.fill
        if fill is None:
            fill = math.nan if dtype.kind == "f" else 0
        object.__setattr__(self, "dtype", dtype.name)
        object.__setattr__(self, "fill", dtype.type(fill).item())

    def attributes(self) -> dict[str, Any]:
        """Return what describes the field in a data set, after the CF conventions."""
        if self.flags:
            return {
                "description": self.description,
                "flag_values": list(range(len(self.flags))),
                "flag_meanings": " ".join(self.flags),
            }
        return {"description": self.description, "units": "dimensionless"}


STATUS = Field("status", "int8", "how the computation of the cell ended", flags=STATUS_NAMES)


@interruptible
@dataclass(frozen=True)
class RowGroup:
    """Any number of rows per cell, in cell order.

    Group ``impact`` has the dimension ``impact_row``, the rows per cell in the column
    ``impact_count`` and where they begin in ``impact_offset``, shape (cells + 1,): cell i owns the
    rows offset[i] : offset[i + 1] of the columns named by ``fields``.

    Attributes
    ----------
    name
        Name of the group.
    fields
        The columns of its rows.
    """

    name: str
    fields: tuple[Field, ...]

    @property
    def dim(self) -> str:
        """Name of the dimension along the rows."""
        return f"{self.name}_row"

    @property
    def offset(self) -> str:
        """Name of the column that tells where the rows of each cell begin."""
        return f"{self.name}_offset"

    @property
    def count(self) -> Field:
        """The field that counts the rows of each cell."""
        return Field(f"{self.name}_count", "int64", f"number of rows along {self.dim}")


@dataclass
class ChunkResult:
    """The cells first ... last - 1 of a computation.

    Attributes
    ----------
    columns
        For each field an array of shape (last - first, *shape).
    rows
        For each row group the rows per cell, shape (last - first,) and int64, and for each of its
        fields an array of shape (rows, *shape).
    interrupted
        Ctrl-C came: some cells are pending.
    """

    columns: dict[str, NDArray[Any]]
    rows: dict[str, tuple[NDArray[np.int64], dict[str, NDArray[Any]]]] = field(default_factory=dict)
    interrupted: bool = False


class Task(Protocol):
    """A computation over a grid; frozen, picklable. The numbers of a cell follow from its place.

    Attributes
    ----------
    kind
        What is computed: ``sweep``, ``diagram``, ...
    grid
        The cells.
    fields, rows
        What is computed for each; ``STATUS`` is one of the fields.
    cost
        Drive periods per cell, from which the default size of a chunk follows.
    divisible
        False for a branch that is followed from cell to cell: one chunk only.
    """

    @property
    def kind(self) -> str: ...  # noqa: D102
    @property
    def grid(self) -> Grid: ...  # noqa: D102
    @property
    def fields(self) -> tuple[Field, ...]: ...  # noqa: D102
    @property
    def rows(self) -> tuple[RowGroup, ...]: ...  # noqa: D102
    @property
    def cost(self) -> float: ...  # noqa: D102
    @property
    def divisible(self) -> bool: ...  # noqa: D102

    def settings(self) -> dict[str, Any]:
        """Return all that the numbers depend on but the grid, fit for JSON; ``system`` is a dict.

        Two tasks of one kind, grid and settings have the same numbers: a store relies on this.
        """
        ...

    def within(self, first: int, last: int) -> "Task":
        """Return the task for the cells first ... last - 1, with what the caller makes for them.

        It is this one, unless functions of the user make something: these stay with the caller.
        """
        ...

    def compute(
        self,
        first: int,
        last: int,
        *,
        workers: int | None,
        progress: Callable[[int], object] | None,
    ) -> ChunkResult:
        """Compute the cells first ... last - 1 on ``workers`` threads (None: all cores).

        ``progress`` is called at intervals with the number of cells that are done. Ctrl-C ends the
        work early; then the result is ``interrupted``.
        """
        ...


@interruptible
@dataclass(frozen=True, eq=False)
class Layout:
    """What a computation is, and which arrays it has: a task without its code.

    Attributes
    ----------
    kind
        What was computed: ``sweep``, ``diagram``, ...
    grid
        The cells.
    fields
        What was computed for each cell.
    rows
        What has any number of rows per cell.
    settings
        All that the numbers depend on but the grid, the system as a dict.
    version
        The version of vibroimpact that computed it.
    """

    kind: str
    grid: Grid
    fields: tuple[Field, ...]
    rows: tuple[RowGroup, ...]
    settings: Mapping[str, Any]
    version: str = _core.__version__

    @classmethod
    def of(cls, task: Task) -> "Layout":
        """Return the layout of a task, with settings as they will be read from a store."""
        settings = json.loads(json.dumps(task.settings(), allow_nan=False))
        return cls(task.kind, task.grid, task.fields, task.rows, settings)

    def __post_init__(self) -> None:
        """Refuse names that would meet in a store or in a data set."""
        dims = {*self.grid.axes}
        dims.update(*(entry.dims for entry in self.fields), (group.dim for group in self.rows))
        dims.update(*(entry.dims for group in self.rows for entry in group.fields))
        names = [entry.name for entry, _ in self.arrays()] + [group.offset for group in self.rows]
        for name in self.grid.axes:
            if name in names:
                taken = "a name that no column of the result has"
                reject("name of an axis", name, taken)
        if len({*names} | dims) != len(names) + len(dims):
            raise ValueError(f"names meet: fields {sorted(names)}, dimensions {sorted(dims)}")
        if not any((entry.name, entry.dtype) == ("status", "int8") for entry in self.fields):
            raise ValueError("a task has the field STATUS")

    def __repr__(self) -> str:
        """Kind, grid and names of the arrays."""
        names = ", ".join(entry.name for entry, _ in self.arrays())
        return f"<Layout of a {self.kind}, {self.grid}: {names}>"

    def arrays(self) -> Iterator[tuple[Field, RowGroup | None]]:
        """Return every array: the fields and counts of the cells (None), the fields of the rows."""
        for entry in (*self.fields, *(group.count for group in self.rows)):
            yield entry, None
        for group in self.rows:
            for entry in group.fields:
                yield entry, group

    def dims(self, entry: Field, group: RowGroup | None) -> tuple[str, ...]:
        """Return the names of the dimensions of an array."""
        return (*(self.grid.axes if group is None else (group.dim,)), *entry.dims)

    def attributes(self) -> dict[str, Any]:
        """Return what describes the whole; JSON texts, because other formats know no mappings."""
        settings = dict(self.settings)
        system = settings.pop("system", None)
        return {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "kind": self.kind,
            "version": self.version,
            "system": json.dumps(system),
            "settings": json.dumps(settings),
            "axes": [*self.grid.axes],
            "fields": [entry.name for entry in self.fields],
            "row_fields": [entry.name for group in self.rows for entry in group.fields],
        }

    def check(self, first: int, last: int, result: ChunkResult) -> None:
        """Refuse a chunk that is not what the layout says: an error of the task itself."""
        arrays = {entry.name: (entry, last - first) for entry in self.fields}
        found = dict(result.columns)
        for group in self.rows:
            counts, rows = result.rows[group.name]
            arrays[group.count.name] = (group.count, last - first)
            arrays |= {entry.name: (entry, int(counts.sum())) for entry in group.fields}
            found |= {group.count.name: counts, **rows}
        for name, (entry, length) in arrays.items():
            wanted = (length, *entry.shape)
            if name not in found or found[name].shape != wanted or found[name].dtype != entry.dtype:
                given = f"{found[name].dtype} {found[name].shape}" if name in found else "nothing"
                raise TypeError(
                    f"cells {first} ... {last - 1} of a {self.kind}: {name} must be {entry.dtype} "
                    f"{wanted}, got {given}"
                )
        if not result.interrupted and not result.columns["status"].all():
            raise TypeError(f"cells {first} ... {last - 1} of a {self.kind}: some are left pending")
