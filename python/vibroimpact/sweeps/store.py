"""Computations over a grid in a Zarr store: written chunk by chunk, resumed after any end.

The store is a local directory without pickle. A chunk of its arrays is a chunk of the engine, and
rows are appended in the order of the chunks. Each file appears complete or not at all, and those of
the status come last: a chunk without a pending cell is whole, every other one is computed again, as
is one that has lost a file (`store_check`).
"""

import errno
import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..arguments import path as checked_path
from ..arguments import reject
from ..errors import ParameterError
from ..whole_file import remedy
from .columns import Columns
from .ctrl_c import ctrl_c_waits
from .fields import ChunkResult, Layout
from .grid import Tiling
from .machines import machine_from_dict
from .store_check import Chunks, check_arrays, damaged, reading
from .store_layout import (
    check_format,
    consolidate,
    create,
    differences,
    every_chunk,
    mark,
    read_layout,
    zarr_module,
)
from .store_lock import LOCK, Lock


class Store:
    """A store open for writing by this process alone; a context manager.

    Opening makes it, or checks that it holds part of the same computation.

    Raises
    ------
    ParameterError
        If ``path`` is something else, holds something else, is damaged or in use.
    OSError
        If it cannot be made or written.
    ImportError
        If Zarr is not installed.
    """

    def __init__(self, path: str | os.PathLike[str], layout: Layout, tiling: Tiling) -> None:
        path = checked_path("store", path, "the path of a directory")
        zarr_module()
        self.path = Path(path).absolute()
        self.layout = layout
        self.tiling = tiling
        # Rows must come in the order of the chunks.
        self.ordered = bool(layout.rows)
        self._lock: Lock | None = None
        try:
            with reading(self.path), _writing(self.path):
                with ctrl_c_waits(), every_chunk():
                    _make(self.path)
                    self._lock = Lock(self.path)
                    group = self._opened()
                    self._arrays = {entry.name: group[entry.name] for entry, _ in layout.arrays()}
                    consolidate(self.path)
                self._chunks = Chunks(self.path, layout, self._arrays)
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
        """Release the lock."""
        self._release()

    def _release(self) -> None:
        if self._lock is not None:
            self._lock.release()
            self._lock = None

    def _opened(self) -> Any:
        """Return the group, made or found to be the same computation."""
        # The rest of a file that was being written when the process was killed.
        parts = set(self.path.glob("zarr.*.partial"))
        if _is_group(self.path):
            group = zarr_module().open_group(str(self.path), mode="r+", use_consolidated=False)
            check_format(self.path, group)
        elif {*parts, self.path / LOCK}.issuperset(self.path.iterdir()):
            group = zarr_module().create_group(str(self.path), attributes=mark())
        else:
            raise ParameterError(f"store = {str(self.path)!r} is a directory of something else")
        for part in parts:
            part.unlink()
        if "kind" not in group.attrs:  # the last to be written
            create(group, self.layout, self.tiling)
            return group
        stored, chunks = read_layout(group), group["status"].chunks
        check_arrays(group, stored, chunks)
        found = differences(stored, self.layout)
        if found:
            raise ParameterError(
                f"store = {str(self.path)!r} holds another computation: {'; '.join(found)};"
                " give another place, or delete this one"
            )
        self.tiling = Tiling.of(self.layout.grid.shape, int(np.prod(chunks)))
        if self.tiling.tile != chunks:
            raise ValueError(f"chunks {chunks}")
        return group

    def _scan(self) -> None:
        """Find which chunks are done, their number of cells and of rows."""
        self.done = 0
        self._length = {group.name: 0 for group in self.layout.rows}
        self._whole = np.zeros(len(self.tiling), np.bool_)
        for index in range(len(self.tiling)):
            status = self._chunks.read("status", self.tiling.slices(index))
            ends = self._ends(index) if status.all() else None
            if ends is not None:
                self._whole[index] = True
                self.done += status.size
                self._length = ends
            elif self.ordered:
                self._forget(index + 1)
                break

    def _ends(self, index: int) -> dict[str, int] | None:
        """Return where the rows of a chunk of done cells end, or None if it has lost a file."""
        place, chunks = self.tiling.slices(index), self._chunks
        cells = [entry.name for entry, group in self.layout.arrays() if group is None]
        if any(any(chunks.missing(name, place)) for name in cells):
            return None
        ends = {}
        for group in self.layout.rows:
            start = self._length[group.name]
            ends[group.name] = start + int(chunks.read(group.count.name, place).sum())
            rows = slice(start, ends[group.name])
            for entry in group.fields:
                lost = self._arrays[entry.name].shape[0] < rows.stop
                if lost or any(chunks.missing(entry.name, (rows,))):
                    return None
        return ends

    def _forget(self, first: int) -> None:
        """Call the chunks pending from this one on: their rows are about to be replaced."""
        for index in range(first, len(self.tiling)):
            place = self.tiling.slices(index)
            if not any(self._chunks.missing("status", place)):
                self._clear(place)

    def _clear(self, place: tuple[slice, ...]) -> None:
        """Call the cells of a chunk pending."""
        for name in ("status", *(group.count.name for group in self.layout.rows)):
            self._arrays[name][place] = 0

    def todo(self) -> list[int]:
        """Return the numbers of the chunks that are to be computed."""
        numbers: list[int] = np.flatnonzero(~self._whole).tolist()
        return numbers

    def compare(self, known: Callable[[int, int], dict[str, NDArray[Any]]]) -> None:
        """Refuse to go on if columns of finished cells are not as ``known``.

        Raises
        ------
        ParameterError
            Names the first cell, the column and both values.
        """
        for index in np.flatnonzero(self._whole).tolist():
            place = self.tiling.slices(index)
            first, last = self.tiling.cells(index)
            for name, wanted in known(first, last).items():
                with reading(self.path):
                    there = self._chunks.read(name, place).reshape(last - first, -1)
                wanted = wanted.reshape(last - first, -1)
                same = (there == wanted) | (np.isnan(there) & np.isnan(wanted))
                if not same.all():
                    cell, entry = np.argwhere(~same)[0].tolist()
                    at = self.layout.grid.values(first + cell, first + cell + 1)
                    own = machine_from_dict(self.layout.settings["system"])
                    where = ", ".join(f"{axis} = {float(value[0])!r}" for axis, value in at.items())
                    raise ParameterError(
                        f"store = {str(self.path)!r} holds another computation: at {where} "
                        f"{own.entry_name(name, entry)} is {float(there[cell, entry])!r} there, "
                        f"{float(wanted[cell, entry])!r} here; "
                        "give another place, or delete this one"
                    )

    def write(self, index: int, result: ChunkResult) -> None:
        """Write chunk ``index``; with row groups, the first that is not done.

        Raises
        ------
        OSError
            If it cannot be written; the chunk is then still to be computed.
        ParameterError
            If the store turns out to be damaged.
        """
        if not _is_group(self.path):
            # Zarr would make the directory again, and write into something that is no store.
            raise FileNotFoundError(
                errno.ENOENT,
                "the store has been moved or removed while it was written; the same call goes on "
                "with it if it is put back",
                str(self.path),
            )
        with reading(self.path), _writing(self.path):
            self._write(index, result)

    def _write(self, index: int, result: ChunkResult) -> None:
        place = self.tiling.slices(index)
        status = self._arrays["status"]
        if status[place].any():
            # Part of the chunk was written before; it must not be mixed with a part of the new one.
            self._clear(place)
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
            consolidate(self.path)
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
    arrays = StoredArrays(Path(path).absolute())
    return Columns(arrays.layout, arrays, str(arrays.directory), arrays.check)


