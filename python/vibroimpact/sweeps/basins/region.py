"""A trapping region of an attractor, and how starts are followed to it."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...system import System

Array = NDArray[np.float64]


def is_rotor(system: Any) -> bool:
    """Whether the first number of a state counts modulo a turn."""
    return isinstance(system, System) and system.is_rotor


def to_core(system: Any, rows: Array) -> Array:
    """Return states (..., d) in the coordinates of the compiled machine."""
    return _converted(system, rows, system._to_core)


def from_core(system: Any, rows: Array) -> Array:
    """Return states (..., d) of the compiled machine in the coordinates of a user."""
    return _converted(system, rows, system._from_core)


def _converted(system: Any, rows: Array, convert: Callable[[Array], Array]) -> Array:
    *lead, width = rows.shape
    # Of a structure q before v.
    own = (width,) if system._AXES == 1 else (2, width // 2)
    states = convert(rows.reshape(*lead, *own))
    return states.reshape(*lead, math.prod(states.shape[len(lead) :]))


def wrapped(offsets: Array, *, rotor: bool) -> Array:
    """Return differences of states, shape (..., d), with that of a rotor's angle in [-pi, pi]."""
    if rotor:
        offsets = offsets.copy()
        offsets[..., 0] -= math.tau * np.round(offsets[..., 0] / math.tau)
    return offsets


@dataclass(frozen=True, eq=False)
class Region:
    """The states X with ``|factor @ (X - center)| <= 1`` at the start of a drive period.

    They are those of the compiled machine: of a structure `from_modes` in its modal coordinates.

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
        """Half extents of the region along each number of such a state."""
        inverse = np.linalg.inv(self.factor)
        return np.sqrt((inverse @ inverse.T).diagonal())


@dataclass(frozen=True)
class Follow:
    """How starts are followed: drive periods, sections kept, caps; see ``vi.basins``."""

    periods: int
    keep: int
    max_events: int | None
    chatter_tolerance: float
