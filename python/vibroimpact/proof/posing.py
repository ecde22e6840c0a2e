"""From a motion to the problem of a certificate: exact numbers, legs, and nodes."""

from __future__ import annotations

from typing import Any

import numpy as np
from flint import arb, fmpq
from numpy.typing import NDArray

from .._core import LegKind, Regime
from ..orbits.motion import PeriodicMotion
from ..reference.flight import exact as exact_number
from ..structure_motion import StructureOrbit
from ..system import SYMBOLS, System
from ..verification.structure_motion import exact_structure

AnyMotion = PeriodicMotion | StructureOrbit


def text(value: arb | fmpq | float) -> str:
    """An exact number as certificates write it: a double, a dyadic fraction, a ball's midpoint."""
    if isinstance(value, arb):
        mantissa, exponent = value.mid().man_exp()
        return f"{int(mantissa)}p{int(exponent)}"
    fraction = exact_number(value)
    return f"{int(fraction.p)}p-{int(fraction.q).bit_length() - 1}"


def machine_of(motion: AnyMotion) -> dict[str, Any]:
    """The machine of a motion, as certificates write it."""
    system = motion.system
    if isinstance(motion, PeriodicMotion):
        numbers = {symbol: text(getattr(system, name)) for symbol, name in SYMBOLS.items()}
        return {
            "kind": "two bodies",
            "contact": system.contact,
            "law": system.law,
            "wall_rests": bool(motion.wall_at_rest),
            "numbers": numbers,
        }
    known = exact_structure(system)
    none = ["0p0"] * known.size

    def rows(matrix: Any) -> list[list[str]]:
        return [[text(x) for x in row] for row in matrix.tolist()]

    damping = (
        {"damping": rows(known.damping)}
        if known.damping is not None
        else {"damping_ratios": [text(x) for x in known.ratios] if known.ratios else none}
    )
    return {
        "kind": "structure",
        "law": known.law,
        "mass": rows(known.mass),
        "stiffness": rows(known.stiffness),
        **damping,
        "static_load": [text(x) for x in known.load],
        "drive_amplitude": [[text(real), text(imag)] for real, imag in known.drive],
        "drive_frequency": text(known.omega),
        "phase": text(known.phase),
        "stops": [
            {
                "normal": rows(stop.normal)[0],
                "tangent": none if stop.tangent is None else rows(stop.tangent)[0],
                **{
                    name: text(getattr(stop, name))
                    for name in ("gap", "restitution", "friction", "amplitude", "phase")
                },
            }
            for stop in known.stops
        ],
    }


def legs_of(motion: AnyMotion) -> list[list[Any]] | str:
    """The legs as certificates write them, or why there is no proof of such a motion."""
    if not motion.legs:
        return "stops stay closed for a while: sustained contact is not proved"
    legs = []
    for leg in motion.legs:
        if leg.kind is LegKind.CIRCUIT:
            return "a motion without impacts is not proved"
        if leg.kind is LegKind.CHATTER:
            return "complete chatter is not proved"
        if leg.regime is None:
            return "sustained contact is not proved"
        legs.append([getattr(leg, "stop", 0), Regime(leg.regime).name.lower()])
    return legs


def nodes_of(motion: AnyMotion) -> NDArray[np.float64]:
    """The nodes as certificates have them, (legs, 2N + 1): q, v, and t from 0 to m T."""
    system, nodes = motion.system, np.array(motion.nodes)
    times = nodes[:, -1] + np.array(motion.clocks) * system.drive_period
    if not isinstance(system, System):
        return np.column_stack([nodes[:, :-1], times])
    x1, v1, v2 = nodes[:, :3].T
    if motion.wall_at_rest:
        return np.column_stack([x1, v1, times])
    tip = np.sin(x1) if system.contact == "oblique" else x1
    return np.column_stack([x1, tip - system.gap, v1, v2, times])
