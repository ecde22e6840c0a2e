"""Cells of a grid around its values: for maps over two axes, and for marks along one."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from numpy.typing import NDArray

Array = NDArray[np.float64]


def edges(values: Array) -> Array:
    """Edges of cells around rising values, shape (n + 1,)."""
    if len(values) == 1:
        return np.array([values[0] - 0.5, values[0] + 0.5])
    middle = 0.5 * (values[1:] + values[:-1])
    return np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])


def spans(parameter: Array, chosen: NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Intervals of the chosen values, each reaching half way to its neighbours."""
    order = np.argsort(parameter, kind="stable")
    values, mask = parameter[order], chosen[order]
    middle = 0.5 * (values[1:] + values[:-1])
    left = np.concatenate([values[:1], middle])
    right = np.concatenate([middle, values[-1:]])
    ends = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [
        (float(left[start]), float(right[stop - 1]))
        for start, stop in zip(ends[::2], ends[1::2], strict=True)
    ]


def boxes(
    cells: list[tuple[float, float]], low: float, high: float
) -> list[list[tuple[float, float]]]:
    """Corners of boxes over intervals of the first axis, between two heights."""
    return [[(left, low), (left, high), (right, high), (right, low)] for left, right in cells]


def strip(
    ax: Axes,
    parameter: Array,
    chosen: NDArray[np.bool_],
    heights: tuple[float, float],
    color: str,
    *,
    gid: str,
    text: str = "",
) -> PolyCollection:
    """Mark the chosen values along the first axis, between two parts of the axes' height."""
    marks = PolyCollection(
        boxes(spans(parameter, chosen), *heights),
        facecolors=color,
        # The outline keeps a single value visible where its cell is narrower than a dot.
        edgecolors=color,
        linewidths=0.4,
        transform=ax.get_xaxis_transform(),
        label=text,
    )
    marks.set_gid(gid)
    ax.add_collection(marks, autolim=False)
    return marks
