"""Places for the names of regions of a plane: inside if there is room, else beside, with a line.

The axes are a raster of points (1/72 inch). A label covers no curve, no mark and no other label.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.path import Path
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Room around a label inside its region, in points, in the order in which it is tried.
_ROOMS = (16, 12, 8, 5, 3, 2, 1)
# Half of what a mark covers, and room around a label beside its region.
_MARK = 3
_GAP = 2
# A label may be so much farther from its region in order to be on free ground.
_ON_OTHER = 60.0
_POINTS_PER_INCH = 72.0
# Curves nearer than so many points look like one; which part of a curve must be that near.
_NEAR, _MOST = 3, 0.8


@dataclass(frozen=True)
class Place:
    """The place of a label, and the point of its region to which a line leads, if any."""

    at: tuple[float, float]
    leads_to: tuple[float, float] | None


class Ground:
    """The raster of an axes, on which labels are placed one after the other.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
        With its final limits and size.
    curves, marks : sequence of arrays of shape (k, 2)
        What labels must not cover.
    label : (float, float)
        Width and height of a label in points.
    """

    def __init__(
        self,
        ax: Axes,
        curves: Sequence[Array],
        marks: Sequence[Array],
        label: tuple[float, float],
    ) -> None:
        self._ax = ax
        box, dpi = ax.get_window_extent(), ax.get_figure(root=True).dpi  # type: ignore[union-attr]
        self._origin = np.array([box.x0, box.y0])
        self._scale = _POINTS_PER_INCH / dpi
        self._columns, self._rows = (round(side * self._scale) for side in (box.width, box.height))
        self._half = (int(np.ceil(0.5 * label[0])), int(np.ceil(0.5 * label[1])))
        self._taken: Mask = np.zeros((self._rows, self._columns), np.bool_)
        for curve in curves:
            self._cover(self._dense(self.raster(curve)), 0)
        for points in marks:
            self._cover(self.raster(points), _MARK)

    def raster(self, values: Array) -> Array:
        """Return points of the plane in points of the raster."""
        shown: Array = (self._ax.transData.transform(values) - self._origin) * self._scale
        return shown

    def inside(self, border: Array) -> Mask:
        """Return which points of the raster a border encloses."""
        row, column = np.mgrid[: self._rows, : self._columns]
        centres = np.column_stack([column.ravel() + 0.5, row.ravel() + 0.5])
        found = Path(self.raster(border)).contains_points(centres)
        mask: Mask = found.reshape(self._rows, self._columns)
        return mask

    def along(self, curve: Array) -> Mask:
        """Return which points of the raster a curve passes through."""
        mask: Mask = np.zeros((self._rows, self._columns), np.bool_)
        for x, y in np.floor(self._dense(self.raster(curve))).astype(int).tolist():
            if 0 <= x < self._columns and 0 <= y < self._rows:
                mask[y, x] = True
        return mask

    @staticmethod
    def covers(one: Mask, other: Mask) -> bool:
        """Return whether most of what is in view of another region is near this one."""
        if not other.any():
            return False
        near = np.zeros_like(one)
        padded = np.pad(one, _NEAR)
        rows, columns = one.shape
        for down in range(2 * _NEAR + 1):
            for right in range(2 * _NEAR + 1):
                near |= padded[down : down + rows, right : right + columns]
        return bool((near & other).sum() >= _MOST * other.sum())

    def place(self, region: Mask, others: Mask) -> Place | None:
        """Return the place for the label of a region, and occupy it; None if not in view.

        Parameters
        ----------
        region, others : arrays of bool
            What the region covers of the raster, and what other regions do.
        """
        if not region.any():
            return None
        for room in _ROOMS:
            free = self._fits(self._taken | ~region, room)
            if free.any():
                return self._take(self._nearest(free, _middle(free)), None)
        anchor = _middle(region)
        free = self._fits(self._taken | region, _GAP)
        if not free.any():
            return self._take(anchor, None)
        on_other = ~self._fits(others, 0)
        return self._take(self._nearest(free, anchor, on_other), anchor)

    def _take(self, centre: tuple[int, int], anchor: tuple[int, int] | None) -> Place:
        (row, column), (wide, high) = centre, self._half
        top, left = max(row - high - 1, 0), max(column - wide - 1, 0)
        self._taken[top : row + high + 2, left : column + wide + 2] = True
        return Place(self._value(centre), None if anchor is None else self._value(anchor))

    def _value(self, cell: tuple[int, int]) -> tuple[float, float]:
        pixels = (np.array([cell[1], cell[0]]) + 0.5) / self._scale + self._origin
        x, y = self._ax.transData.inverted().transform(pixels).tolist()
        return x, y

    def _fits(self, taken: Mask, room: int) -> Mask:
        """Return where the centre of a label may be that needs so much room around it."""
        wide, high = self._half[0] + room, self._half[1] + room
        free: Mask = np.zeros_like(taken)
        if 2 * high + 1 > self._rows or 2 * wide + 1 > self._columns:
            return free
        total = np.pad(taken.astype(np.int64).cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
        tall, broad = 2 * high + 1, 2 * wide + 1
        covered = (total[tall:, broad:] - total[:-tall, broad:] - total[tall:, :-broad]) + total[
            :-tall, :-broad
        ]
        free[high : high + covered.shape[0], wide : wide + covered.shape[1]] = covered == 0
        return free

    @staticmethod
    def _nearest(free: Mask, to: tuple[int, int], on_other: Mask | None = None) -> tuple[int, int]:
        row, column = np.mgrid[: free.shape[0], : free.shape[1]]
        away = np.hypot(row - to[0], column - to[1])
        if on_other is not None:
            away[on_other] += _ON_OTHER
        place = int(np.where(free, away, np.inf).argmin())
        return place // free.shape[1], place % free.shape[1]

    @staticmethod
    def _dense(points: Array) -> Array:
        """Return a point of a curve for every half point of its length."""
        if len(points) < 2:
            return points
        steps = np.hypot(*np.diff(points, axis=0).T)
        way = np.concatenate([[0.0], steps.cumsum()])
        # An upper limit for a curve in view, also if one end is far outside.
        count = min(int(2.0 * way[-1]) + 2, 20_000)
        at = np.linspace(0.0, way[-1], count)
        return np.column_stack([np.interp(at, way, column) for column in points.T])

    def _cover(self, points: Array, reach: int) -> None:
        for x, y in np.floor(points).astype(int).tolist():
            if -reach <= x < self._columns + reach and -reach <= y < self._rows + reach:
                rows = slice(max(y - reach, 0), y + reach + 1)
                self._taken[rows, max(x - reach, 0) : x + reach + 1] = True


def _middle(mask: Mask) -> tuple[int, int]:
    """Return the point of a mask nearest to its mean."""
    row, column = np.nonzero(mask)
    best = int(np.hypot(row - row.mean(), column - column.mean()).argmin())
    return int(row[best]), int(column[best])
