"""Branches of periodic motions over a parameter, stable and unstable, with their bifurcations.

A branch is followed by pseudo-arclength continuation with its sequence of legs held fixed, so that
every condition of the motion is smooth (docs/orbits.md). Where a condition that makes it a motion
reaches zero the branch meets a border: a flight grazes, an impact changes its regime, chatter
becomes incomplete, a contact phase ends another way. The border is located, and where the orbit
goes on it goes on with another sequence of legs: both sequences have the border's orbit in common.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..checks import count, number, positive, reject
from ..errors import Interrupted, ParameterError
from ..system import NUMERIC_RANGES, System
from .continuation import follow
from .friction import with_friction
from .motion import NEUTRAL, PeriodicMotion, motion_of
from .newton import OutsideDomain, solve
from .path import Path, Point, SpecialPoint
from .problem import OrbitProblem
from .resegment import Crossing, beyond
from .shooting import same_orbit

Array = NDArray[np.float64]

# Kinds of tests at which a motion ceases to be one with these legs.
BORDERS = ("grazing", "regime_border", "chatter_onset", "contact_border")
# Names of the kinds of bifurcations as users see them.
NAMES = {"fold": "saddle_node"}
# Sequences of legs that one direction of a branch may pass.
MOST_PIECES = 200
# Shortest step, as part of the range and of the motion's size.
MIN_STEP = 1e-9
# Part of the largest value of a test function along a piece below which it is at its border.
AT_BORDER = 1e-4
# Halves of an orbit this close, in units of its size, are one.
ONE_HALF = 1e-3
# Parts of the range around their meeting in which the period doubling is looked for.
DOUBLING_WINDOWS = (1e-5, 1e-4, 1e-3, 1e-2)
# How a direction ends after Ctrl-C.
INTERRUPTED = "interrupted"
# First step unless told otherwise.
DEFAULT_STEP = 0.01
# A test is this small at the most where it was located; all are of order one elsewhere.
LOCATED = 1e-6
# Halves this close are the same but for rounding.
SAME_HALVES = 1e-9
# Times that the steps are halved where a path has passed a border.
MOST_REFINEMENTS = 6
# A border met again has the same parameter to this accuracy.
SAME_VALUE = 1e-9
# Another event nearer to a border than this, in units of the sizes, is the border: beyond it these
# legs are none any more.
SAME_PLACE = 1e-9
# Where a step has led past a border unseen, such as a gap's maximum that rises from nothing to
# above zero within it, it is taken again this many times, each time by so many shorter ones.
RETRIES = 8
SHORTER = 4.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Bifurcation:
    """A located bifurcation of a periodic motion.

    Attributes
    ----------
    kind
        ``saddle_node``, ``period_doubling``, ``neimark_sacker``, ``neutral_saddle`` (no
        bifurcation), ``branch_point``, or a border: ``grazing``, ``regime_border``,
        ``chatter_onset``, ``contact_border``.
    parameter, value
        Name and value of the parameter.
    motion
        The motion there.
    test, test_value
        The function that vanishes there, and what is left of it.
    goes_on
        At a border: the legs beyond it, ``()`` where the branch ends.
    """

    kind: str
    parameter: str
    value: float
    motion: PeriodicMotion
    test: str
    test_value: float
    goes_on: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Kind, place and motion."""
        return f"<{self.kind} of {self.motion.label} at {self.parameter} = {self.value:.12g}>"


