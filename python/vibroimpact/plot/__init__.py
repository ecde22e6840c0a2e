"""Figures of runs and diagrams: every function takes ``ax=None``, returns the axes, shows nothing.

The functions draw what a result (`Run`, `Diagram`, `ImpactRegimes` ...) holds and compute no
dynamics.
"""

from .diagram import bifurcation, chatter_handles, contact_fraction
from .force import contact_force
from .impacts import impact_agreement, impact_regimes
from .motion import (
    displacement_history,
    gap_history,
    impact_count,
    impact_section,
    phase_portrait,
    time_history,
)
from .style import (
    PUBLICATION,
    REGIME_STYLES,
    publication_style,
    regime_handles,
)

__all__ = [
    "PUBLICATION",
    "REGIME_STYLES",
    "bifurcation",
    "chatter_handles",
    "contact_force",
    "contact_fraction",
    "displacement_history",
    "gap_history",
    "impact_agreement",
    "impact_count",
    "impact_regimes",
    "impact_section",
    "phase_portrait",
    "publication_style",
    "regime_handles",
    "time_history",
]
