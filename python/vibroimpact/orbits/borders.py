"""Curves of bifurcations of periodic motions in two parameters.

A located bifurcation is followed as a zero of the conditions of periodicity together with its own
test function (`curves`), with its sequence of legs held fixed. The curve ends where another
condition of the motion reaches zero: a point of codimension two, from which other curves start.

A grazing is followed on the side without the touching impact: there the derivative of the return
map is finite, so that its multipliers tell where the motion is stable up to the grazing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Unpack, overload

import numpy as np
from numpy.typing import NDArray

from .._core import Border, BorderKind, Condition
from ..arguments import count, positive, reject
from ..continuation.curves import follow_curve
from ..continuation.names import TURNING_POINTS, OwnTest, PathEnd
from ..continuation.path import Path, Point, SpecialPoint, path_so_far
from ..errors import Interrupted
from ..interruption import interruptible
from ..keyword_types import Ranges, completing
from ..made import Maker, made_from, value_of
from ..scales import Units
from .bifurcation import Bifurcation
from .call_types import CurveCall
from .curve import BifurcationCurve, CodimensionTwo
from .curve_problem import RESONANCES, ROUNDING, CurveProblem
from .friction import need_friction, with_friction
from .kinds import BORDERS, FIRST, BifurcationKind
from .problem import OrbitProblem
from .ranges import LONGEST_STEP, Bounds, begin, is_of_structure, refuse, two_ranges
from .resegment import beside, spared
from .special_points import end_of
from .verdict import motion_of, primitive

Array = NDArray[np.float64]

# Kinds that can be followed.
KINDS = (
    BifurcationKind.SADDLE_NODE,
    BifurcationKind.PERIOD_DOUBLING,
    BifurcationKind.NEIMARK_SACKER,
    *(BifurcationKind(border.value) for border in BorderKind),
)


@dataclass(frozen=True, kw_only=True)
class CurveSteps:
    """Steps along a curve, as part of the ranges and of the motion's size, and how many points."""

    step: float
    min_step: float
    max_step: float
    max_points: int

    @classmethod
    def checked(cls, step: float, max_step: float, max_points: int) -> "CurveSteps":
        """Check the arguments."""
        first, largest = positive("step", step), positive("max_step", max_step)
        for name, value in (("step", first), ("max_step", largest)):
            if value > LONGEST_STEP:
                reject(name, value, f"a number > 0, at most {LONGEST_STEP:g}")
        return cls(
            step=first,
            min_step=min(1e-9, first),
            max_step=max(first, largest),
            max_points=count("max_points", max_points, least=2),
        )


@overload
def bifurcation_curve(
    bifurcation: Bifurcation | CodimensionTwo, *, system: None = ..., **keywords: Unpack[CurveCall]
) -> BifurcationCurve: ...


@overload
def bifurcation_curve(
    bifurcation: Bifurcation | CodimensionTwo, *, units: Units, **keywords: Any
) -> BifurcationCurve: ...


@overload
def bifurcation_curve(
    bifurcation: Bifurcation | CodimensionTwo, *, system: Maker, **keywords: Any
) -> BifurcationCurve: ...


