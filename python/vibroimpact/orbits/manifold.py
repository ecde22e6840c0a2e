"""The unstable manifold of a saddle, and its two sides."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..fixed_arrays import FixedArrays
from ..interruption import interruptible
from .motion import PeriodicMotion, same_orbit

Array = NDArray[np.float64]


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class ManifoldSide(FixedArrays):
    """One side of an unstable manifold.

    Attributes
    ----------
    points
        States x1, v1, x2, v2 on the section, from the saddle on, shape (k, 4).
    breaks
        Numbers i of the points before which the curve is broken, shape (b,): it does not join
        points i - 1 and i.
    length
        Its length in the space of (x1, v1, x2, v2), without the breaks.
    end
        Why it ends: ``length``, ``attractor`` (the curve runs into it), ``points``, ``resolution``
        (neighbours that double precision cannot distinguish at the start are further apart than the
        spacing), ``interrupted``, or the stop reason of a simulation.
    attractors
        Where its orbits end up, the most frequent first, from a sample of 16 on the first piece,
        through which all of them pass: stable PeriodicMotions, or the label or stop reason of a
        run that ends on none.
    """

    points: Array
    breaks: NDArray[np.int64]
    length: float
    end: str
    attractors: tuple[PeriodicMotion | str, ...]

    @property
    def attractor(self) -> PeriodicMotion | str:
        """The attractor that most of its orbits reach; ``""`` if none was followed."""
        return self.attractors[0] if self.attractors else ""

    def pieces(self) -> list[Array]:
        """Return the points between the breaks, as arrays of shape (k, 4)."""
        return np.split(self.points, self.breaks)

    @property
    def _to(self) -> str:
        """The attractors of its orbits, in words."""
        names = (x.label if isinstance(x, PeriodicMotion) else x for x in self.attractors)
        return ", ".join(names) or "unknown"

    def __repr__(self) -> str:
        """Length, number of points, end, and where it leads."""
        return (
            f"<ManifoldSide of length {self.length:.6g}, {len(self.points)} points, "
            f"ends: {self.end}, to {self._to}>"
        )


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class UnstableManifold(FixedArrays):
    """The unstable manifold of a saddle on a stroboscopic section.

    Attributes
    ----------
    motion
        The saddle.
    multiplier
        Its multiplier outside the unit circle.
    section_phase
        Drive phase of the section, from that of t = 0.
    saddle
        State x1, v1, x2, v2 of the motion on the section, shape (4,).
    direction
        Unit eigenvector there, shape (4,); its largest component is positive.
    sides
        The side along ``direction`` and the one against it.
    """

    motion: PeriodicMotion
    multiplier: float
    section_phase: float
    saddle: Array
    direction: Array
    sides: tuple[ManifoldSide, ...]

    @property
    def separates(self) -> bool:
        """Whether its sides lead to different attractors: the saddle is on their basins' border.

        False also where that is not known because something that is no periodic motion was reached.
        """
        one, other = self.sides[0].attractors, self.sides[-1].attractors
        known = all(isinstance(found, PeriodicMotion) for found in (*one, *other))
        return bool(one and other and known) and not any(
            same_attractor(first, second) for first in one for second in other
        )

    def __repr__(self) -> str:
        """Motion, multiplier and where the sides lead."""
        ends = " and ".join(side._to for side in self.sides)
        return (
            f"<UnstableManifold of {self.motion.label}, lambda = {self.multiplier:.6g}, to {ends}>"
        )


def same_attractor(one: PeriodicMotion | str, other: PeriodicMotion | str) -> bool:
    """Whether two ends are the same: one orbit, or one label or stop reason."""
    if isinstance(one, PeriodicMotion) and isinstance(other, PeriodicMotion):
        return same_orbit(one, other)
    return one is other or (isinstance(one, str) and one == other)
