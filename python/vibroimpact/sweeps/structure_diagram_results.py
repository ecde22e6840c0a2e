"""What a bifurcation diagram of structures returns."""

from __future__ import annotations

from ..interruption import interruptible
from ..structure_run import StructureRun
from ..structure_run_parts import IMPACT_COLUMNS
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
