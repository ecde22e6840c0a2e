"""A structure of two masses with two stops, and a beam of two modes."""

from typing import Any

import vibroimpact as vi

MASS = [[2.0, 0.5], [0.5, 1.0]]
STIFFNESS = [[3.0, -1.0], [-1.0, 2.0]]
STOPS = [
    vi.Stop([0, 1], 0.3, 0.8),
    vi.Stop([1, -1], 0.1, 0.5, friction=0.2, tangent=[1, 1], amplitude=0.05, phase=0.4),
]


def structure(**changes: Any) -> vi.Structure:
    """Return the two masses, with some arguments changed."""
    fields = {
        "mass": MASS,
        "stiffness": STIFFNESS,
        "stops": STOPS,
        "damping_ratios": [0.01, 0.02],
        "drive_amplitude": [1, 1j],
        "drive_frequency": 1.2,
    }
    return vi.Structure(**fields | changes)


def beam(**changes: Any) -> vi.Structure:
    """Return two modes at three points, with some arguments changed."""
    fields = {
        "frequencies": [1.0, 3.0],
        "shapes": [[1.0, 1.0], [0.5, -1.0], [0.25, 2.0]],
        "stops": [vi.Stop([0, 0, 1], 0.3, 0.8)],
    }
    return vi.Structure.from_modes(**fields | changes)
