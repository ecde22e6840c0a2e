"""What a bifurcation diagram of structures returns."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..interruption import interruptible
from ..structure_run import StructureRun
from ..structure_run_parts import IMPACT_COLUMNS
from ..tables import Table, of_columns
from .diagram_results import AnyDiagram


@interruptible
class StructureDiagram(AnyDiagram[StructureRun]):
    """A bifurcation diagram of structures: n points, as a Diagram has them, and their impacts.

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

    kind = "structure_diagram"

    def _columns(self) -> dict[str, tuple[str, ...]]:
        return {"impacts": IMPACT_COLUMNS}

    @property
    def impacts(self) -> Table:
        """Kept impacts of all points one after another: the columns of ``StructureRun.impacts``.

        Point i owns the rows offset[i] : offset[i + 1].
        """
        (impacts, _) = self._machine.row_groups
        columns = {entry.name: self.columns[entry.name] for entry in impacts.fields}
        names = {"impact_phase": "phase"}
        return of_columns({names.get(name, name): rows for name, rows in columns.items()})

    def _impact_columns(self) -> dict[str, Any]:
        columns: dict[str, Any] = {}
        impacts = np.asarray(self.impacts)
        for name in impacts.dtype.names or ():
            column = impacts[name]
            if column.ndim == 1:
                columns[name] = column
            else:
                columns |= {f"{name}_{place}": row for place, row in enumerate(column.T)}
        return columns
