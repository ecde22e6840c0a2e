"""Figures of runs and diagrams: every function takes ``ax=None``, returns the axes, shows nothing.

The functions draw what a result (`Run`, `Diagram`, `ImpactRegimes` ...) holds and compute no
dynamics.
"""

from .basins import BASIN_COLORS, basin_handles, basins
from .branches import bifurcation_curves, branch_handles, branches
from .diagram import bifurcation, chatter_handles, contact_fraction
from .force import contact_force
from .impacts import impact_agreement, impact_regimes
from .manifold import manifold
from .motion import (
    displacement_history,
    gap_history,
    impact_count,
    impact_section,
    phase_portrait,
    time_history,
)
from .multipliers import CROSSINGS, multipliers
from .orbit import orbit
from .solutions import (
    motion_branches,
    motion_handles,
    motion_space,
    stability_handles,
    stability_map,
)
from .style import (
    BIFURCATION_STYLES,
    PUBLICATION,
    REGIME_STYLES,
    bifurcation_handles,
    publication_style,
    regime_handles,
)

__all__ = [
    "BASIN_COLORS",
    "BIFURCATION_STYLES",
    "CROSSINGS",
    "PUBLICATION",
    "REGIME_STYLES",
    "basin_handles",
    "basins",
    "bifurcation",
    "bifurcation_curves",
    "bifurcation_handles",
    "branch_handles",
    "branches",
    "chatter_handles",
    "contact_force",
    "contact_fraction",
    "displacement_history",
    "gap_history",
    "impact_agreement",
    "impact_count",
    "impact_regimes",
    "impact_section",
    "manifold",
    "motion_branches",
    "motion_handles",
    "motion_space",
    "multipliers",
    "orbit",
    "phase_portrait",
    "publication_style",
    "regime_handles",
    "stability_handles",
    "stability_map",
    "time_history",
]
