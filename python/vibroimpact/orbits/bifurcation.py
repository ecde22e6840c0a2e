"""A located bifurcation of a periodic motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .._core import Leg, StopLeg
from ..interruption import interruptible
from ..showing import Facts, Shown
from ..verbs import verb
from .kinds import BifurcationKind, Branching, Test

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class Bifurcation(Shown):
    """A located bifurcation of a periodic motion.

    Attributes
    ----------
    kind
        ``saddle_node``, ``period_doubling``, ``neimark_sacker``, ``neutral_saddle`` (no
        bifurcation), ``branch_point``, or a border: ``grazing``, ``regime_border``,
        ``chatter_onset``, ``contact_border``.
    parameter, value
        Name and value of the parameter.
    motion
        The motion there: a PeriodicMotion, of a structure a StructureOrbit.
    test, test_value
        The function that vanishes there, and its remaining value.
    goes_on
        At a border: the legs beyond it, ``()`` where the branch ends.
    branching
        At a branch point: how the branches cross, as far as it can be told, ``"transcritical"``,
        ``"pitchfork"`` (on the other branch the parameter has an extremum there: a symmetry is
        lost) or ``"symmetry-breaking pitchfork"`` (of a motion that is its own mirror image, -q
        half a period later). Else None.
    other
        At a branch point: the direction of the other branch, by the nodes of ``motion`` and by the
        parameter, shape (nodes + 1,). Else None.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> motion = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).refine()
    >>> found = motion.follow(drive_frequency=(1.5, 1.9)).bifurcations[0]
    >>> str(found.kind), found.parameter, round(found.value, 3)
    ('period_doubling', 'drive_frequency', 1.511)
    """

    kind: BifurcationKind
    parameter: str
    value: float
    motion: Any
    test: Test
    test_value: float
    goes_on: tuple[Leg, ...] | tuple[StopLeg, ...] = ()
    branching: Branching | None = None
    other: NDArray[np.float64] | None = None

    def plot(self, **options: Any) -> list[Axes]:
        """Draw the motion there, by ``vi.plot.orbit``.

        Parameters
        ----------
        **options
            As in ``vi.plot.orbit``.

        Returns
        -------
        list of matplotlib.axes.Axes

        Examples
        --------
        >>> len(found.plot())
        3
        """
        axes: list[Axes] = verb("draw")(self, **options)
        return axes

    def _named(self) -> str:
        return f"{self.kind} ({self.branching})" if self.branching else str(self.kind)

    def _facts(self) -> Facts:
        return {
            "kind": self._named(),
            self.parameter: f"{self.value:.12g}",
            "motion": self.motion.label,
            "multipliers": ", ".join(f"{value:.6g}" for value in self.motion.multipliers),
        }

    def __repr__(self) -> str:
        """Kind, place and motion."""
        return f"<{self._named()} of {self.motion.label} at {self.parameter} = {self.value:.12g}>"
