"""All period n-1 motions of a system without friction: n drive periods, one impact.

docs/theory.md, section 8. Every solution of (35) in x1 is isolated by intervals, made exact to
rounding by Newton's method on the conditions of periodicity, and given its verdict; beside it
stands that of the paper, by the eigenvalues of (42).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..checks import count, reject
from ..system import System
from .algebraic import Conditions, Parameters, conditions
from .criterion import paper_eigenvalues
from .intervals import Interval, isolate
from .motion import PeriodicMotion
from .open_phase import cuts, is_open
from .shooting import solve_orbit

Array = NDArray[np.float64]

# Boxes of x1 with which a search begins are this wide.
FIRST_BOX = math.pi / 16
# A bound of |x1| above this counts as none.
LARGEST_ANGLE = 1e4
UNBOUNDED = "no bound of x1 is known: |x1| <= pi is searched"
# An approach velocity below this part of the other velocities is lost in rounding.
LOST = 1e-12
# Newton's method may move x1 beyond its box by so many units of rounding.
SLACK = 256.0 * float(np.finfo(float).eps)


@dataclass(frozen=True, kw_only=True)
class Undecided:
    """An interval of x1 in which double precision does not tell how many solutions there are.

    Attributes
    ----------
    lo, hi
        The interval.
    reason
        Why, in words.
    """

    lo: float
    hi: float
    reason: str


@dataclass(frozen=True, kw_only=True, eq=False)
class PeriodicMotions(Sequence[PeriodicMotion]):
    """All period n-1 solutions of a system, a sequence in order of x1.

    Attributes
    ----------
    motions
        The solutions, admissible or not.
    boxes
        Intervals of x1, shape (motions, 2), proved to hold this solution and no other; where x1
        alone is fixed (a wall at rest) two solutions of different phase may share one.
    undecided
        Intervals that may hold further solutions, such as an exact double root, or none.
    within
        The interval of x1 that was searched.
    bounded
        Whether no solution can lie outside it.
    note
        What is special about the system, such as why it has no isolated solutions; mostly ``""``.
    """

    motions: tuple[PeriodicMotion, ...]
    boxes: Array
    undecided: tuple[Undecided, ...]
    within: tuple[float, float]
    bounded: bool
    note: str = ""

    def __len__(self) -> int:
        """Number of solutions."""
        return len(self.motions)

    @overload
    def __getitem__(self, index: int) -> PeriodicMotion: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[PeriodicMotion, ...]: ...
    def __getitem__(self, index: int | slice) -> PeriodicMotion | tuple[PeriodicMotion, ...]:
        """Return one solution, or several."""
        return self.motions[index]

    def __iter__(self) -> Iterator[PeriodicMotion]:
        """Pass through the solutions."""
        return iter(self.motions)


@dataclass(frozen=True)
class Solutions:
    """Solutions of many systems, arrays of one row each: the state just before the impact.

    Attributes
    ----------
    which
        Number of the system.
    box
        Interval of x1.
    isolated
        Whether it is proved to hold exactly one solution. Where not, the other columns are NaN.
    x1, v1, v2, phase
        The state; phase in (-pi, pi].
    approach_velocity
        u = v1 kappa - v2.
    """

    which: NDArray[np.int64]
    box: Interval
    isolated: NDArray[np.bool_]
    x1: Array
    v1: Array
    v2: Array
    phase: Array
    approach_velocity: Array

    def __len__(self) -> int:
        """Number of solutions."""
        return len(self.which)


def periodic_motions(
    system: System, n: int = 1, *, within: tuple[float, float] | None = None
) -> PeriodicMotions:
    """Find all motions of n drive periods with one impact, by solving (35) in the angle x1.

    Parameters
    ----------
    system
        A system without friction and with a drive.
    n
        Drive periods per orbit, >= 1.
    within
        Interval of x1 at the impact to search, in radians; default all that a bound allows.

    Returns
    -------
    PeriodicMotions
        Every solution, with its verdict; admissible ones are motions of the system. A wall at rest
        (mass_ratio and force_amplitude 0) stays at x2 = 0.

    Raises
    ------
    ParameterError
        For bad input: friction (use ``search_motions`` or ``run.refine`` there), no drive.
    """
    if not isinstance(system, System):
        reject("system", system, "a vibroimpact.System")
    n = count("n", n, least=1, most=100_000)
    _check(system)
    limits = None if within is None else _limits(within)
    parameters = Parameters.of([system], n)
    equations = conditions(parameters)
    reach, bounded, note = reach_of(equations)[0]
    if limits is None:
        limits = (-reach, reach)
    else:
        bounded = bounded and limits[0] <= -reach and reach <= limits[1]
    common: dict[str, Any] = {"within": limits, "bounded": bounded, "note": note}
    if reach == 0.0:
        return PeriodicMotions(motions=(), boxes=np.empty((0, 2)), undecided=(), **common)
    found = solve_many(equations, *(np.array([end]) for end in limits))
    motions: list[PeriodicMotion] = []
    boxes: list[tuple[float, float]] = []
    undecided: list[Undecided] = []
    for k in range(len(found)):
        box = (float(found.box.lo[k]), float(found.box.hi[k]))
        starts, reason = [_state(found, k)], ""
        if not found.isolated[k]:
            starts, reason = _decided(equations, found.box[k : k + 1])
        for start in starts:
            motion = _motion(system, equations, start)
            if motion is None or not _in(box, motion.state[0]):
                reason = "Newton's method does not find the solution in it"
            elif _lost(motion):
                reason = "a solution whose approach velocity is lost in rounding"
            else:
                motions.append(motion)
                boxes.append(box)
        if reason:
            undecided.append(Undecided(lo=box[0], hi=box[1], reason=reason))
    order = sorted(range(len(motions)), key=lambda i: motions[i].state)
    return PeriodicMotions(
        motions=tuple(motions[i] for i in order),
        boxes=np.array(boxes).reshape(-1, 2)[order],
        undecided=tuple(undecided),
        **common,
    )


def solve_many(equations: Conditions, lo: Array, hi: Array) -> Solutions:
    """Isolate all solutions of many systems with x1 in [lo, hi], one interval per system."""
    boxes = np.maximum(np.ceil((hi - lo) / FIRST_BOX).astype(np.int64), 1)
    which = np.repeat(np.arange(len(lo)), boxes)
    place = np.arange(len(which)) - np.repeat(np.cumsum(boxes) - boxes, boxes)
    width = ((hi - lo) / boxes)[which]
    left = np.where(place == 0, lo[which], lo[which] + place * width)
    last = place == boxes[which] - 1
    right = np.where(last, hi[which], lo[which] + (place + 1) * width)
    roots = isolate(equations.enclose, which, Interval(left, right))
    x1 = np.where(roots.isolated, roots.box.middle, np.nan)
    unknowns = np.full((len(roots), 5), np.nan)
    matrix, rhs = equations.linear(roots.which[roots.isolated], Interval(x1[roots.isolated]))
    unknowns[roots.isolated] = np.linalg.solve(matrix.middle, rhs.middle[..., None])[..., 0]
    return _solutions(equations, roots.which, roots.box, roots.isolated, x1, unknowns)


def _solutions(
    equations: Conditions,
    which: NDArray[np.int64],
    box: Interval,
    isolated: NDArray[np.bool_],
    x1: Array,
    unknowns: Array,
) -> Solutions:
    """Return the states before the impact of solutions (V, W, P, cos psi, sin psi)."""
    parameters = equations.parameters
    kappa = np.cos(x1) if parameters.oblique else np.ones_like(x1)
    omega, mbar = parameters.drive_frequency[which], parameters.mass_ratio[which]
    v_post, w_post, impulse, cosine, sine = unknowns.T
    return Solutions(
        which=which,
        box=box,
        isolated=isolated,
        x1=x1,
        v1=omega * (v_post + kappa * impulse),
        v2=omega * (w_post - mbar * impulse),
        phase=np.arctan2(sine, cosine),
        approach_velocity=omega
        * ((mbar + kappa**2) * impulse / (1.0 + parameters.restitution[which])),
    )


def reach_of(equations: Conditions) -> list[tuple[float, bool, str]]:
    """Bound |x1| over all solutions, for each system: (bound, whether it is one, note).

    With a, b displacement and velocity before a unit kick of a body kicked once in n periods and p
    its steady response, periodicity says x1 = p1 - a1 kappa P, y = p2 + a2 mbar P and

        (kappa^2 s1 + mbar s2) P = -(kappa p1' - p2')',    s = 1/(1+r) + b >= 0,

    since a passive body takes work from its kicks, b >= -1/2. So in oblique contact
    |kappa P| <= |p1|/s1 + |p2|/(2 sqrt(s1 mbar s2)), and |P| <= (1 + |delta| + |p2|)/|a2 mbar|; the
    smaller one bounds x1. Direct contact: Nc and Ns are linear in x1, D is constant, |N| <= |D|.
    """
    par = equations.parameters
    first, second = equations.first, equations.second
    with np.errstate(all="ignore"):
        (a1, b1), (a2, b2) = first.kicked, second.kicked
        kick = 1.0 / (1.0 + Interval(par.restitution))
        s1, s2 = np.maximum((kick + b1).lo, 0.0), np.maximum((kick + b2).lo, 0.0)
        p1, p2 = first.steady.largest, second.steady.largest
        still = p2 == 0.0
        weighed = p1 / s1 + np.where(still, 0.0, p2 / (2.0 * np.sqrt(s1 * s2 * par.mass_ratio)))
        # A moving wall: kappa P = (p2'/kappa - p1')/s1, and |kappa| is bounded if its tip is.
        height = np.abs(par.gap) + p2
        wall = np.where(height < 1.0, (p1 + p2 / np.sqrt(1.0 - height**2)) / s1, np.inf)
        weighed = np.where((par.mass_ratio == 0.0) & ~still, wall, weighed)
        limited = (1.0 + height) / (a2.smallest * par.mass_ratio)
        # A resonant body 2 is stopped by the impulse that the drive feeds into it in n periods.
        fed = np.where(second.returns, second.gv.largest / par.mass_ratio, np.inf)
        impulse = np.fmin(np.fmin(weighed, limited), fed)
        bound = (p1 + a1.largest * impulse) * (1.0 + 1e-12)
        if not par.oblique:
            bound = _direct_reach(equations)
    result = []
    for k in range(len(par)):
        note = _special(equations, k)
        driven = par.moment_amplitude[k] != 0.0 or par.force_amplitude[k] != 0.0
        if note.startswith("no ") or not driven:
            result.append((0.0, True, note))
        elif par.frequency_ratio[k] == 0.0:
            result.append((math.pi, False, note))
        elif bound[k] <= LARGEST_ANGLE:
            result.append((float(bound[k]) + 1e-9, True, note))
        else:
            result.append(
                (math.pi, False, note or "no bound of x1 is known: |x1| <= pi was searched")
            )
    return result


def _direct_reach(equations: Conditions) -> Array:
    gap = np.abs(equations.parameters.gap)
    d = equations.d[0] + equations.d[1] + equations.d[2]
    reach = np.full(len(gap), np.inf)
    for p, q in (equations.cosine, equations.sine):
        q_all = q[0] + q[1] + q[2]
        slope = p[0] + p[1] + p[2] + q_all
        reach = np.fmin(reach, (d.largest + gap * q_all.largest) / slope.smallest)
    return reach * (1.0 + 1e-12)


def _special(equations: Conditions, k: int) -> str:
    """Say what is special about a system; "no ..." where it has no isolated solutions."""
    par = equations.parameters
    omega = par.drive_frequency[k]
    if equations.first.returns[k] and (
        par.moment_amplitude[k] == 0.0 or par.frequency_ratio[k] != omega
    ):
        return "no isolated solutions: the undamped pendulum swings a whole number of times"
    if equations.second.returns[k] and not (
        par.force_amplitude[k] != 0.0 and omega == 1.0 and par.mass_ratio[k] > 0.0
    ):
        return "no isolated solutions: the undamped body 2 swings a whole number of times"
    if par.frequency_ratio[k] == 0.0:
        if not par.oblique:
            return "no solutions: nothing brings the free body 1 back"
        return "free rotor: solutions repeat with x1 + 2 pi"
    return ""


def _motion(
    system: System, equations: Conditions, start: tuple[float, float, float, float]
) -> PeriodicMotion | None:
    """Make a solution exact to rounding, with its verdict and the paper's."""
    par = equations.parameters
    x1, v1, v2, phase = start
    kappa = math.cos(x1) if par.oblique else 1.0
    mbar, r = system.mass_ratio, system.restitution
    impulse = (1.0 + r) * (kappa * v1 - v2) / (mbar + kappa**2)
    period = system.drive_period
    time = math.fmod((phase - system.phase) / system.drive_frequency, period) % period
    nodes = np.array([[x1, v1 - kappa * impulse, v2 + mbar * impulse, time]])
    rest = mbar == 0.0 and system.force_amplitude == 0.0
    itinerary = _core.Itinerary(["impact:frictionless"], par.n, None, rest)
    found = solve_orbit(system, itinerary, nodes)
    if not isinstance(found, PeriodicMotion):
        return None
    if rest:
        return found
    at = np.array([found.state])
    values = paper_eigenvalues(equations, np.zeros(1, dtype=np.int64), at)[0]
    values.flags.writeable = False
    return replace(found, paper_eigenvalues=values, paper_stable=bool(np.abs(values).max() < 1.0))


