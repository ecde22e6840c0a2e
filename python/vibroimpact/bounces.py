"""All impacts of a run: those that it lists, and those that complete chatter skipped."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._core import BouncesEnd
from .fixed_arrays import FixedArrays
from .interruption import interruptible
from .showing import Facts, Shown
from .tables import Table, with_column
from .verbs import verb

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class Bounces(FixedArrays, Shown):
    """The impacts of the kept window of a run, with those that complete chatter skipped.

    A complete chatter has infinitely many impacts, so each list of them ends somewhere; ``ends``
    says where and why.

    Attributes
    ----------
    impacts
        Structured array in the order of time, read-only: the columns of ``Run.impacts``, and
        ``skipped``: False for the rows of ``Run.impacts``, True for those that chatter skipped.
    ends
        For each chatter of the window, in order, why the list of its skipped impacts ends, each a
        BouncesEnd. ``approach_velocity``: the next one approaches more slowly than asked for.
        ``accumulation``: what is left is below rounding, or within the error of the accumulation
        point. ``run_end``: the run ends among them. ``cap``: as many as allowed are listed.
        ``interrupted``: Ctrl-C.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> ball = vi.System(
    ...     mass_ratio=0, frequency_ratio=0, restitution=0.9, gap=0, drive_frequency=0,
    ...     moment_amplitude=1, contact="direct",
    ... )
    >>> run = vi.simulate(ball, initial=(-1, 0, 0, 0), time=40)
    >>> bounces = run.bounces(down_to=1e-6)
    >>> bounces.skipped, [str(end) for end in bounces.ends]
    (116, ['approach_velocity'])
    """

    impacts: Table
    ends: tuple[BouncesEnd, ...]

    @property
    def skipped(self) -> int:
        """Number of rows that ``Run.impacts`` does not have."""
        return int(np.count_nonzero(self.impacts["skipped"]))

    @property
    def capped(self) -> bool:
        """Whether a list ends at the cap on their number."""
        return BouncesEnd.CAP in self.ends

    def plot(self, **options: Any) -> Axes:
        """Draw the approach velocities against time, by ``vi.plot.bounces``.

        Parameters
        ----------
        **options
            As in ``vi.plot.bounces``.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> bounces.plot().get_yscale()
        'log'
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    def _facts(self) -> Facts:
        return {
            "impacts": len(self.impacts),
            "of them skipped in chatter": self.skipped,
            "lists end": ", ".join(
                f"{self.ends.count(end)} x {end}" for end in dict.fromkeys(self.ends)
            ),
        }

    def __repr__(self) -> str:
        """Say how many there are, and why the lists end."""
        ends = ", ".join(f"{self.ends.count(end)} x {end}" for end in dict.fromkeys(self.ends))
        return (
            f"<Bounces: {len(self.impacts)} impacts, {self.skipped} of them skipped in chatter"
            f"{f'; lists end: {ends}' if ends else ''}>"
        )


def as_bounces(rows: Table, skipped: NDArray[np.bool_], ends: list[BouncesEnd]) -> Bounces:
    """Return rows like those of ``Run.impacts`` with their marks as a result."""
    impacts = with_column(rows, "skipped", skipped, after="energy_loss")
    return Bounces(impacts=impacts, ends=tuple(ends))
