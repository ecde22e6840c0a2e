"""All period n-1 motions of a system without friction: n drive periods, one impact.

Orbits page. Every solution of (35) in x1 (in `curved_search` of (x1, u), if the
restitution depends on the approach velocity u) is isolated by intervals, made exact to rounding by
Newton's method on the conditions of periodicity, and given its verdict.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import Leg, Regime
from ..arguments import count, number, pair, reject
from ..errors import Interrupted
from ..interruption import interruptible
from ..machine_kinds import need_system
from ..orbits.motion import PeriodicMotion
from ..orbits.shooting import solve_orbit
from ..orbits.verdict import motion_of
from ..restitution import RestitutionCurve
from ..system import System
from .algebraic import Parameters, conditions
from .curved import Curved, at_constant
from .curved_search import search_curved
from .intervals import Interval
from .open_phase import FIRST
from .results import PeriodicMotions, Undecided
from .solutions import (
    LARGEST_ANGLE,
    lost,
    nodes_after,
    reach_of,
    solve_many,
)
from .starts import Starts, State, starts_in, state_of

Array = NDArray[np.float64]

# Newton's method may move x1 beyond its box by so many units of rounding.
_SLACK = 256.0 * float(np.finfo(float).eps)


@interruptible
def periodic_motions(
    system: System, n: int = 1, *, within: tuple[float, float] | None = None
) -> PeriodicMotions:
    """Find all motions of n drive periods with one impact, by solving (35) in the angle x1.

    Where the restitution depends on the approach velocity, in both together.

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
        (mass_ratio and force_amplitude 0) stays at x2 = static_force.

    Raises
    ------
    ParameterError
        For bad input: friction (use ``search_motions`` or ``run.refine`` there), no drive.
    Interrupted
        After Ctrl-C; ``.result`` holds the solutions found so far, its ``undecided`` the intervals
        that were not examined.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motions = vi.periodic_motions(system)
    >>> [motion.stability for motion in motions if motion.admissible]
    ['unstable', 'unstable', 'stable', 'unstable', 'unstable', 'unstable', 'unstable', 'unstable']
    >>> yields = system.replace(restitution=vi.RestitutionPowerLaw(0.9, 0.05))
    >>> [motion.stability for motion in vi.periodic_motions(yields) if motion.admissible]
    ['stable']
    """
    need_system(system)
    n = count("n", n, least=1, most=100_000)
    check_system(system)
    limits = None if within is None else limits_of(within)
    curved = Curved(system, n) if isinstance(system.restitution, RestitutionCurve) else None
    equations = conditions(Parameters.of(system, n)) if curved is None else curved.all()
    (reach,) = reach_of(equations)
    bounded = reach.bounded
    if limits is None:
        limits = (-reach.bound, reach.bound)
    else:
        bounded = bounded and limits[0] <= -reach.bound and reach.bound <= limits[1]
    common: dict[str, Any] = {"system": system, "n": n, "within": limits}
    common |= {"bounded": bounded, "note": reach.note}
    if reach.empty:
        return PeriodicMotions(motions=(), boxes=np.empty((0, 2)), undecided=(), **common)
    motions: list[PeriodicMotion] = []
    boxes: list[tuple[float, float]] = []
    undecided: list[Undecided] = []

    def result() -> PeriodicMotions:
        order = sorted(range(len(motions)), key=lambda i: motions[i].state)
        return PeriodicMotions(
            motions=tuple(motions[i] for i in order),
            # If Ctrl-C came in between, a box may have no motion yet.
            boxes=np.array(boxes[: len(motions)]).reshape(-1, 2)[order],
            undecided=tuple(undecided),
            **common,
        )

    left = [limits]
    try:
        if curved is None:
            found = solve_many(equations, FIRST, *(np.array([end]) for end in limits))
            left = list(zip(found.box.lo.tolist(), found.box.hi.tolist(), strict=True))
            places = (
                starts_in(equations, found.box[k : k + 1], state_of(found, k))
                for k in range(len(found))
            )
        else:
            all_places = search_curved(curved, *limits)
            left = [place.ends for place in all_places]
            places = (place for place in all_places)
        for place in places:
            inside, reason = motions_in(system, n, place)
            boxes += [left[0]] * len(inside)
            motions += inside
            if reason:
                undecided.append(Undecided(lo=left[0][0], hi=left[0][1], reason=reason))
            del left[0]
    except KeyboardInterrupt:
        undecided += [Undecided(lo=lo, hi=hi, reason="interrupted") for lo, hi in left]
        raise Interrupted(
            "interrupted",
            result(),
            holds=f"{len(motions)} solutions, and where there may be others",
        ) from None
    return result()


# Beyond the range of floats an interval is the whole line, or NaN, which decides nothing.
@np.errstate(over="ignore", invalid="ignore")
def motions_in(system: System, n: int, found: Starts) -> tuple[list[PeriodicMotion], str]:
    """Return the motions in a box of x1, and why there may be others, ``""`` if there are none."""
    motions, reason = [], found.reason
    for start in found.states:
        motion = solve_orbit(system, *_legs(system, n, start))
        if not isinstance(motion, PeriodicMotion) or not _in(found.box, motion.state[0]):
            reason = "Newton's method does not find the solution in it"
        elif bool(lost(system.drive_frequency, motion.approach_velocity, *motion.state[:3])):
            reason = "a solution whose approach velocity is lost in rounding"
        else:
            motions.append(motion)
    return motions, reason


def motion_at(system: System, n: int, state: State) -> PeriodicMotion:
    """Return the motion with this solution (x1, v1, v2, phase) as it is, with its verdict."""
    return motion_of(system, *_legs(system, n, state))


def _legs(system: System, n: int, state: State) -> tuple[_core.Itinerary, Array]:
    """Return the one leg of a motion, and its node just after the impact."""
    parameters = Parameters.of(at_constant(system, state), n)
    (at_rest,) = parameters.at_rest.tolist()
    nodes = nodes_after(parameters, FIRST, *np.array([state]).T)
    return one_impact(n, wall_at_rest=at_rest), nodes


def one_impact(n: int, *, wall_at_rest: bool) -> _core.Itinerary:
    """Return the one leg of a motion with an impact in n drive periods."""
    return _core.Itinerary([Leg.impact(Regime.FRICTIONLESS)], n, None, wall_at_rest)


def _in(box: Interval, x1: float) -> bool:
    slack = _SLACK * max(1.0, abs(x1))
    return bool(box.lo[0] - slack <= x1 <= box.hi[0] + slack)


def limits_of(within: Any) -> tuple[float, float]:
    """Check an interval of x1."""
    allowed = f"a pair (lo, hi) of angles, lo < hi <= lo + {2.0 * LARGEST_ANGLE:g}"
    lo, hi = (number("within", end, allowed) for end in pair("within", within, allowed))
    if not (lo < hi and hi - lo <= 2.0 * LARGEST_ANGLE):
        reject("within", within, allowed)
    return lo, hi


def check_system(system: System) -> None:
    """Reject a system to which these solutions do not apply."""
    check_columns(**{name: np.array([getattr(system, name)]) for name in CHECKED})


CHECKED = ("friction", "drive_frequency", "moment_amplitude", "force_amplitude")


def check_columns(
    friction: Array, drive_frequency: Array, moment_amplitude: Array, force_amplitude: Array
) -> None:
    """Reject systems to which these solutions do not apply."""
    if friction.any():
        reject(
            "friction",
            float(friction[friction != 0.0][0]),
            "0: these solutions are those without friction; use search_motions or run.refine",
        )
    if not drive_frequency.all():
        reject("drive_frequency", 0.0, "a finite number > 0: a period needs a drive")
    if ((moment_amplitude == 0.0) & (force_amplitude == 0.0)).any():
        reject(
            "moment_amplitude", 0.0, "a moment or a force other than 0: without drive there is no n"
        )