@interruptible
@completing(Ranges)
def bifurcation_curve(
    bifurcation: Bifurcation | CodimensionTwo,
    *,
    system: Maker | None = None,
    units: Units | None = None,
    step: float = 0.01,
    max_step: float = 0.05,
    max_points: int = 1000,
    **parameters: tuple[float, ...],
) -> BifurcationCurve:
    """Follow a bifurcation in two parameters, both ways.

    Parameters
    ----------
    bifurcation
        A located bifurcation of a branch: ``saddle_node``, ``period_doubling``,
        ``neimark_sacker``, ``grazing``, ``regime_border``, ``contact_border``, ``chatter_onset``;
        or a point of codimension two of one of these kinds, for the other curve through it.
    system
        A function that makes the system from the two numbers that vary, as in ``follow_motion``.
    units
        ``"SI"``: ranges are in SI, as in ``follow_motion``.
    step
        First step, as part of the ranges and of the motion's size, at most 1000.
    max_step
        Largest step, in the same measure.
    max_points
        Cap on the points of each direction.
    **parameters
        Two numeric parameters of the system with their ranges:
        ``drive_frequency=(0.2, 3), moment_amplitude=(0.05, 2.5)``. With ``system`` two arguments of
        the function, each (low, value at the bifurcation, high).

    Returns
    -------
    BifurcationCurve
        The curve. Every point is a zero of the test function to rounding.

    Raises
    ------
    ParameterError
        For bad input.
    Interrupted
        After Ctrl-C; ``.result`` is the curve so far.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> found = motion.follow(drive_frequency=(1.5, 1.9)).bifurcations[0]
    >>> curve = vi.bifurcation_curve(found, drive_frequency=(1.4, 1.7), restitution=(0.75, 0.85))
    >>> str(curve.kind), curve.parameters
    ('period_doubling', ('drive_frequency', 'restitution'))
    """
    known = isinstance(bifurcation, Bifurcation | CodimensionTwo)
    if not known or is_of_structure(bifurcation):
        allowed = "a Bifurcation, such as motion.follow(...).bifurcations[0], or a CodimensionTwo"
        refuse("bifurcation", bifurcation, allowed)
    if bifurcation.kind not in KINDS:
        reject("bifurcation", bifurcation.kind, f"one of the kinds {', '.join(KINDS)}")
    bifurcation, ranges = begin(bifurcation, system, parameters, units)
    names, bounds = two_ranges(bifurcation.motion.system, ranges)
    steps = CurveSteps.checked(step, max_step, max_points)
    problem, u = curve_problem(bifurcation, names)
    paths: list[Path] = []
    for direction in (-1, 1):
        path = follow_way(problem, u, bounds, direction, steps)
        paths.append(path)
        if path.end in (PathEnd.CLOSED, PathEnd.INTERRUPTED):
            break
    try:
        curve = curve_of(problem, paths)
    except KeyboardInterrupt:
        raise Interrupted("interrupted at the end of a curve", curve_of(problem, paths)) from None
    if path.end is PathEnd.INTERRUPTED:
        raise Interrupted("interrupted along a curve", curve)
    return curve


def curve_problem(
    bifurcation: Bifurcation | CodimensionTwo, names: tuple[str, ...]
) -> tuple[CurveProblem, Array]:
    """Return the equations of a curve, and the nodes at which it starts."""
    motion, test = bifurcation.motion, bifurcation.test
    system, itinerary, nodes = motion.system, motion.itinerary, motion.nodes
    if bifurcation.kind is BifurcationKind.SADDLE_NODE:
        test = OwnTest.FOLD
    elif isinstance(test, Condition) and test.border is Border.APPROACH_VELOCITY:
        problem = OrbitProblem(system, itinerary, names)
        p = np.array([value_of(system, name) for name in names])
        without = spared(problem, nodes.ravel(), p, test.leg)
        if without is not None:
            itinerary, nodes, flight = without
            shorter, cut = primitive(system.drive_period, itinerary, nodes)
            if len(cut) < len(nodes):
                flight = Condition(flight.border, flight.leg % len(cut))
                itinerary, nodes = shorter, cut
            test = flight
    need_friction(system, names)
    if "friction" in names and made_from(system, names) is None:
        itinerary, nodes, friction = with_friction(system, itinerary, nodes)
        if friction != system.friction:
            reject("friction", system.friction, "> 0 for a motion with sustained contact")
    return CurveProblem(system, itinerary, names, bifurcation.kind, test), nodes.ravel().copy()


