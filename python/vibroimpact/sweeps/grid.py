"""Grids of cells: named axes in C order, and their division into tiles.

A cell is one point of the grid; its number runs through the last axis fastest. Only the axes are
stored, so that a grid of a billion cells takes no more memory than its two axes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import reject, vector
from ..fixed_arrays import FixedArrays
from ..interruption import interruptible


@interruptible
@dataclass(frozen=True, eq=False)
class Grid(FixedArrays):
    """All combinations of the values of named axes.

    Parameters
    ----------
    axes
        Name of each axis, slowest first, and its values, shape (n,), dimensionless, any order. No
        axis at all makes a grid of one cell.

    Raises
    ------
    ParameterError
        If a name is not an identifier, or an axis is not a one-dimensional array of finite numbers.
    """

    axes: Mapping[str, NDArray[np.float64]]

    def __init__(self, axes: Mapping[str, ArrayLike]) -> None:
        checked = {}
        for name, values in axes.items():
            if not isinstance(name, str) or not name.isidentifier():
                reject("name of an axis", name, "an identifier")
            checked[name] = vector(name, values)
            checked[name].flags.writeable = False
        object.__setattr__(self, "axes", checked)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values along each axis."""
        return tuple(len(values) for values in self.axes.values())

    @property
    def size(self) -> int:
        """Number of cells."""
        return math.prod(self.shape)

    def __repr__(self) -> str:
        """Number of values of each axis."""
        axes = " x ".join(f"{len(values)} {name}" for name, values in self.axes.items())
        return f"<Grid {axes or 'of one cell'}>"

    def values(self, first: int, last: int) -> dict[str, NDArray[np.float64]]:
        """Return the value on each axis of the cells first ... last - 1, shape (last - first,)."""
        number = np.arange(first, last)
        result = {}
        for name in reversed([*self.axes]):
            values = self.axes[name]
            number, place = np.divmod(number, max(len(values), 1))
            result[name] = values[place]
        return {name: result[name] for name in self.axes}


@dataclass(frozen=True)
class Tiling:
    """A grid cut into equal tiles, each a block of the grid and a range of cells at once.

    A tile is some whole rows of the grid, or part of one row: a chunk of a Zarr array of the grid's
    shape as well as a piece of work in cell order.

    Attributes
    ----------
    shape
        Shape of the grid.
    tile
        Shape of a tile; the last one along an axis may be smaller.
    """

    shape: tuple[int, ...]
    tile: tuple[int, ...]

    @classmethod
    def of(cls, shape: tuple[int, ...], most: int) -> Tiling:
        """Cut into tiles of at most so many cells, nearly equal ones along the axis that is cut."""
        tile: list[int] = []
        room = most
        for length in reversed(shape):
            parts = max(1, -(-length // room))
            tile.append(max(1, -(-length // parts)))
            # Once an axis is cut, the slower ones go one value at a time.
            room = max(1, room // length) if parts == 1 and length else 1
        return cls(shape, tuple(reversed(tile)))

    @property
    def blocks(self) -> tuple[int, ...]:
        """Number of tiles along each axis."""
        return tuple(-(-n // t) for n, t in zip(self.shape, self.tile, strict=True))

    def __len__(self) -> int:
        """Return the number of tiles."""
        return math.prod(self.blocks)

    def slices(self, index: int) -> tuple[slice, ...]:
        """Return the place of tile ``index`` in an array of the grid's shape."""
        result: list[slice] = []
        for blocks, n, t in zip(
            reversed(self.blocks), reversed(self.shape), reversed(self.tile), strict=True
        ):
            index, block = divmod(index, blocks)
            result.append(slice(block * t, min((block + 1) * t, n)))
        return tuple(reversed(result))

    def cells(self, index: int) -> tuple[int, int]:
        """Return the first cell of tile ``index`` and the one after its last."""
        first, size = 0, 1
        for part, n in zip(self.slices(index), self.shape, strict=True):
            first = first * n + part.start
            size *= part.stop - part.start
        return first, first + size

    def view(self, index: int, array: NDArray[Any]) -> NDArray[Any]:
        """Give ``array``, one entry per cell of tile ``index``, the tile's shape."""
        lengths = tuple(part.stop - part.start for part in self.slices(index))
        return array.reshape(lengths + array.shape[1:])
