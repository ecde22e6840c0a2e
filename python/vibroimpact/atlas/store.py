"""Computations over a grid in a Zarr store: written chunk by chunk, resumed after any end.

The store is a directory in format 3 of Zarr, local and without pickle: one array per field, of the
grid's shape and with named dimensions, one per axis of the grid, and what describes the computation
as attributes. A chunk of the arrays is a chunk of the engine. Rows are appended in the order of the
chunks. Each file appears complete or not at all, and those of the status come last: a chunk without
a pending cell is whole, every other one is computed again.
"""

import errno
import json
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..checks import reject
from ..errors import ParameterError
from .columns import Columns, attributes, axis_attributes
from .fields import FORMAT, FORMAT_VERSION, ChunkResult, Field, Layout, RowGroup
from .grid import Grid, Tiling

# Numbers in a chunk of rows: half a megabyte, rewritten as rows are appended to it.
_ROW_NUMBERS = 2**16


class Store:
    """A store open for writing by this process alone; a context manager.

    Opening makes it, or checks that it holds part of the same computation.

    Raises
    ------
    ParameterError
        If ``path`` is something else, holds something else, is damaged or in use.
    ImportError
        If Zarr is not installed.
    """

    def __init__(self, path: str | os.PathLike[str], layout: Layout, tiling: Tiling) -> None:
        if not isinstance(path, str | os.PathLike):
            reject("store", path, "the path of a directory")
        _zarr()
        self.path = Path(path).absolute()
        self.layout = layout
        self.tiling = tiling
        # Rows must come in the order of the chunks.
        self.ordered = bool(layout.rows)
        self._lock = _locked(self.path)
        try:
            with _reading(self.path), _writing(self.path):
                group = self._opened()
                self._arrays = {entry.name: group[entry.name] for entry, _ in layout.arrays()}
                _consolidate(self.path)
                self._scan()
        except BaseException:
            self._release()
            raise

    def __enter__(self) -> Self:
        """Return the store."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Let others write."""
        self._release()

    def _release(self) -> None:
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def _opened(self) -> Any:
        """Return the group, made or found to be the same computation."""
        # What a kill leaves of a file that was being written.
        parts = set(self.path.glob("zarr.*.partial"))
        if (self.path / "zarr.json").exists():
            group = _zarr().open_group(str(self.path), mode="r+", use_consolidated=False)
            _check_format(self.path, group)
        elif parts.issuperset(self.path.iterdir()):
            group = _zarr().create_group(str(self.path), attributes=_mark())
        else:
            raise ParameterError(f"store = {str(self.path)!r} is a directory of something else")
        for part in parts:
            part.unlink()
        if "kind" not in group.attrs:  # the last to be written
            _create(group, self.layout, self.tiling)
            return group
        differences = _differences(_layout(group), self.layout)
        if differences:
            raise ParameterError(
                f"store = {str(self.path)!r} holds another computation: {'; '.join(differences)}"
            )
        chunks = group["status"].chunks
        self.tiling = Tiling.of(self.layout.grid.shape, int(np.prod(chunks)))
        if self.tiling.tile != chunks:
            raise ValueError(f"chunks {chunks}")
        return group

    def _scan(self) -> None:
        """Find out which chunks are done, how many cells they have and how many rows."""
        self.done = 0
        self._length = {group.name: 0 for group in self.layout.rows}
        self._whole = np.zeros(len(self.tiling), np.bool_)
        for index in range(len(self.tiling)):
            place = self.tiling.slices(index)
            status = self._arrays["status"][place]
            if status.all():
                self._whole[index] = True
                self.done += status.size
                for group in self.layout.rows:
                    self._length[group.name] += int(self._arrays[group.count.name][place].sum())
            elif self.ordered:
                break

    def todo(self) -> list[int]:
        """Return the numbers of the chunks that are to be computed."""
        numbers: list[int] = np.flatnonzero(~self._whole).tolist()
        return numbers

    def write(self, index: int, result: ChunkResult) -> None:
        """Write chunk ``index``; with row groups, the first that is not done.

        Raises
        ------
        OSError
            If it cannot be written; the chunk is then still to be computed.
        ParameterError
            If the store turns out to be damaged.
        """
        with _reading(self.path), _writing(self.path):
            self._write(index, result)

    def _write(self, index: int, result: ChunkResult) -> None:
        place = self.tiling.slices(index)
        status = self._arrays["status"]
        if status[place].any():
            # Part of the chunk came before, and may not stand beside half of what comes now.
            for name in ("status", *(group.count.name for group in self.layout.rows)):
                self._arrays[name][place] = 0
        ends = {}
        for group in self.layout.rows:
            counts, rows = result.rows[group.name]
            start = self._length[group.name]
            ends[group.name] = start + int(counts.sum())
            for entry in group.fields:
                array = self._arrays[entry.name]
                array.resize((ends[group.name], *entry.shape))
                array[start:] = rows[entry.name]
        if self.layout.rows:
            _consolidate(self.path)
        for group in self.layout.rows:
            counts = result.rows[group.name][0]
            self._arrays[group.count.name][place] = self.tiling.view(index, counts)
        for entry in self.layout.fields:
            if entry.name != "status":
                cells = result.columns[entry.name]
                self._arrays[entry.name][place] = self.tiling.view(index, cells)
        status[place] = self.tiling.view(index, result.columns["status"])
        self.done += int(np.count_nonzero(result.columns["status"]))
        if not result.interrupted:
            self._length = ends
            self._whole[index] = True

    def columns(self) -> Columns:
        """Return what is in the store, to be read from it."""
        return open_columns(self.path)


