"""Computations over a grid in a Zarr store: written chunk by chunk, resumed after any end.

The store is a local directory without pickle. A chunk of its arrays is a chunk of the engine, and
rows are appended in the order of the chunks. Each file appears complete or not at all, and those of
the status come last: a chunk without a pending cell is whole, every other one is computed again.
"""

import errno
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..checks import reject
from ..errors import ParameterError
from .columns import Columns
from .fields import ChunkResult, Layout
from .grid import Tiling
from .store_layout import (
    check_format,
    consolidate,
    create,
    differences,
    mark,
    read_layout,
    reading,
    zarr_module,
)


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
        zarr_module()
        self.path = Path(path).absolute()
        self.layout = layout
        self.tiling = tiling
        # Rows must come in the order of the chunks.
        self.ordered = bool(layout.rows)
        self._lock = _locked(self.path)
        try:
            with reading(self.path), _writing(self.path):
                group = self._opened()
                self._arrays = {entry.name: group[entry.name] for entry, _ in layout.arrays()}
                consolidate(self.path)
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
            group = zarr_module().open_group(str(self.path), mode="r+", use_consolidated=False)
            check_format(self.path, group)
        elif parts.issuperset(self.path.iterdir()):
            group = zarr_module().create_group(str(self.path), attributes=mark())
        else:
            raise ParameterError(f"store = {str(self.path)!r} is a directory of something else")
        for part in parts:
            part.unlink()
        if "kind" not in group.attrs:  # the last to be written
            create(group, self.layout, self.tiling)
            return group
        found = differences(read_layout(group), self.layout)
        if found:
            raise ParameterError(
                f"store = {str(self.path)!r} holds another computation: {'; '.join(found)}"
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
        with reading(self.path), _writing(self.path):
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
    return Columns(arrays.layout, arrays, str(arrays.directory))


class StoredArrays:
    """Gives the arrays of a store; pickled as its path."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.layout, self._arrays = _opened(directory)
        self._counts = {
            entry.name: group.count.name for group in self.layout.rows for entry in group.fields
        }

    def __reduce__(self) -> tuple[Any, ...]:
        """Open the store again where it is unpickled."""
        return StoredArrays, (self.directory,)

    def __call__(self, name: str, place: tuple[slice, ...]) -> NDArray[Any]:
        """Return a part of an array."""
        with reading(self.directory):
            if name in self._counts:
                # A chunk that was cut short may have left rows without cells.
                place = (slice(0, int(self._arrays[self._counts[name]][()].sum())),)
            return np.asarray(self._arrays[name][place])


def _opened(directory: Path) -> tuple[Layout, dict[str, Any]]:
    """Return what is known of a store, and its arrays."""
    zarr = zarr_module()
    with reading(directory):
        if not (directory / "zarr.json").exists():
            raise ParameterError(f"{str(directory)!r} is not a store")
        group = zarr.open_group(str(directory), mode="r", use_consolidated=False)
        check_format(directory, group)
        if "kind" not in group.attrs:
            raise ParameterError(f"{str(directory)!r} is not a store yet, only begun")
        layout = read_layout(group)
        return layout, {entry.name: group[entry.name] for entry, _ in layout.arrays()}


def folder_of_stores(store: Any, names: str, kind: str) -> Path | None:
    """Return the folder of a computation that has several stores, of names like ``names``.

    Raises
    ------
    ParameterError
        If it holds something else, or has no folder to be in.
    """
    if store is None:
        return None
    if not isinstance(store, str | os.PathLike):
        reject("store", store, "the path of a directory")
    path = Path(store)
    new = not path.exists()
    ours = path.is_dir() and all(re.fullmatch(names, found.name) for found in path.iterdir())
    if not (new and path.absolute().parent.is_dir()) and not ours:
        reject("store", str(store), f"a new directory in one that exists, or one of {kind}")
    return path


def store_in(folder: Path | None, name: str) -> Path | None:
    """Return the path of one of the stores of a folder, which is made if need be."""
    if folder is None:
        return None
    folder.mkdir(exist_ok=True)
    return folder / name


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
