"""A trapping region of an attractor, and how starts are followed to it."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def wrapped(offsets: Array, *, rotor: bool) -> Array:
    """Return differences of states, shape (..., 4), with that of a rotor's angle in [-pi, pi]."""
    if rotor:
        offsets = offsets.copy()
        offsets[..., 0] -= math.tau * np.round(offsets[..., 0] / math.tau)
    return offsets


@dataclass(frozen=True, eq=False)
class Region:
    """The states X with ``|factor @ (X - center)| <= 1`` at the start of a drive period.

    Attributes
    ----------
    center, factor
        Section point of the attractor, shape (4,), and the matrix of the norm, shape (4, 4).
    counts
        Impacts in each of the m drive periods after ``center``, -1 with complete chatter.
    contraction
        Factor by which m drive periods brought every sample nearer, at least.
    samples
        Number of random states, in twice the region, that confirmed it.
    """

    center: Array
    factor: Array
    counts: tuple[int, ...]
    contraction: float
    samples: int

    @property
    def extents(self) -> Array:
        """Half extents of the region along x1, v1, x2, v2."""
        inverse = np.linalg.inv(self.factor)
        return np.sqrt((inverse @ inverse.T).diagonal())


@dataclass(frozen=True)
class Follow:
    """How starts are followed: drive periods, sections kept, caps; see ``vi.basins``."""

    periods: int
    keep: int
    max_events: int | None
    chatter_tolerance: float