@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """Part of a branch with one sequence of legs.

    Attributes
    ----------
    system
        The system, at any value of the parameter.
    parameter
        Name of the parameter.
    itinerary
        The legs.
    values
        Of the parameter, shape (k,).
    nodes
        Shape (k, legs, 4), as in PeriodicMotion.
    multipliers
        Complex, by falling modulus, shape (k, 4) or (k, 2).
    """

    system: System
    parameter: str
    itinerary: _core.Itinerary
    values: Array
    nodes: Array
    multipliers: NDArray[np.complex128]

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Whether all multipliers lie inside the unit circle, shape (k,)."""
        inside: NDArray[np.bool_] = np.abs(self.multipliers).max(axis=1) < 1.0 - NEUTRAL
        return inside

    @property
    def label(self) -> str:
        """The motion in a word, m-n."""
        legs = self.itinerary.legs
        impacts = sum(leg.startswith("impact") for leg in legs)
        return f"{self.itinerary.periods}-{'inf' if 'chatter' in legs else impacts}"

    def motion(self, k: int) -> PeriodicMotion:
        """Return the k-th motion, with its verdict."""
        return motion_of(self._system_at(k), self.itinerary, self.nodes[k].copy())

    def _system_at(self, k: int) -> System:
        return self.system.replace(**{self.parameter: float(self.values[k])})

    @cached_property
    def impacts(self) -> Array:
        """x1 at the impacts but those of chatter, shape (k, impacts)."""
        after = [i for i, leg in enumerate(self.itinerary.legs) if leg.startswith("impact")]
        count = len(self.itinerary.legs)
        return self.nodes[:, [(i + 1) % count for i in after], 0]

    @cached_property
    def sections(self) -> Array:
        """x1 at the starts of the m drive periods, shape (k, m)."""
        # As a whole: at a period doubling an orbit run through twice would be cut down to one.
        motions = (
            motion_of(self._system_at(k), self.itinerary, nodes.copy(), whole=True)
            for k, nodes in enumerate(self.nodes)
        )
        return np.array([motion.sections[:, 0] for motion in motions])


@dataclass(frozen=True, kw_only=True, eq=False)
class Branch:
    """A branch of periodic motions over one parameter.

    Attributes
    ----------
    parameter
        Its name.
    pieces
        In order along the branch, each with one sequence of legs.
    bifurcations
        In order along the branch.
    ends
        Why the branch ends, at its first and last point: ``bound``, the kind of a border that it
        does not pass, ``points``, ``closed``, ``no convergence``, ``outside domain``,
        ``interrupted``, or a text that begins with ``not a motion:`` and says why a simulation does
        not confirm the next point.
    """

    parameter: str
    pieces: tuple[Piece, ...]
    bifurcations: tuple[Bifurcation, ...]
    ends: tuple[str, str]

    @property
    def values(self) -> Array:
        """The parameter along the branch, shape (k,)."""
        return np.concatenate([np.empty(0), *(piece.values for piece in self.pieces)])

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Whether the motion is stable, shape (k,)."""
        return np.concatenate([np.empty(0, bool), *(piece.stable for piece in self.pieces)])

    def of_kind(self, kind: str) -> list[Bifurcation]:
        """Return the bifurcations of one kind."""
        return [found for found in self.bifurcations if found.kind == kind]

    def __repr__(self) -> str:
        """Labels, range and what happens on it."""
        if not self.pieces:
            return f"<Branch without points, ends: {self.ends[0]}, {self.ends[1]}>"
        labels = " ".join(dict.fromkeys(piece.label for piece in self.pieces))
        low, high = self.values.min(), self.values.max()
        return (
            f"<Branch {labels}, {self.parameter} {low:.6g} ... {high:.6g}, "
            f"{len(self.bifurcations)} bifurcations, ends: {self.ends[0]}, {self.ends[1]}>"
        )


@dataclass(frozen=True, kw_only=True)
class _Settings:
    """What is the same along a branch."""

    parameter: str
    bounds: tuple[float, float]
    size: float
    step: float
    max_step: float
    max_points: int
    virtual: bool

    @classmethod
    def checked(
        cls,
        name: str,
        bounds: tuple[float, float],
        step: float | None,
        max_step: float,
        max_points: int,
        virtual: bool = False,
    ) -> "_Settings":
        """Check what a caller gives."""
        largest = positive("max_step", max_step)
        first = min(DEFAULT_STEP, largest) if step is None else positive("step", step)
        if not MIN_STEP <= first <= largest:
            reject("step", step, f"a number from {MIN_STEP} to max_step = {largest}")
        if not isinstance(virtual, bool):
            reject("virtual", virtual, "True or False")
        return cls(
            parameter=name,
            bounds=bounds,
            size=bounds[1] - bounds[0],
            step=first,
            max_step=largest,
            max_points=count("max_points", max_points, least=2),
            virtual=virtual,
        )

    def halved(self) -> "_Settings":
        """Return the same with steps half as long."""
        half = max(self.step / 2.0, MIN_STEP)
        return replace(self, step=half, max_step=max(self.max_step / 2.0, half))


