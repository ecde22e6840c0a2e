"""Oblique-impact vibration of two bodies: simulation, sections and bifurcation diagrams.

The model is that of Han, Jin & Hu (2004), corrected and completed; see the theory page. All
quantities are dimensionless; the notation page explains each name.

Every docstring has an example. That of a method goes on from the example of its class.

The pages that docstrings name belong to the documentation. Each is named after its file: the theory
page is docs/theory.md in the source repository, and theory.html on the site of ``make docs``.

    import vibroimpact as vi

    system = vi.System(
        mass_ratio=0.6, frequency_ratio=2, restitution=0.8, gap=0.5,
        drive_frequency=1.8, moment_amplitude=1,
    )
    run = vi.simulate(system, initial=(0, 0.5, 0, 0), periods=600, keep=100)
    run.label
"""

from typing import TYPE_CHECKING

from ._core import BouncesEnd, Regime, __version__
from .errors import (
    ClusterError,
    Interrupted,
    NoMotionError,
    ParameterError,
    ProofError,
    SimulationError,
    StateError,
)
from .impacts import impact
from .restitution import RestitutionPowerLaw, RestitutionTable
from .run import EventKind, Evidence, PeriodReport, Run
from .run_parts import EnergyAudit, FinalState
from .scales import Scales
from .simulation import simulate
from .system import System
from .tables import Table

if TYPE_CHECKING:
    from . import plot as plot
    from .bounces import Bounces
    from .explorer import explore
    from .files import load
    from .fitting import ExpectedErrors, Fit, Record, expected_errors, fit, measure
    from .gradients import gradient
    from .impact_maps import impact_agreement, impact_regimes
    from .impact_results import ImpactAgreement, ImpactRegimes
    from .orbits import (
        Bifurcation,
        BifurcationCurve,
        Branch,
        ManifoldSide,
        MotionSearch,
        NotFound,
        PeriodicMotion,
        StabilityRegion,
        UnstableManifold,
        bifurcation_curve,
        follow_motion,
        nonsmooth_mode,
        periodic_motion,
        search_motions,
        stability_region,
        switch_branch,
        unstable_manifold,
    )
    from .proof import (
        BranchProof,
        Disc,
        Proof,
        ProofBox,
        ProvedBifurcation,
        ProvedStretch,
        SolutionsProof,
        Unproved,
        check_proof,
        prove,
    )
    from .run_in_si import RunInSI
    from .sensitivity import ImpactSensitivity, OneSided, Sensitivity
    from .single_impact import MotionMap, PeriodicMotions, Undecided, periodic_motions
    from .single_impact.motion_map import motion_map
    from .stop import Stop
    from .structure import Structure
    from .structure_motion import StructureOrbit, StructureSpectrum
    from .structure_run import StructureRun as StructureRun
    from .structure_run_parts import StructureEnergyAudit as StructureEnergyAudit
    from .structure_run_parts import StructureState as StructureState
    from .sweeps import (
        Attractor,
        Basins,
        Chart,
        Diagram,
        DiagramSettings,
        LyapunovSpectrum,
        LyapunovSweep,
        Sweep,
        bifurcation_diagram,
        chart,
        lyapunov_spectrum,
    )

    # mypy takes these for the modules of their names where they come from the package.
    from .sweeps.basins import basins
    from .sweeps.structure_diagram_results import StructureDiagram
    from .sweeps.sweep import sweep
    from .verification import Disagreement, Verification, verify
