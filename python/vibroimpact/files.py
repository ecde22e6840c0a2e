"""Reading of files that ``save`` has written, and opening of stores."""

import os

from . import archive
from .arguments import path as checked_path
from .fitting import Fit
from .interruption import interruptible
from .orbits import Branch, PeriodicMotion
from .orbits.branch_files import branch_from_parts
from .orbits.files import motion_from_parts, structure_motion_from_parts
from .run import Run
from .structure_motion import StructureOrbit
from .structure_run import StructureRun
from .sweeps import RESULTS, Basins, GridResult, LyapunovSpectrum, open_columns
from .sweeps.basins.files import basins_from_parts
from .sweeps.merge import is_refined, open_levels

Motion = PeriodicMotion | StructureOrbit | Branch
Saved = Run | StructureRun | GridResult | Basins | LyapunovSpectrum | Motion | Fit


@interruptible
def load(path: str | os.PathLike[str]) -> Saved:
    """Read a result from the file that its ``save`` wrote, or open the Zarr store of a computation.

    The ``load`` of each class accepts files of that class only.

    Raises
    ------
    ValueError
        If it is damaged, or was written by something else or by another version.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> system = vi.System(mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
    ...                    drive_frequency=1.8, moment_amplitude=1)
    >>> vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100).save("run.npz")
    >>> vi.load("run.npz").label
    '1-1'
    """
    path = checked_path("path", path)
    if os.path.isdir(path):
        columns = open_levels(path) if is_refined(path) else open_columns(path)
        kind = columns.layout.kind
        if kind not in RESULTS:
            raise ValueError(f"{path}: one of the stores of {kind}, which are more than its cells")
        return RESULTS[kind](columns)
    builders: dict[str, archive.Builder[Saved]] = {
        "run": Run._from_parts,
        "basins": basins_from_parts,
        "branch": branch_from_parts,
        "fit": Fit._from_parts,
        "motion": motion_from_parts,
        "spectrum": LyapunovSpectrum._from_parts,
        "structure_motion": structure_motion_from_parts,
        "structure_run": StructureRun._from_parts,
    }
    builders |= {kind: result._from_parts for kind, result in RESULTS.items()}
    return archive.read(path, builders)
