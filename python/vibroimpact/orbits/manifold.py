"""The unstable manifold of a saddle, and its two sides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..fixed_arrays import FixedArrays
from ..interruption import interruptible
from ..showing import Facts, Shown
from ..tables import frame
from ..verbs import verb
from .motion import PeriodicMotion, same_orbit

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class ManifoldSide(FixedArrays, Shown):
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

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> saddle = motion.follow(drive_frequency=(1.5, 1.8)).at(drive_frequency=1.55)[0]
    >>> side = vi.unstable_manifold(saddle, length=0.5, settle=300).sides[0]
    >>> side.points.shape[1], side.length > 0.4
    (4, True)
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
        """Return the points between the breaks, as arrays of shape (k, 4).

        Examples
        --------
        >>> len(side.pieces())
        1
        """
        return np.split(self.points, self.breaks)

    def plot(self, **options: Any) -> Axes:
        """Draw the side, by ``vi.plot.manifold``.

        Parameters
        ----------
        **options
            As in ``vi.plot.manifold``.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> side.plot().get_xlabel()
        'position $x_1$ of body 1 once per drive period'
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    @property
    def _to(self) -> str:
        """The attractors of its orbits, in words."""
        names = (x.label if isinstance(x, PeriodicMotion) else x for x in self.attractors)
        return ", ".join(names) or "unknown"

    def _facts(self) -> Facts:
        return {
            "length": f"{self.length:.6g}",
            "points": len(self.points),
            "ends": self.end,
            "leads to": self._to,
        }

    def __repr__(self) -> str:
        """Length, number of points, end, and where it leads."""
        return (
            f"<ManifoldSide of length {self.length:.6g}, {len(self.points)} points, "
            f"ends: {self.end}, to {self._to}>"
        )


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class UnstableManifold(FixedArrays, Shown):
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

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> saddle = motion.follow(drive_frequency=(1.5, 1.8)).at(drive_frequency=1.55)[0]
    >>> manifold = vi.unstable_manifold(saddle, length=0.5, settle=300)
    >>> manifold.direction.shape
    (4,)
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

    def plot(self, **options: Any) -> Axes:
        r"""Draw both sides, by ``vi.plot.manifold``.

        Parameters
        ----------
        **options
            As in ``vi.plot.manifold``.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> manifold.plot().get_xlabel()
        'position $x_1$ of body 1 once per drive period, at $\\psi = 0$'
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    def to_pandas(self) -> pandas.DataFrame:
        """Return the points of both sides as a data frame; ``piece`` counts between breaks.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> manifold.to_pandas().columns.tolist()
        ['side', 'piece', 'x1', 'v1', 'x2', 'v2']
        """
        lengths = [len(side.points) for side in self.sides]
        pieces = [
            np.searchsorted(side.breaks, np.arange(len(side.points)), side="right")
            for side in self.sides
        ]
        points = np.concatenate([side.points for side in self.sides])
        return frame(
            {
                "side": np.repeat(np.arange(len(lengths)), lengths),
                "piece": np.concatenate(pieces),
                **dict(zip(("x1", "v1", "x2", "v2"), points.T, strict=True)),
            }
        )

    def _facts(self) -> Facts:
        facts: Facts = {"motion": self.motion.label, "multiplier": f"{self.multiplier:.6g}"}
        for number, side in enumerate(self.sides):
            length = f"length {side.length:.6g}, {len(side.points)} points"
            facts[f"side {number}"] = f"{length}, ends: {side.end}, to {side._to}"
        return facts

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