else:
    # Parts that a simulation does not need are imported on first use; `plot` imports matplotlib.
    _ON_FIRST_USE = {
        "bounces": "Bounces",
        "explorer": "explore",
        "files": "load",
        "fitting": "ExpectedErrors Fit Record expected_errors fit measure",
        "gradients": "gradient",
        "impact_maps": "ImpactAgreement ImpactRegimes impact_agreement impact_regimes",
        "orbits": """
            Bifurcation BifurcationCurve Branch ManifoldSide MotionSearch NotFound PeriodicMotion
            StabilityRegion UnstableManifold bifurcation_curve follow_motion nonsmooth_mode
            periodic_motion search_motions stability_region switch_branch unstable_manifold
        """,
        "plot": "",
        "proof": """
            BranchProof Disc Proof ProofBox ProvedBifurcation ProvedStretch SolutionsProof Unproved
            check_proof prove
        """,
        "run_in_si": "RunInSI",
        "sensitivity": "ImpactSensitivity OneSided Sensitivity",
        "single_impact": """
            MotionMap PeriodicMotions Undecided motion_map periodic_motions
        """,
        "stop": "Stop",
        "structure": "Structure",
        "structure_motion": "StructureOrbit StructureSpectrum",
        "structure_run": "StructureRun",
        "sweeps.structure_diagram_results": "StructureDiagram",
        "structure_run_parts": "StructureEnergyAudit StructureState",
        "sweeps": """
            Attractor Basins Chart Diagram DiagramSettings LyapunovSpectrum LyapunovSweep Sweep
            basins bifurcation_diagram chart lyapunov_spectrum sweep
        """,
        "verification": "Disagreement Verification verify",
    }
    _HOMES = {name: home for home, names in _ON_FIRST_USE.items() for name in names.split()}

    def __getattr__(name):
        """Import a public name when it is used for the first time."""
        import importlib

        if name in _ON_FIRST_USE:
            return importlib.import_module(f".{name}", __name__)
        if name not in _HOMES:
            from .hints import meant_in_package

            hint = "" if name[:1] == "_" else meant_in_package(name, __all__)
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}{hint}")
        found = getattr(importlib.import_module(f".{_HOMES[name]}", __name__), name)
        globals()[name] = found
        return found

    def __dir__():
        """Return the public names, for completion: the modules in which they live are none."""
        return sorted({*__all__, *(name for name in globals() if name[:2] == "__")})


__all__ = [
    "Attractor",
    "Basins",
    "Bifurcation",
    "BifurcationCurve",
    "Bounces",
    "BouncesEnd",
    "Branch",
    "BranchProof",
    "Chart",
    "ClusterError",
    "Diagram",
    "DiagramSettings",
    "Disagreement",
    "Disc",
    "EnergyAudit",
    "EventKind",
    "Evidence",
    "ExpectedErrors",
    "FinalState",
    "Fit",
    "ImpactAgreement",
    "ImpactRegimes",
    "ImpactSensitivity",
    "Interrupted",
    "LyapunovSpectrum",
    "LyapunovSweep",
    "ManifoldSide",
    "MotionMap",
    "MotionSearch",
    "NoMotionError",
    "NotFound",
    "OneSided",
    "ParameterError",
    "PeriodReport",
    "PeriodicMotion",
    "PeriodicMotions",
    "Proof",
    "ProofBox",
    "ProofError",
    "ProvedBifurcation",
    "ProvedStretch",
    "Record",
    "Regime",
    "RestitutionPowerLaw",
    "RestitutionTable",
    "Run",
    "RunInSI",
    "Scales",
    "Sensitivity",
    "SimulationError",
    "SolutionsProof",
    "StabilityRegion",
    "StateError",
    "Stop",
    "Structure",
    "StructureDiagram",
    "StructureEnergyAudit",
    "StructureOrbit",
    "StructureRun",
    "StructureSpectrum",
    "StructureState",
    "Sweep",
    "System",
    "Table",
    "Undecided",
    "Unproved",
    "UnstableManifold",
    "Verification",
    "__version__",
    "basins",
    "bifurcation_curve",
    "bifurcation_diagram",
    "chart",
    "check_proof",
    "expected_errors",
    "explore",
    "fit",
    "follow_motion",
    "gradient",
    "impact",
    "impact_agreement",
    "impact_regimes",
    "load",
    "lyapunov_spectrum",
    "measure",
    "motion_map",
    "nonsmooth_mode",
    "periodic_motion",
    "periodic_motions",
    "plot",
    "prove",
    "search_motions",
    "simulate",
    "stability_region",
    "sweep",
    "switch_branch",
    "unstable_manifold",
    "verify",
]