def follow_motion(
    motion: PeriodicMotion,
    *,
    both: bool = True,
    direction: int = 1,
    step: float | None = None,
    max_step: float = 0.05,
    max_points: int = 2000,
    virtual: bool = False,
    **parameter: tuple[float, float],
) -> Branch:
    """Follow a periodic motion over a parameter, stable or not, with its bifurcations.

    Parameters
    ----------
    motion
        Where to start.
    both, direction
        Follow it both ways, or only the way on which the parameter first grows (1) or falls (-1).
    step, max_step
        First and largest step, as part of the range and of the motion's size; the first is 0.01
        or ``max_step``, if that is smaller.
    max_points
        Cap on the points of each direction.
    virtual
        Go on with the same legs beyond borders, where the solution is no motion any more.
    parameter
        The one numeric parameter of the system to vary, with its range:
        ``drive_frequency=(1.5, 1.6)``.

    Returns
    -------
    Branch
        Pieces, bifurcations and ends. Bifurcations are located until rounding stops it, as a rule
        to 1e-12 in the parameter.

    Raises
    ------
    ParameterError
        For bad input.
    Interrupted
        After Ctrl-C; ``.result`` is the branch so far.
    """
    if not isinstance(motion, PeriodicMotion):
        reject("motion", motion, "a PeriodicMotion")
    name, bounds = _range(motion.system, parameter)
    settings = _Settings.checked(name, bounds, step, max_step, max_points, virtual)
    if isinstance(direction, bool) or not isinstance(direction, int) or direction not in (1, -1):
        reject("direction", direction, "1 or -1")
    if not isinstance(both, bool):
        reject("both", both, "True or False")
    itinerary, nodes, value = motion.itinerary, motion.nodes, getattr(motion.system, name)
    if name == "friction":
        itinerary, nodes, value = with_friction(motion.system, itinerary, nodes)
    start = Crossing(itinerary=itinerary, u=nodes.ravel().copy(), p=value, tangent=None)
    ways = (-1, 1) if both else (direction,)
    halves: list[_Half] = []
    for way in ways:
        half = _follow_way(motion.system, start, way, settings)
        halves.append(half)
        if half.end == INTERRUPTED:
            raise Interrupted("interrupted along a branch", _joined(name, halves, both))
        if half.end == "closed":
            break
    return _joined(name, halves, both)


@dataclass
class _Half:
    """One direction of a branch."""

    pieces: list[Piece]
    bifurcations: list[Bifurcation]
    end: str


def _follow_way(system: System, start: Crossing, way: int, settings: _Settings) -> _Half:
    """Follow one direction; Ctrl-C ends it with what is done."""
    half = _Half([], [], "points")
    try:
        _extend(half, system, start, way, settings)
    except (KeyboardInterrupt, Interrupted):
        half.end = INTERRUPTED
    return half


def _extend(half: _Half, system: System, start: Crossing, way: int, settings: _Settings) -> None:
    borders: list[tuple[Bifurcation, int, int]] = []
    at: Crossing | None = start
    direction, left, retries = way, settings.max_points, RETRIES
    finer, continued = settings, False
    while at is not None and left >= 2 and len(half.pieces) < MOST_PIECES:
        problem = OrbitProblem(system, at.itinerary, (settings.parameter,))
        path = _path(problem, at, direction, left, finer)
        for _ in range(MOST_REFINEMENTS):
            if not _passed_a_border(problem, path):
                break
            finer = finer.halved()
            path = _path(problem, at, direction, left, finer)
        left -= len(path.points)
        half.end = path.end.removeprefix("stopped: ")
        halved = halving(problem, path)
        piece, good, reason = _piece(problem, path, halved, settings)
        if piece is None:
            break
        if continued:
            piece = _continued(half.pieces.pop(), piece)
        half.pieces.append(piece)
        last = path.special[-1] if path.end.startswith("stopped") else None
        reached = path.points[good - 1].arclength
        if last is not None and not reason:
            reached = min(reached, last.arclength - SAME_PLACE)
        for special in path.special:
            if special is not last and special.arclength <= reached and _is_zero(special):
                half.bifurcations.append(_bifurcation(problem, special))
        if INTERRUPTED in (path.end, reason):
            raise KeyboardInterrupt
        if reason:
            half.end = f"not a motion: {reason}"
            failed = path.points[good].arclength - path.points[good - 1].arclength
            at = _again(problem, path.points[good - 1])
            finer = replace(settings, step=failed / SHORTER, max_step=failed / SHORTER)
            direction, retries, continued = 1, retries - 1, True
            if retries < 0 or finer.step <= MIN_STEP:
                break
            continue
        if halved is not None:
            half.end = "period_doubling"
            at_halves = path.points[halved]
            doubling = doubling_near(
                problem, at_halves.u, at_halves.p, settings.bounds, settings.max_step
            )
            if doubling is not None:
                half.bifurcations.append(doubling)
            break
        if last is None:
            break
        at = beyond(problem, last)
        direction, retries, finer, continued = 1, RETRIES, settings, False
        onward = () if at is None else tuple(at.itinerary.legs)
        border = _bifurcation(problem, last, onward)
        for known, pieces, found in borders:
            if _same_border(known, border):
                # Once round: what of the loop lies before the first passage of this border comes
                # again. Before that there may be a way to the loop.
                first, keep = pieces, 0
                while first > 0 and _same_legs(
                    half.pieces[first - 1], half.pieces[first - 1 - pieces]
                ):
                    first -= 1
                if first > 0:
                    keep = borders[first - 1][2]
                del half.pieces[first:pieces], half.bifurcations[keep:found]
                half.bifurcations.append(border)
                half.end = "closed"
                return
        half.bifurcations.append(border)
        borders.append((border, len(half.pieces), len(half.bifurcations)))
        half.end = last.kind if at is None else "points"


