"""The columns of a computation over a grid, in memory or in a store, and as an xarray data set."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ParameterError
from ..extras import missing
from ..interruption import interruptible
from .fields import ChunkResult, Field, Layout
from .grid import Grid, Tiling

if TYPE_CHECKING:
    import xarray

# Gives the named array or a part of it; () is all of it.
Read = Callable[[str, tuple[slice, ...]], NDArray[Any]]

# What the dimension ``coordinate`` counts.
COORDINATES = ("x1", "v1", "x2", "v2")

# Cells whose status is looked at together.
_MANY = 2**22


@interruptible
class Columns:
    """The arrays of a computation over a grid, by name; read-only.

    ``columns["status"]`` has the shape of the grid, and any inner shape of the field after it. The
    columns of a row group have the shape (rows, ...), and ``columns["impact_offset"]`` says where
    the rows of each cell begin: shape (cells + 1,). Columns of a store are read at each access.

    Attributes
    ----------
    layout
        Kind, grid, fields, row groups, settings and version.
    path
        Directory of the store, or None in memory.
    """

    def __init__(
        self,
        layout: Layout,
        read: Read,
        path: str | None = None,
        check: Callable[[], dict[str, int]] = dict,
    ) -> None:
        self.layout = layout
        self.path = path
        self._read = read
        self._check = check
        self._groups = {group.offset: group for group in layout.rows}
        self._names = [entry.name for entry, _ in layout.arrays()] + list(self._groups)

    @property
    def grid(self) -> Grid:
        """The cells."""
        return self.layout.grid

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all columns."""
        return tuple(self._names)

    def __contains__(self, name: object) -> bool:
        """Say whether there is a column of that name."""
        return name in self._names

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return a column.

        Raises
        ------
        KeyError
            If there is no column of that name.
        ParameterError
            If the store is damaged.
        """
        if name not in self._names:
            raise KeyError(f"{name!r} is none of {', '.join(self._names)}")
        if name in self._groups:
            counts = self._read(self._groups[name].count.name, ()).ravel()
            array = np.concatenate([np.zeros(1, np.int64), np.cumsum(counts)])
        else:
            array = self._read(name, ())
        array.flags.writeable = False
        return array

    @property
    def done(self) -> int:
        """Number of cells that are not pending."""
        parts = Tiling.of(self.grid.shape, _MANY)
        return sum(
            int(np.count_nonzero(self._read("status", parts.slices(index))))
            for index in range(len(parts))
        )

    @property
    def complete(self) -> bool:
        """Whether no cell is pending."""
        return self.done == self.grid.size

    def __repr__(self) -> str:
        """Say what was computed and how far."""
        axes = " x ".join(f"{len(values)} {name}" for name, values in self.grid.axes.items())
        where = "" if self.path is None else f", in {self.path}"
        return f"<Columns of a {self.layout.kind}, {axes or 'one cell'}, {self.done} done{where}>"


@dataclass(frozen=True)
class Arrays:
    """Gives the arrays of a computation from memory."""

    arrays: dict[str, NDArray[Any]]

    def __call__(self, name: str, place: tuple[slice, ...]) -> NDArray[Any]:
        """Return a part of an array."""
        return np.asarray(self.arrays[name][place])


class Memory:
    """Collects the chunks of a computation in memory, in any order."""

    ordered = False

    def __init__(self, layout: Layout, tiling: Tiling) -> None:
        self.layout = layout
        self.tiling = tiling
        self.done = 0
        self._rows: dict[str, dict[int, NDArray[Any]]] = {}
        self._cells: dict[str, NDArray[Any]] = {}
        for entry, group in layout.arrays():
            if group is None:
                shape = layout.grid.shape + entry.shape
                self._cells[entry.name] = np.full(shape, entry.fill, entry.dtype)
            else:
                self._rows[entry.name] = {}

    def todo(self) -> range:
        """Return the numbers of the chunks that are to be computed."""
        return range(len(self.tiling))

    def write(self, index: int, result: ChunkResult) -> None:
        """Take over chunk ``index``."""
        place = self.tiling.slices(index)
        for entry in self.layout.fields:
            self._cells[entry.name][place] = self.tiling.view(index, result.columns[entry.name])
        for group in self.layout.rows:
            counts, rows = result.rows[group.name]
            self._cells[group.count.name][place] = self.tiling.view(index, counts)
            for entry in group.fields:
                self._rows[entry.name][index] = rows[entry.name]
        self.done += int(np.count_nonzero(result.columns["status"]))

    def columns(self) -> Columns:
        """Return the columns collected; nothing may be written after that."""
        arrays = self._cells.copy()
        for entry, group in self.layout.arrays():
            if group is not None:
                parts = [part for _, part in sorted(self._rows.pop(entry.name).items())]
                none = np.empty((0, *entry.shape), entry.dtype)
                arrays[entry.name] = parts[0] if len(parts) == 1 else np.concatenate([none, *parts])
        return Columns(self.layout, Arrays(arrays))


def need_xarray() -> None:
    """Say how to get xarray where it is not installed."""
    try:
        import xarray  # noqa: F401
    except ImportError as error:
        raise missing("xarray", "a data set needs xarray") from error


def to_dataset(columns: Columns) -> "xarray.Dataset":
    """Return the columns as an xarray data set with labelled dimensions.

    The axes of the grid are its coordinates; names and attributes are those of a store. In place of
    ``impact_offset`` it has ``impact_count``, rows per cell, as CF's contiguous ragged arrays. If
    it has motions it has their ``label`` as well, computed when it is used. Columns of a store are
    read when they are used, so that the store must stay where it is.

    Raises
    ------
    ImportError
        If xarray is not installed, or for a store Zarr.
    ParameterError
        If the store is damaged.
    """
    need_xarray()
    import xarray

    from .label_array import with_label

    layout = columns.layout
    if columns.path is not None:
        # xarray reads a missing chunk as fill values.
        lengths = columns._check()
        stored: xarray.Dataset = xarray.open_zarr(columns.path, chunks=None)
        return with_label(_with_names(_as_told(columns, lengths, stored)))
    data = xarray.Dataset(
        {
            entry.name: (layout.dims(entry, group), columns[entry.name], attributes(layout, entry))
            for entry, group in layout.arrays()
        },
        {name: (name, values, axis_attributes()) for name, values in columns.grid.axes.items()},
        layout.attributes(),
    )
    return with_label(_with_names(data))


def _with_names(data: "xarray.Dataset") -> "xarray.Dataset":
    """Return the data set with coordinates along the dimensions that are not those of the grid."""
    sizes = data.sizes
    names: dict[str, Any] = {"coordinate": [*COORDINATES]}
    if "part" in sizes:  # of a structure
        names = {"part": ["q", "v"], "coordinate": [*range(sizes["coordinate"])]}
    names["exponent"] = [*range(1, sizes.get("exponent", 0) + 1)]
    return data.assign_coords({name: names[name] for name in names if name in data.dims})


def _as_told(columns: Columns, lengths: dict[str, int], stored: "xarray.Dataset") -> Any:
    """Return the arrays of a store without rows that belong to no cell."""
    layout = columns.layout
    for entry, group in layout.arrays():
        found = stored.get(entry.name)
        wanted = (layout.grid.shape if group is None else (lengths[group.dim],)) + entry.shape
        if (
            found is None
            or found.dims != layout.dims(entry, group)
            or found.dtype != entry.dtype
            or any(is_ < must for is_, must in zip(found.shape, wanted, strict=True))
            or (group is None and found.shape != wanted)
        ):
            raise ParameterError(
                f"store = {columns.path!r} is damaged (its consolidated metadata are not those of "
                f"{entry.name}); the same call writes them anew"
            )
    names = [entry.name for entry, _ in layout.arrays()]
    told = stored[names].isel({dim: slice(length) for dim, length in lengths.items()})
    told.attrs.pop("fingerprint")  # of the store
    return told


def attributes(layout: Layout, entry: Field) -> dict[str, Any]:
    """Return the attributes of an array, those that make CF's ragged arrays among them."""
    for group in layout.rows:
        if entry == group.count:
            return entry.attributes() | {"sample_dimension": group.dim}
    return entry.attributes()


def axis_attributes() -> dict[str, Any]:
    """Return the attributes of a coordinate."""
    return {"units": "dimensionless"}
