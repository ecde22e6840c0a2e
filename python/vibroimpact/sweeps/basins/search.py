"""Which known attractors starts reach, and the search for unknown attractors.

A run that settles on a periodic motion is refined by Newton's method, and a stable motion gets a
trapping region. A run that neither repeats nor settles is continued for a long time: it may be a
transient.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...orbits.motion import PeriodicMotion
from ...restitution import is_one
from ...simulation import simulated
from ...structure_motion import StructureOrbit
from ...system import System
from ..fields import STATUS_NAMES
from ..machines import machine_of
from .attractors import Attractor, Family, Kind, Tails, flat, same
from .clouds import cloud_of
from .free_motion import never_strike
from .region import Follow, from_core, is_rotor, to_core
from .trapping import arrive, largest_multiplier, trapping_region

Array = NDArray[np.float64]

# A multiplier this close to the unit circle counts as on it: central differences are not more
# accurate.
_ON_UNIT_CIRCLE = 1e-7
# Drive periods by which a motion that does not repeat is continued, and how many are used.
_CONTINUED, _LOOKED_AT = 20_000, 8_000
# With more attractors than this there is a continuum of them, and they are not distinguished.
_MOST = 64
# Starts that are followed at a time.
BATCH = 64
# After so many starts in a row without a known motion the search ends.
_MOST_HOPELESS = 8


@dataclass(frozen=True, eq=False)
class Ends:
    """The known attractors that n starts reached.

    Attributes
    ----------
    status
        Codes: places in ``STATUS_NAMES``, shape (n,).
    attractor
        Number of the attractor, -1 for none, shape (n,).
    periods
        Drive periods until the trapping region was entered, -1 where none was, shape (n,).
    left, tails
        The starts that came to the end of their run on no known attractor, shape (k,), and its
        last sections.
    interrupted
        Whether Ctrl-C ended the work.
    """

    status: NDArray[np.int8]
    attractor: NDArray[np.int64]
    periods: NDArray[np.int64]
    left: NDArray[np.int64]
    tails: Tails
    interrupted: bool


def follow_all(
    system: Any,
    starts: Array,
    attractors: Sequence[Attractor],
    follow: Follow,
    *,
    workers: int | None = None,
    progress: Callable[[int], object] | None = None,
) -> Ends:
    """Follow starts, shape (n, d), until they arrive at attractors; judge the others by tails."""
    trapping = [k for k, attractor in enumerate(attractors) if attractor.region is not None]
    regions = [attractor.region for attractor in attractors if attractor.region is not None]
    inner = to_core(system, starts)
    found = arrive(system, inner, regions, follow, workers=workers, progress=progress)
    number = np.array([*trapping, -1])[found.attractor]
    status, left = found.status, found.left
    tails = Tails(
        sections=from_core(system, found.tails),
        counts=found.counts,
        orbits=np.column_stack([found.m[left], found.n[left]]),
        rested=status[left] == STATUS_NAMES.index("rest"),
    )
    for k, attractor in enumerate(attractors):
        on_it = attractor.holds(tails)
        number[left[on_it]] = k
        left, tails = left[~on_it], tails[~on_it]
    return Ends(status, number, found.periods, left, tails, found.interrupted)


def find_attractors(
    system: Any,
    starts: Array,
    follow: Follow,
    *,
    known: Sequence[Attractor] = (),
    workers: int | None = None,
) -> tuple[Attractor, ...]:
    """Find the attractors of some starts beyond those that are known.

    Starts are examined in their order, if they lead to no attractor found so far. The result does
    not depend on ``workers``.

    Parameters
    ----------
    system
        The system.
    starts
        Initial states, shape (n, d); those in which the bodies overlap are left out.
    follow
        How they are followed.
    known
        Attractors to which those found are added.
    workers
        Threads.

    Returns
    -------
    tuple of Attractor
        The known ones first.
    """
    found = list(known)
    hopeless = 0
    # In batches: once the attractors are known, starts arrive early.
    for first in range(0, len(starts), BATCH):
        batch = starts[first : first + BATCH]
        ends = follow_all(system, batch, found, follow, workers=workers)
        if ends.interrupted:
            raise KeyboardInterrupt
        left, tails = ends.left, ends.tails
        while len(left):
            if hopeless == _MOST_HOPELESS or len(found) == _MOST:
                return tuple(found)
            new = explore(system, batch[left[0]], follow, known=found, workers=workers)
            kept = np.arange(len(left)) > 0
            if new is None:
                hopeless += 1
            elif new not in found:
                hopeless = 0
                found.append(new)
                kept &= ~new.holds(tails)
            left, tails = left[kept], tails[kept]
    return tuple(found)


def explore(
    system: Any,
    start: Array,
    follow: Follow,
    *,
    known: Sequence[Attractor] = (),
    workers: int | None = None,
) -> Attractor | None:
    """Return the attractor of a start: a known one, a new one, or None if it is not decided."""
    run: Any = simulated(
        system,
        initial=start.reshape(machine_of(system).final_state.shape).tolist(),
        periods=follow.periods,
        keep=follow.keep,
        max_events=follow.max_events,
        chatter_tolerance=follow.chatter_tolerance,
    )
    if run.stop_reason in ("completed", "rest") and run.period.m is None:
        if not len(run.impacts) and run.time_in_contact == 0.0:
            if not never_strike(system, flat(run.stroboscopic[-1:])).all():
                return None
            free = _attractor(run, **_family(Family.FREE), system=system)
            return _known_or(free, known)
        run = run.resume(periods=_CONTINUED, keep=_LOOKED_AT)
    if run.stop_reason not in ("completed", "rest"):
        return None
    if run.period.m is not None:
        return _periodic(run, follow, known, workers)
    if run.label not in ("chaotic", "quasi-periodic"):
        return None
    cloud = cloud_of(flat(run.stroboscopic), rotor=is_rotor(system))
    if cloud is None:
        return None
    kind: Kind = "chaotic" if run.label == "chaotic" else "quasi-periodic"
    lossless = _is_lossless(system)
    why_not = "without losses nothing attracts" if lossless else ""
    new = _attractor(run, kind=kind, cloud=cloud, confirmed=not lossless, why_not=why_not)
    return _known_or(new, known)


def _is_lossless(system: Any) -> bool:
    """Whether nothing takes energy."""
    if isinstance(system, System):
        damped = system.pendulum_damping or system.oscillator_damping
        return is_one(system.restitution) and not (system.friction or damped)
    damping = (system.damping, system.damping_ratios)
    damped = any(each is not None and np.any(each) for each in damping)
    return not damped and all(
        is_one(stop.restitution) and not stop.friction for stop in system.stops
    )


def _rubs(system: Any) -> bool:
    """Whether there is friction."""
    if isinstance(system, System):
        return system.friction > 0.0
    return any(stop.friction > 0.0 for stop in system.stops)


def _attractor(run: Any, **more: Any) -> Attractor:
    """Return an attractor found by a run that does not repeat."""
    label = "quasi-periodic" if more["kind"] == "family" else run.label
    return Attractor(label=label, sections=run.stroboscopic, start=_start(run), **more)


def _start(run: Any) -> tuple[Any, ...]:
    start: tuple[Any, ...] = machine_of(run.system).start(run.initial)
    return start


def _family(why: Family) -> dict[str, Any]:
    return {"kind": "family", "family": why, "why_not": str(why)}


def _known_or(new: Attractor, known: Sequence[Attractor]) -> Attractor:
    """Return the known attractor that is the same as this one, or this one."""
    return next((old for old in known if same(new, old)), new)


def _periodic(
    run: Any, follow: Follow, known: Sequence[Attractor], workers: int | None
) -> Attractor:
    """Return the attractor of a run that has a period, confirmed if it can be."""
    m, n = run.period.m, run.period.n
    assert m is not None
    assert n is not None
    # The period may have been detected from more sections than were kept.
    sections = (run.resume(periods=m) if m > len(run.stroboscopic) else run).stroboscopic[-m:]
    new = Attractor(
        label=run.label,
        kind="periodic",
        sections=sections,
        start=_start(run),
        orbit=(m, -1 if math.isinf(n) else int(n)),
        rotor=is_rotor(run.system),
    )
    if run.stop_reason == "rest" and _rubs(run.system):
        return _known_or(replace(new, **_family(Family.AT_REST)), known)
    motion = run.refine()
    if motion and _is_stable(motion):
        found = motion.sections
        new = _known_or(replace(new, sections=found, motion=motion), known)
        if new in known:
            return new
        region = trapping_region(run.system, flat(found), follow, workers=workers)
        why_not = "" if region is not None else "no trapping region was confirmed"
        return replace(new, region=region, confirmed=region is not None, why_not=why_not)
    if abs(largest_multiplier(run.system, flat(sections), follow) - 1.0) <= _ON_UNIT_CIRCLE:
        return _known_or(replace(new, **_family(Family.NOT_ISOLATED)), known)
    if motion:
        unstable = f"unstable, |lambda| = {abs(motion.multipliers[0]):.6g}"
        why = getattr(motion, "why_not", "") or unstable
    else:
        why = motion.reason
    return _known_or(replace(new, why_not=why), known)


def _is_stable(motion: PeriodicMotion | StructureOrbit) -> bool:
    if isinstance(motion, PeriodicMotion):
        return motion.stable
    return motion.stability == "stable"
