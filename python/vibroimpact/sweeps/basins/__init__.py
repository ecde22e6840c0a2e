"""Basins of attraction over a plane of initial states (basins page)."""

from .arrivals import basins
from .attractors import Attractor
from .measures import BasinEntropy, UncertaintyExponent, basin_entropy, uncertainty_exponent
from .results import Basins, BasinSettings

__all__ = [
    "Attractor",
    "BasinEntropy",
    "BasinSettings",
    "Basins",
    "UncertaintyExponent",
    "basin_entropy",
    "basins",
    "uncertainty_exponent",
]