def _is_zero(special: SpecialPoint) -> bool:
    """Whether a test vanishes where it was located.

    A test of the multipliers that jumps passes infinity near a grazing; and where one of them is
    huge, rounding of the small ones makes it cross zero as it likes.
    """
    return special.continuous and abs(special.value) <= LOCATED


def _same_legs(one: Piece, other: Piece) -> bool:
    return one.label == other.label and sorted(one.itinerary.legs) == sorted(other.itinerary.legs)


def _passed_a_border(problem: OrbitProblem, path: Path) -> bool:
    """Whether another border lies in the step to the border at which a path stops.

    Both sign changes of a test within a step go unseen. This is common where a branch meets a
    shorter orbit at its graze: all its passes graze there together, and one of them may have done
    so just before.
    """
    if not path.end.startswith("stopped") or len(path.points) < 2:
        return False
    before, border = path.points[-2:]
    for part in (0.5, 0.9):
        u, p = (1.0 - part) * before.u + part * border.u, (1.0 - part) * before.p + part * border.p
        found, report = solve(problem, u, p)
        if not report.converged:
            continue
        tests = problem.tests(found, p, problem.residual(found, p)[1])
        if any(value < 0.0 for test, value in tests.items() if test.split(":")[0] in BORDERS):
            return True
    return False


def _again(problem: OrbitProblem, point: Point) -> Crossing:
    """Start from a point of a path, the way it goes."""
    return Crossing(
        itinerary=problem.itinerary, u=point.u, p=float(point.p[0]), tangent=point.tangent
    )


def _continued(first: Piece, second: Piece) -> Piece:
    """Join two pieces with the same legs, the second of which begins with the first's end."""
    return replace(
        second,
        values=np.concatenate((first.values, second.values[1:])),
        nodes=np.concatenate((first.nodes, second.nodes[1:])),
        multipliers=np.concatenate((first.multipliers, second.multipliers[1:])),
    )


def _same_border(one: Bifurcation, other: Bifurcation) -> bool:
    """Whether a branch has come back to a border, with the same legs on both sides."""
    return (
        one.kind == other.kind
        and abs(one.value - other.value) <= SAME_VALUE * max(1.0, abs(one.value))
        and sorted(one.goes_on) == sorted(other.goes_on)
        and same_orbit(one.motion, other.motion)
    )


def _path(
    problem: OrbitProblem, at: Crossing, direction: int, left: int, settings: _Settings
) -> Path:
    try:
        return follow(
            problem,
            at.u,
            [at.p],
            bounds=settings.bounds,
            direction=direction,
            tangent=at.tangent,
            parameter_size=settings.size,
            step=settings.step,
            min_step=MIN_STEP,
            max_step=settings.max_step,
            max_points=left,
            stop_at=() if settings.virtual else BORDERS,
            classify=problem.classify,
        )
    except Interrupted as interruption:
        path: Path = interruption.result
        return path