def _state(found: Solutions, k: int) -> tuple[float, float, float, float]:
    columns = (found.x1, found.v1, found.v2, found.phase)
    x1, v1, v2, phase = (float(column[k]) for column in columns)
    return x1, v1, v2, phase


def _decided(
    equations: Conditions, box: Interval
) -> tuple[list[tuple[float, float, float, float]], str]:
    """Return the solutions in a box in which F has no simple root, and why it is undecided."""
    if not is_open(equations, float(box.middle[0])):
        return [], "a double root, or two roots too close to tell apart"
    points, complete = cuts(equations, box)
    values = np.array(points).reshape(-1, 6)
    which = np.zeros(len(points), dtype=np.int64)
    sure = np.ones(len(points), dtype=bool)
    at = Interval(values[:, 0])
    found = _solutions(equations, which, at, sure, values[:, 0], values[:, 1:])
    reason = "" if complete else "the conditions leave the drive phase open here"
    return [_state(found, k) for k in range(len(found))], reason


def _lost(motion: PeriodicMotion) -> bool:
    x1, v1, v2, _ = motion.state
    size = abs(v1) + abs(v2) + motion.system.drive_frequency * abs(x1)
    return abs(motion.approach_velocity) <= LOST * size


def _in(box: tuple[float, float], x1: float) -> bool:
    slack = SLACK * max(1.0, abs(x1))
    return box[0] - slack <= x1 <= box[1] + slack


def _limits(within: Any) -> tuple[float, float]:
    allowed = "a pair (lo, hi) of finite angles, lo < hi"
    try:
        lo, hi = (float(end) for end in within)
    except (TypeError, ValueError):
        reject("within", within, allowed)
    if not (math.isfinite(lo) and math.isfinite(hi) and lo < hi and hi - lo <= 2 * LARGEST_ANGLE):
        reject("within", within, allowed)
    return lo, hi


def _check(system: System) -> None:
    if system.friction != 0.0:
        reject(
            "friction",
            system.friction,
            "0: these solutions are those without friction; use search_motions or run.refine",
        )
    if system.drive_frequency == 0.0:
        reject("drive_frequency", 0.0, "a finite number > 0: a period needs a drive")
    if system.moment_amplitude == 0.0 and system.force_amplitude == 0.0:
        reject(
            "moment_amplitude", 0.0, "a moment or a force other than 0: without drive there is no n"
        )
