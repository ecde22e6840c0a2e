"""Structures of tests/data for the reference simulator, and other structures of its tests."""

from __future__ import annotations

import json
from fractions import Fraction
from typing import Any

from vibroimpact.reference.flight import Number, System
from vibroimpact.reference.structure import Structure

from .generate import DATA

Row = dict[str, Any]


def scenes(name: str) -> list[Row]:
    """The scenes of a data file."""
    found: list[Row] = json.loads((DATA / name).read_text())
    return found


def structure(scene: Row, **changes: Any) -> Structure:
    """The structure of a scene; in structures_contact.json a stop acts on one coordinate."""
    size = len(scene["mass"])
    stops = [
        stop
        if "normal" in stop
        else {
            "normal": [stop["normal_sign"] * (i == stop["coordinate"]) for i in range(size)],
            "gap": stop["gap"],
            "restitution": stop["restitution"],
        }
        for stop in scene["stops"]
    ]
    return Structure.parse(scene | {"static_load": scene["load"], "stops": stops} | changes)


def head_on(values: dict[str, Number]) -> Structure:
    """The structure of two coordinates that is the pair of bodies in direct contact."""
    system = System.parse(values, "direct")

    def plain(value: Any) -> Fraction:
        return Fraction(int(value.p), int(value.q))

    inverse = 1 / plain(system.mbar)
    omega0, zeta1, zeta2 = map(plain, (system.omega0, system.zeta1, system.zeta2))
    return Structure.parse(
        {
            "mass": [[1, 0], [0, inverse]],
            "stiffness": [[omega0**2, 0], [0, inverse]],
            "damping": [[2 * zeta1 * omega0, 0], [0, 2 * zeta2 * inverse]],
            "static_load": [plain(system.c1), plain(system.c2) * inverse],
            "drive_amplitude": [plain(system.f1), plain(system.f2) * inverse],
            "drive_frequency": plain(system.omega),
            "stops": [
                {"normal": [1, -1], "gap": plain(system.delta), "restitution": plain(system.r)}
            ],
        }
    )


def row_of_balls(count: int, **changes: Any) -> Structure:
    """Free balls of mass 1 in a row that touch, or as `gap` says: Newton's cradle."""
    gap = changes.pop("gap", 0)
    mass = [[int(i == j) for j in range(count)] for i in range(count)]
    stops = [
        {
            "normal": [int(i == j) - int(i == j + 1) for i in range(count)],
            "gap": gap,
            "restitution": 1,
        }
        for j in range(count - 1)
    ]
    nothing = [[0] * count for _ in range(count)]
    return Structure.parse({"mass": mass, "stiffness": nothing, "stops": stops} | changes)