def open_columns(path: str | os.PathLike[str]) -> Columns:
    """Open a store to read from it, complete or not, also while it is being written.

    Raises
    ------
    ParameterError
        If there is no store, or it is damaged.
    ImportError
        If Zarr is not installed.
    """
    directory = Path(path).absolute()
    zarr = _zarr()
    with _reading(directory):
        if not (directory / "zarr.json").exists():
            raise ParameterError(f"{str(directory)!r} is not a store")
        group = zarr.open_group(str(directory), mode="r", use_consolidated=False)
        _check_format(directory, group)
        if "kind" not in group.attrs:
            raise ParameterError(f"{str(directory)!r} is not a store yet, only begun")
        layout = _layout(group)
        arrays = {entry.name: group[entry.name] for entry, _ in layout.arrays()}
    counts = {entry.name: group.count.name for group in layout.rows for entry in group.fields}

    def read(name: str, place: tuple[slice, ...]) -> NDArray[Any]:
        with _reading(directory):
            if name in counts:
                # A chunk that was cut short may have left rows without cells.
                place = (slice(0, int(arrays[counts[name]][()].sum())),)
            return np.asarray(arrays[name][place])

    return Columns(layout, read, str(directory))


def _mark() -> dict[str, Any]:
    """Return the attributes of a store that is being made; Zarr goes on to write into them."""
    return {"format": FORMAT, "format_version": FORMAT_VERSION}


def _zarr() -> Any:
    needed = 'a store needs Zarr 3.1.3 or newer: pip install "vibroimpact[xarray]"'
    try:
        import zarr
        from packaging.version import Version  # which Zarr needs itself
    except ImportError as error:
        raise ImportError(needed, name="zarr") from error
    if Version(zarr.__version__) < Version("3.1.3"):
        # Older ones write into files that stand, so that a kill leaves half of one.
        raise ImportError(f"{needed}; found {zarr.__version__}", name="zarr")
    return zarr


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Turn what Zarr raises on bytes that are not what they claim to be into one error."""
    try:
        yield
    except ParameterError:
        raise
    except (ValueError, KeyError, TypeError, IndexError, RuntimeError, FileNotFoundError) as error:
        raise ParameterError(f"store = {str(path)!r} is damaged ({error!r})") from error


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Say what to do about a disk that is full."""
    try:
        yield
    except FileNotFoundError:
        raise  # damage
    except OSError as error:
        raise OSError(
            error.errno or errno.EIO,
            f"the store {str(path)!r} cannot be written ({error.strerror or error}); the cells in "
            "it are safe, and with room enough the same call goes on from there",
        ) from error


