"""Periodic motions from simulations: Newton's method on the conditions of periodicity.

A simulation gives the sequence of events of one orbit; with this sequence held fixed, nodes and
event times are found by Newton's method with exact derivatives (theory page, section 7), stable
or not.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._core import Leg
from ..arguments import count, reject, state, states
from ..continuation.newton import solve
from ..errors import Interrupted, StateError
from ..interruption import interruptible
from ..machine_kinds import need_system
from ..run import Run
from ..simulation import refuse_overlap, simulated
from ..structure import Structure
from ..structure_motion import StructureOrbit
from ..structure_run import StructureRun
from ..system import System
from .found import MotionSearch, NotFound, not_periodic
from .motion import SAME_ORBIT, PeriodicMotion, same_orbit, size_of
from .problem import OrbitProblem
from .verdict import motion_of

Array = NDArray[np.float64]
Motion = PeriodicMotion | StructureOrbit

_DRIVEN = "a finite number > 0: a periodic motion needs a drive period"

# Events of two orbits after which the search for their sequence is given up.
_MAX_EVENTS = 1_000_000
# A run this close to an unstable motion started on it: it cannot get there by itself.
SETTLED = 1e-6
# Drive periods by which a run that has not settled yet is continued.
_FURTHER = (0, 2000, 8000)
# Starts of a search that are simulated together; Ctrl-C loses at most so many.
BATCH = 256
# Half widths of the box from which a search starts (theory page, E9).
START_BOX = (0.3, 1.0, 0.2, 1.0)


def solve_orbit(
    system: System, itinerary: _core.Itinerary, nodes: Array
) -> PeriodicMotion | NotFound:
    """Solve the conditions of periodicity for this sequence of legs, starting from these nodes."""
    problem = OrbitProblem(system, itinerary)
    found, report = solve(problem, nodes.ravel(), np.empty(0))
    if not report.converged:
        return NotFound(reason=f"Newton's method: {report.outcome}")
    return motion_of(system, itinerary, found.reshape(-1, 4), error=report.error)


@interruptible
def periodic_motion(
    system: System, *, initial: ArrayLike, periods: int
) -> PeriodicMotion | NotFound:
    """Find the periodic motion near a state.

    Parameters
    ----------
    system
        The system; drive_frequency > 0.
    initial
        State (x1, v1, x2, v2) at t = 0 close to the motion. A simulation from here gives the
        sequence of events; the motion itself may be unstable.
    periods
        Drive periods m per orbit.

    Returns
    -------
    PeriodicMotion or NotFound
        The motion, to rounding, with its verdict; or why there is none.

    Raises
    ------
    ParameterError, StateError
        For bad input.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    >>> motion = vi.periodic_motion(system, initial=run.final_state.state, periods=1)
    >>> motion.label, motion.stability
    ('1-1', 'stable')
    """
    need_system(system)
    start = state(initial)
    periods = count("periods", periods, least=1, most=100_000)
    _driven(system)
    found, reason = _core.Itinerary.follow(system._compiled, start, periods, _MAX_EVENTS)
    if found is None:
        return NotFound(reason=reason)
    itinerary, nodes = found
    if itinerary.legs == [Leg.CIRCUIT] and periods > 1:
        # Without events the motion repeats with the drive; over more periods of an undamped system
        # the conditions may be singular.
        itinerary = _core.Itinerary([Leg.CIRCUIT], 1, None, itinerary.wall_at_rest)
    return solve_orbit(system, itinerary, nodes)


def refine(run: Run) -> PeriodicMotion | NotFound:
    """Find the periodic motion that a run has settled on, to rounding; see ``Run.refine``.

    A label can predict the motion on which a run settles while the run is still far from it
    (``run.period.evidence``). Newton's method may then find another motion, and the run is
    continued.
    """
    _driven(run.system)
    period, label = run.period, run.label
    if period.m is None:
        return not_periodic(run)
    end = run.final_state
    if end.time_in_period > 0.0:
        # Continue to the start of the next drive period.
        run = run.resume(time=run.system.drive_period - end.time_in_period)
    for further in _FURTHER:
        if further:
            run = run.resume(periods=further, keep=0)
        motion = periodic_motion(run.system, initial=run.final_state.state, periods=period.m)
        if not isinstance(motion, PeriodicMotion) or (motion.m, motion.n) != (period.m, period.n):
            continue
        if motion.stable or _distance(motion, run.final_state.state) < SETTLED:
            return motion
    if isinstance(motion, PeriodicMotion):
        return NotFound(reason=f"Newton's method does not find the run's {label} motion")
    return motion


def _distance(motion: Motion, state: ArrayLike) -> float:
    """Distance of a state at the start of a drive period from a motion, as part of its size."""
    off = np.abs(motion.sections - np.asarray(state)).reshape(motion.m, -1)
    return float(off.max(axis=1).min()) / size_of(motion.sections)


@overload
def search_motions(
    system: System,
    *,
    starts: int | ArrayLike = ...,
    periods: int = ...,
    seed: int = ...,
    workers: int | None = ...,
) -> MotionSearch[PeriodicMotion]: ...


@overload
def search_motions(
    system: Structure,
    *,
    starts: ArrayLike,
    periods: int = ...,
    seed: int = ...,
    workers: int | None = ...,
) -> MotionSearch[StructureOrbit]: ...


@interruptible
def search_motions(
    system: System | Structure,
    *,
    starts: int | ArrayLike = 64,
    periods: int = 2000,
    seed: int = 0,
    workers: int | None = None,
) -> MotionSearch[Any]:
    """Find the periodic motions that random or given starts settle on, with their basin shares.

    Parameters
    ----------
    system
        The System or Structure; drive_frequency > 0.
    starts
        Number of random starts, uniform in x1 +-0.3, x1' +-1, x2 +-0.2, x2' +-1 about the
        equilibrium under the constant loads (about 0 where the bodies have no room there; those in
        which the bodies overlap are drawn anew), or initial states, shape (k, 4). Of a structure
        initial states, (k, 2, N): it has no usual box.
    periods
        Drive periods that each start is given to settle.
    seed
        Of the random starts.
    workers
        Threads; default one per core.

    Returns
    -------
    MotionSearch
        Motions, each to rounding, and shares.

    Raises
    ------
    ParameterError, StateError
        For bad input.
    Interrupted
        After Ctrl-C; ``.result`` is the MotionSearch, the share of the starts not yet judged being
        ``others["pending"]``.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> search = vi.search_motions(system, starts=16, periods=200)
    >>> search.motions[0].label
    '1-1'
    """
    if not isinstance(system, Structure):
        _driven(system)
    elif system.drive_frequency == 0.0:
        reject("drive_frequency", 0.0, _DRIVEN)
    periods = count("periods", periods, least=8)
    seed = count("seed", seed, least=0)
    if isinstance(system, Structure):
        if not hasattr(starts, "__len__"):
            reject("starts", starts, "initial states, (k, 2, N): a structure has no usual box")
        try:
            given = system._starts(starts)
        except StateError as error:
            raise StateError(f"starts: {error}") from None
        begins = given.reshape(-1, 2, system.coordinates)
        _check_starts(system, begins, single=given.ndim == 2)
    elif not hasattr(starts, "__len__"):
        number = count("starts", starts, least=1, most=1_000_000)
        begins = _random_starts(system, number, seed)
    else:
        given = states(starts, "starts")
        begins = np.atleast_2d(given)
        _check_starts(system, begins, single=given.ndim == 1)
    motions: list[Motion] = []
    # For each start, in order: the number of its motion, or why it has none.
    ends: list[int | str] = []
    try:
        for first in range(0, len(begins), BATCH):
            for run in simulated(
                system,
                initial=begins[first : first + BATCH],
                periods=periods,
                keep=min(periods, 200),
                workers=workers,
            ):
                ends.append(_end(run, motions))
    except KeyboardInterrupt:  # Interrupted is a KeyboardInterrupt
        raise Interrupted(
            f"interrupted after {len(ends)} of {len(begins)} starts",
            _searched(begins, motions, ends),
            holds="them",
        ) from None
    return _searched(begins, motions, ends)


def _check_starts(system: System | Structure, begins: Array, *, single: bool) -> None:
    """Refuse no starts at all, and those in which the bodies overlap or a stop is penetrated."""
    if not len(begins):
        reject("starts", [], "at least one initial state")
    for row, begin in enumerate(begins.tolist()):
        try:
            refuse_overlap(system, begin)
        except StateError as error:
            raise StateError(f"{'starts' if single else f'starts[{row}]'}: {error}") from None


def _end(run: Run | StructureRun, motions: list[Motion]) -> int | str:
    """Return the number of the motion a run has settled on, which may be a new one, or why not."""
    known = _known(run, motions)
    if known is not None:
        return known
    motion = run.refine() if run.stop_reason in ("completed", "rest") else None
    if not isinstance(motion, PeriodicMotion | StructureOrbit) or not motion.admissible:
        label = run.label if run.stop_reason == "completed" else run.stop_reason
        return label if motion is None or run.period.m is None else "unresolved"
    for k, other in enumerate(motions):
        if same_orbit(motion, other):
            return k
    motions.append(motion)
    return len(motions) - 1


def _searched(
    begins: Array, motions: Sequence[Motion], ends: Sequence[int | str]
) -> MotionSearch[Any]:
    """Return the motions of the starts, the most frequent first; others count as pending."""
    reached = np.full(len(begins), -1, dtype=np.int64)
    others: Counter[str] = Counter()
    for i, end in enumerate(ends):
        if isinstance(end, int):
            reached[i] = end
        else:
            others[end] += 1
    if len(ends) < len(begins):
        others["pending"] = len(begins) - len(ends)
    counts = np.bincount(reached[reached >= 0], minlength=len(motions))
    order = np.argsort(-counts, kind="stable")
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    reached = np.where(reached >= 0, rank[reached] if len(rank) else -1, -1)
    return MotionSearch(
        motions=tuple(motions[k] for k in order),
        shares=counts[order] / len(begins),
        others={name: number / len(begins) for name, number in others.items()},
        starts=begins,
        reached=reached,
    )


def _known(run: Run | StructureRun, motions: Sequence[Motion]) -> int | None:
    """The motion on which a run has settled, if it is among these."""
    for k, motion in enumerate(motions):
        if run.period.m != motion.m or run.period.n != motion.n:
            continue
        if _distance(motion, run.final_state.state) < SAME_ORBIT:
            return k
    return None


def _random_starts(system: System, number: int, seed: int) -> Array:
    """Uniform states of the box in which the bodies do not overlap."""
    # A load that presses the bodies together has its equilibrium where they overlap.
    for middle in dict.fromkeys((_equilibrium(system), (0.0, 0.0, 0.0, 0.0))):
        random = np.random.default_rng(seed)
        kept = np.empty((0, 4))
        for _ in range(1000):
            drawn = middle + random.uniform(-1.0, 1.0, (2 * number, 4)) * START_BOX
            kept = np.concatenate([kept, drawn[system.gap_function(drawn) < 0.0]])
            if len(kept) >= number:
                return kept[:number]
    reject("gap", system.gap, "a gap that leaves room for the bodies around x1 = x2 = 0")


def _equilibrium(system: System) -> tuple[float, float, float, float]:
    """Return the state of rest under the constant loads; x1 = 0 of a body 1 that has none."""
    stiffness, x1 = system.frequency_ratio**2, 0.0
    if stiffness > 0.0 and math.isfinite(system.static_moment / stiffness):
        x1 = system.static_moment / stiffness
    return x1, 0.0, system.static_force, 0.0


def _driven(system: System) -> None:
    need_system(system)
    if system.drive_frequency == 0.0:
        reject("drive_frequency", 0.0, _DRIVEN)