def _piece(
    problem: OrbitProblem, path: Path, halved: int | None, settings: _Settings
) -> tuple[Piece | None, int, str]:
    """Return the piece, how many points it has, and why a simulation does not confirm the next."""
    multipliers: list[NDArray[np.complex128]] = []
    reason = ""
    points = path.points if halved is None else path.points[:halved]
    stops = path.special[-1].test if path.end.startswith("stopped") else ""
    largest = max((point.tests.get(stops, 0.0) for point in points), default=0.0)
    for k, point in enumerate(points):
        try:
            system = problem.system_at(point.p)
            motion = motion_of(system, problem.itinerary, point.u.reshape(-1, 4), whole=True)
        except KeyboardInterrupt:
            reason = INTERRUPTED
            break
        # So close to a border a simulation decides by rounding.
        at_border = (
            k == 0
            or (stops and k == len(path.points) - 1)
            or point.tests.get(stops, 1.0) < AT_BORDER * largest
        )
        if not (motion.admissible or at_border or settings.virtual):
            reason = motion.why_not
            break
        multipliers.append(motion.multipliers)
    good = len(multipliers)
    if not good:
        return None, 0, reason
    piece = Piece(
        system=problem.system,
        parameter=settings.parameter,
        itinerary=problem.itinerary,
        values=path.p[:good, 0],
        nodes=path.u[:good].reshape(good, -1, 4),
        multipliers=np.array(multipliers),
    )
    return piece, good, reason


def halving(problem: OrbitProblem, path: Path) -> int | None:
    """Return the first point beyond which both halves of the orbit have become one.

    There the branch meets that of the halved orbit, at its period doubling, and would come back
    with its halves exchanged.
    """
    shorter = _half_of(problem)
    if shorter is None or len(path.points) < 2:
        return None
    sizes = problem.scale(path.points[0].u)
    apart = np.array([_halves_apart(point.u / sizes) for point in path.points])
    distance = np.abs(apart).max(axis=1)
    for k in range(1, len(apart)):
        # A branch that begins at a period doubling leaves it first.
        turned = apart[k] @ apart[k - 1] < 0.0 and distance[k - 1] > SAME_HALVES
        if turned or distance[k - 1] > distance[k] < ONE_HALF:
            return k
    return None


def _halves_apart(u: Array) -> Array:
    half = len(u) // 2
    return u[:half] - u[half:]


