"""The region of two parameters in which a periodic motion exists and is stable, by its border.

From a stable motion one parameter is varied up to the first bifurcation. Its curve is followed both
ways to points of codimension two, at which the motion would lose more than the curve takes; there
the border turns into the other curve through that point, on the side where the first condition
holds. Where a curve meets a bound of the parameters the border runs along the bound. This is
repeated until the border closes (islands page).

The border is the component of the edge of stability that is reached in this way; a hole inside the
region has a border of its own. Beyond a grazing or a regime border the motion may go on as a stable
one with other legs: that is another region.
"""

from __future__ import annotations

from typing import Any, Unpack, overload

import numpy as np
from numpy.typing import NDArray

from ..continuation.curves import curve_point
from ..continuation.names import OwnTest, PathEnd
from ..errors import Interrupted
from ..interruption import interruptible
from ..keyword_types import Ranges, completing
from ..made import Maker
from ..scales import Units
from .bifurcation import Bifurcation
from .border_walk import Walk
from .borders import CurveSteps
from .call_types import CurveCall
from .curve import BifurcationCurve
from .kinds import BifurcationKind
from .motion import PeriodicMotion
from .ranges import begin, refuse, two_ranges
from .region import StabilityRegion
from .verdict import motion_of

Array = NDArray[np.float64]


@overload
def stability_region(
    motion: PeriodicMotion, *, system: None = ..., **keywords: Unpack[CurveCall]
) -> StabilityRegion: ...


@overload
def stability_region(
    motion: PeriodicMotion, *, units: Units, **keywords: Any
) -> StabilityRegion: ...


@overload
def stability_region(
    motion: PeriodicMotion, *, system: Maker, **keywords: Any
) -> StabilityRegion: ...


@interruptible
@completing(Ranges)
def stability_region(
    motion: PeriodicMotion,
    *,
    system: Maker | None = None,
    units: Units | None = None,
    step: float = 0.01,
    max_step: float = 0.05,
    max_points: int = 1000,
    **parameters: tuple[float, ...],
) -> StabilityRegion:
    """Find the border of the region of two parameters in which a periodic motion is stable.

    Parameters
    ----------
    motion
        A stable motion.
    system
        A function that makes the system from the two numbers that vary, as in ``follow_motion``.
    units
        ``"SI"``: ranges are in SI, as in ``follow_motion``.
    step
        First step, as part of the ranges and of the motion's size, at most 1000.
    max_step
        Largest step, in the same measure.
    max_points
        Cap on the points of each curve.
    **parameters
        Two numeric parameters of the system with their ranges:
        ``drive_frequency=(0.2, 3), moment_amplitude=(0.05, 2.5)``. With ``system`` two arguments of
        the function, each (low, value of the motion, high).

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

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> region = vi.stability_region(motion, drive_frequency=(1.6, 1.9), restitution=(0.75, 0.85))
    >>> region.label
    '1-1'
    """
    if not isinstance(motion, PeriodicMotion) or not (motion.admissible and motion.stable):
        refuse("motion", motion, "an admissible and stable PeriodicMotion")
    motion, ranges = begin(motion, system, parameters, units)
    names, bounds = two_ranges(motion.system, ranges)
    walk = Walk(motion, names, bounds, CurveSteps.checked(step, max_step, max_points))
    try:
        why_not = walk.round()
    except KeyboardInterrupt:  # Interrupted is a KeyboardInterrupt
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


def crossing(arc: BifurcationCurve, k: int, index: int, value: float) -> Bifurcation | None:
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
