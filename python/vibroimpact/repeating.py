"""What the periodic motions of all machines have alike: label, period, picture and file."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, ClassVar, Self

from .fixed_arrays import FixedArrays
from .interruption import interruptible
from .showing import Shown
from .verbs import verb

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@interruptible
class Repeating(FixedArrays, Shown):
    """A periodic motion of any machine."""

    # What a file of it is called.
    _KIND: ClassVar[str]

    system: Any
    m: int
    n: int | float

    @property
    def label(self) -> str:
        """The label of the motion, m-n: ``"1-1"``, ``"4-5"``, ``"1-inf"``, ``"1-0"``."""
        return f"{self.m}-{self.n}"

    @property
    def period(self) -> float:
        """Time after which the motion repeats, in that of its system: m drive periods."""
        period: float = self.m * self.system.drive_period
        return period

    def plot(self, **options: Any) -> list[Axes]:
        """Draw phase portraits and time history, by ``vi.plot.orbit``.

        Parameters
        ----------
        **options
            As in ``vi.plot.orbit``.

        Returns
        -------
        list of matplotlib.axes.Axes

        Examples
        --------
        >>> oscillator = vi.Structure([[1]], [[1]], [vi.Stop([1], 0.3, 0.8)], damping_ratios=[0.05],
        ...                           drive_amplitude=[1], drive_frequency=2.0)
        >>> motion = vi.simulate(oscillator, initial=[[0], [0]], periods=200, keep=50).refine()
        >>> [ax.get_xlabel() for ax in motion.plot()]
        ['coordinate $q_0$', 'time $t$']
        """
        axes: list[Axes] = verb("draw")(self, **options)
        return axes

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the motion to ``path`` (.npz, no pickle); ``vibroimpact.load`` reads it.

        Examples
        --------
        >>> motion.save("motion.npz")
        >>> vi.load("motion.npz").label
        '1-1'
        """
        verb("write_motion")(path, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read a motion from the file that ``save`` wrote.

        Raises
        ------
        ValueError
            If it is damaged, foreign, or holds something else.

        Examples
        --------
        >>> motion.save("motion.npz")
        >>> type(motion).load("motion.npz").label
        '1-1'
        """
        motion: Self = verb("read_motion")(path, cls._KIND)
        return motion
