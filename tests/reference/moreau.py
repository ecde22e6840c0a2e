"""Moreau's time stepping for structures with plastic stops: a coarse peer of the reference.

One step of length h solves the impulses of all active stops at once, with the velocity at its end
implicit (theta = 1/2): first order in h, and nothing in common with flows and events. The law of
friction is that at the end of an impact, which is Routh's unless slip reverses within it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


def final_state(values: dict[str, Any], time: float, steps: int) -> Vector:
    """Coordinates and velocities at `time`, from rest at 0."""
    mass, stiffness, damping = (np.array(values[k]) for k in ("mass", "stiffness", "damping"))
    load, drive = np.array(values["static_load"]), np.array(values["drive_amplitude"])
    omega, phase, h = values["drive_frequency"], values["phase"], time / steps
    inverse = np.linalg.inv(mass + h / 2 * damping + h * h / 4 * stiffness)
    q, v = np.zeros(len(mass)), np.zeros(len(mass))
    stops = [
        (s, np.array(s["normal"]), np.array(s.get("tangent", s["normal"]))) for s in values["stops"]
    ]
    for step in range(steps):
        middle = (step + 0.5) * h
        force = load + drive * np.cos(omega * middle + phase)
        force = force - damping @ v - stiffness @ (q + h / 2 * v)
        after = v + h * (inverse @ force)
        ahead = q + h / 2 * v
        active = [
            (s, n, t)
            for s, n, t in stops
            if n @ ahead - s["gap"] - s["amplitude"] * np.cos(omega * middle + s["phase"]) >= 0
        ]
        pressed, rubbed = [0.0] * len(active), [0.0] * len(active)
        for _ in range(60 if active else 0):
            before = after
            for k, (s, n, t) in enumerate(active):
                wall = -s["amplitude"] * omega * np.sin(omega * (middle + h / 2) + s["phase"])
                push = max(0.0, pressed[k] + (n @ after - wall) / (n @ inverse @ n))
                after = after - inverse @ n * (push - pressed[k])
                pressed[k] = push
                most = s.get("friction", 0.0) * push
                rub = np.clip(rubbed[k] - (t @ after) / (t @ inverse @ t), -most, most)
                after = after + inverse @ t * (rub - rubbed[k])
                rubbed[k] = float(rub)
            if np.abs(after - before).max() < 1e-14:
                break
        q, v = q + h / 2 * (v + after), after
    return np.concatenate((q, v))
