"""A periodic motion with its verdict: is it real, is it stable.

A motion is a sequence of legs (flights to an impact in a given regime, chatter, slides, sticks) and
the nodes at which they start; both come from the kernels in the compiled core (`_core.Itinerary`).
An algebraic solution of the conditions of periodicity is a motion only if it is *admissible*: the
bodies approach before each impact, do not overlap in between, and every leg ends as it is said to
(docs/theory.md, section 8). Its Floquet multipliers are the eigenvalues of the derivative of the
return map (section 7).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..arguments import vector
from ..fixed_arrays import FixedArrays
from ..simulation import simulate
from ..system import System

Array = NDArray[np.float64]

# Columns of PeriodicMotion.impacts.
IMPACT_DTYPE = np.dtype(
    [
        (name, "<f8")
        for name in ("time", "x1", "v1_pre", "v1_post", "x2", "v2_pre", "v2_post", "phase")
    ]
    + [("regime", "<i8"), ("approach_velocity", "<f8")]
)
REGIMES = (
    "frictionless",
    "slip",
    "reversal_approach",
    "reversal_restitution",
    "stick_approach",
    "stick_restitution",
)
# A simulation over one orbit must come back this closely, times the largest growth on the way.
CLOSES = 1e-7
# An event this part of a drive period from its start is too close for a simulation to begin there.
NEAR_EVENT = 1e-9
# A multiplier this close to the unit circle is on it: those of undamped free motion are, but for
# rounding.
NEUTRAL = 1e-12
# A test function this close to zero is on its border.
ON_BORDER = 1e-12
# Events of one orbit after which a simulation that checks it is given up.
MAX_EVENTS = 100_000


@dataclass(frozen=True, kw_only=True, eq=False)
class PeriodicMotion(FixedArrays):
    """A solution of the conditions of periodicity, and whether it is a motion.

    Attributes
    ----------
    system
        The system.
    m, n
        Drive periods and impacts per orbit; n is ``math.inf`` with complete chatter.
    legs
        What happens, leg by leg, in order of time.
    nodes
        States (x1, v1, v2, t) just after the events at which the legs start, shape (legs, 4): t is
        the time in the drive period, x2 follows from g = 0. A motion without events has one node
        (x1, v1, v2, x2) at the start of a drive period.
    clocks
        Completed drive periods at the nodes.
    multipliers
        Floquet multipliers, complex, by falling modulus, shape (4,); of a wall at rest, which is
        left out, those of body 1, shape (2,). They are those of the solution whether or not it is
        admissible.
    stable
        Whether it is a motion, and all multipliers lie inside the unit circle.
    admissible, why_not
        Whether it is a motion of the system, and if not the first reason, else ``""``.
    residual
        Largest residual of the conditions of periodicity.
    error
        Estimated error of the nodes relative to the motion's size: Newton's last step.
    paper_eigenvalues, paper_stable
        What Han, Jin & Hu (2004), eqs. (42)-(45), take for the multipliers, and their verdict; None
        but for the motions of ``periodic_motions``. Their matrix is not the derivative of the
        return map (docs/theory.md, E5).
    """

    system: System
    m: int
    n: int | float
    legs: tuple[str, ...]
    nodes: Array
    clocks: tuple[int, ...]
    wall_at_rest: bool
    multipliers: NDArray[np.complex128]
    stable: bool
    admissible: bool
    why_not: str
    residual: float
    error: float
    paper_eigenvalues: NDArray[np.complex128] | None = None
    paper_stable: bool | None = None

    @property
    def label(self) -> str:
        """The motion in a word, m-n: ``"1-1"``, ``"4-5"``, ``"1-inf"``, ``"1-0"``."""
        return f"{self.m}-{self.n}"

    @cached_property
    def itinerary(self) -> _core.Itinerary:
        """The legs as the compiled core takes them."""
        return _core.Itinerary(list(self.legs), self.m, list(self.clocks), self.wall_at_rest)

    @property
    def state(self) -> tuple[float, float, float, float]:
        """(x1, v1, v2, phase) just before the first impact; phase in (-pi, pi].

        Of a motion without impacts, at the start of a drive period.
        """
        if not len(self.impacts):
            x1, v1, v2, _ = self.nodes[0].tolist()
            return x1, v1, v2, _wrapped(self.system.phase)
        first = self.impacts[0]
        return (
            float(first["x1"]),
            float(first["v1_pre"]),
            float(first["v2_pre"]),
            _wrapped(float(first["phase"])),
        )

    @property
    def approach_velocity(self) -> float:
        """Approach velocity u before the first impact; NaN without impacts."""
        return float(self.impacts["approach_velocity"][0]) if len(self.impacts) else math.nan

    @cached_property
    def max_gap(self) -> float:
        """Largest local maximum of the gap g inside the flights; ``-inf`` where there is none.

        Positive: the bodies overlap there.
        """
        humps = self.itinerary.humps(self.system._compiled, self.nodes)
        return max((hump[1] for hump in humps if hump is not None), default=-math.inf)

    @cached_property
    def impacts(self) -> NDArray[np.void]:
        """Impacts of one orbit but those of chatter, in order of time: structured array.

        Columns ``time`` (in [0, m T)), ``x1, v1_pre, v1_post, x2, v2_pre, v2_post, phase, regime,
        approach_velocity``.
        """
        before = self.itinerary.before_events(self.system._compiled, self.nodes)
        rows = []
        for i, leg in enumerate(self.legs):
            if not leg.startswith("impact"):
                continue
            after = (i + 1) % len(self.legs)
            x1, v1, x2, v2 = before[i]
            _, v1_post, v2_post, time = self.nodes[after]
            phase = math.fmod(self.system.drive_frequency * time + self.system.phase, math.tau)
            rows.append(
                (
                    (self.clocks[after] % self.m) * self.system.drive_period + time,
                    *(x1, v1, v1_post, x2, v2, v2_post, phase % math.tau),
                    REGIMES.index(leg.split(":")[1]),
                    float(self.system.gap_rate(before[i])),
                )
            )
        rows.sort()
        result = np.array(rows, dtype=IMPACT_DTYPE)
        result.flags.writeable = False
        return result

    @cached_property
    def return_map(self) -> Array:
        """Derivative of the return map of (x1, v1, v2, t) just after the first node, shape (4, 4).

        The product of the legs' derivatives; its eigenvalues are the multipliers. A motion without
        events has its map of (x1, v1, v2, x2) over m drive periods.
        """
        return monodromy(self.itinerary, self.system, self.nodes)

    @cached_property
    def determinant(self) -> float:
        """Product of the multipliers, from the determinants of the legs' derivatives."""
        legs = self.itinerary.transfer(self.system._compiled, self.nodes)
        return math.prod(float(np.linalg.det(reduced(leg, self.itinerary))) for leg in legs)

    @cached_property
    def initial(self) -> tuple[float, float, float, float]:
        """State (x1, v1, x2, v2) at t = 0, as ``simulate(initial=...)`` takes it."""
        x1, v1, x2, v2 = self.sections[0].tolist()
        return x1, v1, x2, v2

    @cached_property
    def sections(self) -> Array:
        """States x1, v1, x2, v2 at the starts of the m drive periods, shape (m, 4)."""
        period = self.system.drive_period
        return self.trajectory(np.arange(self.m) * period)

    def trajectory(self, t: ArrayLike) -> Array:
        """Return the states x1, v1, x2, v2 at times ``t``, which may lie anywhere.

        They are those of the solution, whether or not it is admissible. During chatter of a motion
        that is not admissible they are NaN.

        Parameters
        ----------
        t
            Times, shape (k,); the orbit repeats after m drive periods.

        Returns
        -------
        array, shape (k, 4)
        """
        times = vector("t", t)
        period = self.system.drive_period
        if self.legs[0] == "circuit":
            return np.array([self._in_leg(0, time % (self.m * period)) for time in times])
        starts = self._node_times()
        states = np.empty((len(times), 4))
        for k, time in enumerate(times):
            place = math.fmod(time - starts[0], self.m * period)
            place = place + self.m * period if place < 0.0 else place
            leg = int(np.searchsorted(starts - starts[0], place, side="right")) - 1
            states[k] = self._in_leg(leg, place - (starts[leg] - starts[0]))
        return states

    def _node_times(self) -> Array:
        """Times of the nodes, rising, the first in the first orbit."""
        return np.array(self.clocks) * self.system.drive_period + self.nodes[:, 3]

    def _in_leg(self, leg: int, time: float) -> tuple[float, float, float, float]:
        if self.legs[leg] == "chatter" and time > 0.0:
            return self._in_chatter(leg, time)
        state = self.itinerary.state_in_leg(self.system._compiled, self.nodes, leg, time)
        return state or (math.nan,) * 4

    def _in_chatter(self, leg: int, time: float) -> tuple[float, float, float, float]:
        start = self.itinerary.state_in_leg(self.system._compiled, self.nodes, leg, 0.0)
        if start is None:
            return (math.nan,) * 4
        ahead = self.system.drive_frequency * float(self.nodes[leg, 3])
        shifted = self.system.replace(phase=self.system.phase + ahead)
        return simulate(shifted, initial=start, time=time).final_state.state

    def __repr__(self) -> str:
        """Label, verdict and the largest multiplier."""
        verdict = "admissible" if self.admissible else "not admissible"
        verdict += ", stable" if self.stable else ", unstable"
        return (
            f"<PeriodicMotion {self.label}, {verdict}, |lambda| = {abs(self.multipliers[0]):.6g}>"
        )


