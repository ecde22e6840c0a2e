"""Damage in a store: found before its numbers are used, and reported with a remedy.

Three checks find wrong numbers. Every chunk ends with a checksum, which Zarr's codec compares when
the chunk is read. The metadata of the store have a checksum as well, `fingerprint`. Zarr reads a
chunk without a file as fill values; so every chunk of a finished cell has its file, even if it
contains fill values only (`Stored.missing`). A chunk that is deleted is computed again by the next
call, to the same bits; this repairs a damaged one.
"""

import itertools
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ParameterError
from .fields import Layout
from .store_layout import fingerprint, row_chunk

# What Zarr and its codecs raise on damaged bytes. A file that is not there is damage as well.
_DAMAGE = (ValueError, KeyError, TypeError, IndexError, RuntimeError, FileNotFoundError)
_HOPELESS = "what it says of itself cannot be trusted: move it away, and the same call begins anew"


def damaged(path: Path, what: object, remedy: str = _HOPELESS) -> ParameterError:
    """Return the error of a store that is damaged."""
    return ParameterError(f"store = {str(path)!r} is damaged ({what}); {remedy}")


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn the errors of Zarr for damaged bytes into one error."""
    try:
        yield
    except ParameterError:
        raise
    except _DAMAGE as error:
        raise damaged(path, repr(error)) from error


def check_arrays(group: Any, layout: Layout, tile: tuple[int, ...]) -> None:
    """Raise ValueError where the layout, or an array, is not as it was made."""
    if group.attrs["fingerprint"] != fingerprint(layout, tile):
        raise ValueError("its description has changed")
    for entry, rows in layout.arrays():
        array = group[entry.name]
        outer = layout.grid.shape if rows is None else array.shape[:1]
        chunks = tile if rows is None else (row_chunk(entry),)
        place = (0,) * array.ndim
        if (
            array.shape != outer + entry.shape
            or array.chunks != chunks + entry.shape
            or array.dtype != entry.dtype
            or not np.array_equal(array.fill_value, np.array(entry.fill), equal_nan=True)
            or array.metadata.encode_chunk_key(place) != "/".join(["c", *map(str, place)])
        ):
            raise ValueError(f"{entry.name} is another array")


# Name of a chunk's file within the store, and the chunk's place in its array.
_Chunk = tuple[str, tuple[slice, ...]]


class Chunks:
    """The files in which the chunks of a store's arrays are."""

    def __init__(self, path: Path, layout: Layout, arrays: dict[str, Any]) -> None:
        self.path = path
        self.layout = layout
        self.arrays = arrays

    def of(self, name: str, place: tuple[slice, ...]) -> Iterator[_Chunk]:
        """Return name and place of every chunk that has a part in a place of an array."""
        array = self.arrays[name]
        whole = place + (slice(None),) * (array.ndim - len(place))
        ranges = []
        for part, size, length in zip(whole, array.shape, array.chunks, strict=True):
            first, last, _ = part.indices(size)
            ranges.append(range(first // length, -(-last // length) if last > first else 0))
        for index in itertools.product(*ranges):
            corner = zip(index, array.chunks, strict=True)
            within = tuple(slice(i * length, (i + 1) * length) for i, length in corner)
            yield "/".join([name, "c", *map(str, index)]), within

    def missing(self, name: str, place: tuple[slice, ...]) -> Iterator[_Chunk]:
        """Return those that have no file."""
        return ((file, part) for file, part in self.of(name, place) if not self._exists(file))

    def _exists(self, file: str) -> bool:
        return (self.path / file).is_file()

    def check(self, name: str, place: tuple[slice, ...]) -> None:
        """Refuse a place of an array that has a chunk without file, though its cells are done.

        ``place`` is of cells, or of rows all of which belong to cells.

        Raises
        ------
        ParameterError
            If there is one.
        """
        if name == "status":
            return  # without it the cells are pending
        cells = len(self.layout.grid.shape)
        rows = name in {entry.name for entry, group in self.layout.arrays() if group is not None}
        for file, part in self.missing(name, place):
            done = rows or self.read("status", part[:cells]).any()
            if done and not self._exists(file):  # otherwise it has been written in the meantime
                raise damaged(self.path, f"{file} is missing", "the same call computes it again")

    def read(self, name: str, place: tuple[slice, ...]) -> NDArray[Any]:
        """Read a part of an array.

        Raises
        ------
        ParameterError
            If a chunk is damaged.
        """
        array = self.arrays[name]
        try:
            return np.asarray(array[place])
        except _DAMAGE as error:
            remedy = "delete that file, and the same call computes it again"
            for file, part in self.of(name, place):
                try:
                    array[part]
                except _DAMAGE as found:
                    raise damaged(self.path, f"{file}: {found!r}", remedy) from found
            raise damaged(self.path, repr(error)) from error
