"""Solutions of the conditions of periodicity of many systems at once, and where they can lie."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .algebraic import Conditions, Parameters
from .intervals import Interval, isolate

Array = NDArray[np.float64]

# Boxes of x1 with which a search begins are this wide.
_FIRST_BOX = math.pi / 16
# A bound of |x1| above this counts as no bound.
LARGEST_ANGLE = 1e3
# An approach velocity below this part of the other velocities is lost in rounding.
_LOST = 1e-12
UNBOUNDED = "x1 has no bound, or one beyond 1,000: |x1| <= pi is searched"


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


def lost(
    omega: ArrayLike, approach_velocity: ArrayLike, x1: ArrayLike, v1: ArrayLike, v2: ArrayLike
) -> NDArray[np.bool_]:
    """Whether the approach velocity is lost in the rounding of the others."""
    size = np.abs(v1) + np.abs(v2) + np.asarray(omega) * np.abs(x1)
    return np.asarray(np.abs(approach_velocity) <= _LOST * size)


@dataclass(frozen=True)
class Reach:
    """Where the solutions of a system can lie.

    Attributes
    ----------
    bound
        Largest |x1| that is to be searched.
    bounded
        Whether no solution can lie beyond.
    empty
        Whether the system is known to have no isolated solutions.
    note
        What is special about the system; mostly ``""``.
    """

    bound: float
    bounded: bool
    empty: bool
    note: str


# Beyond the range of floats an interval is the whole line, or NaN, which decides nothing.
@np.errstate(over="ignore", invalid="ignore")
def solve_many(
    equations: Conditions, systems: NDArray[np.int64], lo: Array, hi: Array
) -> Solutions:
    """Isolate all solutions of the systems of these numbers with x1 in [lo, hi], one interval each.

    Numbers and ends have shape (k,), the numbers rise.
    """
    boxes = np.maximum(np.ceil((hi - lo) / _FIRST_BOX).astype(np.int64), 1)
    row = np.repeat(np.arange(len(lo)), boxes)
    place = np.arange(len(row)) - np.repeat(np.cumsum(boxes) - boxes, boxes)
    width = ((hi - lo) / boxes)[row]
    left = np.where(place == 0, lo[row], lo[row] + place * width)
    last = place == boxes[row] - 1
    right = np.where(last, hi[row], lo[row] + (place + 1) * width)
    roots = isolate(equations.enclose, systems[row], Interval(left, right))
    x1 = np.where(roots.isolated, roots.box.middle, np.nan)
    unknowns = np.full((len(roots), 5), np.nan)
    matrix, rhs = equations.linear(roots.which[roots.isolated], Interval(x1[roots.isolated]))
    unknowns[roots.isolated] = np.linalg.solve(matrix.middle, rhs.middle[..., None])[..., 0]
    return states_before(equations, roots.which, roots.box, roots.isolated, x1, unknowns)


def states_before(
    equations: Conditions,
    which: NDArray[np.int64],
    box: Interval,
    isolated: NDArray[np.bool_],
    x1: Array,
    unknowns: Array,
) -> Solutions:
    """Return the states before the impact of solutions (V, W, P, cos psi, sin psi)."""
    parameters = equations.parameters
    kappa = parameters.slope(x1)
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


def nodes_after(
    parameters: Parameters, which: NDArray[np.int64], x1: Array, v1: Array, v2: Array, phase: Array
) -> Array:
    """Return the nodes (x1, v1, v2, t) just after the impacts of solutions, shape (k, 4)."""
    mbar, omega = parameters.mass_ratio[which], parameters.drive_frequency[which]
    kappa = parameters.slope(x1)
    # Newton's law, also for a solution whose bodies separate: `impact` refuses those.
    impulse = (1.0 + parameters.restitution[which]) * (kappa * v1 - v2) / (mbar + kappa**2)
    period = 2.0 * np.pi / omega
    time = np.fmod((phase - parameters.phase[which]) / omega, period) % period
    # A time just below zero becomes the period itself.
    time = np.where(time < period, time, 0.0)
    return np.stack([x1, v1 - kappa * impulse, v2 + mbar * impulse, time], axis=1)


# Beyond the range of floats an interval is the whole line, or NaN, which decides nothing.
@np.errstate(over="ignore", invalid="ignore")
def reach_of(equations: Conditions) -> list[Reach]:
    """Bound |x1| over all solutions, for each system.

    With a, b displacement and velocity before a unit kick of a body kicked once in n periods and p
    its steady response about its equilibrium e, periodicity says x1 = e1 + p1 - a1 kappa P,
    y = e2 + p2 + a2 mbar P and

        (kappa^2 s1 + mbar s2) P = -(kappa p1' - p2')',    s = 1/(1+r) + b >= 0,

    since a passive body takes work from its kicks, b >= -1/2. So in oblique contact
    |kappa P| <= |p1|/s1 + |p2|/(2 sqrt(s1 mbar s2)), and
    |P| <= (1 + |delta| + |e2| + |p2|)/|a2 mbar|; the smaller one bounds x1. Direct contact: Nc and
    Ns are linear in x1, D is constant, |N| <= |D|.
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
        height = np.abs(par.gap) + np.abs(second.equilibrium) + p2
        wall = np.where(height < 1.0, (p1 + p2 / np.sqrt(1.0 - height**2)) / s1, np.inf)
        weighed = np.where(par.is_wall & ~still, wall, weighed)
        limited = (1.0 + height) / (a2.smallest * par.mass_ratio)
        # A resonant body 2 is stopped by the impulse that the drive feeds into it in n periods.
        fed = np.where(second.returns, second.gv.largest / par.mass_ratio, np.inf)
        impulse = np.fmin(np.fmin(weighed, limited), fed)
        bound = (np.abs(first.equilibrium) + p1 + a1.largest * impulse) * (1.0 + 1e-12)
        if not par.oblique:
            bound = _direct_reach(equations)
    result = []
    for k in range(len(par)):
        nothing = _without_solutions(equations, k)
        if nothing:
            result.append(Reach(0.0, True, True, nothing))
        elif par.frequency_ratio[k] == 0.0 and par.oblique:
            result.append(Reach(math.pi, False, False, "free rotor: all repeats with x1 + 2 pi"))
        elif bound[k] <= LARGEST_ANGLE:
            result.append(Reach(float(bound[k]), True, False, ""))
        else:
            result.append(Reach(math.pi, False, False, UNBOUNDED))
    return result