def monodromy(itinerary: _core.Itinerary, system: System, nodes: Array) -> Array:
    """Return the derivative of the return map, the product of those of the legs."""
    product = np.eye(4)
    # A leg that cannot be followed has NaN, one that ends in a graze infinity.
    with np.errstate(all="ignore"):
        for leg in itinerary.transfer(system._compiled, nodes):
            product = leg @ product
    return product


def reduced(matrix: Array, itinerary: _core.Itinerary) -> Array:
    """Leave out a wall at rest: its states, and x1, which cannot vary on it."""
    if not itinerary.wall_at_rest:
        return matrix
    kept = [0, 1] if itinerary.legs == ["circuit"] else [1, 3]
    return matrix[np.ix_(kept, kept)]


def motion_of(
    system: System,
    itinerary: _core.Itinerary,
    nodes: Array,
    *,
    error: float = 0.0,
    whole: bool = False,
    **paper: Any,
) -> PeriodicMotion:
    """Build the motion of a converged solution, with its multipliers and verdict.

    Unless asked for as a ``whole``, an orbit that repeats itself is cut down to one run, and begins
    with its first event.
    """
    if whole:
        nodes = nodes.copy()
    else:
        itinerary, nodes = _in_order(system, *primitive(system, itinerary, nodes))
    matrix = reduced(monodromy(itinerary, system, nodes), itinerary)
    finite = bool(np.isfinite(matrix).all())
    multipliers = np.linalg.eigvals(matrix) if finite else np.full(len(matrix), np.nan)
    order = np.lexsort((-multipliers.imag, -np.round(np.abs(multipliers), 13)))
    multipliers = multipliers[order].astype(np.complex128)
    residual, _ = itinerary.residual(system._compiled, nodes)
    chatters = "chatter" in itinerary.legs
    impacts = sum(leg.startswith("impact") for leg in itinerary.legs)
    for array in (nodes, multipliers):
        array.flags.writeable = False
    fields: dict[str, Any] = {
        "system": system,
        "m": itinerary.periods,
        "n": math.inf if chatters else impacts,
        "legs": tuple(itinerary.legs),
        "nodes": nodes,
        "clocks": tuple(itinerary.clocks),
        "wall_at_rest": itinerary.wall_at_rest,
        "multipliers": multipliers,
        "residual": float(np.abs(residual).max()),
        "error": error,
        **paper,
    }
    solution = PeriodicMotion(**fields, stable=False, admissible=False, why_not="")
    reason = why_not(solution)
    stable = not reason and bool(np.abs(multipliers).max() < 1.0 - NEUTRAL)
    return PeriodicMotion(**fields, stable=stable, admissible=not reason, why_not=reason)


