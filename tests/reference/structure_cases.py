"""Structures of tests/data/structures_reference.json: what the supplied data do not have.

Damping that couples the modes, free bodies on a damper, sets of closed stops, complete chatter,
stops that move, slip and stick, several stops at one instant under the three rules, more laws.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import Any

Values = dict[str, Any]


@dataclass(frozen=True)
class Case:
    """A structure by the names of `Structure.parse`, in floats, with its start and length."""

    values: Values
    initial: tuple[list[float], list[float]]
    periods: int | None = None
    times: tuple[float, ...] = ()
    #: Coordinates that perturbations of the start move: those of bodies that touch no stop.
    moves: tuple[int, ...] | None = None


def _diagonal(entries: list[float]) -> list[list[float]]:
    return [[x if i == j else 0.0 for j in range(len(entries))] for i, x in enumerate(entries)]


def _chain(count: int, coupling: float = 1.0, ground: float = 0.5) -> list[list[float]]:
    """Stiffness of masses in a row, each on a spring of its own too."""
    rows = _diagonal([ground + 2.0 * coupling] * count)
    for i in range(count - 1):
        rows[i][i + 1] = rows[i + 1][i] = -coupling
    return rows


def _stop(normal: list[float], gap: float, restitution: float, **more: Any) -> Values:
    return {"normal": normal, "gap": gap, "restitution": restitution, **more}


def _unit(count: int, i: int, sign: float = 1.0) -> list[float]:
    return [sign * float(i == j) for j in range(count)]


_TWO: Values = {
    "mass": _diagonal([1.0, 2.0]),
    "stiffness": [[2.0, -1.0], [-1.0, 1.0]],
    "drive_amplitude": [[1.0, 0.0], [0.0, 0.75]],
    "drive_frequency": 1.25,
    "phase": 0.5,
}
_COUPLED = [[0.3, -0.1], [-0.1, 0.05]]


def _balls(count: int, restitution: float, **more: Any) -> Values:
    return {
        "mass": _diagonal([1.0] * count),
        "stiffness": _diagonal([0.0] * count),
        "stops": [
            _stop([float(i == j) - float(i == j + 1) for i in range(count)], 0.0, restitution)
            for j in range(count - 1)
        ],
        **more,
    }


def _many() -> Case:
    """Six masses, each with a stop of its own, some of them moving."""
    draw, count = random.Random(7), 6
    stops = [
        _stop(
            _unit(count, i, draw.choice([-1.0, 1.0])),
            round(draw.uniform(0.1, 0.4), 3),
            round(draw.uniform(0.3, 0.9), 3),
            amplitude=round(draw.uniform(0.0, 0.1), 3) * draw.randrange(2),
            phase=round(draw.uniform(0.0, 6.0), 3),
        )
        for i in range(count)
    ]
    values = {
        "mass": _diagonal([round(draw.uniform(0.5, 2.0), 3) for _ in range(count)]),
        "stiffness": _chain(count),
        "damping_ratios": [0.03] * count,
        "drive_amplitude": [[round(draw.uniform(-1.0, 1.0), 3), 0.0] for _ in range(count)],
        "drive_frequency": 1.1,
        "stops": stops,
    }
    return Case(values, ([0.0] * count, [0.0] * count), periods=3)


_WALLS = [_stop([1.0, 0.0], 0.25, 0.4), _stop([0.0, -1.0], 0.5, 0.3)]
_RUBS = {"friction": 0.4, "tangent": [0.0, 1.0]}
_TABLE: Values = {
    "mass": _diagonal([1.0, 1.0]),
    "stiffness": _diagonal([0.0, 0.25]),
    "static_load": [1.0, 0.0],
    "drive_frequency": 0.8,
}
_REST = ([-0.5, 0.0], [0.0, 0.0])

CASES: dict[str, Case] = {
    "coupled_damping": Case(
        _TWO
        | {
            "damping": _COUPLED,
            "stops": [_stop([1.0, -1.0], 0.2, 0.7), _stop([0.0, 1.0], 0.5, 0.8)],
        },
        ([0.0, 0.0], [0.0, 0.0]),
        periods=6,
    ),
    "free_body_on_a_damper": Case(
        _TWO
        | {
            "stiffness": _diagonal([2.0, 0.0]),
            "damping": _diagonal([0.1, 0.4]),
            "stops": [_stop([1.0, -1.0], 0.3, 0.6), _stop([-1.0, 1.0], 0.3, 0.6)],
        },
        ([0.0, 0.125], [0.25, 0.0]),
        periods=6,
    ),
    "chatter_and_contact": Case(
        _TWO
        | {
            "damping": _COUPLED,
            "drive_frequency": 0.6,
            "static_load": [0.75, -0.5],
            "stops": _WALLS,
        },
        ([0.0, 0.0], [0.0, 0.0]),
        periods=4,
    ),
    "chatter_on_a_moving_stop": Case(
        {
            "mass": [[1.0]],
            "stiffness": [[0.25]],
            "damping_ratios": [0.05],
            "static_load": [0.8],
            "drive_frequency": 1.0,
            "stops": [_stop([1.0], 0.1, 0.35, amplitude=0.25, phase=1.0)],
        },
        ([-0.75], [0.0]),
        periods=5,
    ),
    "two_closed_stops": Case(
        {
            "mass": _diagonal([1.0, 0.5, 2.0]),
            "stiffness": _chain(3),
            "damping_ratios": [0.02, 0.05, 0.01],
            "drive_amplitude": [[1.5, 0.0], [0.5, 1.0], [-1.0, 0.5]],
            "drive_frequency": 0.7,
            "stops": [
                _stop([1.0, 0.0, 0.0], 0.2, 0.0),
                _stop([0.0, 0.0, -1.0], 0.15, 0.0),
                _stop([0.0, 1.0, 0.0], 0.6, 0.5),
            ],
            "simultaneous": "sequence",
        },
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        periods=3,
    ),
    "corner_together": Case(
        {
            "mass": _diagonal([1.0, 1.0]),
            "stiffness": _diagonal([1.0, 1.0]),
            "static_load": [1.5, 0.75],
            "drive_amplitude": [[0.5, 0.0], [0.0, 1.0]],
            "drive_frequency": 0.6,
            "stops": [_stop([1.0, 0.0], 0.25, 0.0), _stop([0.6, 0.8], 0.5, 0.0)],
            "simultaneous": "together",
        },
        ([-0.5, -0.25], [0.0, 0.0]),
        periods=3,
    ),
    "cradle_sequence": Case(
        _balls(4, 1.0, simultaneous="sequence"),
        ([-0.5, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]),
        times=(0.25, 1.0, 2.0),
        moves=(0,),
    ),
    "cradle_together": Case(
        _balls(4, 1.0, simultaneous="together"),
        ([-0.5, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]),
        times=(0.25, 1.0, 2.0),
        moves=(0,),
    ),
    "lossy_cradle_together": Case(
        _balls(3, 0.5, simultaneous="together"),
        ([-0.5, 0.0, 0.0], [1.0, 0.0, 0.0]),
        times=(0.25, 1.0, 2.0),
        moves=(0,),
    ),
    "cradle_stops": Case(
        _balls(3, 1.0),
        ([-0.5, 0.0, 0.0], [1.0, 0.0, 0.0]),
        times=(0.25, 1.0),
        moves=(0,),
    ),
    "slide_and_stick": Case(
        _TABLE
        | {
            "drive_amplitude": [[0.0, 0.0], [0.6, 0.0]],
            "stops": [_stop([1.0, 0.0], 0.0, 0.0, **_RUBS)],
        },
        _REST,
        periods=4,
    ),
    "chatter_with_friction": Case(
        _TABLE
        | {
            "drive_amplitude": [[1.0625, 0.0], [0.5, 0.25]],
            "stops": [_stop([1.0, 0.0], 0.0, 0.2, **_RUBS)],
        },
        _REST,
        periods=2,
    ),
    **{
        f"friction_{law}": Case(
            _TWO
            | {
                "mass": [[1.0, 0.25], [0.25, 1.5]],
                "damping": _COUPLED,
                "law": law,
                "stops": [_stop([1.0, 0.0], 0.2, 0.6, friction=0.5, tangent=[0.25, 1.0])],
            },
            ([0.0, 0.0], [0.0, 0.0]),
            periods=6,
        )
        for law in ("poisson", "newton", "energetic")
    },
    "six_masses": _many(),
}
