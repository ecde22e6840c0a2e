"""Computations over grids of cells: the engine, its fields, its results."""

from .columns import Columns, to_dataset
from .engine import compute
from .fields import STATUS, STATUS_NAMES, ChunkResult, Field, Layout, RowGroup, Task
from .grid import Grid, Tiling
from .store import open_columns

__all__ = [
    "STATUS",
    "STATUS_NAMES",
    "ChunkResult",
    "Columns",
    "Field",
    "Grid",
    "Layout",
    "RowGroup",
    "Task",
    "Tiling",
    "compute",
    "open_columns",
    "to_dataset",
]
