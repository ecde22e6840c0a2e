"""The obvious picture of each result: what its method ``plot`` draws."""

from collections.abc import Callable
from functools import singledispatch
from typing import Any

import numpy as np

from ..arguments import reject
from ..bounces import Bounces
from ..fitting import Fit
from ..impact_results import ImpactAgreement, ImpactRegimes
from ..orbits import (
    Bifurcation,
    BifurcationCurve,
    Branch,
    ManifoldSide,
    MotionSearch,
    PeriodicMotion,
    StabilityRegion,
    UnstableManifold,
)
from ..run import Run
from ..single_impact import MotionMap, PeriodicMotions
from ..structure import Structure
from ..structure_motion import StructureOrbit, StructureSpectrum
from ..structure_run import StructureRun
from ..sweeps import Attractor, Basins, Diagram, LyapunovSpectrum, LyapunovSweep, Sweep
from ..sweeps.structure_diagram_results import StructureDiagram
from ..system import System
from ..verification import Verification
from .attractors import attractor, motion_search
from .basins import basins
from .bounces import bounces
from .branches import bifurcation_curves, branches
from .chart import chart
from .diagram import bifurcation
from .final_states import final_states
from .fit import fit
from .impacts import impact_agreement, impact_regimes
from .lyapunov import lyapunov
from .machine import machine
from .manifold import manifold
from .motion import time_history
from .multipliers import multipliers
from .orbit import orbit
from .solutions import motion_branches, stability_map
from .verification import verification


@singledispatch
def draw(result: Any, **options: Any) -> Any:
    """Draw a result; the options are those of the function that draws it.

    Raises
    ------
    ParameterError
        If the result has no picture.
    """
    reject("result", result, "a result that has a picture")


_FUNCTIONS: dict[type, Callable[..., Any]] = {
    Attractor: attractor,
    Basins: basins,
    BifurcationCurve: bifurcation_curves,
    Bounces: bounces,
    Branch: branches,
    Diagram: bifurcation,
    Fit: fit,
    ImpactAgreement: impact_agreement,
    ImpactRegimes: impact_regimes,
    LyapunovSpectrum: lyapunov,
    LyapunovSweep: lyapunov,
    ManifoldSide: manifold,
    MotionSearch: motion_search,
    PeriodicMotion: orbit,
    StabilityRegion: bifurcation_curves,
    UnstableManifold: manifold,
    StructureDiagram: bifurcation,
    StructureOrbit: orbit,
    StructureSpectrum: lyapunov,
    Verification: verification,
}
for _kind, _function in _FUNCTIONS.items():
    draw.register(_kind, _function)


@draw.register
def _(system: System, **options: Any) -> Any:
    # At rest; where the gap is negative the bodies then touch.
    rest = (0.0, 0.0, max(0.0, -system.gap), 0.0)
    return machine(system, options.pop("state", rest), **options)


@draw.register
def _(structure: Structure, **options: Any) -> Any:
    rest = np.zeros((2, structure.coordinates))
    return machine(structure, options.pop("state", rest), **options)


@draw.register(Run)
@draw.register(StructureRun)
def _(run: Run | StructureRun, **options: Any) -> Any:
    if run.system.drive_frequency == 0.0:
        options = {"window": (run.kept_from, run.final_state.time)} | options
    return time_history(run, **options)


@draw.register
def _(sweep: Sweep, **options: Any) -> Any:
    if len(sweep.axes) == 2:
        return chart(sweep, **options)
    return final_states(sweep, **options)


@draw.register
def _(found: Bifurcation, **options: Any) -> Any:
    return orbit(found.motion, **options)


@draw.register
def _(motions: PeriodicMotions, **options: Any) -> Any:
    return multipliers(motions.motions, **options)


@draw.register
def _(solutions: MotionMap, **options: Any) -> Any:
    return (motion_branches if len(solutions.grid) == 1 else stability_map)(solutions, **options)
