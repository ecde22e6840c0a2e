"""A periodic motion: a solution of the conditions of periodicity, and whether it is a motion.

A motion is a sequence of legs (flights to an impact in a given regime, chatter, slides, sticks) and
the nodes at which they start; both come from the kernels in the compiled core (`_core.Itinerary`).
An algebraic solution of the conditions of periodicity is a motion only if it is *admissible*: the
bodies approach before each impact, do not overlap in between, and every leg ends in the event that
belongs to it (orbits page). Its Floquet multipliers are the eigenvalues of the
derivative of the return map (theory page, section 7).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._core import Leg
from ..arguments import times_of
from ..interruption import interruptible
from ..repeating import Repeating
from ..showing import Facts
from ..system import System
from ..tables import Table, table
from ..verbs import verb

if TYPE_CHECKING:
    import pandas

    from ..verb_types import Branch

Array = NDArray[np.float64]

# Columns of PeriodicMotion.impacts.
IMPACT_DTYPE = np.dtype(
    [
        (name, "<f8")
        for name in ("time", "x1", "v1_pre", "v1_post", "x2", "v2_pre", "v2_post", "phase")
    ]
    + [("regime", "<i8"), ("approach_velocity", "<f8")]
)
# A multiplier this close to the unit circle counts as on it: those of undamped free motion lie on
# it within rounding.
NEUTRAL = 1e-12
# Two orbits are the same if their sections agree to this part of their size. Newton's method gives
# sections to rounding times the growth of the motion, which this leaves room for.
SAME_ORBIT = 1e-7
# The size of smaller motions, so that those at rest have one.
_LEAST_SIZE = 1e-3


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class PeriodicMotion(Repeating):
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

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> motion.label, motion.stability, motion.admissible
    ('1-1', 'stable', True)
    >>> bool(abs(motion.multipliers).max() < 1)
    True
    """

    _KIND = "motion"

    system: System
    m: int
    n: int | float
    legs: tuple[Leg, ...]
    nodes: Array
    clocks: tuple[int, ...]
    wall_at_rest: bool
    multipliers: NDArray[np.complex128]
    stable: bool
    admissible: bool
    why_not: str
    residual: float
    error: float

    @property
    def stability(self) -> str:
        """The verdict in words: ``stable``, ``unstable``, or ``not admissible``."""
        return ("stable" if self.stable else "unstable") if self.admissible else "not admissible"

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

    def _columns(self) -> dict[str, tuple[str, ...]]:
        return {"impacts": IMPACT_DTYPE.names or ()}

    @cached_property
    def impacts(self) -> Table:
        """Impacts of one orbit, without those of chatter, in order of time: structured array.

        Columns ``time`` (in [0, m T)), ``x1, v1_pre, v1_post, x2, v2_pre, v2_post, phase, regime,
        approach_velocity``.
        """
        before = self.itinerary.before_events(self.system._compiled, self.nodes)
        rows = []
        for i, leg in enumerate(self.legs):
            if leg.regime is None:
                continue
            after = (i + 1) % len(self.legs)
            x1, v1, x2, v2 = before[i]
            _, v1_post, v2_post, time = self.nodes[after]
            phase = math.fmod(self.system.drive_frequency * time + self.system.phase, math.tau)
            rows.append(
                (
                    (self.clocks[after] % self.m) * self.system.drive_period + time,
                    *(x1, v1, v1_post, x2, v2, v2_post, phase % math.tau),
                    int(leg.regime),
                    float(self.system.gap_rate(before[i])),
                )
            )
        rows.sort()
        return table(np.array(rows, dtype=IMPACT_DTYPE))

    @cached_property
    def return_map(self) -> Array:
        """Derivative of the return map of (x1, v1, v2, t) just after the first node, shape (4, 4).

        The product of the legs' derivatives; its eigenvalues are the multipliers. A motion without
        events has its map of (x1, v1, v2, x2) over m drive periods.
        """
        return self.itinerary.return_map(self.system._compiled, self.nodes)

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
            Times, shape (k,), or one time; the orbit repeats after m drive periods.

        Returns
        -------
        array, shape (k, 4), or (4,) for one time

        Examples
        --------
        >>> motion.trajectory([0.0, motion.period / 2]).shape
        (2, 4)
        """
        times, single = times_of("t", t)
        rows = self.itinerary.trajectory(self.system._compiled, self.nodes, times)
        return rows[0] if single else rows

    def follow(self, **options: Any) -> Branch:
        """Follow the motion over a parameter, stable or not: ``vi.follow_motion(motion, ...)``.

        Parameters
        ----------
        **options
            As in ``vi.follow_motion``, with one parameter of the system and its range:
            ``motion.follow(drive_frequency=(1.5, 1.6))``.

        Raises
        ------
        ParameterError, Interrupted
            As ``vi.follow_motion``.

        Examples
        --------
        >>> import vibroimpact as vi
        >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2.0, restitution=0.8, gap=0.5,
        ...                    drive_frequency=1.8, moment_amplitude=1.0)
        >>> run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
        >>> motion = run.refine()
        >>> motion.follow(drive_frequency=(1.75, 1.85)).of_kind("neimark_sacker")
        [<neimark_sacker of 1-1 at drive_frequency = 1.80904556953>]
        """
        branch: Branch = verb("follow_motion")(self, **options)
        return branch

    def to_pandas(self) -> pandas.DataFrame:
        """Return the impacts of one orbit as a data frame.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> len(motion.to_pandas())
        1
        """
        return self.impacts.to_pandas()

    def _facts(self) -> Facts:
        verdict = self.stability if self.admissible else f"{self.stability}: {self.why_not}"
        return {
            "motion": f"{self.label}, {verdict}",
            "multipliers": ", ".join(f"{value:.6g}" for value in self.multipliers),
            "start": f"({', '.join(f'{value:.6g}' for value in self.initial)})",
            "period": f"{self.period:.6g}",
            "residual": f"{self.residual:.2g}",
        }

    def __repr__(self) -> str:
        """Label, verdict and the largest multiplier."""
        verdict = "admissible" if self.admissible else "not admissible"
        verdict += ", stable" if self.stable else ", unstable"
        return (
            f"<PeriodicMotion {self.label}, {verdict}, |lambda| = {abs(self.multipliers[0]):.6g}>"
        )


def columns_of(motions: Sequence[Any]) -> dict[str, Any]:
    """Return what a data frame says of motions, a row for each."""
    states = np.array([motion.sections[0] for motion in motions])
    names: Sequence[str] = ("x1", "v1", "x2", "v2")
    if states.ndim == 3:
        names = [f"{part}_{place}" for part in "qv" for place in range(states.shape[2])]
    states = states.reshape(len(motions), len(names))
    return {
        "label": [motion.label for motion in motions],
        "m": [motion.m for motion in motions],
        "n": [motion.n for motion in motions],
        "stable": [motion.stable for motion in motions],
        "admissible": [motion.admissible for motion in motions],
        "largest_multiplier": [float(abs(motion.multipliers[0])) for motion in motions],
        **dict(zip(names, states.T, strict=True)),
    }


def reduced(matrices: Array, itinerary: _core.Itinerary) -> Array:
    """Leave out the states of a wall at rest, and x1, which cannot vary in contact with it.

    The matrices are along the last two axes.
    """
    if not itinerary.wall_at_rest:
        return matrices
    kept = [0, 1] if itinerary.legs == [Leg.CIRCUIT] else [1, 3]
    return matrices[..., kept, :][..., kept]


def multipliers_of(return_maps: Array, itinerary: _core.Itinerary) -> NDArray[np.complex128]:
    """Return the multipliers of return maps, shape (k, 4, 4), in rows by falling modulus.

    A leg that cannot be followed gives NaN, and one that ends in a graze infinity: then all of them
    are NaN.
    """
    return eigenvalues_of(reduced(return_maps, itinerary))


def eigenvalues_of(matrices: Array) -> NDArray[np.complex128]:
    """Return the eigenvalues of matrices (k, n, n), in rows by falling modulus, as above."""
    finite = np.isfinite(matrices).all(axis=(1, 2))
    multipliers = np.full(matrices.shape[:2], np.nan, dtype=np.complex128)
    multipliers[finite] = np.linalg.eigvals(matrices[finite])
    order = np.lexsort((-multipliers.imag, -np.round(np.abs(multipliers), 13)), axis=-1)
    return np.take_along_axis(multipliers, order, axis=-1)


def all_inside(multipliers: NDArray[np.complex128]) -> NDArray[np.bool_]:
    """Whether multipliers, along the last axis, all lie inside the unit circle."""
    return np.asarray(np.abs(multipliers).max(axis=-1) < 1.0 - NEUTRAL)


def _wrapped(phase: float) -> float:
    """The phase in (-pi, pi]."""
    result = math.remainder(phase, math.tau)
    return math.pi if result == -math.pi else result


def size_of(sections: Array) -> float:
    """Return the size of a motion, by which differences of its sections are measured."""
    return max(_LEAST_SIZE, float(np.abs(sections).max()))


def same_orbit(one: Any, other: Any) -> bool:
    """Whether two motions are the same orbit; it may begin in another drive period."""
    if (one.m, one.n) != (other.m, other.n):
        return False
    shifts = (np.abs(np.roll(other.sections, k, axis=0) - one.sections) for k in range(one.m))
    return min(float(shift.max()) for shift in shifts) < SAME_ORBIT * size_of(one.sections)
