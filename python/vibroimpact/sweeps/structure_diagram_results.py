"""What a bifurcation diagram of structures returns."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..arguments import count, reject
from ..fixed_arrays import FixedArrays
from ..interruption import interruptible
from ..run_parts import read_only
from ..showing import Facts, Shown
from ..structure_run import StructureRun
from ..tables import Table, of_columns
from ..verbs import verb

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


@interruptible
@dataclass(frozen=True, kw_only=True, eq=False)
class StructureDiagram(FixedArrays, Shown):
    """The motions of structures that differ in one number, branch by branch.

    Attributes
    ----------
    name
        The number that is varied.
    values, branch
        Of each point its value, (n,), and the branch it belongs to, (n,).
    status, label
        Of each point: ``"completed"``, ``"restarted"`` or why not, as in a Diagram; and the label
        of its motion.
    m, n, residual
        Period in drive periods, 0 where none was found; impacts per orbit on all stops, -1 with
        complete chatter; and the largest difference of sections m periods apart.
    runs
        The run of each point, None where there is none.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> oscillator = vi.Structure([[1]], [[1]], [vi.Stop([1], 0.3, 0.8)], damping_ratios=[0.05],
    ...                           drive_amplitude=[1], drive_frequency=2.0)
    >>> diagram = vi.bifurcation_diagram(oscillator, initial=[[0], [0]],
    ...                                  drive_frequency=[1.9, 2.0, 2.05], periods=200, keep=50)
    >>> diagram.label.tolist()
    ['1-1', '1-1', '1-1']
    """

    name: str
    values: Array
    branch: NDArray[np.int64]
    status: NDArray[np.str_]
    label: NDArray[np.str_]
    m: NDArray[np.int64]
    n: NDArray[np.int64]
    residual: Array
    runs: tuple[StructureRun | None, ...]

    @cached_property
    def offset(self) -> NDArray[np.int64]:
        """Place of the first impact of each point in ``impacts``, and their number, (n + 1,)."""
        counts = [0 if run is None else len(run.impacts) for run in self.runs]
        return read_only(np.concatenate([[0], np.cumsum(counts)]).astype(np.int64))

    @cached_property
    def impacts(self) -> Table:
        """Impacts of all points one after another: the columns of ``StructureRun.impacts``."""
        rows = [run.impacts.view(np.ndarray) for run in self.runs if run is not None]
        if not rows:
            return of_columns({"time": np.empty(0)})
        joined = np.concatenate(rows)
        return of_columns({name: joined[name] for name in joined.dtype.names or ()})

    @cached_property
    def impact_values(self) -> Array:
        """The varied number at each impact."""
        return read_only(np.repeat(self.values, np.diff(self.offset)))

    @cached_property
    def stroboscopic(self) -> Array:
        """Kept sections of all points one after another, (rows, 2, N): rows q and v."""
        rows = [run.stroboscopic for run in self.runs if run is not None]
        return read_only(np.concatenate(rows)) if rows else np.empty((0, 2, 0))

    @cached_property
    def stroboscopic_values(self) -> Array:
        """The varied number at each section."""
        counts = [0 if run is None else len(run.stroboscopic) for run in self.runs]
        return read_only(np.repeat(self.values, counts))

    def run(self, i: int) -> StructureRun:
        """Return the run of point ``i``.

        Raises
        ------
        ParameterError
            If there is no such point, or it has no run.

        Examples
        --------
        >>> diagram.run(1).label
        '1-1'
        """
        place = count("i", i, least=0, most=len(self.runs) - 1)
        found = self.runs[place]
        if found is None:
            reject("i", i, f"a point with a run; this one is {self.status[place]}")
        return found

    def plot(self, **options: Any) -> Axes:
        """Draw a section against the varied number, by ``vi.plot.structure_bifurcation``.

        Parameters
        ----------
        **options
            As in ``vi.plot.structure_bifurcation``.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> diagram.plot().get_xlabel()
        'drive frequency'
        """
        axes: Axes = verb("draw")(self, **options)
        return axes

    def _facts(self) -> Facts:
        labels, numbers = np.unique(self.label, return_counts=True)
        most = sorted(zip(numbers.tolist(), labels.tolist(), strict=True), reverse=True)[:6]
        return {
            "varied": f"{self.name}, {len(self.values)} points",
            "motions": ", ".join(f"{number} {label}" for number, label in most),
        }

    def __repr__(self) -> str:
        """Say what is varied and how many points there are."""
        return f"<StructureDiagram over {self.name}, {len(self.values)} points>"
