"""The region of two parameters in which a periodic motion exists and is stable, by its border.

From a stable motion one parameter is varied up to the first bifurcation. Its curve is followed both
ways to points of codimension two, at which the motion would lose more than the curve takes; there
the border turns into the other curve through that point, on the side where the first condition
holds. Where a curve meets a bound of the parameters the border runs along the bound. So it is
walked round until it closes (docs/islands.md).

The border is that component of the edge of stability which the walk meets; a hole inside the region
has a border of its own. Beyond a grazing or a regime border the motion may go on as a stable one
with other legs: that is another region.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import array_of, as_floats, number, reject
from ..continuation.curves import curve_point
from ..continuation.path import OwnTest, PathEnd
from ..errors import Interrupted
from .border_walk import Walk
from .borders import BifurcationCurve, CurveSteps
from .branch import Bifurcation
from .kinds import BifurcationKind
from .motion import PeriodicMotion, motion_of
from .ranges import Bounds, two_ranges

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class StabilityRegion:
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
        """The motion in a word, m-n."""
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
        """
        if len(parameter) != 1 or next(iter(parameter)) not in self.parameters:
            reject("parameter", parameter, f"one of {', '.join(self.parameters)} with its value")
        name, given = next(iter(parameter.items()))
        value, index = number(name, given), self.parameters.index(name)
        found = [
            crossing
            for arc in self.arcs
            for k in np.flatnonzero(np.diff(arc.values[:, index] > value))
            if (crossing := _crossing(arc, int(k), index, value)) is not None
        ]
        return sorted(found, key=lambda bifurcation: bifurcation.value)

    def __repr__(self) -> str:
        """Motion, extent, and of what the border consists."""
        kinds = " ".join(dict.fromkeys(arc.kind for arc in self.arcs)) or "bounds only"
        sides = ", ".join(
            f"{name} {low:.6g} ... {high:.6g}"
            for name, (low, high) in zip(self.parameters, self.extent, strict=True)
        )
        state = "closed" if self.closed else f"open: {self.why_not}"
        return f"<StabilityRegion of {self.label}, {sides}, {kinds}, {state}>"


def stability_region(
    motion: PeriodicMotion,
    *,
    step: float = 0.01,
    max_step: float = 0.05,
    max_points: int = 1000,
    **parameters: tuple[float, float],
) -> StabilityRegion:
    """Walk round the region of two parameters in which a periodic motion is stable.

    Parameters
    ----------
    motion
        A stable motion.
    step, max_step
        First and largest step, as part of the ranges and of the motion's size, at most 1000.
    max_points
        Cap on the points of each curve.
    parameters
        Two numeric parameters of the system with their ranges:
        ``drive_frequency=(0.2, 3), moment_amplitude=(0.05, 2.5)``.

    Returns
    -------
    StabilityRegion
        Its border. Every point of its arcs is a bifurcation to rounding.

    Raises
    ------
    ParameterError
        For bad input, and if the motion is not admissible or not stable.
    Interrupted
        After Ctrl-C; ``.result`` is the region with its border so far.
    """
    if not isinstance(motion, PeriodicMotion) or not (motion.admissible and motion.stable):
        reject("motion", motion, "an admissible and stable PeriodicMotion")
    names, bounds = two_ranges(motion.system, parameters)
    walk = Walk(motion, names, bounds, CurveSteps.checked(step, max_step, max_points))
    try:
        why_not = walk.round()
    except KeyboardInterrupt:  # Interrupted is one
        region = _region(walk, PathEnd.INTERRUPTED)
        raise Interrupted("interrupted along a border of stability", region) from None
    return _region(walk, why_not)


def _region(walk: Walk, why_not: str) -> StabilityRegion:
    arcs = walk.arcs
    return StabilityRegion(
        motion=walk.motion,
        parameters=walk.names,
        bounds=walk.bounds,
        arcs=tuple(arc.curve for arc in arcs if arc.curve is not None),
        border=np.concatenate([np.empty((0, 2)), *(arc.values for arc in arcs)]),
        closed=not why_not,
        why_not=why_not,
    )


def _crossing(arc: BifurcationCurve, k: int, index: int, value: float) -> Bifurcation | None:
    """Return the point of an arc between two of its points, at a value of one parameter."""
    problem = arc.problem
    low, high = arc.values[k, index], arc.values[k + 1, index]
    part = (value - low) / (high - low)
    u = (1.0 - part) * arc.nodes[k].ravel() + part * arc.nodes[k + 1].ravel()
    p = (1.0 - part) * arc.values[k] + part * arc.values[k + 1]
    p[index] = value
    found = curve_point(problem, u, p, problem.test, index)
    if found is None:
        return None
    u, p, left = found
    motion = motion_of(problem.system_at(p), problem.itinerary, u.reshape(-1, 4), whole=True)
    return Bifurcation(
        kind=arc.kind,
        parameter=arc.parameters[1 - index],
        value=float(p[1 - index]),
        motion=motion,
        test=OwnTest.FOLD if arc.kind is BifurcationKind.SADDLE_NODE else problem.test,
        test_value=left,
    )
