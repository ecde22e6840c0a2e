"""The border of a region of stability, from curve to curve and along the bounds (`regions`)."""

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..continuation.follow import follow
from ..continuation.names import OwnTest, PathEnd
from ..continuation.path import Path, SpecialPoint, path_so_far
from ..made import value_of, varied
from .bifurcation import Bifurcation
from .borders import CurveSteps, codimension_two, curve_of, curve_problem, follow_way
from .curve import BifurcationCurve, CodimensionTwo
from .curve_problem import RESONANCES, ROUNDING, CurveProblem
from .doubling import doubled, doubling_near, halving
from .kinds import BORDERS, FIRST, BifurcationKind
from .motion import PeriodicMotion
from .problem import OrbitProblem
from .ranges import Bounds
from .special_points import bifurcation_at
from .verdict import motion_of

Array = NDArray[np.float64]

# Bifurcations at which a stable motion ends, along a branch and along a border of stability.
ENDS = (
    OwnTest.FOLD,
    BifurcationKind.SADDLE_NODE,
    BifurcationKind.PERIOD_DOUBLING,
    BifurcationKind.NEIMARK_SACKER,
    *BORDERS,
    *RESONANCES,
)
# The kind of the other curve through a strong resonance on a curve of Neimark-Sacker points.
_OTHER = {
    BifurcationKind.RESONANCE_1_1: BifurcationKind.SADDLE_NODE,
    BifurcationKind.RESONANCE_1_2: BifurcationKind.PERIOD_DOUBLING,
}
# Two ends of curves are the same point if they agree to this part of the ranges.
_SAME_CORNER = 1e-6
# This tolerance where the equations of a doubled motion become singular.
_JOINED = 1e-3
# A point of a curve is on another of the same equations if it is this near to a chord between two
# points of that, as part of the chord. The curve itself leaves a chord by a few hundredths.
_SAME_CURVE = 0.1
# Curves and bounds that a border may consist of.
_MOST_ARCS = 60


class Lost(Exception):
    """The border cannot be followed any further; carries why."""


@dataclass
class Arc:
    """Part of the border, in order: a curve, or a piece of a bound.

    ``z`` are its points with their motions, in rows, and ``equations`` what they solve.
    """

    values: Array
    curve: BifurcationCurve | None
    equations: Hashable
    z: Array


@dataclass
class OnBound:
    """A motion where the parameter ``index`` is at its bound; the direction to start in, if any."""

    itinerary: _core.Itinerary
    u: Array
    p: Array
    index: int
    tangent: Array | None = None


# Position on the border: start of the next curve, on a bound, none, or the place of Ctrl-C.
Place = Bifurcation | CodimensionTwo | OnBound | Lost | KeyboardInterrupt


