"""Writes the reference data of periodic motions: tests/data/orbits_reference.json.

    python -m reference.regenerate orbits_reference.json --write     (in tests)

Motions: orbit_scenes.py; how they are computed: orbits.py. Each is computed twice, at 400 and 544
bits with other tolerances and steps of the differences, and the differences are its stated errors.
Inputs are float64, written so that reading the decimal gives the same bits; the reference values
belong to exactly those floats. Quantities are dimensionless. An object of motions by name:

params, contact, law, phase: as in contact_reference.json, and the impact law
m, n            drive periods and impacts of one orbit; n is "inf" with chatter
stroboscopic    m states (x1, v1, x2, v2), at t = 0, T, ..., (m - 1) T; T = 2 pi/omega
events          of one orbit, 0 < t < m T, in order: `event` (as in contact_reference.json, or
                impact), `regime` (null but for impacts), `t`, `pre` and `post`: the states just
                before and after. Of a complete chatter only the impacts with an approach velocity
                of at least 1e-3 are listed, and its accumulation point (event chatter)
multipliers     [real, imaginary] of the Floquet multipliers, largest modulus first, of a conjugate
                pair the one with imaginary part > 0 first. "0" means exactly 0: a part of the orbit
                slides or sticks, or an impact sticks. Of a wall at rest (mbar = f2 = 0) only body
                1's two are given
product         their product, from the determinant of the differences
volume          the product by the determinant identities of docs/theory.md, section 7; null with
                contact. The multipliers are computed without it
stable          whether all multipliers lie inside the unit circle
error           stated error of states, times and events
multiplier_error    stated error of the multipliers and their product
"""

from __future__ import annotations

from typing import Any

from flint import arb, ctx

from vibroimpact.reference.hybrid import FINER

from .ladder import digits
from .orbit_scenes import OrbitScene
from .orbits import Orbit, difference

NAME = "orbits_reference.json"
#: A stated error of more than this is no reference.
LARGEST_ERROR = 1e-28
LARGEST_MULTIPLIER_ERROR = 1e-20


def text(value: arb) -> str:
    """25 digits of a point."""
    return "0" if value.is_zero() else digits(value)


def row(state: tuple[arb, ...]) -> list[str]:
    """A state."""
    return [text(value.mid()) for value in state]


def scene_record(scene: OrbitScene) -> dict[str, Any]:
    """One motion of the file."""
    coarse, orbit = scene.find(finer=False), scene.find(finer=True)
    with ctx.workprec(FINER.precision):
        error, multiplier_error = difference(coarse, orbit)
        check(scene, orbit, error, multiplier_error)
        return {
            "params": {name: repr(value) for name, value in scene.parameters().items()},
            "contact": scene.contact,
            "law": scene.law,
            "phase": repr(scene.phase),
            "m": scene.m,
            "n": "inf" if orbit.impacts is None else orbit.impacts,
            "stroboscopic": [row(state) for state in orbit.states],
            "events": [
                {
                    "event": moment.event,
                    "regime": moment.regime,
                    "t": text(moment.time.mid()),
                    "pre": row(moment.pre),
                    "post": row(moment.post),
                }
                for moment in orbit.moments
            ],
            "multipliers": [[text(root.real), text(root.imag)] for root in orbit.multipliers],
            "product": text(orbit.product),
            "volume": None if orbit.volume is None else text(orbit.volume),
            "stable": bool(abs(orbit.multipliers[0]) < 1),
            "error": f"{error:.1e}",
            "multiplier_error": f"{multiplier_error:.1e}",
        }


def check(scene: OrbitScene, orbit: Orbit, error: float, multiplier_error: float) -> None:
    """Raise ArithmeticError if a motion is not the expected one, or not known well enough."""
    if not (error < LARGEST_ERROR and multiplier_error < LARGEST_MULTIPLIER_ERROR):
        raise ArithmeticError(f"errors {error}, {multiplier_error}: {scene}")
    if orbit.impacts != scene.n:
        raise ArithmeticError(f"{orbit.impacts} impacts: {scene}")
    lost = sum(1 for root in orbit.multipliers if root.is_zero())
    if lost != dimensions_lost(orbit):
        raise ArithmeticError(f"{lost} multipliers are 0: {scene}")
    if orbit.volume is not None and not abs(orbit.product - orbit.volume) < 1e-30:
        raise ArithmeticError(f"product {orbit.product}, volume {orbit.volume}: {scene}")


def dimensions_lost(orbit: Orbit) -> int:
    """How many multipliers must be 0: a stick keeps x1 only, a slide x1 and v1."""
    events = {moment.event for moment in orbit.moments}
    if "stick" in events:
        return len(orbit.multipliers) - 1
    if events - {"impact"}:
        return len(orbit.multipliers) - 2
    return int(any((moment.regime or "").startswith("stick") for moment in orbit.moments))
