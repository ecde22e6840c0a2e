"""A trapping region of an attractor, and how starts are followed to it."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...system import System

Array = NDArray[np.float64]


def is_rotor(system: Any) -> bool:
    """Whether the first number of a state counts modulo a turn."""
    return isinstance(system, System) and system.is_rotor


def wrapped(offsets: Array, *, rotor: bool) -> Array:
    """Return differences of states, shape (..., d), with that of a rotor's angle in [-pi, pi]."""
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
        Section point of the attractor, shape (d,), and the matrix of the norm, shape (d, d); a
        state has d numbers, q before v of a structure.
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
        """Half extents of the region along each number of a state."""
        inverse = np.linalg.inv(self.factor)
        return np.sqrt((inverse @ inverse.T).diagonal())


@dataclass(frozen=True)
class Follow:
    """How starts are followed: drive periods, sections kept, caps; see ``vi.basins``."""

    periods: int
    keep: int
    max_events: int | None
    chatter_tolerance: float
