"""Curves of bifurcations of periodic motions in two parameters.

A located bifurcation is followed as a zero of the conditions of periodicity together with its own
test function (`curves`), with its sequence of legs held fixed. The curve ends where another
condition of the motion reaches zero: a point of codimension two, from which other curves start.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..checks import count, number, positive, reject
from ..errors import Interrupted, ParameterError
from ..system import NUMERIC_RANGES, System
from .branches import BORDERS, NAMES, Bifurcation
from .curves import follow_curve
from .motion import PeriodicMotion, motion_of
from .path import Path
from .problem import OrbitProblem

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class CodimensionTwo:
    """A point of a curve of bifurcations at which another test function vanishes.

    Attributes
    ----------
    kind
        Of the second bifurcation, as in Bifurcation; also ``cusp`` on a curve of saddle-nodes.
    values
        Of both parameters, shape (2,).
    motion
        The motion there.
    test, test_value
        The second function, and what is left of it.
    """

    kind: str
    values: Array
    motion: PeriodicMotion
    test: str
    test_value: float


@dataclass(frozen=True, kw_only=True, eq=False)
class BifurcationCurve:
    """A curve of bifurcations of one kind in the plane of two parameters.

    Attributes
    ----------
    kind
        Of the bifurcation.
    parameters
        Names of both parameters.
    values
        Shape (k, 2), in order along the curve.
    nodes
        Of the motion, shape (k, legs, 4).
    legs
        Its legs.
    points
        Points of codimension two, in order along the curve.
    ends
        Why the curve ends, at its first and last point: ``bound``, the kind of a border,
        ``points``, ``closed``, ``no convergence``, ``outside domain`` or ``interrupted``.
    system
        The system, at any values of the parameters.
    test
        The function that vanishes along the curve.
    """

    kind: str
    parameters: tuple[str, str]
    values: Array
    nodes: Array
    legs: tuple[str, ...]
    points: tuple[CodimensionTwo, ...]
    ends: tuple[str, str]
    system: System
    test: str

    def __repr__(self) -> str:
        """Kind, extent and ends."""
        (a, b), (low, high) = self.parameters, (self.values.min(axis=0), self.values.max(axis=0))
        return (
            f"<BifurcationCurve {self.kind}, {a} {low[0]:.6g} ... {high[0]:.6g}, "
            f"{b} {low[1]:.6g} ... {high[1]:.6g}, ends: {self.ends[0]}, {self.ends[1]}>"
        )


def bifurcation_curve(
    bifurcation: Bifurcation,
    *,
    step: float = 0.01,
    max_step: float = 0.05,
    max_points: int = 1000,
    **parameters: tuple[float, float],
) -> BifurcationCurve:
    """Follow a bifurcation in two parameters, both ways.

    Parameters
    ----------
    bifurcation
        A located bifurcation of a branch: ``saddle_node``, ``period_doubling``,
        ``neimark_sacker``, ``grazing``, ``regime_border``, ``contact_border``, ``chatter_onset``.
    step, max_step
        First and largest step, as part of the ranges and of the motion's size.
    max_points
        Cap on the points of each direction.
    parameters
        Two numeric parameters of the system with their ranges:
        ``drive_frequency=(0.2, 3), moment_amplitude=(0.05, 2.5)``.

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
    """
    system = bifurcation.motion.system
    names, bounds = _ranges(system, parameters)
    motion = bifurcation.motion
    problem = OrbitProblem(system, motion.itinerary, names)
    test = "fold" if bifurcation.kind == "saddle_node" else bifurcation.test
    ignored = {"fold"} if test == "fold" else set[str]()
    sizes = (bounds[0][1] - bounds[0][0], bounds[1][1] - bounds[1][0])
    paths: list[Path] = []
    for direction in (-1, 1):
        try:
            path = follow_curve(
                problem,
                motion.nodes.ravel(),
                [getattr(system, name) for name in names],
                test,
                bounds=bounds,
                direction=direction,
                parameter_sizes=sizes,
                step=positive("step", step),
                min_step=1e-9,
                max_step=positive("max_step", max_step),
                max_points=count("max_points", max_points, least=2),
                stop_at=BORDERS,
                ignore=ignored,
                classify=problem.classify,
            )
        except Interrupted as interruption:
            path = interruption.result
        paths.append(path)
        if path.end == "interrupted":
            curve = _curve(bifurcation, problem, test, paths)
            raise Interrupted("interrupted along a curve", curve)
        if path.end == "closed":
            break
    return _curve(bifurcation, problem, test, paths)


def _curve(
    bifurcation: Bifurcation, problem: OrbitProblem, test: str, paths: list[Path]
) -> BifurcationCurve:
    back, forth = paths[0], paths[-1]
    both = len(paths) == 2
    points = [*reversed(back.points), *forth.points[1:]] if both else list(back.points)
    special = [*reversed(back.special), *forth.special] if both else list(back.special)
    found = []
    for point in special:
        if point.kind in ("turning_point", "neutral_saddle") or not point.continuous:
            continue
        system = problem.system_at(point.p)
        nodes = point.u.reshape(-1, 4)
        found.append(
            CodimensionTwo(
                kind=NAMES.get(point.kind, point.kind),
                values=point.p,
                motion=motion_of(system, problem.itinerary, nodes, whole=True),
                test=point.test,
                test_value=point.value,
            )
        )
    first, second = problem.parameters
    return BifurcationCurve(
        kind=bifurcation.kind,
        parameters=(first, second),
        values=np.array([point.p for point in points]),
        nodes=np.array([point.u.reshape(-1, 4) for point in points]),
        legs=tuple(problem.itinerary.legs),
        points=tuple(found),
        ends=(_end(back), _end(forth)),
        system=problem.system,
        test=test,
    )


def _end(path: Path) -> str:
    return path.end.removeprefix("stopped: ").split(":")[0]


def _ranges(
    system: System, parameters: dict[str, tuple[float, float]]
) -> tuple[tuple[str, str], tuple[tuple[float, float], tuple[float, float]]]:
    """Check the two parameters and their ranges."""
    if len(parameters) != 2:
        given = ", ".join(parameters) or "none"
        raise ParameterError(f"give exactly two parameters with their ranges, got {given}")
    bounds = []
    for name, limits in parameters.items():
        if name not in NUMERIC_RANGES:
            reject("parameter", name, f"one of {', '.join(NUMERIC_RANGES)}")
        if np.shape(limits) != (2,):
            reject(name, limits, "a range (low, high)")
        low, high = (number(name, limit) for limit in limits)
        value = getattr(system, name)
        if not low <= value <= high or low == high:
            reject(name, (low, high), f"a range (low, high) around {value}")
        bounds.append((low, high))
    first, second = parameters
    return (first, second), (bounds[0], bounds[1])