def follow_way(
    problem: CurveProblem,
    u: Array,
    bounds: Bounds,
    direction: int,
    steps: CurveSteps,
    stop_at: Sequence[str] = (),
) -> Path:
    """Follow a curve in one direction, until it is no bifurcation of a motion any more.

    After Ctrl-C the path ends with ``interrupted``.
    """
    resonances = RESONANCES if problem.kind is BifurcationKind.NEIMARK_SACKER else ()
    try:
        path = follow_curve(
            problem,
            u,
            [value_of(problem.system, name) for name in problem.parameters],
            problem.test,
            bounds=bounds,
            direction=direction,
            parameter_sizes=(bounds[0][1] - bounds[0][0], bounds[1][1] - bounds[1][0]),
            step=steps.step,
            min_step=steps.min_step,
            max_step=steps.max_step,
            max_points=steps.max_points,
            stop_at=(*BORDERS, *resonances, *stop_at),
            first=FIRST,
            # On a curve of saddle-nodes det(I - M) is zero throughout.
            ignore=[BifurcationKind.SADDLE_NODE] if problem.test is OwnTest.FOLD else [],
            classify=problem.classify,
        )
    except KeyboardInterrupt as interruption:
        path = path_so_far(interruption)
    if len(path.points) > 1 and _beyond_a_border(problem, path.points[1]):
        end = PathEnd.INTERRUPTED if path.end is PathEnd.INTERRUPTED else PathEnd.START
        return Path(points=path.points[:1], special=(), end=end)
    return path


def _beyond_a_border(problem: CurveProblem, point: Point) -> bool:
    """Whether a motion has ceased to be one, or a Neimark-Sacker pair is real."""
    return any(
        value < -ROUNDING
        for test, value in point.tests.items()
        if test != problem.test and (isinstance(test, Condition) or test in RESONANCES)
    )


def curve_of(problem: CurveProblem, paths: list[Path]) -> BifurcationCurve:
    """Return the curve of one path, or of two from the same start, the first against its way."""
    back, forth = paths[0], paths[-1]
    both = len(paths) == 2
    # The start is the first point of both.
    onward = forth.points[1:] if back.points else forth.points
    points = [*reversed(back.points), *onward] if both else list(back.points)
    special = [*reversed(back.special), *forth.special] if both else list(back.special)
    first, second = problem.parameters
    shape = (len(points), -1, 4)
    return BifurcationCurve(
        kind=problem.kind,
        parameters=(first, second),
        values=np.array([point.p for point in points]).reshape(-1, 2),
        nodes=np.array([point.u for point in points]).reshape(shape if points else (0, 0, 4)),
        itinerary=problem.itinerary,
        multipliers=np.array([problem.multipliers(point.u, point.p) for point in points]),
        bounds_stability=np.array(
            [problem.bounds_stability(point.u, point.p) for point in points], dtype=np.bool_
        ),
        points=tuple(
            codimension_two(problem, point)
            for point in special
            if point.test not in TURNING_POINTS
            and point.kind != BifurcationKind.NEUTRAL_SADDLE
            and point.continuous
        ),
        ends=(end_of(back), end_of(forth)),
        system=problem.system,
        test=problem.test,
    )


def codimension_two(problem: CurveProblem, point: SpecialPoint) -> CodimensionTwo:
    """Return a special point of a curve as users see it."""
    nodes = point.u.reshape(-1, 4)
    return CodimensionTwo(
        kind=BifurcationKind(point.kind),
        values=point.p,
        motion=motion_of(problem.system_at(point.p), problem.itinerary, nodes, whole=True),
        test=point.test,
        test_value=point.value,
        goes_on=_beyond(problem, point),
    )


def _beyond(problem: CurveProblem, point: SpecialPoint) -> CodimensionTwo | None:
    """Return where the curve goes on beyond another border."""
    if not (isinstance(problem.test, Condition) and isinstance(point.test, Condition)):
        return None
    found = beside(problem, point, problem.test)
    if found is None:
        return None
    itinerary, nodes, test = found
    return CodimensionTwo(
        kind=problem.kind,
        values=point.p,
        motion=motion_of(problem.system_at(point.p), itinerary, nodes, whole=True),
        test=test,
        test_value=point.tests.get(problem.test, 0.0),
    )
