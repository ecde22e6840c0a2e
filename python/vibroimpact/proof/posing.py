"""From a motion to the problem of a certificate: exact numbers, legs, and nodes."""

from __future__ import annotations

from typing import Any

import numpy as np
from flint import arb, arb_mat
from numpy.typing import NDArray

from .._core import LegKind, Regime
from ..orbits.motion import PeriodicMotion
from ..restitution import RestitutionCurve
from ..structure import Structure
from ..structure_motion import StructureOrbit
from ..system import SYMBOLS, System
from ..verification.structure_motion import exact_structure
from .certificate import machine_in
from .files import text
from .formulas import dot
from .verifier import CIRCUIT, Orbit

AnyMotion = PeriodicMotion | StructureOrbit


def machine_in_text(motion: AnyMotion) -> dict[str, Any]:
    """The machine of a motion, as certificates write it."""
    if isinstance(motion, PeriodicMotion):
        return two_bodies_in_text(motion.system, rests=motion.wall_at_rest)
    return _structure(motion.system)


def two_bodies_in_text(system: System, *, rests: bool) -> dict[str, Any]:
    """The two bodies, as certificates write them."""
    return {
        "kind": "two bodies",
        "contact": system.contact,
        "law": system.law,
        "wall_rests": bool(rests),
        "numbers": {symbol: text(getattr(system, name)) for symbol, name in SYMBOLS.items()},
    }


def _structure(given: Structure) -> dict[str, Any]:
    known = exact_structure(given)
    none = ["0p0"] * known.size
    damping: dict[str, Any]
    if known.damping is not None:
        damping = {"damping": _rows(known.damping)}
    else:
        damping = {"damping_ratios": [text(x) for x in known.ratios] if known.ratios else none}
    numbers = ("gap", "restitution", "friction", "amplitude", "phase")
    return {
        "kind": "structure",
        "law": known.law,
        "mass": _rows(known.mass),
        "stiffness": _rows(known.stiffness),
        **damping,
        "static_load": [text(x) for x in known.load],
        "drive_amplitude": [[text(real), text(imag)] for real, imag in known.drive],
        "drive_frequency": text(known.omega),
        "phase": text(known.phase),
        "stops": [
            {
                "normal": _rows(stop.normal)[0],
                "tangent": none if stop.tangent is None else _rows(stop.tangent)[0],
                **{name: text(getattr(stop, name)) for name in numbers},
            }
            for stop in known.stops
        ],
    }


def _rows(matrix: Any) -> list[list[str]]:
    return [[text(x) for x in row] for row in matrix.tolist()]


def legs_of(motion: AnyMotion, *, free: bool = False) -> list[list[Any]] | str:
    """The legs as certificates write them, or why there is no proof of such a motion.

    `free`: whether one without impacts will do.
    """
    if motion.system.law == "paper":
        return "the law of the paper is not proved with"
    system = motion.system
    struck = system.stops if isinstance(system, Structure) else (system,)
    if any(isinstance(each.restitution, RestitutionCurve) for each in struck):
        return "a restitution that depends on the approach velocity is not proved with"
    if not motion.legs:
        return "stops stay closed for a while: sustained contact is not proved"
    legs = []
    for leg in motion.legs:
        if leg.kind is LegKind.CIRCUIT:
            return [list(CIRCUIT)] if free else "a motion without impacts is not proved"
        if leg.kind is LegKind.CHATTER:
            return "complete chatter is not proved"
        if leg.regime is None:
            return "sustained contact is not proved"
        legs.append([getattr(leg, "stop", 0), Regime(leg.regime).name.lower()])
    return _directed(motion, legs)


def _directed(motion: AnyMotion, legs: list[list[Any]]) -> list[list[Any]]:
    """Legs whose regimes tell the direction of slip before the impact."""
    if all(regime == "frictionless" for _, regime in legs):
        return legs
    machine, z = machine_in(machine_in_text(motion)), [arb(x) for x in nodes_of(motion).ravel()]
    orbit = Orbit(machine, motion.m, tuple((stop, regime) for stop, regime in legs))
    n, told = machine.size, []
    for k, (place, regime) in enumerate(legs):
        begin, _, lasts = orbit.times(k, z)
        start = [*z[k * (2 * n + 1) :][: 2 * n], *machine.drive(begin)]
        w = (machine.flow(lasts) * arb_mat(len(start), 1, start)).entries()
        stop = machine.stops[place]
        slip = w[0].sin() * w[n] if stop.tip else dot(stop.tangent, w[n : 2 * n])
        way = "-" if slip.mid() < 0 else "+"
        told.append([place, regime if regime == "frictionless" else f"{regime} {way}"])
    return told


def nodes_of(motion: AnyMotion) -> NDArray[np.float64]:
    """The nodes as certificates have them, (legs, 2N + 1): q, v, and t from 0 to m T."""
    system, nodes = motion.system, np.array(motion.nodes)
    if motion.legs[0].kind is LegKind.CIRCUIT:  # its state at t = 0
        if isinstance(motion, PeriodicMotion):  # x1, v1, v2, x2
            nodes = nodes[:, [0, 1] if motion.wall_at_rest else [0, 3, 1, 2]]
        return np.column_stack([nodes, np.zeros(1)])
    times = nodes[:, -1] + np.array(motion.clocks) * system.drive_period
    if not isinstance(motion, PeriodicMotion):
        return np.column_stack([nodes[:, :-1], times])
    x1, v1, v2 = nodes[:, :3].T
    if motion.wall_at_rest:
        return np.column_stack([x1, v1, times])
    tip = np.sin(x1) if motion.system.contact == "oblique" else x1
    return np.column_stack([x1, tip - motion.system.gap, v1, v2, times])