def why_not(motion: PeriodicMotion) -> str:
    """Return why a solution is no motion of its system, ``""`` if it is one.

    First every condition of its legs; then a simulation over one orbit, whose contact search has a
    guarantee, must pass the same events and come back.
    """
    if not np.isfinite(motion.multipliers).all():
        return "a leg cannot be followed"
    # Said at once: the maxima of the gap take longer to find.
    for u in motion.impacts["approach_velocity"]:
        if not u > 0.0:
            return f"separating before the impact (u = {u:.3g})"
    tests = motion.itinerary.tests(motion.system._compiled, motion.nodes)
    for kind, leg, name, value, _ in sorted(tests, key=lambda test: test[0] != "grazing"):
        # On a border between regimes the motion is one of both, and of a graze.
        if value > (0.0 if name == "u" else -ON_BORDER):
            continue
        if name == "u":
            return f"separating before the impact (u = {value:.3g})"
        if name == "flight":
            return f"the bodies overlap during the flight (gap {-value:.3g})"
        return f"{kind.replace('_', ' ')}: {name} ({value:.3g}, leg {leg})"
    return _simulated_otherwise(motion)


def _simulated_otherwise(motion: PeriodicMotion) -> str:
    moment = _clear_of_events(motion)
    start = motion.trajectory([moment])[0]
    if not np.isfinite(start).all():
        return "the state at the start of a simulation is not defined"
    system = motion.system
    if moment:
        ahead = math.fmod(moment, system.drive_period)
        system = system.replace(phase=system.phase + system.drive_frequency * ahead)
    found, reason = _core.Itinerary.follow(
        system._compiled, tuple(start.tolist()), motion.m, MAX_EVENTS
    )
    if found is None:
        return f"a simulation of it: {reason}"
    legs, own = found[0].legs, list(motion.legs)
    if system.friction == 0.0:
        legs, own = _without_friction(legs), _without_friction(own)
    legs, own = _significant(legs), _significant(own)
    if not any(legs[i:] + legs[:i] == own for i in range(len(legs))):
        return "a simulation of it passes other events"
    end = simulate(system, initial=start, periods=motion.m, keep=0).final_state
    growth = max(1.0, float(np.abs(motion.return_map).max()))
    scale = max(1.0, float(np.abs(start).max()))
    off = float(np.abs(np.array(end.state) - start).max())
    if off > CLOSES * scale * growth:
        return f"a simulation of it does not come back (by {off:.1e})"
    return ""


