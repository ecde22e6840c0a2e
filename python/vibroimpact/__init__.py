"""Oblique-impact vibration of two bodies: simulation, sections and bifurcation diagrams.

The model is that of Han, Jin & Hu (2004), corrected and completed; see docs/theory.md. All
quantities are dimensionless; the glossary is docs/notation.md.

    import vibroimpact as vi

    system = vi.System(
        mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
        drive_frequency=1.8, moment_amplitude=1,
    )
    run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    run.label
"""

from typing import TYPE_CHECKING

from ._core import __version__
from .atlas import (
    Attractor,
    Basins,
    Chart,
    Diagram,
    DiagramSettings,
    LyapunovSpectrum,
    LyapunovSweep,
    Sweep,
    basins,
    bifurcation_diagram,
    chart,
    lyapunov_spectrum,
    sweep,
)
from .errors import Interrupted, ParameterError, SimulationError, StateError
from .files import load
from .impact_maps import ImpactAgreement, ImpactRegimes, impact_agreement, impact_regimes
from .impacts import impact
from .orbits import (
    Bifurcation,
    BifurcationCurve,
    Branch,
    ManifoldSide,
    MotionMap,
    MotionSearch,
    NotFound,
    PeriodicMotion,
    PeriodicMotions,
    StabilityRegion,
    Undecided,
    UnstableManifold,
    bifurcation_curve,
    follow_motion,
    motion_map,
    periodic_motion,
    periodic_motions,
    search_motions,
    stability_region,
    switch_branch,
    unstable_manifold,
)
from .results import EnergyAudit, EventKind, FinalState, PeriodReport, Regime, Run
from .simulation import simulate
from .system import System
from .verification import Disagreement, Verification, verify

if TYPE_CHECKING:
    from . import plot as plot
else:

    def __getattr__(name):
        """Import the plotting functions on first use, so that matplotlib is loaded only then."""
        if name == "plot":
            import importlib

            return importlib.import_module(".plot", __name__)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


__all__ = [
    "Attractor",
    "Basins",
    "Bifurcation",
    "BifurcationCurve",
    "Branch",
    "Chart",
    "Diagram",
    "DiagramSettings",
    "Disagreement",
    "EnergyAudit",
    "EventKind",
    "FinalState",
    "ImpactAgreement",
    "ImpactRegimes",
    "Interrupted",
    "LyapunovSpectrum",
    "LyapunovSweep",
    "ManifoldSide",
    "MotionMap",
    "MotionSearch",
    "NotFound",
    "ParameterError",
    "PeriodReport",
    "PeriodicMotion",
    "PeriodicMotions",
    "Regime",
    "Run",
    "SimulationError",
    "StabilityRegion",
    "StateError",
    "Sweep",
    "System",
    "Undecided",
    "UnstableManifold",
    "Verification",
    "__version__",
    "basins",
    "bifurcation_curve",
    "bifurcation_diagram",
    "chart",
    "follow_motion",
    "impact",
    "impact_agreement",
    "impact_regimes",
    "load",
    "lyapunov_spectrum",
    "motion_map",
    "periodic_motion",
    "periodic_motions",
    "plot",
    "search_motions",
    "simulate",
    "stability_region",
    "sweep",
    "switch_branch",
    "unstable_manifold",
    "verify",
]
