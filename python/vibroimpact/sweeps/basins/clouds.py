"""Attractors that are not periodic, recognised by where their sections lie.

The section points of a long run on the attractor are sorted into boxes. The boxes are as small as
the run itself allows: points of its second half must find points of the first in their own box or
a neighbouring one. Another run is on the same attractor if its sections find such boxes, too.
"""

import hashlib
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Boxes along the largest extent that are tried, finest first.
_DIVISIONS = (64, 48, 32, 24, 16, 12, 8, 6, 4)
# Part of the second half that must find the first. With half of it the boxes are so fine that they
# miss much of the attractor, which then counts as several.
_COVERED = 0.99
# Part of a run's sections that must lie in the cloud, for the run to be on the attractor.
INSIDE = 0.95
# Numbers of a state in which boxes are counted, at most; of longer states those that vary most.
_MOST = 4


@dataclass(frozen=True, eq=False)
class Cloud:
    """The boxes that the section of an attractor visits, and their neighbours.

    Attributes
    ----------
    low, width
        Corner of the boxes and their widths, shape (c,), c at most 4.
    boxes
        Their numbers, sorted.
    covered
        Part of the second half of the points that found the first.
    rotor
        Whether x1 counts modulo a turn.
    counted
        Places of the c numbers of a state in which boxes are counted; of states of more than four
        numbers those that vary most. None for all.
    """

    low: Array
    width: Array
    boxes: NDArray[np.int64]
    covered: float
    rotor: bool
    counted: tuple[int, ...] | None = None

    def inside(self, points: Array) -> NDArray[np.bool_]:
        """Tell which states, shape (..., d), lie in the cloud."""
        points = _in_one_turn(points, rotor=self.rotor)
        if self.counted is not None:
            points = points[..., self.counted]
        numbers, valid = _numbers(np.floor((points - self.low) / self.width))
        place = np.minimum(np.searchsorted(self.boxes, numbers), len(self.boxes) - 1)
        found: NDArray[np.bool_] = valid & (self.boxes[place] == numbers)
        return found

    def digest(self) -> str:
        """Return a checksum of the cloud."""
        parts = (self.low, self.width, self.boxes)
        return hashlib.sha256(b"".join(part.tobytes() for part in parts)).hexdigest()

    def holds(self, tails: Array) -> NDArray[np.bool_]:
        """Tell which tails of sections, shape (k, keep, d), belong to the attractor."""
        return np.asarray(self.inside(tails).mean(axis=-1) >= INSIDE)


def cloud_of(points: Array, *, rotor: bool = False) -> Cloud | None:
    """Return the cloud of section points in order of time, shape (k, d).

    None if even coarse boxes do not contain its second half: the run was too short, or drifts.
    """
    points = _in_one_turn(points, rotor=rotor)
    whole, counted = points, None
    if points.shape[1] > _MOST:
        order = np.argsort(-np.ptp(points, axis=0), kind="stable")
        counted = tuple(sorted(order[:_MOST].tolist()))
        points = points[:, counted]
    half = len(points) // 2
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    # For a coordinate that hardly varies, boxes are wide against rounding.
    floor = 1e-9 * float(np.abs(points).max()) + 1e-300
    for divisions in _DIVISIONS:
        width = np.maximum(extent / divisions, floor)
        first = Cloud(low, width, _visited(points[:half], low, width), 0.0, rotor, counted)
        covered = float(first.inside(whole[half:]).mean())
        if covered >= _COVERED:
            return Cloud(low, width, _visited(points, low, width), covered, rotor, counted)
    return None


def _in_one_turn(points: Array, *, rotor: bool) -> Array:
    if rotor:
        points = points.copy()
        points[..., 0] = np.mod(points[..., 0], 2.0 * np.pi)
    return points


def _visited(points: Array, low: Array, width: Array) -> NDArray[np.int64]:
    """Number the boxes that hold points, and their neighbours."""
    boxes = np.unique(np.floor((points - low) / width).astype(np.int64), axis=0)
    count = points.shape[1]
    around = np.array(list(product((-1, 0, 1), repeat=count)))  # a neighbour in every direction
    numbers, _ = _numbers((boxes[:, None] + around).reshape(-1, count))
    return np.unique(numbers)


def _numbers(places: NDArray[Any]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Number the boxes at whole-numbered places; False for those far away."""
    base = 2 * _DIVISIONS[0]
    reach = _DIVISIONS[0] // 2
    valid: NDArray[np.bool_] = np.all((places >= -reach) & (places < base - reach), axis=-1)
    shifted = np.where(valid[..., None], places + reach, 0).astype(np.int64)
    powers = base ** np.arange(places.shape[-1], dtype=np.int64)
    numbers: NDArray[np.int64] = shifted @ powers
    return numbers, valid