def _without_friction(legs: list[str]) -> list[str]:
    """Return what is left of legs at mu = 0: neither regimes nor kinds of contact play a part."""
    return [
        leg.split(":")[0] if leg.startswith("impact") else leg.split(":")[-1]
        for leg in legs
        if not leg.startswith(("stick", "slide")) or leg.endswith(":release")
    ]


def _clear_of_events(motion: PeriodicMotion) -> float:
    """Time from which to simulate an orbit: 0, but for an event there.

    A simulation that begins or ends within rounding of an event passes it twice, or never.
    """
    period = motion.system.drive_period
    if (
        motion.legs[0] == "circuit"
        or np.abs(np.remainder(motion.nodes[:, 3] + 0.5 * period, period) - 0.5 * period).min()
        > NEAR_EVENT * period
    ):
        return 0.0
    starts = motion._node_times()
    lengths = np.append(starts[1:], starts[0] + motion.m * period) - starts
    flights = [i for i, leg in enumerate(motion.legs) if leg.startswith("impact")]
    if not flights:
        return 0.0
    longest = max(flights, key=lambda i: float(lengths[i]))
    return float(starts[longest] + 0.5 * lengths[longest])


def _significant(legs: list[str]) -> list[str]:
    """Leave out the impacts that lead into chatter: how many stand alone is a matter of choice."""
    kept: list[str] = []
    for leg in legs + legs:
        if leg == "chatter":
            while kept and kept[-1].startswith("impact"):
                kept.pop()
        kept.append(leg)
    # The second round alone: the first may begin among such impacts.
    chatters = [i for i, leg in enumerate(kept) if leg == "chatter"]
    if not chatters:
        return legs
    return kept[chatters[0] : chatters[len(chatters) // 2]]


def primitive(
    system: System, itinerary: _core.Itinerary, nodes: Array
) -> tuple[_core.Itinerary, Array]:
    """Cut a solution that runs through a shorter orbit several times down to that orbit."""
    legs, count, periods = itinerary.legs, len(itinerary.legs), itinerary.periods
    clocks = itinerary.clocks
    size = np.abs(nodes).max(axis=0) + 1e-3
    if legs == ["circuit"]:
        return itinerary, nodes
    for repeats in range(count, 1, -1):
        if count % repeats or periods % repeats:
            continue
        step, shorter = count // repeats, periods // repeats
        times = np.array(clocks) * system.drive_period + nodes[:, 3]
        shifted = np.roll(nodes, -step, axis=0)
        ahead = np.roll(times, -step)
        ahead[count - step :] += periods * system.drive_period
        same = (
            legs == legs[step:] + legs[:step]
            and np.abs((shifted - nodes)[:, :3] / size[:3]).max() < 1e-8
            and np.abs(ahead - times - shorter * system.drive_period).max() < 1e-8
        )
        if same:
            cut = _core.Itinerary(legs[:step], shorter, clocks[:step], itinerary.wall_at_rest)
            return cut, nodes[:step].copy()
    return itinerary, nodes


def _in_order(
    system: System, itinerary: _core.Itinerary, nodes: Array
) -> tuple[_core.Itinerary, Array]:
    """Begin with the first event of the first drive period."""
    legs, count, periods = itinerary.legs, len(itinerary.legs), itinerary.periods
    nodes = nodes.copy()
    if legs == ["circuit"]:
        return itinerary, nodes
    # Along a branch a node may have moved into another drive period.
    passed = np.floor(nodes[:, 3] / system.drive_period)
    nodes[:, 3] -= passed * system.drive_period
    counted = np.array(itinerary.clocks) + passed.astype(np.int64)
    clocks = (counted % periods).tolist()
    # The nodes are in order of time already; the orbit may begin with any of them.
    first = min(range(count), key=lambda i: (clocks[i], nodes[i, 3]))
    order = [(first + i) % count for i in range(count)]
    turned = [clocks[i] for i in order]
    itinerary = _core.Itinerary([legs[i] for i in order], periods, turned, itinerary.wall_at_rest)
    return itinerary, nodes[order]


def _wrapped(phase: float) -> float:
    """The phase in (-pi, pi]."""
    result = math.remainder(phase, math.tau)
    return math.pi if result == -math.pi else result
