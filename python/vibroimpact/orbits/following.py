"""Following a branch of periodic motions one way, from one sequence of legs to the next.

Each sequence is followed on its own (`continuation`), up to its border; there the branch goes on
with the sequence beyond (`resegment`), or ends. Between, a simulation confirms every point.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arguments import count, positive, reject
from ..continuation.follow import follow
from ..continuation.names import PathEnd
from ..continuation.newton import solve
from ..continuation.path import Path, Point, SpecialPoint, path_so_far
from ..errors import Interrupted
from ..hints import close_to
from ..structure import Structure
from ..system import System
from .bifurcation import Bifurcation
from .branch import Branch, Piece
from .doubling import MIN_STEP, doubling_near, halving
from .endings import why_ended
from .kinds import BORDERS, CONDITIONS, FIRST, ON_CURVES, BifurcationKind, BranchEnd
from .kinks import beyond_kink
from .machines import beyond, problem_of
from .motion import same_orbit
from .problem import OrbitProblem
from .ranges import LONGEST_STEP
from .resegment import Crossing
from .special_points import bifurcation_at, end_of, turns_back

# Sequences of legs that one direction of a branch may pass.
_MOST_PIECES = 200
# A test function is at its border below this part of its largest value along a piece.
_AT_BORDER = 1e-4
# First step unless given.
_DEFAULT_STEP = 0.01
# Where a test was located it is at most this; elsewhere all tests are of order one.
_LOCATED = 1e-6
# How often the steps are halved where a path has passed a border.
_MOST_REFINEMENTS = 6
# A border that is reached again has the same parameter to this accuracy.
_SAME_VALUE = 1e-9
# Another event nearer to a border than this, in units of the sizes, belongs to the border: beyond
# it these legs do not exist.
_BESIDE_BORDER = 1e-9
# A step may pass a border without a sign change, for example if a maximum of the gap appears and
# becomes positive within it. Then the step is repeated this many times, each time with so many
# shorter steps.
_RETRIES = 8
_SHORTER = 4.0


@dataclass(frozen=True, kw_only=True)
class Settings:
    """The settings of a branch."""

    parameter: str
    bounds: tuple[float, float]
    size: float
    step: float
    max_step: float
    max_points: int
    virtual: bool
    stop_at: frozenset[BifurcationKind]

    @classmethod
    def checked(
        cls,
        name: str,
        bounds: tuple[float, float],
        step: float | None,
        max_step: float,
        max_points: int,
        virtual: bool = False,
        stop_at: Any = (),
    ) -> "Settings":
        """Check the arguments."""
        largest = positive("max_step", max_step)
        if largest > LONGEST_STEP:
            reject("max_step", max_step, f"a number > 0, at most {LONGEST_STEP:g}")
        first = min(_DEFAULT_STEP, largest) if step is None else positive("step", step)
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
            stop_at=_kinds(stop_at),
        )

    def stops(self, point: SpecialPoint) -> bool:
        """Whether a sequence of legs is followed up to this point only."""
        kind = BifurcationKind(point.kind)
        if kind in BORDERS:
            return not self.virtual or kind in self.stop_at
        return _is_zero(point) and (kind in self.stop_at or turns_back(point))

    def halved(self) -> "Settings":
        """Return these settings with steps half as long."""
        half = max(self.step / 2.0, MIN_STEP)
        return replace(self, step=half, max_step=max(self.max_step / 2.0, half))


@dataclass
class Half:
    """One direction of a branch."""

    pieces: list[Piece]
    bifurcations: list[Bifurcation]
    end: BranchEnd
    detail: str = ""
    # Whether stop_at asked for this end.
    asked: bool = False

    @property
    def why_not(self) -> str:
        """Why it does not go on, in a sentence."""
        return "" if self.asked else why_ended(self.end, self.detail)


def _kinds(given: Any) -> frozenset[BifurcationKind]:
    """Check the kinds of bifurcations at which a branch stops: one, or several."""
    known = tuple(kind for kind in BifurcationKind if kind not in ON_CURVES)
    kinds = (given,) if isinstance(given, str) else given
    hint = ""
    if isinstance(kinds, list | tuple | set | frozenset):
        wrong = [kind for kind in kinds if not isinstance(kind, str) or kind not in known]
        if not wrong:
            return frozenset(map(BifurcationKind, kinds))
        hint = close_to(wrong[0], known) if isinstance(wrong[0], str) else ""
    reject("stop_at", given, f"one or several of {', '.join(known)}{hint}")


def check_ways(both: Any, direction: Any) -> None:
    """Check which ways a branch is followed."""
    if isinstance(direction, bool) or not isinstance(direction, int) or direction not in (1, -1):
        reject("direction", direction, "1 or -1")
    if not isinstance(both, bool):
        reject("both", both, "True or False")


def followed(
    system: System | Structure,
    start: Crossing,
    ways: Sequence[int],
    settings: Settings,
    here: Bifurcation | None = None,
) -> Branch:
    """Return the branch from its start one way or both, through the bifurcation there if any.

    Raises
    ------
    Interrupted
        After Ctrl-C; ``.result`` is the branch so far.
    """
    halves: list[Half] = []
    both = len(ways) > 1
    for way in ways:
        half = follow_half(system, start, way, settings)
        halves.append(half)
        if half.end is PathEnd.INTERRUPTED:
            branch = joined(settings.parameter, halves, both)
            raise Interrupted("interrupted along a branch", branch)
        if half.end is PathEnd.CLOSED:
            break
    closed = halves[-1].end is PathEnd.CLOSED
    ended = all(half.end is PathEnd.MIRRORED or half.asked for half in halves)
    if here is not None and both and ended:
        # The two sides of a pitchfork that end at one other are a closed branch.
        back, forth = (half.bifurcations for half in halves)
        if _same_border(back[-1], forth[-1]):
            back.pop()
            for half in halves:
                half.end = PathEnd.CLOSED
    if here is not None and (both or closed):
        # The first direction is reversed; a closed branch ends where it began.
        found = halves[-1].bifurcations
        found[:] = [point for point in found if not _same_border(point, here)]
        found.insert(len(found) if closed else 0, here)
    return joined(settings.parameter, halves, both)


def follow_half(system: System | Structure, start: Crossing, way: int, settings: Settings) -> Half:
    """Follow one direction; after Ctrl-C return what is done."""
    half = Half([], [], PathEnd.POINTS)
    try:
        _extend(half, system, start, way, settings)
    except KeyboardInterrupt:  # Interrupted is a KeyboardInterrupt
        half.end = PathEnd.INTERRUPTED
    return half


def joined(name: str, halves: Sequence[Half], both: bool) -> Branch:
    """Return the branch of one direction, or of both; then the first is reversed."""
    if not both or len(halves) == 1:
        half = halves[0]
        return Branch(
            parameter=name,
            pieces=tuple(half.pieces),
            bifurcations=tuple(half.bifurcations),
            ends=(half.end if both else PathEnd.START, half.end),
            why_not=(half.why_not if both else "", half.why_not),
        )
    back, forth = halves
    reversed_pieces = [
        replace(
            piece,
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
        why_not=(back.why_not, forth.why_not),
    )


def _extend(
    half: Half, system: System | Structure, start: Crossing, way: int, settings: Settings
) -> None:
    borders: list[tuple[Bifurcation, int, int]] = []
    at: Crossing | None = start
    direction, left, retries = way, settings.max_points, _RETRIES
    finer, continued = settings, False
    while at is not None and left >= 2 and len(half.pieces) < _MOST_PIECES:
        problem = problem_of(system, at.itinerary, (settings.parameter,))
        path = _path(problem, at, direction, left, finer)
        try:
            for _ in range(_MOST_REFINEMENTS):
                if not _passed_a_border(problem, path):
                    break
                finer = finer.halved()
                path = _path(problem, at, direction, left, finer)
        except KeyboardInterrupt:
            # The last step may have passed a border without a sign change.
            path = replace(path, points=path.points[:-1], end=PathEnd.INTERRUPTED)
        left -= len(path.points)
        half.end, half.detail = end_of(path), path.detail
        halved = halving(problem, path)
        piece, good, reason = _piece(problem, path, halved, settings)
        if piece is None:
            if reason is None:
                raise KeyboardInterrupt
            break
        if continued:
            half.pieces[-1] = _continued(half.pieces[-1], piece)
        else:
            half.pieces.append(piece)
        last = path.stop
        reached = path.points[good - 1].arclength
        if last is not None and _is_border(last) and not reason:
            reached = min(reached, last.arclength - _BESIDE_BORDER)
        for special in path.special:
            if special is not last and special.arclength <= reached and _is_zero(special):
                half.bifurcations.append(bifurcation_at(problem, special))
        if path.end is PathEnd.INTERRUPTED or reason is None:
            raise KeyboardInterrupt
        if reason:
            half.end, half.detail = PathEnd.REFUSED, reason
            failed = path.points[good].arclength - path.points[good - 1].arclength
            at = _again(problem, path.points[good - 1])
            finer = replace(settings, step=failed / _SHORTER, max_step=failed / _SHORTER)
            direction, retries, continued = 1, retries - 1, True
            if retries < 0 or finer.step <= MIN_STEP:
                break
            continue
        if halved is not None:
            half.end = BifurcationKind.PERIOD_DOUBLING
            at_halves = path.points[halved]
            doubling = doubling_near(
                problem, at_halves.u, at_halves.p, settings.bounds, settings.max_step
            )
            if doubling is not None:
                half.bifurcations.append(doubling)
            break
        if last is None and half.end is PathEnd.NO_CONVERGENCE:
            at = beyond_kink(problem, path, settings.size)
            if at is not None:
                half.end = PathEnd.POINTS  # unless the next path ends otherwise
                direction, retries, finer, continued = 1, _RETRIES, settings, True
                continue
        if last is None:
            break
        if not _is_border(last):
            half.bifurcations.append(bifurcation_at(problem, last))
            half.asked = half.end in settings.stop_at
            if not half.asked:
                half.end = PathEnd.MIRRORED
            break
        at = beyond(problem, last)
        direction, retries, finer, continued = 1, _RETRIES, settings, False
        onward = () if at is None else tuple(at.itinerary.legs)
        border = bifurcation_at(problem, last, onward)
        for known, pieces, found in borders:
            if _same_border(known, border):
                # The loop is complete: its points before the first passage of this border would
                # repeat. Points before the loop may lead to it.
                first, keep = pieces, 0
                while first > 0 and _same_legs(
                    half.pieces[first - 1], half.pieces[first - 1 - pieces]
                ):
                    first -= 1
                if first > 0:
                    keep = borders[first - 1][2]
                del half.pieces[first:pieces], half.bifurcations[keep:found]
                half.bifurcations.append(border)
                half.end = PathEnd.CLOSED
                return
        half.bifurcations.append(border)
        if border.kind in settings.stop_at:
            half.end, half.asked = border.kind, True
            break
        borders.append((border, len(half.pieces), len(half.bifurcations)))
        half.end = end_of(path) if at is None else PathEnd.POINTS


def _path(
    problem: OrbitProblem, at: Crossing, direction: int, left: int, settings: Settings
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
            stop_at=settings.stops,
            first=FIRST,
            classify=problem.classify,
        )
    except KeyboardInterrupt as interruption:
        return path_so_far(interruption)


def _piece(
    problem: OrbitProblem, path: Path, halved: int | None, settings: Settings
) -> tuple[Piece | None, int, str | None]:
    """Return the piece, its number of points, and why a simulation does not confirm the next one.

    The reason is ``""`` if there is no next point, and None after Ctrl-C.
    """
    multipliers: list[NDArray[np.complex128]] = []
    reason: str | None = ""
    points = path.points if halved is None else path.points[:halved]
    stops = path.stop.test if path.stop is not None and _is_border(path.stop) else None
    largest = max((point.tests.get(stops, 0.0) for point in points), default=0.0)
    # All of a path may lie at its border.
    border = max(_AT_BORDER * largest, _LOCATED)
    for k, point in enumerate(points):
        try:
            motion = problem.motion(point.u, point.p)
        except KeyboardInterrupt:
            reason = None
            break
        # So close to a border the result of a simulation depends on rounding.
        at_border = (
            k == 0
            or (stops is not None and k == len(path.points) - 1)
            or point.tests.get(stops, math.inf) < border
        )
        if not (motion.admissible or at_border or settings.virtual):
            reason = motion.why_not
            break
        multipliers.append(motion.multipliers)
    good = len(multipliers)
    if not good:
        return None, 0, reason
    piece = problem.piece(path.p[:good, 0], path.u[:good], np.array(multipliers))
    return piece, good, reason


def _passed_a_border(problem: OrbitProblem, path: Path) -> bool:
    """Whether another border lies in the step to the border at which a path stops.

    If a test changes its sign twice within a step, neither change is found. This is common where a
    branch meets a shorter orbit at its graze: all passes of the orbit graze there together, and one
    of them may have grazed just before.
    """
    if path.stop is None or not _is_border(path.stop) or len(path.points) < 2:
        return False
    before, border = path.points[-2:]
    for part in (0.5, 0.9):
        u, p = (1.0 - part) * before.u + part * border.u, (1.0 - part) * before.p + part * border.p
        found, report = solve(problem, u, p)
        if not report.converged:
            continue
        tests = problem.tests(found, p, problem.residual(found, p)[1])
        if any(value < 0.0 for test, value in tests.items() if isinstance(test, CONDITIONS)):
            return True
    return False


def _is_border(special: SpecialPoint) -> bool:
    return special.kind in BORDERS


def _is_zero(special: SpecialPoint) -> bool:
    """Whether a test vanishes where it was located.

    A test of the multipliers that jumps passes infinity near a grazing. Where one multiplier is
    huge, rounding of the small ones makes the test cross zero at random.
    """
    return special.continuous and abs(special.value) <= _LOCATED


def _same_legs(one: Piece, other: Piece) -> bool:
    return one.label == other.label and Counter(one.itinerary.legs) == Counter(other.itinerary.legs)


def _same_border(one: Bifurcation, other: Bifurcation) -> bool:
    """Whether a branch has come back to a border, with the same legs on both sides."""
    return (
        one.kind == other.kind
        and abs(one.value - other.value) <= _SAME_VALUE * max(1.0, abs(one.value))
        and Counter(one.goes_on) == Counter(other.goes_on)
        and same_orbit(one.motion, other.motion)
    )


def _again(problem: OrbitProblem, point: Point) -> Crossing:
    """Start from a point of a path, in its direction."""
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
