"""All period n-1 motions of a system without friction: n drive periods, one impact (theory, section 8).

Every solution of (35) in x1 is isolated by intervals, made exact to rounding by Newton's method on
the conditions of periodicity, and given its verdict; beside it stands that of the paper, by the
eigenvalues of (42).
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
from .shooting import solve_orbit

Array = NDArray[np.float64]

# Boxes of x1 with which a search begins are this wide.
FIRST_BOX = math.pi / 16
# A bound of |x1| above this counts as none.
LARGEST_ANGLE = 1e4
# Below this ratio of its extreme singular values the linear system leaves the phase open.
OPEN_PHASE = 1e-8
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
        Intervals of x1, shape (motions, 2): each is proved to hold exactly one solution, but for
        those within an undecided interval.
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
    if rests(equations)[0]:
        found = _with_body_two_at_rest(equations, limits)
    else:
        found = solve_many(equations, *(np.array([end]) for end in limits))
    motions: list[PeriodicMotion] = []
    boxes: list[tuple[float, float]] = []
    undecided: list[Undecided] = []
    for k in range(len(found)):
        box = (float(found.box.lo[k]), float(found.box.hi[k]))
        if found.isolated[k]:
            starts = [(found.x1[k], found.v1[k], found.v2[k], found.phase[k])]
            reason = "Newton's method does not find the solution in it"
        else:
            starts, reason = _with_open_phase(equations, box)
        inside = []
        for start in starts:
            motion = _motion(system, equations, start)
            if motion is None or not _in(box, motion.state[0]):
                continue
            if all(_apart(motion, other) for other in inside):
                inside.append(motion)
        if not (found.isolated[k] and inside):
            undecided.append(Undecided(lo=box[0], hi=box[1], reason=reason))
        motions += inside
        boxes += [box] * len(inside)
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
    matrix, rhs = equations.linear(roots.which[roots.isolated], x1[roots.isolated])
    unknowns[roots.isolated] = np.linalg.solve(matrix, rhs[..., None])[..., 0]
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


def rests(equations: Conditions) -> NDArray[np.bool_]:
    """Where body 2 must meet the pendulum at x2 = 0: a wall at rest, or half turns without a force.

    Then (31) is singular for every x1: sigma(x1) = delta, and the phase follows from a quadratic.
    """
    par = equations.parameters
    quarter = np.fmod(2.0 * par.n, par.drive_frequency) == 0.0
    odd = np.fmod(2.0 * par.n / par.drive_frequency, 2.0) == 1.0
    halves = quarter & odd & (par.oscillator_damping == 0.0)
    return (par.force_amplitude == 0.0) & ((par.mass_ratio == 0.0) | halves)


def _with_body_two_at_rest(equations: Conditions, within: tuple[float, float]) -> Solutions:
    """Solve where y = 0. W = mbar P/(1 - B22), so V = alpha P; body 1's rows without P then read

    (h1 kappa' + ...): gamma_c cos psi + gamma_s sin psi = gamma_0.
    """
    par, body = equations.parameters, equations.first
    places: list[float] = []
    delta = float(par.gap[0])
    if not par.oblique:
        places = [delta] if within[0] <= delta <= within[1] else []
    elif abs(delta) < 1.0:
        low, high = within
        for angle in (math.asin(delta), math.pi - math.asin(delta)):
            turns = range(
                math.ceil((low - angle) / math.tau), math.floor((high - angle) / math.tau) + 1
            )
            places += [angle + k * math.tau for k in turns]
    rows: list[tuple[Interval, float, Array, bool]] = []
    for place in sorted(places):
        x = Interval(np.array([place]))._widened(8)
        if not par.oblique:
            x = Interval(np.array([place]))
        kappa = x.cos() if par.oblique else Interval(np.ones(1))
        mbar, r = Interval(par.mass_ratio), Interval(par.restitution)
        rho = r / (1.0 + r)
        push = mbar / equations.second.c22
        alpha = (push - rho * (mbar + kappa.square())) / kappa
        one, two = body.c22 * alpha + kappa, body.a12 * alpha
        cosine = -(one * body.gx.re) - two * body.gv.re
        sine = one * body.gx.im + two * body.gv.im
        constant = two * body.a21 * x - one * body.c11 * x
        size = cosine.square() + sine.square()
        rest = size - constant.square()
        if rest.hi[0] < 0.0:
            continue
        sure = bool(rest.lo[0] > 0.0)
        if not sure:
            rows.append((x, math.nan, np.full(5, np.nan), False))
            continue
        for sign in (-1.0, 1.0):
            across = sign * np.sqrt(rest.middle)
            c = (constant.middle * cosine.middle - across * sine.middle) / size.middle
            s = (constant.middle * sine.middle + across * cosine.middle) / size.middle
            # P from that of body 1's rows in which it weighs more.
            if one.middle[0] ** 2 > two.middle[0] ** 2:
                force = body.gv.re.middle * c - body.gv.im.middle * s
                impulse = (body.a21.middle * place + force) / one.middle
            else:
                force = body.gx.re.middle * c - body.gx.im.middle * s
                impulse = (body.c11.middle * place - force) / two.middle
            v, w = alpha.middle * impulse, push.middle * impulse
            rows.append((x, place, np.concatenate([v, w, impulse, c, s]), True))
    if not rows:
        empty = Interval(np.empty(0))
        nothing = np.empty(0, dtype=np.int64)
        return _solutions(
            equations, nothing, empty, nothing.astype(bool), np.empty(0), np.empty((0, 5))
        )
    box = Interval(
        np.concatenate([row[0].lo for row in rows]), np.concatenate([row[0].hi for row in rows])
    )
    which = np.zeros(len(rows), dtype=np.int64)
    isolated = np.array([row[3] for row in rows])
    x1, unknowns = np.array([row[1] for row in rows]), np.array([row[2] for row in rows])
    return _solutions(equations, which, box, isolated, x1, unknowns)


def _with_open_phase(
    equations: Conditions, box: tuple[float, float]
) -> tuple[list[tuple[float, float, float, float]], str]:
    """Return starts for Newton's method where (31) is singular in a box, and why it is undecided.

    Its solutions at given x1 form a line, which cos^2 + sin^2 = 1 may cut twice.
    """
    middle = 0.5 * (box[0] + box[1])
    which = np.zeros(1, dtype=np.int64)
    matrix, rhs = (item[0] for item in equations.linear(which, np.array([middle])))
    scale = np.abs(matrix).max(axis=1, keepdims=True)
    matrix, rhs = matrix / scale, rhs / scale[:, 0]
    left, sizes, right = np.linalg.svd(matrix)
    if sizes[-1] > OPEN_PHASE * sizes[0]:
        return [], "a double root, or two roots too close to tell apart"
    base = right[:-1].T @ ((left.T @ rhs)[:-1] / sizes[:-1])
    along = right[-1]
    # |base + t along| = 1 in the plane of (cos psi, sin psi).
    a, b = along[3:] @ along[3:], base[3:] @ along[3:]
    rest = b * b - a * (base[3:] @ base[3:] - 1.0)
    reason = "the conditions leave the drive phase open here: there may be further solutions"
    if a == 0.0 or rest < 0.0:
        return [], reason
    starts = []
    for sign in (-1.0, 1.0):
        unknowns = (base + (-b + sign * math.sqrt(rest)) / a * along)[None, :]
        at = np.array([middle])
        found = _solutions(equations, which, Interval(at), np.ones(1, dtype=bool), at, unknowns)
        starts.append((middle, float(found.v1[0]), float(found.v2[0]), float(found.phase[0])))
    return starts, reason


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


def _in(box: tuple[float, float], x1: float) -> bool:
    slack = SLACK * max(1.0, abs(x1))
    return box[0] - slack <= x1 <= box[1] + slack


def _apart(one: PeriodicMotion, other: PeriodicMotion) -> bool:
    difference = np.abs(np.array(one.state) - np.array(other.state))
    difference[3] = abs(math.remainder(difference[3], math.tau))
    return bool(difference.max() > 1e-9)


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
