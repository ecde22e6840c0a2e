"""Writes the reference data of chatter and sustained contact: tests/data/contact_reference.json.

    python -m reference.regenerate contact_reference.json --write     (in tests)

Inputs are float64, written so that reading the decimal gives the same bits; the reference values
belong to exactly those floats. Format: tests/data/README.md. Scenes: scenes.py. Quantities are
dimensionless.
"""

from __future__ import annotations

from typing import Any

from flint import arb, ctx

from vibroimpact.reference.hold import Phase
from vibroimpact.reference.hybrid import FINER

from .ladder import digits
from .scenes import Scene

NAME = "contact_reference.json"
#: A stated error of more than this, or more growth, is no reference.
LARGEST_ERROR = 1e-28
LARGEST_GROWTH = 1e6


def text(value: arb | None) -> str | None:
    """25 digits; 0 for what cannot be told from it."""
    if value is None:
        return None
    return "0" if value.contains(0) else digits(value)


def phase_record(phase: Phase, growth: float) -> dict[str, Any]:
    """One phase of the file."""
    names = ("x1", "v1", "x2", "v2")
    return {
        "event": phase.event,
        "t": text(phase.time),
        **{name: text(value) for name, value in zip(names, phase.state, strict=True)},
        "normal_force": text(phase.normal),
        "friction_force": text(phase.friction),
        "amplification": growth,
    }


def scene_record(scene: Scene) -> dict[str, Any]:
    """One scene of the file."""
    found = scene.measured()
    growth = max([0.0, *found.phase_growth, *found.sample_growth])
    if not found.error < LARGEST_ERROR or growth > LARGEST_GROWTH:
        raise ArithmeticError(f"error {found.error}, amplification {growth}: {scene}")
    with ctx.workprec(FINER.precision):
        phases = zip(found.run.phases, found.phase_growth, strict=True)
        return {
            "params": {name: repr(value) for name, value in scene.parameters().items()},
            "contact": scene.contact,
            "initial": [repr(value) for value in scene.initial],
            "phase": repr(scene.phase),
            "periods": None if scene.times else scene.periods,
            "times": [repr(t) for t in scene.times],
            "ending": found.run.ending,
            "error": f"{float(found.error):.1e}",
            "phases": [phase_record(phase, factor) for phase, factor in phases],
            "stroboscopic": [[text(value) for value in state] for state in found.run.samples],
            "amplification": found.sample_growth,
        }