class StoredArrays:
    """Gives the arrays of a store; pickled as its path."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self._open()
        self._counts = {
            entry.name: group.count.name for group in self.layout.rows for entry in group.fields
        }

    def _open(self) -> None:
        self.layout, self._arrays = _opened(self.directory)
        self._chunks = Chunks(self.directory, self.layout, self._arrays)

    def __reduce__(self) -> tuple[Any, ...]:
        """Open the store again where it is unpickled."""
        return StoredArrays, (self.directory,)

    def __call__(self, name: str, place: tuple[slice, ...]) -> NDArray[Any]:
        """Return a part of an array."""
        with reading(self.directory):
            if name in self._counts:
                # A chunk that was interrupted may have left rows without cells.
                place = (slice(0, self._length(name)),)
            self._chunks.check(name, place)
            return self._chunks.read(name, place)

    def _length(self, name: str) -> int:
        """Return how many rows of an array belong to cells."""
        length = int(self(self._counts[name], ()).sum())
        if self._arrays[name].shape[0] < length:
            self._open()  # it may have grown since
        if self._arrays[name].shape[0] < length:
            raise damaged(
                self.directory,
                f"{name} has {self._arrays[name].shape[0]} rows instead of {length}",
                "the same call computes what is missing again",
            )
        return length

    def check(self) -> dict[str, int]:
        """Refuse a store in which a chunk is missing; return the rows of each row group.

        Raises
        ------
        ParameterError
            If there is one.
        """
        lengths = {}
        with reading(self.directory):
            for entry, group in self.layout.arrays():
                place: tuple[slice, ...] = ()
                if group is not None:
                    lengths[group.dim] = self._length(entry.name)
                    place = (slice(0, lengths[group.dim]),)
                self._chunks.check(entry.name, place)
        return lengths


def _opened(directory: Path) -> tuple[Layout, dict[str, Any]]:
    """Return what is known of a store, and its arrays."""
    zarr = zarr_module()
    with reading(directory):
        if not _is_group(directory):
            raise ParameterError(f"{str(directory)!r} is not a store")
        group = zarr.open_group(str(directory), mode="r", use_consolidated=False)
        check_format(directory, group)
        if "kind" not in group.attrs:
            raise ParameterError(f"{str(directory)!r} is not a store yet, only begun")
        layout = read_layout(group)
        check_arrays(group, layout, group["status"].chunks)
        return layout, {entry.name: group[entry.name] for entry, _ in layout.arrays()}


def _is_group(path: Path) -> bool:
    """Say whether a directory is a Zarr group; an OSError where it may not be looked at."""
    try:
        os.stat(path / "zarr.json")
    except (FileNotFoundError, NotADirectoryError):
        return False
    return True


def folder_of_stores(store: Any, names: str, kind: str) -> Path | None:
    """Return the folder of a computation that has several stores, of names like ``names``.

    Raises
    ------
    ParameterError
        If it holds something else, or has no folder to be in.
    """
    if store is None:
        return None
    path = Path(checked_path("store", store, "the path of a directory"))
    new = not path.exists()
    ours = path.is_dir() and all(re.fullmatch(names, found.name) for found in path.iterdir())
    if not (new and path.absolute().parent.is_dir()) and not ours:
        reject("store", str(store), f"a new directory in one that exists, or one of {kind}")
    return path


def store_in(folder: Path | None, name: str) -> Path | None:
    """Return the path of one of the stores of a folder, which is made if need be."""
    if folder is None:
        return None
    with _writing(folder):
        folder.mkdir(exist_ok=True)
    return folder / name


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Say what to do about a disk that is full, a permission that is missing ..."""
    try:
        yield
    except FileNotFoundError:
        raise  # damage
    except OSError as error:
        raise OSError(
            error.errno or errno.EIO,
            f"the store {str(path)!r} cannot be written ({error.strerror or error}); the cells in "
            f"it are safe, and {remedy(error)} the same call goes on from there",
        ) from error


def _make(path: Path) -> None:
    """Make the directory of a store, if there is none."""
    try:
        path.mkdir(exist_ok=True)
    except (FileNotFoundError, FileExistsError, NotADirectoryError) as error:
        wrong = "is a file" if isinstance(error, FileExistsError) else "has no folder to be in"
        raise ParameterError(f"store = {str(path)!r} {wrong}") from error