def _half_of(problem: OrbitProblem) -> OrbitProblem | None:
    """Return the problem of an orbit half as long, if both halves have the same legs."""
    itinerary = problem.itinerary
    legs, clocks, m = itinerary.legs, itinerary.clocks, itinerary.periods
    half = len(legs) // 2
    if len(legs) % 2 or m % 2 or legs[:half] != legs[half:]:
        return None
    if any(late - early != m // 2 for early, late in zip(clocks, clocks[half:], strict=False)):
        return None
    shorter = _core.Itinerary(legs[:half], m // 2, clocks[:half], itinerary.wall_at_rest)
    return OrbitProblem(problem.system, shorter, problem.parameters)


def doubling_near(
    problem: OrbitProblem, u: Array, p: Array, bounds: tuple[float, float], max_step: float
) -> Bifurcation | None:
    """Return the period doubling of the halved orbit next to a point."""
    shorter = _half_of(problem)
    if shorter is None:
        return None
    nodes = 0.5 * (u[: len(u) // 2] + u[len(u) // 2 :])
    low, high = bounds
    size = high - low
    for part in DOUBLING_WINDOWS:
        window = part * size
        start = max(low, float(p[0]) - window)
        path = follow(
            shorter,
            nodes,
            start,
            bounds=(start, min(high, float(p[0]) + window)),
            parameter_size=size,
            step=max(min(0.1 * part, max_step), MIN_STEP),
            min_step=MIN_STEP,
            max_step=max_step,
            max_points=100,
            classify=shorter.classify,
        )
        doublings = path.of_kind("period_doubling")
        if doublings:
            return _bifurcation(
                shorter, min(doublings, key=lambda point: abs(point.p[0] - float(p[0])))
            )
    return None


def _bifurcation(
    problem: OrbitProblem, special: SpecialPoint, goes_on: tuple[str, ...] = ()
) -> Bifurcation:
    nodes = special.u.reshape(-1, 4)
    return Bifurcation(
        kind=NAMES.get(special.kind, special.kind),
        parameter=problem.parameters[0],
        value=float(special.p[0]),
        motion=motion_of(problem.system_at(special.p), problem.itinerary, nodes, whole=True),
        test=special.test,
        test_value=special.value,
        goes_on=goes_on,
    )


def _joined(name: str, halves: Sequence[_Half], both: bool) -> Branch:
    if not both or len(halves) == 1:
        half = halves[0]
        return Branch(
            parameter=name,
            pieces=tuple(half.pieces),
            bifurcations=tuple(half.bifurcations),
            ends=("start", half.end) if not both else (half.end, half.end),
        )
    back, forth = halves
    reversed_pieces = [
        Piece(
            system=piece.system,
            parameter=name,
            itinerary=piece.itinerary,
            values=piece.values[::-1],
            nodes=piece.nodes[::-1],
            multipliers=piece.multipliers[::-1],
        )
        for piece in reversed(back.pieces)
    ]
    return Branch(
        parameter=name,
        pieces=(*reversed_pieces, *forth.pieces),
        bifurcations=(*reversed(back.bifurcations), *forth.bifurcations),
        ends=(back.end, forth.end),
    )


def _range(system: System, parameter: dict[str, Any]) -> tuple[str, tuple[float, float]]:
    """Check the one parameter and its range."""
    if len(parameter) != 1:
        given = ", ".join(parameter) or "none"
        raise ParameterError(f"give exactly one parameter with its range, got {given}")
    name, bounds = next(iter(parameter.items()))
    if name not in NUMERIC_RANGES:
        reject("parameter", name, f"one of {', '.join(NUMERIC_RANGES)}")
    return name, range_around(system, name, bounds)


def range_around(system: System, name: str, bounds: Any) -> tuple[float, float]:
    """Check a range of a parameter that contains its value."""
    value = getattr(system, name)
    allowed = f"a range (low, high) of finite numbers around {value}"
    try:
        low, high = bounds
    except (TypeError, ValueError):
        reject(name, bounds, allowed)
    low, high = number(name, low, allowed), number(name, high, allowed)
    if not low <= value <= high or low == high:
        reject(name, (low, high), allowed)
    return low, high


def doubled(motion: PeriodicMotion) -> tuple[_core.Itinerary, Array, Array]:
    """Return legs and nodes of a motion run through twice, and the direction that doubles it.

    At a period doubling the multiplier -1 has an eigenvector d: the doubled orbit leaves by +d in
    its first half and by -d in its second.
    """
    legs, clocks = list(motion.legs), list(motion.clocks)
    circuit = legs == ["circuit"]
    if circuit:
        raise OutsideDomain("a motion without impacts does not double")
    twice = _core.Itinerary(
        legs + legs, 2 * motion.m, clocks + [c + motion.m for c in clocks], motion.wall_at_rest
    )
    values, vectors = np.linalg.eig(motion.return_map)
    direction = np.real(vectors[:, np.argmin(np.abs(values + 1.0))])
    shifts = []
    for leg in motion.itinerary.transfer(motion.system._compiled, motion.nodes):
        shifts.append(direction)
        direction = leg @ direction
    shift = np.array(shifts)
    nodes = np.vstack((motion.nodes, motion.nodes))
    return twice, nodes, np.vstack((shift, -shift))


def switch_branch(
    bifurcation: Bifurcation,
    *,
    step: float | None = None,
    max_step: float = 0.05,
    max_points: int = 2000,
    **parameter: tuple[float, float],
) -> Branch:
    """Follow the branch of doubled motions that begins at a period doubling.

    Parameters
    ----------
    bifurcation
        A ``period_doubling`` of a branch.
    step, max_step, max_points, parameter
        As in ``follow_motion``; the parameter may be another one than that of the bifurcation.

    Returns
    -------
    Branch
        Its first point is the bifurcation.

    Raises
    ------
    ParameterError
        For bad input, and if the bifurcation is no period doubling.
    """
    if not isinstance(bifurcation, Bifurcation) or bifurcation.kind != "period_doubling":
        reject("bifurcation", bifurcation, "a Bifurcation of the kind period_doubling")
    system = bifurcation.motion.system
    name, bounds = _range(system, parameter)
    settings = _Settings.checked(name, bounds, step, max_step, max_points)
    itinerary, nodes, shift = doubled(bifurcation.motion)
    tangent = np.append(shift.ravel(), 0.0)
    start = Crossing(itinerary=itinerary, u=nodes.ravel(), p=getattr(system, name), tangent=tangent)
    half = _follow_way(system, start, 1, settings)
    if half.end == INTERRUPTED:
        raise Interrupted("interrupted along a branch", _joined(name, [half], False))
    return _joined(name, [half], False)
