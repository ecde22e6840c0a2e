"""Computations over grids: sweeps, diagrams, charts, Lyapunov exponents, basins (docs/atlas.md).

One engine cuts a grid into chunks and has them computed by threads or by a cluster, into memory or
into a store; what a cell is, the tasks say. The modules, in this order: ctrl_c, grid, fields,
labels, label_array, columns, store_layout, store_check, store_lock, store, cluster, engine (any
computation), results, cells (runs),
sweep, merge, diagram_results, diagram, lyapunov, trapping, clouds, free_motion, attractors,
attractor_search, basin_measures, basin_results, basin_files, basins.
"""

from .attractors import Attractor
from .basin_measures import BasinEntropy, UncertaintyExponent, basin_entropy, uncertainty_exponent
from .basin_results import Basins, BasinSettings
from .basins import basins
from .columns import Columns, to_dataset
from .diagram import bifurcation_diagram
from .diagram_results import Diagram, DiagramSettings
from .engine import compute
from .fields import STATUS, STATUS_NAMES, ChunkResult, Field, Layout, RowGroup, Task
from .grid import Grid, Tiling
from .labels import orbit_label
from .lyapunov import LyapunovSpectrum, LyapunovSweep, lyapunov_spectrum
from .results import GridResult
from .store import open_columns
from .sweep import Chart, Sweep, chart, sweep

# The results by the kind of their store or file.
RESULTS: dict[str, type[GridResult]] = {
    result.kind: result for result in (Sweep, Chart, Diagram, LyapunovSweep)
}

__all__ = [
    "RESULTS",
    "STATUS",
    "STATUS_NAMES",
    "Attractor",
    "BasinEntropy",
    "BasinSettings",
    "Basins",
    "Chart",
    "ChunkResult",
    "Columns",
    "Diagram",
    "DiagramSettings",
    "Field",
    "Grid",
    "GridResult",
    "Layout",
    "LyapunovSpectrum",
    "LyapunovSweep",
    "RowGroup",
    "Sweep",
    "Task",
    "Tiling",
    "UncertaintyExponent",
    "basin_entropy",
    "basins",
    "bifurcation_diagram",
    "chart",
    "compute",
    "lyapunov_spectrum",
    "open_columns",
    "orbit_label",
    "sweep",
    "to_dataset",
    "uncertainty_exponent",
]
