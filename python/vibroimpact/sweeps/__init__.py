"""Computations over grids: sweeps, diagrams, charts, Lyapunov exponents, basins (sweeps page).

One engine divides a grid into chunks, which threads or a cluster compute, into memory or into a
store. The tasks define what a cell is.
"""

from .basins import (
    Attractor,
    BasinEntropy,
    Basins,
    BasinSettings,
    UncertaintyExponent,
    basin_entropy,
    basins,
    uncertainty_exponent,
)
from .columns import Columns
from .columns import to_dataset as to_dataset
from .diagram import bifurcation_diagram
from .diagram_results import Diagram, DiagramSettings

# Names imported `as` themselves are used within the package only; they are not public.
from .engine import compute as compute
from .fields import STATUS as STATUS
from .fields import STATUS_NAMES, Field, Layout, RowGroup
from .fields import ChunkResult as ChunkResult
from .fields import Task as Task
from .grid import Grid
from .grid import Tiling as Tiling
from .labels import orbit_label as orbit_label
from .lyapunov import lyapunov_spectrum
from .lyapunov_results import LyapunovSpectrum, LyapunovSweep
from .results import GridResult as GridResult
from .store import open_columns as open_columns
from .structure_diagram_results import StructureDiagram as StructureDiagram
from .sweep import chart, sweep
from .sweep_results import Chart, Sweep

# The results by the kind of their store or file.
RESULTS: dict[str, type[GridResult]] = {
    result.kind: result for result in (Sweep, Chart, Diagram, StructureDiagram, LyapunovSweep)
}

__all__ = [
    "STATUS_NAMES",
    "Attractor",
    "BasinEntropy",
    "BasinSettings",
    "Basins",
    "Chart",
    "Columns",
    "Diagram",
    "DiagramSettings",
    "Field",
    "Grid",
    "Layout",
    "LyapunovSpectrum",
    "LyapunovSweep",
    "RowGroup",
    "Sweep",
    "UncertaintyExponent",
    "basin_entropy",
    "basins",
    "bifurcation_diagram",
    "chart",
    "lyapunov_spectrum",
    "sweep",
    "uncertainty_exponent",
]