class Walk:
    """Follows the border of the region of stability of a motion; ``arcs`` are the parts so far."""

    def __init__(
        self,
        motion: PeriodicMotion,
        names: tuple[str, str],
        bounds: Bounds,
        steps: CurveSteps,
    ) -> None:
        self.motion, self.names, self.bounds, self.steps = motion, names, bounds, steps
        self.sizes = np.array([high - low for low, high in bounds])
        # Parts of the border in order, forwards and backwards from the start.
        self._after: list[Arc] = []
        self._before: list[Arc] = []
        # Where a doubled motion becomes one with the shorter one.
        self.merging: Bifurcation | None = None

    @property
    def arcs(self) -> list[Arc]:
        """The border in order: the parts found backwards from the start, then those forwards."""
        turned = [replace(arc, values=arc.values[::-1]) for arc in reversed(self._before)]
        return [*turned, *self._after]

    def round(self) -> str:
        """Follow the border; return why it does not close, ``""`` if it does.

        After Ctrl-C a KeyboardInterrupt is raised, and ``arcs`` has the parts found by then.
        """
        try:
            start = self._first_bifurcation()
        except Lost as loss:
            return str(loss)
        if start is None:
            (a, b), (c, d) = self.bounds
            corners = np.array([[a, c], [b, c], [b, d], [a, d]])
            self._after.append(Arc(corners, None, None, np.empty((0, 0))))
            return ""
        problem, u = curve_problem(start, self.names)
        ways = [self._way(problem, u, 1)]
        if ways[0].end not in (PathEnd.CLOSED, PathEnd.INTERRUPTED):
            ways.insert(0, self._way(problem, u, -1))
        curve = curve_of(problem, ways)
        self._after.append(_arc_of(problem, curve))
        back, forth = ways[0], ways[-1]
        if PathEnd.INTERRUPTED in (back.end, forth.end):
            raise KeyboardInterrupt
        if forth.end is PathEnd.CLOSED:
            return ""
        aim = curve.values[0]
        try:
            for arc in self._onward(self._place(problem, forth), aim):
                self._after.append(arc)
            return ""
        except Lost as loss:
            why_not = str(loss)
        # The other direction may reach the rest of the border.
        try:
            for arc in self._onward(self._place(problem, back), self._after[-1].values[-1]):
                self._before.append(arc)
            return ""
        except Lost as loss:
            return f"{why_not}; {loss}"

    def _onward(self, place: Place, aim: Array) -> Iterator[Arc]:
        """Yield the arcs from a place to the target point."""
        for _ in range(_MOST_ARCS):
            if isinstance(place, Lost | KeyboardInterrupt):
                raise place
            arc, place = self._next(place)
            yield arc
            if isinstance(place, KeyboardInterrupt):
                continue
            near = _JOINED if isinstance(place, Lost) else _SAME_CORNER
            if (np.abs(arc.values[-1] - aim) < near * self.sizes).all():
                return
        raise Lost(f"not closed after {_MOST_ARCS} curves")

    def _next(self, place: Bifurcation | CodimensionTwo | OnBound) -> tuple[Arc, Place]:
        if isinstance(place, OnBound):
            return self._along_bound(place)
        problem, u = curve_problem(place, self.names)
        retraced = False
        for direction in (1, -1):
            probe = self._way(problem, u, direction, most=3)
            if len(probe.points) < 2 or probe.end is PathEnd.START:
                continue
            if problem.bounds_stability(probe.points[1].u, probe.points[1].p):
                if self._passed(problem, _equations_of(problem), probe.points[1].z):
                    retraced = True
                    continue
                path = self._way(problem, u, direction)
                return _arc_of(problem, curve_of(problem, [path])), self._place(problem, path)
        if retraced:
            raise Lost(f"the border comes back along its own {place.kind} curve at {_at(problem)}")
        raise Lost(f"no border of stability goes on from the {place.kind} at {_at(problem)}")

    def _passed(self, problem: OrbitProblem, equations: Hashable, at: Array) -> bool:
        """Whether the border has been at a point before, with the same motion.

        Others may lie at the same parameters: a region round a cusp lies over itself.
        """
        sizes = np.concatenate((problem.scale(at[:-2]), self.sizes))
        for arc in (*self._before, *self._after):
            if arc.equations != equations:
                continue
            chords = np.diff(arc.z, axis=0) / sizes
            ahead = (at - arc.z[:-1]) / sizes
            squares = np.maximum((chords**2).sum(axis=1), np.finfo(float).tiny)
            along = (ahead * chords).sum(axis=1) / squares
            off = np.linalg.norm(ahead - along[:, None] * chords, axis=1)
            if ((along >= 0.0) & (along <= 1.0) & (off <= _SAME_CURVE * np.sqrt(squares))).any():
                return True
        return False

    def _way(self, problem: CurveProblem, u: Array, direction: int, most: int = 0) -> Path:
        steps = replace(self.steps, max_points=most) if most else self.steps
        path = follow_way(problem, u, self.bounds, direction, steps, ENDS)
        if path.end is PathEnd.INTERRUPTED and most:
            raise KeyboardInterrupt
        return path

    def _place(self, problem: CurveProblem, path: Path) -> Place:
        """Return the place at the end of a curve."""
        if path.end is PathEnd.INTERRUPTED:
            return KeyboardInterrupt()
        last = path.points[-1]
        short = problem.itinerary.periods < self.motion.m
        if path.end is PathEnd.BOUND:
            at = OnBound(problem.itinerary, last.u, last.p, self._bound_of(last.p))
            return self._doubled(problem, at) if short else at
        if path.stop is not None:
            if short:
                return Lost(f"the halved motion has a {path.stop.kind} at {_numbers(last.p)}")
            return _meeting(problem, path.stop)
        return Lost(f"{problem.kind} at {_numbers(last.p)}: {path.end} {path.detail}".strip())

    def _doubled(self, problem: CurveProblem, at: OnBound) -> OnBound:
        """Return the start of the doubled motion at a period doubling on a bound."""
        motion = motion_of(
            problem.system_at(at.p), at.itinerary, at.u.reshape(-1, 4).copy(), whole=True
        )
        itinerary, nodes, shift = doubled(motion)
        return OnBound(itinerary, nodes.ravel(), at.p, at.index, np.append(shift.ravel(), 0.0))

    def _bound_of(self, p: Array) -> int:
        """Return the parameter that is at its bound."""
        off = [min(abs(p[i] - bound) for bound in self.bounds[i]) for i in (0, 1)]
        return int(np.argmin(off / self.sizes))

    def _first_bifurcation(self) -> Bifurcation | None:
        """Return the first bifurcation along one of the parameters, if there is one."""
        system, nodes = self.motion.system, self.motion.nodes.ravel()
        p = np.array([value_of(system, name) for name in self.names])
        lost: Lost | None = None
        proper: Bifurcation | None = None
        for index in (0, 1):
            problem = OrbitProblem(system, self.motion.itinerary, (self.names[index],))
            for direction in (1, -1):
                try:
                    found = self._end_of(
                        problem, self._branch(problem, nodes, p, index, direction), index
                    )
                except Lost as loss:
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
        if path.end is PathEnd.INTERRUPTED:
            raise KeyboardInterrupt
        # A doubled motion ends where its halves become one.
        k = halving(problem, path)
        if k is not None:
            u, p = path.points[k].u, path.points[k].p
            found = doubling_near(problem, u, p, self.bounds[index], self.steps.max_step)
            if found is not None:
                return found
        if path.end is PathEnd.BOUND:
            return None
        if path.stop is not None:
            return bifurcation_at(problem, path.stop)
        at = f"{problem.parameters[0]} = {path.p[-1, 0]:.6g}" if path.points else "the start"
        raise Lost(f"the motion at {at}: {path.end}")

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
                step=self.steps.step,
                min_step=self.steps.min_step,
                max_step=self.steps.max_step,
                max_points=most or self.steps.max_points,
                stop_at=ENDS,
                first=FIRST,
                classify=problem.classify,
            )
        except KeyboardInterrupt as interruption:
            if most:
                raise
            return path_so_far(interruption)

    def _along_bound(self, place: OnBound) -> tuple[Arc, Place]:
        """Follow the motion along a bound, to where it loses its stability or to the corner."""
        free = 1 - place.index
        fixed = {self.names[place.index]: float(place.p[place.index])}
        problem = OrbitProblem(
            varied(self.motion.system, fixed), place.itinerary, (self.names[free],)
        )
        fixed_at = float(place.p[place.index])
        equations = (place.index, fixed_at, *_legs_of(place.itinerary))
        retraced = False
        for direction in (1, -1):
            start = (problem, place.u, place.p, free, direction)
            probe = self._branch(*start, tangent=place.tangent, most=3)
            first = probe.points[1] if len(probe.points) > 1 else None
            if first is None or not _is_stable(problem, first.u, first.p):
                continue
            z = np.append(first.u, np.insert(first.p, place.index, fixed_at))
            if self._passed(problem, equations, z):
                retraced = True
                continue
            path = self._branch(*start, tangent=place.tangent)
            count = len(path.points)
            values = np.insert(path.p.reshape(count, 1), place.index, fixed_at, axis=1)
            z = np.hstack((path.u.reshape(count, len(place.u)), values))
            arc = Arc(values, None, equations, z)
            if path.end is PathEnd.INTERRUPTED:
                return arc, KeyboardInterrupt()
            found = self._end_of(problem, path, free)
            if found is not None:
                values[-1, free] = found.value
                return arc, found
            return arc, OnBound(place.itinerary, path.points[-1].u, values[-1], free)
        if retraced:
            raise Lost(f"the border comes back along the bound at {_numbers(place.p)}")
        raise Lost(f"no stable motion along the bound at {_numbers(place.p)}")