def _direct_reach(equations: Conditions) -> Array:
    gap = np.abs(equations.parameters.gap)
    d = equations.d[0] + equations.d[1] + equations.d[2]
    reach = np.full(len(gap), np.inf)
    for p, q, s in (equations.cosine, equations.sine):
        q_all, s_all = q[0] + q[1] + q[2], s[0] + s[1] + s[2]
        slope = p[0] + p[1] + p[2] + q_all
        most = d.largest + gap * q_all.largest + s_all.largest
        reach = np.fmin(reach, most / slope.smallest)
    return reach * (1.0 + 1e-12)


def _without_solutions(equations: Conditions, k: int) -> str:
    """Say why a system has no isolated solutions; "" if it may have."""
    par = equations.parameters
    omega, moment, force = (
        column[k] for column in (par.drive_frequency, par.moment_amplitude, par.force_amplitude)
    )
    if moment == 0.0 and force == 0.0:
        return "no isolated solutions: nothing drives the system"
    # Over whole turns a body keeps what an impact gives it, unless resonance takes it away.
    if equations.first.returns[k] and (moment == 0.0 or par.frequency_ratio[k] != omega):
        return "no isolated solutions: the undamped pendulum swings a whole number of times"
    resonant = force != 0.0 and omega == 1.0 and not par.is_wall[k]
    if equations.second.returns[k] and not resonant:
        return "no isolated solutions: the undamped body 2 swings a whole number of times"
    if par.frequency_ratio[k] == 0.0 and par.static_moment[k] == 0.0 and not par.oblique:
        return "no solutions: nothing brings the free body 1 back"
    return ""
