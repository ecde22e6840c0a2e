"""Figures of runs and diagrams: every function takes ``ax=None``, returns the axes, shows nothing.

The functions draw what a result (`Run`, `Diagram`, `ImpactRegimes` ...) holds and compute no
dynamics.
"""

from typing import Any

from ..hints import meant_in_package
from .animation import animation
from .attractors import attractor, motion_search
from .axis_names import PARAMETER_SYMBOLS
from .basins import BASIN_COLORS, basin_handles, basins
from .bounces import bounces
from .branches import bifurcation_curves, branch_handles, branches, curve_handles
from .chart import chart, chart_handles
from .diagram import bifurcation, chatter_handles, contact_fraction, no_impact_handles
from .film import Animation
from .final_states import final_states
from .fit import fit
from .force import contact_force
from .impacts import impact_agreement, impact_regimes
from .labels import LABEL_STYLES, label_handles
from .lyapunov import lyapunov
from .machine import machine
from .manifold import manifold
from .motion import displacement_history, gap_history, phase_portrait, time_history
from .multipliers import CROSSINGS, multipliers
from .orbit import orbit
from .sections import impact_count, impact_section, stroboscopic
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
    label_text,
    publication_style,
    regime_handles,
)
from .verification import verification


def __getattr__(name: str) -> Any:
    """Refuse a name that is not here; the error says which was meant."""
    hint = "" if name[:1] == "_" else meant_in_package(name, __all__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}{hint}")


__all__ = [
    "BASIN_COLORS",
    "BIFURCATION_STYLES",
    "CROSSINGS",
    "LABEL_STYLES",
    "PARAMETER_SYMBOLS",
    "PUBLICATION",
    "REGIME_STYLES",
    "Animation",
    "animation",
    "attractor",
    "basin_handles",
    "basins",
    "bifurcation",
    "bifurcation_curves",
    "bifurcation_handles",
    "bounces",
    "branch_handles",
    "branches",
    "chart",
    "chart_handles",
    "chatter_handles",
    "contact_force",
    "contact_fraction",
    "curve_handles",
    "displacement_history",
    "final_states",
    "fit",
    "gap_history",
    "impact_agreement",
    "impact_count",
    "impact_regimes",
    "impact_section",
    "label_handles",
    "label_text",
    "lyapunov",
    "machine",
    "manifold",
    "motion_branches",
    "motion_handles",
    "motion_search",
    "motion_space",
    "multipliers",
    "no_impact_handles",
    "orbit",
    "phase_portrait",
    "publication_style",
    "regime_handles",
    "stability_handles",
    "stability_map",
    "stroboscopic",
    "time_history",
    "verification",
]
