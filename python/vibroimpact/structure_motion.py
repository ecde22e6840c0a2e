"""What is computed from a run of a structure: a periodic motion, and Lyapunov exponents."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import StopLeg, StructureItinerary
from .arguments import times_of
from .fixed_arrays import FixedArrays
from .interruption import interruptible
from .repeating import Repeating
from .showing import Facts, Shown, in_a_line
from .structure import Structure
from .verbs import verb

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .verb_types import Branch

Array = NDArray[np.float64]


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class StructureOrbit(Repeating):
    """A periodic motion of a structure, found to rounding by Newton's method.

    ``vi.simulate(orbit.system, initial=orbit.state, periods=orbit.m)`` runs it.

    Attributes
    ----------
    system
        The structure.
    state
        Rows q and v at the start of a drive period, (2, N).
    m, n
        Drive periods of an orbit, and impacts in it on all stops; n is ``math.inf`` with complete
        chatter.
    impacts
        Those on each stop, without those that a complete chatter skips.
    residual
        Largest difference of the end of an orbit from its start.
    derivative
        Of the return map, the state m periods later by the state, (2 N', 2 N'), exact up to
        rounding; N' modes of a structure `from_modes`, in their coordinates.
    multipliers
        Its eigenvalues, complex, by descending modulus.
    error
        Rounding of their moduli.
    stability
        ``"stable"``, ``"unstable"``, or ``"undecided"`` where the largest modulus is 1 to rounding.
    legs, nodes, clocks
        Of a motion whose only events are impacts: what ends each flight, where it starts, and the
        drive periods completed there. A node is (q, v, t) just after an impact, t the time in the
        drive period; of a motion without impacts (q, v) at the start of a period. Their q and v are
        those of the modes of a structure `from_modes`. Empty where stops stay closed for a while.
    admissible, why_not
        Whether it is a motion: a branch has its points on both sides of a border within rounding.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> oscillator = vi.Structure([[1]], [[1]], [vi.Stop([1], 0.3, 0.8)], damping_ratios=[0.05],
    ...                           drive_amplitude=[1], drive_frequency=2.0)
    >>> motion = vi.simulate(oscillator, initial=[[0], [0]], periods=200, keep=50).refine()
    >>> motion.label, motion.stability, motion.multipliers.shape
    ('1-1', 'stable', (2,))
    """

    _KIND = "structure_motion"

    system: Structure
    state: Array
    m: int
    n: int | float
    impacts: NDArray[np.int64]
    residual: float
    derivative: Array
    multipliers: NDArray[np.complex128]
    error: float
    stability: str
    legs: tuple[StopLeg, ...] = ()
    nodes: Array = field(default_factory=lambda: np.empty((0, 0)))
    clocks: tuple[int, ...] = ()
    admissible: bool = True
    why_not: str = ""

    @property
    def stable(self) -> bool:
        """Whether it is a motion, and stable."""
        return self.admissible and self.stability == "stable"

    @cached_property
    def is_symmetric(self) -> bool | None:
        """Whether it is its own mirror image: -q(t) half a drive period later.

        If not, its mirror image is another motion of the structure, with the same label. None for a
        structure that is not its own mirror image: then motions have none.

        Examples
        --------
        >>> stops = [vi.Stop([1], 0.5, 0.8), vi.Stop([-1], 0.5, 0.8)]
        >>> between = motion.system.replace(stops=stops)
        >>> vi.simulate(between, initial=[[0], [0]], periods=400, keep=50).refine().is_symmetric
        True
        """
        own: bool | None = verb("own_image")(self)
        return own

    @cached_property
    def itinerary(self) -> StructureItinerary:
        """The legs as the compiled core takes them.

        Raises
        ------
        ParameterError
            If there are none.
        """
        return StructureItinerary(list(self.legs), self.m, list(self.clocks))

    @cached_property
    def sections(self) -> Array:
        """States (m, 2, N) at the starts of the m drive periods: rows q and v."""
        system = self.system
        if self.legs:
            return system._from_core(self.itinerary.sections(system._compiled, self.nodes))
        (run,), *_ = _core.simulate(
            system._compiled, system._to_core(self.state), periods=self.m, keep=self.m
        )
        # Those of a run are at the ends of its periods.
        return np.concatenate([self.state[None], system._from_core(run.stroboscopic)[:-1]])

    def trajectory(self, t: ArrayLike) -> Array:
        """Return the states (k, 2, N) at times ``t``, which may lie anywhere; rows q and v.

        They are those of the solution, whether or not it is admissible.

        Parameters
        ----------
        t
            Times, shape (k,), or one time; the orbit repeats after m drive periods.

        Raises
        ------
        ParameterError
            If stops stay closed for a while: then ``simulate`` from ``state``.

        Examples
        --------
        >>> motion.trajectory([0.0, motion.period / 2]).shape
        (2, 2, 1)
        """
        times, single = times_of("t", t)
        rows = self.itinerary.trajectory(self.system._compiled, self.nodes, times)
        states = self.system._from_core(rows)
        return states[0] if single else states

    def follow(self, **options: Any) -> Branch:
        """Follow the motion over a parameter, stable or not: ``vi.follow_motion(motion, ...)``.

        Parameters
        ----------
        **options
            As in ``vi.follow_motion``, with one number of the structure and its range:
            ``motion.follow(drive_frequency=(1.9, 2.1))``, ``gap_0``, ``restitution`` ...

        Raises
        ------
        ParameterError, Interrupted
            As ``vi.follow_motion``.

        Examples
        --------
        >>> branch = motion.follow(drive_frequency=(1.9, 2.05))
        >>> branch.parameter, len(branch.bifurcations)
        ('drive_frequency', 0)
        """
        branch: Branch = verb("follow_motion")(self, **options)
        return branch

    def _facts(self) -> Facts:
        image = (
            {}
            if self.is_symmetric is None
            else {"mirror image": "itself" if self.is_symmetric else "another motion"}
        )
        return {
            "motion": f"{self.label}, {self.stability}",
            **image,
            "multipliers": in_a_line(np.abs(self.multipliers)),
            "q": in_a_line(self.state[0]),
            "v": in_a_line(self.state[1]),
            "residual": f"{self.residual:.3g}",
        }

    def __repr__(self) -> str:
        """Say its label and stability."""
        return f"<StructureOrbit {self.label}, {self.stability}>"


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class StructureSpectrum(FixedArrays, Shown):
    """Lyapunov exponents of a motion of a structure, per unit of its time, natural logarithm.

    Attributes
    ----------
    exponents
        The largest ones, descending, (count,). -inf where perturbations die out at once: in lasting
        contact, complete chatter, a plastic impact.
    error
        Standard errors from the means of ten blocks, (count,); 0 for -inf.
    time
        Time they are measured over: the last nine tenths of what was asked for.
    impacts
        Impacts at each stop in that time, without those that complete chatter skips.
    history_time, history
        Times since the measurement began, (h,), and the exponents up to them, (h, count).
    label
        Label of the motion.
    system
        The structure.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> oscillator = vi.Structure([[1]], [[1]], [vi.Stop([1], 0.3, 0.8)], damping_ratios=[0.05],
    ...                           drive_amplitude=[1], drive_frequency=2.0)
    >>> spectrum = vi.lyapunov_spectrum(oscillator, initial=[[0], [0]], periods=400)
    >>> spectrum.label, spectrum.exponents.shape, spectrum.largest < 0
    ('1-1', (2,), True)
    """

    exponents: Array
    error: Array
    time: float
    impacts: NDArray[np.int64]
    history_time: Array
    history: Array
    label: str
    system: Structure

    def plot(self, **options: Any) -> Axes:
        """Draw the exponents over the time of their measurement, by ``vi.plot.lyapunov``.

        Parameters
        ----------
        **options
            As in ``vi.plot.lyapunov``.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> spectrum.plot().get_ylabel()
        'Lyapunov exponents up to $t$'
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    @property
    def per_period(self) -> Array:
        """The exponents per drive period, those of the stroboscopic map."""
        return self.exponents * self.system.drive_period

    @property
    def sum(self) -> float:
        """Sum of the exponents: of all 2 N the mean rate of contraction of volumes."""
        return float(self.exponents.sum())

    @property
    def largest(self) -> float:
        """The largest exponent: > 0 for chaotic motion."""
        return float(self.exponents[0])

    def _facts(self) -> Facts:
        return {
            "motion": self.label,
            "exponents": in_a_line(self.exponents),
            "errors": in_a_line(self.error),
            "time": f"{self.time:.6g}",
        }

    def __repr__(self) -> str:
        """Say the largest exponent and the label."""
        return f"<StructureSpectrum {self.label}, largest {self.largest:.4g}>"
