"""A region of two parameters in which a periodic motion is stable."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import array_of, as_floats, number, one_value, reject
from ..interruption import interruptible
from ..showing import Facts, Shown
from ..verbs import verb
from .bifurcation import Bifurcation
from .curve import BifurcationCurve
from .motion import PeriodicMotion
from .ranges import Bounds

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class StabilityRegion(Shown):
    """A region of two parameters in which a periodic motion with given legs is stable.

    Attributes
    ----------
    motion
        The motion from which the region was found.
    parameters
        Names of both parameters.
    bounds
        Their ranges.
    arcs
        The curves of which the border consists, in order along it. Of each only the part that
        bounds the region is kept.
    border
        The whole border with its parts along the bounds, in order, shape (k, 2).
    closed
        Whether it came back to its start.
    why_not
        Why not, ``""`` if it did; ``interrupted`` after Ctrl-C.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> region = vi.stability_region(motion, drive_frequency=(1.6, 1.9), restitution=(0.75, 0.85))
    >>> region.parameters, region.closed
    (('drive_frequency', 'restitution'), True)
    """

    motion: PeriodicMotion
    parameters: tuple[str, str]
    bounds: Bounds
    arcs: tuple[BifurcationCurve, ...]
    border: Array
    closed: bool
    why_not: str

    @property
    def label(self) -> str:
        """The label of the motion, m-n."""
        return self.motion.label

    @property
    def extent(self) -> Array:
        """Least and largest value of both parameters, shape (2, 2): a row for each parameter.

        NaN if the border has no points.
        """
        if not len(self.border):
            return np.full((2, 2), np.nan)
        extent: Array = np.array([self.border.min(axis=0), self.border.max(axis=0)]).T
        return extent

    def sheets(self, values: ArrayLike) -> NDArray[np.int64]:
        """Return how many motions of the region there are at points; the border as a polygon.

        The region is a surface over the plane of the parameters: round a cusp it lies over itself,
        with two stable motions at one point.

        Parameters
        ----------
        values
            Of both parameters, shape (k, 2).

        Returns
        -------
        array of int, shape (k,)

        Examples
        --------
        >>> region.sheets([[1.8, 0.8], [0.5, 0.8]])
        array([1, 0])
        """
        wanted = "finite numbers of shape (k, 2)"
        given = array_of("values", values, wanted)
        if given.ndim != 2 or given.shape[1] != 2 or given.dtype.kind not in "iuf":
            reject("values", values, wanted)
        points = as_floats(given)
        if not np.isfinite(points).all():
            reject("values", values, wanted)
        a, b = self.border, np.roll(self.border, -1, axis=0)
        x, y = points[:, :1], points[:, 1:]
        # The winding number: a ray to the right counts the border upwards and downwards.
        upwards = (b[:, 1] > y).astype(np.int64) - (a[:, 1] > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            at = a[:, 0] + (y - a[:, 1]) * (b[:, 0] - a[:, 0]) / (b[:, 1] - a[:, 1])
        count: NDArray[np.int64] = np.abs((upwards * (x < at)).sum(axis=1))
        return count

    def crossings(self, **parameter: float) -> list[Bifurcation]:
        """Return the bifurcations of the border at one value of one parameter, by the other.

        Parameters
        ----------
        parameter
            One of the two parameters with its value: ``moment_amplitude=1.0``.

        Returns
        -------
        list of Bifurcation
            To rounding, in order of the other parameter. Where the border only touches the value
            there is none.

        Examples
        --------
        >>> len(region.crossings(restitution=0.8))
        1
        """
        name, given = one_value("crossings", self.parameters, [*parameter.items()])
        value, index = number(name, given), self.parameters.index(name)
        crossing = verb("crossing")
        found: list[Bifurcation] = [
            crossed
            for arc in self.arcs
            for k in np.flatnonzero(np.diff(arc.values[:, index] > value))
            if (crossed := crossing(arc, int(k), index, value)) is not None
        ]
        return sorted(found, key=lambda bifurcation: bifurcation.value)

    def plot(self, **options: Any) -> Axes:
        r"""Draw the curves of the border, by ``vi.plot.bifurcation_curves``.

        Parameters
        ----------
        **options
            As in ``vi.plot.bifurcation_curves``.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> region.plot().get_xlabel()
        'drive frequency $\\omega$'
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    def _facts(self) -> Facts:
        kinds = ", ".join(dict.fromkeys(str(arc.kind) for arc in self.arcs))
        return {
            "motion": self.label,
            **{
                name: f"{low:.6g} to {high:.6g}"
                for name, (low, high) in zip(self.parameters, self.extent, strict=True)
            },
            "border": kinds or "bounds only",
            "closed": "yes" if self.closed else f"no: {self.why_not}",
        }

    def __repr__(self) -> str:
        """Motion, extent, and of what the border consists."""
        kinds = " ".join(dict.fromkeys(arc.kind for arc in self.arcs)) or "bounds only"
        sides = ", ".join(
            f"{name} {low:.6g} ... {high:.6g}"
            for name, (low, high) in zip(self.parameters, self.extent, strict=True)
        )
        state = "closed" if self.closed else f"open: {self.why_not}"
        return f"<StabilityRegion of {self.label}, {sides}, {kinds}, {state}>"
