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

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..checks import count, number, positive, reject
from ..errors import Interrupted
from .borders import (
    BifurcationCurve,
    CodimensionTwo,
    codimension_two,
    curve_of,
    curve_problem,
    follow_way,
    ranges,
)
from .branch import BORDERS, NAMES, Bifurcation
from .continuation import follow
from .curve_problem import RESONANCES, ROUNDING, CurveProblem
from .curves import curve_point
from .doubling import doubled, doubling_near, halving
from .motion import PeriodicMotion, motion_of
from .path import Path, SpecialPoint
from .problem import OrbitProblem

Array = NDArray[np.float64]
Bounds = tuple[tuple[float, float], tuple[float, float]]

# At which a stable motion ends, along a branch and along the edge of its stability.
ENDS = ("fold", "saddle_node", "period_doubling", "neimark_sacker", *BORDERS, *RESONANCES)
# Two ends of curves are one point if they agree to this part of the ranges.
SAME_CORNER = 1e-6
# ... and to this part where the equations of a doubled motion become singular.
JOINED = 1e-3
# Curves and bounds that a border may consist of.
MOST_ARCS = 60


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
        Why not, ``""`` if it did.
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
        """Least and largest value of both parameters, shape (2, 2): a row for each parameter."""
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
        points = np.asarray(values, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
            reject("values", values, "finite numbers of shape (k, 2)")
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
        First and largest step, as part of the ranges and of the motion's size.
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
        After Ctrl-C.
    """
    if not isinstance(motion, PeriodicMotion) or not (motion.admissible and motion.stable):
        reject("motion", motion, "an admissible and stable PeriodicMotion")
    names, bounds = ranges(motion.system, parameters)
    walk = _Walk(
        motion,
        names,
        bounds,
        step=positive("step", step),
        max_step=positive("max_step", max_step),
        max_points=count("max_points", max_points, least=2),
    )
    return walk.region()


class _Lost(Exception):
    """The border cannot be followed any further; carries why."""


@dataclass
class _Arc:
    """Part of the border, in the order of the walk: a curve, or a piece of a bound."""

    values: Array
    curve: BifurcationCurve | None


@dataclass
class _OnBound:
    """A motion where the parameter ``index`` is at its bound; the direction to start in, if any."""

    itinerary: _core.Itinerary
    u: Array
    p: Array
    index: int
    tangent: Array | None = None


# Where the walk stands: where the next curve starts, on a bound, or nowhere.
_Place = Bifurcation | CodimensionTwo | _OnBound | _Lost


class _Walk:
    def __init__(
        self,
        motion: PeriodicMotion,
        names: tuple[str, str],
        bounds: Bounds,
        *,
        step: float,
        max_step: float,
        max_points: int,
    ) -> None:
        self.motion, self.names, self.bounds = motion, names, bounds
        self.step, self.max_step, self.max_points = step, max_step, max_points
        self.sizes = np.array([high - low for low, high in bounds])
        # Where a doubled motion becomes one with the shorter one.
        self.merging: Bifurcation | None = None

    def region(self) -> StabilityRegion:
        """Walk round."""
        try:
            start = self._first_bifurcation()
        except _Lost as loss:
            return self._result([_Arc(np.empty((0, 2)), None)], str(loss))
        if start is None:
            (a, b), (c, d) = self.bounds
            corners = np.array([[a, c], [b, c], [b, d], [a, d]])
            return self._result([_Arc(corners, None)], "")
        problem, u = curve_problem(start, self.names)
        forth, back = (self._way(problem, u, direction) for direction in (1, -1))
        curve = curve_of(problem, [forth] if forth.end == "closed" else [back, forth])
        arcs = [_Arc(curve.values, curve)]
        if forth.end == "closed":
            return self._result(arcs, "")
        aim = curve.values[0]
        try:
            for arc in self._onward(self._place(problem, forth), aim):
                arcs.append(arc)
            return self._result(arcs, "")
        except _Lost as loss:
            why_not = str(loss)
        # What can be reached the other way round, which may be the rest.
        before: list[_Arc] = []
        try:
            for arc in self._onward(self._place(problem, back), arcs[-1].values[-1]):
                before.append(arc)
            why_not = ""
        except _Lost as loss:
            why_not = f"{why_not}; {loss}"
        turned = [_Arc(arc.values[::-1], arc.curve) for arc in reversed(before)]
        return self._result([*turned, *arcs], why_not)

    def _result(self, arcs: list[_Arc], why_not: str) -> StabilityRegion:
        return StabilityRegion(
            motion=self.motion,
            parameters=self.names,
            bounds=self.bounds,
            arcs=tuple(arc.curve for arc in arcs if arc.curve is not None),
            border=np.concatenate([arc.values for arc in arcs]),
            closed=not why_not,
            why_not=why_not,
        )

    def _onward(self, place: _Place, aim: Array) -> Iterator[_Arc]:
        """Give the arcs from a place up to the point aimed at."""
        for _ in range(MOST_ARCS):
            if isinstance(place, _Lost):
                raise place
            arc, place = self._next(place)
            yield arc
            near = JOINED if isinstance(place, _Lost) else SAME_CORNER
            if (np.abs(arc.values[-1] - aim) < near * self.sizes).all():
                return
        raise _Lost(f"not closed after {MOST_ARCS} curves")

    def _next(self, place: Bifurcation | CodimensionTwo | _OnBound) -> tuple[_Arc, _Place]:
        if isinstance(place, _OnBound):
            return self._along_bound(place)
        problem, u = curve_problem(place, self.names)
        for direction in (1, -1):
            probe = self._way(problem, u, direction, most=3)
            if len(probe.points) < 2 or probe.end == "start":
                continue
            if problem.bounds_stability(probe.points[1].u, probe.points[1].p):
                path = self._way(problem, u, direction)
                curve = curve_of(problem, [path])
                return _Arc(curve.values, curve), self._place(problem, path)
        raise _Lost(f"no border of stability goes on from the {place.kind} at {_at(problem)}")

    def _way(self, problem: CurveProblem, u: Array, direction: int, most: int = 0) -> Path:
        try:
            return follow_way(
                problem,
                u,
                self.bounds,
                direction,
                step=self.step,
                max_step=self.max_step,
                max_points=most or self.max_points,
                stop_at=ENDS,
            )
        except Interrupted:
            raise Interrupted("interrupted along a border of stability", None) from None

    def _place(self, problem: CurveProblem, path: Path) -> _Place:
        """Return where a curve has led."""
        last = path.points[-1]
        short = problem.itinerary.periods < self.motion.m
        if path.end == "bound":
            at = _OnBound(problem.itinerary, last.u, last.p, self._bound_of(last.p))
            return self._doubled(problem, at) if short else at
        if path.end.startswith("stopped"):
            if short:
                kind = path.special[-1].kind
                return _Lost(f"the halved motion has a {kind} at {_numbers(last.p)}")
            return _meeting(problem, path.special[-1])
        return _Lost(f"{problem.kind} at {_numbers(last.p)}: {path.end} {path.detail}".strip())

    def _doubled(self, problem: CurveProblem, at: _OnBound) -> _OnBound:
        """Return the start of the doubled motion at a period doubling on a bound."""
        motion = motion_of(
            problem.system_at(at.p), at.itinerary, at.u.reshape(-1, 4).copy(), whole=True
        )
        itinerary, nodes, shift = doubled(motion)
        return _OnBound(itinerary, nodes.ravel(), at.p, at.index, np.append(shift.ravel(), 0.0))

    def _bound_of(self, p: Array) -> int:
        """Return the parameter that is at its bound."""
        off = [min(abs(p[i] - bound) for bound in self.bounds[i]) for i in (0, 1)]
        return int(np.argmin(off / self.sizes))

    def _first_bifurcation(self) -> Bifurcation | None:
        """Return the first bifurcation that is met along one of the parameters, if any is."""
        system, nodes = self.motion.system, self.motion.nodes.ravel()
        p = np.array([getattr(system, name) for name in self.names])
        lost: _Lost | None = None
        proper: Bifurcation | None = None
        for index in (0, 1):
            problem = OrbitProblem(system, self.motion.itinerary, (self.names[index],))
            for direction in (1, -1):
                try:
                    found = self._end_of(
                        problem, self._branch(problem, nodes, p, index, direction), index
                    )
                except _Lost as loss:
                    lost = loss
                    continue
                if found is not None and found.motion.m == self.motion.m:
                    proper = proper or found
                    continue
                self.merging = self.merging or found
        if proper is None and self.merging is None and lost is not None:
            raise lost
        return proper or self.merging

    def _end_of(self, problem: OrbitProblem, path: Path, index: int) -> Bifurcation | None:
        """Return the bifurcation at the end of a branch, None on a bound."""
        # A doubled motion ends where its halves become one.
        k = halving(problem, path)
        if k is not None:
            u, p = path.points[k].u, path.points[k].p
            found = doubling_near(problem, u, p, self.bounds[index], self.max_step)
            if found is not None:
                return found
        if path.end == "bound":
            return None
        if path.end.startswith("stopped"):
            return _bifurcation(problem, path.special[-1])
        at = f"{problem.parameters[0]} = {path.p[-1, 0]:.6g}" if path.points else "the start"
        raise _Lost(f"the motion at {at}: {path.end}")

    def _branch(
        self,
        problem: OrbitProblem,
        u: Array,
        p: Array,
        index: int,
        direction: int,
        *,
        tangent: Array | None = None,
        most: int = 0,
    ) -> Path:
        """Follow the motion over one of the parameters while it is stable."""
        try:
            return follow(
                problem,
                u,
                [p[index]],
                bounds=self.bounds[index],
                direction=direction,
                tangent=tangent,
                parameter_size=float(self.sizes[index]),
                step=self.step,
                min_step=min(1e-9, self.step),
                max_step=max(self.step, self.max_step),
                max_points=most or self.max_points,
                stop_at=ENDS,
                classify=problem.classify,
            )
        except Interrupted:
            raise Interrupted("interrupted along a border of stability", None) from None

    def _along_bound(self, place: _OnBound) -> tuple[_Arc, _Place]:
        """Follow the motion along a bound, to where it loses its stability or to the corner."""
        free = 1 - place.index
        fixed = {self.names[place.index]: float(place.p[place.index])}
        problem = OrbitProblem(
            self.motion.system.replace(**fixed), place.itinerary, (self.names[free],)
        )
        for direction in (1, -1):
            start = (problem, place.u, place.p, free, direction)
            probe = self._branch(*start, tangent=place.tangent, most=3)
            first = probe.points[1] if len(probe.points) > 1 else None
            if first is None or not _is_stable(problem, first.u, first.p):
                continue
            path = self._branch(*start, tangent=place.tangent)
            values = np.empty((len(path.points), 2))
            values[:, place.index], values[:, free] = place.p[place.index], path.p[:, 0]
            found = self._end_of(problem, path, free)
            if found is not None:
                values[-1, free] = found.value
                return _Arc(values, None), found
            return _Arc(values, None), _OnBound(
                place.itinerary, path.points[-1].u, values[-1], free
            )
        raise _Lost(f"no stable motion along the bound at {_numbers(place.p)}")


def _is_stable(problem: OrbitProblem, u: Array, p: Array) -> bool:
    matrix = problem.monodromy(u, p)
    inside = np.isfinite(matrix).all() and np.abs(np.linalg.eigvals(matrix)).max() < 1.0
    return bool(inside) and all(value > -ROUNDING for value in problem.border_tests(u, p).values())


def _bifurcation(problem: OrbitProblem, special: SpecialPoint) -> Bifurcation:
    nodes = special.u.reshape(-1, 4)
    return Bifurcation(
        kind=NAMES.get(special.kind, special.kind),
        parameter=problem.parameters[0],
        value=float(special.p[0]),
        motion=motion_of(problem.system_at(special.p), problem.itinerary, nodes, whole=True),
        test=special.test,
        test_value=special.value,
    )


def _meeting(problem: CurveProblem, special: SpecialPoint) -> CodimensionTwo:
    """Return a point of codimension two as the start of the other curve through it."""
    found = codimension_two(problem, special)
    if found.kind not in RESONANCES:
        return found
    other = {"resonance_1_1": "saddle_node", "resonance_1_2": "period_doubling"}[found.kind]
    kind = other if problem.kind == "neimark_sacker" else "neimark_sacker"
    return CodimensionTwo(
        kind=kind,
        values=found.values,
        motion=found.motion,
        test=kind,
        test_value=found.test_value,
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
        test="fold" if arc.kind == "saddle_node" else problem.test,
        test_value=left,
    )


def _at(problem: OrbitProblem) -> str:
    return _numbers(np.array([getattr(problem.system, name) for name in problem.parameters]))


def _numbers(p: Array) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in p) + ")"
