"""Columns of two computations that differ in their values along the last axis alone."""

import functools
import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .columns import Columns
from .fields import Layout
from .grid import Grid
from .results import in_memory
from .store import open_columns

# Names of the stores of a refined diagram.
LEVELS = r"level-\d+"


def is_refined(path: str | os.PathLike[str]) -> bool:
    """Whether a directory has the stores of a refined diagram."""
    return (Path(path) / "level-0").is_dir()


def open_levels(path: str | os.PathLike[str]) -> Columns:
    """Return the columns of all levels of a refined diagram, in memory.

    Raises
    ------
    ParameterError
        If one of its stores is damaged.
    """
    levels = sorted(Path(path).glob("level-*"), key=lambda found: int(found.name.split("-")[1]))
    return functools.reduce(merged, map(open_columns, levels))


def merged(first: Columns, second: Columns) -> Columns:
    """Return the columns over the values of both, in increasing order, in memory."""
    name = [*first.grid.axes][-1]
    values = np.concatenate([first.grid.axes[name], second.grid.axes[name]])
    order = np.argsort(values, kind="stable")
    layout = Layout(
        first.layout.kind,
        Grid({**first.grid.axes, name: values[order]}),
        first.layout.fields,
        first.layout.rows,
        first.layout.settings,
        first.layout.version,
    )
    axis = len(first.grid.axes) - 1
    arrays = {}
    for entry, group in layout.arrays():
        if group is None:
            both = np.concatenate([first[entry.name], second[entry.name]], axis=axis)
            arrays[entry.name] = np.take(both, order, axis=axis)
    for group in layout.rows:
        rows = _row_order(first, second, group.offset, order)
        for entry in group.fields:
            arrays[entry.name] = np.concatenate([first[entry.name], second[entry.name]])[rows]
    return in_memory(layout, arrays)


def _row_order(
    first: Columns, second: Columns, offset: str, order: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Return the places of the rows of the merged cells among the rows of both."""
    counts, begins, before = [], [], 0
    for columns in (first, second):
        offsets = columns[offset]
        length = columns.grid.shape[-1]
        counts.append(np.diff(offsets).reshape(-1, length))
        begins.append((before + offsets[:-1]).reshape(-1, length))
        before += offsets[-1]
    count = np.concatenate(counts, axis=1)[:, order].ravel()
    begin = np.concatenate(begins, axis=1)[:, order].ravel()
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    rows: NDArray[np.intp] = np.repeat(begin, count) + within
    return rows