def _locked(path: Path) -> int | None:
    """Make the directory and lock it until this process ends; None where there are no locks."""
    try:
        path.mkdir(exist_ok=True)
    except (FileNotFoundError, FileExistsError) as error:
        wrong = "is a file" if isinstance(error, FileExistsError) else "has no folder to be in"
        raise ParameterError(f"store = {str(path)!r} {wrong}") from error
    try:
        import fcntl
    except ImportError:  # Windows
        return None
    handle = os.open(path, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        os.close(handle)
        raise ParameterError(
            f"store = {str(path)!r} is being written by another process; wait until it ends"
        ) from error
    except OSError:  # a file system without locks
        os.close(handle)
        return None
    return handle


def _create(group: Any, layout: Layout, tiling: Tiling) -> None:
    """Make all arrays, empty; what a killed process has made of them is replaced."""

    def make(name: str, **options: Any) -> Any:
        return group.create_array(
            name, compressors=_zarr().codecs.ZstdCodec(checksum=True), overwrite=True, **options
        )

    for name, values in layout.grid.axes.items():
        axis = make(
            name,
            shape=values.shape,
            chunks=(max(1, len(values)),),
            dtype="float64",
            dimension_names=(name,),
            attributes=axis_attributes(),
        )
        axis[...] = values
    for entry, rows in layout.arrays():
        if rows is None:
            shape, chunks = layout.grid.shape, tiling.tile
        else:
            shape, chunks = (0,), (max(1, _ROW_NUMBERS // int(np.prod(entry.shape))),)
        make(
            entry.name,
            shape=shape + entry.shape,
            chunks=chunks + entry.shape,
            dtype=entry.dtype,
            fill_value=entry.fill,
            dimension_names=layout.dims(entry, rows),
            attributes=attributes(layout, entry),
        )
    group.update_attributes(layout.attributes())


def _consolidate(path: Path) -> None:
    """Gather the metadata of all arrays in one file.

    xarray looks for it, and there all columns of a row group change their length at once.
    """
    with warnings.catch_warnings():
        # Zarr notes that this file is an extension of its format 3; a reader may do without it.
        warnings.simplefilter("ignore")
        _zarr().consolidate_metadata(str(path), zarr_format=3)


def _check_format(path: Path, group: Any) -> None:
    if group.attrs.get("format") != FORMAT:
        raise ParameterError(f"store = {str(path)!r} is a Zarr group of something else")
    if group.attrs["format_version"] != FORMAT_VERSION:
        raise ParameterError(
            f"store = {str(path)!r} is in format {group.attrs['format_version']}; this version of "
            f"vibroimpact reads and writes format {FORMAT_VERSION}"
        )


def _layout(group: Any) -> Layout:
    """Return the layout of a store."""
    about: Any = dict(group.attrs)
    axes = {name: group[name][()] for name in about["axes"]}

    def entry(name: str, outer: int) -> Field:
        array = group[name]
        return Field(
            name,
            array.dtype.name,
            array.attrs["description"],
            array.shape[outer:],
            (array.metadata.dimension_names or ())[outer:],
            array.fill_value.item(),
            tuple(array.attrs.get("flag_meanings", "").split()),
        )

    rows: dict[str, list[Field]] = {}
    for name in about["row_fields"]:
        dim = group[name].metadata.dimension_names[0]
        rows.setdefault(dim.removesuffix("_row"), []).append(entry(name, 1))
    system = json.loads(about["system"])
    return Layout(
        about["kind"],
        Grid(axes),
        tuple(entry(name, len(axes)) for name in about["fields"]),
        tuple(RowGroup(name, tuple(fields)) for name, fields in rows.items()),
        json.loads(about["settings"]) | ({} if system is None else {"system": system}),
        about["version"],
    )


def _differences(stored: Layout, asked: Layout) -> list[str]:
    """Return in words what tells two computations apart."""
    there, here = _facts(stored), _facts(asked)
    found = [
        f"{name} is {there.get(name, 'not known')} there, {here.get(name, 'not known')} here"
        for name in {**there, **here}
        if there.get(name) != here.get(name)
    ]
    for name, values in stored.grid.axes.items():
        others = asked.grid.axes.get(name, values)
        if values.shape == others.shape and (values != others).any():
            place = int(np.argmax(values != others))
            found.append(
                f"{name}[{place}] is {float(values[place])!r} there, {float(others[place])!r} here"
            )
    return found


def _facts(layout: Layout) -> dict[str, str]:
    """Return all that two layouts must share, but the values of the axes, as texts by name."""
    facts = {"kind": layout.kind, "version": layout.version, "axes": " x ".join(layout.grid.axes)}
    facts |= {f"len({name})": str(len(values)) for name, values in layout.grid.axes.items()}
    facts |= dict(_flat("", layout.settings))
    for entry, group in layout.arrays():
        facts[f"the field {entry.name}"] = f"{entry} of the {group.name if group else 'cell'}s"
    return facts


def _flat(prefix: str, settings: Any) -> Iterator[tuple[str, str]]:
    if not isinstance(settings, dict):
        yield prefix.removesuffix("."), repr(settings)
        return
    for name, value in settings.items():
        yield from _flat(f"{prefix}{name}.", value)
