"""The ends of numbers of machines beyond which there is no machine."""

import math

_NOT_NEGATIVE = (
    "mass_ratio",
    "frequency_ratio",
    "drive_frequency",
    "pendulum_damping",
    "oscillator_damping",
    "friction",
)

NATURAL = {**dict.fromkeys(_NOT_NEGATIVE, (0.0, math.inf)), "restitution": (0.0, 1.0)}
"""Ranges of those that have ends, by name."""