def _equations_of(problem: CurveProblem) -> Hashable:
    return problem.kind, problem.test, *_legs_of(problem.itinerary)


def _legs_of(itinerary: _core.Itinerary) -> tuple[Hashable, ...]:
    return tuple(itinerary.legs), tuple(itinerary.clocks), itinerary.periods


def _arc_of(problem: CurveProblem, curve: BifurcationCurve) -> Arc:
    z = np.hstack((curve.nodes.reshape(len(curve.values), -1), curve.values))
    return Arc(curve.values, curve, _equations_of(problem), z)


def _is_stable(problem: OrbitProblem, u: Array, p: Array) -> bool:
    matrix = problem.monodromy(u, p)
    inside = np.isfinite(matrix).all() and np.abs(np.linalg.eigvals(matrix)).max() < 1.0
    return bool(inside) and all(value > -ROUNDING for value in problem.border_tests(u, p).values())


def _meeting(problem: CurveProblem, special: SpecialPoint) -> CodimensionTwo:
    """Return a point of codimension two as the start of the other curve through it."""
    found = codimension_two(problem, special)
    if found.kind not in _OTHER:
        return found
    pair = BifurcationKind.NEIMARK_SACKER
    kind = _OTHER[found.kind] if problem.kind is pair else pair
    return CodimensionTwo(
        kind=kind,
        values=found.values,
        motion=found.motion,
        test=kind,
        test_value=found.test_value,
    )


def _at(problem: OrbitProblem) -> str:
    return _numbers(np.array([value_of(problem.system, name) for name in problem.parameters]))


def _numbers(p: Array) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in p) + ")"
